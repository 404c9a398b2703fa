"""The centreline found in a slot's mouth is the line along which the slot was drawn."""

import numpy as np
import pytest
from manifold3d import CrossSection, FillRule, JoinType

from digitise.mesh_import.mouth_line import MouthLine, line_of_mouth
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from tests.support.shapes import CLOSED

FAR_MM = (-1e3, -1e3, 1e3, 1e3)
HEADING = np.radians([-50, 50, -50, 50])
ZIGZAG_MM = np.cumsum(25.0 * np.column_stack([np.cos(HEADING), np.sin(HEADING)]), axis=0)


def straight(length_mm: float, width_mm: float) -> CrossSection:
    """A strip along x from the origin."""
    return CrossSection.square((length_mm, width_mm)).translate((0.0, -width_mm / 2))


def zigzag(width_mm: float) -> CrossSection:
    """A strip about ``ZIGZAG_MM``, with mitred corners."""
    to_and_fro_mm = np.vstack([ZIGZAG_MM, ZIGZAG_MM[-2:0:-1] + 1e-6])
    return CrossSection([to_and_fro_mm], FillRule.NonZero).offset(width_mm / 2, JoinType.Miter)


def length_mm(line: MouthLine) -> float:
    return float(arc_length(line.centreline_mm)[-1])


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
def test_the_centreline_of_a_closed_crack_ends_at_the_rim(mouth, expected_mm):
    line = line_of_mouth(mouth, FAR_MM)
    assert line.ends == CLOSED
    assert length_mm(line) == pytest.approx(expected_mm, abs=0.05)
    assert line.left_mm[[0, -1]] == pytest.approx(line.right_mm[[0, -1]])


@pytest.mark.parametrize(
    ("mouth", "between_mm", "says"),
    [
        (CrossSection.square((12.0, 8.0)), None, r"12\.0 x 8\.0 mm, is not a crack: .* 8\.0 mm wide"),
        (CrossSection.circle(6.0, 64), None, r"11\.9 x 11\.9 mm, is not a crack"),
        (CrossSection.circle(20.0) - CrossSection.circle(17.0), None, r"a ring around \(-?0\.0, -?0\.0\) mm"),
        (zigzag(3.0), ZIGZAG_MM[[0, 2]], "do not face each other along one line"),
    ],
    ids=["square", "disc", "ring", "path that ends in a bend"],
)
def test_the_error_for_a_mouth_without_a_centreline_does_not_mention_photos(mouth, between_mm, says):
    with pytest.raises(InputError, match=says) as refusal:
        line_of_mouth(mouth, FAR_MM, between_mm)
    assert not any(word in str(refusal.value) for word in ("photo", "ends_px", "px"))
