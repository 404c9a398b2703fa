"""Device code of the neighbour search: points sorted into cells, and a list for each particle that moves."""

from types import ModuleType
from typing import Any

import warp as wp

from simulate.kernels.status import FROZEN, Movers

wp.set_module_options({"enable_backward": False})

SIXTEEN = wp.constant(16)  # Lists are padded to whole sixteens with a dummy point (``pair_sums_cpu``)


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
    """Lists of the fluid and wall particles near each mover, by row."""

    fluid: wp.array2d[int]
    fluid_count: wp.array[int]
    wall: wp.array2d[int]
    wall_count: wp.array[int]
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


def neighbour_kernels(loops: ModuleType, module: Any) -> Any:
    """The kernel ``list_neighbours`` with the inner loop of ``loops``."""
    collect = loops.collect

    @wp.kernel(enable_backward=False, module=module)
    def list_neighbours(
        begin: int,
        movers: Movers,
        cells: CellArrays,
        of_the_fluid: int,
        reach: float,
        full: int,
        dummy: int,
        position: wp.array[wp.vec4],
        listed: wp.array2d[int],  # out
        count: wp.array[int],  # out
        fault: wp.array[int],  # in, out
    ):
        """List the points nearer than ``reach``, except the particle itself; too short a list sets ``fault``."""
        row = begin + wp.tid()
        if row >= movers.count[0]:
            return
        i = movers.particle[row]
        here = position[i]
        a = cell_along(here[0], cells.corner[0], cells.size, cells.count[0])
        b = cell_along(here[1], cells.corner[1], cells.size, cells.count[1])
        c = cell_along(here[2], cells.corner[2], cells.size, cells.count[2])
        a_low = wp.max(a - 1, 0)
        a_high = wp.min(a + 1, cells.count[0] - 1)
        base = int(0)
        self = int(-1)
        if of_the_fluid == 1:
            base = i // cells.points_per_run * cells_per_run(cells)
            self = i
        found = int(0)
        for cc in range(wp.max(c - 1, 0), wp.min(c + 2, cells.count[2])):
            for bb in range(wp.max(b - 1, 0), wp.min(b + 2, cells.count[1])):
                line = base + cells.count[0] * (bb + cells.count[1] * cc)
                found = collect(
                    cells.x,
                    cells.y,
                    cells.z,
                    cells.number,
                    cells.start[line + a_low],
                    cells.start[line + a_high + 1],
                    here,
                    reach,
                    self,
                    listed,
                    row,
                    found,
                )
        slots = listed.shape[1]
        if found > slots:
            fault[i] = fault[i] | full
            found = slots
        count[row] = found
        for slot in range(found, (found + SIXTEEN - 1) // SIXTEEN * SIXTEEN):
            listed[row, slot] = dummy

    return list_neighbours
