"""Device code: signed distances from the solid's mesh, of which the grid of ``distance`` is made. Centimetres.

Warp's query of the nearest point is exact but beside needles, of which the face around a crack has many: there it is up
to 0.08 mm too far. The nodes of the grid have their own, which takes half the time.
"""

import warp as wp

from simulate.kernels.distance import BLOCK, LARGEST, NODES, Distance, block_at, row_at
from simulate.kernels.run_module import run_kernel

wp.set_module_options({"enable_backward": False})

NOT_OWN = wp.constant(-1.0)  # Square of the distance at a node that another block measures


@wp.struct
class Places:
    """Places whose exact signed distance is asked for."""

    point: wp.array[wp.vec3]
    known: wp.array[float]  # Distance of a place near each, zero where none is known
    away: wp.array[float]  # How far away that place is at most, or how far to look
    distance: wp.array[float]


@wp.struct
class Blocks:
    """Blocks of the grid that have nodes, and the distances at these."""

    number: wp.array[wp.vec3i]
    distance: wp.array2d[float]  # By row and node


@run_kernel
def measure_places(
    mesh: wp.uint64,
    places: Places,  # out: distance, NaN where no triangle is within reach
):
    """Exact signed distance, negative where a ray crosses the surface an odd number of times."""
    i = wp.tid()
    x = places.point[i]
    known = places.known[i]
    away = places.away[i]
    found = wp.mesh_query_point_no_sign(mesh, x, wp.abs(known) + away)
    places.distance[i] = wp.nan
    if found.result:
        size = wp.length(x - wp.mesh_eval_position(mesh, found.face, found.u, found.v))
        places.distance[i] = with_sign(mesh, x, size, known, away)


@wp.func
def with_sign(mesh: wp.uint64, x: wp.vec3, size: float, known: float, away: float) -> float:
    """The distance ``size`` at ``x`` with its sign; ``known`` is that of a place no farther than ``away``.

    No surface fits between the two where both are far from it. A ray, which tells on which side ``x`` is, takes as long
    as to find the nearest triangle.
    """
    if size + wp.abs(known) > away:
        return wp.sign(known) * size
    # The ray of Warp's mesh_query_point_sign_parity, which would look for the nearest triangle again.
    state = wp.rand_init(42)
    ray = wp.vec3(1.0) + wp.vec3(wp.randf(state, -0.1, 0.1), wp.randf(state, -0.1, 0.1), wp.randf(state, -0.1, 0.1))
    return wp.where(wp.mesh_query_ray_count_intersections(mesh, x, ray) % 2 == 1, -size, size)


@wp.func
def row_of_owner(solid: Distance, a: int, b: int, c: int, own: int) -> int:
    """Row of the block that begins with the nodes that the block of row ``own`` ends with; ``own`` if it has none."""
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
    """Square of the distance from a triangle: from its plane above its inside, else from the nearest edge."""
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
    """Exact signed distance at the nodes of blocks.

    Nodes that several blocks share are measured by one of them; a second launch, ``shared``, copies them to the others.
    The nodes of a block share the few triangles that can be the nearest to one of them.
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
    known = solid.centre[block_at(solid, block[0], block[1], block[2])]
    at_middle = float(LARGEST)
    # No node is farther from the middle than a corner, nor from the nearest triangle than that and the middle's.
    corner = 1.7321 * half
    reach = half + wp.abs(known) + corner
    for face in wp.mesh_query_aabb(mesh, middle - wp.vec3(reach), middle + wp.vec3(reach)):
        p = wp.mesh_get_point(mesh, 3 * face)
        q = wp.mesh_get_point(mesh, 3 * face + 1)
        r = wp.mesh_get_point(mesh, 3 * face + 2)
        squared = squared_from_triangle(p, q, r, middle)
        at_middle = wp.min(at_middle, squared)
        if wp.sqrt(squared) <= wp.abs(known) + 2.0 * corner:
            for node in range(NODES):
                if blocks.distance[row, node] != NOT_OWN:
                    x = low + solid.spacing * wp.vec3(place_of(node))
                    blocks.distance[row, node] = wp.min(blocks.distance[row, node], squared_from_triangle(p, q, r, x))
    known = wp.sign(known) * wp.sqrt(at_middle)
    last = wp.vec3(0.5 * float(BLOCK))
    for turn in range(NODES):
        place = place_on_path(turn)
        node = node_at(place)
        if blocks.distance[row, node] != NOT_OWN:
            here = wp.vec3(place)
            away = solid.spacing * (1.001 * wp.length(here - last) + 0.001)
            known = with_sign(mesh, low + solid.spacing * here, wp.sqrt(blocks.distance[row, node]), known, away)
            blocks.distance[row, node] = known
            last = here


@wp.func
def place_of(node: int) -> wp.vec3i:
    """Place of a node in its block, in steps from the low corner."""
    side = BLOCK + 1
    return wp.vec3i(node // (side * side), node // side % side, node % side)


@wp.func
def node_at(place: wp.vec3i) -> int:
    side = BLOCK + 1
    return (place[0] * side + place[1]) * side + place[2]


@wp.func
def place_on_path(turn: int) -> wp.vec3i:
    """Place in a block at which a path through all of them is after ``turn`` steps, each to a node beside the last."""
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
