"""What settings mean in a crack: whether they fit it, and what they amount to in the numbers' own units."""

import math

import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import Outline, Solid, Trajectory
from simulate.course import frames_to_freeze
from simulate.distance import CM, crack_box_mm
from simulate.paste import Rheology, viscous_weight
from simulate.settings import STIFFEST_U, Fluid, Nozzle, Solver
from simulate.solver import LIST_REACH, Domain

ACROSS_AT_LEAST = 2
"""Particles abreast in a crack of mean width."""
CELLS_AT_MOST = 4_000_000
"""Of the neighbour search: 90 times the paper's trial. Each substep clears and sums them all: 2 ms."""
CM2_IN_M2 = 1e4


def check_fit(outline: Outline, solid: Solid, fluid: Fluid, solver: Solver, nozzle: Nozzle) -> None:
    """Raises InputError where settings that are fine alone are impossible in this crack."""
    radius_mm = solver.for_crack(outline.mean_width_mm).size_mm
    x_min, y_min, x_max, y_max = solid.block_mm
    side_mm = min(x_max - x_min, y_max - y_min)
    if nozzle.diameter_mm > side_mm:
        raise InputError(
            f"nozzle.diameter_mm is {nozzle.diameter_mm:g}: wider than the face, whose shorter side is {side_mm:g} mm. "
            f"Allowed is at most {side_mm:g}."
        )
    widest_mm = outline.mean_width_mm / ACROSS_AT_LEAST / 2
    if radius_mm > widest_mm:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: fewer than {ACROSS_AT_LEAST} particles fit abreast in a crack "
            f"of mean width {outline.mean_width_mm:.2f} mm, and fluid one particle wide bridges the walls instead of "
            f"flowing. Allowed is at most {widest_mm:.3f}; {outline.mean_width_mm / 8:.3f} is four abreast, as in the "
            'paper, and so is "auto".'
        )
    if radius_mm > nozzle.diameter_mm / 2:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: a particle is wider than the nozzle it leaves. Allowed is at "
            f"most {nozzle.diameter_mm / 2:g}, half of nozzle.diameter_mm."
        )
    fall_s = math.sqrt(2 * solid.depth_mm / 9810)
    if fluid.freeze_after_s != "never" and fluid.freeze_after_s < fall_s:
        raise InputError(
            f"fluid.freeze_after_s is {fluid.freeze_after_s:g}: sealant falls {solid.depth_mm:g} mm to the floor in "
            f'{fall_s:.3f} s and would freeze in the air. Allowed is at least {fall_s:.3f}, or "never".'
        )


def check_damping(solver: Solver, step_s: float) -> None:
    if solver.damping_per_s * step_s > 1:
        raise InputError(
            f"solver.damping_per_s is {solver.damping_per_s:g}: in a substep of {step_s * 1e3:.3g} ms it would take "
            f"more than all of a particle's speed. Allowed is at most {1 / step_s:.4g}, or more with more substeps."
        )


def effective_u(fluid: Fluid, support: float, frame_s: float) -> float:
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


def rheology_of(fluid: Fluid, support: float, frame_s: float) -> Rheology:
    """Raises InputError where a viscosity is more than the equations can carry."""
    return Rheology(
        effective_u(fluid, support, frame_s),
        fluid.D_cm,
        yield_cm2_s2=fluid.yield_stress_pa / fluid.density_kg_m3 * CM2_IN_M2,
        stiffening_cm2_s3=fluid.structuration_pa_per_s / fluid.density_kg_m3 * CM2_IN_M2,
        yield_most_cm2_s2=fluid.most_yield_stress_pa / fluid.density_kg_m3 * CM2_IN_M2,
        frames_to_freeze=frames_to_freeze(fluid, frame_s),
    )


def domain_of(solid: Solid, outline: Outline, trajectory: Trajectory, radius_mm: float) -> Domain:
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
