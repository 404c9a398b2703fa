"""Run the fast model with the settings of a trial, and record the run in the same form as a run of particles."""

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Outline, Profile, Run, Trajectory
from sealtwin.core.regime import regime_of
from sealtwin.core.run_figures import FastFill, RunHealth
from sealtwin.core.settings import without_none
from simulate.pour import Pour
from simulate.settings import Fluid, particle_volume
from simulate.setup.release_schedule import plan_releases
from simulate.setup.rheology import dynamic_viscosity
from simulate.setup.signed_distance import CM
from simulate.setup_checks import sized
from simulate.shear_law import FLOW_BETWEEN_PLATES
from simulate.slot.fill import CELLS, STEPS, Filled, HerschelBulkley, fill
from simulate.slot.fitness import fitness_of

STATION_MM = 0.2
PARTICLES_RUB = 0.0065
"""Friction between particles, as a fraction of the pressure. Shear waves in a box without walls give 0.5 to 0.8 %. The
fast model includes this friction so that it agrees with a run of particles."""


def pour(inputs: Pour) -> tuple[Run, Profile]:
    """Pour along the trajectory, let the sealant settle for ``solver.settle_s``, and return the run and its level.

    Raises InputError for a sealant with a setting that is not in ``settings.FAST_READS``, for example if it freezes.
    """
    solid, outline, trajectory = inputs.sample.solid, inputs.sample.outline, inputs.sample.trajectory
    fluid, nozzle = inputs.fluid, inputs.nozzle
    solver = sized(outline, solid, inputs.solver, nozzle)
    if trajectory.dispensed_mm3 <= 0:
        raise InputError("trajectory: its flow gives no sealant. Check flow_mm3_s and t_s.")
    paste = paste_of(inputs)
    began = time.perf_counter()
    filled, fitness = bed_of(inputs, paste, trajectory), fitness_of(solid, outline, trajectory, paste)
    fitness = replace(fitness, above_mm=max(0.0, float(filled.level_mm.max())))
    in_crack_mm3 = float(np.minimum(filled.area_mm2, filled.sections.full_mm2).sum()) * filled.sections.step_mm
    viscosity_m2_s = paste.consistency_pa_s_n / paste.density_kg_m3
    flowing_s = float(np.diff(trajectory.t_s)[trajectory.flow_mm3_s[:-1] > 0].sum())
    regime = regime_of(
        viscosity_m2_s=viscosity_m2_s,
        density_kg_m3=paste.density_kg_m3,
        yield_stress_pa=paste.yield_stress_pa,
        speed_mm_s=filled.dispensed_mm3 / flowing_s / (np.pi / 4 * nozzle.size_mm**2),
        nozzle_mm=nozzle.size_mm,
        width_mm=outline.mean_width_mm,
        flow_index=paste.flow_index,
    )
    health = RunHealth(
        frames_s=time.perf_counter() - began,
        viscosity_m2_s=viscosity_m2_s,
        viscosity_pa_s=paste.consistency_pa_s_n,
        yield_stress_pa=paste.yield_stress_pa,
        **without_none(regime._asdict()),
        volume_ratio=filled.bed_mm3 / filled.dispensed_mm3,
    )
    used = {"model", "settle_s", *(["radius_mm"] if fluid.U is not None else [])}
    settings = {"fluid": fluid.model_dump(exclude_none=True), "solver": solver.model_dump(include=used)}
    s_mm = np.linspace(0.0, outline.length_mm, max(2, round(outline.length_mm / STATION_MM) + 1))
    level_mm = np.interp(s_mm, filled.sections.s_mm, filled.level_mm)
    level = Profile(s_mm, level_mm, source="simulation")
    none = np.zeros((0, 3))
    run = Run(
        position_mm=none,
        velocity_mm_s=none,
        age_s=none[:, 0],
        spilled=np.zeros(0, bool),
        radius_mm=solver.size_mm,
        particle_volume_mm3=particle_volume(solver.size_mm),
        escaped_particles=0,
        device="CPU, without particles",
        settings={**settings, "nozzle": nozzle.model_dump(), "seed": inputs.seed, **inputs.slope.table},
        health=health,
        fast_fill=FastFill(
            dispensed_mm3=filled.dispensed_mm3,
            in_crack_mm3=in_crack_mm3,
            above_face_mm3=max(0.0, filled.bed_mm3 - in_crack_mm3),
            in_flight_mm3=filled.in_flight_mm3,
            held_slope=fitness.slope,
            mound_mm=fitness.mound_mm,
            fill=fitness.fill,
            above_mm=fitness.above_mm,
            unfit=(*fitness.unfit, *_unfit_settings(fluid, outline)),
        ),
        fast_level=level,
        doubts=inputs.doubts,
    )
    return run, level


def bed_of(
    inputs: Pour, paste: HerschelBulkley, trajectory: Trajectory, *, cells: int = CELLS, steps: int = STEPS
) -> Filled:
    """Return the settled sealant after a pour of ``paste`` along ``trajectory``.

    Crack, nozzle, slope and settling time are those of ``inputs``.
    """
    return fill(
        inputs.sample.solid,
        inputs.sample.outline,
        trajectory,
        paste,
        nozzle_mm=inputs.nozzle.size_mm,
        settle_s=inputs.solver.settle_s,
        slope=inputs.slope,
        cells=cells,
        steps=steps,
    )


def paste_of(inputs: Pour) -> HerschelBulkley:
    """Return the sealant as this model describes it. U is replaced by the equivalent viscosity at the trial's radius.

    Raises InputError if the model does not support the sealant.
    """
    fluid, sample = inputs.fluid, inputs.sample
    refused = 'the fast model (solver.model = "slot") does not support this setting. Give solver.model = "particles"'
    for key, default in fluid.unread_by_fast_model.items():
        raise InputError(f"fluid.{key}: {refused}, or leave fluid.{key} at its default, {default}.")
    if fluid.law not in FLOW_BETWEEN_PLATES:
        raise InputError(f"fluid.{fluid.given_by} selects the law of flow: {refused}.")
    viscosity_pa_s = fluid.fresh.viscosity_pa_s
    if viscosity_pa_s is None and not fluid.yields:
        raise InputError(
            f"fluid.U is {fluid.U:g}: without a yield stress it has no equivalent viscosity, but the fast model needs "
            "one. Give fluid.viscosity_pa_s instead."
        )
    if viscosity_pa_s is None:
        try:
            radius_mm = sized(sample.outline, sample.solid, inputs.solver, inputs.nozzle).size_mm
            frame_s = plan_releases(sample.trajectory, radius_mm, inputs.nozzle.size_mm, inputs.seed).frame_s
        except InputError as fault:
            raise InputError(
                "fluid.U: its equivalent viscosity depends on the particles, but particles cannot be released here "
                f"({fault}). Give fluid.viscosity_pa_s instead."
            ) from None
        viscosity_pa_s = dynamic_viscosity(fluid.U or 0.0, fluid.density_kg_m3, 4 * radius_mm * CM, frame_s)
    if viscosity_pa_s == 0:
        raise InputError('solver.model = "slot" needs a viscosity. Give fluid.viscosity_pa_s above 0.')
    return HerschelBulkley(
        density_kg_m3=fluid.density_kg_m3,
        yield_stress_pa=fluid.yield_stress_pa,
        consistency_pa_s_n=viscosity_pa_s,
        flow_index=fluid.flow_index or 1.0,
        friction=PARTICLES_RUB,
        wall_share=fluid.wall_share or 1.0,
        law=fluid.law,
    )


def _unfit_settings(fluid: Fluid, outline: Outline) -> Iterator[Fact]:
    """Yield a reason for each setting with which this model is not valid."""
    if fluid.D_cm is not None:
        text = (
            f"fluid.D_cm = {fluid.D_cm:g} is a drag on particles, but in this model the paste sticks to the walls. "
            "Leave D_cm out, and give fluid.viscosity_pa_s instead of fluid.U."
        )
        yield doubt("unfit.drag", text, fluid.D_cm, "cm")
    if outline.branches_kept:
        leave_out = ' Give photo.branches = "drop".' if outline.seen_in == "photo" else ""
        yield doubt("unfit.side-cracks", f"The solid has side cracks, which this model does not fill.{leave_out}")
