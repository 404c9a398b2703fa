"""Device code that sorts points into cells on a GPU. ``cells_cpu`` does the same on one thread of a CPU."""

import warp as wp

from simulate.kernels.status import FROZEN

wp.set_module_options({"enable_backward": False})

NEARLY_ONE = wp.constant(1.0001)  # Squared distance, in cells, up to which lines of cells are searched. 1 plus rounding


@wp.struct
class CellArrays:
    """Points sorted by cell. Cells are numbered along the shortest side of the box first.

    The points of three adjacent cells along that side are consecutive. In a long crack, points are therefore sorted
    along the crack, and most neighbours of consecutive points are close to them in memory. Each run has its own cells.
    The walls have one set of cells for all runs.
    """

    axis: wp.vec3i  # Axes from the shortest side of the box to the longest. ``corner`` and ``count`` have this order
    corner: wp.vec3
    size: float
    count: wp.vec3i
    points_per_run: int  # Number of points of each run. The points are stored run by run
    start: wp.array[int]
    x: wp.array[float]
    y: wp.array[float]
    z: wp.array[float]
    number: wp.array[int]


@wp.struct
class Sorting:
    """Arrays for sorting by cell on a GPU."""

    cell: wp.array[int]  # Cell of each point
    rank: wp.array[int]  # Number of points of the same cell that were counted before each point
    count: wp.array[int]  # Number of points of each cell
    number: wp.array[int]  # Points sorted by cell, in arbitrary order within a cell


@wp.func
def cells_per_run(cells: CellArrays):
    return cells.count[0] * cells.count[1] * cells.count[2]


@wp.func
def cell_along(x: float, corner: float, size: float, count: int):
    """Return the cell index along an axis.

    Points outside the grid are in border cells, so that neighbours are in adjacent cells.
    """
    return wp.clamp(int(wp.floor((x - corner) / size)), 0, count - 1)


@wp.kernel
def count_in_cells(
    cells: CellArrays,
    position: wp.array[wp.vec4],
    status: wp.array[int],
    sorting: Sorting,  # out: cell, rank and count
):
    """Find the cell of each point, and count the points of each cell. A point without a cell gets -1."""
    i = wp.tid()
    sorting.cell[i] = -1
    if status[i] <= FROZEN:
        x = position[i]
        a = cell_along(x[cells.axis[0]], cells.corner[0], cells.size, cells.count[0])
        b = cell_along(x[cells.axis[1]], cells.corner[1], cells.size, cells.count[1])
        c = cell_along(x[cells.axis[2]], cells.corner[2], cells.size, cells.count[2])
        key = i // cells.points_per_run * cells_per_run(cells) + a + cells.count[0] * (b + cells.count[1] * c)
        sorting.cell[i] = key
        sorting.rank[i] = wp.atomic_add(sorting.count, key, 1)


@wp.kernel
def bring_together(
    cells: CellArrays,
    sorting: Sorting,  # out: number
):
    """Write the points of each cell next to each other, in arbitrary order."""
    i = wp.tid()
    key = sorting.cell[i]
    if key >= 0:
        sorting.number[cells.start[key] + sorting.rank[i]] = i


@wp.kernel
def put_in_order(
    position: wp.array[wp.vec4],
    sorting: Sorting,
    cells: CellArrays,  # out: x, y, z and number
):
    """Sort the points within each cell by their number."""
    i = wp.tid()
    key = sorting.cell[i]
    if key < 0:
        return
    slot = cells.start[key]
    for k in range(cells.start[key], cells.start[key + 1]):
        if sorting.number[k] < i:
            slot += 1
    point = position[i]
    cells.x[slot] = point[0]
    cells.y[slot] = point[1]
    cells.z[slot] = point[2]
    cells.number[slot] = i


@wp.func
def beside(x: float, corner: float, size: float, cell: int, other_cell: int):
    """Return the shortest distance along an axis from ``x``, which is in ``cell``, to ``other_cell``.

    The distance is divided by ``size``.
    """
    part = (x - corner) / size - float(cell)
    if other_cell < cell:
        return wp.max(part, 0.0)
    if other_cell > cell:
        return wp.max(1.0 - part, 0.0)
    return 0.0
