"""Device code of the inner loops: sums over a particle's neighbours, on any device. Units are cm and s.

``pair_sums_cpu`` computes the same sums faster on CPUs, with many neighbours at a time. Tests compare the two. ``row``
is the row of a moving particle in the neighbour lists ``near``. If a row is processed by the threads of a warp, each
thread sums every 32nd entry, and all threads get the total.
"""

import warp as wp

from simulate.kernels.lanes import lane, lanes, over_lanes
from simulate.kernels.neighbours import Neighbours
from simulate.kernels.status import RESTS, Particles

wp.set_module_options({"enable_backward": False})

ALONG = 5.0 * 7.54
"""Factor of the pair weight of the implicit form, with which the same U gives the same viscosity as in Eq. 5.

5 is the ratio for a force along the pair's line and the force of Eq. 5. The rest is the ratio of the weights: that of
the fourth moments of exp(-u^2) and (1 - u^2)^3, u = 0 to 1, is 7.24. The remaining factor was fitted to shear waves. It
is needed because neighbours are not closer than a certain distance."""
NEAREST_WALL = wp.constant(0.16)
"""Smallest squared distance of a wall particle in the drag of walls, divided by h^2. For fluid at rest it is 0.22."""

DensitySums = wp.types.vector(length=5, dtype=wp.float32)
"""Sums over neighbours at distance r: (h^2 - r^2)^3, three components of (h - r)^2 times the unit offset, and (h -
r)^4."""
CoupleSums = wp.types.vector(length=13, dtype=wp.float32)
"""Sums over neighbours. The first six are the pair weights times the products xx, yy, zz, xy, yz, zx of the pair's
direction. The seventh is the sum of the weights of neighbours at rest. Three components of ``sum_pulled`` for the
velocity and three for the guess follow."""
GradientSums = wp.types.vector(length=15, dtype=wp.float32)
"""Weighted sums of the products xx, yy, zz, xy, yz, zx of the offsets, and of velocity differences times offsets."""
DragSums = wp.types.vector(length=6, dtype=wp.float32)
"""Sums over wall particles: D of Eq. 5, ``no_slip_weight``, ``distance_weight``, and ``distance_weight`` times the
offsets."""
WallSums = wp.types.vector(length=4, dtype=wp.float32)
"""The first four sums of ``DensitySums``, over wall particles instead of neighbours. Each term is multiplied by the
wall particle's weight."""


@wp.func
def spike(support: float, distance: float):
    """Return (h - r)^2 / r, where h is ``support`` and r is ``distance``. Returns 0 for r = 0.

    Multiplied by the offset, this is proportional to the gradient of (h - r)^3. For two particles at the same position,
    the gradient has no direction.
    """
    depth = wp.max(support - distance, 0.0)
    if distance == 0.0:
        return 0.0
    return depth * depth / distance


@wp.func
def sum_density(particles: Particles, near: Neighbours, row: int, support: float):
    position = particles.position[particles.mover[row]]
    sums = DensitySums()
    window = near.fluid_at[row]
    for slot in range(lane(), near.fluid_count[row], lanes()):
        neighbour = particles.position[near.fluid[window, slot]]
        offset = position[:3] - neighbour[:3]
        squared = wp.length_sq(offset)
        rest = wp.max(support * support - squared, 0.0)
        slope = spike(support, wp.sqrt(squared))
        sums[0] += rest * rest * rest
        sums[1:4] += slope * offset
        sums[4] += slope * slope * squared
    return over_lanes(sums)


@wp.func
def sum_walls(particles: Particles, near: Neighbours, row: int, support: float):
    position = particles.position[particles.mover[row]]
    sums = WallSums()
    window = near.wall_at[row]
    for slot in range(lane(), near.wall_count[row], lanes()):
        wall = near.wall_particle[near.wall[window, slot]]
        offset = position[:3] - wall[:3]
        squared = wp.length_sq(offset)
        rest = wp.max(support * support - squared, 0.0)
        slope = wall[3] * spike(support, wp.sqrt(squared))
        sums[0] += wall[3] * rest * rest * rest
        sums[1:4] += slope * offset
    return over_lanes(sums)


@wp.func
def sum_correction(particles: Particles, near: Neighbours, row: int, support: float, resting: float):
    """Sum (lambda_i + lambda_j) (h - r)^2 times the unit offset over the neighbours j.

    For a neighbour at rest, lambda_j is ``resting``.
    """
    position = particles.position[particles.mover[row]]
    total = wp.vec3(0.0)
    window = near.fluid_at[row]
    for slot in range(lane(), near.fluid_count[row], lanes()):
        neighbour = particles.position[near.fluid[window, slot]]
        offset = position[:3] - neighbour[:3]
        answer = neighbour[3]
        if answer == RESTS:
            answer = resting
        total += (position[3] + answer) * spike(support, wp.length(offset)) * offset
    return over_lanes(total)


@wp.func
def gauss(squared: float, support: float):
    """Return exp(-r^2/h^2), or 0 for r >= h. This is the weight in the paper, for the paper's U and D."""
    if squared >= support * support:
        return 0.0
    return wp.exp(-squared / (support * support))


@wp.func
def no_slip_weight(squared: float, support: float):
    """Return the weight of a wall particle in the no-slip drag of a fluid of viscosity 1. It is a number times h^3.

    A fluid particle has no neighbours behind a wall. Their drag is replaced by one layer of wall particles with these
    weights, a radius deep in the wall. The weight was fitted for fluid whose speed is proportional to its distance from
    the wall, up to three radii, and is accurate to 2 %.
    """
    share = wp.max(squared / (support * support), NEAREST_WALL)
    rest = wp.max(1.0 - share, 0.0)
    return support * support * support * rest * rest * (0.42132 + (0.15390 / share - 0.19697) / share)


@wp.func
def distance_weight(squared: float, support: float):
    """Return a weight of a wall particle whose sum is that of ``no_slip_weight`` times the distance from the wall.

    The two sums are equal for a plane wall. The weight is a number times h^4.
    """
    share = wp.max(squared / (support * support), NEAREST_WALL)
    rest = wp.max(1.0 - share, 0.0)
    return support * support * support * support * rest * ((0.12740 - 0.01363 / share) / share - 0.08634)


@wp.func
def poly6(squared: float, support: float):
    """Return (1 - r^2/h^2)^3, the weight of a pair in the implicit form of the viscosity."""
    rest = wp.max(1.0 - squared / (support * support), 0.0)
    return rest * rest * rest


@wp.func
def sum_gradient(particles: Particles, near: Neighbours, row: int, support: float):
    """Sum the terms of a linear fit to the velocities around a particle, with the pair weights of the viscosity."""
    i = particles.mover[row]
    position = particles.position[i]
    moves = particles.velocity[i]
    sums = GradientSums()
    window = near.fluid_at[row]
    for slot in range(lane(), near.fluid_count[row], lanes()):
        j = near.fluid[window, slot]
        neighbour = particles.position[j]
        offset = position[:3] - neighbour[:3]
        apart = moves - particles.velocity[j]
        weight = poly6(wp.length_sq(offset), support)
        sums[0] += weight * offset[0] * offset[0]
        sums[1] += weight * offset[1] * offset[1]
        sums[2] += weight * offset[2] * offset[2]
        sums[3] += weight * offset[0] * offset[1]
        sums[4] += weight * offset[1] * offset[2]
        sums[5] += weight * offset[2] * offset[0]
        sums[6:9] += weight * apart[0] * offset
        sums[9:12] += weight * apart[1] * offset
        sums[12:15] += weight * apart[2] * offset
    return over_lanes(sums)


@wp.func
def link_pairs(
    particles: Particles,
    near: Neighbours,
    row: int,
    support: float,
    links: wp.array2d[wp.vec3h],  # out
):
    """Compute the link of each pair: a vector along the pair, whose square is the pair's weight in the matrix.

    The weight is ``ALONG`` times the mean volume, W and the mean viscosity. The matrix is the sum of the links'
    outer products. It is therefore symmetric without negative eigenvalues, also if links are rounded to float16.
    Returns ``CoupleSums``: the particle's diagonal block of the matrix, and the matrix times the velocity and times
    the guess, without this rounding.
    """
    i = particles.mover[row]
    position = particles.position[i]
    material = particles.volume_and_viscosity[i]
    moves = particles.velocity[i]
    guessed = particles.scaled_residual[i]
    sums = CoupleSums()
    window = near.fluid_at[row]
    for slot in range(lane(), near.fluid_count[row], lanes()):
        j = near.fluid[window, slot]
        neighbour = particles.position[j]
        offset = position[:3] - neighbour[:3]
        squared = wp.length_sq(offset)
        neighbour_material = particles.volume_and_viscosity[j]
        mean = 0.5 * (material[1] + neighbour_material[1])
        weight = 0.5 * wp.static(ALONG) * (material[0] + neighbour_material[0]) * mean * poly6(squared, support)
        link = wp.sqrt(weight / wp.max(squared, 1.0e-20)) * offset
        links[window, slot] = wp.vec3h(link)
        sums[0] += link[0] * link[0]
        sums[1] += link[1] * link[1]
        sums[2] += link[2] * link[2]
        sums[3] += link[0] * link[1]
        sums[4] += link[1] * link[2]
        sums[5] += link[2] * link[0]
        if neighbour[3] == RESTS:
            sums[6] += weight
        still = wp.dot(moves - particles.velocity[j], link)
        moved = wp.dot(guessed - particles.scaled_residual[j], link)
        sums[7:10] += still * link
        sums[10:13] += moved * link
    return over_lanes(sums)


@wp.func
def sum_eq5(
    particles: Particles,
    velocity: wp.array[wp.vec3],
    near: Neighbours,
    row: int,
    support: float,
):
    """Sum the weight U m/rho_j W_v of Eq. 5 times the difference of velocities, and the weight itself.

    If the two viscosities of a pair differ, their harmonic mean is used.
    """
    i = particles.mover[row]
    position = particles.position[i]
    viscosity = particles.volume_and_viscosity[i][1]
    moves = velocity[i]
    sums = wp.vec4(0.0)
    window = near.fluid_at[row]
    for slot in range(lane(), near.fluid_count[row], lanes()):
        j = near.fluid[window, slot]
        neighbour = particles.position[j]
        offset = position[:3] - neighbour[:3]
        neighbour_material = particles.volume_and_viscosity[j]
        mean = 2.0 * viscosity * neighbour_material[1] / wp.max(viscosity + neighbour_material[1], 1.0e-20)
        weight = neighbour_material[0] * mean * gauss(wp.length_sq(offset), support)
        apart = weight * (moves - velocity[j])
        sums += wp.vec4(*apart, weight)
    return over_lanes(sums)


@wp.func
def sum_drag(particles: Particles, near: Neighbours, row: int, support: float):
    """Sum D of Eq. 5 (the wall particles' weights times a Gaussian), and the terms of the no-slip drag."""
    position = particles.position[particles.mover[row]]
    sums = DragSums()
    window = near.wall_at[row]
    for slot in range(lane(), near.wall_count[row], lanes()):
        wall = near.wall_particle[near.wall[window, slot]]
        offset = position[:3] - wall[:3]
        squared = wp.length_sq(offset)
        far = wall[3] * distance_weight(squared, support)
        sums[0] += wall[3] * gauss(squared, support)
        sums[1] += wall[3] * no_slip_weight(squared, support)
        sums[2] += far
        sums[3:6] += far * offset
    return over_lanes(sums)


@wp.func
def sum_pulled(particles: Particles, near: Neighbours, row: int, links: wp.array2d[wp.vec3h]):
    """Sum each link times the difference of the two scaled residuals, projected on the link.

    The scaled residual of a particle at rest is 0.
    """
    vector = particles.scaled_residual
    scaled_residual = vector[particles.mover[row]]
    total = wp.vec3(0.0)
    window = near.fluid_at[row]
    for slot in range(lane(), near.fluid_count[row], lanes()):
        link = wp.vec3(links[window, slot])
        total += wp.dot(scaled_residual - vector[near.fluid[window, slot]], link) * link
    return over_lanes(total)
