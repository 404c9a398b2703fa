"""The report for programs: what report.json holds, and the schema that is published for it.

python -m validate.reporting.report_data > validate/schema/report.schema.json
"""

import json
import sys
from collections.abc import Iterable
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from sealtwin.records import Comparison, DataKind, Outcome
from validate.evidence import Evidence
from validate.settings import Role
from validate.statements.assumptions import assumptions, left_out
from validate.statements.cautions import cautions
from validate.statements.headline import findings, headline
from validate.statements.health import MEANING
from validate.statements.sealant import volumes_mm3
from validate.statements.table import Table
from validate.statements.uncertainty import INPUTS, uncertainty_sentences
from validate.wording import unit_of, words

SCHEMA = "report.schema.json"
"""In validate/schema/."""
METRICS = {
    "mean_error_mm": "area between the simulated and the measured level over the covered length",
    "bias_mm": "mean of simulated minus measured level",
    "rmse_mm": "root mean square error",
    "frechet_mm": "Fréchet distance of the two levels",
    "p95_error_mm": "error that 95 % of the length stay below",
    "worst_error_mm": "largest error",
    "worst_at_mm": "where along the crack the largest error is",
    "area_mm2": "area between the two levels, exact",
    "area_similaritymeasures_mm2": "the same by the library that the paper used",
    "share_under_1_mm": "share of the covered length with an error below 1 mm",
    "start_zone_error_mm": "mean error over the first bin",
    "end_zone_error_mm": "mean error over the last bin",
    "flat_level_mm": "constant level that lies nearest to the readings: a baseline",
    "flat_level_error_mm": "mean error of that constant level",
    "volume_balance_level_mm": "level of the dispensed volume spread over the nozzle's reach: another baseline",
    "volume_balance_error_mm": "mean error of that level",
    "covered_from_mm": "where the comparison begins along the crack",
    "covered_to_mm": "where it ends",
    "coverage": "share of the crack's length that is compared",
    "simulated_underfill_mm3": "room below the face, simulated",
    "measured_underfill_mm3": "room below the face, measured",
    "simulated_overfill_mm3": "sealant above the mouth, simulated",
    "measured_overfill_mm3": "sealant above the mouth, measured",
    "simulated_fill_ratio": "share of the cavity filled over the covered length, simulated",
    "measured_fill_ratio": "share of the cavity filled over the covered length, measured",
    "stations_compared": "stations on the stretch that both curves cover",
    "widest_gap_mm": "from one station to the next, at most",
}
"""Of a comparison, by its keys in comparison.json; what was not computed is not there."""


SETTLED = {
    "dispensed_mm3": "dispensed",
    "in_crack_mm3": "settled in the crack, below the face, simulated",
    "above_mm3": "settled above the face, simulated",
    "spilled_mm3": "over the sample's edge, simulated",
    "lost_mm3": "lost by the numbers; below 0, gained",
    "footprint_mm2": "face beside the mouth under sealant",
    "readings_mm3": "held by the readings over the covered length",
    "readings_when_dispensed_mm3": "the same before it shrank, where that is declared",
}
"""Of the mass balance beside the readings, by its keys in comparison.json."""
SHARES = ("share_under_1_mm", "coverage")
"""Pure numbers, whatever their names end with."""
WITH_INTERVAL = ("mean_error_mm", "bias_mm")


class Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class Quantity(Part):
    """A number with its unit."""

    value: float | None
    """None where the number does not exist, as the error of a stretch without readings."""
    unit: str
    """As it is written; "1" for a pure number."""
    meaning: str
    """In words."""
    interval_95: tuple[float, float] | None = None
    """Ends of the 95 % interval in the same unit; None where none was computed."""


class Verdict(Part):
    """What the comparison comes to."""

    sentence: str
    """As the report leads with it."""
    findings: tuple[str, ...]
    """What ASME V&V 20 allows one to say, to be read with the sentence; empty where there is no verdict."""
    outcome: Outcome
    """passed, failed: the gate lies outside the mean error's 95 % interval, or the run leaks. undecided: inside it, or
    too few readings, or files edited by hand. open: no readings, or no gate declared."""
    edited: tuple[str, ...]
    """Files of the run that are not as their stage wrote them: with one, nothing here is a result of the trial."""
    mean_error_limit_mm: float | None
    """The gate that the trial declared before the run."""
    role: Role | None
    """Whether the fluid was tuned on these readings; None without readings."""
    photo_data: DataKind
    """Where the photo, or the mesh, comes from; only measured data can validate."""
    readings_data: DataKind | None
    """Where the readings come from; None without any."""


class ErrorBin(Part):
    """Mean absolute error over a stretch of the crack."""

    from_mm: float
    """Where it begins, along the crack from the end where the nozzle starts."""
    to_mm: float
    """Where it ends."""
    covered_mm: float
    """How much of it has readings."""
    mean_error_mm: float | None
    """None where nothing of it has."""


class Uncertainty(Part):
    """What the mean level's error may come from, as in ASME V&V 20; standard uncertainties."""

    error_mm: float
    """E: simulated less measured."""
    data_mm: float
    """Of the readings."""
    numerics_mm: float | None
    """Of the particles' size; None where no other sizes were run."""
    inputs_mm: float | None
    """Of the declared inputs; None where none was varied."""
    validation_mm: float
    """u_val: of all that is known, together."""
    resolved: bool
    """Whether E is larger than twice u_val: smaller, the data cannot tell that the model is off, nor that it is not."""
    sentences: tuple[str, ...]
    """What that allows one to say, and what is not in it."""


class ReadingsFile(Part):
    """Which readings were judged."""

    name: str
    """Of the file, as the user or the lab named it."""
    sha256: str
    """Of its content."""
    operator: str | None
    """Who read; None where no note says."""
    date: str | None
    """When it was read, as the lab writes it; None where no note says."""
    dialect: str
    """How the sheet was understood, in a sentence."""


class Sizes(Part):
    """One number at three particle sizes, from the finest to the coarsest."""

    radii_mm: tuple[float, ...]
    """Of the particles; the trial's own stands in the middle."""
    values_mm: tuple[float, ...]
    """The number at each of them."""
    kind: str
    """converging, no order, or oscillatory."""
    order: float | None
    """As observed; None where there is none."""
    band_95_mm: float
    """By the grid convergence index where it converges, else the spread of the three."""


class Input(Part):
    """What one declared standard uncertainty of an input does to the simulated level."""

    meaning: str
    """In words."""
    standard: float
    """As declared."""
    unit: str
    """Of it."""
    mean_level_mm: float
    """Change of the mean level for an input larger by that."""
    largest_mm: float
    """Largest change of the level anywhere, whatever its sign."""


class Shift(Part):
    """The comparison with the readings moved along the crack."""

    shift_mm: float
    """By how much."""
    mean_error_mm: float
    """Then."""
    bias_mm: float
    """Then."""


class PageTable(Part):
    """A table of the page, every number in words with its unit."""

    title: str
    """As on the page."""
    rows: tuple[tuple[str, str], ...]
    """Label, and what it labels."""


class ReportData(Part):
    """One trial: what was found, how sure that is, what it rests on."""

    schema_version: Literal[2] = 2
    """Larger where a program that reads this version would go wrong."""
    name: str
    """Of the trial."""
    note: str
    """Its user's own words."""
    verdict: Verdict
    """In one line, with what it takes to be more than a line."""
    cautions: tuple[str, ...]
    """What must be read before any number."""
    metrics: dict[str, Quantity]
    """Simulated against measured level; empty without readings."""
    readings: ReadingsFile | None
    """None without readings."""
    error_by_bin: tuple[ErrorBin, ...]
    """Along the crack, as in the report's histogram."""
    uncertainty: Uncertainty | None
    """None where none was assessed."""
    sizes: dict[str, Sizes]
    """Mean level and mean error at three particle sizes; empty where no other sizes were run."""
    inputs: dict[str, Input]
    """By their names in the trial's table [uncertainty]; empty where none is declared or none was varied."""
    shifts: tuple[Shift, ...]
    """Where s is 0 is a choice: what another one would make of the error. Empty without readings."""
    mass_balance: dict[str, Quantity]
    """Where the dispensed sealant is, as particles."""
    settled: dict[str, Quantity]
    """The same as volumes of settled sealant, beside what the readings hold; empty without readings."""
    health: dict[str, Quantity | str]
    """What the run recorded of itself."""
    assumptions: tuple[str, ...]
    """What was taken for granted."""
    left_out: tuple[str, ...]
    """Data that stand in no metric, and why."""
    provenance: dict[str, str]
    """Versions, device, seed, dates, hashes."""
    commands: tuple[str, ...]
    """What makes this report again, one after the other."""
    tables: tuple[PageTable, ...]
    """All that stand on the page, so that no number of it is missing here."""


def report_data(evidence: Evidence, tables: Iterable[Table] = ()) -> ReportData:
    """``tables`` are those of the page."""
    comparison, readings = evidence.comparison, evidence.readings
    metrics = {} if comparison is None else comparison.metrics
    sentence, outcome = headline(evidence)
    return ReportData(
        name=evidence.name,
        note=evidence.note,
        verdict=Verdict(
            sentence=sentence,
            findings=findings(evidence),
            outcome=outcome,
            edited=evidence.edited,
            mean_error_limit_mm=None if comparison is None else comparison.gate.get("mean_error_mm"),
            role=None if comparison is None else comparison.metrics["role"],
            photo_data=evidence.photo_data,
            readings_data=None if readings is None else readings.data,
        ),
        cautions=cautions(evidence),
        metrics={} if comparison is None else _metrics(comparison),
        readings=_readings(evidence),
        error_by_bin=() if comparison is None else tuple(_bin(part) for part in comparison.metrics["error_by_bin"]),
        uncertainty=_uncertainty(comparison),
        sizes=_sizes(metrics),
        inputs=_inputs(metrics),
        shifts=tuple(Shift(**row) for row in metrics.get("uncertainty", {}).get("alignment", {}).get("shifts", ())),
        mass_balance={
            key: Quantity(value=volume_mm3, unit="mm³", meaning=label)
            for key, (label, volume_mm3) in volumes_mm3(evidence).items()
        },
        settled={
            key: Quantity(value=metrics["mass_balance"][key], unit=unit_of(key), meaning=meaning)
            for key, meaning in SETTLED.items()
            if "mass_balance" in metrics
        },
        health={key: _health(key, value) for key, value in evidence.run.health.items()},
        assumptions=tuple(assumptions(evidence)),
        left_out=tuple(left_out(evidence)),
        provenance=evidence.provenance,
        commands=evidence.commands,
        tables=tuple(PageTable(title=table.title, rows=table.rows) for table in tables),
    )


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of report.json."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return head | ReportData.model_json_schema(mode="serialization")


def _metrics(comparison: Comparison) -> dict[str, Quantity]:
    numbers = comparison.metrics | {
        name: getattr(comparison, name) for name in ("mean_error_mm", "worst_error_mm", "worst_at_mm")
    }
    return {
        key: Quantity(
            value=_finite(numbers[key]),
            unit="1" if key in SHARES else unit_of(key),
            meaning=meaning,
            interval_95=_interval(numbers, key),
        )
        for key, meaning in METRICS.items()
        if key in numbers
    }


def _interval(numbers: dict[str, Any], key: str) -> tuple[float, float] | None:
    if key not in WITH_INTERVAL or "uncertainty" not in numbers:
        return None
    low, high = numbers["uncertainty"][key]
    return low, high


def _uncertainty(comparison: Comparison | None) -> Uncertainty | None:
    if comparison is None or "uncertainty" not in comparison.metrics:
        return None
    told = comparison.metrics["uncertainty"]["mean_level"]
    return Uncertainty(
        **{key: told[key] for key in ("error_mm", "data_mm", "numerics_mm", "inputs_mm", "validation_mm", "resolved")},
        sentences=tuple(uncertainty_sentences(comparison.metrics)),
    )


def _readings(evidence: Evidence) -> ReadingsFile | None:
    if evidence.readings is None or evidence.sheet is None:
        return None
    return ReadingsFile(**vars(evidence.sheet), dialect=evidence.readings.dialect)


def _sizes(metrics: dict[str, Any]) -> dict[str, Sizes]:
    found = metrics.get("uncertainty", {}).get("numerics")
    if found is None:
        return {}
    return {
        key: Sizes(
            radii_mm=found["radii_mm"],
            values_mm=found[key]["values"],
            kind=found[key]["kind"],
            order=found[key]["order"],
            band_95_mm=found[key]["band"],
        )
        for key in ("mean_level_mm", "mean_error_mm")
    }


def _inputs(metrics: dict[str, Any]) -> dict[str, Input]:
    inputs = {}
    for one in metrics.get("uncertainty", {}).get("inputs", ()):
        meaning, unit = INPUTS[one["name"]]
        numbers = {key: one[key] for key in ("standard", "mean_level_mm", "largest_mm")}
        inputs[one["name"]] = Input(meaning=meaning, unit=unit, **numbers)
    return inputs


def _bin(part: dict[str, float]) -> ErrorBin:
    return ErrorBin(
        from_mm=part["from_mm"],
        to_mm=part["to_mm"],
        covered_mm=part["covered_mm"],
        mean_error_mm=_finite(part["mean_error_mm"]),
    )


def _health(key: str, value: Any) -> Quantity | str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    meaning, _, _ = MEANING.get(key, (words(key), 1, ""))
    return Quantity(value=_finite(value), unit=unit_of(key), meaning=meaning)


def _finite(value: float) -> float | None:
    return float(value) if abs(value) < float("inf") else None


if __name__ == "__main__":
    sys.stdout.write(json.dumps(schema(), indent=2, ensure_ascii=False) + "\n")
