"""Device code that lists the neighbours of a row: a search through the surrounding cells, for any device.

``listing_cpu`` has the same search for CPUs. Tests compare the two.
"""

import warp as wp

from simulate.kernels.cells import NEARLY_ONE, CellArrays, beside, cell_along, cells_per_run
from simulate.kernels.lanes import count_marks, lane, lanes
from simulate.kernels.neighbours import Neighbours
from simulate.kernels.status import Particles

wp.set_module_options({"enable_backward": False})

ROWS = wp.constant(1)  # Number of rows that are listed together


@wp.func
def collect(cells: CellArrays, run: int, position: wp.vec4, self: int, neighbours: wp.array2d[int], row: int):
    """List the points of a run that are closer to ``position`` than a cell's size, except ``self``.

    Returns the number of these points. Points that do not fit into the row's slots are only counted. The order is the
    same for any number of lanes.
    """
    reach = cells.size
    count = cells.count
    a = cell_along(position[cells.axis[0]], cells.corner[0], reach, count[0])
    b = cell_along(position[cells.axis[1]], cells.corner[1], reach, count[1])
    c = cell_along(position[cells.axis[2]], cells.corner[2], reach, count[2])
    base = run * cells_per_run(cells)
    total = int(0)
    for cc in range(wp.max(c - 1, 0), wp.min(c + 2, count[2])):
        above = beside(position[cells.axis[2]], cells.corner[2], reach, c, cc)
        for bb in range(wp.max(b - 1, 0), wp.min(b + 2, count[1])):
            aside = beside(position[cells.axis[1]], cells.corner[1], reach, b, bb)
            if above * above + aside * aside <= NEARLY_ONE:
                line = base + count[0] * (bb + count[1] * cc)
                low = cells.start[line + wp.max(a - 1, 0)]
                high = cells.start[line + wp.min(a + 2, count[0])]
                for first in range(low, high, lanes()):
                    k = first + lane()
                    is_near = int(0)
                    if k < high:
                        offset = wp.vec3(cells.x[k], cells.y[k], cells.z[k]) - position[:3]
                        if wp.length_sq(offset) < reach * reach and cells.number[k] != self:
                            is_near = 1
                    marks = count_marks(is_near)
                    slot = total + marks[0]
                    if is_near == 1 and slot < neighbours.shape[1]:
                        neighbours[row, slot] = cells.number[k]
                    total += marks[1]
    return total


@wp.func
def list_rows(
    first: int,
    last: int,
    particles: Particles,
    cells: CellArrays,
    wall_cells: CellArrays,
    near: Neighbours,  # out. Counts include points without a slot
):
    """List the fluid and wall particles near the moving particles of some rows. Each row has its own window."""
    for row in range(first, last):
        i = particles.mover[row]
        position = particles.position[i]
        fluid = collect(cells, i // cells.points_per_run, position, i, near.fluid, row)
        wall = collect(wall_cells, 0, position, -1, near.wall, row)
        if lane() == 0:
            near.fluid_at[row] = row
            near.wall_at[row] = row
            near.fluid_count[row] = fluid
            near.wall_count[row] = wall
