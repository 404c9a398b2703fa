"""Device code: signed distances to the solid's mesh, for the grid of ``distance``. Units are cm.

Warp's query of the nearest point is exact except next to needle-shaped triangles. The face around a crack has many such
triangles, and there the query returns distances that are up to 0.08 mm too large. The distances at the grid's nodes
therefore come from another search, which takes half the time.
"""

import warp as wp

from simulate.kernels.distance import BLOCK, LARGEST, NODES, Distance, block_at, row_at
from simulate.kernels.run_module import run_kernel

wp.set_module_options({"enable_backward": False})

NOT_OWN = wp.constant(-1.0)  # Value that marks a node whose distance is measured by another block


@wp.struct
class Places:
    """Positions at which the exact signed distance is measured."""

    point: wp.array[wp.vec3]
    nearby: wp.array[float]  # Signed distance at another position near each point, or 0
    away: wp.array[float]  # Largest distance of the point from that position, or, if there is none, of the search
    distance: wp.array[float]


@wp.struct
class Blocks:
    """Blocks of the grid that have nodes, and the distances at their nodes."""

    number: wp.array[wp.vec3i]
    distance: wp.array2d[float]  # Distance at each node, by row and node


@run_kernel
def measure_places(
    mesh: wp.uint64,
    places: Places,  # out: distance, NaN if no triangle is within reach
):
    """Measure the exact signed distance at each point. It is negative inside the solid."""
    i = wp.tid()
    x = places.point[i]
    nearby = places.nearby[i]
    away = places.away[i]
    query = wp.mesh_query_point_no_sign(mesh, x, wp.abs(nearby) + away)
    places.distance[i] = wp.nan
    if query.result:
        size = wp.length(x - wp.mesh_eval_position(mesh, query.face, query.u, query.v))
        places.distance[i] = with_sign(mesh, x, size, nearby, away)


@wp.func
def with_sign(mesh: wp.uint64, x: wp.vec3, size: float, nearby: float, away: float) -> float:
    """Return the distance ``size`` at ``x`` with its sign.

    ``nearby`` is the signed distance at another position, at most ``away`` from ``x``. If both positions are far from
    the surface, the surface cannot be between them, and the signs are equal. Otherwise the crossings of a ray with the
    surface are counted. The ray takes as long as a search for the nearest triangle.
    """
    if size + wp.abs(nearby) > away:
        return wp.sign(nearby) * size
    # This is the ray of Warp's mesh_query_point_sign_parity, which would also search for the nearest triangle again.
    state = wp.rand_init(42)
    ray = wp.vec3(1.0) + wp.vec3(wp.randf(state, -0.1, 0.1), wp.randf(state, -0.1, 0.1), wp.randf(state, -0.1, 0.1))
    return wp.where(wp.mesh_query_ray_count_intersections(mesh, x, ray) % 2 == 1, -size, size)


@wp.func_native(
    f"enum {{ SIDE = {int(BLOCK) + 1}, NODES = {int(NODES)}, MIDDLE = NODES / 2 }};"
    """
struct Edge { wp::vec3 start, along, per_length, inward; };
const wp::vec3 normal = wp::normalize(wp::cross(q - p, r - p));
const auto edge = [normal](const wp::vec3& start, const wp::vec3& end) {
    const wp::vec3 along = end - start;
    return Edge{start, along, along / wp::max(wp::length_sq(along), 1.0e-30f), wp::cross(normal, along)};
};
const Edge pq = edge(p, q), qr = edge(q, r), rp = edge(r, p);
const auto from_edge = [](const Edge& edge, const wp::vec3& x) {
    float share = wp::dot(edge.per_length, x - edge.start);
    share = share < 0.0f ? 0.0f : share > 1.0f ? 1.0f : share;
    return wp::length_sq(x - edge.start - share * edge.along);
};
const auto inward = [](const Edge& edge, const wp::vec3& x) { return wp::dot(edge.inward, x - edge.start); };
const auto least = [](float a, float b, float c) { return a < b ? (a < c ? a : c) : (b < c ? b : c); };
const auto squared_at = [&](int node) {
    const wp::vec3 x = low + spacing * wp::vec3(node / (SIDE * SIDE), node / SIDE % SIDE, node % SIDE);
    const float height = wp::dot(normal, x - p), edges = least(from_edge(pq, x), from_edge(qr, x), from_edge(rp, x));
    return least(inward(pq, x), inward(qr, x), inward(rp, x)) > 0.0f ? height * height : edges;
};
if (squared_at(MIDDLE) > farthest * farthest) return;
float* nearest = blocks.distance.data + (size_t)row * NODES;
#pragma clang loop vectorize(enable) interleave(disable)
for (int node = 0; node < NODES; ++node) {
    const float squared = squared_at(node), before = nearest[node];
    nearest[node] = squared < before ? squared : before;
}""",
)
def measure_from_triangle(
    p: wp.vec3,
    q: wp.vec3,
    r: wp.vec3,
    low: wp.vec3,
    spacing: float,
    farthest: float,
    row: int,
    blocks: Blocks,  # in, out: squared distances
):
    """Lower the squared distance of each node of a block to its squared distance from a triangle, if that is smaller.

    A triangle is skipped if it is farther than ``farthest`` from the block's middle. The distance is measured from the
    triangle's plane if a node is above the triangle, and from the nearest edge otherwise. The code is C++, so that the
    compiler for a CPU processes several nodes at the same time, which it does not do with Warp's code.
    """
    ...


@run_kernel
def measure_nodes(
    mesh: wp.uint64,
    solid: Distance,
    shared: bool,
    blocks: Blocks,  # out: distance
):
    """Measure the exact signed distance at the nodes of all blocks.

    A node that belongs to several blocks is measured by one block. A second launch with ``shared`` copies its distance
    to the other blocks. The few triangles that may be nearest are searched once for all nodes of a block.
    """
    row = wp.tid()
    block = blocks.number[row]
    for node in range(NODES):
        coordinates = place_of(node)
        step = wp.vec3i(coordinates[0] // BLOCK, coordinates[1] // BLOCK, coordinates[2] // BLOCK)
        # The last nodes of a block are the first nodes of the next block, if that block has nodes.
        owner = row_at(solid, block[0] + step[0], block[1] + step[1], block[2] + step[2])
        if owner < 0:
            owner = row
        if not shared:
            blocks.distance[row, node] = wp.where(owner == row, float(LARGEST), float(NOT_OWN))
        elif owner != row:
            blocks.distance[row, node] = blocks.distance[owner, node_at(coordinates - BLOCK * step)]
    if shared:
        return
    half = 0.5 * float(BLOCK) * solid.spacing
    low = solid.corner + 2.0 * half * wp.vec3(block)
    middle = low + wp.vec3(half)
    centre = solid.centre[block_at(solid, block[0], block[1], block[2])]
    # A node is at most ``corner`` from the middle of the block. Its nearest triangle is at most ``corner`` plus the
    # middle's distance away.
    corner = 1.7321 * half
    reach = half + wp.abs(centre) + corner
    for face in wp.mesh_query_aabb(mesh, middle - wp.vec3(reach), middle + wp.vec3(reach)):
        p = wp.mesh_get_point(mesh, 3 * face)
        q = wp.mesh_get_point(mesh, 3 * face + 1)
        r = wp.mesh_get_point(mesh, 3 * face + 2)
        measure_from_triangle(p, q, r, low, solid.spacing, wp.abs(centre) + 2.0 * corner, row, blocks)
    before = wp.sign(centre) * wp.sqrt(blocks.distance[row, NODES // 2])
    last = wp.vec3(0.5 * float(BLOCK))
    for turn in range(NODES):
        coordinates = place_on_path(turn)
        node = node_at(coordinates)
        if blocks.distance[row, node] != NOT_OWN:
            position = wp.vec3(coordinates)
            away = solid.spacing * (1.001 * wp.length(position - last) + 0.001)
            before = with_sign(mesh, low + solid.spacing * position, wp.sqrt(blocks.distance[row, node]), before, away)
            blocks.distance[row, node] = before
            last = position


@wp.func
def place_of(node: int) -> wp.vec3i:
    """Return the position of a node in its block, in steps from the low corner."""
    side = BLOCK + 1
    return wp.vec3i(node // (side * side), node // side % side, node % side)


@wp.func
def node_at(coordinates: wp.vec3i) -> int:
    side = BLOCK + 1
    return (coordinates[0] * side + coordinates[1]) * side + coordinates[2]


@wp.func
def place_on_path(turn: int) -> wp.vec3i:
    """Return the position after ``turn`` steps of a path through all nodes of a block.

    Each step goes to an adjacent node.
    """
    side = BLOCK + 1
    line = turn // side
    i = line // side
    j = line % side
    k = turn % side
    if i % 2 == 1:
        j = BLOCK - j
    if line % 2 == 1:
        k = BLOCK - k
    return wp.vec3i(i, j, k)
