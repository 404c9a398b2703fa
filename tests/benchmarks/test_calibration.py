"""The bars of the calibration benchmark."""

import pytest

from benchmarks.calibration import FREES, MIN_FOUND, Calibration, power_rows, truths
from validate.calibration.posterior import Marginal


@pytest.mark.parametrize(("end", "met"), [(1.0, [False, False]), (0.45, [True, False])])
def test_neither_silence_nor_guesses_meet_the_bars(end, met):
    """The whole range identifies nothing. The lower 45 % of each range contains about half of the truths."""
    marginals = [Marginal(free, free.low, free.low, float(free.values(end)), end / 0.9) for free in FREES]
    rows = power_rows("a method", [Calibration(truth, marginals, True) for truth in truths()], MIN_FOUND)
    assert [row.met for row in rows if row.judged] == met
