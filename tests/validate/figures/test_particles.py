"""Where particles lie along and across a crack."""

import numpy as np
import pytest

from validate.figures.particles import AlongCrack


def test_places_along_a_crack_run_on_past_its_ends_and_left_is_above_zero(evidence):
    """The slot of this trial runs along x from the origin, so s is x, and left of it is y."""
    points_mm = np.array([[-7.0, 1.0], [0.0, 0.5], [13.0, -1.2], [47.0, 2.0]])
    s_mm, aside_mm = AlongCrack(evidence.outline).of(points_mm)
    assert s_mm == pytest.approx(points_mm[:, 0], abs=0.06)
    assert aside_mm == pytest.approx(points_mm[:, 1], abs=0.01)
