"""Device code of the pressure's coarse level: multipliers on nodes in arc length and height. Centimetres.

The multipliers of a fluid at rest are smooth apart from each particle's own part. They are therefore written as
lambda_i = own_i + t_i sum_a phi_a(s_i, z_i) L_a. phi_a falls linearly from 1 at node a to 0 at the next nodes, and L is
the solution of (Galerkin) sum_b (sum_i B_ai B_bi) L_b = - sum_i t_i phi_a C_i. B_ai is the move of particle i by L_a,
grad phi_a + 2 phi_a grad_i C_i: near a free surface, with neighbours on one side only, towards the other side.

Sums over particles are of integers, so that they do not depend on order, device or threads.
"""

import warp as wp

from simulate.kernels.status import Particles, Span, end_of

wp.set_module_options({"enable_backward": False})

UNIT = wp.constant(float(2**40))
"""Integer that represents a sum of 1. Sums of a collapsed fluid stay a thousand times below the largest integer."""
WEIGHT = wp.constant(5)
OLD = wp.constant(6)
SUMS = wp.constant(7)
"""Columns of a node's sums: couplings to itself and to the nodes above, ahead below, ahead, and ahead above; then the
weight of its particles, and their old compression."""
COLOURS = wp.constant(4)


@wp.struct
class ArcLengthMap:
    """Arc length along the crack, on the nodes of a horizontal grid."""

    corner: wp.vec2
    spacing: float
    count: wp.vec2i
    at: wp.array[wp.vec3]  # Arc length, and the direction in which it grows


@wp.struct
class Nodes:
    """A lattice of nodes in arc length and height for each run, height fastest.

    No particle is next to an outermost node.
    """

    low: wp.vec2
    spacing: float
    count: wp.vec2i
    per_run: int
    by_colour: wp.array[int]  # Nodes of a run in four groups; neighbours are in different groups
    sums: wp.array2d[wp.int64]
    excess: wp.array[wp.int64]
    matrix: wp.array2d[float]
    right: wp.array[float]
    change: wp.array[float]  # Change of the nodes' multipliers in an iteration
    total: wp.array[float]  # The nodes' multipliers so far in a substep


@wp.struct
class CoarseRows:
    """The coarse level's data of each mover, by row."""

    node: wp.array[int]  # The node behind and below the mover
    part: wp.array[wp.vec2]  # Share of the way from that node to the next ones
    along: wp.array[wp.vec2]  # Direction of the crack
    old: wp.array[float]  # Compression that the last substep left
    multiplier: wp.array[float]
    slope: wp.array[wp.vec4]  # The constraint's own gradient, and the share in the nodes' multipliers
    yielding: wp.array[float]  # Change of the multiplier for each unit of compression
    compression: wp.array[float]  # Density less 1


@wp.kernel
def locate(
    rows: Span,
    particles: Particles,
    arc: ArcLengthMap,
    nodes: Nodes,
    coarse: CoarseRows,  # out
):
    """Find each mover's nodes for a substep, and its compression after the last substep."""
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        i = particles.mover[row]
        here = particles.position[i]
        x = wp.vec2(here[0], here[1])
        q = (x - arc.corner) / arc.spacing
        a = wp.clamp(int(q[0] + 0.5), 0, arc.count[0] - 1)
        b = wp.clamp(int(q[1] + 0.5), 0, arc.count[1] - 1)
        nearest = arc.at[a * arc.count[1] + b]
        along = wp.vec2(nearest[1], nearest[2])
        beside = x - arc.corner - arc.spacing * wp.vec2(float(a), float(b))
        p = (wp.vec2(nearest[0] + wp.dot(beside, along), here[2]) - nodes.low) / nodes.spacing
        s = wp.clamp(p[0], 1.0, float(nodes.count[0]) - 2.001)
        z = wp.clamp(p[1], 1.0, float(nodes.count[1]) - 2.001)
        coarse.node[row] = i // particles.per_run * nodes.per_run + int(s) * nodes.count[1] + int(z)
        coarse.part[row] = wp.vec2(s - float(int(s)), z - float(int(z)))
        coarse.along[row] = along
        coarse.old[row] = particles.density[i] - 1.0
        coarse.multiplier[row] = 0.0


@wp.func
def shape(part: wp.vec2, along: wp.vec2, corner: int):
    """Return the gradient of phi times the spacing, and phi, at a corner of a cell.

    Corners are 0 below, 1 above, and 2 and 3 below and above at the next arc length.
    """
    ahead = float(corner // 2)
    above = float(corner % 2)
    s = ahead * part[0] + (1.0 - ahead) * (1.0 - part[0])
    z = above * part[1] + (1.0 - above) * (1.0 - part[1])
    forward = (2.0 * ahead - 1.0) * z
    return wp.vec4(forward * along[0], forward * along[1], (2.0 * above - 1.0) * s, s * z)


@wp.func
def response(shape: wp.vec4, slope: wp.vec3):
    """Return B times the spacing. ``slope`` is twice the particle's own gradient, times the spacing."""
    return wp.vec3(shape[0], shape[1], shape[2]) + shape[3] * slope


@wp.func
def put(sums: wp.array2d[wp.int64], node: int, of: int, value: float):
    wp.atomic_add(sums, node, of, wp.int64(value * UNIT))


@wp.kernel
def sum_matrix(
    particles: Particles,
    nodes: Nodes,  # out: sums
    coarse: CoarseRows,
):
    """Sum the effects of the nodes' multipliers on the sums of C at other nodes, times the spacing squared."""
    row = wp.tid()
    if row >= particles.mover_count[0]:
        return
    part = coarse.part[row]
    along = coarse.along[row]
    own = coarse.slope[row]
    g = 2.0 * nodes.spacing * wp.vec3(own[0], own[1], own[2])
    c = own[3] * coarse.old[row]
    for one in range(4):
        here = shape(part, along, one)
        moves = response(here, g)
        node = coarse.node[row] + one // 2 * nodes.count[1] + one % 2
        for other in range(one, 4):
            coupling = 3 * (other // 2 - one // 2) + other % 2 - one % 2
            put(nodes.sums, node, coupling, wp.dot(moves, response(shape(part, along, other), g)))
        put(nodes.sums, node, WEIGHT, here[3])
        put(nodes.sums, node, OLD, here[3] * c)


@wp.kernel
def sum_excess(
    particles: Particles,
    nodes: Nodes,  # out: excess
    coarse: CoarseRows,
):
    """Sum t_i phi_a C_i, including the terms of loose fluid with C < 0."""
    row = wp.tid()
    if row >= particles.mover_count[0]:
        return
    n = coarse.node[row]
    s = coarse.part[row][0]
    z = coarse.part[row][1]
    c = coarse.slope[row][3] * coarse.compression[row] * UNIT
    on = s * c
    wp.atomic_add(nodes.excess, n, wp.int64((1.0 - z) * (c - on)))
    wp.atomic_add(nodes.excess, n + 1, wp.int64(z * (c - on)))
    wp.atomic_add(nodes.excess, n + nodes.count[1], wp.int64((1.0 - z) * on))
    wp.atomic_add(nodes.excess, n + nodes.count[1] + 1, wp.int64(z * on))


@wp.func_native(
    """
#if defined(__CUDA_ARCH__)
__syncthreads();
#endif
"""
)
def wait_for_block(): ...


@wp.func
def pull(nodes: Nodes, a: int, up: int):
    """Return the sum of the eight neighbours' couplings, each times the neighbour's change."""
    matrix = nodes.matrix
    change = nodes.change
    total = matrix[a, 1] * change[a + 1] + matrix[a - 1, 1] * change[a - 1]
    total += matrix[a, 2] * change[a + up - 1] + matrix[a - up + 1, 2] * change[a - up + 1]
    total += matrix[a, 3] * change[a + up] + matrix[a - up, 3] * change[a - up]
    total += matrix[a, 4] * change[a + up + 1] + matrix[a - up - 1, 4] * change[a - up - 1]
    return total


@wp.kernel
def solve(
    nodes: Nodes,  # in: sums, excess and total; out: all arrays, with zero excess for the next iteration
    summed: bool,
    lanes: int,
    sweeps: int,
    overshoot: float,
    least: float,
    at_once: float,
):
    """Solve for the nodes by projected over-relaxation in four colours, one block of threads per run.

    Multipliers are at most 0. The matrix is computed from its sums if they were ``summed`` since the last iteration. A
    share ``at_once`` of the compression after the last substep is corrected. Nodes with less than ``least`` weight of
    particles are not solved for, so that spray falls freely.
    """
    run, lane = wp.tid()
    first = run * nodes.per_run
    scale = nodes.spacing * nodes.spacing / UNIT
    for k in range(lane, nodes.per_run, lanes):
        a = first + k
        nodes.change[a] = 0.0
        nodes.right[a] = wp.inf
        if nodes.sums[a, WEIGHT] >= wp.int64(least * UNIT):
            old = wp.max(float(nodes.sums[a, OLD]), 0.0)
            nodes.right[a] = ((1.0 - at_once) * old - float(nodes.excess[a])) * scale
        nodes.excess[a] = wp.int64(0)
        if summed:
            for of in range(WEIGHT):
                nodes.matrix[a, of] = float(nodes.sums[a, of]) / UNIT
    wait_for_block()
    quarter = nodes.per_run // COLOURS
    for _ in range(sweeps):
        for colour in range(COLOURS):
            for k in range(lane, quarter, lanes):
                a = first + nodes.by_colour[colour * quarter + k]
                if nodes.right[a] < wp.inf:
                    there = (nodes.right[a] - pull(nodes, a, nodes.count[1])) / nodes.matrix[a, 0]
                    nodes.change[a] = wp.min(nodes.change[a] + overshoot * (there - nodes.change[a]), -nodes.total[a])
            wait_for_block()
    for k in range(lane, nodes.per_run, lanes):
        nodes.total[first + k] = nodes.total[first + k] + nodes.change[first + k]


@wp.kernel
def change_multipliers(
    rows: Span,
    particles: Particles,  # in, out: the change of the multiplier with the position
    nodes: Nodes,
    coarse: CoarseRows,  # in, out: multiplier
    iteration: float,
    step: float,
):
    """Change each multiplier by the particle's own part and its nodes' part. The sum stays at most 0.

    The own part is a Jacobi step with the factors and the momentum of Legendre's polynomials: n steps have the effect
    of n^2 / 2 plain steps at most.
    """
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        i = particles.mover[row]
        n = coarse.node[row]
        s = coarse.part[row][0]
        z = coarse.part[row][1]
        ahead = n + nodes.count[1]
        change = nodes.change
        smooth = (1.0 - s) * ((1.0 - z) * change[n] + z * change[n + 1])
        smooth += s * ((1.0 - z) * change[ahead] + z * change[ahead + 1])
        x = particles.position[i]
        before = coarse.multiplier[row]
        momentum = (iteration - 1.0) / iteration
        own = momentum * x[3] - (1.0 + momentum) * step * coarse.compression[row] * coarse.yielding[row]
        after = wp.min(0.0, before + own + coarse.slope[row][3] * smooth)
        particles.position[i] = wp.vec4(x[0], x[1], x[2], after - before)
        coarse.multiplier[row] = after
