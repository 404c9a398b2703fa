"""The judge of calibrations: what its bars can tell."""

import pytest

from benchmarks.calibration import bar_rows


def test_how_likely_a_bar_is_met_follows_from_the_binomial_law():
    """80 to 97 % of ten values are eight or nine: 45 p^8 q^2 + 10 p^9 q, to the last digit of the table.

    With the bar's ends rounded outwards ten of ten met it too.
    """
    rows = bar_rows(10)
    for row, share in zip(rows, (0.7, 0.8, 0.9), strict=True):
        expected = 45 * share**8 * (1 - share) ** 2 + 10 * share**9 * (1 - share)
        assert row.value == pytest.approx(100 * expected, rel=1e-9), row.name
        assert not row.judged
