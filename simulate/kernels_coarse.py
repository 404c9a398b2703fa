"""Device code of the pressure's coarse level: multipliers on nodes in arc length and height. Centimetres.

The multipliers of a fluid at rest are smooth but for what each particle needs of its own. So they are written as
lambda_i = own_i + t_i sum_a phi_a(s_i, z_i) L_a, where phi_a falls linearly from 1 at node a to 0 at the next, and L is
solved for (Galerkin): sum_b (sum_i B_ai B_bi) L_b = - sum_i t_i phi_a C_i, where B_ai is how L_a moves particle i. That
is grad phi_a + 2 phi_a grad_i C_i: near a free surface, with neighbours on one side only, it goes where there are none.

Sums over particles are in whole numbers, so that their order, and with it the device and its threads, does not matter.
"""

import warp as wp

from simulate.kernels_rest import Movers

wp.set_module_options({"enable_backward": False})

UNIT = wp.constant(float(2**40))
"""A sum of 1 as a whole number: a collapsed fluid's stay a thousand times below the largest."""
WEIGHT = wp.constant(5)
OLD = wp.constant(6)
SUMS = wp.constant(7)
"""Of a node: couplings to itself, above, ahead below, ahead, ahead above; weight of its particles; old compression."""
COLOURS = wp.constant(4)


@wp.struct
class Stations:
    """Arc length along the crack, on the nodes of a map seen from above."""

    corner: wp.vec2
    spacing: float
    count: wp.vec2i
    at: wp.array[wp.vec3]
    """Arc length, and the direction in which it grows."""


@wp.struct
class Nodes:
    """A lattice in arc length and height for each run, height fastest; none touches its outermost nodes."""

    low: wp.vec2
    spacing: float
    count: wp.vec2i
    a_run: int
    by_colour: wp.array[int]
    """Nodes of a run so that no two of the same quarter are neighbours."""


@wp.struct
class Spot:
    """Of a mover among the nodes."""

    node: wp.array[int]
    """Behind and below it."""
    part: wp.array[wp.vec2]
    """Of the way to the next nodes."""
    along: wp.array[wp.vec2]
    """Direction of the crack."""


@wp.kernel
def locate(
    begin: int,
    movers: Movers,
    points_a_run: int,
    stations: Stations,
    nodes: Nodes,
    place: wp.array[wp.vec4],
    density: wp.array[float],
    spot: Spot,  # out
    old: wp.array[float],  # out
    multiplier: wp.array[float],  # out
):
    """Find each mover's nodes for a substep, and what compression the last one left."""
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    x = wp.vec2(place[i][0], place[i][1])
    q = (x - stations.corner) / stations.spacing
    a = wp.clamp(int(q[0] + 0.5), 0, stations.count[0] - 1)
    b = wp.clamp(int(q[1] + 0.5), 0, stations.count[1] - 1)
    station = stations.at[a * stations.count[1] + b]
    along = wp.vec2(station[1], station[2])
    beside = x - stations.corner - stations.spacing * wp.vec2(float(a), float(b))
    p = (wp.vec2(station[0] + wp.dot(beside, along), place[i][2]) - nodes.low) / nodes.spacing
    s = wp.clamp(p[0], 1.0, float(nodes.count[0]) - 2.001)
    z = wp.clamp(p[1], 1.0, float(nodes.count[1]) - 2.001)
    spot.node[row] = i // points_a_run * nodes.a_run + int(s) * nodes.count[1] + int(z)
    spot.part[row] = wp.vec2(s - float(int(s)), z - float(int(z)))
    spot.along[row] = along
    old[row] = density[i] - 1.0
    multiplier[row] = 0.0


@wp.func
def shape(part: wp.vec2, along: wp.vec2, ahead: float, above: float):
    """Of the node ``ahead`` and ``above``, each 0 or 1: gradient of phi times the spacing, and phi."""
    s = ahead * part[0] + (1.0 - ahead) * (1.0 - part[0])
    z = above * part[1] + (1.0 - above) * (1.0 - part[1])
    forward = (2.0 * ahead - 1.0) * z
    return wp.vec4(forward * along[0], forward * along[1], (2.0 * above - 1.0) * s, s * z)


@wp.func
def response(shape: wp.vec4, slope: wp.vec3):
    """B times the spacing; ``slope`` is twice the particle's own gradient, times the spacing."""
    return wp.vec3(shape[0], shape[1], shape[2]) + shape[3] * slope


@wp.func
def put(sums: wp.array2d[wp.int64], node: int, of: int, value: float):
    wp.atomic_add(sums, node, of, wp.int64(value * UNIT))


@wp.kernel
def sum_matrix(
    movers: Movers,
    nodes: Nodes,
    spot: Spot,
    slope: wp.array[wp.vec4],
    old: wp.array[float],
    sums: wp.array2d[wp.int64],  # out
):
    """What the nodes' multipliers do to each other's sums of C, times the spacing squared."""
    row = wp.tid()
    if row >= movers.count[0]:
        return
    part = spot.part[row]
    along = spot.along[row]
    n = spot.node[row]
    ahead = n + nodes.count[1]
    own = slope[row]
    g = 2.0 * nodes.spacing * wp.vec3(own[0], own[1], own[2])
    here = shape(part, along, 0.0, 0.0)
    up = shape(part, along, 0.0, 1.0)
    on = shape(part, along, 1.0, 0.0)
    on_up = shape(part, along, 1.0, 1.0)
    b_here = response(here, g)
    b_up = response(up, g)
    b_on = response(on, g)
    b_on_up = response(on_up, g)
    put(sums, n, 0, wp.dot(b_here, b_here))
    put(sums, n, 1, wp.dot(b_here, b_up))
    put(sums, n, 3, wp.dot(b_here, b_on))
    put(sums, n, 4, wp.dot(b_here, b_on_up))
    put(sums, n + 1, 0, wp.dot(b_up, b_up))
    put(sums, n + 1, 2, wp.dot(b_up, b_on))
    put(sums, n + 1, 3, wp.dot(b_up, b_on_up))
    put(sums, ahead, 0, wp.dot(b_on, b_on))
    put(sums, ahead, 1, wp.dot(b_on, b_on_up))
    put(sums, ahead + 1, 0, wp.dot(b_on_up, b_on_up))
    put(sums, n, WEIGHT, here[3])
    put(sums, n + 1, WEIGHT, up[3])
    put(sums, ahead, WEIGHT, on[3])
    put(sums, ahead + 1, WEIGHT, on_up[3])
    c = own[3] * old[row]
    put(sums, n, OLD, here[3] * c)
    put(sums, n + 1, OLD, up[3] * c)
    put(sums, ahead, OLD, on[3] * c)
    put(sums, ahead + 1, OLD, on_up[3] * c)


@wp.kernel
def sum_excess(
    movers: Movers,
    nodes: Nodes,
    spot: Spot,
    slope: wp.array[wp.vec4],
    density: wp.array[float],
    excess: wp.array[wp.int64],  # out
):
    """Sum of t_i phi_a C_i; where the fluid is loose, C < 0 counts too."""
    row = wp.tid()
    if row >= movers.count[0]:
        return
    n = spot.node[row]
    s = spot.part[row][0]
    z = spot.part[row][1]
    c = slope[row][3] * (density[movers.who[row]] - 1.0) * UNIT
    on = s * c
    wp.atomic_add(excess, n, wp.int64((1.0 - z) * (c - on)))
    wp.atomic_add(excess, n + 1, wp.int64(z * (c - on)))
    wp.atomic_add(excess, n + nodes.count[1], wp.int64((1.0 - z) * on))
    wp.atomic_add(excess, n + nodes.count[1] + 1, wp.int64(z * on))


@wp.func_native(
    """
#if defined(__CUDA_ARCH__)
__syncthreads();
#endif
"""
)
def wait_for_block(): ...


@wp.func
def pull(matrix: wp.array2d[float], change: wp.array[float], a: int, up: int):
    """Sum of the eight neighbours' couplings times their changes."""
    total = matrix[a, 1] * change[a + 1] + matrix[a - 1, 1] * change[a - 1]
    total += matrix[a, 2] * change[a + up - 1] + matrix[a - up + 1, 2] * change[a - up + 1]
    total += matrix[a, 3] * change[a + up] + matrix[a - up, 3] * change[a - up]
    total += matrix[a, 4] * change[a + up + 1] + matrix[a - up - 1, 4] * change[a - up - 1]
    return total


@wp.kernel
def solve(
    nodes: Nodes,
    lanes: int,
    sweeps: int,
    overshoot: float,
    least: float,
    at_once: float,
    sums: wp.array2d[wp.int64],
    excess: wp.array[wp.int64],  # in, out: none, for the next iteration to sum into
    matrix: wp.array2d[float],  # out
    right: wp.array[float],  # out
    change: wp.array[float],  # out: of the nodes' multipliers in this iteration
    total: wp.array[float],  # in, out
):
    """Projected over-relaxation in four colours: no multiplier pulls. A block of threads works on a run.

    Compression that the last substep left is taken out by the share ``at_once``. Nodes with fewer particles' weight
    than ``least`` stay out: spray falls free.
    """
    run, lane = wp.tid()
    first = run * nodes.a_run
    scale = nodes.spacing * nodes.spacing / UNIT
    for k in range(lane, nodes.a_run, lanes):
        a = first + k
        change[a] = 0.0
        right[a] = wp.inf
        if sums[a, WEIGHT] >= wp.int64(least * UNIT):
            left = wp.max(float(sums[a, OLD]), 0.0)
            right[a] = ((1.0 - at_once) * left - float(excess[a])) * scale
        excess[a] = wp.int64(0)
        for of in range(WEIGHT):
            matrix[a, of] = float(sums[a, of]) / UNIT
    wait_for_block()
    quarter = nodes.a_run // COLOURS
    for _ in range(sweeps):
        for colour in range(COLOURS):
            for k in range(lane, quarter, lanes):
                a = first + nodes.by_colour[colour * quarter + k]
                if right[a] < wp.inf:
                    there = (right[a] - pull(matrix, change, a, nodes.count[1])) / matrix[a, 0]
                    change[a] = wp.min(change[a] + overshoot * (there - change[a]), -total[a])
            wait_for_block()
    for k in range(lane, nodes.a_run, lanes):
        total[first + k] = total[first + k] + change[first + k]


@wp.kernel
def change_multipliers(
    begin: int,
    movers: Movers,
    nodes: Nodes,
    spot: Spot,
    iteration: float,
    step: float,
    density: wp.array[float],
    slope: wp.array[wp.vec4],
    yielding: wp.array[float],
    change: wp.array[float],
    multiplier: wp.array[float],  # in, out
    place: wp.array[wp.vec4],  # in, out: the change of the multiplier, in the iteration before and in this one
):
    """What a particle needs of its own, and its nodes' share; together they only ever push.

    The own part is a Jacobi step with the factors and the momentum of Legendre's polynomials: n of them reach as far as
    n^2 / 2 plain ones.
    """
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    i = movers.who[row]
    n = spot.node[row]
    s = spot.part[row][0]
    z = spot.part[row][1]
    ahead = n + nodes.count[1]
    coarse = (1.0 - s) * ((1.0 - z) * change[n] + z * change[n + 1])
    coarse += s * ((1.0 - z) * change[ahead] + z * change[ahead + 1])
    x = place[i]
    momentum = (iteration - 1.0) / iteration
    own = momentum * x[3] - (1.0 + momentum) * step * (density[i] - 1.0) * yielding[row]
    after = wp.min(0.0, multiplier[row] + own + slope[row][3] * coarse)
    place[i] = wp.vec4(x[0], x[1], x[2], after - multiplier[row])
    multiplier[row] = after
