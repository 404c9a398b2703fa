"""Device code: signed distances from the solid's mesh, for the grid of ``distance``. Centimetres.

Warp's query of the nearest point is exact, except next to needles, of which the face around a crack has many. There it
returns up to 0.08 mm too much. The nodes of the grid have another search, which takes half the time.
"""

import warp as wp

from simulate.kernels.distance import BLOCK, LARGEST, NODES, Distance, block_at, row_at
from simulate.kernels.run_module import run_kernel

wp.set_module_options({"enable_backward": False})

NOT_OWN = wp.constant(-1.0)  # Square of the distance at a node that another block measures


@wp.struct
class Places:
    """Places at which the exact signed distance is measured."""

    point: wp.array[wp.vec3]
    nearby: wp.array[float]  # Distance at another place near each, or zero
    away: wp.array[float]  # Largest distance to that other place, or to search in
    distance: wp.array[float]


@wp.struct
class Blocks:
    """Blocks of the grid that have nodes, and the distances at these nodes."""

    number: wp.array[wp.vec3i]
    distance: wp.array2d[float]  # By row and node


@run_kernel
def measure_places(
    mesh: wp.uint64,
    places: Places,  # out: distance, NaN if no triangle is within reach
):
    """Measure the exact signed distance. It is negative if a ray crosses the surface an odd number of times."""
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
    """Return the distance ``size`` at ``x`` with its sign. ``nearby`` is the distance at a place within ``away``.

    If both places are far from the surface, it cannot be between them. Otherwise a ray decides, which takes as long as
    a search for the nearest triangle.
    """
    if size + wp.abs(nearby) > away:
        return wp.sign(nearby) * size
    # The ray of Warp's mesh_query_point_sign_parity, which would search the nearest triangle again.
    state = wp.rand_init(42)
    ray = wp.vec3(1.0) + wp.vec3(wp.randf(state, -0.1, 0.1), wp.randf(state, -0.1, 0.1), wp.randf(state, -0.1, 0.1))
    return wp.where(wp.mesh_query_ray_count_intersections(mesh, x, ray) % 2 == 1, -size, size)


@wp.func
def row_of_owner(solid: Distance, a: int, b: int, c: int, own: int) -> int:
    """Return the row of a block whose first nodes are the last ones of block ``own``; ``own`` if it has no nodes."""
    row = row_at(solid, a, b, c)
    return wp.where(row >= 0, row, own)


@wp.func
def squared_from_edge(p: wp.vec3, q: wp.vec3, x: wp.vec3) -> float:
    along = q - p
    per_length = along / wp.max(wp.length_sq(along), 1.0e-30)
    share = wp.clamp(wp.dot(per_length, x - p), 0.0, 1.0)
    return wp.length_sq(x - p - share * along)


@wp.func
def squared_from_triangle(p: wp.vec3, q: wp.vec3, r: wp.vec3, x: wp.vec3) -> float:
    """Return the squared distance from a triangle: from its plane if ``x`` is above it, else from its nearest edge."""
    normal = wp.normalize(wp.cross(q - p, r - p))
    inside = wp.min(
        wp.min(wp.dot(wp.cross(normal, q - p), x - p), wp.dot(wp.cross(normal, r - q), x - q)),
        wp.dot(wp.cross(normal, p - r), x - r),
    )
    height = wp.dot(normal, x - p)
    from_edges = wp.min(wp.min(squared_from_edge(p, q, x), squared_from_edge(q, r, x)), squared_from_edge(r, p, x))
    return wp.where(inside > 0.0, height * height, from_edges)


@run_kernel
def measure_nodes(
    mesh: wp.uint64,
    solid: Distance,
    shared: bool,
    blocks: Blocks,  # out: distance
):
    """Measure the exact signed distance at the nodes of blocks.

    Nodes of several blocks are measured by one block, and a second launch, ``shared``, copies them to the others. The
    few triangles that can be nearest to a node are searched once for all nodes of a block.
    """
    row = wp.tid()
    block = blocks.number[row]
    for node in range(NODES):
        place = place_of(node)
        step = wp.vec3i(place[0] // BLOCK, place[1] // BLOCK, place[2] // BLOCK)
        owner = row_of_owner(solid, block[0] + step[0], block[1] + step[1], block[2] + step[2], row)
        if not shared:
            blocks.distance[row, node] = wp.where(owner == row, float(LARGEST), float(NOT_OWN))
        elif owner != row:
            blocks.distance[row, node] = blocks.distance[owner, node_at(place - BLOCK * step)]
    if shared:
        return
    half = 0.5 * float(BLOCK) * solid.spacing
    low = solid.corner + 2.0 * half * wp.vec3(block)
    middle = low + wp.vec3(half)
    centre = solid.centre[block_at(solid, block[0], block[1], block[2])]
    at_middle = float(LARGEST)
    # A node is at most a corner's distance from the middle, and that plus the middle's distance from a triangle.
    corner = 1.7321 * half
    reach = half + wp.abs(centre) + corner
    for face in wp.mesh_query_aabb(mesh, middle - wp.vec3(reach), middle + wp.vec3(reach)):
        p = wp.mesh_get_point(mesh, 3 * face)
        q = wp.mesh_get_point(mesh, 3 * face + 1)
        r = wp.mesh_get_point(mesh, 3 * face + 2)
        squared = squared_from_triangle(p, q, r, middle)
        at_middle = wp.min(at_middle, squared)
        if wp.sqrt(squared) <= wp.abs(centre) + 2.0 * corner:
            for node in range(NODES):
                if blocks.distance[row, node] != NOT_OWN:
                    x = low + solid.spacing * wp.vec3(place_of(node))
                    blocks.distance[row, node] = wp.min(blocks.distance[row, node], squared_from_triangle(p, q, r, x))
    before = wp.sign(centre) * wp.sqrt(at_middle)
    last = wp.vec3(0.5 * float(BLOCK))
    for turn in range(NODES):
        place = place_on_path(turn)
        node = node_at(place)
        if blocks.distance[row, node] != NOT_OWN:
            here = wp.vec3(place)
            away = solid.spacing * (1.001 * wp.length(here - last) + 0.001)
            before = with_sign(mesh, low + solid.spacing * here, wp.sqrt(blocks.distance[row, node]), before, away)
            blocks.distance[row, node] = before
            last = here


@wp.func
def place_of(node: int) -> wp.vec3i:
    """Return the place of a node in its block, in steps from the low corner."""
    side = BLOCK + 1
    return wp.vec3i(node // (side * side), node // side % side, node % side)


@wp.func
def node_at(place: wp.vec3i) -> int:
    side = BLOCK + 1
    return (place[0] * side + place[1]) * side + place[2]


@wp.func
def place_on_path(turn: int) -> wp.vec3i:
    """Return the place after ``turn`` steps of a path through all nodes of a block, each step to an adjacent node."""
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
