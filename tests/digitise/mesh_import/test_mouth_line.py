"""The line between the walls of a slot is the line that it was drawn along."""

import numpy as np
import pytest
from manifold3d import CrossSection, FillRule

from digitise.geometry.polyline import left_normals
from digitise.mesh_import.mouth_line import MouthLine, line_of_mouth
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from tests.support.shapes import CLOSED
from tests.support.slot_outlines import straight, strip, zigzag

FAR_MM = (-1e3, -1e3, 1e3, 1e3)


def length_mm(line: MouthLine) -> float:
    return float(arc_length(line.centreline_mm)[-1])


def swept_mm2(line: MouthLine) -> float:
    """Area that the lines from wall to wall pass on their way."""
    across_mm, ahead_mm = line.left_mm - line.right_mm, np.diff(line.centreline_mm, axis=0)
    across_mm = (across_mm[1:] + across_mm[:-1]) / 2
    return float(np.abs(ahead_mm[:, 0] * across_mm[:, 1] - ahead_mm[:, 1] * across_mm[:, 0]).sum())


@pytest.mark.parametrize(
    ("mouth", "expected_mm"),
    [
        (straight(14.0, 4.0), 14.0),
        (straight(60.0, 4.0) + CrossSection.circle(2.0, 100) + CrossSection.circle(2.0, 100).translate((60, 0)), 64.0),
        (CrossSection([np.array([[2, -2], [62, -2], [58, 2], [-2, 2.0]])], FillRule.NonZero), 60.0),
        (CrossSection([np.array([[0, 0], [60, -2], [60, 2.0]])], FillRule.NonZero), 60.0),
    ],
    ids=["square", "round", "slanted by 45 degrees", "pointed"],
)
def test_a_closed_crack_ends_where_its_line_meets_the_rim(mouth, expected_mm):
    line = line_of_mouth(mouth, FAR_MM)
    assert line.ends == CLOSED
    assert length_mm(line) == pytest.approx(expected_mm, abs=0.05)
    assert line.left_mm[[0, -1]] == pytest.approx(line.right_mm[[0, -1]])


def ray(towards_deg: float, from_mm: tuple[float, float], reach_mm: float) -> Floats:
    turn = np.radians(towards_deg)
    return np.array([from_mm, np.add(from_mm, reach_mm * np.array([np.cos(turn), np.sin(turn)]))])


def test_side_cracks_are_lines_of_their_own():
    """A wall goes straight across their mouths, a little beyond the corners: 0.06 of the width, and 1.6 mm wide."""
    mouth = straight(60.0, 3.0)
    for towards_deg, x_mm, reach_mm in ((60.0, 15.0, 12.0), (-90.0, 30.0, 15.0), (120.0, 45.0, 10.0)):
        mouth += strip(ray(towards_deg, (x_mm, 0.0), reach_mm), 1.6)
    line = line_of_mouth(mouth, FAR_MM)
    assert length_mm(line) == pytest.approx(60.0, abs=0.1)
    assert np.abs(line.centreline_mm[:, 1]).max() < 0.2
    assert swept_mm2(line) == pytest.approx(180.0, rel=0.005)
    assert sorted(arc_length(side)[-1] for side in line.side_lines_mm) == pytest.approx([10, 12, 15], abs=1)
    assert "side arms (3, up to 15 mm long; the longest at s = 30 mm)" in line.warnings[0].text


@pytest.mark.parametrize(
    ("mouth", "between_mm", "says"),
    [
        (CrossSection.square((12.0, 8.0)), None, r"12\.0 x 8\.0 mm, is not a crack: .* 8\.0 mm wide"),
        (CrossSection.circle(6.0, 64), None, r"11\.9 x 11\.9 mm, is not a crack"),
        (CrossSection.circle(20.0) - CrossSection.circle(17.0), None, r"a ring around \(-?0\.0, -?0\.0\) mm"),
        (strip(zigzag(100.0), 3.0), zigzag(100.0)[[0, 2]], "do not face each other along one line"),
    ],
    ids=["square", "disc", "ring", "path that ends in a bend"],
)
def test_what_has_no_line_is_refused_in_words_of_a_mesh(mouth, between_mm, says):
    with pytest.raises(InputError, match=says) as refusal:
        line_of_mouth(mouth, FAR_MM, between_mm)
    assert not any(word in str(refusal.value) for word in ("photo", "ends_px", "px"))


@pytest.mark.parametrize("front", [0.02, 0.1, 0.2, 0.4])
@pytest.mark.parametrize("bend_mm", [0.0, -2.0])
def test_a_taper_begins_in_the_middle_of_its_front(front, bend_mm):
    """Fronts from a fiftieth of the mean width on, turned by some angle."""
    x_mm = np.linspace(0.0, 60.0, 121)
    centre_mm = np.column_stack([x_mm, bend_mm * x_mm * (60.0 - x_mm) / 900.0])
    across_mm = left_normals(centre_mm) * np.interp(x_mm, (0.0, 60.0), (1.5 * front, 3.0 - 1.5 * front))[:, None]
    ring_mm = np.vstack([centre_mm - across_mm, (centre_mm + across_mm)[::-1]])
    angle = 10 * front + bend_mm
    turn = np.array([(np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))])
    line = line_of_mouth(CrossSection([ring_mm @ turn], FillRule.NonZero), FAR_MM)
    ends_mm = line.centreline_mm[[0, -1]] @ turn.T
    ends_mm = ends_mm[np.argsort(ends_mm[:, 0])]
    off_mm = np.linalg.norm(ends_mm - centre_mm[[0, -1]], axis=1)
    assert (off_mm < 0.02 * 3.0 * np.array([front, 2.0 - front])).all()
    assert length_mm(line) == pytest.approx(arc_length(centre_mm)[-1], abs=0.01)
