"""How far the simulated level is from the readings, and what the readings are."""

from typing import Any

import numpy as np

from validate.evidence import Evidence
from validate.statements.table import NOT_RECORDED, Table, millimetres
from validate.wording import counted, percent, signed

SAME_MM2 = 1e-9


def agreement_table(evidence: Evidence) -> Table:
    assert evidence.comparison is not None
    comparison, metrics = evidence.comparison, evidence.comparison.metrics
    beats = "the simulation beats it" if metrics["beats_flat_level"] else "the simulation does NOT beat it"
    return Table(
        "Agreement with the readings",
        (
            ("role of the readings", metrics["role"]),
            (
                "covered length",
                f"{metrics['covered_length_mm']:.1f} mm, {percent(metrics['coverage'])} of the crack "
                f"({metrics['covered_from_mm']:.1f} to {metrics['covered_to_mm']:.1f} mm)",
            ),
            ("area between the curves, exact", f"{metrics['area_mm2']:.4f} mm²"),
            (
                "area by similaritymeasures",
                f"{metrics['area_similaritymeasures_mm2']:.4f} mm², {_apart(metrics['area_difference_mm2'])}",
            ),
            (
                "mean error = area / covered length",
                f"{comparison.mean_error_mm:.3f} mm{_interval(metrics, 'mean_error_mm')}",
            ),
            ("bias (simulated - measured)", f"{signed(metrics['bias_mm'], 3)} mm{_interval(metrics, 'bias_mm')}"),
            ("root mean square error", f"{metrics['rmse_mm']:.3f} mm"),
            ("95 % of the length within", f"{metrics['p95_error_mm']:.3f} mm"),
            ("Fréchet distance", f"{metrics['frechet_mm']:.3f} mm"),
            ("worst error", f"{comparison.worst_error_mm:.3f} mm at s = {comparison.worst_at_mm:.1f} mm"),
            ("length with less than 1 mm error", percent(metrics["share_under_1_mm"])),
            ("mean error, first 10 mm bin", millimetres(metrics["start_zone_error_mm"])),
            ("mean error, last 10 mm bin", millimetres(metrics["end_zone_error_mm"])),
            (
                "best flat level, as a baseline",
                f"{metrics['flat_level_mm']:.2f} mm, mean error {metrics['flat_level_error_mm']:.3f} mm: {beats}",
            ),
            (
                "room below the face",
                f"{metrics['simulated_underfill_mm3']:.0f} mm³ simulated, "
                f"{metrics['measured_underfill_mm3']:.0f} mm³ measured",
            ),
            (
                "sealant above the mouth",
                f"{metrics['simulated_overfill_mm3']:.0f} mm³ simulated, "
                f"{metrics['measured_overfill_mm3']:.0f} mm³ measured",
            ),
        ),
    )


def readings_table(evidence: Evidence) -> Table:
    assert evidence.comparison is not None
    assert evidence.readings is not None
    metrics = evidence.comparison.metrics
    readings = metrics["readings"]
    rows = [
        *_origin(evidence),
        *([("read as", evidence.readings.dialect)] if evidence.readings.dialect else []),
        ("data", evidence.readings.data),
        ("stations, readings", f"{readings['stations']}, {readings['readings']}"),
        (
            "stations compared",
            f"{metrics['stations_compared']} of {readings['stations']}, at most {metrics['widest_gap_mm']:.1f} mm from "
            "one to the next",
        ),
    ]
    if readings["repeatability_sd_mm"] is None:
        rows.append(("repeatability", "no repeats: the scatter of the readings is not known"))
    else:
        rows += [
            (
                "repeatability, pooled over the stations",
                f"{readings['repeatability_sd_mm']:.3f} mm standard deviation, "
                f"{counted(readings['degrees_of_freedom'], 'degree')} of freedom",
            ),
            (
                "95 % band of a station's mean, by the scatter of its repeats alone",
                f"± {np.max(readings['band_95_mm']):.3f} mm at most",
            ),
        ]
    return Table("Readings", tuple(rows))


def _interval(metrics: dict[str, Any], key: str) -> str:
    """By what is unsure about the readings; nothing where that was not assessed."""
    if (assessed := metrics.get("uncertainty")) is None:
        return ""
    low, high = (signed(end, 3) if key == "bias_mm" else f"{end:.3f}" for end in assessed[key])
    return f", 95 % interval by the readings {low} to {high} mm"


def _apart(area_mm2: float) -> str:
    """Two computations of one number, which differ by rounding."""
    return "the same to 1e-9 mm²" if abs(area_mm2) < SAME_MM2 else f"{area_mm2:+.1e} mm² apart"


def _origin(evidence: Evidence) -> list[tuple[str, str]]:
    """Which file was judged, and who read it."""
    assert evidence.readings is not None
    if (sheet := evidence.sheet) is None:
        return [("source", evidence.readings.source)]
    return [
        ("file", sheet.name),
        ("sha256 of the file", sheet.sha256),
        ("read by", sheet.operator or NOT_RECORDED),
        ("read on", sheet.date or NOT_RECORDED),
    ]
