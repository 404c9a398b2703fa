"""Tables of the crack, the nozzle path, the run and its settings, and what a result assumes and leaves out."""

from typing import Any

import numpy as np

from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Outline, Solid
from sealtwin.core.regime import SURFACE_TENSION_N_M, regime_of
from sealtwin.core.run_figures import RunHealth
from sealtwin.core.solid_figures import Span
from validate.report_input import Evidence
from validate.uncertainty.meniscus import Mouth
from validate.units import LABELS, PageTable, counted, millimetres, percent, plain, span, words
from validate.wording.comparison import sealant_as_read

HEALTH_LABELS: dict[str, tuple[str, float, str]] = LABELS["health"]
"""Label, factor to the reported unit, and format of each number that a run records about itself."""


SHOWN_HEALTH = (
    *("density_error_p95", "density_error_max", "moving_most", "viscosity_iterations_mean", "finer"),
    *("particles_across", "viscosity_m2_s", "viscosity_pa_s", "viscosity_added_m2_s", "reynolds", "bond", "bingham"),
    *("flat_mm", "to_rest_mm", "setup_s", "frames_s"),
)
"""Figures of a run's health on the page. report.json has all of them."""


def health_table(evidence: Evidence) -> PageTable:
    return PageTable("Numerical health", tuple(health_rows(evidence.run.health)))


def health_rows(health: RunHealth) -> list[tuple[str, str]]:
    """Return the figures of the page that the run recorded, in the run's order."""
    rows = []
    for key, value in health.recorded().items():
        if key in SHOWN_HEALTH and value is not None:
            label, factor, shape = HEALTH_LABELS[key]
            rows.append((label, shape.format(factor * value)))
    if health.frames and health.frames_s is not None:
        rows.append(("computing time of a frame", f"{1000 * health.frames_s / health.frames:.1f} ms"))
    return rows


def path_table(evidence: Evidence) -> PageTable:
    trajectory, path = evidence.trajectory, evidence.solid.figures.path
    giving = trajectory.giving
    begins_mm, ends_mm = trajectory.s_mm[giving][[0, -1]]
    rows = [("sealant flows from, to", f"s = {begins_mm:.1f} to {ends_mm:.1f} mm")]
    if path is not None:
        radius_mm = path.smallest_radius_mm
        length = (
            f"{path.length_mm:.2f} mm, smoothed within {path.smoothing_mm:g} mm RMS of the centreline's "
            f"{path.centreline_mm:.2f} mm; turns by up to {path.largest_turn_deg:.1f}°"
        )
        radius = "" if radius_mm is None else f", smallest radius {radius_mm:.1f} mm"
        rows.append(("length over the crack", length + radius))
    rows += [
        ("duration", f"{trajectory.duration_s:.2f} s in {counted(len(trajectory.t_s), 'waypoint')}"),
        ("speed", f"{span(trajectory.speed_mm_s[:-1], 2)} mm/s"),
        ("flow", f"{span(trajectory.flow_mm3_s[giving.start : giving.stop - 1], 1)} mm³/s"),
        ("height above the face", f"{trajectory.position_mm[:, 2].mean():.1f} mm"),
    ]
    leads = trajectory.position_mm[: giving.start + 1], trajectory.position_mm[giving.stop - 1 :]
    before_mm, after_mm = (arc_length(points)[-1] for points in leads)
    if before_mm or after_mm:
        rows.append(("length without sealant before, after", f"{before_mm:.1f} mm, {after_mm:.1f} mm"))
    return PageTable("Nozzle path", tuple(rows))


def geometry_table(evidence: Evidence) -> PageTable:
    outline, solid, figures = evidence.outline, evidence.solid, evidence.solid.figures
    low_mm, high_mm = solid.sections.depth_mm.min(), solid.sections.depth_mm.max()
    depth = f"{high_mm:g} mm" if low_mm == high_mm else f"{low_mm:.3g} to {high_mm:.3g} mm, from station to station"
    widths = f"{millimetres(figures.mouth_width_mm)}, {millimetres(figures.floor_width_mm)}"
    rows = [
        ("length along the centreline", f"{outline.length_mm:.2f} mm"),
        ("ends", ", ".join(outline.ends)),
        (f"width in the {outline.seen_in}, mean", width_words(outline)),
        ("mean width of the mouth, of the floor", widths),
        ("depth", depth),
        ("tilt", tilt_words(evidence)),
        ("volume of the cavity", f"{solid.cavity_volume_mm3:.0f} mm³{_interval(figures.cavity_volume_95_mm3, 0)}"),
    ]
    if (weighed := figures.weighed) is not None:
        rows.append((f"by weight, {counted(len(weighed.levels_mm), 'step')} (95 %)", str(weighed)))
    if solid.tilt == "funnel" and (closing := figures.closing_depth_mm) and closing.mean is not None:
        above = percent(closing.share_above_floor, 0)
        rows.append(("walls meet at", f"{closing.mean:.1f} mm deep, above the floor on {above}"))
    return PageTable("Crack and solid", tuple(rows))


def width_words(outline: Outline) -> str:
    """Return the mean width with its interval, and with its source unless it is measured from the walls."""
    sources = {"fit": ", fitted to the blurred profile, since the crack is too thin for walls", "gauge": ", as given"}
    source = sources.get(outline.width_source, "")
    return f"{outline.mean_width_mm:.2f} mm{_interval(outline.width_95_mm, 2)}{source}"


def _interval(ends: Span | None, digits: int) -> str:
    return "" if ends is None else f" (95 %: {ends[0]:.{digits}f} to {ends[1]:.{digits}f})"


def tilt_words(evidence: Evidence) -> str:
    solid = evidence.solid
    without_angle = {"vertical": "vertical walls", "modelled": "as in the mesh"}
    return without_angle.get(solid.tilt) or f"{solid.tilt}, {_angle_words(solid)} from vertical"


def _angle_words(solid: Solid) -> str:
    left_deg, right_deg = solid.wall_angles_deg
    return (
        f"each wall {left_deg:.3g}°"
        if left_deg == right_deg
        else f"left wall {left_deg:.3g}°, right wall {right_deg:.3g}°"
    )


def _settled(evidence: Evidence) -> str:
    """Return how long after the last release the sealant settled: the time that was set, or until it was at rest."""
    health, path = evidence.run.health, evidence.trajectory
    settle_s = evidence.run.settings.get("solver", {}).get("settle_s", 0.0)
    if health.frames is None or health.frame_s is None or not len(given := np.flatnonzero(path.flow_mm3_s[:-1] > 0)):
        return f"{settle_s:g} s after"
    settled_s = health.frames * health.frame_s - float(path.t_s[given[-1] + 1] - path.t_s[0])
    if settled_s > settle_s - 0.1:
        return f"{settle_s:g} s after"
    return f"at rest, {max(settled_s, 0.0):.1f} s after"


def settings_table(evidence: Evidence) -> PageTable:
    rows = []
    for group, content in evidence.run.settings.items():
        if not isinstance(content, dict):
            continue  # The seed, which the table of versions has
        cells = []
        for key, value in content.items():
            table = value if isinstance(value, dict) else {"": value}
            cells += [
                f"{words(key)} {words(name)}".rstrip() + f" {_listed(one)}"
                for name, one in table.items()
                if one is not None
            ]
        rows.append((group, ", ".join(cells)))
    return PageTable("Settings in effect", tuple(rows))


def _listed(value: Any) -> str:
    """Return a setting as text. A list of numbers becomes its length and its first and last value."""
    if not isinstance(value, list | tuple) or not value or not all(isinstance(one, int | float) for one in value):
        return plain(value)
    return f"{len(value)} rows, {value[0]:.4g} to {value[-1]:.4g}"


def assumptions(evidence: Evidence) -> list[str]:
    """Return sentences on the assumptions, with the numbers that show how much depends on them."""
    outline, comparison = evidence.outline, evidence.comparison
    fluid = evidence.run.settings.get("fluid", {})
    sentences = [_tilt(evidence), *_slope(evidence), _surface_tension(evidence), *_meniscus(evidence)]
    sentences += [*_curve(fluid), *_measured(fluid)]
    curing_pa_s, yield_stress_pa = fluid.get("structuration_pa_per_s", 0.0), fluid.get("yield_stress_pa", 0.0)
    if yield_stress_pa or curing_pa_s:
        walls = "along the walls, which are assumed to be rough"
        if (share := fluid.get("wall_share")) is not None:
            walls = f"slides along the walls above {share:g} of it (fluid.wall_share)"
        grows = f", and {curing_pa_s:g} Pa more each second" if curing_pa_s else ""
        sentences.append(
            f"The paste is a Bingham fluid: it does not flow below a yield stress of {yield_stress_pa:g} Pa{grows}, "
            f"inside and {walls}. This preserves the slope of the bed."
        )
    if fluid.get("D_from") == "no slip":
        sentences.append(
            f"The fluid sticks to the walls: the weight of their drag, D = {fluid['D_cm']:.3g} cm per frame, follows "
            "from the viscosity, the particles' radius and the time of a frame."
        )
    volumes, as_read = None if comparison is None else comparison.volumes, ""
    if volumes is not None:
        _, as_read = sealant_as_read(volumes.mass_balance)
    absent = "Shrinkage is" if curing_pa_s or fluid.get("curve") else "Curing and shrinkage are"
    residual_mm = outline.scale_residual_mm
    sentences += [
        f"The profile is taken {_settled(evidence)} the last release. {absent} not modelled{as_read}.",
        "The profile includes sealant in the crack and above its mouth. Sealant on the face beside the mouth is in the "
        "mass balance, not in the profile.",
        *([] if residual_mm is None else [f"RMS misfit of the scale: {residual_mm:.3f} mm."]),
    ]
    if outline.path_source == "automatic":
        sentences.append("The crack was found automatically: check the overlay before you trust the results.")
    warnings = (*outline.warnings, *evidence.solid.figures.warnings)
    sentences += [f"In doubt: {doubt}" for doubt in evidence.run.doubts]
    return [*sentences, *(f"Note of the digitising stage: {text}" for text in warnings)]


def left_out(evidence: Evidence) -> list[str]:
    """Return sentences on the data that no metric includes, and why; one sentence if all data are included."""
    run, outline, readings, comparison = evidence.run, evidence.outline, evidence.readings, evidence.comparison
    sentences = []
    if readings is not None and comparison is not None:
        m = comparison
        if beyond := len(m.stations_beyond_mm):
            places = ", ".join(f"{s_mm:g}" for s_mm in m.stations_beyond_mm)
            sentences.append(
                f"Not compared: {counted(beyond, 'station')} of {len(readings.s_mm)} (s = {places} mm) beyond the "
                f"stretch that both curves cover, {m.covered_from_mm:.1f} to {m.covered_to_mm:.1f} mm."
            )
        if readings.repeats_mm is not None and (missing := int(np.isnan(readings.repeats_mm).sum())):
            sentences.append(
                f"{counted(missing, 'single reading')} {'has' if missing == 1 else 'have'} no number in the sheet."
            )
    if spilled := run.spilled_particles:
        sentences.append(
            f"{counted(spilled, 'particle')} ({spilled * run.particle_volume_mm3:.0f} mm³) ran over the edge of the "
            "sample. The mass balance includes them, the profile does not."
        )
    if outline.branches_mm and not outline.branches_kept:
        cracks = counted(len(outline.branches_mm), "side crack")
        sentences.append(f"The solid does not include {cracks} seen in the {outline.seen_in}.")
    if not run.has_particles:
        sentences.append("The fast model computes no jet, no overspill and no view of the fill over time.")
    return sentences or ["Left out: nothing."]


def _tilt(evidence: Evidence) -> str:
    ratio = evidence.solid.cavity_volume_mm3 / evidence.run.dispensed_volume_mm3
    if evidence.outline.seen_in == "mesh":
        return f"The walls are those of the mesh; the cavity has {ratio:.2f} times the volume of the sealant."
    if (weighed := evidence.solid.figures.weighed) is not None and evidence.solid.tilt not in ("lean", "vertical"):
        return (
            "The tilt of the walls was measured by a liquid weighed into the crack in "
            f"{counted(len(weighed.levels_mm), 'step')}: {tilt_words(evidence)}, assumed to be straight; the cavity "
            f"has {ratio:.2f} times the volume of the sealant."
        )
    return (
        f"A photo from above does not show the tilt of the walls. Assumed: {tilt_words(evidence)}; the cavity has "
        f"{ratio:.2f} times the volume of the sealant."
    )


def hidden_width(evidence: Evidence) -> tuple[str, ...]:
    """Return a sentence on the width that the photo contradicts or does not show, if the walls flare or undercut."""
    solid, traced_mm = evidence.solid, evidence.outline.mean_width_mm
    mouth_mm, floor_mm = solid.figures.mouth_width_mm, solid.figures.floor_width_mm
    if solid.tilt == "flare" and mouth_mm is not None:
        return (
            f"the solid's mouth, {mouth_mm:.1f} mm, is wider than the crack in the photo, {traced_mm:.1f} mm, which is "
            f"taken as its floor: the walls are assumed to flare, {_angle_words(solid)}.",
        )
    if solid.tilt == "undercut" and floor_mm is not None:
        return (
            f"the floor, {floor_mm:.1f} mm wide, extends under the face on both sides of the mouth, {traced_mm:.1f} "
            f"mm: the walls are assumed to open downward, {_angle_words(solid)}.",
        )
    return ()


def freezing(evidence: Evidence) -> tuple[str, ...]:
    """Return a sentence on freezing by age, if there is any."""
    freeze_s = evidence.run.settings.get("fluid", {}).get("freeze_after_s")
    if not isinstance(freeze_s, int | float):
        return ()
    return (f"each particle is fixed {freeze_s:g} s after its release, which holds the slope of the bed.",)


def _curve(fluid: dict[str, Any]) -> list[str]:
    """Return a sentence for a fluid whose viscosity follows a table."""
    if not (curve := fluid.get("curve")):
        return []
    viscosity_pa_s, stress_pa = curve["viscosity_pa_s"], curve.get("yield_stress_pa") or (0.0,)
    yields = f", its yield stress (Bingham) {min(stress_pa):.3g} to {max(stress_pa):.3g} Pa" if max(stress_pa) else ""
    over, rest = "age since it left the nozzle", "They are constant before the first age and after the last."
    if cooling := fluid.get("cooling"):
        over = "temperature"
        cooled_c = cooling["temperature_c"]
        rest = (
            f"The temperature changes from {cooled_c[0]:.4g} to {cooled_c[-1]:.4g} °C with the time since the nozzle, "
            "equally in all of the sealant, since heat is not modelled."
        )
    return [
        f"The sealant's viscosity follows a table over its {over}, {min(viscosity_pa_s):.3g} to "
        f"{max(viscosity_pa_s):.3g} Pa s{yields}; between rows its logarithm is linear. {rest}"
    ]


def _measured(fluid: dict[str, Any]) -> list[str]:
    """Return a sentence on a measured paste: yield stress, interval, method, and uses that it is not for."""
    if not (paste := fluid.get("material")):
        return []
    (low, high), within = paste["yield_stress_95_pa"], "uncertainty not stated"
    if paste["yield_stress_error_pa"] > 0:
        within = f"95 %: {low:.3g} to {high:.3g} Pa"
    law, n = "", paste.get("flow_index")
    if n is not None:
        k = paste["consistency_pa_s_n"]
        low_n, high_n = paste.get("flow_index_95") or (n, n)
        law = (
            f" and its viscous stress {k:.3g} Pa times the power {n:.3g} ({low_n:.3g} to {high_n:.3g}, which no budget "
            "includes) of the shear rate in 1/s"
        )
    return [
        f"The paste's yield stress is {paste['yield_stress_pa']:.3g} Pa ({within}){law}, with the method "
        f"{paste['method']} ({paste['date']}, {paste['data']}). Do not use it for {'; '.join(paste['not_for'])}.",
        *paste.get("doubts", ()),
    ]


def _slope(evidence: Evidence) -> list[str]:
    """Return a sentence on a sample that is not level."""
    slope = evidence.run.settings.get("sample")
    if slope is None:
        return []
    gradient_deg, crossfall_deg = slope["gradient_deg"], slope["crossfall_deg"]
    return [
        f"The sample slopes: its face rises towards +x by {gradient_deg:g}° and towards +y by {crossfall_deg:g}°, and "
        "gravity is vertical. The nozzle points, and levels are measured, square to the face. The surface of a liquid "
        "at rest is horizontal, not parallel to the face, so a crack filled to the face would overflow at its lower "
        "end."
    ]


def _meniscus(evidence: Evidence) -> list[str]:
    """Return a sentence on the meniscus, unless the uncertainty includes or names it."""
    profile, comparison = evidence.profile, evidence.comparison
    if evidence.prediction is not None or (comparison is not None and comparison.uncertainty is not None):
        return []
    mouth = Mouth.of(evidence.outline, evidence.solid, evidence.run.density_kg_m3)
    sag_mm = mouth.sag_mm(profile.s_mm, profile.level_mm).max()
    return [f"Sealant that wets the walls, as water does, is up to {sag_mm:.2f} mm lower in the middle than computed."]


def _surface_tension(evidence: Evidence) -> str:
    density_kg_m3 = evidence.run.density_kg_m3
    viscosity_m2_s = evidence.run.health.viscosity_m2_s
    nozzle_mm = evidence.run.settings.get("nozzle", {}).get("diameter_mm")
    if density_kg_m3 is None or nozzle_mm is None or not viscosity_m2_s:
        u = evidence.run.health.U
        why = "The run records no viscosity" if not u else f"U = {u:.4g} without a yield stress defines no viscosity"
        return f"Surface tension is not modelled. {why}, so no Reynolds or Bond number is given."
    # The mean flow over the time in which sealant flows; each waypoint's flow holds until the next.
    trajectory = evidence.trajectory
    flowing_s = np.diff(trajectory.t_s)[trajectory.flow_mm3_s[:-1] > 0].sum()
    speed_mm_s = float(trajectory.given_mm3.sum() / flowing_s) / (np.pi / 4 * nozzle_mm**2)
    width_mm = evidence.outline.mean_width_mm
    fluid = evidence.run.settings["fluid"]
    regime = regime_of(
        viscosity_m2_s=viscosity_m2_s,
        density_kg_m3=density_kg_m3,
        yield_stress_pa=fluid.get("yield_stress_pa", 0.0),
        speed_mm_s=speed_mm_s,
        nozzle_mm=nozzle_mm,
        width_mm=width_mm,
        flow_index=fluid.get("flow_index") or 1.0,
    )
    flowing_mm2_s = speed_mm_s * nozzle_mm / regime.reynolds if regime.reynolds else viscosity_m2_s * 1e6
    yields = f" Bingham number {regime.bingham:.2g} there: yield stress over viscous stress." if regime.bingham else ""
    return (
        f"Surface tension is not modelled. Bond number {regime.bond:.2g} over the crack's {width_mm:.2f} mm "
        f"({density_kg_m3:g} kg/m³; {SURFACE_TENSION_N_M:g} N/m, water's, assumed): gravity over capillarity. "
        f"Reynolds number {regime.reynolds:.2g} in the nozzle ({speed_mm_s:.0f} mm/s, {nozzle_mm:g} mm, "
        f"{flowing_mm2_s:.3g} mm²/s).{yields}"
    )
