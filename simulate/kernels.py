"""Device code of the fluid: Algorithm 1 of the paper, Eqs 1 to 4.

Centimetres and seconds; densities in units of the rest density, so that a particle's mass is a volume in cm3.
Particles are numbered by release. Row ``row`` of a launch stands for the mover of that number; ``begin`` is the first
row of a slice, where a launch is cut for several threads.
"""

from types import ModuleType
from typing import Any, NamedTuple

import warp as wp

from simulate.kernels_distance import Distance, distance_at, move
from simulate.kernels_rest import ESCAPED, MOVING, SPILLED, Movers

wp.set_module_options({"enable_backward": False})

GRAVITY = wp.constant(wp.vec3(0.0, 0.0, -981.0))

# A bit each: what is wrong with a particle is their sum.
NEIGHBOURS_FULL = wp.constant(1)
WALLS_FULL = wp.constant(2)
NOT_FINITE = wp.constant(4)
TOO_FAST = wp.constant(8)
TOO_DENSE = wp.constant(16)

MOST_BY_WALLS = wp.constant(0.6)
"""Of a density: a corner of two walls makes 0.43 (1 - 0.75^2), one of three 0.58."""


@wp.struct
class Smoothing:
    """The density constraint's constants, worked out once."""

    support: float
    """h: both kernels vanish from here on."""
    mass: float
    """Of a particle over the rest density, cm3."""
    density: float
    """Mass times 315 / (64 pi h^9): of the fluid's sum of (h^2 - r^2)^3."""
    slope: float
    """Mass times -45 / (pi h^6): of its sum of (h - r)^2 times the unit offset."""
    wall_density: float
    wall_slope: float
    relaxation: float
    """epsilon of Eq. 1, 1/cm2."""


@wp.kernel
def predict(
    begin: int,
    movers: Movers,
    step_s: float,
    damping: float,
    clearance: float,
    solid: Distance,
    velocity: wp.array[wp.vec3],
    place: wp.array[wp.vec4],  # in, out
    start: wp.array[wp.vec3],  # out
):
    """V + (g - eta v) dt, x* = x + v dt, as far as walls allow (Eq. 4; Algorithm 1, line 2)."""
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    x = wp.vec3(place[i][0], place[i][1], place[i][2])
    start[i] = x
    v = velocity[i] + step_s * (GRAVITY - damping * velocity[i])
    there = move(solid, x, step_s * v, clearance)
    place[i] = wp.vec4(there[0], there[1], there[2], 0.0)


@wp.kernel
def shift(
    begin: int,
    movers: Movers,
    clearance: float,
    solid: Distance,
    correction: wp.array[wp.vec3],
    place: wp.array[wp.vec4],  # in, out
):
    """Go where the pressure pushes, as far as walls allow."""
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    x = place[i]
    there = move(solid, wp.vec3(x[0], x[1], x[2]), correction[row], clearance)
    place[i] = wp.vec4(there[0], there[1], there[2], x[3])


@wp.kernel
def update_velocity(
    begin: int,
    movers: Movers,
    step_s: float,
    start: wp.array[wp.vec3],
    place: wp.array[wp.vec4],
    velocity: wp.array[wp.vec3],  # out
):
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    velocity[i] = (wp.vec3(place[i][0], place[i][1], place[i][2]) - start[i]) / step_s


@wp.kernel
def go_as_solved(
    begin: int,
    movers: Movers,
    points_a_run: int,
    yields: wp.array[float],
    step_s: float,
    clearance: float,
    solid: Distance,
    start: wp.array[wp.vec3],
    velocity: wp.array[wp.vec3],
    place: wp.array[wp.vec4],  # in, out
):
    """X = x0 + v dt with the velocity that the viscosity left, for paste that yields.

    Eq. 5 changes velocities after positions have moved: without this, a bank at rest slides in every substep.
    """
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    if yields[i // points_a_run] == 0.0:
        return
    there = move(solid, start[i], step_s * velocity[i], clearance)
    place[i] = wp.vec4(there[0], there[1], there[2], place[i][3])


@wp.kernel
def inspect(
    begin: int,
    movers: Movers,
    fastest: float,
    densest: float,
    support: float,
    solid: Distance,
    place: wp.array[wp.vec4],
    density: wp.array[float],
    velocity: wp.array[wp.vec3],  # in, out
    direction: wp.array[wp.vec3],  # out
    fate: wp.array[int],  # in, out
    fault: wp.array[int],  # in, out
):
    """Mark what went wrong, by particle, and what left, over the edge or through a wall."""
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    if fate[i] != MOVING:
        return
    x = wp.vec3(place[i][0], place[i][1], place[i][2])
    speed = wp.length(velocity[i])
    if not (wp.isfinite(x) and wp.isfinite(speed) and wp.isfinite(density[i])):
        fault[i] = fault[i] | NOT_FINITE
    elif speed > fastest:
        fault[i] = fault[i] | TOO_FAST
    elif density[i] > densest:
        fault[i] = fault[i] | TOO_DENSE
    else:
        face = solid.face
        over = wp.max(wp.max(face[0] - x[0], x[0] - face[2]), wp.max(face[1] - x[1], x[1] - face[3]))
        if over > support or (over > 0.0 and x[2] < 0.0):
            fate[i] = SPILLED
        elif distance_at(solid, x)[3] < 0.0:
            fate[i] = ESCAPED
        if fate[i] != MOVING:
            velocity[i] = wp.vec3(0.0)
            direction[i] = wp.vec3(0.0)


@wp.struct
class Constraint:
    """Of a particle: rho_i, and how it changes with places (Eqs 1 and 2)."""

    density: float
    by_walls: float
    """What walls add to it."""
    slope: wp.vec3
    """Its gradient with the particle's own place."""
    wall_slope: wp.vec3
    """The walls' part of that."""
    squares: float
    """Sum of its squared gradients with all places."""


class PressureKernels(NamedTuple):
    measure_density: Any
    measure_terms: Any
    correct: Any


def pressure_kernels(loops: ModuleType, module: Any) -> PressureKernels:
    """The kernels of a pressure iteration that go over pairs, with the inner loops of ``loops``."""
    sum_density, sum_walls, sum_correction = loops.sum_density, loops.sum_walls, loops.sum_correction

    @wp.func(module=module)
    def constrain(
        kernel: Smoothing,
        listed: wp.array2d[int],
        count: wp.array[int],
        wall: wp.array[wp.vec4],
        wall_listed: wp.array2d[int],
        wall_count: wp.array[int],
        place: wp.array[wp.vec4],
        row: int,
        here: wp.vec4,
    ):
        """rho_i = sum_j m W_poly6 + sum_k psi_k W_poly6, and its gradients by the spiky kernel."""
        h = kernel.support
        sums = sum_density(place, listed, row, count[row], here, h)
        walls = sum_walls(wall, wall_listed, row, wall_count[row], here, h)
        it = Constraint()
        it.by_walls = kernel.wall_density * walls[0]
        it.density = kernel.density * (h * h * h * h * h * h + sums[0]) + it.by_walls
        it.wall_slope = kernel.wall_slope * wp.vec3(walls[1], walls[2], walls[3])
        it.slope = kernel.slope * wp.vec3(sums[1], sums[2], sums[3]) + it.wall_slope
        it.squares = wp.length_sq(it.slope) + kernel.slope * kernel.slope * sums[4]
        return it

    @wp.kernel(enable_backward=False, module=module)
    def measure_density(
        begin: int,
        movers: Movers,
        kernel: Smoothing,
        listed: wp.array2d[int],
        count: wp.array[int],
        wall: wp.array[wp.vec4],
        wall_listed: wp.array2d[int],
        wall_count: wp.array[int],
        place: wp.array[wp.vec4],  # in, out: the multiplier, which no one reads here
        wall_slope: wp.array[wp.vec3],  # out
        density: wp.array[float],  # out
        bulk: wp.array[wp.vec2],  # in, out: the volume
    ):
        """lambda_i = -max(rho_i - 1, 0) / (sum |grad C|^2 + eps)."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.who[row]
        here = place[i]
        it = constrain(kernel, listed, count, wall, wall_listed, wall_count, place, row, here)
        wall_slope[row] = it.wall_slope
        density[i] = it.density
        bulk[i] = wp.vec2(kernel.mass / it.density, bulk[i][1])
        multiplier = -wp.max(it.density - 1.0, 0.0) / (it.squares + kernel.relaxation)
        place[i] = wp.vec4(here[0], here[1], here[2], multiplier)

    @wp.kernel(enable_backward=False, module=module)
    def measure_terms(
        begin: int,
        movers: Movers,
        kernel: Smoothing,
        listed: wp.array2d[int],
        count: wp.array[int],
        wall: wp.array[wp.vec4],
        wall_listed: wp.array2d[int],
        wall_count: wp.array[int],
        place: wp.array[wp.vec4],
        wall_slope: wp.array[wp.vec3],  # out
        density: wp.array[float],  # out
        bulk: wp.array[wp.vec2],  # in, out: the volume
        slope: wp.array[wp.vec4],  # out: and the share in its nodes' multipliers
        yielding: wp.array[float],  # out
    ):
        """What the coarse level needs to know of a particle, ``kernels_coarse``.

        Walls answer a multiplier, but not its gradient: of that a particle beside them feels only what its fluid
        neighbours make, and so takes the more of its nodes' multipliers.
        """
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.who[row]
        it = constrain(kernel, listed, count, wall, wall_listed, wall_count, place, row, place[i])
        wall_slope[row] = it.wall_slope
        density[i] = it.density
        bulk[i] = wp.vec2(kernel.mass / it.density, bulk[i][1])
        share = 1.0 / (1.0 - wp.min(it.by_walls / it.density, MOST_BY_WALLS))
        slope[row] = wp.vec4(it.slope[0], it.slope[1], it.slope[2], share)
        yielding[row] = 1.0 / (it.squares + kernel.relaxation)

    @wp.kernel(enable_backward=False, module=module)
    def correct(
        begin: int,
        movers: Movers,
        kernel: Smoothing,
        longest: float,
        frozen_answer: float,
        listed: wp.array2d[int],
        count: wp.array[int],
        wall_slope: wp.array[wp.vec3],
        place: wp.array[wp.vec4],
        correction: wp.array[wp.vec3],  # out
    ):
        """dx_i = sum_j (lambda_i + lambda_j) m grad W + lambda_i sum_k psi_k grad W (Eq. 3).

        lambda is what the place holds: the multiplier, or what an iteration changed of it.

        Who rests cannot give way: it answers with the particle's own multiplier, or, as in the paper, with none, and
        is then half as hard as it should be.
        """
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        here = place[movers.who[row]]
        own = here[3]
        step = own * wall_slope[row]
        step += kernel.slope * sum_correction(place, listed, row, count[row], here, kernel.support, frozen_answer * own)
        length = wp.length(step)
        if length > longest:
            step *= longest / length
        correction[row] = step

    return PressureKernels(measure_density, measure_terms, correct)
