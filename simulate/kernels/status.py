"""Device code of the particles, their status and the list of those that move, and of the rows of a launch."""

import warp as wp

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
    mover: wp.array[int]  # List of the particles that move, run by run
    movers: wp.array[int]  # Their number
    first_row: wp.array[int]  # First row of each run in that list, and one past the last row


@wp.struct
class Span:
    """Rows of a launch, or parts of them. Each thread takes every ``step``-th: on a GPU one, on a CPU all of them."""

    begin: int
    end: int
    step: int


@wp.func
def end_of(rows: Span, particles: Particles):
    """End of the rows of a launch in which there is a mover."""
    return wp.min(rows.end, particles.movers[0])


@wp.func
def bring_to_rest(particles: Particles, i: int):
    x = particles.position[i]
    particles.position[i] = wp.vec4(x[0], x[1], x[2], RESTS)
    particles.velocity[i] = wp.vec3(0.0)
    particles.earlier_velocity[i] = wp.vec3(0.0)
    particles.scaled_residual[i] = wp.vec3(0.0)
    particles.pressed[i] = wp.vec4(0.0)
