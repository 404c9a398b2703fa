"""Checks that the settings of particles fit a crack. They also convert the fluid to the solver's units."""

import math
from collections.abc import Callable

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline, Solid, Trajectory
from sealtwin.core.regime import GRAVITY_M_S2
from simulate.fluid.solver import SLOWEST_SHEAR, Domain, substeps_for
from simulate.fluid.viscosity import STABLE, explicit_parts
from simulate.material_file import Material
from simulate.settings import LEVEL, MOST_SUBSTEPS, THICKNESSES, Fluid, Nozzle, SampleSlope, Solver, particle_volume
from simulate.setup.release_schedule import PARTICLES_AT_MOST, Schedule, frames_to_freeze, plan_releases
from simulate.setup.rheology import (
    CM2_IN_M2,
    Rheology,
    dynamic_viscosity,
    kinematic_viscosity,
    no_slip_weight,
    viscous_weight,
)
from simulate.setup.signed_distance import CM, SolidSurface, crack_box_mm, grid_fits

ACROSS_AT_LEAST = 2  # Least number of particles abreast in a crack of mean width
CELLS_AT_MOST = 4_000_000
"""Largest number of cells of the neighbour search, 90 times that of the paper's trial. A substep scans all cells in 2
ms."""
STIFFEST = 1000.0
"""Largest kinematic viscosity that is solved for, times a substep divided by h^2. It is 2,400 Pa s at a radius of 0.4
mm. At this limit pours in slots 1.2 to 12 mm wide are solved. At 4000 particles are flung away."""
HOLDS_SUPPORTS = 100.0
"""Largest yield stress of fresh paste that is solved for, divided by rho g h. It is 2,650 Pa at a radius of 0.4 mm. At
this limit pours take up to a fifth of the allowed iterations with any substep. At 200 one pour of 18 fails."""
STIFFENS = 150.0
"""Largest gain of yield stress in ``STIFFENING_S``, divided by rho h^2 / dt, in 1/s. It is 105 Pa/s at a radius of 0.4
mm. From a gain of 180 on, stiffened paste compresses the fresh paste that it encloses until that collapses."""
STIFFENING_S = 3.0  # Longest time over which a gain is counted
LIMP = 30.0  # Yield stress over rho h^2 / dt, in 1/s, up to which paste may stiffen at any rate
SHEARED = 100.0  # Shear in 1/s of a jet that hits a bed: the largest, at which shear-thickening paste is stiffest
MOST_PASSES = 5000
"""Largest number of explicit passes of a substep, equal to the limit of a solve's iterations. Paste at rest takes most:
2,600 with 1 Pa at a radius of 0.6 mm. There 36 particles in substeps of 2.8 ms take a minute for a second of pouring.
"""
MOST_AGES = 1_000_000  # Frames up to which a curve is tabulated if the length of the run is not given
TICK_MM, TICK_OF_RADIUS_MM = 0.1, 1e-3  # Steps of the diameters and heights, and of the radii, in proposals
ROUNDING_MM = 1e-3  # Tolerance of distances, which are float32: a release at just the clearance is allowed


def check_fit(
    outline: Outline, solid: Solid, fluid: Fluid, solver: Solver, nozzle: Nozzle, slope: SampleSlope = LEVEL
) -> None:
    """Raise InputError if valid settings of particles are impossible in this crack."""
    if not solver.has_particles:
        return
    radius_mm = solver.for_crack(outline.mean_width_mm, nozzle).size_mm
    x_min, y_min, x_max, y_max = solid.block_mm
    side_mm = min(x_max - x_min, y_max - y_min)
    if nozzle.diameter_mm > side_mm:
        raise InputError(
            f"nozzle.diameter_mm is {nozzle.diameter_mm:g}: wider than the face, whose shorter side is {side_mm:g} "
            f"mm. Give at most {side_mm:g}."
        )
    widest_mm = outline.mean_width_mm / ACROSS_AT_LEAST / 2
    if radius_mm > widest_mm:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: fewer than {ACROSS_AT_LEAST} particles fit abreast in a crack "
            f"of mean width {outline.mean_width_mm:.2f} mm, and fluid one particle wide bridges the walls instead of "
            f"flowing. {_radii_allowed(outline, solid, widest_mm)}"
        )
    if not _carried(solid, outline, radius_mm):
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: a crack {outline.length_mm:.0f} mm long needs more particles, or a "
            f"finer distance grid, than a run can have. {_radii_allowed(outline, solid, widest_mm, radius_mm)}"
        )
    if radius_mm > nozzle.diameter_mm / 2:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: a particle is wider than the nozzle it leaves. Give at most "
            f"{nozzle.diameter_mm / 2:g}, half of nozzle.diameter_mm."
        )
    thickness_mm = -float(solid.vertices_mm[:, 2].min())
    if 2 * radius_mm > thickness_mm:
        allowed_mm = math.floor(1000 * thickness_mm / 2) / 1000
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: wall particles reach one radius into the sample, which is "
            f"{thickness_mm:g} mm thick ({solid.depth_mm:g} mm of crack above {thickness_mm - solid.depth_mm:g} mm of "
            f"floor). Give at most {allowed_mm:g}, half the thickness, or a larger crack.floor_thickness_mm."
        )
    if (course := fluid.course) is not None and solver.sleep and course.softens:
        raise InputError(
            "fluid.curve: its yield stress falls with age, but sleeping particles would not respond to that. Give "
            "solver.sleep = false."
        )
    calibrated_mm = fluid.material.radius_mm if isinstance(fluid.material, Material) else None
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
    """Return a sentence on the radii that this crack allows. Its distance grid may set a lower limit."""
    abreast_mm = outline.mean_width_mm / 8
    if _carried(solid, outline, abreast_mm):
        four_abreast = f'"auto" is {abreast_mm:.3f}, four particles abreast as in the paper'
        least = "at most"
        if too_fine_mm is not None:
            ends = math.ceil(abreast_mm / TICK_OF_RADIUS_MM), math.floor(too_fine_mm / TICK_OF_RADIUS_MM)
            ticks = _bisect(*ends, lambda ticks: _carried(solid, outline, ticks * TICK_OF_RADIUS_MM))
            least = f"{ticks * TICK_OF_RADIUS_MM:.3f} to"
        return f"Give {least} {widest_mm:.3f}; {four_abreast}."
    too_fine = f'"auto" ({abreast_mm:.3f}) is too fine for a run'
    if _carried(solid, outline, 0.99 * widest_mm):
        return f"Give {0.99 * widest_mm:.3f}; {too_fine}."
    return (
        f"No radius is possible: at most {widest_mm:.3f} fits the crack, but even that radius is too fine for a run. "
        'Use the fast model (solver.model = "slot" with fluid.viscosity_pa_s), simulate a shorter piece of the '
        "crack, or make only a path for a robot (photo.path_only = true)."
    )


def _carried(solid: Solid, outline: Outline, radius_mm: float) -> bool:
    """Return True if a run can have the particles and the distance grid that a radius needs."""
    particles = (solid.figures.sealant_mm3 or 0.0) / particle_volume(radius_mm)
    return grid_fits(solid, outline, radius_mm) and particles <= PARTICLES_AT_MOST


def check_damping(solver: Solver, step_s: float) -> None:
    if solver.damping_per_s * step_s > 1:
        raise InputError(
            f"solver.damping_per_s is {solver.damping_per_s:g}: in a substep of {step_s * 1e3:.3g} ms it would remove "
            f"more than a particle's whole speed. Give at most {1 / step_s:.4g}, or more substeps."
        )


def effective_d_cm(fluid: Fluid, paste: Rheology, support: float, frame_s: float) -> float:
    """Return D as given or, if the fluid sticks to walls, the D with the total drag of no-slip walls."""
    if fluid.D_cm is not None:
        return fluid.D_cm
    no_slip = no_slip_weight(paste.viscosity_pa_s / fluid.density_kg_m3 * CM2_IN_M2, support, frame_s)
    return paste.wall_share * no_slip


def rheology_of(fluid: Fluid, support: float, frame_s: float, frames: int = MOST_AGES) -> Rheology:
    """Return the fluid in the solver's units, up to an age of ``frames``."""
    (viscosity_pa_s, fresh_stress_pa), u, by_age = fluid.fresh, fluid.U or 0.0, None
    if viscosity_pa_s is None:
        viscosity_pa_s = dynamic_viscosity(u, fluid.density_kg_m3, support, frame_s)
    else:
        u = viscous_weight(viscosity_pa_s / fluid.density_kg_m3 * CM2_IN_M2, support, frame_s)
    if (course := fluid.course) is not None:
        last = math.ceil(min(course.age_s[-1] / frame_s, frames))
        viscosity, stress_pa = course.at(frame_s * np.arange(last + 1))
        grown = viscosity / viscosity[0]
        by_age = np.column_stack([u * grown, stress_pa / fluid.density_kg_m3 * CM2_IN_M2])
    return Rheology(
        u,
        fluid.D_cm or 0.0,
        viscosity_pa_s=viscosity_pa_s,
        sticks=fluid.D_cm is None,
        wall_share=1.0 if fluid.wall_share is None else fluid.wall_share,
        flow_index=fluid.flow_index or 1.0,
        yield_cm2_s2=fresh_stress_pa / fluid.density_kg_m3 * CM2_IN_M2,
        stiffening_cm2_s3=fluid.structuration_pa_per_s / fluid.density_kg_m3 * CM2_IN_M2,
        yield_most_cm2_s2=fluid.most_yield_stress_pa / fluid.density_kg_m3 * CM2_IN_M2,
        frames_to_freeze=frames_to_freeze(fluid, frame_s),
        physical=fluid.U is None,
        by_age=by_age,
    )


def solved_as(fluid: Fluid, solver: Solver, frame_s: float, frames: int) -> tuple[Rheology, int]:
    """Return the fluid in the solver's units, and the number of substeps of a frame.

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
    else:
        _check_passes(fluid, solver, paste, frame_s, substeps, frames)
    return paste, substeps


def _check_passes(fluid: Fluid, solver: Solver, paste: Rheology, frame_s: float, substeps: int, frames: int) -> None:
    """Raise InputError if paste that comes to rest would need too many passes at its stiffest age."""
    lasts_s = frame_s * min(frames, paste.frames_to_freeze)
    support, shears_per_s = 4 * solver.size_mm * CM, (SLOWEST_SHEAR, SHEARED)
    parts = explicit_parts(paste, support, frame_s, substeps, shears_per_s=shears_per_s, lasts_s=lasts_s)
    thick = next((key for key in THICKNESSES if getattr(fluid, key) is not None), "curve")
    stress_pa = paste.reached_cm2_s2(lasts_s) * fluid.density_kg_m3 / CM2_IN_M2
    stiff, verb = (
        ("yield_stress_pa", "is") if stress_pa <= fluid.yield_stress_pa else ("yield_stress_most_pa", "reaches")
    )
    of = [(thick, "is", getattr(fluid, thick)), (stiff, verb, stress_pa), ("D_cm", "is", fluid.D_cm)]
    if (passes := sum(parts) / STABLE) <= MOST_PASSES:
        return
    part, (key, verb, value) = max(zip(parts, of, strict=True), key=lambda one: one[0])
    spare = STABLE * MOST_PASSES - (sum(parts) - part)
    cause, allowed = f"fluid.{key} {verb} {value:.6g}" if fluid.curve is None else "fluid.curve is too stiff", "Give"
    if spare > 0 and fluid.curve is None:
        softer = rheology_of(fluid.model_copy(update={key: value * spare / part}), support, frame_s, frames)
        # Softer sealant may have longer substeps, in which all parts are larger.
        spare = STABLE * MOST_PASSES * min(1.0, substeps_for(solver, softer, frame_s) / substeps) - (sum(parts) - part)
        allowed = f"Give at most {_rounded_down(value * spare / part)}, or" if spare > 0 else "Give"
    raise InputError(
        f"{cause}: the explicit viscosity solve takes {passes:.3g} passes a substep for paste that comes to rest "
        f"{_in_substeps(solver, frame_s, substeps)}, but at most {MOST_PASSES} are allowed. {allowed} "
        'solver.viscosity_solve = "implicit".'
    )


def _check_viscosity(fluid: Fluid, solver: Solver, paste: Rheology, frame_s: float, substeps: int) -> None:
    support = 4 * solver.size_mm * CM
    thickest = float(paste.course[:, 0].max())
    stiffness = kinematic_viscosity(thickest, support, frame_s) * frame_s / substeps / support**2
    stiffness *= SHEARED ** max(0.0, paste.flow_index - 1)
    if stiffness <= STIFFEST:
        return
    key = next((key for key in THICKNESSES if getattr(fluid, key) is not None), "curve")
    value = thickest if key == "U" else dynamic_viscosity(thickest, fluid.density_kg_m3, support, frame_s)
    raise InputError(
        f"fluid.{key} {'reaches' if key == 'curve' else 'is'} {value:.6g}, which is too stiff to be solved "
        f"{_in_substeps(solver, frame_s, substeps)}. Give at most "
        f"{_rounded_down(value * STIFFEST / stiffness)}{_or_more(substeps * stiffness / STIFFEST)}."
    )


def _check_yield_stress(fluid: Fluid, solver: Solver) -> None:
    """Raise InputError if fresh paste is too stiff; older paste is at rest and takes few iterations."""
    stress_pa = fluid.fresh.yield_stress_pa
    column_pa = 1e-3 * fluid.density_kg_m3 * GRAVITY_M_S2 * 4 * solver.size_mm
    if stress_pa > HOLDS_SUPPORTS * column_pa:
        raise InputError(
            f"fluid.{'curve begins with a yield stress of' if fluid.curve else 'yield_stress_pa is'} "
            f"{stress_pa:.6g}{' Pa' if fluid.curve else ''}, which is too stiff to be solved with solver.radius_mm = "
            f"{solver.size_mm:g} at any number of substeps. Give at most {_rounded_down(HOLDS_SUPPORTS * column_pa)}."
        )


def _check_stiffening(
    fluid: Fluid, solver: Solver, paste: Rheology, frame_s: float, substeps: int, frames: int
) -> None:
    rate, most = paste.stiffening_cm2_s3, paste.yield_most_cm2_s2
    if len(paste.course) > 1:
        rate = float(np.diff(paste.course[:, 1]).max()) / frame_s
    lasts_s = min(STIFFENING_S, frame_s * min(frames, paste.frames_to_freeze))
    per_stress = frame_s / substeps / (4 * solver.size_mm * CM) ** 2
    gain = rate * lasts_s * per_stress
    if gain <= STIFFENS or most * per_stress <= LIMP:
        return
    pascals = fluid.density_kg_m3 / CM2_IN_M2
    key, limp = "structuration_pa_per_s is", ""
    if fluid.curve is not None:
        key = "curve gains a yield stress, in Pa/s, of up to"
    elif fluid.yield_stress_pa <= (limp_pa := LIMP / per_stress * pascals):
        limp = f", or fluid.yield_stress_most_pa of at most {_rounded_down(limp_pa)}"
    raise InputError(
        f"fluid.{key} {rate * pascals:.6g}: paste that stiffens so fast makes fresh paste collapse "
        f"{_in_substeps(solver, frame_s, substeps)}. Give at most "
        f"{_rounded_down(rate * pascals * STIFFENS / gain)}{limp}{_or_more(substeps * gain / STIFFENS)}."
    )


def _in_substeps(solver: Solver, frame_s: float, substeps: int) -> str:
    return f"with solver.radius_mm = {solver.size_mm:g} in substeps of {frame_s / substeps * 1e3:.3g} ms"


def _or_more(substeps: float) -> str:
    """Return a proposal of a least number of substeps; "" if a frame cannot have as many."""
    least = math.ceil(substeps)
    return f", or solver.substeps of at least {least}" if least <= MOST_SUBSTEPS else ""


def _rounded_down(value: float) -> str:
    """Return a value with three significant digits, rounded down."""
    tick = 10 ** (math.floor(math.log10(value)) - 2)
    return f"{float(f'{math.floor(value / tick + ROUNDING_MM) * tick:.3g}'):g}"


def domain_of(solid: Solid, outline: Outline, trajectory: Trajectory, radius_mm: float) -> Domain:
    """Return the box of the neighbour search: the crack, the face around it, and the path while sealant flows.

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
            f"trajectory: it extends to ({x:g}, {y:g}, {z:g}) mm; with solver.radius_mm = {radius_mm:g} the box "
            f"around it and the crack has {cells:.3g} cells for the neighbour search; at most {CELLS_AT_MOST} are "
            "allowed. Bring the nozzle nearer to the crack (path.nozzle_height_mm), or give a larger radius."
        )
    return Domain(low_mm * CM, high_mm * CM)


def check_outlet(
    schedule: Schedule,
    trajectory: Trajectory,
    outline: Outline,
    surface: SolidSurface,
    *,
    radius_mm: float,
    diameter_mm: float,
    seed: int,
) -> None:
    """Raise InputError if a particle would be released inside the solid or nearer to it than its clearance.

    The message proposes settings, each of which would be enough. A proposed diameter or height has been tried.
    """
    blocked = _blocked(schedule.position_mm, surface)
    if not blocked.any():
        return
    at_s = trajectory.t_s[0] + schedule.frame_of * schedule.frame_s
    s_mm = np.interp(at_s, trajectory.t_s, trajectory.s_mm)[blocked]
    x, y, z = schedule.position_mm[blocked][0]
    begins_mm, ends_mm = trajectory.s_mm[trajectory.giving][[0, -1]]
    remedies = [
        _larger_trim(s_mm, outline.length_mm),
        _smaller_nozzle(trajectory, surface, radius_mm, diameter_mm, seed),
        _higher_nozzle(schedule.position_mm, trajectory, surface),
    ]
    allowed = ", or ".join(remedy for remedy in remedies if remedy) or "a path that is farther from the solid"
    raise InputError(
        f"nozzle.diameter_mm is {diameter_mm:g}, path.trim_mm lets sealant flow from s = {begins_mm:g} to "
        f"{ends_mm:g} mm and path.nozzle_height_mm is {trajectory.position_mm[:, 2].min():g}: together they release "
        f"sealant in the solid, such as a dam at an open end, or nearer to it than {surface.clearance / CM:.2f} mm; "
        f"first at s = {s_mm[0]:.1f} mm, ({x:.1f}, {y:.1f}, {z:.1f}) mm. Give {allowed}."
    )


def _blocked(points_mm: Floats, surface: SolidSurface) -> np.ndarray:
    """Return the mask of points nearer to the solid than the clearance, (n,)."""
    return surface.exact_mm(points_mm) < surface.clearance / CM - ROUNDING_MM


def _larger_trim(blocked_s_mm: Floats, length_mm: float) -> str:
    """Return a proposal of a larger trim, in whole millimetres.

    It is not tried, because discs are turned differently along another path.
    """
    from_end_mm = np.minimum(blocked_s_mm, length_mm - blocked_s_mm)
    trim_mm = math.floor(from_end_mm.max()) + 1
    return f"path.trim_mm of at least {trim_mm}" if 2 * trim_mm < length_mm - 1 else ""


def _smaller_nozzle(
    trajectory: Trajectory, surface: SolidSurface, radius_mm: float, diameter_mm: float, seed: int
) -> str:
    def fits(ticks: int) -> bool:
        try:
            schedule = plan_releases(trajectory, radius_mm, ticks * TICK_MM, seed)
        except InputError:
            return False
        return not _blocked(schedule.position_mm, surface).any()

    smallest, blocked = math.ceil(2 * radius_mm / TICK_MM), math.ceil(diameter_mm / TICK_MM)
    if smallest >= blocked or not fits(smallest):
        return ""
    return f"nozzle.diameter_mm of at most {_bisect(smallest, blocked, fits) * TICK_MM:g}"


def _higher_nozzle(points_mm: Floats, trajectory: Trajectory, surface: SolidSurface) -> str:
    low_mm = trajectory.position_mm[:, 2].min()
    top_mm = surface.mesh.points.numpy()[:, 2].max() / CM + surface.clearance / CM

    def fits(ticks: int) -> bool:
        return not _blocked(points_mm + np.array([0, 0, ticks * TICK_MM - low_mm]), surface).any()

    blocked, highest = math.floor(low_mm / TICK_MM), math.ceil(top_mm / TICK_MM)
    if highest <= blocked or not fits(highest):
        return ""
    return f"path.nozzle_height_mm of at least {_bisect(highest, blocked, fits) * TICK_MM:g}"


def _bisect(good: int, bad: int, fits: Callable[[int], bool]) -> int:
    """Return the last value that fits, between ``good``, which fits, and ``bad``, which does not."""
    while abs(good - bad) > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if fits(middle) else (good, middle)
    return good
