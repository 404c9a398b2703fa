"""The short answer of commands that run a trial."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sealtwin.cli.trial_answer import result_lines
from sealtwin.core.facts import doubt
from sealtwin.core.records import Profile
from sealtwin.core.solid_figures import WeighedCavity
from sealtwin.trial.job import StageName
from tests.support.evidence import FAST_FILL, SEEDS, make_evidence, slope
from tests.validate.test_assess import LIFTED, NO_PASSES, SHEET, spread
from validate.compare import assess
from validate.comparison import Comparison
from validate.intervals import BudgetPart, PredictedLevel
from validate.result import Evidence, FluidFigures, SampleFigures, TrialResult
from validate.settings import Gate, Uncertainty

GATE = Gate(mean_error_mm=1.6)
REMARK = doubt("fluid.liquid", "fluid.U is 30: at any U, sealant levels like a thin liquid until it freezes.")
SAMPLE: dict[str, Any] = {
    "data": "synthetic", "length_mm": 79.5, "mean_width_mm": 3.12, "width_source": "walls", "width_95_mm": None,
    "cavity_volume_mm3": 5949.0, "cavity_volume_95_mm3": None, "weighed": None, "sealant_mm3": 4800.0,
    "path_source": "ends", "scale_source": "8 4x4_50 markers of 16 mm", "mm_per_px": 0.1001,
    "scale_uncertainty": 0.00045, "scale_residual_mm": 0.004, "camera_tilt_deg": 3.4, "warnings": (),
}  # fmt: skip
FLUID: dict[str, Any] = {
    "particles": 14527, "escaped_particles": 0, "spilled_particles": 0, "above_face_mm3": 110.0, "unfit": None,
    "volume_ratio": 0.999, "device": "CPU", "warnings": (REMARK,),
}  # fmt: skip
WEIGHED = WeighedCavity(
    *((-9.0, -6.0), (100.0, 200.0), (1.0, 2.0), (3.0, 3.0), 3.1, 2.0, 12.0),
    *(((0.1, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.3)), (900.0, 1100.0)),
)


@pytest.fixture(scope="module")
def evidence(tmp_path_factory) -> Evidence:
    """A slope that is simulated 0.5 mm too high, read at nine stations."""
    return make_evidence(tmp_path_factory.mktemp("evidence"), error_mm=0.5)


def compared(evidence: Evidence, *, runs=None, gate: Gate | None = GATE, declared=NO_PASSES, **changes) -> Comparison:
    """Return a comparison; ``changes`` are settings of the readings."""
    return assess(evidence, SHEET.model_copy(update=changes), declared, runs, gate)


def lines_of(comparison: Comparison | None, last: StageName = "validate", printed=(), **parts: Any) -> list[str]:
    """Return the answer; of ``parts``, sample and fluid are figures that differ from the shipped trial's."""
    return result_lines(result_of(comparison, **parts), last, can_be_varied=True, printed=printed)


def result_of(comparison: Comparison | None, sample: Any = (), fluid: Any = (), **more: Any) -> TrialResult:
    return TrialResult.model_construct(
        folder="run",
        report="run/report.html",
        sample=SampleFigures.model_construct(**SAMPLE | dict(sample)),
        fluid=FluidFigures.model_construct(**FLUID | dict(fluid)),
        comparison=comparison,
        **more,
    )


def test_the_answer_about_a_crack_states_its_scale_with_residual_and_tilt(evidence):
    scale = next(line for line in result_lines(result_of(compared(evidence)), "digitise") if line.startswith("Scale"))
    assert "residual 0.004 mm, camera tilted 3.4 degrees" in scale


def test_the_first_line_says_that_a_line_was_found_without_clicks(evidence):
    first, *_ = lines_of(compared(evidence), "digitise", sample={"path_source": "found"})
    assert "found without clicks, perhaps a part of the crack, see overlay.png" in first
    assert not any("without clicks" in line for line in lines_of(compared(evidence), "digitise"))


def test_the_printed_answer_lists_each_reason_why_the_fast_model_is_unfit(evidence):
    unfit = doubt("unfit.mound", "A mound."), doubt("unfit.over", "It runs over the face.")
    method, other = doubt("method.fast", "By the fast model."), doubt("fluid.bond", "The Bond number is 0.9.")
    fluid = dict.fromkeys(("particles", "escaped_particles", "spilled_particles"))
    comparison = compared(replace(evidence, run=replace(evidence.run, fast_fill=FAST_FILL)))
    lines = lines_of(comparison, fluid=fluid | {"unfit": unfit, "warnings": (method, *unfit, other)})
    assert lines[1].startswith("Fluid    fast model, UNFIT for this case")
    assert lines[2:5] == [*(f"         {reason}" for reason in unfit), f"Warning  {other}"]
    assert any("No verdict: the level was computed by the fast model" in line for line in lines)
    assert lines[-1] == "Report   run/report.html"
    within = lines_of(comparison, fluid=fluid | {"unfit": (), "warnings": (method,)})
    assert within[1].startswith("Fluid    fast model, without particles; for screening only")


def few(evidence: Evidence) -> Evidence:
    """Return the evidence with readings at three of the nine stations."""
    s_mm = np.array([5.0, 10.0, 15.0])
    return replace(evidence, readings=Profile(s_mm, slope(s_mm), data="measured"))


PREDICTED = PredictedLevel.model_construct(
    mean_level_mm=-5.0,
    mean_level_95_mm=(-6.0, -4.0),
    band_95_mm=np.array([1.0, 2.0, 9.0]),
    numerics_mm=0.1,
    parts=(BudgetPart("volume", "", "declared", "inputs", 0.1, None, 0.1),),
    inputs=(),
    fast_level_mm=np.full(3, -5.2),
    missing=(),
    inputs_left_out=(),
)
# fmt: off
COMPARED = {
    "held out": (lambda e: compared(e), [
        "Held out, as declared", "Mean errors: simulation 0.50 mm, ",
        "outside the 95 % band of the whole profile at 9 of 9 stations",
        "Gate passed: mean error 0.50 mm"]),
    "gate undecided": (lambda e: compared(e, gate=Gate(mean_error_mm=0.5)), ["Gate undecided: mean error 0.50 mm"]),
    "no gate": (lambda e: compared(e, gate=None), ["No gate is declared: mean error 0.50 mm"]),
    "within errors": (lambda e: compared(replace(e, profile=Profile(e.profile.s_mm, e.profile.level_mm - 0.5))),
        ["outside the 95 % band of the whole profile at none of 9 stations"]),
    "extra runs": (lambda e: compared(e, runs=spread(effects=[LIFTED]), declared=Uncertainty(volume_ml=0.1)),
        ["errors of readings, numerics and inputs, mostly", "ASME V&V 20: E = +0.50 mm"]),
    "few readings": (lambda e: compared(few(e)),
        ["Result   No verdict: the readings cover", "Held out"]),
    "edited": (lambda e: compared(replace(e, edited=("profile.csv",))),
        ["Result   Files were edited by hand after the run (profile.csv)"]),
    "escaped": (lambda e: compared(replace(e, run=replace(e.run, escaped_particles=2))),
        ["Result   Do not use this run: 2 particles"]),
}
WITHOUT_READINGS: dict[str, tuple[dict[str, Any], list[str]]] = {
    "edited": ({"edited": ("profile.csv",)},
        ["Warning  ", "Files were edited by hand after the run (profile.csv)", "No readings: "]),
    "escaped": ({"fluid": {"escaped_particles": 2}}, ["Fluid    2 particles escaped"]),
    "spilled": ({"fluid": {"spilled_particles": 12}}, ["face, 12 particles ran over "]),
    "on the face": ({"fluid": {"above_face_mm3": 1110.0}}, ["; 1.1 ml are above the "]),
    "no readings": ({}, ["Result   No readings: ", "adds a 95 % band)"]),
    "prediction": ({"prediction": PREDICTED},
        ["the mean level is -5.00 mm from the face", "± 2.00 mm (95 %, median of all places"]),
    "seeds": ({"seeds": SEEDS}, ["Seeds    The level is the mean of 3 runs"]),
    "weighed": ({"sample": {"weighed": WEIGHED}}, ["Cavity   by weight (2 steps, 95 %): width 3.10 ± 0.20 mm"]),
}
# fmt: on
UNVARIED = {"extra runs", "few readings", "edited", "escaped"}
"""Results to which extra runs can add nothing."""


@pytest.mark.parametrize("kind", COMPARED)
def test_the_printed_answer_states_the_outcome_of_each_kind_of_comparison(evidence, kind):
    comparison, expected = COMPARED[kind]
    lines = lines_of(comparison(evidence))
    assert [text for text in expected if text not in "\n".join(lines)] == []
    assert kind not in UNVARIED or "--uncertainty" not in lines[-1]


@pytest.mark.parametrize("kind", WITHOUT_READINGS)
def test_the_printed_answer_of_a_trial_without_readings_states_the_kind_of_result(kind):
    parts, expected = WITHOUT_READINGS[kind]
    lines = lines_of(None, **parts)
    assert [text for text in expected if text not in "\n".join(lines)] == []
    assert kind != "prediction" or "--uncertainty" not in lines[-1]
