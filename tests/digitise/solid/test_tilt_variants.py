"""What each reading of the tilt makes of a crack, against closed forms."""

import pytest

from digitise.settings import CrackShape
from digitise.solid.footprint import lay_out
from digitise.solid.tilt_variants import cavity_volume_mm3, compare_tilts
from digitise.solid.wedges import wall_shifts_mm
from sealtwin.core.solid_figures import ClosingDepth
from tests.shapes import arc_slot, pinched_crack


@pytest.mark.parametrize("depth_mm", [16.0, pytest.param(((0, 6), (20, 16), (40, 10)), marks=pytest.mark.broad)])
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
