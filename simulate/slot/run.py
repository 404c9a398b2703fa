"""A run of the fast model with the settings of a trial, recorded like one of particles."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Profile, Run, Sample, Trajectory
from sealtwin.core.regime import regime_of
from sealtwin.core.run_figures import FastFill, RunHealth
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver, particle_volume
from simulate.setup.release_schedule import plan_releases
from simulate.setup.rheology import dynamic_viscosity
from simulate.setup.signed_distance import CM
from simulate.slot.fill import Filled, fill
from simulate.slot.fitness import FULLEST, Fitness, fitness_of
from simulate.slot.flux import HerschelBulkley

DEVICE = "CPU, without particles"
STATION_MM = 0.2
FILL_STEP = 0.1  # Of the fills that are tried for one inside the domain
PARTICLES_RUB = 0.0065
"""Friction of particles under pressure, 0.5 to 0.8 % by shear waves in a box without walls (decision 0064). The fast
model stands for particles, which judge it, and has it too."""


def pour(
    sample: Sample,
    fluid: Fluid,
    solver: Solver,
    nozzle: Nozzle,
    *,
    seed: int,
    slope: SampleSlope = LEVEL,
    advise: bool = False,
) -> tuple[Run, Profile]:
    """Follow the trajectory and let the sealant settle for ``solver.settle_s``; return the run and its level.

    With ``advise`` an unfit run says last with what settings it would be fit: a dozen fills more, at most.

    Raises InputError for sealant that this model does not know: one that freezes, stiffens or follows a curve.
    """
    solid, outline, trajectory = sample.solid, sample.outline, sample.trajectory
    solver = solver.for_crack(outline.mean_width_mm)
    if trajectory.dispensed_mm3 <= 0:
        raise InputError("trajectory: its flow gives no sealant. Check flow_mm3_s and t_s.")
    paste = paste_of(fluid, solver, nozzle, trajectory, seed)
    began = time.perf_counter()

    def poured(trajectory: Trajectory, paste: HerschelBulkley) -> tuple[Filled, Fitness]:
        filled = fill(
            solid, outline, trajectory, paste, nozzle_mm=nozzle.diameter_mm, settle_s=solver.settle_s, slope=slope
        )
        above_mm = max(0.0, float(filled.level_mm.max()))
        return filled, replace(fitness_of(solid, outline, trajectory, paste), above_mm=above_mm)

    filled, fitness = poured(trajectory, paste)
    changes = _changes(trajectory, paste, fitness, poured) if advise else ()
    in_crack_mm3 = float(np.minimum(filled.area_mm2, filled.sections.full_mm2).sum()) * filled.sections.step_mm
    viscosity_m2_s = paste.consistency_pa_s_n / paste.density_kg_m3
    flowing_s = float(np.diff(trajectory.t_s)[trajectory.flow_mm3_s[:-1] > 0].sum())
    regime = regime_of(
        viscosity_m2_s=viscosity_m2_s,
        density_kg_m3=paste.density_kg_m3,
        yield_stress_pa=paste.yield_stress_pa,
        speed_mm_s=filled.dispensed_mm3 / flowing_s / (np.pi / 4 * nozzle.diameter_mm**2),
        nozzle_mm=nozzle.diameter_mm,
        width_mm=outline.mean_width_mm,
    )
    health = RunHealth(
        frames_s=time.perf_counter() - began,
        viscosity_m2_s=viscosity_m2_s,
        viscosity_pa_s=paste.consistency_pa_s_n,
        yield_stress_pa=paste.yield_stress_pa,
        **{name: value for name, value in regime._asdict().items() if value is not None},
        volume_ratio=filled.bed_mm3 / filled.dispensed_mm3,
    )
    used = {"model", "settle_s", *(["radius_mm"] if fluid.U is not None else [])}
    settings = {"fluid": fluid.model_dump(exclude_none=True), "solver": solver.model_dump(include=used)}
    s_mm = np.linspace(0.0, outline.length_mm, max(2, round(outline.length_mm / STATION_MM) + 1))
    level_mm = np.interp(s_mm, filled.sections.s_mm, filled.level_mm)
    level = Profile(s_mm=s_mm, level_mm=level_mm, data="synthetic", source="simulation")
    none = np.zeros((0, 3))
    run = Run(
        position_mm=none,
        velocity_mm_s=none,
        age_s=none[:, 0],
        spilled=np.zeros(0, dtype=bool),
        radius_mm=solver.size_mm,
        particle_volume_mm3=particle_volume(solver.size_mm),
        escaped_particles=0,
        device=DEVICE,
        settings={**settings, "nozzle": nozzle.model_dump(), "seed": seed, **slope.table},
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
            unfit=_unfit(fitness, fluid, outline, paste, changes),
        ),
        level=level,
    )
    return run, level


def paste_of(fluid: Fluid, solver: Solver, nozzle: Nozzle, trajectory: Trajectory, seed: int) -> HerschelBulkley:
    """The sealant as this model has it; U counts as the viscosity that it amounts to at the trial's radius."""
    for key, given in (
        ("freeze_after_s", fluid.freezes),
        ("structuration_pa_per_s", fluid.structuration_pa_per_s > 0),
        ("curve", fluid.curve is not None),
    ):
        if given:
            raise InputError(
                f'fluid.{key}: solver.model = "slot" knows no age of the sealant, and so neither freezing nor '
                'stiffening. Take solver.model = "particles", or a paste whose yield stress stays as it is.'
            )
    viscosity_pa_s = fluid.fresh.viscosity_pa_s
    if viscosity_pa_s is None and not fluid.yields:
        raise InputError(
            f"fluid.U is {fluid.U:g}: without a yield stress it amounts to no viscosity, and the fast model needs one. "
            "Give fluid.viscosity_pa_s in its place."
        )
    if viscosity_pa_s is None:
        try:
            frame_s = plan_releases(trajectory, solver.size_mm, nozzle.diameter_mm, seed).frame_s
        except InputError as fault:
            raise InputError(
                f"fluid.U: its viscosity is that of particles, which cannot be released here ({fault}); give "
                "fluid.viscosity_pa_s, which the fast model takes as it is."
            ) from None
        viscosity_pa_s = dynamic_viscosity(fluid.U or 0.0, fluid.density_kg_m3, 4 * solver.size_mm * CM, frame_s)
    if viscosity_pa_s == 0:
        raise InputError('fluid: without a viscosity solver.model = "slot" has no flow; give viscosity_pa_s above 0.')
    index = fluid.flow_index or 1.0
    return HerschelBulkley(fluid.density_kg_m3, fluid.yield_stress_pa, viscosity_pa_s, index, PARTICLES_RUB)


def _changes(
    trajectory: Trajectory,
    paste: HerschelBulkley,
    fitness: Fitness,
    poured: Callable[[Trajectory, HerschelBulkley], tuple[Filled, Fitness]],
) -> tuple[str, ...]:
    """Settings of a trial that bring a case inside, as fills with them show; none where it is, or where none does."""
    if not fitness.unfit:
        return ()
    shares = np.arange(FULLEST, 0.0, -FILL_STEP)
    for share in [fitness.fill, *shares[shares < fitness.fill]]:
        less = replace(trajectory, flow_mm3_s=trajectory.flow_mm3_s * share / fitness.fill)
        soft = replace(paste, yield_stress_pa=min(paste.yield_stress_pa, fitness.most_pa))
        if poured(less, soft)[1].unfit:
            continue
        found = []
        if soft != paste:
            found.append(f"fluid.yield_stress_pa = {soft.yield_stress_pa:g} or less")
        if share != fitness.fill:
            found.append(f'path.fill = {share:.2f} with path.volume_ml = "cavity"')
        return tuple(found)
    return ()


def unknown(fluid: Fluid, outline: Outline) -> tuple[str, ...]:
    """Parts of a case that this model leaves out, a sentence each."""
    found = []
    if fluid.D_cm is not None:
        found.append(f"fluid.D_cm = {fluid.D_cm:g} is a drag on particles; here the paste sticks to the walls.")
    if outline.branches_kept:
        found.append("The solid has side cracks, which this model does not fill.")
    return tuple(found)


def _unfit(
    fitness: Fitness, fluid: Fluid, outline: Outline, paste: HerschelBulkley, changes: tuple[str, ...]
) -> tuple[str, ...]:
    """Return why the model is unfit for a case, a sentence each, and what to change; none where it is fit."""
    found, wanted = [*fitness.unfit, *unknown(fluid, outline)], list(changes)
    if fluid.D_cm is not None:
        thickness = f"fluid.viscosity_pa_s = {paste.consistency_pa_s_n:.3g} in place of fluid.U and fluid.D_cm"
        wanted.append(thickness if fluid.U is not None else "no fluid.D_cm")
    if outline.branches_kept and outline.seen_in == "photo":
        wanted.append('photo.branches = "drop"')
    if wanted and (changes or not fitness.unfit):
        found.append(f"Inside it with: {'; '.join(wanted)}.")
    return tuple(found)
