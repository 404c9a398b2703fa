"""Device code of the viscosity: Eq. 5 of the paper, its implicit form, and a yield stress in it. Centimetres, seconds.

A particle's ``viscosity`` is the weight of its pairs in a substep: U of Eq. 5 over h sqrt(pi), or the weight that
stands for a viscosity and a yield stress. Rows of the implicit system are multiplied by the particle's volume m/rho,
which makes the matrix symmetric.
"""

from types import ModuleType
from typing import Any, NamedTuple

import warp as wp

from simulate.kernels.neighbours import Neighbours
from simulate.kernels.status import Movers, Particles

wp.set_module_options({"enable_backward": False})

CHUNKS = wp.constant(64)
"""Parts of a run whose sums are made one by one, the same on all devices and with any number of threads."""


@wp.struct
class Paste:
    """Constants of each run's fluid, by the number of the run, and factors that all runs share."""

    by_age: wp.array2d[wp.vec3]
    """Weight of pairs where the fluid flows fast, D of Eq. 5 in a substep over h sqrt(pi), and yield stress over
    density in cm2/s2, by run and age in frames; the last age stands for all later ones.
    """
    stiffens_by: wp.array[float]  # Yield stress over density that a second of age adds
    yields_at_most: wp.array[float]
    per_viscosity: float  # Weight of pairs for each cm2/s of viscosity
    per_shear: float  # Squared shear, 1/s2, for each unit of the sum over pairs
    wall_per_viscosity: float  # Drag for each cm2/s2 of yield stress at a speed of 1 cm/s
    slowest_shear: float  # 1/s: below it the paste creeps as a fluid of constant viscosity
    slowest: float  # cm/s: the same along a wall


@wp.struct
class System:
    """The linear system (I + A) v_new = v of backward Euler on Eq. 5, by row."""

    coupling: wp.array2d[float]  # Weight of each pair, in the slots of the fluid's neighbour lists
    resistance: wp.array[float]  # Sum of a particle's couplings and of the walls' drag
    yields: wp.array[float]  # Yield stress over density, cm2/s2
    slides: wp.array[float]  # Speed along the walls, cm/s


@wp.struct
class Search:
    """Conjugate gradients, as Chronopoulos and Gear arrange them: vectors by row, scalars by run.

    The residual over the diagonal (Jacobi's preconditioner) is by particle, for it is what the matrix is applied to.
    """

    residual: wp.array[wp.vec3]
    product: wp.array[wp.vec3]  # The matrix times the scaled residual
    direction: wp.array[wp.vec3]
    pull: wp.array[wp.vec3]  # The matrix times the direction
    partial: wp.array2d[wp.vec3]  # Sums of each part of a run
    error: wp.array[float]
    length: wp.array[float]  # How far to go along the direction
    turn: wp.array[float]  # Share of the last direction in the next one
    goal: wp.array[float]
    warm: wp.array[int]  # 1 where the search begins at the guess
    iterations: wp.array[int]


@wp.func
def at_age(paste: Paste, run: int, age: int):
    return paste.by_age[run, wp.min(age, paste.by_age.shape[1] - 1)]


class ViscosityKernels(NamedTuple):
    measure_shear: Any
    weigh_pairs: Any
    measure_residuals: Any
    apply_matrix: Any
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


@wp.func
def diagonal_of(particles: Particles, system: System, row: int, i: int):
    return particles.volume_and_viscosity[i][0] + system.resistance[row]


@wp.kernel
def sum_residuals(
    begin: int,
    movers: Movers,
    particles: Particles,
    system: System,
    search: Search,  # out: partial
    more: wp.array[int],  # out: zero
):
    """Squares of the right side and of both residuals, over the diagonal."""
    part = begin + wp.tid()
    if part == 0:
        more[0] = 0
    rows = rows_of(movers, part)
    total = wp.vec3(0.0)
    for row in range(rows[0], rows[1]):
        i = movers.particle[row]
        volume = particles.volume_and_viscosity[i][0]
        own = wp.length_sq(volume * particles.velocity[i])
        squares = wp.vec3(own, wp.length_sq(search.residual[row]), wp.length_sq(search.product[row]))
        total += squares / diagonal_of(particles, system, row, i)
    search.partial[part // CHUNKS, part % CHUNKS] = total


@wp.func
def whole_sum(search: Search, run: int):
    """The parts in their order."""
    total = wp.vec3(0.0)
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
        particles.scaled_residual[i] = r / diagonal_of(particles, system, row, i)


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
    search.partial[part // CHUNKS, part % CHUNKS] = wp.vec3(total, 0.0, 0.0)


@wp.kernel
def find_length(search: Search):
    """The step to the least energy along the next direction."""
    run = wp.tid()
    if search.error[run] <= search.goal[run]:
        return
    curvature = whole_sum(search, run)[0]
    if search.turn[run] > 0.0:
        curvature -= search.turn[run] * search.error[run] / search.length[run]
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
        scaled = r / diagonal_of(particles, system, row, i)
        particles.scaled_residual[i] = scaled
        total += wp.dot(r, scaled)
    search.partial[run, part % CHUNKS] = wp.vec3(total, 0.0, 0.0)


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


def viscosity_kernels(loops: ModuleType, module: Any) -> ViscosityKernels:
    """The kernels of the viscosity that sum over pairs, with the inner loops of ``loops``.

    They are defined in a function because Warp binds the functions that a kernel calls when the kernel is defined.
    """
    sum_shear, couple, sum_drag, sum_pulled = loops.sum_shear, loops.couple, loops.sum_drag, loops.sum_pulled

    @wp.kernel(enable_backward=False, module=module)
    def measure_shear(
        begin: int,
        movers: Movers,
        particles: Particles,  # out: viscosity
        neighbours: Neighbours,
        support: float,
        paste: Paste,
        fresh_shear: float,
        fresh_speed: float,
        frame_s: float,
        shear: wp.array[float],  # out
        system: System,  # out: yields and slides
    ):
        """Shear, by the velocities that the last substep left, and Bingham's viscosity at it.

        gamma^2 = sum_j w_ij |v_i - v_j|^2 / (2 c h^2) is the rate at which the viscosity dissipates;
        nu + tau / (rho (gamma + eps)).
        """
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        run = i // particles.per_run
        gamma = fresh_shear
        slide = fresh_speed
        age = particles.frame[0] - particles.release_frame[i]
        if age > 0:
            own = particles.velocity[i]
            slide = wp.length(own)
            sheared = sum_shear(
                particles.position,
                particles.velocity,
                particles.volume_and_viscosity,
                neighbours.fluid,
                row,
                neighbours.fluid_count[row],
                particles.position[i],
                own,
                support,
            )
            gamma = wp.sqrt(paste.per_shear * sheared)
        aged = at_age(paste, run, age)
        tau = wp.min(aged[2] + paste.stiffens_by[run] * (float(age) * frame_s), paste.yields_at_most[run])
        shear[i] = gamma
        system.yields[row] = tau
        system.slides[row] = slide
        viscosity = aged[0] + paste.per_viscosity * tau / (gamma + paste.slowest_shear)
        particles.volume_and_viscosity[i] = wp.vec2(particles.volume_and_viscosity[i][0], viscosity)

    @wp.kernel(enable_backward=False, module=module)
    def weigh_pairs(
        begin: int,
        movers: Movers,
        particles: Particles,
        neighbours: Neighbours,
        support: float,
        paste: Paste,
        system: System,  # out: coupling and resistance
    ):
        """The weight of each pair, and its sum with the walls' drag for each particle; all times m/rho_i."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        run = i // particles.per_run
        near = neighbours
        here = particles.position[i]
        own = particles.volume_and_viscosity[i]
        total = couple(
            particles.position,
            particles.volume_and_viscosity,
            near.fluid,
            row,
            near.fluid_count[row],
            here,
            own,
            support,
            system.coupling,
        )
        aged = at_age(paste, run, particles.frame[0] - particles.release_frame[i])
        drag = aged[1] + paste.wall_per_viscosity * system.yields[row] / (system.slides[row] + paste.slowest)
        walls = sum_drag(near.wall_particle, near.wall, row, near.wall_count[row], here, support)
        system.resistance[row] = total + own[0] * drag * walls

    @wp.kernel(enable_backward=False, module=module)
    def measure_residuals(
        begin: int,
        movers: Movers,
        particles: Particles,
        neighbours: Neighbours,
        system: System,
        search: Search,  # out: residual of the velocity without viscosity, and in ``product`` that of the guess
    ):
        """m/rho v - (I + A) v, and the same of the guess."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        near = neighbours
        count = near.fluid_count[row]
        pulled = sum_pulled(particles.velocity, system.coupling, near.fluid, row, count)
        search.residual[row] = pulled - system.resistance[row] * particles.velocity[i]
        pulled = sum_pulled(particles.scaled_residual, system.coupling, near.fluid, row, count)
        volume = particles.volume_and_viscosity[i][0]
        guess = particles.scaled_residual[i]
        search.product[row] = pulled - system.resistance[row] * guess + volume * (particles.velocity[i] - guess)

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
        vector = particles.scaled_residual
        pulled = sum_pulled(vector, system.coupling, neighbours.fluid, row, neighbours.fluid_count[row])
        search.product[row] = diagonal_of(particles, system, row, i) * vector[i] - pulled

    @wp.kernel(enable_backward=False, module=module)
    def pass_velocity(
        begin: int,
        movers: Movers,
        particles: Particles,
        neighbours: Neighbours,
        system: System,
        passes: float,
        before: wp.array[wp.vec3],
        after: wp.array[wp.vec3],  # out
    ):
        """One of the q passes of Eq. 5."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        pulled = sum_pulled(before, system.coupling, neighbours.fluid, row, neighbours.fluid_count[row])
        volume = particles.volume_and_viscosity[i][0]
        after[i] = before[i] - (system.resistance[row] * before[i] - pulled) / (passes * volume)

    return ViscosityKernels(measure_shear, weigh_pairs, measure_residuals, apply_matrix, pass_velocity)
