"""The report for programs: what report.json holds of one trial."""

from collections.abc import Iterable
from typing import Any

from sealtwin.records import Comparison
from validate.evidence import Evidence
from validate.reporting.report_form import (
    ErrorBin,
    Input,
    PageTable,
    Quantity,
    ReadingsFile,
    ReportData,
    Shift,
    Sizes,
    Uncertainty,
    Verdict,
)
from validate.statements.assumptions import assumptions, left_out
from validate.statements.cautions import cautions
from validate.statements.headline import findings, headline
from validate.statements.health import MEANING
from validate.statements.sealant import volumes_mm3
from validate.statements.table import Table
from validate.statements.uncertainty import INPUTS, uncertainty_sentences
from validate.wording import unit_of, words

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
