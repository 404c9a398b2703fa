"""Device code of the viscosity: Eq. 5 of the paper, its implicit form, and a yield stress in it. Centimetres, seconds.

A particle's ``viscosity`` is the weight of its pairs in a substep: U of Eq. 5 over h sqrt(pi), or the weight that
stands for a viscosity and a yield stress. In the implicit form pairs pull along the line between them, with the mean
of both volumes, so that they keep momentum and angular momentum (decision 0111); the explicit passes are Eq. 5 as
printed.
"""

from types import ModuleType
from typing import Any, NamedTuple

import warp as wp

from simulate.kernels.neighbours import Neighbours
from simulate.kernels.pair_sums import DragSums, GradientSums, gauss
from simulate.kernels.status import Movers, Particles

wp.set_module_options({"enable_backward": False})

CHUNKS = wp.constant(64)
"""Parts of a run whose sums are made one by one, the same on all devices and with any number of threads."""

WALL_MOMENT = wp.constant(0.057)
"""Weight of a wall in the fit that measures shear, over h and ``stick``'s weights: as that of the pairs it cuts off."""
LEAST_MOMENT = wp.constant(6.0e-5)
"""Moment, over h^5, below which a particle's neighbours say nothing of a direction: a thousandth of what a liquid has.
"""
ROUNDS = wp.constant(1.0e-3)
"""Part of a curvature below which a difference of two float32 sums is not to be trusted."""


@wp.struct
class Paste:
    """Constants of each run's fluid, by the number of the run, and factors that all runs share."""

    by_age: wp.array2d[wp.vec2]
    """Weight of pairs without a yield stress, at a shear of 1/s, and yield stress over density in cm2/s2, by run and
    age in frames; the last age stands for all later ones.
    """
    flow_index: wp.array[float]  # Power of the shear in the stress: 1 for a viscosity that does not depend on it
    drag: wp.array[float]  # D of Eq. 5 in a substep over h sqrt(pi).
    sticks: wp.array[float]  # 1 for a fluid that sticks to walls by its viscosity, 0 for one with a D of its own
    stiffens_by: wp.array[float]  # Yield stress over density that a second of age adds
    yields_at_most: wp.array[float]
    per_viscosity: float  # Weight of pairs for each cm2/s of viscosity
    slowest_shear: float  # 1/s: below it the paste creeps as a fluid of constant viscosity


@wp.struct
class System:
    """The linear system (I + A) v_new = v of backward Euler on Eq. 5, by row."""

    coupling: wp.array2d[float]
    """Weight of each pair over its squared distance, in the slots of the fluid's neighbour lists."""
    drag: wp.array[float]  # By the walls
    held: wp.array[float]  # Drag by the walls and by neighbours at rest
    inverse: wp.array[wp.mat33]  # Of a particle's own block of I + A
    resistance: wp.array[float]  # Largest part of a velocity that a pass of Eq. 5 takes away
    at_walls: wp.array[float]  # Weight of pairs with a wall to which the fluid sticks; by particle


@wp.struct
class Search:
    """Conjugate gradients, as Chronopoulos and Gear arrange them: vectors by row, scalars by run.

    The residual times the inverses of the particles' own blocks (Jacobi's preconditioner) is by particle, for
    it is what the matrix is applied to.
    """

    residual: wp.array[wp.vec3]
    product: wp.array[wp.vec3]  # The matrix times the scaled residual
    direction: wp.array[wp.vec3]
    pull: wp.array[wp.vec3]  # The matrix times the direction
    partial: wp.array2d[wp.vec4]  # Sums of each part of a run
    error: wp.array[float]
    length: wp.array[float]  # How far to go along the direction
    turn: wp.array[float]  # Share of the last direction in the next one
    goal: wp.array[float]
    holds: wp.array[float]  # Number of particles, and the drag of all that does not move with them
    warm: wp.array[int]  # 1 where the search begins at the guess
    iterations: wp.array[int]


class ViscosityKernels(NamedTuple):
    measure_shear: Any
    weigh_pairs: Any
    measure_residuals: Any
    apply_matrix: Any
    measure_rates: Any
    pass_velocity: Any


@wp.func
def rows_of(movers: Movers, part: int):
    """First row of a part of a run, and one past its last."""
    run = part // CHUNKS
    first = movers.first_row[run]
    rows = movers.first_row[run + 1] - first
    width = (rows + CHUNKS - 1) // CHUNKS
    begin = wp.min(part % CHUNKS * width, rows)
    return wp.vec2i(first + begin, first + wp.min(begin + width, rows))


@wp.kernel
def sum_residuals(
    begin: int,
    movers: Movers,
    particles: Particles,
    system: System,
    search: Search,  # out: partial
    more: wp.array[int],  # out: zero
):
    """Squares of the right side and of both residuals, in the norm of the preconditioner."""
    part = begin + wp.tid()
    if part == 0:
        more[0] = 0
    rows = rows_of(movers, part)
    total = wp.vec4(0.0)
    for row in range(rows[0], rows[1]):
        inverse = system.inverse[row]
        own = particles.velocity[movers.particle[row]]
        still = search.residual[row]
        moved = search.product[row]
        total += wp.vec4(
            wp.dot(own, inverse * own),
            wp.dot(still, inverse * still),
            wp.dot(moved, inverse * moved),
            1.0 + system.held[row],
        )
    search.partial[part // CHUNKS, part % CHUNKS] = total


@wp.func
def whole_sum(search: Search, run: int):
    """The parts in their order."""
    total = wp.vec4(0.0)
    for chunk in range(CHUNKS):
        total += search.partial[run, chunk]
    return total


@wp.kernel
def begin_search(
    of_the_right: float,
    of_the_change: float,
    at_most: int,
    search: Search,  # out: all scalars
    more: wp.array[int],  # out
    unsolved: wp.array[int],  # in, out
):
    """Choose where to begin, and the goal: shares of the right side, and of the residual of no viscosity at all."""
    run = wp.tid()
    squares = whole_sum(search, run)
    search.goal[run] = wp.min(of_the_right * of_the_right * squares[0], of_the_change * of_the_change * squares[1])
    # False for a guess that is no number.
    search.warm[run] = wp.where(squares[2] < squares[1], 1, 0)
    search.error[run] = wp.where(squares[2] < squares[1], squares[2], squares[1])
    search.holds[run] = squares[3]
    search.turn[run] = 0.0
    search.length[run] = 0.0
    search.iterations[run] = 0
    ask_for_more(search, run, at_most, more, unsolved)


@wp.func
def ask_for_more(search: Search, run: int, at_most: int, more: wp.array[int], unsolved: wp.array[int]):
    """Ask for another iteration while a residual is above its goal; after ``at_most`` the run counts as unsolved."""
    if search.error[run] > search.goal[run]:
        if search.iterations[run] < at_most:
            search.iterations[run] = search.iterations[run] + 1
            more[0] = 1
        else:
            unsolved[run] = 1


@wp.kernel
def start_search(begin: int, movers: Movers, particles: Particles, system: System, search: Search):
    """Begin at the guess, which lies where the scaled residual will, or at the velocity without viscosity."""
    part = begin + wp.tid()
    rows = rows_of(movers, part)
    warm = search.warm[part // CHUNKS]
    for row in range(rows[0], rows[1]):
        i = movers.particle[row]
        r = search.residual[row]
        if warm == 1:
            r = search.product[row]
            particles.velocity[i] = particles.scaled_residual[i]
        search.residual[row] = r
        search.direction[row] = wp.vec3(0.0)
        search.pull[row] = wp.vec3(0.0)
        particles.scaled_residual[i] = system.inverse[row] * r


@wp.kernel
def sum_curvature(
    begin: int,
    movers: Movers,
    particles: Particles,
    search: Search,  # out: partial
    more: wp.array[int],  # out: zero
):
    part = begin + wp.tid()
    if part == 0:
        more[0] = 0
    rows = rows_of(movers, part)
    total = float(0.0)
    for row in range(rows[0], rows[1]):
        total += wp.dot(particles.scaled_residual[movers.particle[row]], search.product[row])
    search.partial[part // CHUNKS, part % CHUNKS] = wp.vec4(total, 0.0, 0.0, 0.0)


@wp.kernel
def find_length(search: Search):
    """The step to the least energy along the next direction."""
    run = wp.tid()
    if search.error[run] <= search.goal[run]:
        return
    along = whole_sum(search, run)[0]
    curvature = along
    if search.turn[run] > 0.0:
        curvature -= search.turn[run] * search.error[run] / search.length[run]
        # Where rounding takes what is left of the difference, the search begins anew.
        if curvature < ROUNDS * along:
            search.turn[run] = 0.0
            curvature = along
    search.length[run] = search.error[run] / wp.max(curvature, 1.0e-30)


@wp.kernel
def advance_search(begin: int, movers: Movers, particles: Particles, system: System, search: Search):
    """Turn the direction, go along it, and sum up the new residual."""
    part = begin + wp.tid()
    run = part // CHUNKS
    if search.error[run] <= search.goal[run]:
        return
    rows = rows_of(movers, part)
    length = search.length[run]
    turn = search.turn[run]
    total = float(0.0)
    for row in range(rows[0], rows[1]):
        i = movers.particle[row]
        direction = particles.scaled_residual[i] + turn * search.direction[row]
        pull = search.product[row] + turn * search.pull[row]
        search.direction[row] = direction
        search.pull[row] = pull
        particles.velocity[i] = particles.velocity[i] + length * direction
        r = search.residual[row] - length * pull
        search.residual[row] = r
        scaled = system.inverse[row] * r
        particles.scaled_residual[i] = scaled
        total += wp.dot(r, scaled)
    search.partial[run, part % CHUNKS] = wp.vec4(total, 0.0, 0.0, 0.0)


@wp.kernel
def find_turn(
    at_most: int,
    search: Search,  # in, out
    more: wp.array[int],  # out
    unsolved: wp.array[int],  # in, out
):
    run = wp.tid()
    if search.error[run] <= search.goal[run]:
        return
    error = whole_sum(search, run)[0]
    search.turn[run] = error / wp.max(search.error[run], 1.0e-30)
    search.error[run] = error
    ask_for_more(search, run, at_most, more, unsolved)


@wp.kernel
def sum_left(
    begin: int,
    movers: Movers,
    search: Search,  # out: partial
):
    """The residual of a run as a whole."""
    part = begin + wp.tid()
    rows = rows_of(movers, part)
    total = wp.vec3(0.0)
    for row in range(rows[0], rows[1]):
        total += search.residual[row]
    search.partial[part // CHUNKS, part % CHUNKS] = wp.vec4(total[0], total[1], total[2], 0.0)


@wp.kernel
def shift_all(begin: int, movers: Movers, particles: Particles, search: Search):
    """Move a run as a whole until its residual is zero: pairs then keep momentum, wherever the search ended."""
    part = begin + wp.tid()
    run = part // CHUNKS
    rows = rows_of(movers, part)
    left = whole_sum(search, run)
    by = wp.vec3(left[0], left[1], left[2]) / wp.max(search.holds[run], 1.0)
    # What is no number stays with its particle, which is then found.
    if not wp.isfinite(by):
        return
    for row in range(rows[0], rows[1]):
        i = movers.particle[row]
        particles.velocity[i] = particles.velocity[i] + by


@wp.func
def printed_weight(particles: Particles, here: wp.vec4, i: int, j: int, support: float):
    """U m/rho_j W_v of Eq. 5, with the harmonic mean of both viscosities."""
    other = particles.position[j]
    offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
    own = particles.volume_and_viscosity[i][1]
    theirs = particles.volume_and_viscosity[j]
    mean = 2.0 * own * theirs[1] / wp.max(own + theirs[1], 1.0e-20)
    return theirs[0] * mean * gauss(wp.length_sq(offset), support)


@wp.func
def not_slower(paste: Paste, gamma: float):
    """Shear at which paste creeps, where it is slower than the slowest."""
    return wp.sqrt(gamma * gamma + paste.slowest_shear * paste.slowest_shear)


@wp.func
def thinning(paste: Paste, run: int, gamma: float):
    """Viscosity at a shear over that at 1/s, gamma^(n - 1)."""
    if paste.flow_index[run] == 1.0:
        return 1.0
    return wp.pow(not_slower(paste, gamma), paste.flow_index[run] - 1.0)


@wp.func
def shear_of(sums: GradientSums, walls: DragSums, moves: wp.vec3, volume: float, support: float):
    """Shear, sqrt(2 D:D), of the linear fit to the velocities around a particle, and to walls that do not move."""
    fit = wp.mat33(sums[0], sums[3], sums[5], sums[3], sums[1], sums[4], sums[5], sums[4], sums[2])
    found = wp.mat33(sums[6], sums[7], sums[8], sums[9], sums[10], sums[11], sums[12], sums[13], sums[14])
    normal = wp.normalize(wp.vec3(walls[3], walls[4], walls[5]))
    # A wall counts as the volume that it cuts off, in particles.
    moment = WALL_MOMENT * support / volume
    fit += moment * walls[2] * wp.outer(normal, normal)
    found += moment * walls[1] * wp.outer(moves, normal)
    # Too few neighbours have no gradient across them.
    least = LEAST_MOMENT * support * support * support * support * support / volume
    for axis in range(3):
        fit[axis, axis] += least
    gradient = found * wp.inverse(fit)
    rate = gradient + wp.transpose(gradient)
    return wp.sqrt(0.5 * wp.ddot(rate, rate))


def viscosity_kernels(loops: ModuleType, module: Any) -> ViscosityKernels:
    """The kernels of the viscosity that sum over pairs, with the inner loops of ``loops``.

    They are defined in a function because Warp binds the functions that a kernel calls when the kernel is defined.
    """
    sum_gradient, couple, sum_drag, sum_pulled = loops.sum_gradient, loops.couple, loops.sum_drag, loops.sum_pulled

    @wp.kernel(enable_backward=False, module=module)
    def measure_shear(
        begin: int,
        movers: Movers,
        particles: Particles,  # out: viscosity
        neighbours: Neighbours,
        support: float,
        paste: Paste,
        fresh_shear: float,
        frame_s: float,
        shear: wp.array[float],  # out
        system: System,  # out: at_walls
    ):
        """Shear, by the velocities that the last substep left, and the viscosity of Herschel and Bulkley at it.

        gamma^2 is the rate at which a viscosity of 1 dissipates, in pairs and at walls.
        """
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        near = neighbours
        run = i // particles.per_run
        gamma = fresh_shear
        at_wall = fresh_shear
        age = particles.frame[0] - particles.release_frame[i]
        if age > 0:
            own = particles.velocity[i]
            here = particles.position[i]
            walls = sum_drag(near.wall_particle, near.wall, row, near.wall_count[row], here, support)
            sums = sum_gradient(
                particles.position,
                particles.velocity,
                near.fluid,
                row,
                near.fluid_count[row],
                here,
                own,
                support,
            )
            gamma = shear_of(sums, walls, own, particles.volume_and_viscosity[i][0], support)
            at_wall = wp.length(own) * walls[1] / wp.max(walls[2], 1.0e-20)
        shear[i] = gamma
        aged = paste.by_age[run, wp.min(age, paste.by_age.shape[1] - 1)]
        tau = wp.min(aged[1] + paste.stiffens_by[run] * (float(age) * frame_s), paste.yields_at_most[run])
        thin = aged[0] * thinning(paste, run, gamma)
        yields = paste.per_viscosity * tau / not_slower(paste, gamma)
        particles.volume_and_viscosity[i] = wp.vec2(particles.volume_and_viscosity[i][0], thin + yields)
        thin = paste.sticks[run] * aged[0] * thinning(paste, run, at_wall)
        system.at_walls[i] = thin + paste.per_viscosity * tau / not_slower(paste, at_wall)

    @wp.kernel(enable_backward=False, module=module)
    def weigh_pairs(
        begin: int,
        movers: Movers,
        particles: Particles,
        neighbours: Neighbours,
        support: float,
        paste: Paste,
        system: System,  # out: coupling, drag, held and inverse
    ):
        """The weight of each pair, the walls' drag, and each particle's own block of the matrix."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        near = neighbours
        here = particles.position[i]
        sums = couple(
            particles.position,
            particles.volume_and_viscosity,
            near.fluid,
            row,
            near.fluid_count[row],
            here,
            particles.volume_and_viscosity[i],
            support,
            system.coupling,
        )
        walls = sum_drag(near.wall_particle, near.wall, row, near.wall_count[row], here, support)
        drag = paste.drag[i // particles.per_run] * walls[0] + system.at_walls[i] * walls[1]
        system.drag[row] = drag
        # A pair pulls along one of three directions.
        system.held[row] = drag + sums[6] / 3.0
        block = wp.mat33(sums[0], sums[3], sums[5], sums[3], sums[1], sums[4], sums[5], sums[4], sums[2])
        for axis in range(3):
            block[axis, axis] += 1.0 + drag
        system.inverse[row] = wp.inverse(block)

    @wp.kernel(enable_backward=False, module=module)
    def measure_residuals(
        begin: int,
        movers: Movers,
        particles: Particles,
        neighbours: Neighbours,
        system: System,
        search: Search,  # out: residual of the velocity without viscosity, and in ``product`` that of the guess
    ):
        """V - (I + A) v, and the same of the guess."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        near = neighbours
        count = near.fluid_count[row]
        here = particles.position[i]
        own = particles.velocity[i]
        guess = particles.scaled_residual[i]
        pulled = sum_pulled(particles.position, particles.velocity, system.coupling, near.fluid, row, count, here, own)
        search.residual[row] = -(pulled + system.drag[row] * own)
        pulled = sum_pulled(
            particles.position, particles.scaled_residual, system.coupling, near.fluid, row, count, here, guess
        )
        search.product[row] = own - guess - (pulled + system.drag[row] * guess)

    @wp.kernel(enable_backward=False, module=module)
    def apply_matrix(
        begin: int,
        movers: Movers,
        particles: Particles,
        neighbours: Neighbours,
        system: System,
        search: Search,  # out: product
    ):
        """(I + A) of backward Euler on Eq. 5, times the scaled residual."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        near = neighbours
        vector = particles.scaled_residual
        pulled = sum_pulled(
            particles.position,
            vector,
            system.coupling,
            near.fluid,
            row,
            near.fluid_count[row],
            particles.position[i],
            vector[i],
        )
        search.product[row] = (1.0 + system.drag[row]) * vector[i] + pulled

    @wp.kernel(enable_backward=False, module=module)
    def measure_rates(
        begin: int,
        movers: Movers,
        particles: Particles,
        neighbours: Neighbours,
        support: float,
        paste: Paste,
        system: System,  # out: drag, and in ``resistance`` what a pass of Eq. 5 takes at most of a velocity
    ):
        """The sums of U and D in Eq. 5 as printed, U sum_j m/rho_j W and D sum_k W."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        near = neighbours
        here = particles.position[i]
        total = float(0.0)
        for slot in range(near.fluid_count[row]):
            total += printed_weight(particles, here, i, near.fluid[row, slot], support)
        walls = sum_drag(near.wall_particle, near.wall, row, near.wall_count[row], here, support)
        drag = paste.drag[i // particles.per_run] * walls[0] + system.at_walls[i] * walls[1]
        system.drag[row] = drag
        system.resistance[row] = drag + total

    @wp.kernel(enable_backward=False, module=module)
    def pass_velocity(
        begin: int,
        movers: Movers,
        particles: Particles,
        neighbours: Neighbours,
        support: float,
        system: System,
        passes: float,
        before: wp.array[wp.vec3],
        after: wp.array[wp.vec3],  # out
    ):
        """One of the q passes of Eq. 5, as printed."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        near = neighbours
        here = particles.position[i]
        lost = system.drag[row] * before[i]
        for slot in range(near.fluid_count[row]):
            j = near.fluid[row, slot]
            lost += printed_weight(particles, here, i, j, support) * (before[i] - before[j])
        after[i] = before[i] - lost / passes

    return ViscosityKernels(measure_shear, weigh_pairs, measure_residuals, apply_matrix, measure_rates, pass_velocity)
