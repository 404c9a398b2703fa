"""The crack from above: run out past its flat ends, and which wall each piece of its outline is."""

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.footprint import lay_out, sides
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from tests.shapes import CLOSED, CUT, straight_slot, with_ring

VERTICAL = CrackShape(depth_mm=16.0, tilt="vertical")


def test_a_crack_that_comes_back_past_its_cut_end_is_refused():
    """A hairpin whose second leg runs on beyond the cut of the first."""
    hairpin = straight_slot(20.0, 3.0, CUT)
    ring = np.array(
        [(0, -1.5), (24, -1.5), (24, 6.5), (-9, 6.5), (-9, 3.5), (20, 3.5), (20, 1.5), (0, 1.5)], dtype=float
    )
    with pytest.raises(InputError, match=r"One end of the crack is cut, .* Move the end along the crack"):
        lay_out(with_ring(hairpin, ring), VERTICAL, 0.0)


UP, DOWN, RIGHT, LEFT = np.array([[0, 1], [0, -1], [1, 0], [-1, 0]], dtype=float)


def share(outline, place: tuple[float, float], outward: Floats) -> float:
    return float(sides(outline, 10.0).left_share(np.array([place]), outward[None])[0])


@pytest.mark.parametrize(("tip_x", "out"), [(40.0, RIGHT), (0.0, LEFT)])
def test_a_tip_goes_over_from_left_to_right(tip_x, out):
    """Straight out it is half of either; what faces up by a third of the way to all left, more of the left."""
    slot = straight_slot(40.0, 3.0, CLOSED)
    assert share(slot, (tip_x, 0.4), out) == pytest.approx(0.5)
    turned = np.radians(20.0)
    assert share(slot, (tip_x, 0.4), np.cos(turned) * out + np.sin(turned) * UP) == pytest.approx(0.5 + 20 / 120)
    assert share(slot, (tip_x, -0.4), np.cos(turned) * out + np.sin(turned) * DOWN) == pytest.approx(0.5 - 20 / 120)
    assert share(slot, (tip_x, 0.4), UP) == 1.0
    # Away from the tip a wall is one or the other, however rough.
    assert share(slot, (20.0, 1.5), out) == 1.0
