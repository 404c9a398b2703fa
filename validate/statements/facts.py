"""The numbers of a report, each with its unit, as the tables of the page and the PDF."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sealtwin.records import Floats, Sections, Solid, Trajectory, arc_length
from validate.comparison.verdict import leak
from validate.evidence import Evidence
from validate.statements.health import health_rows
from validate.wording import counted, plain, words

Outcome = Literal["passed", "failed", "open"]
"""open: no readings, or no gate declared."""
NOT_RECORDED = "not recorded"
WITHOUT_ANGLE = {"vertical": "vertical walls", "modelled": "as in the mesh"}


@dataclass(frozen=True)
class Table:
    title: str
    rows: tuple[tuple[str, str], ...]


def headline(evidence: Evidence) -> tuple[str, Outcome]:
    """The verdict line, and how it ended."""
    comparison = evidence.comparison
    if comparison is None and evidence.run.escaped_particles:
        return f"{leak(evidence.run.escaped_particles)}. There are no readings.", "failed"
    if comparison is None:
        return "No readings: this is the simulated fill alone, held against nothing.", "open"
    outcomes: dict[bool | None, Outcome] = {True: "passed", False: "failed", None: "open"}
    return comparison.verdict, outcomes[comparison.passed]


def key_figures(evidence: Evidence) -> list[tuple[str, str]]:
    """The numbers that one looks for first, each with its unit."""
    run, comparison = evidence.run, evidence.comparison
    figures = []
    if comparison is not None:
        figures.append(("mean error", f"{comparison.mean_error_mm:.2f} mm"))
        if (assessed := comparison.metrics.get("uncertainty")) is not None:
            low_mm, high_mm = assessed["mean_error_mm"]
            figures.append(("its 95 % interval by the readings", f"{low_mm:.2f} to {high_mm:.2f} mm"))
        figures += [
            ("readings", comparison.metrics["role"]),
            ("worst error", f"{comparison.worst_error_mm:.2f} mm at {comparison.worst_at_mm:.0f} mm"),
        ]
    return [
        *figures,
        ("volume ratio", f"{evidence.volume_ratio:.3f}"),
        ("escaped particles", f"{run.escaped_particles}"),
        ("spilled particles", f"{run.spilled_particles}"),
        ("particles", f"{len(run.position_mm):,}"),
    ]


def photo_caption(evidence: Evidence) -> str:
    seen_in = evidence.outline.seen_in
    return (
        f"The walls and the centreline that were found, over the {seen_in}. {seen_in.capitalize()}: "
        f"{evidence.photo_data}. Scale: {evidence.outline.scale_source}."
    )


def agreement(evidence: Evidence) -> Table:
    assert evidence.comparison is not None
    comparison, metrics = evidence.comparison, evidence.comparison.metrics
    beats = "the simulation beats it" if metrics["beats_flat_level"] else "the simulation does NOT beat it"
    return Table(
        "Agreement with the readings",
        (
            ("role of the readings", metrics["role"]),
            (
                "covered length",
                f"{metrics['covered_length_mm']:.1f} mm, {metrics['coverage']:.1%} of the crack "
                f"({metrics['covered_from_mm']:.1f} to {metrics['covered_to_mm']:.1f} mm)",
            ),
            ("area between the curves, exact", f"{metrics['area_mm2']:.4f} mm²"),
            (
                "area by similaritymeasures",
                f"{metrics['area_similaritymeasures_mm2']:.4f} mm², {metrics['area_difference_mm2']:+.1e} mm² apart",
            ),
            (
                "mean error = area / covered length",
                f"{comparison.mean_error_mm:.3f} mm{_interval(metrics, 'mean_error_mm')}",
            ),
            ("bias (simulated - measured)", f"{metrics['bias_mm']:+.3f} mm{_interval(metrics, 'bias_mm')}"),
            ("root mean square error", f"{metrics['rmse_mm']:.3f} mm"),
            ("95 % of the length within", f"{metrics['p95_error_mm']:.3f} mm"),
            ("Fréchet distance", f"{metrics['frechet_mm']:.3f} mm"),
            ("worst error", f"{comparison.worst_error_mm:.3f} mm at s = {comparison.worst_at_mm:.1f} mm"),
            ("length with less than 1 mm error", f"{metrics['share_under_1_mm']:.1%}"),
            ("mean error, first 10 mm bin", _mm(metrics["start_zone_error_mm"])),
            ("mean error, last 10 mm bin", _mm(metrics["end_zone_error_mm"])),
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


def readings(evidence: Evidence) -> Table:
    assert evidence.comparison is not None
    assert evidence.readings is not None
    metrics = evidence.comparison.metrics
    readings = metrics["readings"]
    rows = [
        ("source", evidence.readings.source),
        *([("read as", evidence.readings.dialect)] if evidence.readings.dialect else []),
        ("data", evidence.readings.data),
        ("stations, readings", f"{readings['stations']}, {readings['readings']}"),
        (
            "stations compared",
            f"{metrics['stations_compared']}, at most {metrics['widest_gap_mm']:.1f} mm from one to the next",
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
            ("95 % band of a station's mean", f"± {np.max(readings['band_95_mm']):.3f} mm at most"),
        ]
    return Table("Readings", tuple(rows))


def mass_balance(evidence: Evidence) -> Table:
    run = evidence.run
    rows = [
        (label, f"{volume_mm3:.0f} mm³, {counted(round(volume_mm3 / run.particle_volume_mm3), 'particle')}")
        for label, volume_mm3 in volumes_mm3(evidence).values()
    ]
    rows.append(("volume that the settled particles fill, over dispensed", f"{evidence.volume_ratio:.3f}"))
    return Table("Where the sealant is", tuple(rows))


def volumes_mm3(evidence: Evidence) -> dict[str, tuple[str, float]]:
    """Where what was dispensed has gone, by key: in words, and its volume."""
    run = evidence.run
    height_mm = run.position_mm[~run.spilled, 2]
    counts = {
        "dispensed": ("dispensed", len(run.position_mm)),
        "in_crack": ("in the crack, below the face", int((height_mm <= 0).sum())),
        "above_face": ("above the face, the jet under the nozzle included", int((height_mm > 0).sum())),
        "spilled": ("spilled over the sample's edge", run.spilled_particles),
        "escaped": ("escaped through a wall (must be 0)", run.escaped_particles),
    }
    return {key: (label, count * run.particle_volume_mm3) for key, (label, count) in counts.items()}


def geometry(evidence: Evidence) -> Table:
    outline, solid, report = evidence.outline, evidence.solid, evidence.solid.report
    rows = [
        ("length along the centreline", f"{outline.length_mm:.2f} mm"),
        ("ends", ", ".join(outline.ends)),
        (f"width in the {outline.seen_in}, mean", f"{outline.mean_width_mm:.2f} mm"),
        (
            "mean width of the mouth, of the floor",
            f"{_mm(report.get('mouth_width_mm'))}, {_mm(report.get('floor_width_mm'))}",
        ),
        ("depth", _depth_words(solid.sections)),
        ("tilt", tilt_words(evidence)),
        ("volume of the cavity", f"{solid.cavity_volume_mm3:.0f} mm³"),
    ]
    if "volume_mm3" in report:
        readings = ", ".join(f"{tilt} {volume:.0f}" for tilt, volume in report["volume_mm3"].items())
        rows.append((f"volume by reading of the tilt, {_angle_words(solid)}", f"{readings} mm³"))
    if solid.tilt == "funnel" and "closing_depth_mm" in report:
        closing = report["closing_depth_mm"]
        rows.append(
            ("walls meet at", f"{closing['mean']:.1f} mm deep, above the floor on {closing['share_above_floor']:.0%}")
        )
    if dams := report.get("dams"):
        high_mm = max(dam["box_mm"][5] for dam in dams)
        rows.append(
            (
                "in crack.stl beside the sample",
                f"{counted(len(dams), 'dam')} at open ends, to {high_mm:g} mm above the face: no part of the sample",
            )
        )
    rows.append(("cavity over sealant", f"{solid.cavity_volume_mm3 / evidence.run.dispensed_volume_mm3:.2f}"))
    return Table("Crack and solid", tuple(rows))


def nozzle_path(evidence: Evidence) -> Table:
    trajectory = evidence.trajectory
    giving = trajectory.giving
    begins_mm, ends_mm = trajectory.s_mm[giving][[0, -1]]
    rows = [
        ("gives sealant from, to", f"s = {begins_mm:.1f} to {ends_mm:.1f} mm"),
        ("duration", f"{trajectory.duration_s:.2f} s in {counted(len(trajectory.t_s), 'waypoint')}"),
        ("speed", _span(trajectory.speed_mm_s[:-1], 2, "mm/s")),
        ("flow", _span(trajectory.flow_mm3_s[giving.start : giving.stop - 1], 1, "mm³/s")),
        ("height above the face", f"{trajectory.position_mm[:, 2].mean():.1f} mm"),
    ]
    if (path := evidence.solid.report.get("path")) is not None:
        rows.insert(1, ("length over the crack", _smoothed(path)))
    leads_mm = [arc_length(points)[-1] for points in _leads(trajectory)]
    if any(leads_mm):
        rows.append(("without sealant before, after", f"{leads_mm[0]:.1f} mm, {leads_mm[1]:.1f} mm"))
    return Table("Nozzle path", tuple(rows))


def _smoothed(path: dict[str, Any]) -> str:
    """A length means little without how much was smoothed away."""
    radius_mm = path["smallest_radius_mm"]
    bends = "" if radius_mm is None else f", smallest radius {radius_mm:.1f} mm"
    return (
        f"{path['length_mm']:.2f} mm, smoothed within {path['smoothing_mm']:g} mm RMS of the centreline's "
        f"{path['centreline_mm']:.2f} mm; turns by up to {path['largest_turn_deg']:.1f}°{bends}"
    )


def _leads(trajectory: Trajectory) -> tuple[Floats, Floats]:
    giving = trajectory.giving
    return trajectory.position_mm[: giving.start + 1], trajectory.position_mm[giving.stop - 1 :]


def _span(values: Floats, decimals: int, unit: str) -> str:
    """One number where they are the same as far as it is written, else the least and the most."""
    least, most = (f"{value:.{decimals}f}" for value in (values.min(), values.max()))
    return f"{least} {unit}" if least == most else f"{least} to {most} {unit}"


def health(evidence: Evidence) -> Table:
    return Table("Numerical health", (("device", evidence.run.device), *health_rows(evidence.run.health)))


def settings_in_effect(evidence: Evidence) -> Table:
    rows = []
    for group, content in evidence.run.settings.items():
        if isinstance(content, dict):
            rows += [(f"{group}: {words(key)}", plain(value)) for key, value in content.items() if value is not None]
        else:
            rows.append((group, plain(content)))
    return Table("Settings in effect", tuple(rows))


def tilt_words(evidence: Evidence) -> str:
    solid = evidence.solid
    if solid.tilt in WITHOUT_ANGLE:
        return WITHOUT_ANGLE[solid.tilt]
    return f"{solid.tilt}, {_angle_words(solid)} from vertical"


def _depth_words(sections: Sections) -> str:
    low_mm, high_mm = sections.depth_mm.min(), sections.depth_mm.max()
    return f"{high_mm:g} mm" if low_mm == high_mm else f"{low_mm:.3g} to {high_mm:.3g} mm, from station to station"


def _angle_words(solid: Solid) -> str:
    left_deg, right_deg = solid.wall_angles_deg
    return (
        f"each wall {left_deg:g}°" if left_deg == right_deg else f"left wall {left_deg:g}°, right wall {right_deg:g}°"
    )


def _mm(value: float | None) -> str:
    return NOT_RECORDED if value is None or np.isnan(value) else f"{value:.2f} mm"


def provenance(evidence: Evidence) -> Table:
    return Table("Versions and inputs", tuple(evidence.provenance.items()))


def _interval(metrics: dict[str, Any], key: str) -> str:
    """By what is unsure about the readings; nothing where that was not assessed."""
    if (assessed := metrics.get("uncertainty")) is None:
        return ""
    low, high = assessed[key]
    return f", 95 % interval by the readings {low:.3f} to {high:.3f} mm"
