"""Device code of the inner loops: what a particle sums over its neighbours. Centimetres and seconds.

These are the equations, for any device. ``kernels_pairs_native`` has the same sums with sixteen neighbours at a time,
for CPUs; tests hold both to each other. A list's row is filled up to a whole sixteen with nobody;
what counts here is its first ``count`` entries.
"""

import warp as wp

from simulate.kernels_rest import RESTS

wp.set_module_options({"enable_backward": False})

DensitySums = wp.types.vector(length=5, dtype=wp.float32)
"""Sum of (h^2 - r^2)^3; of (h - r)^2 times the unit offset, three; of (h - r)^4."""
WallSums = wp.types.vector(length=4, dtype=wp.float32)
"""The first four of DensitySums, each wall particle by its share."""


@wp.func
def spike(support: float, distance: float):
    """(h - r)^2 / r: times the offset, the gradient of (h - r)^3 but for its scale.

    Zero for two particles in one place, which have no direction to part in.
    """
    left = wp.max(support - distance, 0.0)
    if distance == 0.0:
        return 0.0
    return left * left / distance


@wp.func
def sum_density(
    place: wp.array[wp.vec4],
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    support: float,
):
    sums = DensitySums()
    for slot in range(count):
        other = place[listed[row, slot]]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        squared = wp.length_sq(offset)
        left = wp.max(support * support - squared, 0.0)
        slope = spike(support, wp.sqrt(squared))
        sums[0] += left * left * left
        sums[1] += slope * offset[0]
        sums[2] += slope * offset[1]
        sums[3] += slope * offset[2]
        sums[4] += slope * slope * squared
    return sums


@wp.func
def sum_walls(
    wall: wp.array[wp.vec4],  # place and share
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    support: float,
):
    sums = WallSums()
    for slot in range(count):
        other = wall[listed[row, slot]]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        squared = wp.length_sq(offset)
        left = wp.max(support * support - squared, 0.0)
        slope = other[3] * spike(support, wp.sqrt(squared))
        sums[0] += other[3] * left * left * left
        sums[1] += slope * offset[0]
        sums[2] += slope * offset[1]
        sums[3] += slope * offset[2]
    return sums


@wp.func
def sum_correction(
    place: wp.array[wp.vec4],  # and multiplier
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    support: float,
    resting: float,
):
    """Sum of (lambda_i + lambda_j) (h - r)^2 times the unit offset; who rests answers with ``resting``."""
    total = wp.vec3(0.0)
    for slot in range(count):
        other = place[listed[row, slot]]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        answer = other[3]
        if answer == RESTS:
            answer = resting
        total += (here[3] + answer) * spike(support, wp.length(offset)) * offset
    return total


@wp.func
def gauss(squared: float, support: float):
    """exp(-r^2/h^2), cut off at h: the shape of the weight that the paper prints, which explains its U and D."""
    if squared >= support * support:
        return 0.0
    return wp.exp(-squared / (support * support))


@wp.func
def sum_shear(
    place: wp.array[wp.vec4],
    velocity: wp.array[wp.vec3],
    bulk: wp.array[wp.vec2],  # volume and thickness
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    moves: wp.vec3,
    support: float,
):
    """Sum of volume times weight times the squared difference of velocities."""
    total = float(0.0)
    for slot in range(count):
        j = listed[row, slot]
        other = place[j]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        total += bulk[j][0] * gauss(wp.length_sq(offset), support) * wp.length_sq(moves - velocity[j])
    return total


@wp.func
def couple(
    place: wp.array[wp.vec4],
    bulk: wp.array[wp.vec2],  # volume and thickness
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    own: wp.vec2,
    support: float,
    coupling: wp.array2d[float],  # out
):
    """Volumes times weight times the harmonic mean of both thicknesses, for each pair; returns their sum."""
    total = float(0.0)
    for slot in range(count):
        j = listed[row, slot]
        other = place[j]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        theirs = bulk[j]
        mean = 2.0 * own[1] * theirs[1] / wp.max(own[1] + theirs[1], 1.0e-20)
        weight = own[0] * theirs[0] * mean * gauss(wp.length_sq(offset), support)
        coupling[row, slot] = weight
        total += weight
    return total


@wp.func
def sum_drag(
    wall: wp.array[wp.vec4],  # place and share
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    support: float,
):
    total = float(0.0)
    for slot in range(count):
        other = wall[listed[row, slot]]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        total += other[3] * gauss(wp.length_sq(offset), support)
    return total


@wp.func
def sum_pulled(
    vector: wp.array[wp.vec3],
    coupling: wp.array2d[float],
    listed: wp.array2d[int],
    row: int,
    count: int,
):
    """Sum of coupling times velocity; who rests has none."""
    total = wp.vec3(0.0)
    for slot in range(count):
        total += coupling[row, slot] * vector[listed[row, slot]]
    return total


@wp.func
def collect(
    x: wp.array[float],
    y: wp.array[float],
    z: wp.array[float],
    number: wp.array[int],
    begin: int,
    end: int,
    here: wp.vec4,
    reach: float,
    self: int,
    listed: wp.array2d[int],  # out
    row: int,
    found: int,
):
    """List those of a run of points that are nearer than ``reach``, after the ``found`` that are there.

    Returns how many there are then. Past the row's last slot they are counted only.
    """
    slots = listed.shape[1]
    so_far = found
    for k in range(begin, end):
        offset = wp.vec3(x[k] - here[0], y[k] - here[1], z[k] - here[2])
        if wp.length_sq(offset) < reach * reach and number[k] != self:
            if so_far < slots:
                listed[row, so_far] = number[k]
            so_far += 1
    return so_far
