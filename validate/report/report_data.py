"""The form of report.json, and the report of one trial in it.

``python -m validate.report.report_data`` prints the JSON Schema published as
validate/schema/report.schema.json.
"""

import json
import sys
from collections.abc import Iterable
from typing import Any, Literal

from sealtwin.core.comparison import (
    Baseline,
    BudgetPart,
    Comparison,
    ErrorBin,
    ErrorBudget,
    LevelMetrics,
    Outcome,
    Role,
    ShiftedError,
)
from sealtwin.core.earlier_trials import EarlierTrials
from sealtwin.core.predicted_level import PredictedPart
from sealtwin.core.records import DataKind, JsonRecord, Known
from validate.report_input import Evidence, ReadingsSheet
from validate.uncertainty.validation import with_time
from validate.units import PageTable, unit_of, words
from validate.wording.comparison import INPUTS, uncertainty_sentences, volumes_mm3
from validate.wording.headline import cautions, headline
from validate.wording.in_short import in_short
from validate.wording.prediction import prediction_sentences
from validate.wording.sample_and_run import HEALTH_LABELS, assumptions, left_out


class NumberWithUnit(JsonRecord):
    """A number with its unit."""

    value: Known
    """The number; None where it does not exist, as the error of a stretch without readings."""
    unit: str
    """Unit as it is written; "1" for a pure number."""
    meaning: str
    """Meaning in words."""
    interval_95: tuple[float, float] | None = None
    """Ends of the 95 % interval in the same unit; None where none was computed."""


class ReportedVerdict(JsonRecord):
    """The verdict on the comparison, and what it depends on."""

    sentence: str
    """Text that the report begins with: the sentences of ``headline``."""
    headline: tuple[str, ...]
    """Sentences on the gate, on the baselines, and on what the readings were used for before."""
    findings: tuple[str, ...]
    """Conclusions that ASME V&V 20 allows, or that it is not assessed; empty without a verdict."""
    outcome: Outcome
    """passed, failed: the gate lies outside the mean error's 95 % interval, or a particle escaped. undecided: the gate
    lies inside it, the readings are too few, or files were edited by hand. open: no readings, or no gate declared."""
    edited: tuple[str, ...]
    """Files of the run that are not as their stage wrote them: with one, nothing here is a result of the trial."""
    mean_error_limit_mm: float | None
    """Gate that the trial declared before the run."""
    gate_reason: str
    """Reason of the gate, in its user's words; empty where none is given."""
    role: Role | None
    """Use of the readings: the fluid was calibrated on them, or not; None without readings."""
    fitted: tuple[str, ...] | None
    """Settings that were fitted to the readings, by dotted name: empty if none was, None if nobody declared it."""
    photo_data: DataKind
    """Origin of the photo or the mesh; only measured data can validate."""
    readings_data: DataKind | None
    """Origin of the readings; None without any."""


class ReportedUncertainty(ErrorBudget):
    """Error of the mean level and the standard uncertainties of it, after ASME V&V 20."""

    sentences: tuple[str, ...]
    """Conclusions that these allow, and what is not included in them."""
    parts: tuple[BudgetPart, ...]
    """All errors that the intervals are made of, each alone."""
    missing: tuple[BudgetPart, ...]
    """Errors of the readings that nobody declared and no data can show; with what 0.2 mm of each would do."""


class ReportedPrediction(JsonRecord):
    """The level of a run without readings; prediction.json has it and its band along the crack."""

    mean_level_mm: float
    """Mean level along the crack, from the face."""
    mean_level_95_mm: tuple[float, float]
    """Ends of its 95 % interval."""
    sentences: tuple[str, ...]
    """Width of the band, and what it leaves out."""
    parts: tuple[PredictedPart, ...]
    """All errors that the band is made of, each alone."""


class ReadingsFile(ReadingsSheet):
    """The file of the readings."""

    dialect: str
    """Format of the sheet as it was understood, in a sentence."""


class ReportedSizes(JsonRecord):
    """One number at three particle sizes, from the finest to the coarsest."""

    radii_mm: tuple[float, ...]
    """Radii of the particles; the trial's own is in the middle."""
    runs: tuple[int, ...]
    """Number of runs at each radius, which differ in seed."""
    values_mm: tuple[float, ...]
    """Mean of the number over the runs of each radius."""
    scatter_mm: float | None
    """Standard deviation of the number in a single run; None where each size was run once, as are the next two."""
    order_95: tuple[float, float] | None
    """Ends of the 95 % range of the order of convergence, within 0.5 to 2."""
    band_95_mm: float | None
    """Half-width of 95 % of the error at the middle radius: least squares of f0 + a h^p, averaged over p."""


class ReportedInput(JsonRecord):
    """Change of the simulated level for an input that is larger by its declared standard uncertainty."""

    meaning: str
    """Name of the input in words."""
    standard: float
    """Declared standard uncertainty."""
    unit: str
    """Unit of ``standard``."""
    mean_level_mm: float
    """Change of the mean level."""
    largest_mm: float
    """Largest change of the level anywhere, as an absolute value."""
    share: float
    """Share of the mean level's variance by all inputs that this one makes alone: its first-order index."""
    model: str
    """Model that moved the input: particles, or slot for the fast model."""


class ReportData(JsonRecord):
    """Report of one trial: its results, their uncertainty and their origin."""

    schema_version: Literal[2] = 2
    """Version of this form; a larger one breaks programs that read a smaller one."""
    name: str
    """Name of the trial."""
    note: str
    """Note of the trial, in its user's words."""
    in_short: tuple[str, ...]
    """The answer in plain sentences."""
    verdict: ReportedVerdict
    """Verdict on the comparison."""
    cautions: tuple[str, ...]
    """Warnings that must be read before any number."""
    metrics: dict[str, NumberWithUnit]
    """Figures of simulated against measured level; empty without readings."""
    baselines: tuple[Baseline, ...] = ()
    """Levels without a simulation, held against the same readings; empty without readings."""
    readings: ReadingsFile | None
    """File of the readings; None without readings."""
    error_by_bin: tuple[ErrorBin, ...]
    """Mean absolute error along the crack, as in the report's histogram."""
    uncertainty: ReportedUncertainty | None
    """Uncertainty of the mean level; None where it was not assessed."""
    prediction: ReportedPrediction | None = None
    """Level of a run without readings, with its band; None with readings, or where no extra runs were made."""
    earlier_trials: EarlierTrials | None = None
    """The lab's earlier trials and what they make of this one; None where it has fewer than two that count."""
    sizes: dict[str, ReportedSizes]
    """Mean level and mean error at three particle sizes; empty where no other sizes were run."""
    inputs: dict[str, ReportedInput]
    """Effects of the inputs by their names in the trial's table [uncertainty]; empty where none was varied."""
    shifts: tuple[ShiftedError, ...]
    """Errors with the readings shifted along the crack, since s = 0 is a choice; empty without readings."""
    mass_balance: dict[str, NumberWithUnit]
    """Volume of the dispensed sealant by its place, counted in particles."""
    settled: dict[str, NumberWithUnit]
    """Volumes of the settled sealant beside that of the readings; empty without readings."""
    health: dict[str, NumberWithUnit | str]
    """Numbers that the run recorded about itself."""
    assumptions: tuple[str, ...]
    """Assumptions of the model, in sentences."""
    left_out: tuple[str, ...]
    """Data that count in no metric, and why."""
    provenance: dict[str, str]
    """Versions, device, seed, dates and hashes."""
    commands: tuple[str, ...]
    """Commands that make this report again, in order."""
    tables: tuple[PageTable, ...]
    """All tables of the page."""


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of report.json."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return head | ReportData.model_json_schema(mode="serialization")


UNREPORTED = (
    "baselines",
    "beats_baseline",
    "covered_length_mm",
    "fitted",
    "lab_searched",
    "length_mm",
    "stations_beyond_mm",
    "stations_used",
)
METRICS = [name for name, field in LevelMetrics.model_fields.items() if field.description and name not in UNREPORTED]
"""Figures that are reported as numbers with a unit."""


def report_data(evidence: Evidence, tables: tuple[PageTable, ...] = ()) -> ReportData:
    """Collect the content of report.json; ``tables`` are those of the page."""
    comparison, readings, sheet = evidence.comparison, evidence.readings, evidence.sheet
    told, outcome = headline(evidence)
    return ReportData(
        name=evidence.name,
        note=evidence.note,
        in_short=in_short(evidence),
        verdict=ReportedVerdict(
            sentence=" ".join(told),
            headline=told,
            findings=() if comparison is None else with_time(comparison.findings, evidence.extra_runs),
            outcome=outcome,
            edited=evidence.edited,
            mean_error_limit_mm=None if comparison is None else comparison.mean_error_limit_mm,
            gate_reason="" if comparison is None else comparison.gate_reason,
            role=None if comparison is None else comparison.metrics.role,
            fitted=None if comparison is None else comparison.metrics.fitted,
            photo_data=evidence.photo_data,
            readings_data=None if readings is None else readings.data,
        ),
        cautions=cautions(evidence),
        baselines=() if comparison is None else comparison.metrics.baselines,
        readings=sheet and readings and ReadingsFile(**dict(sheet), dialect=readings.dialect),
        prediction=_predicted(evidence),
        earlier_trials=evidence.earlier,
        mass_balance={
            key: NumberWithUnit(value=volume_mm3, unit="mm³", meaning=label)
            for key, (label, volume_mm3) in volumes_mm3(evidence).items()
        },
        health={key: _health(key, value) for key, value in evidence.run.health.recorded().items()},
        assumptions=tuple(assumptions(evidence)),
        left_out=tuple(left_out(evidence)),
        provenance=evidence.provenance,
        commands=evidence.commands,
        tables=tables,
        **_compared(comparison),
    )


def _predicted(evidence: Evidence) -> ReportedPrediction | None:
    if (found := evidence.prediction) is None:
        return None
    return ReportedPrediction(
        mean_level_mm=found.mean_level_mm,
        mean_level_95_mm=found.mean_level_95_mm,
        sentences=prediction_sentences(found),
        parts=found.parts,
    )


def _compared(comparison: Comparison | None) -> dict[str, Any]:
    """Return the parts of a report that depend on readings, by their keys."""
    content: dict[str, Any] = {"metrics": {}, "settled": {}, "sizes": {}, "inputs": {}}
    content |= {"error_by_bin": (), "shifts": (), "uncertainty": None}
    if comparison is None:
        return content
    found, volumes = comparison.uncertainty, comparison.volumes
    content["error_by_bin"] = comparison.metrics.error_by_bin
    content["metrics"] = _numbers(comparison.metrics, METRICS)
    if volumes is not None:
        content["metrics"] |= _numbers(volumes, ("volume_balance_level_mm", "volume_balance_error_mm"))
        balance = volumes.mass_balance
        content["settled"] = _numbers(balance, [key for key, _ in balance if key.endswith(("mm3", "mm2"))])
    if found is None:
        return content
    for key, interval in (("mean_error_mm", found.mean_error_interval_mm), ("bias_mm", found.bias_interval_mm)):
        content["metrics"][key] = content["metrics"][key].model_copy(update={"interval_95": interval})
    if (sizes := found.numerics) is not None:
        content["sizes"] = {
            key: ReportedSizes(
                radii_mm=sizes.radii_mm,
                runs=one.runs,
                values_mm=one.values,
                scatter_mm=one.scatter,
                order_95=one.order_95,
                band_95_mm=one.band,
            )
            for key, one in (("mean_level_mm", sizes.mean_level_mm), ("mean_error_mm", sizes.mean_error_mm))
        }
    for one in found.inputs:
        meaning, unit = INPUTS[one.name]
        content["inputs"][one.name] = ReportedInput(meaning=meaning, unit=unit, **one.model_dump(exclude={"name"}))
    content["uncertainty"] = ReportedUncertainty(
        **found.mean_level.model_dump(exclude={"inputs_waiting"}),
        sentences=tuple(uncertainty_sentences(found)),
        parts=found.budget.parts,
        missing=found.budget.missing,
    )
    return content | {"shifts": found.alignment.shifts}


def _numbers(record: JsonRecord, keys: Iterable[str]) -> dict[str, NumberWithUnit]:
    """Return figures of a record with the unit that their names end with and the meaning that their docstrings give."""
    return {
        key: NumberWithUnit(
            value=getattr(record, key),
            unit="1" if key.startswith("share") else unit_of(key),
            meaning=type(record).model_fields[key].description or words(key),
        )
        for key in keys
    }


def _health(key: str, value: Any) -> NumberWithUnit | str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    meaning = HEALTH_LABELS[key][0] if key in HEALTH_LABELS else words(key)
    return NumberWithUnit(value=value, unit=unit_of(key), meaning=meaning)


if __name__ == "__main__":
    sys.stdout.write(json.dumps(schema(), indent=2, ensure_ascii=False) + "\n")
