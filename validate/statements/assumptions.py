"""What a result takes for granted and what it leaves out, in sentences."""

import numpy as np

from sealtwin.regime import SURFACE_TENSION_N_M, regime_of
from validate.evidence import Evidence
from validate.statements.sample import tilt_words
from validate.wording import counted


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
    absent = "Shrinkage is" if curing_pa_s else "Curing and shrinkage are"
    sentences += [
        f"The profile is taken {solver.get('settle_s', 0.0):g} s after the last release. {absent} not modelled"
        f"{_when_read(evidence)}.",
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


def left_out(evidence: Evidence) -> list[str]:
    """Data that stand in no metric, and why; one sentence says so where there are none."""
    sentences = []
    if evidence.readings is not None and evidence.comparison is not None:
        metrics = evidence.comparison.metrics
        if len(beyond_mm := metrics["stations_beyond_mm"]):
            places = ", ".join(f"{s_mm:g}" for s_mm in beyond_mm)
            sentences.append(
                f"{counted(len(beyond_mm), 'station')} of {len(evidence.readings.s_mm)} (s = {places} mm): beyond the "
                f"stretch that both curves cover, {metrics['covered_from_mm']:.1f} to {metrics['covered_to_mm']:.1f} "
                "mm. The next one beyond an end gives the readings' line its direction up to there."
            )
        if evidence.readings.repeats_mm is not None and (missing := int(np.isnan(evidence.readings.repeats_mm).sum())):
            sentences.append(f"{counted(missing, 'single reading')}: no number in the sheet.")
    if spilled := evidence.run.spilled_particles:
        volume_mm3 = spilled * evidence.run.particle_volume_mm3
        sentences.append(
            f"{counted(spilled, 'particle')} ({volume_mm3:.0f} mm³) over the edge of the sample: in the mass balance, "
            "in no profile."
        )
    if evidence.outline.branches_mm and not evidence.outline.branches_kept:
        sentences.append(
            f"{counted(len(evidence.outline.branches_mm), 'side crack')} seen in the {evidence.outline.seen_in}: "
            "no part of the solid."
        )
    return sentences or ["Nothing: every reading and every particle counts."]


def _when_read(evidence: Evidence) -> str:
    """Wet or cured, as it was declared: what has cured has lost volume that the simulated level still has."""
    if evidence.comparison is None or (balance := evidence.comparison.metrics.get("mass_balance")) is None:
        return ""
    state, shrinkage_percent = balance["readings_state"], balance["shrinkage_percent"]
    if state is None:
        return "; whether the caliper read wet or cured sealant is not declared (readings.state)"
    if state == "wet":
        return ", and the caliper read wet sealant, which had not shrunk"
    if shrinkage_percent is None:
        return ", while the caliper read cured sealant, whose shrinkage is not declared (readings.shrinkage_percent)"
    return (
        f", while the caliper read cured sealant: the {shrinkage_percent:g} % by which it shrank are put back in the "
        "mass balance, and not in the levels"
    )


def _tilt(evidence: Evidence) -> str:
    ratio = evidence.solid.cavity_volume_mm3 / evidence.run.dispensed_volume_mm3
    if evidence.outline.seen_in == "mesh":
        return f"The walls stand as they do in the mesh; the cavity holds {ratio:.2f} times the sealant."
    return (
        f"A photo from above does not show how the walls stand. Assumed here: {tilt_words(evidence)}; the cavity "
        f"holds {ratio:.2f} times the sealant. The table of the solid gives the volume of each other reading."
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
