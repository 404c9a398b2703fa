"""The loop of one run: release, step, freeze, watch, until the profile is taken."""

import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sealtwin.errors import InputError, NumericalError
from sealtwin.progress import Progress
from sealtwin.records import Outline, Run, Solid, Trajectory
from simulate import kernels, kernels_rest
from simulate.device import describe_device
from simulate.distance import CM, build_barrier, crack_box_mm
from simulate.neighbours import NEIGHBOURS, WALL_NEIGHBOURS
from simulate.nozzle import Schedule, plan_releases
from simulate.outlet import check_outlet
from simulate.paste import NEVER, Rheology, kinematic_viscosity, viscous_weight
from simulate.settings import STIFFEST_U, Fluid, Nozzle, Solver
from simulate.solver import DENSEST, FASTEST_CM_S, LIST_REACH, Domain, FluidSolver, substeps_for
from simulate.state import State
from simulate.walls import place_walls

SAMPLE_EVERY = 50
"""Frames between two samples of the density error."""
ACROSS_AT_LEAST = 2
"""Particles abreast in a crack of mean width."""
CELLS_AT_MOST = 4_000_000
"""Of the neighbour search: 90 times the paper's trial. Each substep clears and sums them all: 2 ms."""
ROUNDING = 1e-9
"""A whole number of frames must not become one more."""
CM2_IN_M2 = 1e4
FAULTS = {
    int(kernels.NEIGHBOURS_FULL): f"A particle has more than {NEIGHBOURS} neighbours: the fluid collapsed.",
    int(kernels.WALLS_FULL): f"A particle has more than {WALL_NEIGHBOURS} wall particles around it.",
    int(kernels.NOT_FINITE): "A position, speed or density is no number any more.",
    int(kernels.TOO_FAST): f"A particle is faster than {FASTEST_CM_S / 100:g} m/s.",
    int(kernels.TOO_DENSE): f"A particle's density is over {DENSEST:g} times the rest density.",
}


def inject(
    solid: Solid,
    outline: Outline,
    trajectory: Trajectory,
    fluid: Fluid,
    solver: Solver,
    nozzle: Nozzle,
    *,
    seed: int,
    device: str,
    progress: Progress,
) -> Run:
    """Follow the trajectory, then let the sealant settle for ``solver.settle_s``.

    Bit for bit the same on one CPU for the same input and seed. Raises InputError where the settings do not fit the
    crack, NumericalError where the numbers stop meaning anything.
    """
    check_fit(outline, solid, fluid, solver, nozzle)
    began = time.perf_counter()
    schedule = plan_releases(trajectory, solver.radius_mm, nozzle.diameter_mm, seed)
    frames = len(schedule.released) + math.ceil(solver.settle_s / schedule.frame_s - ROUNDING)
    domain = _domain(solid, outline, trajectory, solver.radius_mm)
    barrier = build_barrier(solid, outline, solver.radius_mm, device)
    check_outlet(
        schedule,
        trajectory,
        outline,
        barrier,
        radius_mm=solver.radius_mm,
        diameter_mm=nozzle.diameter_mm,
        seed=seed,
    )
    walls = place_walls(solid, outline, barrier, solver.radius_mm)
    substeps = substeps_for(solver, schedule.frame_s)
    _check_damping(solver, schedule.frame_s / substeps)
    support = 4 * solver.radius_mm * CM
    weight = _effective_u(fluid, support, schedule.frame_s)
    rheology = _rheology(fluid, weight, schedule.frame_s)
    state = State(schedule, device)
    engine = FluidSolver(
        state,
        walls,
        barrier,
        domain,
        solver,
        [rheology],
        frame_s=schedule.frame_s,
        substeps=substeps,
        rows=_most_movers(schedule, frames, rheology.frames_to_freeze),
    )
    ready = time.perf_counter()
    health = _advance(engine, frames, schedule.frame_s, progress)
    health |= {
        "frames": frames,
        "frame_s": schedule.frame_s,
        "substeps": substeps,
        "particles_a_release": schedule.release,
        "wall_particles": len(walls.place),
        "particles_across": outline.mean_width_mm / (2 * solver.radius_mm),
        "viscosity_m2_s": kinematic_viscosity(weight, support, schedule.frame_s) / CM2_IN_M2,
        "U": weight,
        "setup_s": ready - began,
        "frames_s": time.perf_counter() - ready,
    }
    fate = _fates(engine, progress)
    return Run(
        position_mm=state.position_mm(),
        velocity_mm_s=state.velocity_mm_s(),
        age_s=(frames - schedule.frame_of).astype(float) * schedule.frame_s,
        spilled=fate == int(kernels_rest.SPILLED),
        radius_mm=solver.radius_mm,
        particle_volume_mm3=schedule.dispensed_mm3 / schedule.particles,
        escaped_particles=int((fate == int(kernels_rest.ESCAPED)).sum()),
        device=describe_device(device),
        settings={
            "fluid": fluid.model_dump(),
            "solver": solver.model_dump() | solver.scheme._asdict() | {"substeps": substeps},
            "nozzle": nozzle.model_dump(),
            "seed": seed,
        },
        health=health,
    )


def check_fit(outline: Outline, solid: Solid, fluid: Fluid, solver: Solver, nozzle: Nozzle) -> None:
    """Raises InputError where settings that are fine alone are impossible in this crack."""
    x_min, y_min, x_max, y_max = solid.block_mm
    side_mm = min(x_max - x_min, y_max - y_min)
    if nozzle.diameter_mm > side_mm:
        raise InputError(
            f"nozzle.diameter_mm is {nozzle.diameter_mm:g}: wider than the face, whose shorter side is {side_mm:g} mm. "
            f"Allowed is at most {side_mm:g}."
        )
    widest_mm = outline.mean_width_mm / ACROSS_AT_LEAST / 2
    if solver.radius_mm > widest_mm:
        raise InputError(
            f"solver.radius_mm is {solver.radius_mm:g}: fewer than {ACROSS_AT_LEAST} particles fit abreast in a crack "
            f"of mean width {outline.mean_width_mm:.2f} mm, and fluid one particle wide bridges the walls instead of "
            f"flowing. Allowed is at most {widest_mm:.3f}; {outline.mean_width_mm / 8:.3f} is four abreast, as in the "
            "paper."
        )
    if solver.radius_mm > nozzle.diameter_mm / 2:
        raise InputError(
            f"solver.radius_mm is {solver.radius_mm:g}: a particle is wider than the nozzle it leaves. Allowed is at "
            f"most {nozzle.diameter_mm / 2:g}, half of nozzle.diameter_mm."
        )
    fall_s = math.sqrt(2 * solid.depth_mm / 9810)
    if fluid.freeze_after_s != "never" and fluid.freeze_after_s < fall_s:
        raise InputError(
            f"fluid.freeze_after_s is {fluid.freeze_after_s:g}: sealant falls {solid.depth_mm:g} mm to the floor in "
            f'{fall_s:.3f} s and would freeze in the air. Allowed is at least {fall_s:.3f}, or "never".'
        )


def _check_damping(solver: Solver, step_s: float) -> None:
    if solver.damping_per_s * step_s > 1:
        raise InputError(
            f"solver.damping_per_s is {solver.damping_per_s:g}: in a substep of {step_s * 1e3:.3g} ms it would take "
            f"more than all of a particle's speed. Allowed is at most {1 / step_s:.4g}, or more with more substeps."
        )


def _effective_u(fluid: Fluid, support: float, frame_s: float) -> float:
    """Raises InputError where a viscosity in physical units is more than the equations can carry."""
    if fluid.viscosity_pa_s is None:
        return fluid.U or 0.0
    weight = viscous_weight(fluid.viscosity_pa_s / fluid.density_kg_m3 * CM2_IN_M2, support, frame_s)
    if weight > STIFFEST_U:
        raise InputError(
            f"fluid.viscosity_pa_s is {fluid.viscosity_pa_s:g} and fluid.density_kg_m3 {fluid.density_kg_m3:g}: in "
            f"frames of {frame_s * 1e3:.3g} ms they amount to U = {weight:.3g}, {STIFFEST_U:g} is allowed. "
            f"Give at most {fluid.viscosity_pa_s * STIFFEST_U / weight:.3g} Pa s."
        )
    return weight


def _rheology(fluid: Fluid, weight: float, frame_s: float) -> Rheology:
    frames_to_freeze = NEVER
    if fluid.freeze_after_s != "never":
        frames_to_freeze = math.ceil(fluid.freeze_after_s / frame_s - ROUNDING)
    return Rheology(
        weight,
        fluid.D_cm,
        yield_cm2_s2=fluid.yield_stress_pa / fluid.density_kg_m3 * CM2_IN_M2,
        stiffening_cm2_s3=fluid.structuration_pa_per_s / fluid.density_kg_m3 * CM2_IN_M2,
        yield_most_cm2_s2=fluid.most_yield_stress_pa / fluid.density_kg_m3 * CM2_IN_M2,
        frames_to_freeze=frames_to_freeze,
    )


def _most_movers(schedule: Schedule, frames: int, frames_to_freeze: int) -> int:
    """Particles leave the nozzle in order, and freeze by age in the same order; how many lie between the two."""
    out = np.concatenate([schedule.released, np.full(frames - len(schedule.released), schedule.particles)])
    frozen = np.zeros_like(out)
    if frames_to_freeze < frames:
        frozen[frames_to_freeze:] = out[:-frames_to_freeze]
    return int((out - frozen).max())


def _domain(solid: Solid, outline: Outline, trajectory: Trajectory, radius_mm: float) -> Domain:
    """Box of the neighbour search: the crack, the face around it, and where the nozzle gives sealant.

    Raises InputError where a path leads so far away that the box has too many cells.
    """
    support_mm = 4 * radius_mm
    low_mm, high_mm = crack_box_mm(solid, outline, radius_mm)
    low_mm[2], high_mm[2] = -solid.depth_mm, 0.0
    nozzle_mm = trajectory.position_mm[trajectory.giving]
    low_mm = np.minimum(low_mm, [*nozzle_mm[:, :2].min(axis=0), np.inf]) - support_mm
    high_mm = np.maximum(high_mm, nozzle_mm.max(axis=0)) + support_mm
    cells = math.prod(((high_mm - low_mm) / (LIST_REACH * support_mm)).tolist())
    if not cells <= CELLS_AT_MOST:
        x, y, z = nozzle_mm[np.abs(nozzle_mm).max(axis=1).argmax()]
        raise InputError(
            f"trajectory: it goes as far as ({x:g}, {y:g}, {z:g}) mm; with solver.radius_mm = {radius_mm:g} the box "
            f"around it and the crack has {cells:.3g} cells for the neighbour search; {CELLS_AT_MOST} are allowed. "
            "Bring the nozzle nearer to the crack (path.nozzle_height_mm), or take a larger radius."
        )
    return Domain(low_mm * CM, high_mm * CM)


def _advance(engine: FluidSolver, frames: int, frame_s: float, progress: Progress) -> dict[str, Any]:
    """All frames; what was seen on the way. Raises NumericalError, naming frame, time, particle and place."""
    state = engine.state
    solves, moving, samples = [], [], []
    most_neighbours = 0
    progress.start("Simulating", frames)
    for frame in range(frames):
        engine.begin_frame(frame)
        if engine.rows == 0:
            continue
        moving.append(engine.rows)
        try:
            solves += [engine.step() for _ in range(engine.substeps)]
        except NumericalError as fault:
            raise NumericalError(f"{fault} Frame {frame}, t = {frame * frame_s:.3f} s.") from fault
        _raise_fault(engine, frame, frame * frame_s)
        if not samples or frame % SAMPLE_EVERY == 0 or frame == frames - 1:
            who = engine.movers.movers.who.numpy()[: engine.rows]
            samples.append(state.density.numpy()[who] - 1.0)
            most_neighbours = max(most_neighbours, int(engine.lists.fluid_count.numpy()[: engine.rows].max(initial=0)))
        progress.advance(frame + 1, f"{engine.rows} moving")
    error = np.maximum(np.concatenate(samples), 0.0)
    return {
        "density_error_mean": float(error.mean()),
        "density_error_p95": float(np.quantile(error, 0.95)),
        "density_error_max": float(error.max()),
        "most_neighbours": most_neighbours,
        "moving_mean": float(np.mean(moving)),
        "moving_most": max(moving),
        "viscosity_iterations_mean": float(np.mean(solves)),
        "viscosity_iterations_most": max(solves),
    }


def _fates(engine: FluidSolver, progress: Progress) -> NDArray[np.integer]:
    """What became of each particle. The last word on escapes has the mesh itself, not the grid that stopped them."""
    fate = np.array(engine.state.fate.numpy(), dtype=np.int64)
    inside = engine.barrier.exact_mm(engine.state.position_mm()) < 0
    here = (fate == int(kernels_rest.MOVING)) | (fate == int(kernels_rest.RESTING))
    fate[here & inside] = int(kernels_rest.ESCAPED)
    if escaped := int((fate == int(kernels_rest.ESCAPED)).sum()):
        progress.note(f"FAULT: {escaped} particles went through a wall. Do not use this run; please report it.")
    return fate


def _raise_fault(engine: FluidSolver, frame: int, t_s: float) -> None:
    state = engine.state
    for kind, particle in enumerate(engine.inspect()):
        if particle < state.count:
            x, y, z = state.position_mm()[particle]
            raise NumericalError(
                f"{FAULTS[kind]} Frame {frame}, t = {t_s:.3f} s, particle {particle} at "
                f"({x:.2f}, {y:.2f}, {z:.2f}) mm. Try more substeps, or a smaller radius."
            )
