"""A station's scatter by its own repeats and by those of the others."""

import numpy as np
import pytest
from scipy import stats

from validate.uncertainty.budget import DRAWS
from validate.uncertainty.reading_errors import possible_scatter_mm, rounded_errors_mm


def test_a_station_alone_has_its_own_repeats_and_nothing_else():
    """Its sum of squares over chi-square, however uneven others may be: 2 degrees, 0.3 mm²."""
    found_mm2 = possible_scatter_mm(np.array([0.3]), np.array([2.0]))[:, 0] ** 2
    for share in (0.05, 0.25, 0.5, 0.75, 0.95):
        # Three standard deviations of the share below a quantile, by 4,000 draws.
        below = float((found_mm2 <= 0.3 / stats.chi2.isf(share, 2)).mean())
        assert below == pytest.approx(share, abs=3 * np.sqrt(share * (1 - share) / DRAWS))


def test_many_stations_alike_know_each_other():
    """Thirty of two repeats each, all with 0.1 mm: within a factor of 1.6 two times in three; alone, of 4 and more."""
    found_mm = possible_scatter_mm(np.full(30, 0.01), np.ones(30))
    assert np.median(found_mm, axis=0) == pytest.approx(np.full(30, 0.1), rel=0.05)
    low_mm, high_mm = np.quantile(found_mm, (0.16, 0.84), axis=0)
    assert (high_mm / low_mm < 1.6).all()
    alone_mm = np.quantile(possible_scatter_mm(np.array([0.01]), np.ones(1)), (0.16, 0.84))
    assert alone_mm[1] / alone_mm[0] > 4


def test_stations_unlike_each_other_keep_their_own():
    """0.02 and 0.5 mm by ten degrees each: within 10 % of their own, where the mean of the squares is 0.35 mm."""
    deviation_mm = np.repeat([0.02, 0.5], 8)
    found_mm = possible_scatter_mm(10 * deviation_mm**2, np.full(16, 10.0))
    assert np.median(found_mm, axis=0) == pytest.approx(deviation_mm, rel=0.1)


def test_a_station_read_once_may_be_like_any_of_the_others():
    """0.03 and 0.2 mm by turns: in the middle, and less sure than either."""
    squares_mm2, freedom = 10 * np.tile([0.03, 0.2], 8) ** 2, np.full(16, 10.0)
    found_mm = possible_scatter_mm(np.append(squares_mm2, 0.0), np.append(freedom, 0.0))
    low_mm, middle_mm, high_mm = np.quantile(found_mm, (0.05, 0.5, 0.95), axis=0)
    assert 0.04 < middle_mm[-1] < 0.15
    assert low_mm[-1] < 0.03
    assert high_mm[-1] > 0.2


def test_the_unit_does_not_matter():
    squares = np.array([0.01, 0.2, 0.003, 0.05])
    freedom = np.array([2.0, 1.0, 2.0, 4.0])
    in_mm, in_um = possible_scatter_mm(squares, freedom), possible_scatter_mm(squares * 1e6, freedom)
    assert in_um == pytest.approx(in_mm * 1e3, rel=1e-6)


def test_repeats_that_agree_to_a_coarse_step_may_lie_anywhere_in_it():
    """A single station and no scatter to be seen: the error is even over the step, from -0.25 to 0.25 mm, or wider."""
    found_mm = rounded_errors_mm(np.full((1, 3), -4.0), 0.5)[:, 0]
    assert found_mm.mean() == pytest.approx(0.0, abs=0.02)
    assert 0.2 < np.quantile(np.abs(found_mm), 0.9) < 0.4


def test_many_stations_that_agree_hide_no_scatter_beyond_the_step():
    """Twenty stations whose three repeats agree: nothing reaches beyond half of a step but what a tail leaves."""
    found_mm = rounded_errors_mm(np.full((20, 3), 2.0), 0.5)
    assert np.quantile(np.abs(found_mm), 0.95) == pytest.approx(0.95 * 0.25, rel=0.1)


def test_repeats_on_two_steps_place_the_level_between_them():
    """Two of three readings on one step and one on the next, 0.29 mm of deviation, and their mean 0.29 / sqrt(3)."""
    repeats_mm = np.tile([0.0, 0.0, 0.5], (20, 1))
    error_mm = rounded_errors_mm(repeats_mm, 0.5)
    assert np.median(error_mm) == pytest.approx(0.0, abs=0.05)
    assert np.quantile(np.abs(error_mm), 0.95) == pytest.approx(1.96 * 0.289 / np.sqrt(3), rel=0.15)
