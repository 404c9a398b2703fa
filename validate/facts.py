"""What a report says in words and numbers, for the page and the PDF alike."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sealtwin.records import Floats, Sections, Solid, Trajectory, arc_length
from sealtwin.regime import SURFACE_TENSION_N_M, regime_of
from validate.evidence import Evidence
from validate.health import health_rows
from validate.verdict import leak
from validate.wording import counted, plain, words

NOT_RECORDED = "not recorded"
WITHOUT_ANGLE = {"vertical": "vertical walls", "modelled": "as in the mesh"}


@dataclass(frozen=True)
class Table:
    title: str
    rows: tuple[tuple[str, str], ...]


def headline(evidence: Evidence) -> tuple[str, str]:
    """The verdict line, and how it ended: "passed", "failed" or "open"."""
    comparison = evidence.comparison
    if comparison is None and evidence.run.escaped_particles:
        return f"{leak(evidence.run.escaped_particles)}. There are no readings.", "failed"
    if comparison is None:
        return "No readings: this is the simulated fill alone, held against nothing.", "open"
    return comparison.verdict, {True: "passed", False: "failed", None: "open"}[comparison.passed]


def key_figures(evidence: Evidence) -> list[tuple[str, str]]:
    """The numbers that one looks for first, each with its unit."""
    run, comparison = evidence.run, evidence.comparison
    figures = []
    if comparison is not None:
        figures += [
            ("mean error", f"{comparison.mean_error_mm:.2f} mm"),
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


def tables(evidence: Evidence) -> list[Table]:
    agreement = [] if evidence.comparison is None else [_agreement(evidence), _repeats(evidence)]
    return [
        *agreement,
        _mass_balance(evidence),
        _geometry(evidence),
        _path(evidence),
        _health(evidence),
        _settings(evidence),
        Table("Provenance", (*evidence.provenance.items(), ("made again by", evidence.command))),
    ]


def assumptions(evidence: Evidence) -> list[str]:
    """Sentences on what was taken for granted, with the numbers that say how much hangs on it."""
    solver, fluid = (evidence.run.settings.get(key, {}) for key in ("solver", "fluid"))
    sentences = [_tilt(evidence), _surface_tension(evidence)]
    freeze = fluid.get("freeze_after_s")
    if isinstance(freeze, int | float):
        sentences.append(
            f"A particle is fixed where it lies {freeze:g} s after its release. This stands for the paste's stiffening "
            "and holds the slope of the bed; the paper has the same as a limit of moving particles."
        )
    curing_pa_s = fluid.get("structuration_pa_per_s", 0.0)
    yield_stress_pa = fluid.get("yield_stress_pa", 0.0)
    if yield_stress_pa or curing_pa_s:
        grows = f", and {curing_pa_s:g} Pa more each second" if curing_pa_s else ""
        sentences.append(
            f"The paste is a Bingham fluid: it stands below a yield stress of {yield_stress_pa:g} Pa{grows}, in the "
            "fluid and along the walls, which are taken for rough. This holds the slope of the bed."
        )
    left_out = "Shrinkage is" if curing_pa_s else "Curing and shrinkage are"
    sentences += [
        f"The profile is taken {solver.get('settle_s', 0.0):g} s after the last release. {left_out} not modelled, "
        "while a caliper reads the cured sealant.",
        "Simulated and measured s both count from the first end given; neither curve is shifted to fit the other.",
        "The profile counts sealant in the crack and above its mouth. Sealant on the face beside the mouth is in the "
        "mass balance, not in the profile.",
        f"Scale of the {evidence.outline.seen_in}: {evidence.outline.scale_source}"
        + (
            "."
            if evidence.outline.scale_residual_mm is None
            else f", RMS misfit {evidence.outline.scale_residual_mm:.3f} mm."
        ),
    ]
    if evidence.outline.path_source == "automatic":
        sentences.append(
            "The crack was found automatically: look at the overlay before you trust what follows from it."
        )
    if evidence.comparison is not None and evidence.comparison.metrics["role"] == "calibrated-on":
        sentences.append(
            "The fluid was calibrated on these very readings: the error is what calibration left over, not a test."
        )
    warnings = (*evidence.outline.warnings, *evidence.solid.report.get("warnings", ()))
    return [*sentences, *(f"Note of the digitising stage: {text}" for text in warnings)]


def _agreement(evidence: Evidence) -> Table:
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
            ("mean error = area / covered length", f"{comparison.mean_error_mm:.3f} mm"),
            ("bias (simulated - measured)", f"{metrics['bias_mm']:+.3f} mm"),
            ("root mean square error", f"{metrics['rmse_mm']:.3f} mm"),
            ("95 % of the length within", f"{metrics['p95_error_mm']:.3f} mm"),
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


def _repeats(evidence: Evidence) -> Table:
    assert evidence.comparison is not None
    assert evidence.readings is not None
    metrics = evidence.comparison.metrics
    readings = metrics["readings"]
    rows = [
        ("source", evidence.readings.source),
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


def _mass_balance(evidence: Evidence) -> Table:
    run = evidence.run
    stays = ~run.spilled
    below = stays & (run.position_mm[:, 2] <= 0)
    above = stays & ~below

    def volume(count: int) -> str:
        return f"{count * run.particle_volume_mm3:.0f} mm³, {counted(count, 'particle')}"

    return Table(
        "Where the sealant is",
        (
            ("dispensed", volume(len(run.position_mm))),
            ("in the crack, below the face", volume(int(below.sum()))),
            ("above the face, the jet under the nozzle included", volume(int(above.sum()))),
            ("spilled over the sample's edge", volume(run.spilled_particles)),
            ("escaped through a wall (must be 0)", volume(run.escaped_particles)),
            ("volume that the settled particles fill, over dispensed", f"{evidence.volume_ratio:.3f}"),
        ),
    )


def _geometry(evidence: Evidence) -> Table:
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
        ("tilt", _tilt_words(evidence)),
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


def _path(evidence: Evidence) -> Table:
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


def _health(evidence: Evidence) -> Table:
    return Table("Numerical health", (("device", evidence.run.device), *health_rows(evidence.run.health)))


def _settings(evidence: Evidence) -> Table:
    rows = []
    for group, content in evidence.run.settings.items():
        if isinstance(content, dict):
            rows += [(f"{group}: {words(key)}", plain(value)) for key, value in content.items() if value is not None]
        else:
            rows.append((group, plain(content)))
    return Table("Settings in effect", tuple(rows))


def _tilt(evidence: Evidence) -> str:
    ratio = evidence.solid.cavity_volume_mm3 / evidence.run.dispensed_volume_mm3
    if evidence.outline.seen_in == "mesh":
        return f"The walls stand as they do in the mesh; the cavity holds {ratio:.2f} times the sealant."
    return (
        f"A photo from above does not show how the walls stand. Assumed here: {_tilt_words(evidence)}; the cavity "
        f"holds {ratio:.2f} times the sealant. The table of the solid gives the volume of each other reading."
    )


def _tilt_words(evidence: Evidence) -> str:
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


def _surface_tension(evidence: Evidence) -> str:
    """Reynolds number in the nozzle, Bond number across the crack."""
    density_kg_m3 = evidence.run.settings.get("fluid", {}).get("density_kg_m3")
    viscosity_m2_s = evidence.run.health.get("viscosity_m2_s")
    nozzle_mm = evidence.run.settings.get("nozzle", {}).get("diameter_mm")
    if density_kg_m3 is None or nozzle_mm is None or not viscosity_m2_s:
        return "Surface tension is not modelled. The run records no viscosity, so no Reynolds or Bond number is given."
    speed_mm_s = _mean_flow_mm3_s(evidence) / (np.pi / 4 * nozzle_mm**2)
    width_mm = evidence.outline.mean_width_mm
    regime = regime_of(
        viscosity_m2_s=viscosity_m2_s,
        density_kg_m3=density_kg_m3,
        yield_stress_pa=evidence.run.settings["fluid"].get("yield_stress_pa", 0.0),
        speed_mm_s=speed_mm_s,
        nozzle_mm=nozzle_mm,
        width_mm=width_mm,
    )
    # Capillarity is as strong as gravity over the width at which the Bond number is 1.
    capillary_mm = width_mm / np.sqrt(regime.bond)
    yields = f" Bingham number {regime.bingham:.2g} there: yield stress over viscous stress." if regime.bingham else ""
    return (
        f"Surface tension is not modelled. Bond number {regime.bond:.2g} over the crack's {width_mm:.2f} mm "
        f"({density_kg_m3:g} kg/m³; {SURFACE_TENSION_N_M:g} N/m, water's, assumed): gravity over capillarity, so "
        f"menisci of up to about {capillary_mm:.1f} mm at the walls are missing. "
        f"Reynolds number {regime.reynolds:.2g} in the nozzle ({speed_mm_s:.0f} mm/s, {nozzle_mm:g} mm, "
        f"{viscosity_m2_s * 1e6:.3g} mm²/s).{yields}"
    )


def _mean_flow_mm3_s(evidence: Evidence) -> float:
    """Over the time in which sealant flows; each waypoint's flow holds until the next."""
    trajectory = evidence.trajectory
    flowing = trajectory.flow_mm3_s[:-1] > 0
    return float(trajectory.given_mm3.sum() / np.diff(trajectory.t_s)[flowing].sum())


def _mm(value: float | None) -> str:
    return NOT_RECORDED if value is None or np.isnan(value) else f"{value:.2f} mm"
