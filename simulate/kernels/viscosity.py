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
"""Parts of a run in which a scalar product is summed, the same on all devices and with any number of threads."""


@wp.struct
class Paste:
    """Constants of each run's fluid, by the number of the run, and factors that all runs share."""

    thin: wp.array[float]  # Weight of pairs where the fluid flows fast
    drag: wp.array[float]  # D of Eq. 5 in a substep over h sqrt(pi).
    yields_at: wp.array[float]  # Yield stress of fresh paste over density, cm2/s2
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
    """Conjugate gradients: vectors by row, scalars by run."""

    residual: wp.array[wp.vec3]
    scaled: wp.array[wp.vec3]  # Residual over the diagonal (Jacobi's preconditioner)
    product: wp.array[wp.vec3]  # The matrix times the vector at hand
    right: wp.array[wp.vec3]  # Right side over the root of the diagonal
    right_squared: wp.array[float]
    error: wp.array[float]
    previous_error: wp.array[float]
    curvature: wp.array[float]
    goal: wp.array[float]
    iterations: wp.array[int]


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
    particles: Particles,
    system: System,
    search: Search,  # out
):
    """Start from the velocity without viscosity."""
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.particle[row]
    volume = particles.volume_and_viscosity[i][0]
    diagonal = volume + system.resistance[row]
    right = volume * particles.velocity[i]
    r = right - search.product[row]
    search.residual[row] = r
    search.scaled[row] = r / diagonal
    particles.search_direction[i] = r / diagonal
    search.right[row] = right / wp.sqrt(diagonal)


@wp.kernel
def advance_search(
    begin: int,
    movers: Movers,
    particles: Particles,
    system: System,
    search: Search,  # in, out
):
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.particle[row]
    run = i // particles.per_run
    if search.error[run] <= search.goal[run]:
        return
    # In a fluid at rest it would be 0 / 0.
    length = search.error[run] / wp.max(search.curvature[run], 1.0e-30)
    particles.velocity[i] = particles.velocity[i] + length * particles.search_direction[i]
    r = search.residual[row] - length * search.product[row]
    search.residual[row] = r
    search.scaled[row] = r / (particles.volume_and_viscosity[i][0] + system.resistance[row])


@wp.kernel
def turn_search(begin: int, movers: Movers, particles: Particles, search: Search):
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.particle[row]
    run = i // particles.per_run
    turn = search.error[run] / wp.max(search.previous_error[run], 1.0e-30)
    particles.search_direction[i] = search.scaled[row] + turn * particles.search_direction[i]


@wp.kernel
def sum_chunks(
    movers: Movers,
    a_by_particle: int,
    a: wp.array[wp.vec3],
    b: wp.array[wp.vec3],
    partial: wp.array2d[float],  # out
):
    """Scalar product in parts of two vectors by row; the first may be by particle."""
    run, chunk = wp.tid()
    total = float(0.0)
    for row in range(movers.first_row[run] + chunk, movers.first_row[run + 1], CHUNKS):
        total += wp.dot(a[wp.where(a_by_particle == 1, movers.particle[row], row)], b[row])
    partial[run, chunk] = total


@wp.kernel
def finish_sum(
    partial: wp.array2d[float],
    total: wp.array[float],  # in, out
    before: wp.array[float],  # out
):
    """Add up the parts in their order, and keep the previous sum; ``before`` may be ``total`` itself."""
    run = wp.tid()
    sum = float(0.0)
    for chunk in range(CHUNKS):
        sum += partial[run, chunk]
    before[run] = total[run]
    total[run] = sum


@wp.kernel
def set_goal(
    of_the_right: float,
    of_the_change: float,
    search: Search,  # out: goal and iterations
):
    run = wp.tid()
    search.goal[run] = wp.min(
        of_the_right * of_the_right * search.right_squared[run], of_the_change * of_the_change * search.error[run]
    )
    search.iterations[run] = 0


@wp.kernel
def ask_for_more(
    at_most: int,
    search: Search,
    more: wp.array[int],  # out
    unsolved: wp.array[int],  # in, out
):
    """Ask for another iteration while a residual is above its goal; after ``at_most`` the run counts as unsolved."""
    run = wp.tid()
    if search.error[run] > search.goal[run]:
        if search.iterations[run] < at_most:
            search.iterations[run] = search.iterations[run] + 1
            more[0] = 1
        else:
            unsolved[run] = 1


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
        tau = yield_stress(paste, run, float(age) * frame_s)
        shear[i] = gamma
        system.yields[row] = tau
        system.slides[row] = slide
        viscosity = paste.thin[run] + paste.per_viscosity * tau / (gamma + paste.slowest_shear)
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
        drag = paste.drag[run] + paste.wall_per_viscosity * system.yields[row] / (system.slides[row] + paste.slowest)
        walls = sum_drag(near.wall_particle, near.wall, row, near.wall_count[row], here, support)
        system.resistance[row] = total + own[0] * drag * walls

    @wp.kernel(enable_backward=False, module=module)
    def apply_matrix(
        begin: int,
        movers: Movers,
        particles: Particles,
        neighbours: Neighbours,
        system: System,
        vector: wp.array[wp.vec3],
        product: wp.array[wp.vec3],  # out
    ):
        """(I + A) of backward Euler on Eq. 5, times a vector of velocities."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        pulled = sum_pulled(vector, system.coupling, neighbours.fluid, row, neighbours.fluid_count[row])
        product[row] = (particles.volume_and_viscosity[i][0] + system.resistance[row]) * vector[i] - pulled

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

    return ViscosityKernels(measure_shear, weigh_pairs, apply_matrix, pass_velocity)
