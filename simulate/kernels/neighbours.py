"""Device code of the neighbours: points sorted into cells, a list for each particle that moves, and who wakes whom."""

from types import ModuleType
from typing import Any

import warp as wp

from simulate.kernels.status import ASLEEP, FROZEN, MOVING, Movers, Particles

wp.set_module_options({"enable_backward": False})

BLOCK = wp.constant(64)
ASIDE = wp.constant(7)  # Sixteens at the end of a block in which the walls of a row are collected, before they move up
NOWHERE_CM = 1e6  # x, y and z of the dummy point that pads lists: no particle comes near it
NEARLY_ONE = wp.constant(1.0001)  # Reach squared over a cell's size: rounding may put a point into the next cell


@wp.struct
class CellArrays:
    """Points sorted by cell, x fastest, so that three cells along x are one range of points.

    Each run has cells of its own; the walls have one set for all runs.
    """

    corner: wp.vec3
    size: float
    count: wp.vec3i
    points_per_run: int  # Number of points of each run, which follow each other
    start: wp.array[int]
    x: wp.array[float]
    y: wp.array[float]
    z: wp.array[float]
    number: wp.array[int]


@wp.struct
class Neighbours:
    """Lists of the fluid and wall particles near each mover.

    For a CPU's loops they lie one behind the other, and are windows of one store that begin at every sixteenth entry.
    ``BLOCK`` rows share ``room`` sixteens of it, and a thread has whole blocks. On a GPU each row has a window of its
    own.
    """

    store: wp.array[int]
    wall_store: wp.array[int]  # That of the walls' lists where each row has a window of its own
    fluid: wp.array2d[int]
    fluid_at: wp.array[int]  # Window of each row
    fluid_count: wp.array[int]
    wall: wp.array2d[int]
    wall_at: wp.array[int]
    wall_count: wp.array[int]
    packed: int  # 1 where lists lie one behind the other
    room: int  # Sixteens of entries for the lists of a block of rows, the last of them ``ASIDE``
    lacking: wp.array[int]  # 1 once a block has too little room for what was found
    wall_particle: wp.array[wp.vec4]  # Position of each wall particle, and the share of the surface that it stands for


@wp.func
def cells_per_run(cells: CellArrays):
    return cells.count[0] * cells.count[1] * cells.count[2]


@wp.func
def cell_along(x: float, corner: float, size: float, count: int):
    """Cell index along an axis; points beyond the grid belong to its border cells, which keeps neighbours adjacent."""
    return wp.clamp(int(wp.floor((x - corner) / size)), 0, count - 1)


@wp.func
def cell_of(cells: CellArrays, x: wp.vec4):
    a = cell_along(x[0], cells.corner[0], cells.size, cells.count[0])
    b = cell_along(x[1], cells.corner[1], cells.size, cells.count[1])
    c = cell_along(x[2], cells.corner[2], cells.size, cells.count[2])
    return a + cells.count[0] * (b + cells.count[1] * c)


@wp.kernel
def count_in_cells(
    cells: CellArrays,
    runs: int,
    position: wp.array[wp.vec4],
    status: wp.array[int],
    cell: wp.array[int],  # out
    rank: wp.array[int],  # out: within its cell; the points' own order on a CPU only
    count: wp.array[int],  # out
):
    """Cell of each point, one past the last for points that are absent, and the number of points of each cell."""
    i = wp.tid()
    key = runs * cells_per_run(cells)
    if status[i] <= FROZEN:
        key = cell_of(cells, position[i]) + i // cells.points_per_run * cells_per_run(cells)
    cell[i] = key
    rank[i] = wp.atomic_add(count, key, 1)


@wp.kernel
def put_in_cells(
    cell: wp.array[int],
    rank: wp.array[int],
    start: wp.array[int],
    position: wp.array[wp.vec4],
    x: wp.array[float],  # out
    y: wp.array[float],  # out
    z: wp.array[float],  # out
    number: wp.array[int],  # out
):
    i = wp.tid()
    here = position[i]
    k = start[cell[i]] + rank[i]
    x[k] = here[0]
    y[k] = here[1]
    z[k] = here[2]
    number[k] = i


@wp.kernel
def number_points(
    number: wp.array[int],  # out
):
    i = wp.tid()
    number[i] = i


@wp.kernel
def gather(
    number: wp.array[int],
    position: wp.array[wp.vec4],
    x: wp.array[float],  # out
    y: wp.array[float],  # out
    z: wp.array[float],  # out
):
    k = wp.tid()
    here = position[number[k]]
    x[k] = here[0]
    y[k] = here[1]
    z[k] = here[2]


@wp.func
def beside(x: float, corner: float, size: float, cell: int, at: int):
    """Least distance along an axis, over ``size``, from ``x`` in ``cell`` to a point of the cell ``at``."""
    part = (x - corner) / size - float(cell)
    if at < cell:
        return wp.max(part, 0.0)
    if at > cell:
        return wp.max(1.0 - part, 0.0)
    return 0.0


@wp.func
def sixteens(entries: int):
    return (entries + 15) // 16


@wp.func
def window_of(near: Neighbours, row: int):
    """Window in which a row's list of fluid begins, behind the lists of the row before, which was listed last."""
    if near.packed == 0:
        return row
    if row % BLOCK == 0:
        return row // BLOCK * near.room
    return near.wall_at[row - 1] + sixteens(near.wall_count[row - 1])


def neighbour_kernels(loops: ModuleType, module: Any) -> Any:
    """The kernel ``list_neighbours`` with the inner loop of ``loops``."""
    collect, pad, move_up = loops.collect, loops.pad, loops.move_up

    @wp.func(module=module)
    def close(listed: wp.array2d[int], at: int, most: int, found: int, dummy: int):
        """Pad a list; returns how many of the entries found it holds."""
        kept = wp.min(found, most)
        pad(listed, at, kept, dummy)
        return kept

    @wp.kernel(enable_backward=False, module=module)
    def list_neighbours(
        begin: int,
        movers: Movers,
        cells: CellArrays,
        wall_cells: CellArrays,
        fluid_full: int,
        walls_full: int,
        position: wp.array[wp.vec4],
        near: Neighbours,  # out
        fault: wp.array[int],  # in, out
    ):
        """List the fluid and the wall particles nearer than a cell's size, the particle itself apart.

        The cells of both are the same; a list that is too short sets ``fault``.
        """
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        here = position[i]
        reach = cells.size
        a = cell_along(here[0], cells.corner[0], reach, cells.count[0])
        b = cell_along(here[1], cells.corner[1], reach, cells.count[1])
        c = cell_along(here[2], cells.corner[2], reach, cells.count[2])
        before = beside(here[0], cells.corner[0], reach, a, a - 1)
        after = beside(here[0], cells.corner[0], reach, a, a + 1)
        base = i // cells.points_per_run * cells_per_run(cells)
        at = window_of(near, row)
        aside = row
        most = near.fluid.shape[1]
        if near.packed == 1:
            aside = (row // BLOCK + 1) * near.room - ASIDE
            most = wp.min(most, 16 * (aside - at))
        found = int(0)
        walls = int(0)
        for cc in range(wp.max(c - 1, 0), wp.min(c + 2, cells.count[2])):
            above = beside(here[2], cells.corner[2], reach, c, cc)
            for bb in range(wp.max(b - 1, 0), wp.min(b + 2, cells.count[1])):
                sideways = beside(here[1], cells.corner[1], reach, b, bb)
                left = NEARLY_ONE - above * above - sideways * sideways
                if left >= 0.0:
                    a_low = a
                    a_high = a
                    if a > 0 and before * before <= left:
                        a_low = a - 1
                    if a < cells.count[0] - 1 and after * after <= left:
                        a_high = a + 1
                    low = cells.count[0] * (bb + cells.count[1] * cc) + a_low
                    high = low + a_high - a_low + 1
                    found = collect(
                        cells.x,
                        cells.y,
                        cells.z,
                        cells.number,
                        cells.start[base + low],
                        cells.start[base + high],
                        here,
                        reach,
                        i,
                        near.fluid,
                        at,
                        most,
                        found,
                    )
                    if wall_cells.start[low] < wall_cells.start[high]:
                        walls = collect(
                            wall_cells.x,
                            wall_cells.y,
                            wall_cells.z,
                            wall_cells.number,
                            wall_cells.start[low],
                            wall_cells.start[high],
                            here,
                            reach,
                            -1,
                            near.wall,
                            aside,
                            near.wall.shape[1],
                            walls,
                        )
        kept = close(near.fluid, at, most, found, position.shape[0])
        kept_walls = close(near.wall, aside, near.wall.shape[1], walls, near.wall_particle.shape[0])
        wall_at = aside
        if near.packed == 1:
            wall_at = at + sixteens(kept)
            if kept < wp.min(found, near.fluid.shape[1]) or 16 * (aside - wall_at) < kept_walls:
                near.lacking[0] = 1
                kept_walls = 0
            move_up(near.wall, aside, wall_at, kept_walls)
        near.fluid_at[row] = at
        near.fluid_count[row] = kept
        near.wall_at[row] = wall_at
        near.wall_count[row] = kept_walls
        if found > near.fluid.shape[1]:
            fault[i] = fault[i] | fluid_full
        if walls > near.wall.shape[1]:
            fault[i] = fault[i] | walls_full

    return list_neighbours


@wp.kernel
def wake(
    begin: int,
    movers: Movers,
    particles: Particles,
    yields: wp.array[float],
    fast: float,
    restless_s: float,
    near: Neighbours,
    drag: wp.array[float],
    held: wp.array[float],
    quiet_s: wp.array[float],  # in, out
):
    """Wake the sleeping neighbours of a particle that is fast, or was above its yield stress for ``restless_s``.

    Several threads may write to one of them; all write the same.
    """
    row = begin + wp.tid()
    if row >= movers.count[0]:
        return
    # Most particles have no neighbour at rest: walls alone hold them.
    if held[row] == drag[row]:
        return
    i = movers.particle[row]
    if yields[i // particles.per_run] == 0.0:
        return
    if wp.length(particles.velocity[i]) > fast or quiet_s[i] < -restless_s:
        for slot in range(near.fluid_count[row]):
            j = near.fluid[near.fluid_at[row], slot]
            if particles.status[j] == ASLEEP:
                particles.status[j] = MOVING
                quiet_s[j] = 0.0
