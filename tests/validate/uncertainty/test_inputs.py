"""Inputs drawn together: u of a linear model is the closed form, and shares are those of its variance."""

import numpy as np
import pytest

from validate.uncertainty.budget import Budget
from validate.uncertainty.computed import RUNS, Effect, InputDraws, Inputs, Spread, drawn_inputs

S_MM = np.linspace(0.0, 60.0, 7)
STANDARDS = {"volume_ml": 0.1, "depth_mm": 0.5, "width_mm": 0.1}
PER_SD_MM = np.array([0.3, -0.4, 0.0])


def draws(make) -> InputDraws:
    """Levels that ``make`` gives for draws of the inputs, the same along the crack."""
    return InputDraws(S_MM, STANDARDS, make(drawn_inputs(STANDARDS))[:, None] * np.ones(len(S_MM)), ())


def u_mm(inputs: Inputs) -> float:
    level = np.full(len(S_MM), 1 / len(S_MM)), np.zeros(len(S_MM) - 1)
    return Budget(len(S_MM), tuple(inputs.errors())).mean_mm(level) / 2


def test_of_a_linear_model_u_is_the_root_of_the_sum_of_squares():
    linear = draws(lambda z: z @ PER_SD_MM)
    assert len(linear.moved_mm) == RUNS
    # Twice u is the interval of 95 %, 1.96 standard deviations of a normal one.
    assert u_mm(linear.inputs) == pytest.approx(0.98 * 0.5, rel=0.02)
    effects, together = linear.inputs.reported(S_MM)
    assert [one.mean_level_mm for one in effects] == pytest.approx(PER_SD_MM)
    assert [one.share for one in effects] == pytest.approx([0.36, 0.64, 0.0], abs=1e-9)
    assert [one.model for one in effects] == ["slot"] * 3
    assert together == pytest.approx(0.0, abs=1e-9)


def test_a_parabola_is_an_inputs_own_and_a_product_is_of_both_together():
    """The variances of z squared and of a product of two are 2 and 1."""
    curved = draws(lambda z: 0.5 * z[:, 0] + 0.1 * z[:, 1] ** 2 + 0.2 * z[:, 0] * z[:, 2])
    effects, together = curved.inputs.reported(S_MM)
    whole = 0.25 + 0.02 + 0.04
    assert [one.share for one in effects] == pytest.approx([0.25 / whole, 0.02 / whole, 0.0], abs=0.02)
    assert together == pytest.approx(0.04 / whole, abs=0.02)
    names = [one.name for one in curved.inputs.errors()]
    assert names[-1] == "inputs together, by the fast model"
    # All parts together have the spread of the runs.
    sums_mm = np.sum([one.draws_mm for one in curved.inputs.errors()], axis=0)
    assert np.std(sums_mm[:, 0]) == pytest.approx(np.std(curved.moved_mm[:, 0]), rel=0.03)


def test_effects_by_particles_have_shares_too():
    effects = tuple(Effect(name, 1.0, np.full(7, step)) for name, step in (("volume_ml", 0.3), ("depth_mm", -0.4)))
    inputs = Spread(S_MM, None, effects, None, None).inputs_at(S_MM)
    reported, together = inputs.reported(S_MM)
    assert [one.share for one in reported] == pytest.approx([0.36, 0.64])
    assert {one.model for one in reported} == {"particles"}
    assert together == 0
    assert [one.name for one in inputs.errors()] == [
        "volume given, by particles",
        "the crack's depth, by particles",
    ]
