"""Piecewise linear functions: integrals and shares of closed form."""

import numpy as np
import pytest

from validate.metrics.curve_distances import Difference, PiecewiseLinear

RAMP = PiecewiseLinear(np.array([0.0, 10.0]), np.array([0.0, 5.0]))
STEPS = PiecewiseLinear(np.array([0.0, 4.0, 4.0 + 1e-9, 10.0]), np.array([1.0, 1.0, 3.0, 3.0]))


def test_mean_and_root_mean_square_of_a_ramp():
    assert RAMP.mean() == pytest.approx(2.5)
    assert RAMP.rms() == pytest.approx(5 / np.sqrt(3))


def test_shares_and_quantiles_invert_each_other():
    for share in (0.05, 0.5, 0.95):
        assert RAMP.quantile(share) == pytest.approx(5 * share)
        assert RAMP.share_below(RAMP.quantile(share)) == pytest.approx(share)
    assert RAMP.share_below(-1.0) == 0.0
    assert RAMP.share_below(9.0) == 1.0


def test_a_level_held_over_a_length_is_a_quantile():
    assert STEPS.share_below(2.0) == pytest.approx(0.4)
    assert STEPS.quantile(0.3) == pytest.approx(1.0)
    assert STEPS.quantile(0.5) == pytest.approx(3.0)


def test_a_constant_is_each_of_its_quantiles():
    flat = PiecewiseLinear(np.array([0.0, 1.0]), np.array([2.0, 2.0]))
    assert flat.quantile(0.5) == 2.0


def test_differences_know_their_crossings():
    difference = Difference([0, 4], [0, 4], [0, 4], [1, 1])
    assert difference.x.tolist() == [0, 1, 4]
    assert difference.value.tolist() == [-1, 0, 3]
    # |error| is below 0.5 for 0.5 < x < 1.5.
    assert difference.size.share_below(0.5) == pytest.approx(0.25)
    assert difference.size.quantile(1.0) == pytest.approx(3.0)
