"""Device code that sorts points into cells; ``cells_cpu`` does it in one launch, by one thread of a CPU."""

import warp as wp

from simulate.kernels.status import FROZEN

wp.set_module_options({"enable_backward": False})

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
    number: wp.array[int],  # out: of the points, in their order
    count: wp.array[int],  # out
):
    """Cell of each point, one past the last for points that are absent, and the number of points of each cell."""
    i = wp.tid()
    key = runs * cells_per_run(cells)
    if status[i] <= FROZEN:
        key = cell_of(cells, position[i]) + i // cells.points_per_run * cells_per_run(cells)
    cell[i] = key
    number[i] = i
    wp.atomic_add(count, key, 1)


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
