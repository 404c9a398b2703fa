"""Device code of the particles' status: what a particle is, who moves, release, and freezing by age."""

import warp as wp

from simulate.kernels.run_module import run_kernel

wp.set_module_options({"enable_backward": False})

MOVING = wp.constant(0)
ASLEEP = wp.constant(1)  # The particle rests and its neighbours feel it; a fast neighbour wakes it
FROZEN = wp.constant(2)  # The particle rests for good, because of its age
SPILLED = wp.constant(3)
ESCAPED = wp.constant(4)
WAITING = wp.constant(5)  # The particle is not released yet
GIVEN_UP = wp.constant(6)  # The particle belongs to a run that failed: it is gone, whether or not it was released

RESTS = wp.constant(1.0e30)
"""Value of the multiplier that marks a particle at rest. The pressure's loops load it together with the position."""


@wp.struct
class Particles:
    """All particles, run by run. Centimetres and seconds."""

    per_run: int
    position: wp.array[wp.vec4]
    """Position, and the multiplier of the density constraint: RESTS for a particle at rest (decision 0089)."""
    previous_position: wp.array[wp.vec3]  # Position before the substep
    velocity: wp.array[wp.vec3]
    earlier_velocity: wp.array[wp.vec3]  # Velocity that the last substep but one left
    scaled_residual: wp.array[wp.vec3]
    """Residual over the diagonal in the viscosity's solve; before it, the guess. Zero for a particle at rest."""
    moved: wp.array[wp.vec3]
    """Displacement in this substep so far, in the memory of ``scaled_residual``, which is free until its pressure ends.
    The difference of two positions in float32 would round the velocity to some thousandths of a mm/s.
    """
    free: wp.array[wp.vec4]
    """Centre and radius of a ball that keeps clear of all walls, from when they were last asked for."""
    wall: wp.array[wp.vec4]
    """Unit normal of the nearest wall's plane and its offset along it, from the same time; zero
    where walls are far, ROUNDED where they are no plane.
    """
    density: wp.array[float]  # Density over the rest density
    density_before: wp.array[float]  # The same before the substep's pressure
    pressed: wp.array[wp.vec4]
    """Gradient of the density with the particle's position, by walls, and the sum of the multipliers that a substep's
    iterations found: what the next one carries over.
    """
    volume_and_viscosity: wp.array[wp.vec2]
    """Volume m/rho in cm3, and the weight of the particle's pairs in the viscosity."""
    status: wp.array[int]
    release_frame: wp.array[int]
    frame: wp.array[int]  # Number of the frame that runs, or ran last; -1 before the first
    quiet_s: wp.array[float]
    """Time for which a particle has been below its yield stress; below zero, for which it was above it."""
    fault: wp.array[int]  # Its faults so far, one bit each
    swelling: wp.array[float]
    """Factor by which each run's particles count for more in the density sum than the scheme says."""


@wp.struct
class Movers:
    """List of the particles that move, run by run."""

    particle: wp.array[int]
    count: wp.array[int]
    first_row: wp.array[int]  # First row of each run, and one past the last row


@wp.struct
class Span:
    """Rows of a launch, or parts of them. Each thread takes every ``step``-th: on a GPU one, on a CPU all of them."""

    begin: int
    end: int
    step: int


@wp.func
def end_of(rows: Span, movers: Movers):
    """End of the rows of a launch in which there is a mover."""
    return wp.min(rows.end, movers.count[0])


@run_kernel
def count_frame(
    frame: wp.array[int],  # in, out
):
    """Advance the frame number on the device, so that a recorded frame has its own number when it is replayed."""
    frame[0] = frame[0] + 1


@run_kernel
def grow_older(particles: Particles, frames_to_freeze: wp.array[int]):
    """Release the particles of this frame, and fix those older than the paste's stiffening time.

    Those asleep are fixed too: a sleeper that woke later would be one mover more than the run has room for, and the
    paper's bound on its cost is that of the particles that are younger.
    """
    i = wp.tid()
    age = particles.frame[0] - particles.release_frame[i]
    if age < 0:
        return
    if particles.status[i] == WAITING:
        particles.status[i] = MOVING
    if particles.status[i] <= ASLEEP and age >= frames_to_freeze[i // particles.per_run]:
        particles.status[i] = FROZEN
        bring_to_rest(particles, i)


@wp.func
def bring_to_rest(particles: Particles, i: int):
    x = particles.position[i]
    particles.position[i] = wp.vec4(x[0], x[1], x[2], RESTS)
    particles.velocity[i] = wp.vec3(0.0)
    particles.earlier_velocity[i] = wp.vec3(0.0)
    particles.scaled_residual[i] = wp.vec3(0.0)
    particles.pressed[i] = wp.vec4(0.0)


@run_kernel
def mark_movers(
    status: wp.array[int],
    moves: wp.array[int],  # out
):
    i = wp.tid()
    moves[i] = wp.where(status[i] == MOVING, 1, 0)


@run_kernel
def number_movers(
    particles: Particles,
    row: wp.array[int],
    movers: Movers,  # out
):
    """List the movers; ``row`` is the number of movers before each particle."""
    i = wp.tid()
    count = particles.status.shape[0]
    if particles.status[i] == MOVING:
        movers.particle[row[i]] = i
    if i % particles.per_run == 0:
        movers.first_row[i // particles.per_run] = row[i]
    if i == count - 1:
        total = row[i] + wp.where(particles.status[i] == MOVING, 1, 0)
        movers.count[0] = total
        movers.first_row[count // particles.per_run] = total


@run_kernel
def mark_sorted(
    number: wp.array[int],
    status: wp.array[int],
    moves: wp.array[int],  # out
):
    k = wp.tid()
    moves[k] = wp.where(status[number[k]] == MOVING, 1, 0)


@run_kernel
def list_sorted(
    number: wp.array[int],
    status: wp.array[int],
    row: wp.array[int],
    movers: Movers,  # out
):
    """List the movers in the order of ``number``, which leaves each run its rows."""
    k = wp.tid()
    i = number[k]
    if status[i] == MOVING:
        movers.particle[row[k]] = i
