"""Device code of the fluid: Algorithm 1 of the paper, Eqs 1 to 4.

Units are cm and s. Densities are divided by the rest density, so a particle's mass is a volume in cm3. Row ``row`` of a
launch is an index in the list of moving particles, ``Particles.mover``.
"""

from types import ModuleType
from typing import Any

import warp as wp

from simulate.kernels.distance import (
    ROUNDED,
    Distance,
    distance_at,
    is_number,
    move,
    near_free,
    slide,
)
from simulate.kernels.lanes import lane, lanes
from simulate.kernels.neighbours import Neighbours
from simulate.kernels.run_module import kernel_in, run_kernel
from simulate.kernels.status import ESCAPED, MOVING, SPILLED, Particles, Span, bring_to_rest, end_of

wp.set_module_options({"enable_backward": False})

# Each kind of fault is one bit, after the bits in ``neighbours``. A particle's faults are the sum of these bits.
NOT_FINITE = wp.constant(4)
TOO_FAST = wp.constant(8)
TOO_DENSE = wp.constant(16)

CARRIED_OVER = wp.constant(-1)
"""Value of ``iteration`` for the move by the pressure that is carried over from the last substep."""
UNDONE = wp.constant(0.6)
UNDONE_RANGE = wp.constant(0.3)
"""Decrease of the density by pressure in a substep, divided by the rest density. From UNDONE on, a fraction of the
displacement by pressure is kept after viscosity has acted. From UNDONE + UNDONE_RANGE on, all of it is kept. In sealant
that flows or rests normally, the decrease is smaller than UNDONE."""


@wp.struct
class KernelConstants:
    """Constants of the density constraint."""

    support: float  # h. At this distance and beyond, both kernels are zero
    mass: float  # Mass of a particle, divided by the rest density, in cm3
    density: float  # Mass times 315 / (64 pi h^9), the factor of the fluid's sum of (h^2 - r^2)^3
    slope: float  # Mass times -45 / (pi h^6), the factor of the fluid's sum of (h - r)^2 times the unit offset
    wall_density: float
    wall_slope: float
    relaxation: float  # epsilon of Eq. 1, 1/cm2.


@wp.struct
class IterationState:
    """Parameters of the pressure iterations by run, and displacements of an iteration by row."""

    carried: wp.array[float]  # Fraction of the last substep's multipliers that is carried over
    iterations: wp.array[int]
    moves_after_viscosity: wp.array[float]  # 1 for runs whose particles move after viscosity has acted
    correction: wp.array[wp.vec3]  # Displacement by Eq. 3


@wp.func
def takes_part(iteration_state: IterationState, run: int, iteration: int) -> bool:
    """Return True if a run's particles move in an iteration (or, for ``CARRIED_OVER``, by carried-over pressure)."""
    if iteration == CARRIED_OVER:
        return iteration_state.carried[run] > 0.0
    return iteration < iteration_state.iterations[run]


@run_kernel
def predict(
    rows: Span,
    particles: Particles,
    step_s: float,
    damping: float,
    gravity: wp.vec3,
    iteration_state: IterationState,
    solid: Distance,
):
    """Compute v <- v + (g - eta v) dt and x* = x + v dt, as far as walls allow (Eq. 4; Algorithm 1, line 2).

    g is gravity, eta the damping and dt the substep. The multiplier starts at the carried-over fraction of its last
    value.
    """
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        i = particles.mover[row]
        x = particles.position[i][:3]
        particles.previous_position[i] = x
        v = particles.velocity[i] + step_s * (gravity - damping * particles.velocity[i])
        moved = move(solid, particles.free, particles.wall, i, x, step_s * v, True)
        particles.moved[i] = moved
        multiplier = iteration_state.carried[i // particles.per_run] * particles.pressed[i][3]
        particles.pressed[i][3] = multiplier
        particles.position[i] = wp.vec4(*(x + moved), multiplier)


@run_kernel
def shift(
    rows: Span,
    particles: Particles,
    iteration_state: IterationState,
    iteration: int,
    solid: Distance,
):
    """Move particles by the pressure's correction.

    In the last iteration of a run, particles move as far as walls allow, and in other iterations as far as the nearest
    plane allows. The last move starts from the position before the substep, so that no wall can be crossed. In runs
    that move after viscosity, the last move follows later.
    """
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        i = particles.mover[row]
        run = i // particles.per_run
        if not takes_part(iteration_state, run, iteration):
            continue
        x = particles.position[i]
        if iteration == 0:
            particles.density_before[i] = particles.density[i]
        start = x[:3]
        moved = particles.moved[i]
        step = iteration_state.correction[row]
        wall = particles.wall[i]
        last = iteration == iteration_state.iterations[run] - 1 and iteration_state.moves_after_viscosity[run] == 0.0
        if last:
            start = particles.previous_position[i]
            step += moved
            moved = wp.vec3(0.0)
        if last or wall[0] == ROUNDED:
            step = move(solid, particles.free, particles.wall, i, start, step, False)
        else:
            step = slide(wall, start, step, solid.clearance)
        particles.moved[i] = moved + step
        particles.position[i] = wp.vec4(*(start + step), x[3])


@run_kernel
def update_velocity(rows: Span, particles: Particles, step_s: float):
    """Compute v = (x - x0) / dt, and a guess of v after viscosity, extrapolated from the last two substeps.

    x0 is the position before the substep, and dt is the substep.
    """
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        i = particles.mover[row]
        # The displacement is read before the guess overwrites it, because both use the same memory.
        moved = particles.moved[i]
        last = particles.velocity[i]
        particles.scaled_residual[i] = 2.0 * last - particles.earlier_velocity[i]
        particles.earlier_velocity[i] = last
        particles.velocity[i] = moved / step_s


@run_kernel
def move_after_viscosity(
    rows: Span,
    particles: Particles,
    iteration_state: IterationState,
    step_s: float,
    solid: Distance,
):
    """Move to x = x0 + v dt with the velocity v after viscosity. x0 is the position before the substep.

    Eq. 5 changes velocities after positions have moved by v + g dt. Without this move, sealant at rest on a slope would
    slide in each substep, and liquid of any viscosity would fall at g dt. In a thick fluid, viscosity also cancels the
    displacement by pressure if it moves only a few particles. If that displacement reduced the density much, it is
    kept.
    """
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        i = particles.mover[row]
        if iteration_state.moves_after_viscosity[i // particles.per_run] == 0.0:
            continue
        start, step = particles.previous_position[i], step_s * particles.velocity[i]
        stays = wp.clamp((particles.density_before[i] - particles.density[i] - UNDONE) / UNDONE_RANGE, 0.0, 1.0)
        x = particles.position[i]
        step += stays * (x[:3] - start - step)
        moved = start + move(solid, particles.free, particles.wall, i, start, step, False)
        particles.position[i] = wp.vec4(*moved, x[3])


@run_kernel
def inspect(
    rows: Span,
    particles: Particles,
    fastest: float,
    densest: float,
    support: float,
    solid: Distance,
):
    """Mark particles that have a fault, that spilled over the edge or that escaped through a wall.

    For a particle near its free ball, walls are not searched.
    """
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        i = particles.mover[row]
        if particles.status[i] != MOVING:
            continue
        x = particles.position[i][:3]
        speed = wp.length(particles.velocity[i])
        density = particles.density[i]
        if not (is_number(wp.length_sq(x)) and is_number(speed) and is_number(density)):
            particles.fault[i] |= NOT_FINITE
        elif speed > fastest:
            particles.fault[i] |= TOO_FAST
        elif density > densest:
            particles.fault[i] |= TOO_DENSE
        else:
            face = solid.face
            over = wp.max(wp.max(face[0] - x[0], x[0] - face[2]), wp.max(face[1] - x[1], x[1] - face[3]))
            if over > support or (over > 0.0 and x[2] < 0.0):
                particles.status[i] = SPILLED
            elif not near_free(particles.free[i], x, solid.clearance) and distance_at(solid, x, 0.0)[3] < 0.0:
                particles.status[i] = ESCAPED
            if particles.status[i] != MOVING:
                bring_to_rest(particles, i)


def pressure_kernels(loops: ModuleType, module: Any) -> tuple[Any, Any]:
    """Return the kernels ``measure_density`` and ``correct``, with the inner loops of the module ``loops``.

    The kernels are defined in a function, because Warp binds the functions that a kernel calls when the kernel is
    defined.
    """
    sum_density, sum_walls, sum_correction = loops.sum_density, loops.sum_walls, loops.sum_correction

    @kernel_in(module)
    def measure_density(
        rows: Span,
        particles: Particles,
        neighbours: Neighbours,
        kernel: KernelConstants,
        iteration_state: IterationState,
        iteration: int,
    ):
        """Compute rho_i = sum_j m W_poly6 + sum_k psi_k W_poly6, and its gradients with the spiky kernel (Eqs 1 and 2).

        j are the neighbours and the particle itself, and k the wall particles. (1 - rho_i) / (sum |grad C|^2 + eps) is
        added to the multiplier lambda_i, which is limited to at most 0. If pressure is not carried over, lambda_i
        starts at 0 in each iteration, as in the paper.
        """
        for row in range(rows.begin + wp.tid() // lanes(), end_of(rows, particles), rows.step):
            i = particles.mover[row]
            run = i // particles.per_run
            if not takes_part(iteration_state, run, iteration):
                continue
            h = kernel.support
            swelling = particles.swelling[run]
            sums = sum_density(particles, neighbours, row, h)
            walls = sum_walls(particles, neighbours, row, h)
            if lane() > 0:
                continue
            density = swelling * kernel.density * (h * h * h * h * h * h + sums[0]) + kernel.wall_density * walls[0]
            particles.density[i] = density
            particles.volume_and_viscosity[i][0] = swelling * kernel.mass / density
            slope = swelling * kernel.slope
            wall_gradient = kernel.wall_slope * walls[1:4]
            squares = wp.length_sq(slope * sums[1:4] + wall_gradient) + slope * slope * sums[4]
            before = particles.pressed[i][3]
            after = wp.min(before - (density - 1.0) / (squares + kernel.relaxation), 0.0)
            particles.position[i][3] = after - before
            particles.pressed[i] = wp.vec4(*wall_gradient, wp.where(iteration_state.carried[run] > 0.0, after, 0.0))

    @kernel_in(module)
    def correct(
        rows: Span,
        particles: Particles,
        neighbours: Neighbours,
        kernel: KernelConstants,
        longest: float,
        frozen_answer: float,
        iteration_state: IterationState,  # out: correction
        iteration: int,
    ):
        """Compute dx_i = sum_j (lambda_i + lambda_j) m grad W + lambda_i sum_k psi_k grad W (Eq. 3).

        lambda is the multiplier's change in this iteration, the fourth number of ``position``. A neighbour at rest does
        not move. Its lambda_j is assumed to be lambda_i or, as in the paper, 0. With 0, such a neighbour is half as
        hard as it should be.
        """
        for row in range(rows.begin + wp.tid() // lanes(), end_of(rows, particles), rows.step):
            i = particles.mover[row]
            run = i // particles.per_run
            if not takes_part(iteration_state, run, iteration):
                continue
            lambda_i = particles.position[i][3]
            slope = particles.swelling[run] * kernel.slope
            step = lambda_i * particles.pressed[i][:3]
            step += slope * sum_correction(particles, neighbours, row, kernel.support, frozen_answer * lambda_i)
            squared = wp.length_sq(step)
            if squared > longest * longest:
                step *= longest / wp.sqrt(squared)
            if lane() == 0:
                iteration_state.correction[row] = step

    return measure_density, correct
