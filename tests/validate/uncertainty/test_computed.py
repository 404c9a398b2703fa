"""The numerical error from three runs of three particle sizes, and the effects of the inputs."""

import json
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from sealtwin.core.errors import InputError
from sealtwin.core.files import as_json
from validate.uncertainty.budget import Budget
from validate.uncertainty.computed import (
    RUNS,
    InputDraws,
    Inputs,
    Replicates,
    SizeRuns,
    Spread,
    drawn_inputs,
    effects_of,
    size_series,
    two_level_design,
)

RADII_MM = (1 / 1.3, 1.0, 1.3)
APART_MM = np.array([-0.05, 0.0, 0.05])
"""Differences of three runs of one size from their mean."""


def replicates(means_mm, apart_mm: ArrayLike = APART_MM) -> Replicates:
    """Three runs for each mean, of one number."""
    return Replicates(RADII_MM, [mean_mm + np.asarray(apart_mm)[:, None] for mean_mm in means_mm])


def band_mm(means_mm, apart_mm: ArrayLike = APART_MM) -> float:
    """The 95 % half-width of the middle size's error."""
    return size_series([(mean_mm + np.asarray(apart_mm)).tolist() for mean_mm in means_mm], RADII_MM).band


@pytest.mark.parametrize("order", [0.6, 1.0, 1.7])
def test_the_order_and_the_error_of_an_exact_power_law_are_recovered(order):
    means_mm = [5.0 + 0.3 * h**order for h in RADII_MM]
    assert replicates(means_mm, [0.0] * 3).orders(4000) == pytest.approx(np.full(4000, order), abs=0.03)
    assert band_mm(means_mm, [0.0] * 3) == pytest.approx(0.3, rel=0.06)


ALONG_MM = np.linspace(0.0, 40.0, 9)


def spread_of(*runs_mm: Any) -> Spread:
    """Runs of three sizes along 40 mm of crack."""
    fine, middle, coarse = (SizeRuns(radius_mm, runs) for radius_mm, runs in zip(RADII_MM, runs_mm, strict=True))
    return Spread(ALONG_MM, (fine, middle, coarse), (), None, None)


def test_copied_or_single_extra_runs_are_refused():
    """Broken on purpose, a copy counts as a run, and the scatter of runs falls from 0.050 to 0.044 mm.

    A single run of each size has no scatter, and the band would be 0.
    """
    runs_mm = 0.1 * np.sin(ALONG_MM) + APART_MM[:, None]
    sizes = [runs_mm + radius_mm for radius_mm in RADII_MM]
    assert spread_of(*sizes).sizes_at(ALONG_MM) is not None
    with pytest.raises(InputError, match=r"1\.3 mm: the runs with seed \+ 1 and with seed \+ 2 .* solver\.radius_mm"):
        spread_of(*sizes[:2], runs_mm[[0, 1, 1]])
    nothing = Spread(ALONG_MM, None, (), None, None)
    for spread, words in (
        (spread_of(*(size[:1] for size in sizes)), "fewer than 2 runs"),
        (nothing, "neither runs of"),
    ):
        with pytest.raises(ValueError, match=words):
            Spread.of(json.loads(as_json(spread.content())))


def test_a_two_level_design_gives_exact_linear_effects_and_their_scatter():
    """Eight runs that scatter by 0.2 leave 0.2 / sqrt(8) in an effect; two columns at 400 positions give it to 3 %."""
    slopes = np.array([[0.3, -1.0, 0.0], [0.05, 0.2, 2.0], [-0.4, 0.0, 0.1], [1.0, 1.0, 1.0], [0.0, 0.5, -0.5]])
    results = np.array(7.0 + two_level_design(5) @ slopes, dtype=np.float64)
    effects, scatter = effects_of(results, 5)
    assert effects == pytest.approx(slopes)
    assert scatter == pytest.approx(0.0, abs=1e-12)
    noise = np.random.default_rng(1).normal(0, 0.2, (8, 400))
    _, scatter = effects_of(noise, 5)
    assert scatter == pytest.approx(0.2 / np.sqrt(8), rel=0.1)
    assert effects_of(noise[:4], 3)[1] is None


S_MM = np.linspace(0.0, 60.0, 7)
STANDARDS = {"volume_ml": 0.1, "depth_mm": 0.5, "width_mm": 0.1}
PER_SD_MM = np.array([0.3, -0.4, 0.0])


def draws(make) -> InputDraws:
    """Levels that ``make`` gives for draws of the inputs, the same along the crack."""
    return InputDraws(S_MM, STANDARDS, make(drawn_inputs(STANDARDS))[:, None] * np.ones(len(S_MM)))


def u_mm(inputs: Inputs) -> float:
    level = np.full(len(S_MM), 1 / len(S_MM)), np.zeros(len(S_MM) - 1)
    return Budget(len(S_MM), tuple(inputs.errors())).mean_mm(level) / 2


def test_the_uncertainty_of_a_linear_model_is_the_root_sum_of_squares():
    linear = draws(lambda z: z @ PER_SD_MM)
    assert len(linear.moved_mm) == RUNS
    # Twice u is the interval of 95 %, 1.96 standard deviations of a normal one.
    assert u_mm(linear.inputs) == pytest.approx(0.98 * 0.5, rel=0.02)
    effects, together = linear.inputs.reported(S_MM)
    assert [effect.mean_level_mm for effect in effects] == pytest.approx(PER_SD_MM)
    assert [effect.share for effect in effects] == pytest.approx([0.36, 0.64, 0.0], abs=1e-9)
    assert [effect.model for effect in effects] == ["slot"] * 3
    assert together == pytest.approx(0.0, abs=1e-9)


def test_a_quadratic_effect_is_attributed_to_its_input_and_a_product_to_the_interaction():
    """The variances of z squared and of a product of two are 2 and 1."""
    curved = draws(lambda z: 0.5 * z[:, 0] + 0.1 * z[:, 1] ** 2 + 0.2 * z[:, 0] * z[:, 2])
    effects, together = curved.inputs.reported(S_MM)
    whole = 0.25 + 0.02 + 0.04
    assert [effect.share for effect in effects] == pytest.approx([0.25 / whole, 0.02 / whole, 0.0], abs=0.02)
    assert together == pytest.approx(0.04 / whole, abs=0.02)
    names = [effect.name for effect in curved.inputs.errors()]
    assert names[-1] == "inputs in combination, by the fast model"
    # All parts together have the spread of the runs.
    sums_mm = np.sum([effect.draws_mm for effect in curved.inputs.errors()], axis=0)
    assert np.std(sums_mm[:, 0]) == pytest.approx(np.std(curved.moved_mm[:, 0]), rel=0.03)
