"""Designs of runs are balanced and orthogonal, and exact where the response is linear."""

import numpy as np
import pytest

from validate.uncertainty.computed import effects_of, two_level_design


@pytest.mark.parametrize(("inputs", "runs"), [(1, 2), (2, 4), (3, 4), (4, 8), (5, 8), (7, 8), (8, 16)])
def test_every_input_is_half_up_half_down_and_against_every_other(inputs, runs):
    design = two_level_design(inputs)
    assert design.shape == (runs, inputs)
    assert (design.sum(axis=0) == 0).all()
    assert (design.T @ design == runs * np.eye(inputs)).all()


def test_effects_of_a_linear_response_are_exact_whatever_its_level():
    slopes = np.array([[0.3, -1.0, 0.0], [0.05, 0.2, 2.0], [-0.4, 0.0, 0.1], [1.0, 1.0, 1.0], [0.0, 0.5, -0.5]])
    results = np.array(7.0 + two_level_design(5) @ slopes, dtype=np.float64)
    effects, scatter = effects_of(results, 5)
    assert effects == pytest.approx(slopes)
    assert scatter == pytest.approx(0.0, abs=1e-12)


def test_spare_columns_tell_how_far_runs_scatter():
    """Eight runs that scatter by 0.2 leave 0.2 / sqrt(8) in an effect; two columns at 400 places know it to 3 %."""
    noise = np.random.default_rng(1).normal(0, 0.2, (8, 400))
    _, scatter = effects_of(noise, 5)
    assert scatter == pytest.approx(0.2 / np.sqrt(8), rel=0.1)
    assert effects_of(noise[:4], 3)[1] is None
