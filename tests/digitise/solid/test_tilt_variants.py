"""What each reading of the tilt makes of a crack, against closed forms."""

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.footprint import lay_out
from digitise.solid.tilt_variants import Slicer, cavity_volume_mm3, compare_tilts
from digitise.solid.wedges import wall_shifts_mm
from sealtwin.core.solid_figures import ClosingDepth
from tests.shapes import CUT, arc_slot, pinched_crack, straight_slot


@pytest.mark.parametrize("tilt", ["vertical", "lean", "flare", "funnel", "undercut"])
@pytest.mark.parametrize("depth_mm", [0.0, 4.0, 7.5])
def test_sections_of_a_slot_have_the_width_of_their_depth(tilt, depth_mm):
    shape = CrackShape(depth_mm=16.0, tilt=tilt)
    footprint = lay_out(straight_slot(80.0, 3.1, CUT), shape, max(wall_shifts_mm(shape)))
    slope = np.tan(np.radians(11))
    opening_mm = {"flare": 16.0 - depth_mm, "funnel": -depth_mm, "undercut": depth_mm}.get(tilt, 0.0)
    width_mm = 3.1 + 2 * slope * opening_mm
    assert Slicer(footprint, shape).cavity(depth_mm).area() == pytest.approx(80.0 * width_mm, rel=1e-5)


@pytest.mark.parametrize("depth_mm", [16.0, ((0.0, 6.0), (20.0, 16.0), (40.0, 10.0))], ids=["level", "table"])
@pytest.mark.parametrize("tilt", ["vertical", "lean", "flare", "funnel", "undercut"])
def test_few_sections_are_enough(tilt, depth_mm):
    """Against eight times as many, on a crack that closes at another depth everywhere along itself."""
    shape = CrackShape(depth_mm=depth_mm, tilt=tilt)
    footprint = lay_out(pinched_crack(1), shape, max(wall_shifts_mm(shape)))
    assert cavity_volume_mm3(footprint, shape) == pytest.approx(cavity_volume_mm3(footprint, shape, 8), rel=4e-4)


def test_no_tilt_makes_all_readings_one():
    shape = CrackShape(depth_mm=16.0, tilt="funnel", wall_angle_deg=0.0)
    outline = arc_slot()
    variants = compare_tilts(outline, lay_out(outline, shape, 0.0), shape)
    volumes = list(variants.volume_mm3.values())
    assert volumes == pytest.approx([volumes[0]] * 5, rel=1e-12)
    assert variants.closing_depth_mm == ClosingDepth(None, None, 0.0)
    assert variants.mouth_width_mm == variants.floor_width_mm == variants.photo_width_mm
