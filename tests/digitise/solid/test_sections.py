"""The integral of a crack's sections, compared with the volume of its mesh."""

import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out
from digitise.solid.wedges import wall_shifts_mm
from tests.support.section_volumes import cavity_volume_mm3
from tests.support.shapes import closed_crack, cut_crack, wandering_crack

HILLS = ((0, 6), (20, 16), (40, 10))


@pytest.mark.parametrize(
    ("outline", "tilt", "depth_mm"),
    [
        (wandering_crack(), "lean", 16.0),
        (wandering_crack(), "undercut", HILLS),
        (closed_crack(), "flare", HILLS),
        (closed_crack(), "undercut", 16.0),
        (cut_crack(), "funnel", 16.0),
        (cut_crack(), "vertical", HILLS),
    ],
)
def test_the_volume_of_the_mesh_equals_the_integral_of_the_sections(outline, tilt, depth_mm):
    """Tolerance: 0.1 % between wedges subtracted from a block and offsets of the outline."""
    shape = CrackShape(depth_mm=depth_mm, tilt=tilt, wall_angle_deg=4.0)
    integral_mm3 = cavity_volume_mm3(lay_out(outline, shape, max(wall_shifts_mm(shape))), shape)
    assert build_solid(outline, shape).cavity_volume_mm3 == pytest.approx(integral_mm3, rel=1e-3)
