"""Horizontal sections of a cavity: their integral, and the mesh against it."""

import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out
from digitise.solid.wedges import wall_shifts_mm
from tests.integrals import cavity_volume_mm3
from tests.shapes import closed_crack, cut_crack, pinched_crack, wandering_crack

DEPTHS = pytest.mark.parametrize(
    "depth_mm", [16.0, pytest.param(((0, 6), (20, 16), (40, 10)), marks=pytest.mark.broad)]
)
ALL_TILTS = pytest.mark.parametrize("tilt", ["vertical", "lean", "flare", "funnel", "undercut"])


@DEPTHS
@ALL_TILTS
def test_few_sections_are_enough(tilt, depth_mm):
    """Against eight times as many, on a crack that closes at another depth everywhere along itself."""
    shape = CrackShape(depth_mm=depth_mm, tilt=tilt)
    footprint = lay_out(pinched_crack(1), shape, max(wall_shifts_mm(shape)))
    assert cavity_volume_mm3(footprint, shape) == pytest.approx(cavity_volume_mm3(footprint, shape, 8), rel=4e-4)


@DEPTHS
@ALL_TILTS
@pytest.mark.parametrize("outline", [wandering_crack(), closed_crack(), cut_crack()], ids=["open", "closed", "cut"])
def test_the_mesh_encloses_the_integral_of_the_sections(outline, tilt, depth_mm):
    """Two ways to one volume, within a thousandth: wedges subtracted from a block, and offsets of the outline."""
    shape = CrackShape(depth_mm=depth_mm, tilt=tilt, wall_angle_deg=4.0)
    footprint = lay_out(outline, shape, max(wall_shifts_mm(shape)))
    integral_mm3 = cavity_volume_mm3(footprint, shape)
    assert build_solid(outline, shape).cavity_volume_mm3 == pytest.approx(integral_mm3, rel=1e-3)
