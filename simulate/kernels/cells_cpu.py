"""Sort points into cells on a CPU, as ``cells`` does on a GPU, with a counting sort that keeps the order of points.

One thread counts. This takes half the time of a sort by keys.
"""

import warp as wp

from simulate.kernels.cells import CellArrays
from simulate.kernels.run_module import cpu_block, run_kernel
from simulate.kernels.status import FROZEN, Span

wp.set_module_options({"enable_backward": False})


@wp.struct
class Points:
    """Points of all runs, and their cells."""

    runs: int
    position: wp.array[wp.vec4]
    status: wp.array[int]
    index: wp.array[int]
    """Indices of the points in memory. The points of a cell are in the order of this array."""
    present: wp.array[int]  # A single value: the number of points, counted from the first, that are sorted
    cell: wp.array[int]
    rank: wp.array[int]  # Number of points of the same cell before each point


@wp.func_native(
    cpu_block(
        f"enum {{ FROZEN = {int(FROZEN)} }};",
        """
const int nx = cells.count[0], ny = cells.count[1], nz = cells.count[2], in_run = nx * ny * nz;
const int absent = points.runs * in_run;
const int fast = cells.axis[0], middle = cells.axis[1], slow = cells.axis[2];
const float size = cells.size, x0 = cells.corner[0], y0 = cells.corner[1], z0 = cells.corner[2];
// The arrays have no gaps; their pointers stay in registers.
const wp::vec4* position = points.position.data;
const int* status = points.status.data;
int* cell = points.cell.data;
const auto along = [size](float x, float corner, int count) {
    const int whole = (int)__builtin_elementwise_floor((x - corner) / size);
    return whole < 0 ? 0 : whole < count ? whole : count - 1;
};
for (int i = begin; i < end; ++i) {
    cell[i] = absent;
    if (status[i] <= FROZEN) {
        const wp::vec4 point = position[i];
        const int base = i / cells.points_per_run * in_run;
        const int line = along(point[middle], y0, ny) + ny * along(point[slow], z0, nz);
        cell[i] = base + along(point[fast], x0, nx) + nx * line;
    }
}""",
    )
)
def find_cells(begin: int, end: int, cells: CellArrays, points: Points): ...


@wp.func_native(
    cpu_block(
        """
const int *cell = points.cell.data, *index = points.index.data, count = points.present.data[0];
const int cells_of_all = cells.start.shape[0] - 1;
int *rank = points.rank.data, *start = cells.start.data, before = 0;
__builtin_memset(start, 0, cells_of_all * sizeof(int));
for (int k = 0; k < count; ++k) rank[index[k]] = start[cell[index[k]]]++;
for (int c = 0; c < cells_of_all; ++c) {
    const int in_cell = start[c];
    start[c] = before;
    before += in_cell;
}
start[cells_of_all] = before;""",
    )
)
def count_in_cells(cells: CellArrays, points: Points): ...


@wp.func_native(
    cpu_block(
        """
const wp::vec4* position = points.position.data;
const int *cell = points.cell.data, *rank = points.rank.data, *start = cells.start.data;
float *x = cells.x.data, *y = cells.y.data, *z = cells.z.data;
int* number = cells.number.data;
for (int i = begin; i < end; ++i) {
    const int to = start[cell[i]] + rank[i];
    const wp::vec4 point = position[i];
    x[to] = point[0], y[to] = point[1], z[to] = point[2], number[to] = i;
}""",
    )
)
def fill_cells(begin: int, end: int, cells: CellArrays, points: Points): ...


@run_kernel
def find_cells_of(
    rows: Span,
    points: Points,  # out: cell
    cells: CellArrays,
):
    """Find the cell of each point. Points that are left out are in an additional cell after the cells of all runs."""
    find_cells(rows.begin, rows.end, cells, points)


@run_kernel
def count_in_order(
    rows: Span,  # A single row
    points: Points,  # out: rank
    cells: CellArrays,  # out: start
):
    """Count the points of all cells. Points of a cell keep their order."""
    count_in_cells(cells, points)


@run_kernel
def fill_in_order(
    rows: Span,
    points: Points,
    cells: CellArrays,  # out: x, y, z and number
):
    """Write each point to its position in the sorted arrays."""
    fill_cells(rows.begin, rows.end, cells, points)
