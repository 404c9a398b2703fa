"""Verdicts, and the least readings that allow one."""

import numpy as np
import pytest

from sealtwin.core.facts import doubt
from validate.comparison import Basis, Comparison, ErrorFigures
from validate.intervals import BudgetSummary, ErrorUncertainty
from validate.metrics.verdict import basis_of, judged
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
    reason="",
    scatter_known=True,
    edited=(),
    screening=False,
    findings=((), ()),
    mean_error_mm=0.1,
    **more,
) -> Comparison:
    """Return the judgement on a crack of 80 mm; ``more`` are fields of the comparison."""
    budget = BudgetSummary.model_construct(scatter_known=scatter_known)
    parts = {"budget": budget, "findings": findings[0], "unused": findings[1]}
    uncertainty = ErrorUncertainty.model_construct(mean_error_interval_mm=interval_mm, **parts) if interval_mm else None
    errors = ErrorFigures(mean_error_mm, *[0.0] * 6)
    comparison = Comparison.model_construct(**JUDGED | more, errors=errors, basis=basis, uncertainty=uncertainty)
    return judged(
        comparison, None if gate is None else Gate(mean_error_mm=gate, reason=reason), edited, screening=screening
    )


@pytest.mark.parametrize("case", [{"screening": True}, EDITED, {"basis": FEW}])
def test_what_is_declared_and_not_used_is_said_without_a_verdict_too(case):
    resolved, unused = doubt("validation.mean-level", "Resolved."), doubt("readings.repeatability-unused", "Not used.")
    both = {"interval_mm": (0.0, 0.2), "findings": ((resolved, unused), (unused,))}
    assert judgement_of(**both).findings == (resolved, unused)
    assert judgement_of(**both, **case).findings == (unused,)


@pytest.mark.parametrize(
    ("s_mm", "suffices"),
    [
        ([8, 20, 30, 40, 50, 60, 72], True),
        ([8, 20, 30, 40, 50, 60, 71.9], False),
        ([8, 24, 40, 50, 60, 72], False),
        ([0, 0.1, 0.2, 0.3, 0.4, 0.5, 80], False),
        ([0, 24, 40, 50, 56, 60, 80], True),
        ([0, 24.1, 40, 50, 56, 60, 80], False),
    ],
)
def test_seven_stations_over_four_fifths_none_far_from_the_next(s_mm, suffices):
    judgement = judgement_of(basis_of(np.array(s_mm, dtype=float), s_mm[0], s_mm[-1], 80.0))
    assert judgement.passed is suffices
    assert ("Gate passed: " if suffices else "No verdict: the readings cover") in judgement.verdict


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ({"readings_data": "undeclared"}, "these undeclared readings"),
        ({"readings_data": "reconstructed", "role": "calibrated-on"}, "Calibrated on these reconstructed readings"),
        ({"photo_data": "synthetic"}, "The sample is synthetic."),
        ({"role": "undeclared"}, "is not declared: set readings.role"),
        ({}, "Held out, as declared"),
        (
            {"role": "calibrated-on", "fitted": FITTED, "basis": basis(16, 1.0, 5.0, enough=True)},
            "(fitted at 16 stations: viscosity weight (U), age at freezing, wall angle)",
        ),
        ({"role": "calibrated-on", "fitted": ()}, "with no fitted setting as declared: not a test."),
    ],
)
def test_a_kept_gate_validates_nothing_and_says_what_it_rests_on(case, words):
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
    # A share is never rounded up to what is needed.
    ({"basis": basis(5, 0.7999, 16.0, enough=False)}, "undecided", False, "No verdict: the readings cover 79 % of"),
    (EDITED | WIDTH, "undecided", False, "Files were edited by hand after the run (profile.csv): no verdict."),
    ({"basis": FEW} | LEAK, "failed", False, "Do not use this run: 1 particle went through a wall"),
    (LEAK | EDITED, "failed", False, "Do not use this run: 1 particle"),
]


@pytest.mark.parametrize(("case", "outcome", "passed", "words"), CASES)
def test_what_cannot_be_told_is_neither_passed_nor_failed(case, outcome, passed, words):
    """The verdict never begins with a gate: it is no answer to how near the level is."""
    judgement = judgement_of(**case)
    assert (judgement.outcome, judgement.passed) == (outcome, passed)
    assert words in judgement.verdict
    assert not judgement.verdict.startswith(("Gate", "No gate"))
