"""The cavity by level and along the crack, cut from the mesh: all of it, wherever it is."""

from dataclasses import replace

import numpy as np
import pytest
from manifold3d import CrossSection

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Floats
from tests.shapes import CUT, arc_slot, closed_crack, cut_crack, straight_slot, wandering_crack, with_ring
from validate.metrics.cavity import CavityByLevel, cavity_by_level, cell_areas

SIDE_CRACK = np.array([(0, -3), (40, -3), (40, 3), (22, 3), (22, 20), (18, 20), (18, 3), (0, 3)], dtype=float)
SLOT = straight_slot(40.0, 6.0, CUT)
RISING = ((0.0, 12.0), (15.0, 6.0), (25.0, 6.0), (30.0, 10.0))
STONE = np.array([(12.0, -1.5), (12.0, 1.5), (28.0, 1.5), (28.0, -1.5)])


def whole_mm3(cavity: CavityByLevel, level_mm: float = 0.0) -> Floats:
    return cavity.below_mm3(np.full(len(cavity.ends_mm) - 1, level_mm))


@pytest.mark.parametrize(
    ("outline", "tilt", "angle_deg", "depth_mm"),
    [
        pytest.param(wandering_crack(1), "undercut", 2.0, 12.0, marks=pytest.mark.broad),
        pytest.param(cut_crack(2, length_mm=80.0), "funnel", 5.0, RISING, marks=pytest.mark.broad),
        (closed_crack(4, 30.0, 8.0), "flare", 30.0, RISING),
        pytest.param(arc_slot(), "lean", 8.0, RISING, marks=pytest.mark.broad),
        (replace(SLOT, islands_mm=(STONE,)), "vertical", 0.0, RISING),
        (with_ring(SLOT, SIDE_CRACK), "vertical", 0.0, RISING),
    ],
    ids=["undercut", "funnel", "flare with tips", "lean", "stone", "side crack"],
)
def test_stretches_add_up_to_the_cavity_of_the_mesh(outline, tilt, angle_deg, depth_mm):
    """Within 0.2 %: floors that rise cross layers of a quarter of a millimetre."""
    shape = CrackShape(depth_mm=depth_mm, tilt=tilt, wall_angle_deg=angle_deg)
    solid = build_solid(outline, shape)
    assert whole_mm3(cavity_by_level(outline, solid)).sum() == pytest.approx(solid.cavity_volume_mm3, rel=2e-3)


def test_a_side_crack_is_filled_as_its_root_is():
    """17 mm long, 4 mm wide and 12 mm deep, it leaves the main crack at s = 18 to 22 mm."""
    outline = with_ring(SLOT, SIDE_CRACK)
    cavity = cavity_by_level(outline, build_solid(outline, CrackShape(depth_mm=12.0, tilt="vertical")))
    root = (cavity.middle_mm > 17.0) & (cavity.middle_mm < 23.0)
    main_mm3 = 6.0 * 12.0 * np.diff(cavity.ends_mm)
    assert whole_mm3(cavity)[~root] == pytest.approx(main_mm3[~root], rel=0.15)
    assert whole_mm3(cavity)[root].sum() == pytest.approx(6.0 * 6.0 * 12.0 + 17.0 * 4.0 * 12.0, rel=0.02)


def test_a_floor_in_steps_is_where_it_is():
    """Floors at 12 and 6 mm: a level of -8 mm lies below the second one, and leaves it dry."""
    shape = CrackShape(depth_mm=((0.0, 12.0), (20.0, 12.0), (20.5, 6.0), (40.0, 6.0)), tilt="vertical")
    cavity = cavity_by_level(SLOT, build_solid(SLOT, shape))
    shallow = cavity.middle_mm > 22.0
    assert whole_mm3(cavity, -8.0)[shallow] == pytest.approx(0.0, abs=1e-6)
    assert whole_mm3(cavity, -8.0)[cavity.middle_mm < 19.0].sum() == pytest.approx(19.0 * 6.0 * 4.0, rel=0.01)
    assert whole_mm3(cavity, -4.0)[shallow].sum() == pytest.approx(18.0 * 6.0 * 2.0, rel=0.02)


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
