"""Baselines that have seen as much of the readings as the simulation, and the words on them."""

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Profile
from tests.support.shapes import straight_slot
from validate.compare import compare
from validate.comparison import Baseline
from validate.metrics.verdict import against_baselines, beaten, best_curves, flat_levels, nearer_baseline

OUTLINE = straight_slot(80.0, 3.0)
SOLID = build_solid(OUTLINE, CrackShape(depth_mm=10.0, tilt="vertical"))
S_MM = np.linspace(0.0, 80.0, 17)
FAST_FILL = Profile(S_MM, -4.0 + 3.0 * np.cos(S_MM / 15.0) + 0.01 * S_MM)


def errors_mm(measured: Profile, *numbers: int) -> list[float]:
    return [one.mean_error_mm for one in best_curves(measured, 0.0, 80.0, numbers)]


def test_no_other_polynomial_comes_nearer():
    """Of 300 random changes of the best parabola's coefficients none is nearer, nor is least squares.

    Broken on purpose with least squares, some of them are nearer.
    """
    (best_mm,) = errors_mm(FAST_FILL, 3)
    fine_mm = np.linspace(0.0, 80.0, 1601)
    read_mm = np.interp(fine_mm, S_MM, FAST_FILL.level_mm)
    x = fine_mm / 40.0 - 1.0
    middle = np.polynomial.polynomial.polyfit(x, read_mm, 2)
    random = np.random.default_rng(0)
    tried = [middle, *(middle + 0.3 * random.standard_normal((300, 3)))]
    others_mm = [np.abs(np.polynomial.polynomial.polyval(x, one) - read_mm).mean() for one in tried]
    # The grid of the fit has eight points in a gap of 5 mm, on which an extremum is off by 0.001 mm.
    assert best_mm < min(others_mm) + 0.002


@pytest.mark.parametrize(("to_mm", "numbers"), [(80.0, [1, 15, 16]), (79.5, [1, 15])])
def test_a_curve_through_all_stations_that_are_compared_is_no_baseline(to_mm, numbers):
    """The station at 80 mm is beyond a crack of 79.5 mm."""
    assert [one.numbers for one in best_curves(FAST_FILL, 0.0, to_mm, (1, 15, 16, 17, 20))] == numbers


@pytest.mark.parametrize(
    ("role", "fitted", "names"),
    [
        ("calibrated-on", ("fluid.U",) * 6, ["a flat line", "a parabola", "a curve with 6 numbers"]),
        ("calibrated-on", None, ["a flat line", "a parabola"]),
        ("calibrated-on", (), ["the dispensed volume lying flat", "a flat line", "a parabola"]),
        ("held-out", None, ["the dispensed volume lying flat"]),
        ("undeclared", None, ["the dispensed volume lying flat", "a flat line", "a parabola"]),
    ],
)
def test_a_baseline_has_seen_no_more_than_the_simulation(role, fitted, names):
    """A curve through readings that were held out has seen them, and a fitted level more than the dispensed volume."""
    pool = flat_levels(FAST_FILL, OUTLINE, SOLID, 3000.0)
    how = {"role": role, "photo_data": "measured", "fitted": fitted, "unseen": pool}
    compared = compare(Profile(S_MM, FAST_FILL.level_mm + 0.5), FAST_FILL, OUTLINE, SOLID, **how)
    assert [one.name for one in compared.baselines] == names


def test_the_dispensed_volume_lies_flat():
    """In a slot 3 mm wide and 80 mm long its level is -2 mm."""
    readings = Profile(S_MM, np.full(17, -4.0))
    (pool,) = flat_levels(readings, OUTLINE, SOLID, 3.0 * 80.0 * 8.0)
    assert pool.mean_error_mm == pytest.approx(2.0, abs=1e-3)
    assert flat_levels(readings, OUTLINE, SOLID, 0.0) == ()


def test_nothing_fitted_is_another_declaration_than_none():
    """With nothing fitted the simulation has seen no more than the volume lying flat, and is judged by that alone."""
    pool, line = (Baseline(name=name, numbers=count, mean_error_mm=2.0 - count) for count, name in enumerate("ab"))
    words = [against_baselines(1.5, [pool, line], "calibrated-on", fitted) for fitted in (0, None)]
    assert "(no setting fitted) 1.50 mm" in words[0]
    assert words[1].endswith("B (1.00 mm) is nearer, unlike a (2.00 mm).")
    assert "(fitted settings not declared)" in words[1]
    assert [beaten(1.5, [pool, line], "calibrated-on", fitted) for fitted in (0, None)] == [True, False]
    assert not beaten(2.0, [pool], "held-out", None), "of two equal errors the baseline's needs no simulation"


@pytest.mark.parametrize(
    ("error_mm", "sentence"),
    [
        (2.5, "A flat line (2.00 mm) is nearer."),
        (1.5, "A parabola (1.00 mm) is nearer, unlike a flat line (2.00 mm)."),
        (1.0, "A parabola (1.00 mm) is nearer, unlike a flat line (2.00 mm)."),
        (0.7, "A curve (0.50 mm) is nearer, unlike a flat line (2.00 mm) and a parabola (1.00 mm)."),
        (0.1, "No baseline is nearer: a flat line (2.00 mm), a parabola (1.00 mm), a curve (0.50 mm)."),
    ],
)
def test_the_simplest_baseline_that_is_nearer_is_named_with_the_simpler_ones(error_mm, sentence):
    """With equal errors the baseline wins, since it needs no simulation."""
    baselines = Baseline("a flat line", 1, 2.0), Baseline("a parabola", 3, 1.0), Baseline("a curve", 4, 0.5)
    assert nearer_baseline(error_mm, baselines) == sentence
    assert nearer_baseline(error_mm, ()) == "There is no baseline to compare it with."
