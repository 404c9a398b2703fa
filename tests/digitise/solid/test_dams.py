"""Dams where the crack leaves the block, and nowhere else; labels of faces by the planes that they lie in."""

import pytest

from digitise.settings import CrackShape
from digitise.solid.dams import dams
from digitise.solid.footprint import lay_out
from digitise.solid.sections import Slicer
from digitise.solid.wedges import wall_shifts_mm
from tests.support.shapes import OPEN, straight_slot


@pytest.mark.parametrize("tilt", ["lean", "flare", "undercut"])
def test_dams_cover_what_the_tilt_opens(tilt):
    """Lean moves the opening's foot along the side, flare widens its top, undercut its foot."""
    shape = CrackShape(depth_mm=16.0, tilt=tilt)
    footprint = lay_out(straight_slot(80.0, 3.1, OPEN), shape, max(wall_shifts_mm(shape)))
    first, _ = dams(footprint, [Slicer(footprint, shape).cavity(depth_mm) for depth_mm in (0.0, 16.0)])
    assert first.box_mm[3] == pytest.approx(1.55 + 3.11 + 4.0, abs=0.01)
    assert first.box_mm[1] == pytest.approx(-1.55 - 4.0 - (0.0 if tilt == "lean" else 3.11), abs=0.01)
