"""The emulator, compared with the conditional normal distribution, and its predictions of profiles."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from scipy.spatial.distance import cdist
from scipy.special import gamma, kv
from scipy.stats import multivariate_normal

from validate.calibration.emulator import FACTOR, Emulator, Processes, Scatter, minus_log_posterior

RANDOM = np.random.default_rng(3)
POINTS = RANDOM.random((9, 2))
SCORE = np.sin(3 * POINTS[:, 0]) + POINTS[:, 1] ** 2
LENGTH, VARIANCE, NUGGET, ORDER = np.array([0.6, 1.4]), 1.7, 0.03, 2.5
RELATIVE = np.exp(2 * POINTS[:, 0])  # Of the variance of each run's scatter


def _covariance(one, other):
    """Matérn's covariance of any order, by the Bessel function; Rasmussen and Williams (2006, eq. 4.14)."""
    apart = np.maximum(np.sqrt(2 * ORDER) * cdist(one / LENGTH, other / LENGTH), 1e-9)
    return VARIANCE * 2 ** (1 - ORDER) / gamma(ORDER) * apart**ORDER * kv(ORDER, apart)


OBSERVED = _covariance(POINTS, POINTS) + np.diag(NUGGET * RELATIVE)


def _processes():
    numbers = LENGTH[None], np.array([VARIANCE]), np.array([NUGGET])
    return Processes.given(POINTS, SCORE[:, None], *numbers, RELATIVE)


def test_predictions_of_the_emulator_are_the_conditional_normal_distribution():
    new = RANDOM.random((5, 2))
    mean, variance = _processes().predicted(new)
    weights = np.linalg.solve(OBSERVED, _covariance(POINTS, new)).T
    assert np.allclose(mean[:, 0], weights @ SCORE, rtol=1e-9)
    assert np.allclose(variance[:, 0], VARIANCE - (weights * _covariance(new, POINTS)).sum(axis=1), rtol=1e-7)


def test_the_likelihood_agrees_with_the_normal_density_and_its_gradient_with_differences():
    logs = np.log([*LENGTH, VARIANCE, NUGGET])
    value, gradient = minus_log_posterior(logs, POINTS, SCORE, RELATIVE)
    prior = (np.log(LENGTH) ** 2).sum() / np.log(FACTOR) ** 2 / 2
    likelihood = multivariate_normal(np.zeros(9), OBSERVED).logpdf(SCORE)
    assert value == pytest.approx(prior - likelihood - 9 / 2 * np.log(2 * np.pi), rel=1e-10)
    slope: Any = approx_fprime(logs, lambda x: minus_log_posterior(x, POINTS, SCORE, RELATIVE)[0])
    assert np.allclose(gradient, slope, atol=1e-4)


def test_an_emulator_predicts_profiles_between_its_runs():
    """After forty runs of a smooth function with a scatter of 0.05 mm, the error is below the scatter."""
    s = np.linspace(0, 1, 15)

    def level(points):
        return np.sin(4 * points[:, :1] * s) + points[:, 1:] * s**2

    points = RANDOM.random((40, 2))
    emulator = Emulator.fitted(points, level(points) + 0.05 * RANDOM.standard_normal((40, 15)))
    new = 0.1 + 0.8 * RANDOM.random((200, 2))
    assert np.sqrt(np.mean((emulator.levels_mm(new) - level(new)) ** 2)) < 0.05
    scatter = np.sqrt(emulator.run_noise_mm2.diagonal().mean())
    assert 0.03 < scatter < 0.08


def test_the_fitted_scatter_of_runs_varies_with_the_settings():
    """The standard deviation grows fourfold along the first setting, and is constant along the second."""
    random = np.random.default_rng(5)
    points = random.random((40, 2))
    size_mm = 0.05 * 4 ** points[:, :1]
    scatter = Scatter.fitted(points, size_mm * random.standard_normal((40, 30)), 1)
    ends = scatter.relative(np.array([[0.0, 0.5], [1.0, 0.5], [0.5, 0.0], [0.5, 1.0]]))
    assert np.sqrt(ends[1] / ends[0]) == pytest.approx(4.0, rel=0.25)
    assert np.sqrt(ends[3] / ends[2]) == pytest.approx(1.0, rel=0.1)
    assert np.sqrt(scatter.rest_mm2.diagonal().mean()) == pytest.approx(0.1, rel=0.15)
