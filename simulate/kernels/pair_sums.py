"""Device code of the inner loops: sums over a particle's neighbours. Centimetres and seconds.

These are the equations, for any device. ``pair_sums_cpu`` has the same sums for CPUs, eight neighbours at a time;
tests compare the two. Only the first ``count`` entries of a list's row count; the rest is padding.
"""

import warp as wp

from simulate.kernels.status import RESTS

wp.set_module_options({"enable_backward": False})

DensitySums = wp.types.vector(length=5, dtype=wp.float32)
"""Sum of (h^2 - r^2)^3; three sums of (h - r)^2 times the unit offset; sum of (h - r)^4."""
WallSums = wp.types.vector(length=4, dtype=wp.float32)
"""The first four of DensitySums, each wall particle weighted by its share."""


@wp.func
def spike(support: float, distance: float):
    """(h - r)^2 / r, which times the offset is the gradient of (h - r)^3 but for its scale.

    Zero for two particles at one position, which have no direction to part in.
    """
    left = wp.max(support - distance, 0.0)
    if distance == 0.0:
        return 0.0
    return left * left / distance


@wp.func
def sum_density(
    position: wp.array[wp.vec4], listed: wp.array2d[int], row: int, count: int, here: wp.vec4, support: float
):
    sums = DensitySums()
    for slot in range(count):
        other = position[listed[row, slot]]
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
    wall: wp.array[wp.vec4],  # position and share
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
    position: wp.array[wp.vec4],  # and multiplier
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    support: float,
    resting: float,
):
    """Sum of (lambda_i + lambda_j) (h - r)^2 times the unit offset; a particle at rest answers with ``resting``."""
    total = wp.vec3(0.0)
    for slot in range(count):
        other = position[listed[row, slot]]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        answer = other[3]
        if answer == RESTS:
            answer = resting
        total += (here[3] + answer) * spike(support, wp.length(offset)) * offset
    return total


@wp.func
def gauss(squared: float, support: float):
    """exp(-r^2/h^2), cut off at h: the weight as the paper prints it, which agrees with its U and D."""
    if squared >= support * support:
        return 0.0
    return wp.exp(-squared / (support * support))


@wp.func
def sum_shear(
    position: wp.array[wp.vec4],
    velocity: wp.array[wp.vec3],
    volume_and_viscosity: wp.array[wp.vec2],
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
        other = position[j]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        total += volume_and_viscosity[j][0] * gauss(wp.length_sq(offset), support) * wp.length_sq(moves - velocity[j])
    return total


@wp.func
def couple(
    position: wp.array[wp.vec4],
    volume_and_viscosity: wp.array[wp.vec2],
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    own: wp.vec2,
    support: float,
    coupling: wp.array2d[float],  # out
):
    """Sum of U in Eq. 5: volume times weight times the harmonic mean of both viscosities, for each pair."""
    total = float(0.0)
    for slot in range(count):
        j = listed[row, slot]
        other = position[j]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        theirs = volume_and_viscosity[j]
        mean = 2.0 * own[1] * theirs[1] / wp.max(own[1] + theirs[1], 1.0e-20)
        weight = own[0] * theirs[0] * mean * gauss(wp.length_sq(offset), support)
        coupling[row, slot] = weight
        total += weight
    return total


@wp.func
def sum_drag(
    wall: wp.array[wp.vec4],  # position and share
    listed: wp.array2d[int],
    row: int,
    count: int,
    here: wp.vec4,
    support: float,
):
    """Sum of D in Eq. 5: share times weight over the wall particles."""
    total = float(0.0)
    for slot in range(count):
        other = wall[listed[row, slot]]
        offset = wp.vec3(here[0] - other[0], here[1] - other[1], here[2] - other[2])
        total += other[3] * gauss(wp.length_sq(offset), support)
    return total


@wp.func
def sum_pulled(vector: wp.array[wp.vec3], coupling: wp.array2d[float], listed: wp.array2d[int], row: int, count: int):
    """Sum of coupling times velocity, which is zero for particles at rest."""
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
    """Append the points of a range that are nearer than ``reach`` to a list of ``found`` entries.

    Returns the new number of entries. Points beyond the row's last slot are only counted.
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
