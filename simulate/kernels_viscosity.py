"""Device code of the viscosity: Eq. 5 of the paper, its implicit form, and a yield stress in it. Centimetres, seconds.

A particle's ``thickness`` is the weight of its pairs in a substep: U of Eq. 5 over h sqrt(pi), or what a viscosity and
a yield stress amount to. Rows of the implicit system are multiplied by the particle's volume m/rho, which makes the
matrix symmetric.
"""

from types import ModuleType
from typing import Any, NamedTuple

import warp as wp

from simulate.kernels_rest import Movers

wp.set_module_options({"enable_backward": False})

CHUNKS = wp.constant(64)
"""Parts of a run in which a scalar product is summed: the same whatever the device and the number of threads."""


@wp.struct
class Paste:
    """What a run's fluid is, by the number of the run, and what the numbers make of it."""

    thin: wp.array[float]
    """Thickness of the fluid where it flows fast."""
    drag: wp.array[float]
    """D of Eq. 5 in a substep over h sqrt(pi)."""
    yields_at: wp.array[float]
    """Yield stress of fresh paste over density, cm2/s2."""
    stiffens_by: wp.array[float]
    """What a second of age adds to it."""
    yields_at_most: wp.array[float]
    per_viscosity: float
    """Thickness for each cm2/s of viscosity."""
    per_shear: float
    """Squared shear, 1/s2, for each unit of the sum over pairs."""
    wall_per_viscosity: float
    """Drag for each cm2/s2 of yield stress at a speed of 1 cm/s."""
    slowest_shear: float
    """1/s: below it the paste creeps as a fluid of constant viscosity."""
    slowest: float
    """cm/s: the same along a wall."""


@wp.func
def yield_stress(paste: Paste, run: int, age_s: float):
    return wp.min(paste.yields_at[run] + paste.stiffens_by[run] * age_s, paste.yields_at_most[run])


class ViscosityKernels(NamedTuple):
    measure_shear: Any
    weigh_pairs: Any
    apply_matrix: Any
    pass_velocity: Any


@wp.kernel
def start_search(
    begin: int,
    movers: Movers,
    resistance: wp.array[float],
    bulk: wp.array[wp.vec2],
    velocity: wp.array[wp.vec3],
    product: wp.array[wp.vec3],
    residual: wp.array[wp.vec3],  # out
    scaled: wp.array[wp.vec3],  # out
    direction: wp.array[wp.vec3],  # out
    whole: wp.array[wp.vec3],  # out
):
    """Start of the search from the velocity without viscosity: residual, and right side, over the diagonal (Jacobi)."""
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    diagonal = bulk[i][0] + resistance[row]
    right = bulk[i][0] * velocity[i]
    r = right - product[row]
    residual[row] = r
    scaled[row] = r / diagonal
    direction[i] = r / diagonal
    # Its square is the right side's over the diagonal.
    whole[row] = right / wp.sqrt(diagonal)


@wp.kernel
def advance_search(
    begin: int,
    movers: Movers,
    points_a_run: int,
    error: wp.array[float],
    goal: wp.array[float],
    curvature: wp.array[float],
    resistance: wp.array[float],
    bulk: wp.array[wp.vec2],
    direction: wp.array[wp.vec3],
    product: wp.array[wp.vec3],
    velocity: wp.array[wp.vec3],  # in, out
    residual: wp.array[wp.vec3],  # in, out
    scaled: wp.array[wp.vec3],  # out
):
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    run = i // points_a_run
    if error[run] <= goal[run]:
        return
    # A fluid at rest has nothing to solve for: 0 / 0.
    length = error[run] / wp.max(curvature[run], 1.0e-30)
    velocity[i] = velocity[i] + length * direction[i]
    r = residual[row] - length * product[row]
    residual[row] = r
    scaled[row] = r / (bulk[i][0] + resistance[row])


@wp.kernel
def turn_search(
    begin: int,
    movers: Movers,
    points_a_run: int,
    error: wp.array[float],
    error_before: wp.array[float],
    scaled: wp.array[wp.vec3],
    direction: wp.array[wp.vec3],  # in, out
):
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    run = i // points_a_run
    direction[i] = scaled[row] + error[run] / wp.max(error_before[run], 1.0e-30) * direction[i]


@wp.kernel
def sum_chunks(
    movers: Movers,
    a: wp.array[wp.vec3],
    b: wp.array[wp.vec3],
    partial: wp.array2d[float],  # out
):
    """Scalar product of two vectors by row, in parts."""
    run, chunk = wp.tid()
    total = float(0.0)
    for row in range(movers.first_row[run] + chunk, movers.first_row[run + 1], CHUNKS):
        total += wp.dot(a[row], b[row])
    partial[run, chunk] = total


@wp.kernel
def sum_chunks_along(
    movers: Movers,
    direction: wp.array[wp.vec3],
    product: wp.array[wp.vec3],
    partial: wp.array2d[float],  # out
):
    """The same where the first vector is by particle."""
    run, chunk = wp.tid()
    total = float(0.0)
    for row in range(movers.first_row[run] + chunk, movers.first_row[run + 1], CHUNKS):
        total += wp.dot(direction[movers.who[row]], product[row])
    partial[run, chunk] = total


@wp.kernel
def finish_sum(
    partial: wp.array2d[float],
    total: wp.array[float],  # in, out
    before: wp.array[float],  # out
):
    """The parts in their order; what the sum was before is kept."""
    run = wp.tid()
    sum = float(0.0)
    for chunk in range(CHUNKS):
        sum += partial[run, chunk]
    before[run] = total[run]
    total[run] = sum


@wp.kernel
def set_goal(
    of_the_whole: float,
    of_the_change: float,
    whole: wp.array[float],
    error: wp.array[float],
    goal: wp.array[float],  # out
):
    run = wp.tid()
    goal[run] = wp.min(of_the_whole * of_the_whole * whole[run], of_the_change * of_the_change * error[run])


@wp.kernel
def ask_for_more(
    at_most: int,
    error: wp.array[float],
    goal: wp.array[float],
    searches: wp.array[int],  # in, out
    more: wp.array[int],  # out
    unsolved: wp.array[int],  # in, out
):
    """Whether a run's residual is above its goal still; one that was searched ``at_most`` times stays unsolved."""
    run = wp.tid()
    if error[run] > goal[run]:
        if searches[run] < at_most:
            searches[run] = searches[run] + 1
            more[0] = 1
        else:
            unsolved[run] = 1


def viscosity_kernels(loops: ModuleType, module: Any) -> ViscosityKernels:
    """Those that go over pairs, with the inner loops of ``loops``."""
    sum_shear, couple, sum_drag, sum_pulled = loops.sum_shear, loops.couple, loops.sum_drag, loops.sum_pulled

    @wp.kernel(enable_backward=False, module=module)
    def measure_shear(
        begin: int,
        movers: Movers,
        points_a_run: int,
        support: float,
        paste: Paste,
        fresh_shear: float,
        fresh_speed: float,
        frame: wp.array[int],
        frame_s: float,
        frame_of: wp.array[int],
        place: wp.array[wp.vec4],
        velocity: wp.array[wp.vec3],
        listed: wp.array2d[int],
        count: wp.array[int],
        bulk: wp.array[wp.vec2],  # in, out: the thickness, which no one reads here
        shear: wp.array[float],  # out
        yields: wp.array[float],  # out
        slides: wp.array[float],  # out
    ):
        """Shear, by the velocities that the last substep left, and Bingham's viscosity at it.

        gamma^2 = sum_j w_ij |v_i - v_j|^2 / (2 c h^2) is the rate at which the viscosity dissipates;
        nu + tau / (rho (gamma + eps)).
        """
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.who[row]
        run = i // points_a_run
        gamma = fresh_shear
        slide = fresh_speed
        age = frame[0] - frame_of[i]
        if age > 0:
            here = place[i]
            slide = wp.length(velocity[i])
            sheared = sum_shear(place, velocity, bulk, listed, row, count[row], here, velocity[i], support)
            gamma = wp.sqrt(paste.per_shear * sheared)
        tau = yield_stress(paste, run, float(age) * frame_s)
        shear[i] = gamma
        yields[row] = tau
        slides[row] = slide
        thickness = paste.thin[run] + paste.per_viscosity * tau / (gamma + paste.slowest_shear)
        bulk[i] = wp.vec2(bulk[i][0], thickness)

    @wp.kernel(enable_backward=False, module=module)
    def weigh_pairs(
        begin: int,
        movers: Movers,
        points_a_run: int,
        support: float,
        paste: Paste,
        place: wp.array[wp.vec4],
        slides: wp.array[float],
        yields: wp.array[float],
        bulk: wp.array[wp.vec2],
        listed: wp.array2d[int],
        count: wp.array[int],
        wall: wp.array[wp.vec4],
        wall_listed: wp.array2d[int],
        wall_count: wp.array[int],
        coupling: wp.array2d[float],  # out
        resistance: wp.array[float],  # out
    ):
        """The weight of each pair, and its sum with the walls' drag for each particle; all times m/rho_i."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.who[row]
        run = i // points_a_run
        here = place[i]
        own = bulk[i]
        total = couple(place, bulk, listed, row, count[row], here, own, support, coupling)
        drag = paste.drag[run] + paste.wall_per_viscosity * yields[row] / (slides[row] + paste.slowest)
        walls = sum_drag(wall, wall_listed, row, wall_count[row], here, support)
        resistance[row] = total + own[0] * drag * walls

    @wp.kernel(enable_backward=False, module=module)
    def apply_matrix(
        begin: int,
        movers: Movers,
        listed: wp.array2d[int],
        count: wp.array[int],
        coupling: wp.array2d[float],
        resistance: wp.array[float],
        bulk: wp.array[wp.vec2],
        vector: wp.array[wp.vec3],
        product: wp.array[wp.vec3],  # out
    ):
        """(I + A) of backward Euler on Eq. 5, times a vector of velocities."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.who[row]
        pulled = sum_pulled(vector, coupling, listed, row, count[row])
        product[row] = (bulk[i][0] + resistance[row]) * vector[i] - pulled

    @wp.kernel(enable_backward=False, module=module)
    def pass_velocity(
        begin: int,
        movers: Movers,
        passes: float,
        listed: wp.array2d[int],
        count: wp.array[int],
        coupling: wp.array2d[float],
        resistance: wp.array[float],
        bulk: wp.array[wp.vec2],
        before: wp.array[wp.vec3],
        after: wp.array[wp.vec3],  # out
    ):
        """One of the q passes of Eq. 5."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.who[row]
        pulled = sum_pulled(before, coupling, listed, row, count[row])
        after[i] = before[i] - (resistance[row] * before[i] - pulled) / (passes * bulk[i][0])

    return ViscosityKernels(measure_shear, weigh_pairs, apply_matrix, pass_velocity)
