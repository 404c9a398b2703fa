"""Intervals, combinations and pairs of draws that are known."""

import numpy as np
import pytest

from validate.calibration.posterior import Free, combinations_of, confounded_pairs, marginals_of

FREES = [Free("fluid.yield_stress_pa", 3.0, 60.0), Free("fluid.viscosity_pa_s", 0.2, 5.0), Free("path.fill", 0.9, 1.1)]


def _draws():
    """Of the first two only the sum is known, and of the third nothing."""
    random = np.random.default_rng(1)
    along = random.uniform(0.2, 0.8, 4000)
    sum_is_1 = 1 - along + 0.01 * random.standard_normal(4000)
    return np.column_stack([along, sum_is_1, random.random(4000)])


def test_a_range_over_which_a_setting_changes_fivefold_is_logarithmic():
    assert FREES[0].values(np.array([0.0, 0.5, 1.0])) == pytest.approx([3, np.sqrt(180), 60])
    assert FREES[2].values(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.9, 1.0, 1.1])


def test_what_was_known_beforehand_is_flat_or_normal_in_the_setting():
    assert FREES[2].prior == pytest.approx((0.9, np.sqrt(1 / 12)), rel=1e-3)
    measured = Free("path.fill", 0.9, 1.1, (1.0, 0.01))
    assert measured.prior == pytest.approx((2 * 1.645 * 0.05, 0.05), rel=2e-3)
    logarithmic = Free("fluid.yield_stress_pa", 3.0, 60.0, (20.0, 2.0))
    shares = (np.arange(20000) + 0.5) / 20000
    weight = np.exp(logarithmic.log_prior(shares))
    mean = (weight * logarithmic.values(shares)).sum() / weight.sum()
    assert mean == pytest.approx(20.0, rel=1e-3)


def test_an_interval_wider_than_half_of_what_was_known_does_not_identify():
    marginals = marginals_of(FREES, _draws(), np.array([0.5, 0.5, 0.5]))
    assert [one.identified for one in marginals] == [False, False, False]
    assert marginals[2].width_over_prior == pytest.approx(1.0, abs=0.02)
    assert marginals[0].low == pytest.approx(3 * 20**0.23, rel=0.02)
    narrow = marginals_of(FREES, 0.5 + 0.1 * (_draws() - 0.5), np.array([0.5, 0.5, 0.5]))
    assert all(one.identified for one in narrow)


def test_the_sum_is_the_combination_that_is_determined():
    best, *_, worst = combinations_of(FREES, _draws())
    assert np.abs(best.parts) == pytest.approx([np.sqrt(0.5), np.sqrt(0.5), 0], abs=0.02)
    assert best.parts[0] * best.parts[1] > 0
    assert best.deviation < 0.05
    assert worst.deviation > 0.8
    assert best.said(FREES) in ("0.7 ln yield stress + 0.7 ln viscosity", "0.7 ln viscosity + 0.7 ln yield stress")


def test_two_settings_that_stand_for_each_other_are_named():
    ((a, b, together),) = confounded_pairs(FREES, _draws())
    assert (a.name, b.name) == ("fluid.yield_stress_pa", "fluid.viscosity_pa_s")
    assert together < -0.95
