"""Device code of the particles, of their status, and of the rows of a launch."""

import warp as wp

wp.set_module_options({"enable_backward": False})

MOVING = wp.constant(0)
ASLEEP = wp.constant(1)  # At rest, as a neighbour of others; a fast neighbour wakes it
FROZEN = wp.constant(2)  # At rest for good, by its age
SPILLED = wp.constant(3)
ESCAPED = wp.constant(4)
WAITING = wp.constant(5)  # Not released yet
GIVEN_UP = wp.constant(6)  # Of a run that failed, whether it was released or not

RESTS = wp.constant(1.0e30)
"""Value of the multiplier that marks a particle at rest. The pressure's loops read it together with the position."""


@wp.struct
class Particles:
    """All particles, one run after the other. Centimetres and seconds."""

    per_run: int
    position: wp.array[wp.vec4]
    """Position, and the multiplier of the density constraint, which is RESTS for a particle at rest."""
    previous_position: wp.array[wp.vec3]  # Position before the substep
    velocity: wp.array[wp.vec3]
    earlier_velocity: wp.array[wp.vec3]  # Velocity after the last substep but one
    scaled_residual: wp.array[wp.vec3]
    """Residual divided by the diagonal during the viscosity solve; before the solve, the initial guess. It is 0 for a
    particle at rest."""
    moved: wp.array[wp.vec3]
    """Displacement so far in this substep. It shares its memory with ``scaled_residual``, which is unused until
    pressure ends. The difference of two float32 positions would have errors of some thousandths of a mm/s in the
    velocity."""
    free: wp.array[wp.vec4]
    """Centre and radius of a ball that has the clearance from all walls, from the last search for walls."""
    wall: wp.array[wp.vec4]
    """Unit normal and offset of the nearest wall's plane, from the last search for walls. It is 0 if walls are far, and
    ROUNDED if they are not a plane."""
    density: wp.array[float]  # Density over the rest density
    density_before: wp.array[float]  # The same before the substep's pressure
    pressed: wp.array[wp.vec4]
    """Gradient of the walls' density with respect to the particle's position, and the sum of the multipliers of a
    substep's iterations. The sum may be carried over to the next substep."""
    volume_and_viscosity: wp.array[wp.vec2]
    """Volume m/rho in cm3, and weight of the particle's pairs in the viscosity."""
    status: wp.array[int]
    release_frame: wp.array[int]
    frame: wp.array[int]  # Number of the frame that runs, or ran last; -1 before the first
    quiet_s: wp.array[float]
    """Time for which a particle has been quiet. If negative, its size is the time for which the particle has flowed."""
    fault: wp.array[int]  # Faults so far, one bit each
    swelling: wp.array[float]
    """Factor on the scheme's weight of a particle in the density sum, by run."""
    mover: wp.array[int]  # List of the particles that move, run by run
    mover_count: wp.array[int]
    first_row: wp.array[int]  # First row of each run in that list, and one past the last row


@wp.struct
class Span:
    """Rows, parts or runs of a launch. A thread or block takes every ``step``-th: one on a GPU, all on a CPU."""

    begin: int
    end: int
    step: int


@wp.func
def end_of(rows: Span, particles: Particles):
    """Return the end of the rows of a launch that have a mover."""
    return wp.min(rows.end, particles.mover_count[0])


@wp.func
def bring_to_rest(particles: Particles, i: int):
    particles.position[i][3] = RESTS
    particles.velocity[i] = wp.vec3(0.0)
    particles.earlier_velocity[i] = wp.vec3(0.0)
    particles.scaled_residual[i] = wp.vec3(0.0)
    particles.pressed[i] = wp.vec4(0.0)
