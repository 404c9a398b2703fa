"""The cavity by level and along the crack, cut from the mesh: all of it, wherever it is."""

from dataclasses import replace

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Floats
from tests.support.shapes import CUT, closed_crack, straight_slot, with_ring
from validate.metrics.volumes import CavityByLevel, cavity_by_level

SIDE_CRACK = np.array([(0, -3), (40, -3), (40, 3), (22, 3), (22, 20), (18, 20), (18, 3), (0, 3)], dtype=float)
SLOT = straight_slot(40.0, 6.0, CUT)
RISING = ((0.0, 12.0), (15.0, 6.0), (25.0, 6.0), (30.0, 10.0))
STONE = np.array([(12.0, -1.5), (12.0, 1.5), (28.0, 1.5), (28.0, -1.5)])


def whole_mm3(cavity: CavityByLevel, level_mm: float = 0.0) -> Floats:
    return cavity.below_mm3(np.full(len(cavity.ends_mm) - 1, level_mm))


@pytest.mark.parametrize(
    ("outline", "tilt", "angle_deg", "depth_mm"),
    [
        (closed_crack(4, 30.0, 8.0), "flare", 30.0, RISING),
        (replace(SLOT, islands_mm=(STONE,)), "vertical", 0.0, RISING),
        (with_ring(SLOT, SIDE_CRACK), "vertical", 0.0, RISING),
    ],
    ids=["flare with tips", "stone", "side crack"],
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
