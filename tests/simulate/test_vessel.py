"""The columns that a bed is measured in."""

import numpy as np
import pytest

from simulate.vessel import Vessel
from tests.support.small_fluids import slot


@pytest.mark.parametrize("cell_mm", [0.25, 0.67])
def test_the_columns_of_a_slot_hold_what_the_slot_holds(cell_mm):
    """Their middles take up as much as 0.3 % more or less of it."""
    solid, _ = slot(28.0, 6.0, 8.0, "vertical", 0.0)
    x_mm, y_mm = np.meshgrid(np.linspace(-1, 29, 301), np.linspace(-4, 4, 81))
    surface_mm = np.column_stack([x_mm.ravel(), y_mm.ravel(), np.full(x_mm.size, -2.0)])
    within = Vessel(solid, cell_mm).volume_mm3(surface_mm, 0.0866)
    assert within == pytest.approx(28 * 6 * (6 + 0.0866), rel=1e-6)


def test_particles_below_or_beside_the_solid_fill_nothing():
    """Cells are numbered row by row: beside the solid the next number is a cell at its other side."""
    solid, _ = slot(28.0, 6.0, 8.0, "vertical", 0.0)
    x0, y0, x1, y1 = solid.block_mm
    bottom_mm = float(solid.vertices_mm[:, 2].min())
    x_mm, y_mm = np.meshgrid(np.linspace(x0 - 3, x1 + 3, 200), np.linspace(y0 - 3, y1 + 3, 160))
    place_mm = np.column_stack([x_mm.ravel(), y_mm.ravel(), np.full(x_mm.size, 1.0)])
    beside = (place_mm[:, 0] < x0 - 0.5) | (place_mm[:, 0] > x1 + 0.5)
    beside |= (place_mm[:, 1] < y0 - 0.5) | (place_mm[:, 1] > y1 + 0.5)
    below_mm = place_mm * [1, 1, 0] + [0, 0, bottom_mm - 0.5]
    for outside_mm in (place_mm[beside], below_mm):
        assert Vessel(solid, 0.4).volume_mm3(outside_mm, 0.3) == 0
