"""Device code of the viscosity: Eq. 5 of the paper, and its implicit form. Centimetres and seconds.

Rows of the implicit system are multiplied by the particle's volume m/rho, which makes the matrix symmetric.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def gauss(distance: float, support: float):
    """exp(-r^2/h^2) / (h sqrt(pi)), cut off at h: the weight that the paper prints, which explains its U and D."""
    if distance >= support:
        return 0.0
    return wp.exp(-distance * distance / (support * support)) / (1.772453851 * support)


@wp.kernel
def weigh_pairs(
    first: int,
    support: float,
    mass: float,
    fluid_weight: float,
    wall_weight: float,
    position: wp.array[wp.vec3],
    density: wp.array[float],
    neighbour: wp.array2d[int],
    neighbour_count: wp.array[int],
    wall_point: wp.array[wp.vec3],
    wall_share: wp.array[float],
    wall_neighbour: wp.array2d[int],
    wall_count: wp.array[int],
    coupling: wp.array2d[float],  # out
    resistance: wp.array[float],  # out
    volume: wp.array[float],  # out
):
    """U m/rho_j W for each pair, and its sum with D sum_k W for each particle; all times m/rho_i."""
    row = wp.tid()
    i = first + row
    x = position[i]
    own = mass / density[i]
    total = float(0.0)
    for slot in range(neighbour_count[row]):
        j = neighbour[row, slot]
        weight = fluid_weight * own * mass / density[j] * gauss(wp.length(x - position[j]), support)
        coupling[row, slot] = weight
        total += weight
    for slot in range(wall_count[row]):
        k = wall_neighbour[row, slot]
        total += wall_weight * own * wall_share[k] * gauss(wp.length(x - wall_point[k]), support)
    resistance[row] = total
    volume[row] = own


@wp.func
def pulled_along(
    first: int,
    row: int,
    neighbour: wp.array2d[int],
    neighbour_count: wp.array[int],
    coupling: wp.array2d[float],
    velocity: wp.array[wp.vec3],
):
    """Sum over the moving neighbours of weight times velocity; the frozen ones stand still. ``velocity`` is by row."""
    total = wp.vec3(0.0)
    for slot in range(neighbour_count[row]):
        other = neighbour[row, slot] - first
        if other >= 0:
            total += coupling[row, slot] * velocity[other]
    return total


@wp.kernel
def apply_matrix(
    first: int,
    neighbour: wp.array2d[int],
    neighbour_count: wp.array[int],
    coupling: wp.array2d[float],
    resistance: wp.array[float],
    volume: wp.array[float],
    vector: wp.array[wp.vec3],
    product: wp.array[wp.vec3],  # out
):
    """(I + A) of backward Euler on Eq. 5, times a vector of velocities."""
    row = wp.tid()
    pulled = pulled_along(first, row, neighbour, neighbour_count, coupling, vector)
    product[row] = (volume[row] + resistance[row]) * vector[row] - pulled


@wp.kernel
def start_search(
    first: int,
    resistance: wp.array[float],
    volume: wp.array[float],
    velocity: wp.array[wp.vec3],
    solution: wp.array[wp.vec3],  # out
    right_side: wp.array[wp.vec3],  # out
    scaled: wp.array[wp.vec3],  # out
):
    """The first guess is the velocity without viscosity; scaled is the right hand side over the diagonal (Jacobi)."""
    row = wp.tid()
    v = velocity[first + row]
    b = volume[row] * v
    solution[row] = v
    right_side[row] = b
    scaled[row] = b / (volume[row] + resistance[row])


@wp.kernel
def first_residual(
    resistance: wp.array[float],
    volume: wp.array[float],
    product: wp.array[wp.vec3],
    residual: wp.array[wp.vec3],  # in: right hand side, out
    scaled: wp.array[wp.vec3],  # out
    direction: wp.array[wp.vec3],  # out
):
    row = wp.tid()
    r = residual[row] - product[row]
    residual[row] = r
    scaled[row] = r / (volume[row] + resistance[row])
    direction[row] = r / (volume[row] + resistance[row])


@wp.kernel
def advance_search(
    error: wp.array[float],
    curvature: wp.array[float],
    resistance: wp.array[float],
    volume: wp.array[float],
    direction: wp.array[wp.vec3],
    product: wp.array[wp.vec3],
    solution: wp.array[wp.vec3],  # in, out
    residual: wp.array[wp.vec3],  # in, out
    scaled: wp.array[wp.vec3],  # out
):
    row = wp.tid()
    # A fluid at rest has nothing to solve for: 0 / 0.
    length = error[0] / wp.max(curvature[0], 1.0e-30)
    solution[row] = solution[row] + length * direction[row]
    r = residual[row] - length * product[row]
    residual[row] = r
    scaled[row] = r / (volume[row] + resistance[row])


@wp.kernel
def turn_search(
    error: wp.array[float],
    error_before: wp.array[float],
    scaled: wp.array[wp.vec3],
    direction: wp.array[wp.vec3],  # in, out
):
    row = wp.tid()
    direction[row] = scaled[row] + error[0] / wp.max(error_before[0], 1.0e-30) * direction[row]


@wp.kernel
def pass_velocity(
    first: int,
    passes: float,
    neighbour: wp.array2d[int],
    neighbour_count: wp.array[int],
    coupling: wp.array2d[float],
    resistance: wp.array[float],
    volume: wp.array[float],
    before: wp.array[wp.vec3],
    after: wp.array[wp.vec3],  # out
):
    """One of the q passes of Eq. 5."""
    row = wp.tid()
    pulled = pulled_along(first, row, neighbour, neighbour_count, coupling, before)
    after[row] = before[row] - (resistance[row] * before[row] - pulled) / (passes * volume[row])
