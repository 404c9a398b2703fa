"""Device code of the particles, their status and the rows of a launch."""

import warp as wp

wp.set_module_options({"enable_backward": False})

MOVING = wp.constant(0)
ASLEEP = wp.constant(1)  # At rest, until a fast neighbour wakes it
FROZEN = wp.constant(2)  # Permanently at rest, because of its age
SPILLED = wp.constant(3)
ESCAPED = wp.constant(4)
WAITING = wp.constant(5)  # Not released yet
GIVEN_UP = wp.constant(6)  # In a run that failed, released or not

RESTS = wp.constant(1.0e30)
"""Value of the multiplier that marks a particle at rest. The pressure's loops read it together with the position."""


@wp.struct
class Particles:
    """All particles, run by run. Units are cm and s."""

    per_run: int
    position: wp.array[wp.vec4]
    """Position and, as fourth number, the multiplier of the density constraint. The multiplier is RESTS for a particle
    at rest."""
    previous_position: wp.array[wp.vec3]  # Position before the substep
    velocity: wp.array[wp.vec3]
    earlier_velocity: wp.array[wp.vec3]  # Velocity one substep earlier
    scaled_residual: wp.array[wp.vec3]
    """Residual of the viscosity solve, multiplied by the inverse of the diagonal block. Before the solve, the initial
    guess. 0 for a particle at rest."""
    moved: wp.array[wp.vec3]
    """Displacement so far in this substep. It uses the memory of ``scaled_residual``, which is not needed before the
    viscosity solve. It is stored because the difference of two float32 positions would cause errors of some thousandths
    of a mm/s in the velocity."""
    free: wp.array[wp.vec4]
    """Centre and radius of a ball, from the last search for walls. All positions in it have the clearance from all
    walls."""
    wall: wp.array[wp.vec4]
    """Unit normal and offset of the plane of the nearest wall, from the last search for walls. The normal is 0 if walls
    are far away, and its components are ROUNDED if the walls are not a plane."""
    density: wp.array[float]  # Density, divided by the rest density
    density_before: wp.array[float]  # The same density before the substep's pressure iterations
    pressed: wp.array[wp.vec4]
    """Gradient of the walls' part of the density with respect to the particle's position and, as fourth number, the sum
    of the multipliers of the substep's iterations. This sum may be carried over to the next substep."""
    volume_and_viscosity: wp.array[wp.vec2]
    """Volume m/rho in cm3, and the viscosity as the weight of the particle's pairs."""
    status: wp.array[int]
    release_frame: wp.array[int]
    frame: wp.array[int]  # Number of the current or last frame. -1 before the first frame
    quiet_s: wp.array[float]
    """Time in s for which a particle has been quiet. A negative value means the time for which the particle has
    flowed."""
    fault: wp.array[int]  # Faults so far, one bit for each kind
    swelling: wp.array[float]
    """Factor for each run by which the weight of a particle in the density sum is multiplied."""
    mover: wp.array[int]  # List of the particles that move, run by run
    mover_count: wp.array[int]
    first_row: wp.array[int]  # First row of each run in the list of movers, and the row after the last row


@wp.struct
class Span:
    """Range of rows, parts or runs of a launch.

    A thread or block processes every ``step``-th row. On a GPU this is one row, and on a CPU all rows.
    """

    begin: int
    end: int
    step: int


@wp.func
def end_of(rows: Span, particles: Particles):
    """Return the end of the rows of a launch that have a moving particle."""
    return wp.min(rows.end, particles.mover_count[0])


@wp.func
def bring_to_rest(particles: Particles, i: int):
    particles.position[i][3] = RESTS
    particles.velocity[i] = wp.vec3(0.0)
    particles.earlier_velocity[i] = wp.vec3(0.0)
    particles.scaled_residual[i] = wp.vec3(0.0)
    particles.pressed[i] = wp.vec4(0.0)
