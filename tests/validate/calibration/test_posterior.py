"""The posterior, compared with closed forms, and the conditions for a calibration."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from validate.calibration.emulator import Emulator, Processes, Scatter
from validate.calibration.posterior import (
    COMMON_MM,
    INFLATED,
    Free,
    Posterior,
    ReadLevels,
    confounded_pairs,
    reach_of,
    smooth_errors_mm2,
)

STATIONS = 12
S_MM = np.linspace(0.0, 40.0, STATIONS)
SLOPES = np.array([np.linspace(1.0, 3.0, STATIONS), np.cos(S_MM / 10)])
NOISE_MM = 0.2


def _emulator(rest_mm2=0.0, slopes=(0.0, 0.0)):
    """Levels that are linear in two settings, with almost no uncertainty."""
    points = np.array([[x, y] for x in np.linspace(0, 1, 6) for y in np.linspace(0, 1, 6)])
    mean = np.full(STATIONS, -5.0)
    scores = points - 0.5
    processes = Processes.given(points, scores, np.full((2, 2), 8.0), np.full(2, 10.0), np.full(2, 1e-8), np.ones(36))
    scatter = Scatter(rest_mm2 * np.eye(STATIONS), np.full(2, 0.5), np.array(slopes))
    return Emulator(mean, SLOPES, processes, scatter)


def _posterior(truth, *, frees=None, trials=1, off_mm: Any = 0.0, **scatter):
    level_mm = -5.0 + (np.array(truth) - 0.5) @ SLOPES + off_mm
    evidence = ReadLevels(S_MM, level_mm, NOISE_MM**2 * np.eye(STATIONS))
    frees = frees or [Free("fluid.a", 0.0, 1.0), Free("fluid.b", 0.0, 1.0)]
    return Posterior(frees, [_emulator(**scatter)] * trials, [evidence] * trials)


def test_the_posterior_density_is_normal_with_the_covariance_of_readings_and_runs():
    posterior = replace(_posterior((0.4, 0.6), rest_mm2=0.05, slopes=(2.0, -1.0)), smooth=False)
    points = np.array([[0.4, 0.6], [0.5, 0.5], [0.1, 0.9]])
    mean, variance = posterior.emulators[0].processes.predicted(points)
    expected = []
    for point, row, doubt in zip(points, mean, variance, strict=True):
        run_mm2 = (SLOPES.T * 1e-8) @ SLOPES + 0.05 * np.eye(STATIONS)
        inner = (SLOPES.T * doubt) @ SLOPES + np.exp((point - 0.5) @ [2.0, -1.0]) * run_mm2
        covariance = INFLATED**2 * (NOISE_MM**2 * np.eye(STATIONS) + inner)
        off = posterior.evidence[0].level_mm + 5.0 - row @ SLOPES
        expected.append(-(off @ np.linalg.solve(covariance, off) + np.linalg.slogdet(covariance)[1]) / 2)
    assert np.allclose(posterior.log_density(points), expected, rtol=1e-5)
    assert np.isneginf(posterior.log_density(np.array([[1.1, 0.5]]))).all()


def test_posterior_draws_have_the_mean_and_spread_of_least_squares():
    posterior = _posterior((0.4, 0.6))
    draws, mixing = posterior.draws(500, 600)
    covariance = np.linalg.inv(SLOPES @ SLOPES.T) * (INFLATED * NOISE_MM) ** 2
    # 500 draws of 64 walkers: a mean to a tenth of its deviation, a deviation to a fifth of it.
    assert np.allclose(draws.mean(axis=0), [0.4, 0.6], atol=0.3 * np.sqrt(covariance.diagonal()).max())
    assert np.allclose(draws.std(axis=0), np.sqrt(covariance.diagonal()), rtol=0.2)
    assert mixing < 1.05
    assert np.array_equal(draws, _posterior((0.4, 0.6)).draws(500, 600)[0])


def test_readings_unlike_all_simulated_shapes_cannot_be_reproduced_by_calibration():
    random = np.random.default_rng(0)
    points = random.random((20, 2))
    levels_mm = (points - 0.5) @ SLOPES + 0.05 * random.standard_normal((20, STATIONS))
    covariance = NOISE_MM**2 * np.eye(STATIONS)
    reach = reach_of(points, levels_mm, ReadLevels(S_MM, 0.2 * SLOPES[1], covariance))
    assert reach.possible
    assert reach.residual_mm < 0.1
    other = reach_of(points, levels_mm, ReadLevels(S_MM, 2.0 * np.sin(S_MM), covariance))
    assert not other.possible
    assert other.residual_mm > 3 * other.noise_mm
    # A shape that few runs have needs more components, and is possible.
    shapes = np.linalg.qr(random.standard_normal((STATIONS, STATIONS)))[0]
    points = np.zeros((40, 2))
    many_mm = random.standard_normal((40, 6)) * np.array([9, 8, 7, 6, 5, 0.6]) @ shapes[:6]
    rare = reach_of(points, many_mm, ReadLevels(S_MM, 4 * shapes[5], covariance / 4))
    assert rare.possible
    assert rare.components == 6


def test_a_smooth_error_widens_the_posterior_of_a_setting_with_the_same_effect():
    """The first setting changes the mean level, as does an error that is the same at all stations."""
    exact = _posterior((0.4, 0.6))
    smooth_mm2 = smooth_errors_mm2(S_MM, (S_MM[0], S_MM[-1]))
    assert smooth_mm2.diagonal().min() > COMMON_MM**2
    evidence = [replace(case, smooth_mm2=smooth_mm2) for case in exact.evidence]
    points = np.array([[0.4, 0.6], [0.7, 0.6]])
    allowed = replace(exact, evidence=evidence)
    falls, exact_falls = (-np.diff(case.log_density(points))[0] for case in (allowed, exact))
    assert 0 < falls < 0.2 * exact_falls
    # Neither the search nor the implausibility allows for this error.
    assert replace(allowed, smooth=False).log_density(points) == pytest.approx(exact.log_density(points))
    assert allowed.implausibility(points) == pytest.approx(exact.implausibility(points))


FREES = [Free("fluid.yield_stress_pa", 3.0, 60.0), Free("fluid.viscosity_pa_s", 0.2, 5.0), Free("path.fill", 0.9, 1.1)]


def _draws():
    """Draws that determine only the sum of the first two settings, and nothing of the third."""
    random = np.random.default_rng(1)
    along = random.uniform(0.2, 0.8, 4000)
    sum_is_1 = 1 - along + 0.01 * random.standard_normal(4000)
    return np.column_stack([along, sum_is_1, random.random(4000)])


def test_two_confounded_settings_are_named_with_their_correlation():
    ((a, b, together),) = confounded_pairs(FREES, _draws())
    assert (a.name, b.name) == ("fluid.yield_stress_pa", "fluid.viscosity_pa_s")
    assert together < -0.95
