"""Device code of the fluid: Algorithm 1 of the paper, Eqs 1 to 4.

Centimetres and seconds; densities in units of the rest density, so that a particle's mass is a volume in cm3.
Particles are numbered by release. Thread ``row`` of a launch stands for particle ``first + row``: the older ones are
frozen, and are neighbours only.
"""

import warp as wp

from simulate.kernels_distance import Distance, distance_at, move

wp.set_module_options({"enable_backward": False})

GRAVITY = wp.constant(wp.vec3(0.0, 0.0, -981.0))

NEIGHBOURS_FULL = wp.constant(0)
WALLS_FULL = wp.constant(1)
NOT_FINITE = wp.constant(2)
TOO_FAST = wp.constant(3)
TOO_DENSE = wp.constant(4)
FAULTS = wp.constant(5)

IN_PLAY = wp.constant(0)
SPILLED = wp.constant(1)
ESCAPED = wp.constant(2)


@wp.struct
class Cells:
    """Points in the order of the cells that hold them. x counts fastest: three cells along x are one run of points."""

    corner: wp.vec3
    size: float
    count: wp.vec3i
    start: wp.array[int]
    point: wp.array[wp.vec3]
    number: wp.array[int]


@wp.struct
class Smoothing:
    """The two kernels of the density constraint, with their scales worked out once."""

    support: float
    """h: both vanish from here on."""
    poly6: float
    """315 / (64 pi h^9)."""
    spiky: float
    """-45 / (pi h^6)."""


@wp.func
def poly6(kernel: Smoothing, distance: float):
    """Weight in the density: (h^2 - r^2)^3, scaled to an integral of 1."""
    left = wp.max(kernel.support * kernel.support - distance * distance, 0.0)
    return kernel.poly6 * left * left * left


@wp.func
def spiky_gradient(kernel: Smoothing, offset: wp.vec3, distance: float):
    """Gradient of (h - r)^3; zero for two particles in one place, which have no direction to part in."""
    if distance >= kernel.support or distance == 0.0:
        return wp.vec3(0.0)
    left = kernel.support - distance
    return kernel.spiky * left * left / distance * offset


@wp.func
def cell_along(x: float, corner: float, size: float, count: int):
    """Points beyond the grid belong to its border cells, which keeps near ones near."""
    return wp.clamp(int(wp.floor((x - corner) / size)), 0, count - 1)


@wp.func
def cell_of(cells: Cells, x: wp.vec3):
    a = cell_along(x[0], cells.corner[0], cells.size, cells.count[0])
    b = cell_along(x[1], cells.corner[1], cells.size, cells.count[1])
    c = cell_along(x[2], cells.corner[2], cells.size, cells.count[2])
    return a + cells.count[0] * (b + cells.count[1] * c)


@wp.kernel
def predict(
    first: int,
    step_s: float,
    damping: float,
    clearance: float,
    solid: Distance,
    fate: wp.array[int],
    velocity: wp.array[wp.vec3],
    position: wp.array[wp.vec3],  # in, out
    start: wp.array[wp.vec3],  # out
):
    """V + (g - eta v) dt, x* = x + v dt, as far as walls allow (Eq. 4; Algorithm 1, line 2)."""
    row = wp.tid()
    i = first + row
    x = position[i]
    start[i] = x
    if fate[i] == IN_PLAY:
        v = velocity[i] + step_s * (GRAVITY - damping * velocity[i])
        position[i] = move(solid, x, step_s * v, clearance)


@wp.kernel
def count_in_cells(
    cells: Cells,
    point: wp.array[wp.vec3],
    fate: wp.array[int],
    cell: wp.array[int],  # out
    number: wp.array[int],  # out
    count: wp.array[int],  # out
):
    """The cell of each point, one past the last for those that left, and how many each holds."""
    i = wp.tid()
    number[i] = i
    key = cells.count[0] * cells.count[1] * cells.count[2]
    if fate[i] == IN_PLAY:
        key = cell_of(cells, point[i])
    cell[i] = key
    wp.atomic_add(count, key, 1)


@wp.kernel
def gather(
    number: wp.array[int],
    point: wp.array[wp.vec3],
    gathered: wp.array[wp.vec3],  # out
):
    k = wp.tid()
    gathered[k] = point[number[k]]


@wp.kernel
def list_neighbours(
    first: int,
    cells: Cells,
    reach: float,
    self_is_listed: int,
    full: int,
    position: wp.array[wp.vec3],
    fate: wp.array[int],
    neighbour: wp.array2d[int],  # out
    neighbour_count: wp.array[int],  # out
    fault: wp.array[int],  # out
):
    """The points nearer than ``reach``, itself left out; a list that is too short is a fault, never cut in silence."""
    row = wp.tid()
    i = first + row
    x = position[i]
    found = int(0)
    slots = neighbour.shape[1]
    if fate[i] == IN_PLAY:
        a = cell_along(x[0], cells.corner[0], cells.size, cells.count[0])
        b = cell_along(x[1], cells.corner[1], cells.size, cells.count[1])
        c = cell_along(x[2], cells.corner[2], cells.size, cells.count[2])
        a_low = wp.max(a - 1, 0)
        a_high = wp.min(a + 1, cells.count[0] - 1)
        for cc in range(wp.max(c - 1, 0), wp.min(c + 2, cells.count[2])):
            for bb in range(wp.max(b - 1, 0), wp.min(b + 2, cells.count[1])):
                line = cells.count[0] * (bb + cells.count[1] * cc)
                for k in range(cells.start[line + a_low], cells.start[line + a_high + 1]):
                    if wp.length_sq(cells.point[k] - x) < reach * reach:
                        j = cells.number[k]
                        if j != i or self_is_listed == 1:
                            if found < slots:
                                neighbour[row, found] = j
                            found += 1
    if found > slots:
        wp.atomic_min(fault, full, i)
        found = slots
    neighbour_count[row] = found


@wp.kernel
def measure_density(
    first: int,
    kernel: Smoothing,
    mass: float,
    wall_mass: float,
    relaxation: float,
    position: wp.array[wp.vec3],
    neighbour: wp.array2d[int],
    neighbour_count: wp.array[int],
    wall_point: wp.array[wp.vec3],
    wall_share: wp.array[float],
    wall_neighbour: wp.array2d[int],
    wall_count: wp.array[int],
    gradient: wp.array2d[wp.vec3],  # out
    wall_gradient: wp.array[wp.vec3],  # out
    density: wp.array[float],  # out
    multiplier: wp.array[float],  # out
):
    """rho_i = sum_j m W + sum_k psi_k W, and lambda_i of Eq. 1 where the fluid is compressed (C > 0), else 0.

    Gradients are kept for the correction that follows: the same pair, the same place.
    """
    row = wp.tid()
    i = first + row
    x = position[i]
    rho = mass * poly6(kernel, 0.0)
    own = wp.vec3(0.0)
    squares = float(0.0)
    for slot in range(neighbour_count[row]):
        offset = x - position[neighbour[row, slot]]
        distance = wp.length(offset)
        rho += mass * poly6(kernel, distance)
        slope = mass * spiky_gradient(kernel, offset, distance)
        gradient[row, slot] = slope
        own += slope
        squares += wp.length_sq(slope)
    wall = wp.vec3(0.0)
    for slot in range(wall_count[row]):
        k = wall_neighbour[row, slot]
        offset = x - wall_point[k]
        distance = wp.length(offset)
        rho += wall_mass * wall_share[k] * poly6(kernel, distance)
        wall += wall_mass * wall_share[k] * spiky_gradient(kernel, offset, distance)
    wall_gradient[row] = wall
    density[i] = rho
    multiplier[i] = -wp.max(rho - 1.0, 0.0) / (wp.length_sq(own + wall) + squares + relaxation)


@wp.kernel
def correct(
    first: int,
    longest: float,
    frozen_answer: float,
    clearance: float,
    solid: Distance,
    multiplier: wp.array[float],
    neighbour: wp.array2d[int],
    neighbour_count: wp.array[int],
    gradient: wp.array2d[wp.vec3],
    wall_gradient: wp.array[wp.vec3],
    position: wp.array[wp.vec3],  # in, out
):
    """dx_i = sum_j (lambda_i + lambda_j) m grad W + lambda_i sum_k psi_k grad W (Eq. 3), as far as walls allow.

    A frozen neighbour cannot give way: it answers with the particle's own multiplier, or, as in the paper, with
    none, and is then half as hard as it should be.
    """
    row = wp.tid()
    i = first + row
    own = multiplier[i]
    step = own * wall_gradient[row]
    for slot in range(neighbour_count[row]):
        j = neighbour[row, slot]
        other = frozen_answer * own
        if j >= first:
            other = multiplier[j]
        step += (own + other) * gradient[row, slot]
    length = wp.length(step)
    if length > longest:
        step *= longest / length
    position[i] = move(solid, position[i], step, clearance)


@wp.kernel
def update_velocity(
    first: int,
    step_s: float,
    start: wp.array[wp.vec3],
    position: wp.array[wp.vec3],
    velocity: wp.array[wp.vec3],  # out
):
    i = first + wp.tid()
    velocity[i] = (position[i] - start[i]) / step_s


@wp.kernel
def inspect(
    first: int,
    fastest: float,
    densest: float,
    support: float,
    solid: Distance,
    position: wp.array[wp.vec3],
    velocity: wp.array[wp.vec3],  # in, out
    density: wp.array[float],
    fate: wp.array[int],  # in, out
    fault: wp.array[int],  # out
):
    """Report what went wrong, by the first particle; mark what left, over the edge or through a wall."""
    i = first + wp.tid()
    if fate[i] != IN_PLAY:
        return
    x = position[i]
    speed = wp.length(velocity[i])
    if not (wp.isfinite(x) and wp.isfinite(speed) and wp.isfinite(density[i])):
        wp.atomic_min(fault, NOT_FINITE, i)
    elif speed > fastest:
        wp.atomic_min(fault, TOO_FAST, i)
    elif density[i] > densest:
        wp.atomic_min(fault, TOO_DENSE, i)
    else:
        face = solid.face
        over = wp.max(wp.max(face[0] - x[0], x[0] - face[2]), wp.max(face[1] - x[1], x[1] - face[3]))
        if over > support or (over > 0.0 and x[2] < 0.0):
            fate[i] = SPILLED
        elif distance_at(solid, x)[3] < 0.0:
            fate[i] = ESCAPED
        if fate[i] != IN_PLAY:
            velocity[i] = wp.vec3(0.0)
