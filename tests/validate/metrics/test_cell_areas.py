"""Areas of a region by cells, against the boolean intersection with each cell."""

import numpy as np
import pytest
from manifold3d import CrossSection

from validate.metrics.cavity import cell_areas


@pytest.mark.parametrize("kind", ["ring", "sliver", "on the borders", "nothing"])
def test_each_cell_has_the_area_of_the_region_in_it(kind):
    """1e-6 is the resolution at which the library joins corners of regions of this size, times the cell's side."""
    disc = CrossSection.circle(3.3, 40).translate((4.1, 3.9))
    region = {
        "ring": disc - CrossSection.square((1.3, 2.001)).translate((3.5, 3.0)),
        "sliver": CrossSection.square((6.0, 1e-4)).rotate(20.0).translate((1.3, 1.2)),
        "on the borders": CrossSection.square((6.0, 4.0)).translate((1.0, 2.0)),
        "nothing": CrossSection(),
    }[kind]
    areas = cell_areas(map(np.asarray, region.to_polygons()), (8, 9))
    cells = [[(CrossSection.square((1, 1)).translate((x, y)) ^ region).area() for x in range(9)] for y in range(8)]
    assert areas == pytest.approx(np.array(cells), abs=1e-6)
    assert areas.sum() == pytest.approx(region.area(), rel=1e-9)
