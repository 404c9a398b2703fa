"""Device code: signed distances to the solid from a grid, and moves that cannot cross the solid. Units are cm.

Distances are positive in open space and negative in the solid.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

BLOCK = wp.constant(4)
"""Number of cells along the edge of a block of the grid. Each edge has one more node than cells, so that interpolation
never needs two blocks."""
NODES = wp.constant(125)  # Number of nodes of a block
FAR = wp.constant(-1)
FACE = wp.constant(-2)
OUTSIDE = wp.constant(-3)
BESIDE = wp.constant(1.0e3)  # Distance at positions outside the grid, next to the sample's block
ROUNDED = wp.constant(2.0)  # Value of the components of the stored normal if the nearest surface is not a plane
AS_PLANE = wp.constant(0.1)
"""Within this distance of the last search for walls, divided by the clearance, the wall counts as the same plane."""
NEARBY = wp.constant(0.5)
"""Within this distance of the last search for walls, divided by the clearance, a prediction uses the stored plane.
Farther away, another wall may be nearer."""
LARGEST = wp.constant(3.0e38)  # A number counts as finite if it is below this
PIECES = wp.constant(256)
"""Largest number of pieces of a move. A longer move is cut off. At such speeds, the fault checks end the run."""


@wp.struct
class Distance:
    """Exact distances at the nodes of blocks near the surface. Other blocks have only the distance at their centre."""

    corner: wp.vec3
    spacing: float
    blocks: wp.vec3i
    row: wp.array[int]
    """Row of each block's nodes. FAR for a block without nodes. FACE if the face z = 0 is the nearest surface in the
    block."""
    centre: wp.array[float]
    nodes: wp.array[float]
    clearance: float  # Smallest distance of a particle's centre from walls
    rounded: wp.array[int]  # 1 for each row whose block has a nearest surface that is not a plane
    face: wp.vec4


@wp.func
def block_at(solid: Distance, a: int, b: int, c: int) -> int:
    return (a * solid.blocks[1] + b) * solid.blocks[2] + c


@wp.func
def row_at(solid: Distance, a: int, b: int, c: int) -> int:
    """Return the row of a block's nodes.

    Returns FAR or FACE for a block without nodes, and OUTSIDE outside the grid.
    """
    if a < 0 or b < 0 or c < 0 or a >= solid.blocks[0] or b >= solid.blocks[1] or c >= solid.blocks[2]:
        return int(OUTSIDE)
    return solid.row[block_at(solid, a, b, c)]


@wp.func
def distance_at(solid: Distance, x: wp.vec3, below: float) -> wp.vec4:
    """Return the gradient and the signed distance at ``x``.

    The gradient is a unit vector if the distance is between 0 and ``below``. Otherwise it may be 0. Outside the grid,
    the solid is the half-space below z = 0 within the footprint of the sample's block.
    """
    u = (x - solid.corner) / solid.spacing
    reach = float(BLOCK)
    a = int(wp.floor(u[0] / reach))
    b = int(wp.floor(u[1] / reach))
    c = int(wp.floor(u[2] / reach))
    row = row_at(solid, a, b, c)
    if row == OUTSIDE:
        if x[0] > solid.face[0] and x[1] > solid.face[1] and x[0] < solid.face[2] and x[1] < solid.face[3]:
            return wp.vec4(0.0, 0.0, 1.0, x[2])
        return wp.vec4(0.0, 0.0, 0.0, BESIDE)
    if row == FACE:
        return wp.vec4(0.0, 0.0, 1.0, x[2])
    if row == FAR:
        # A lower bound of the distance in the whole block: the distance at the centre, minus the distance to a corner.
        middle = solid.centre[block_at(solid, a, b, c)]
        size = wp.abs(middle) - 0.8661 * reach * solid.spacing
        return wp.vec4(0.0, 0.0, 0.0, wp.sign(middle) * size)
    i = wp.min(int(u[0]) - a * BLOCK, BLOCK - 1)
    j = wp.min(int(u[1]) - b * BLOCK, BLOCK - 1)
    k = wp.min(int(u[2]) - c * BLOCK, BLOCK - 1)
    p = u[0] - float(a * BLOCK + i)
    q = u[1] - float(b * BLOCK + j)
    r = u[2] - float(c * BLOCK + k)
    node = row * NODES + (i * (BLOCK + 1) + j) * (BLOCK + 1) + k
    next_j = BLOCK + 1
    next_i = (BLOCK + 1) * (BLOCK + 1)
    d000 = solid.nodes[node]
    d001 = solid.nodes[node + 1]
    d010 = solid.nodes[node + next_j]
    d011 = solid.nodes[node + next_j + 1]
    d100 = solid.nodes[node + next_i]
    d101 = solid.nodes[node + next_i + 1]
    d110 = solid.nodes[node + next_i + next_j]
    d111 = solid.nodes[node + next_i + next_j + 1]
    d00 = wp.lerp(d000, d001, r)
    d01 = wp.lerp(d010, d011, r)
    d10 = wp.lerp(d100, d101, r)
    d11 = wp.lerp(d110, d111, r)
    d0 = wp.lerp(d00, d01, q)
    d1 = wp.lerp(d10, d11, q)
    distance = wp.lerp(d0, d1, p)
    # Most positions are far from walls and do not need the gradient.
    if distance >= below or distance <= 0.0:
        return wp.vec4(0.0, 0.0, 0.0, distance)
    slope_z = wp.lerp(wp.lerp(d001 - d000, d011 - d010, q), wp.lerp(d101 - d100, d111 - d110, q), p)
    slope = wp.normalize(wp.vec3(d1 - d0, wp.lerp(d01 - d00, d11 - d10, p), slope_z))
    return wp.vec4(*slope, distance)


@wp.func
def rounded_at(solid: Distance, x: wp.vec3) -> bool:
    """Return True if the walls around a position are not a plane, for example in a corner or at an edge."""
    u = (x - solid.corner) / (solid.spacing * float(BLOCK))
    row = row_at(solid, int(wp.floor(u[0])), int(wp.floor(u[1])), int(wp.floor(u[2])))
    if row < 0:
        return False
    return solid.rounded[row] == 1


@wp.struct
class Landing:
    """A position, and the gradient and distance that ``distance_at`` returns for it."""

    position: wp.vec3
    slope: wp.vec3
    distance: float


@wp.func
def push_out(solid: Distance, x: wp.vec3):
    """Move a position away from walls that are nearer than the clearance.

    Each step is shorter than the current distance, so it cannot cross a thin wall. In a corner, each step leads away
    from the wall that is then nearest.
    """
    position = x
    enough = 0.999 * solid.clearance
    wall = wp.vec4(0.0)
    for turn in range(9):
        # The function is called at only one point, because a compiler copies it for each call.
        wall = distance_at(solid, position, 2.0 * solid.clearance)
        if wall[3] >= enough or wall[3] <= 0.0 or turn == 8:
            break
        position += wp.min(solid.clearance - wall[3], 0.9 * wall[3]) * wall[:3]
    return Landing(position, wall[:3], wall[3])


@wp.func
def slide(plane: wp.vec4, start: wp.vec3, step: wp.vec3, clearance: float):
    """Return a step, changed so that its end keeps the clearance from a plane wall."""
    normal = plane[:3]
    return step + wp.max(clearance - (wp.dot(normal, start + step) - plane[3]), 0.0) * normal


@wp.func
def is_plane(beside: wp.vec4) -> bool:
    """Return True if the nearest wall of a particle is known to be a plane."""
    return beside[0] != ROUNDED and wp.length_sq(beside[:3]) > 0.0


@wp.func
def is_number(x: float) -> bool:
    """Return True for a finite number. Unlike ``isfinite``, this does not call the C library."""
    return wp.abs(x) < LARGEST


@wp.func
def move(
    solid: Distance,
    free: wp.array[wp.vec4],  # in, out: a ball for each particle (centre, radius) in which no wall limits a move
    beside: wp.array[wp.vec4],  # in, out: plane of the nearest wall at the last search
    i: int,
    start: wp.vec3,
    step: wp.vec3,
    for_now: bool,
) -> wp.vec3:
    """Return the part of ``step`` from ``start`` that walls allow. The move slides along walls.

    Walls are searched again if the move leaves the free ball and, next to a plane, also the surroundings of the last
    search. If the start is at least half the clearance from walls, the move never enters the solid: its pieces are
    shorter than that distance, and a piece that would end closer to a wall is dropped.

    ``for_now`` marks a prediction, which the last move of the substep replaces. A prediction uses the plane of a wall
    within a larger distance. The plane that it stores replaces the walls in the moves before the last move.
    """
    squared = wp.length_sq(step)
    # A step that is not finite is returned, so that the fault check finds it.
    if squared == 0.0 or not is_number(squared):
        return step
    ball = free[i]
    centre = ball[:3]
    radius = wp.max(ball[3], 0.0)
    from_centre = wp.length_sq(start - centre)
    away = wp.max(from_centre, wp.length_sq(start + step - centre))
    plane = beside[i]
    if for_now:
        reach = NEARBY * solid.clearance
        if away <= reach * reach and plane[0] != ROUNDED:
            if is_plane(plane):
                return slide(plane, start, step, solid.clearance)
            if away <= radius * radius:
                return step
    else:
        if away <= radius * radius:
            return step
        if is_plane(plane):
            slid = slide(plane, start, step, solid.clearance)
            near = AS_PLANE * solid.clearance
            if wp.max(from_centre, wp.length_sq(start + slid - centre)) <= near * near:
                return slid
    return move_along(solid, free, beside, i, start, step)


@wp.func
def move_along(
    solid: Distance,
    free: wp.array[wp.vec4],  # out
    beside: wp.array[wp.vec4],  # out
    i: int,
    start: wp.vec3,
    step: wp.vec3,
) -> wp.vec3:
    """Search for walls, and return the part of ``step`` that they allow.

    This is separate from ``move`` because a call copies ``solid``, which few moves need.
    """
    length = wp.length(step)
    pieces = wp.min(int(length / (0.45 * solid.clearance)) + 1, PIECES)
    piece = step / wp.max(float(pieces), length / (0.45 * solid.clearance))
    landing = Landing(start, wp.vec3(0.0), 0.0)
    # The move is summed piece by piece, because a difference of two positions would have their rounding errors.
    moved = wp.vec3(0.0)
    for _piece in range(pieces):
        ahead = landing.position + piece
        next_landing = push_out(solid, ahead)
        if next_landing.distance < 0.5 * solid.clearance:
            break
        moved += piece + (next_landing.position - ahead)
        landing = next_landing
    x = landing.position
    n = landing.slope
    if rounded_at(solid, x):
        n = wp.vec3(ROUNDED)
    # The radius is at most the grid's margin around the walls. It is 0 beside the sample's block, whose sides are not
    # in the grid.
    radius = wp.where(landing.distance < BESIDE, wp.min(landing.distance - solid.clearance, solid.clearance), 0.0)
    free[i] = wp.vec4(*x, radius)
    beside[i] = wp.vec4(*n, wp.dot(n, x) - landing.distance)
    return moved


@wp.func
def near_free(ball: wp.vec4, x: wp.vec3, clearance: float) -> bool:
    """Return True if a position is closer to the centre of its free ball than any wall is."""
    return wp.length(x - ball[:3]) < ball[3] + clearance


@wp.kernel
def sample_distance(
    solid: Distance,
    point: wp.array[wp.vec3],
    distance: wp.array[float],  # out
):
    """Return the signed distance at ``point``, interpolated in the grid."""
    i = wp.tid()
    distance[i] = distance_at(solid, point[i], 0.0)[3]
