"""Verdicts, the readings that they need, and baselines."""

import re

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Profile
from tests.support.shapes import straight_slot
from validate.compare import compare
from validate.comparison import Baseline, Basis, Comparison, ErrorFigures
from validate.intervals import BudgetSummary, ErrorUncertainty
from validate.metrics.verdict import (
    against_baselines,
    basis_of,
    with_verdict,
)
from validate.settings import Gate

GATE = 1.6
FITTED = "fluid.U", "fluid.freeze_after_s", "crack.wall_angle_deg"


def basis(stations: int, coverage: float, gap_mm: float, *, enough: bool) -> Basis:
    """Stations on a crack of 80 mm, as all in this file."""
    figures = {"stations_compared": stations, "stations_used": stations, "widest_gap_mm": gap_mm, "length_mm": 80.0}
    return Basis.model_construct(**figures, coverage=coverage, enough_readings=enough)


ENOUGH = basis(17, 1.0, 5.0, enough=True)
JUDGED = {"escaped_particles": 0, "readings_data": "measured", "photo_data": "measured", "role": "held-out"}

FEW = basis(4, 1.0, 24.0, enough=False)
EDITED = {"edited": ("profile.csv",)}
LEAK = {"escaped_particles": 1}
WIDTH = {"interval_mm": (0.05, 0.15)}


def judgement_of(
    basis=ENOUGH,
    gate: float | None = GATE,
    interval_mm=None,
    *,
    scatter_known=True,
    edited=(),
    screening=False,
    findings=(),
    mean_error_mm=0.1,
    **more,
) -> Comparison:
    """Return the judgement on a crack of 80 mm; ``more`` are fields of the comparison."""
    budget = BudgetSummary.model_construct(scatter_known=scatter_known)
    parts = {"budget": budget, "findings": findings}
    uncertainty = ErrorUncertainty.model_construct(mean_error_interval_mm=interval_mm, **parts) if interval_mm else None
    errors = ErrorFigures(mean_error_mm, *[0.0] * 6)
    comparison = Comparison.model_construct(**JUDGED | more, errors=errors, basis=basis, uncertainty=uncertainty)
    return with_verdict(comparison, None if gate is None else Gate(mean_error_mm=gate), edited, screening=screening)


@pytest.mark.parametrize(
    ("s_mm", "suffices"),
    [
        ([8, 20, 30, 40, 50, 60, 72], True),
        ([8, 20, 30, 40, 50, 60, 71.9], False),
        ([0, 0.1, 0.2, 0.3, 0.4, 0.5, 80], False),
        ([0, 24, 40, 50, 56, 60, 80], True),
        ([0, 24.1, 40, 50, 56, 60, 80], False),
    ],
)
def test_a_verdict_needs_seven_stations_over_80_percent_without_large_gaps(s_mm, suffices):
    judgement = judgement_of(basis_of(np.array(s_mm, dtype=float), s_mm[0], s_mm[-1], 80.0))
    assert judgement.passed is suffices
    assert ("Gate passed: " if suffices else "No verdict: the readings cover") in judgement.verdict


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ({"readings_data": "reconstructed", "role": "calibrated-on"}, "Calibrated on these reconstructed readings"),
        ({"photo_data": "synthetic"}, "The sample is synthetic."),
        ({"role": "undeclared"}, 'is not declared: give role = "held-out"'),
        (
            {"role": "calibrated-on", "fitted": FITTED, "basis": basis(16, 1.0, 5.0, enough=True)},
            "(fitted at 16 stations: viscosity weight (U), age at freezing, wall angle)",
        ),
        ({"role": "calibrated-on", "fitted": ()}, "with no fitted setting as declared: not a test."),
    ],
)
def test_the_verdict_of_a_passed_gate_never_claims_a_validation(case, words):
    judgement = judgement_of(**case)
    assert judgement.passed
    assert words in judgement.headline[1].text
    assert "alidated" not in judgement.verdict


CASES = [
    # The gate is checked against the mean error and keeps its exit code; the outcome regards the interval.
    ({"mean_error_mm": 1.5, "interval_mm": (1.41, 1.59)}, "passed", True, "Gate passed: mean error 1.50 mm (95 % in"),
    ({"mean_error_mm": 1.5, "interval_mm": (1.39, 1.61)}, "undecided", True, "Gate undecided: mean error 1.50 mm"),
    ({"mean_error_mm": 1.7, "interval_mm": (1.59, 1.81)}, "undecided", False, "Gate undecided: mean error 1.70 mm"),
    ({"mean_error_mm": 1.7, "interval_mm": (1.61, 1.79)}, "failed", False, "Gate failed: mean error 1.70 mm"),
    ({"interval_mm": (0.0, 0.2), "scatter_known": False}, "passed", True, "from the readings, whose scatter is unk"),
    ({"gate": None}, "open", None, "No gate is declared: "),
    # A coverage is never rounded up to the limit.
    ({"basis": basis(5, 0.7999, 16.0, enough=False)}, "undecided", False, "No verdict: the readings cover 79 % of"),
    (EDITED | WIDTH, "undecided", False, "Files were edited by hand after the run (profile.csv): no verdict."),
    ({"basis": FEW} | LEAK, "failed", False, "Do not use this run: 1 particle went through a wall"),
]


@pytest.mark.parametrize(("case", "outcome", "passed", "words"), CASES)
def test_the_outcome_follows_from_gate_interval_readings_and_faults(case, outcome, passed, words):
    """The verdict does not begin with the gate, which does not state how near the level is."""
    judgement = judgement_of(**case)
    assert (judgement.outcome, judgement.passed) == (outcome, passed)
    assert words in judgement.verdict
    assert not judgement.verdict.startswith(("Gate", "No gate"))


CRACK = straight_slot(80.0, 3.0)
SOLID = build_solid(CRACK, CrackShape(depth_mm=10.0, tilt="vertical"))
S_MM = np.linspace(0.0, 80.0, 17)
FAST_FILL = Profile(S_MM, -4.0 + 3.0 * np.cos(S_MM / 15.0) + 0.01 * S_MM)


@pytest.mark.parametrize(
    ("role", "fitted", "names"),
    [
        ("calibrated-on", ("fluid.U",) * 6, ["a flat line", "a parabola", "a curve with 6 numbers"]),
        ("calibrated-on", None, ["a flat line", "a parabola"]),
        ("calibrated-on", (), ["a flat level of the dispensed volume", "a flat line", "a parabola"]),
        ("held-out", None, ["a flat level of the dispensed volume"]),
        ("undeclared", None, ["a flat level of the dispensed volume", "a flat line", "a parabola"]),
    ],
)
def test_a_baseline_uses_no_more_readings_than_the_simulation(role, fitted, names):
    """A curve through held-out readings would use them, and a fitted level uses more than the dispensed volume."""
    pool = Baseline("a flat level of the dispensed volume", 0, 1.0)
    declared = {"role": role, "photo_data": "measured", "fitted": fitted, "unseen": [pool]}
    compared = compare(Profile(S_MM, FAST_FILL.level_mm + 0.5), FAST_FILL, CRACK, SOLID, **declared)
    assert [curve.name for curve in compared.baselines] == names


@pytest.mark.parametrize(
    ("error_mm", "names"), [(2.5, ["a flat line"]), (1.0, ["a parabola"]), (0.7, ["a curve"]), (0.1, [])]
)
def test_the_simplest_baseline_that_is_nearer_than_the_simulation_is_named(error_mm, names):
    """With equal errors the baseline wins, since it needs no simulation."""
    baselines = Baseline("a flat line", 1, 2.0), Baseline("a parabola", 3, 1.0), Baseline("a curve", 4, 0.5)
    text = against_baselines(error_mm, baselines, "calibrated-on", 4)
    assert re.findall(r"nearer the readings: (.*)\.", text) == names
    assert "no baseline" in against_baselines(error_mm, (), "calibrated-on", 4)
