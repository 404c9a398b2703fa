"""Check that the settings of particles fit a crack, and convert the fluid to the solver's units."""

import itertools
import math

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Sample, Solid, Trajectory
from sealtwin.core.regime import GRAVITY_M_S2
from simulate.fluid.solver import SLOWEST_SHEAR, Domain, substeps_for
from simulate.fluid.viscosity import explicit_passes
from simulate.material_file import Material
from simulate.settings import (
    LEVEL,
    MAX_SUBSTEPS,
    Fluid,
    Nozzle,
    SampleSlope,
    Solver,
    particle_volume,
)
from simulate.setup.release_schedule import (
    PARTICLES_AT_MOST,
    Schedule,
    frames_to_freeze,
    same_fluid,
)
from simulate.setup.resolution import ACCURATE_RESOLUTION, RESOLUTIONS
from simulate.setup.rheology import (
    CM2_IN_M2,
    Rheology,
    dynamic_viscosity,
    no_slip_weight,
    viscous_weight,
)
from simulate.setup.signed_distance import CM, SolidSurface, crack_box_mm, grid_fits

ACROSS_AT_LEAST = 2  # Smallest number of particles side by side across the mean width of a crack
CELLS_AT_MOST = 4_000_000
"""Largest number of cells in the neighbour search, 90 times as many as in the paper's trial. Each substep scans all
cells, which then takes 2 ms."""
STIFFEST = 1000.0
"""Largest kinematic viscosity that can be solved, multiplied by dt / h^2 with the substep dt. At a radius of 0.4 mm it
is 2,400 Pa s. At this limit, pours in slots 1.2 to 12 mm wide are solved. At 4000, particles fly away."""
HOLDS_SUPPORTS = 100.0
"""Largest yield stress of fresh paste that can be solved, divided by rho g h. At a radius of 0.4 mm it is 2,650 Pa. At
this limit, pours take up to a fifth of the allowed iterations with any substep. At 200, one pour of 18 fails."""
STRESS_GAIN_PER_S = 150.0
"""Largest increase of the yield stress in ``STIFFENING_S``, divided by rho h^2 / dt, in 1/s. At a radius of 0.4 mm it
is 105 Pa/s. From 180 on, stiffened paste compresses enclosed fresh paste until the fresh paste collapses."""
STIFFENING_S = 3.0  # Longest time, in s, over which the increase of the yield stress is counted
STRESS_LIMIT_PER_S = 30.0  # Up to this yield stress, divided by rho h^2 / dt, in 1/s, paste may stiffen at any rate
SHEARED = 100.0  # Largest shear rate in 1/s, in a jet that hits sealant. Shear-thickening paste is then stiffest.
MAX_PASSES = 5000
"""Largest number of explicit passes in a substep, equal to the largest number of iterations of a solve. Paste at rest
needs most: 2,600 passes with 1 Pa at a radius of 0.6 mm. A second of pouring, with 36 particles in substeps of 2.8 ms,
then takes a minute."""
MAX_AGES = 1_000_000  # Number of frames for which a curve is tabulated if the length of the run is not known
TICK_MM, TICK_OF_RADIUS_MM = 0.1, 1e-3  # Heights and radii that messages propose are multiples of these steps
ROUNDED = 5e-3  # Fraction by which rounding to three digits may increase a radius "auto"
ROUNDING_MM = 1e-3  # Tolerance of distances, which are float32. It allows a release exactly at the clearance.


def check_fit(
    outline: Outline, solid: Solid, fluid: Fluid, solver: Solver, nozzle: Nozzle, slope: SampleSlope = LEVEL
) -> None:
    """Raise InputError if a run with these settings, each of which is valid, cannot be simulated in this crack."""
    radius_mm = sized(outline, solid, solver, nozzle).size_mm
    x_min, y_min, x_max, y_max = solid.block_mm
    side_mm = min(x_max - x_min, y_max - y_min)
    if nozzle.size_mm > side_mm:
        raise InputError(
            f"nozzle.diameter_mm is {nozzle.size_mm:g}, wider than the face, whose shorter side is {side_mm:g} "
            f"mm. Give at most {side_mm:g}."
        )
    widest_mm = outline.mean_width_mm / ACROSS_AT_LEAST / 2
    if radius_mm > (1 + ROUNDED) * widest_mm:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: fewer than {ACROSS_AT_LEAST} particles fit side by side in a crack "
            f"of mean width {outline.mean_width_mm:.2f} mm, and fluid one particle wide bridges the walls instead of "
            f"flowing. {_radii_allowed(outline, solid, widest_mm)}"
        )
    if not carried(solid, outline, radius_mm):
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: in a crack {outline.length_mm:.0f} mm long, a run would have too many "
            f"particles, or too fine a distance grid. {_radii_allowed(outline, solid, widest_mm, radius_mm)}"
        )
    if radius_mm > nozzle.size_mm / 2:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: a particle would be wider than the nozzle. Give at most "
            f"{nozzle.size_mm / 2:g}, half of nozzle.diameter_mm."
        )
    thickness_mm = -float(solid.vertices_mm[:, 2].min())
    if 2 * radius_mm > thickness_mm:
        allowed_mm = math.floor(1000 * thickness_mm / 2) / 1000
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: wall particles reach one radius into the sample, which is "
            f"{thickness_mm:g} mm thick ({solid.depth_mm:g} mm of crack above {thickness_mm - solid.depth_mm:g} mm of "
            f"floor). Give at most {allowed_mm:g}, half the thickness, or a larger crack.floor_thickness_mm."
        )
    if solver.sleep and (np.diff(fluid.course.yield_stress_pa) < 0).any():
        raise InputError(
            "fluid.curve: its yield stress falls with age, but sleeping particles would not respond to that. Give "
            "solver.sleep = false."
        )
    calibrated_mm = _calibrated_mm(fluid)
    if calibrated_mm is not None and abs(radius_mm - calibrated_mm) > ROUNDING_MM:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}, but fluid.material was calibrated at {calibrated_mm:g}: with the "
            f"same viscosity, levels differ by half a millimetre between such radii. Give {calibrated_mm:g}, or "
            "calibrate again."
        )
    fall_s = math.sqrt(2 * solid.depth_mm / (9810 * -slope.down[2]))
    if fluid.freeze_after_s != "never" and fluid.freeze_after_s < fall_s:
        raise InputError(
            f"fluid.freeze_after_s is {fluid.freeze_after_s:g}: sealant falls {solid.depth_mm:g} mm to the floor in "
            f'{fall_s:.3f} s and would freeze in the air. Give at least {fall_s:.3f}, or "never".'
        )


def _radii_allowed(outline: Outline, solid: Solid, widest_mm: float, too_fine_mm: float | None = None) -> str:
    """Return a sentence that states which radii are possible in this crack.

    ``too_fine_mm`` is a radius that is too small for a run. None if the radius is not too small.
    """
    abreast_mm = outline.mean_width_mm / 8
    auto_mm = _finest_mm(solid, outline, abreast_mm)
    if not carried(solid, outline, auto_mm):
        return (
            f"No radius is possible: at most {widest_mm:.3f} fits the crack, but even that radius exceeds the limits "
            'of a run. Use the fast model (solver.model = "slot" with fluid.viscosity_pa_s), simulate a shorter piece '
            "of the crack, or make only a path for a robot (photo.path_only = true)."
        )
    least_mm = _finest_mm(solid, outline, too_fine_mm or abreast_mm)
    return f'Give {least_mm:.3f} to {widest_mm:.3f}; "auto" is {auto_mm:.3f}.'


def _finest_mm(solid: Solid, outline: Outline, radius_mm: float) -> float:
    """Return ``radius_mm`` if a run with this radius has few enough particles and a small enough distance grid.

    Otherwise returns the smallest larger radius for which this is true. If there is none, returns the largest radius
    that fits the crack.
    """
    widest = math.floor(0.99 * outline.mean_width_mm / ACROSS_AT_LEAST / 2 / TICK_OF_RADIUS_MM)
    finest = math.floor(radius_mm / TICK_OF_RADIUS_MM)
    if finest >= widest or carried(solid, outline, radius_mm):
        return radius_mm
    while widest - finest > 1:
        middle = (widest + finest) // 2
        fits = carried(solid, outline, middle * TICK_OF_RADIUS_MM)
        widest, finest = (middle, finest) if fits else (widest, middle)
    return widest * TICK_OF_RADIUS_MM


def sized(outline: Outline, solid: Solid, solver: Solver, nozzle: Nozzle) -> Solver:
    """Return the solver with "auto" replaced by an accurate run's radius or, if that is too small, a larger one."""
    if solver.radius_mm != "auto":
        return solver
    radius_mm = _finest_mm(solid, outline, ACCURATE_RESOLUTION.radius_mm(outline.mean_width_mm, nozzle))
    return solver.model_copy(update={"radius_mm": radius_mm})


def resolved(sample: Sample, fluid: Fluid, solver: Solver, nozzle: Nozzle) -> tuple[Fluid, Solver]:
    """Return the fluid and the solver of a run, with the particle radius as a number.

    A draft has the same fluid as an accurate run, and particles that are at least as large. If the material was
    calibrated with a radius, a draft has that radius. A draft that was resolved before is returned unchanged.
    """
    outline, path = sample.outline, sample.trajectory
    solver = sized(outline, sample.solid, solver, nozzle)
    if not solver.has_particles or solver.preset != "draft" or solver.accurate_radius_mm is not None:
        return fluid, solver
    own_mm, radius_mm = solver.size_mm, RESOLUTIONS["draft"].radius_mm(outline.mean_width_mm, nozzle)
    radius_mm = _calibrated_mm(fluid) or max(own_mm, radius_mm)
    solver = solver.model_copy(update={"radius_mm": radius_mm, "accurate_radius_mm": own_mm})
    return same_fluid(fluid, nozzle, (own_mm, path), (radius_mm, path)), solver


def carried(solid: Solid, outline: Outline, radius_mm: float) -> bool:
    """Return True if a run with this radius has few enough particles and a small enough distance grid."""
    particles = (solid.figures.sealant_mm3 or 0.0) / particle_volume(radius_mm)
    return grid_fits(solid, outline, radius_mm) and particles <= PARTICLES_AT_MOST


def effective_d_cm(fluid: Fluid, paste: Rheology, support: float, frame_s: float) -> float:
    """Return the user's D. If the fluid sticks to walls, return the D that has the same total drag."""
    if fluid.D_cm is not None:
        return fluid.D_cm
    no_slip = no_slip_weight(paste.viscosity_pa_s / fluid.density_kg_m3 * CM2_IN_M2, support, frame_s)
    return paste.wall_share * no_slip


def rheology_of(fluid: Fluid, support: float, frame_s: float, frames: int = MAX_AGES) -> Rheology:
    """Return the fluid in the solver's units, tabulated up to an age of ``frames`` frames."""
    course, per_density = fluid.course, CM2_IN_M2 / fluid.density_kg_m3
    last = math.ceil(min(course.age_s[-1] / frame_s, frames))
    viscosity_pa_s, stress_pa = course.at_age(frame_s * np.arange(last + 1))
    if fluid.U is not None:
        viscosity_pa_s = np.full(last + 1, dynamic_viscosity(fluid.U, fluid.density_kg_m3, support, frame_s))
    weight = viscous_weight(1.0, support, frame_s) * viscosity_pa_s * per_density
    return Rheology(
        float(weight[0]) if fluid.U is None else fluid.U,
        fluid.D_cm or 0.0,
        viscosity_pa_s=float(viscosity_pa_s[0]),
        sticks=fluid.D_cm is None,
        wall_share=1.0 if fluid.wall_share is None else fluid.wall_share,
        law=fluid.law,
        flow_index=fluid.flow_index or 1.0,
        yield_cm2_s2=float(stress_pa[0]) * per_density,
        frames_to_freeze=frames_to_freeze(fluid, frame_s),
        physical=fluid.U is None,
        by_age=np.column_stack([weight, stress_pa * per_density]) if last else None,
    )


def solved_as(fluid: Fluid, solver: Solver, frame_s: float, frames: int) -> tuple[Rheology, int]:
    """Return the fluid in the solver's units, and the number of substeps per frame.

    Raises InputError if the fluid is too stiff for the viscosity's linear solve, needs too many explicit passes, or
    stiffens so fast that it collapses.
    """
    support = 4 * solver.size_mm * CM
    paste = rheology_of(fluid, support, frame_s, frames)
    substeps = substeps_for(solver, paste, frame_s)
    if solver.viscosity_solve == "implicit":
        _check_viscosity(fluid, solver, paste, frame_s, substeps)
        _check_yield_stress(fluid, solver)
        _check_stiffening(fluid, solver, paste, frame_s, substeps, frames)
        return paste, substeps
    lasts, shears_per_s = min(frames, paste.frames_to_freeze), (SLOWEST_SHEAR, SHEARED)
    passes = explicit_passes(paste, support, frame_s, substeps, shears_per_s=shears_per_s, frames=lasts)
    if passes > MAX_PASSES:
        raise InputError(
            f'solver.viscosity_solve is "explicit": paste that comes to rest takes {passes:.3g} passes per substep '
            f'{_in_substeps(solver, frame_s, substeps)}, but at most {MAX_PASSES} are allowed. Give "implicit".'
        )
    return paste, substeps


def _check_viscosity(fluid: Fluid, solver: Solver, paste: Rheology, frame_s: float, substeps: int) -> None:
    """Raise InputError if the viscosity at a shear rate of 1/s or in a jet is too large for the solver."""
    support, key = 4 * solver.size_mm * CM, fluid.given_by
    viscosities = [paste.apparent_cm2_s(shear, support, frame_s, yields=False).max() for shear in (1.0, SHEARED)]
    stiffness = max(viscosities) * frame_s / substeps / support**2
    if stiffness <= STIFFEST:
        return
    value = paste.viscous_weight if key == "U" else viscosities[0] / CM2_IN_M2 * fluid.density_kg_m3
    raise InputError(
        f"fluid.{key} {'reaches a viscosity of' if key == 'curve' else 'is'} {value:.6g}, which is too large to "
        f"be solved {_in_substeps(solver, frame_s, substeps)}. Give at most "
        f"{_rounded_down(value * STIFFEST / stiffness)}{_or_more(substeps * stiffness / STIFFEST)}."
    )


def _check_yield_stress(fluid: Fluid, solver: Solver) -> None:
    """Raise InputError if fresh paste has too large a yield stress. Older paste is at rest and takes few iterations."""
    stress_pa = fluid.fresh.yield_stress_pa
    column_pa = 1e-3 * fluid.density_kg_m3 * GRAVITY_M_S2 * 4 * solver.size_mm
    if stress_pa > HOLDS_SUPPORTS * column_pa:
        raise InputError(
            f"fluid.{'curve begins with a yield stress of' if fluid.curve else 'yield_stress_pa is'} "
            f"{stress_pa:.6g}{' Pa' if fluid.curve else ''}, which is too large to be solved with solver.radius_mm = "
            f"{solver.size_mm:g} with any number of substeps. Give at most {_rounded_down(HOLDS_SUPPORTS * column_pa)}."
        )


def _check_stiffening(
    fluid: Fluid, solver: Solver, paste: Rheology, frame_s: float, substeps: int, frames: int
) -> None:
    stress = paste.course[:, 1]
    rate, most = float(np.diff(stress).max(initial=0.0)) / frame_s, stress.max()
    lasts_s = min(STIFFENING_S, frame_s * min(frames, paste.frames_to_freeze))
    per_stress = frame_s / substeps / (4 * solver.size_mm * CM) ** 2
    gain = rate * lasts_s * per_stress
    if gain <= STRESS_GAIN_PER_S or most * per_stress <= STRESS_LIMIT_PER_S:
        return
    pascals = fluid.density_kg_m3 / CM2_IN_M2
    raise InputError(
        f"fluid.{'structuration_pa_per_s' if fluid.curve is None else 'curve'}: paste that gains "
        f"{rate * pascals:.6g} Pa/s makes fresh paste collapse "
        f"{_in_substeps(solver, frame_s, substeps)}. Give at most "
        f"{_rounded_down(rate * pascals * STRESS_GAIN_PER_S / gain)}{_or_more(substeps * gain / STRESS_GAIN_PER_S)}."
    )


def _in_substeps(solver: Solver, frame_s: float, substeps: int) -> str:
    return f"with solver.radius_mm = {solver.size_mm:g} in substeps of {frame_s / substeps * 1e3:.3g} ms"


def _or_more(substeps: float) -> str:
    """Return a text that proposes a minimum number of substeps. Returns "" if the number is not allowed."""
    least = math.ceil(substeps)
    return f", or solver.substeps of at least {least}" if least <= MAX_SUBSTEPS else ""


def _rounded_down(value: float) -> str:
    """Return a value as text with three significant digits, rounded down."""
    tick = 10 ** (math.floor(math.log10(value)) - 2)
    return f"{float(f'{math.floor(value / tick + ROUNDING_MM) * tick:.3g}'):g}"


def domain_of(solid: Solid, outline: Outline, trajectory: Trajectory, radius_mm: float) -> Domain:
    """Return the box of the neighbour search. It contains the crack, the face around it, and the path with sealant.

    Raises InputError if the path is so far away that the box has too many cells.
    """
    support_mm = 4 * radius_mm
    low_mm, high_mm = crack_box_mm(solid, outline, radius_mm)
    low_mm[2], high_mm[2] = -solid.depth_mm, 0.0
    nozzle_mm = trajectory.position_mm[trajectory.giving]
    low_mm = np.minimum(low_mm, [*nozzle_mm[:, :2].min(axis=0), np.inf]) - support_mm
    high_mm = np.maximum(high_mm, nozzle_mm.max(axis=0)) + support_mm
    cells = math.prod(((high_mm - low_mm) / support_mm).tolist())
    if not cells <= CELLS_AT_MOST:
        x, y, z = nozzle_mm[np.abs(nozzle_mm).max(axis=1).argmax()]
        raise InputError(
            f"trajectory: it extends to ({x:g}, {y:g}, {z:g}) mm. With solver.radius_mm = {radius_mm:g} the box "
            f"around it and the crack has {cells:.3g} cells for the neighbour search, but at most {CELLS_AT_MOST} are "
            "allowed. Bring the nozzle nearer to the crack (path.nozzle_height_mm), or give a larger radius."
        )
    return Domain(low_mm * CM, high_mm * CM)


def check_outlet(
    schedule: Schedule,
    trajectory: Trajectory,
    outline: Outline,
    surface: SolidSurface,
    *,
    diameter_mm: float,
) -> None:
    """Raise InputError if a particle would be released inside the solid, or closer to it than the clearance.

    The message proposes several changes, each of which is sufficient.
    """
    least_mm, low_mm = surface.clearance / CM - ROUNDING_MM, trajectory.position_mm[:, 2].min()

    def is_blocked(height_mm: float) -> np.ndarray:
        raised_mm = np.add(schedule.position_mm, (0.0, 0.0, height_mm - low_mm))
        return surface.exact_mm(raised_mm) < least_mm

    blocked = is_blocked(low_mm)
    if not blocked.any():
        return
    at_s = trajectory.t_s[0] + schedule.frame_of * schedule.frame_s
    s_mm = np.interp(at_s, trajectory.t_s, trajectory.s_mm)[blocked]
    x, y, z = schedule.position_mm[blocked][0]
    begins_mm, ends_mm = trajectory.s_mm[trajectory.giving][[0, -1]]
    higher_mm = (TICK_MM * tick for tick in itertools.count(math.floor(low_mm / TICK_MM) + 1))
    height_mm = next(each_mm for each_mm in higher_mm if not is_blocked(each_mm).any())
    # The trim is in whole millimetres. It is not tested, because releases along another path are rotated differently.
    trim_mm = math.floor(np.minimum(s_mm, outline.length_mm - s_mm).max()) + 1
    trim = f"path.trim_mm of at least {trim_mm}, or " if 2 * trim_mm < outline.length_mm - 1 else ""
    raise InputError(
        f"nozzle.diameter_mm is {diameter_mm:g}, path.trim_mm lets sealant flow from s = {begins_mm:g} to "
        f"{ends_mm:g} mm and path.nozzle_height_mm is {low_mm:g}: with these settings the nozzle releases "
        f"sealant in the solid, such as a dam at an open end, or nearer to it than {surface.clearance / CM:.2f} mm, "
        f"first at s = {s_mm[0]:.1f} mm, ({x:.1f}, {y:.1f}, {z:.1f}) mm. Give {trim}path.nozzle_height_mm of at "
        f"least {height_mm:g}, or a smaller nozzle.diameter_mm."
    )


def _calibrated_mm(fluid: Fluid) -> float | None:
    """Return the radius with which the fluid's material was calibrated. None if there is none."""
    return fluid.material.radius_mm if isinstance(fluid.material, Material) else None
