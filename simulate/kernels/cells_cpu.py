"""The sort of ``cells`` for one thread of a CPU, as a counting sort that keeps the order of points.

It takes half the time of a sort by keys, or of the same steps as separate kernels.
"""

import warp as wp

from simulate.kernels.cells import CellArrays
from simulate.kernels.run_module import cpu_block, run_kernel
from simulate.kernels.status import FROZEN, Span

wp.set_module_options({"enable_backward": False})


@wp.struct
class Points:
    """The points of all runs, with the cell of each and its rank in the cell."""

    runs: int
    position: wp.array[wp.vec4]
    status: wp.array[int]
    cell: wp.array[int]
    rank: wp.array[int]


@wp.func_native(
    cpu_block(
        f"enum {{ FROZEN = {int(FROZEN)} }};",
        """
const int nx = cells.count[0], ny = cells.count[1], nz = cells.count[2], in_run = nx * ny * nz;
const int absent = points.runs * in_run;
const float size = cells.size, x0 = cells.corner[0], y0 = cells.corner[1], z0 = cells.corner[2];
// The arrays have no gaps; their pointers stay in registers.
const wp::vec4* position = points.position.data;
const int* status = points.status.data;
int *cell = points.cell.data, *rank = points.rank.data, *start = cells.start.data;
const auto along = [size](float x, float corner, int count) {
    const int whole = (int)__builtin_elementwise_floor((x - corner) / size);
    return whole < 0 ? 0 : whole < count ? whole : count - 1;
};
for (int c = 0; c < absent + 2; ++c) start[c] = 0;
for (int i = 0, base = 0, next = cells.points_per_run; i < count; ++i) {
    if (i == next) base += in_run, next += cells.points_per_run;
    int key = absent;
    if (status[i] <= FROZEN) {
        const wp::vec4 here = position[i];
        key = base + along(here[0], x0, nx) + nx * (along(here[1], y0, ny) + ny * along(here[2], z0, nz));
    }
    cell[i] = key;
    rank[i] = start[key]++;
}
for (int c = 0, before = 0; c < absent + 2; ++c) {
    const int here = start[c];
    start[c] = before;
    before += here;
}
float *x = cells.x.data, *y = cells.y.data, *z = cells.z.data;
int* number = cells.number.data;
for (int i = 0; i < count; ++i) {
    const wp::vec4 here = position[i];
    const int k = start[cell[i]] + rank[i];
    x[k] = here[0], y[k] = here[1], z[k] = here[2], number[k] = i;
}""",
    )
)
def sort_points(count: int, cells: CellArrays, points: Points): ...


@run_kernel
def sort_in_order(
    rows: Span,
    points: Points,  # out: cell and rank
    cells: CellArrays,  # out
):
    """Sort the first points in a launch of one thread. Within a cell they keep their order."""
    sort_points(rows.end, cells, points)
