"""Sort points into cells for the neighbour search: the fluid's points in each substep, the walls' points once."""

from functools import partial
from typing import Any

import numpy as np
import warp as wp
from warp.utils import array_scan

from sealtwin.core.records import Floats
from simulate.fluid.launcher import Launcher
from simulate.fluid.walk import Extent, fixed
from simulate.kernels import cells as device_code
from simulate.kernels import cells_cpu as in_order_code
from simulate.kernels.neighbours import BLOCK, Neighbours

NEIGHBOURS = 128  # Slots of a neighbour list, a multiple of 16. Fluid at rest fills 50, and 100 at twice its density.
WALL_NEIGHBOURS = 96  # Slots of a list of wall particles. A flat wall fills 13, a narrow corner three times as many.
ENTRIES = 70  # Initial size of packed lists, in entries per row. Fluid at rest fills 58 to 65, padding included.
MAX_ROOM = int(BLOCK) * (NEIGHBOURS + WALL_NEIGHBOURS) // 16
"""Number of entries of a block whose lists are full, divided by sixteen."""
SLICE_POINTS = 64  # The number of points in a slice is a multiple of this
SPARE = 16  # Extra entries at the end, since a loop reads sixteen points at a time


def neighbour_lists(rows: int, wall_particle: wp.array, device: str, *, packed: bool, lanes: int = 1) -> Any:
    """Return empty neighbour lists for up to ``rows`` moving particles.

    ``packed`` lists are for a CPU. On a GPU, ``lanes`` threads share a row.
    """
    lists = Neighbours()
    lists.room, lists.lanes = int(packed), lanes
    zeros = partial(wp.zeros, dtype=int, device=device)
    lists.lacking = zeros(1)
    lists.fluid_at = zeros(rows)
    lists.fluid_count = zeros(rows)
    lists.wall_at = zeros(rows)
    lists.wall_count = zeros(rows)
    lists.wall_particle = wall_particle
    make_room(lists, ENTRIES * int(BLOCK) // 16)
    return lists


def make_room(lists: Any, room: int) -> None:
    """Replace the arrays of the lists by empty ones. In packed lists, a block then has 16 times ``room`` entries."""
    if lists.room:
        lists.room = room
    lists.lacking.zero_()
    lists.store, lists.fluid = pairs_of(lists, NEIGHBOURS, int)
    if lists.room:
        lists.wall = _windows(lists.store, (lists.fluid.shape[0], WALL_NEIGHBOURS), (16, 1))
    else:
        lists.wall_store, lists.wall = pairs_of(lists, WALL_NEIGHBOURS, int)


def pairs_of(lists: Any, slots: int, dtype: type) -> tuple[wp.array, wp.array]:
    """Return an array with a value for each entry of the lists, and a two-dimensional view of that array.

    Each row of the view is a window of ``slots`` values. In packed lists a window begins at every sixteenth entry. On a
    GPU each row of the lists has its own window. If threads share a row, the slots of a row are adjacent in memory.
    Otherwise equal slots of successive rows are adjacent.
    """
    rows, device = len(lists.fluid_count), lists.fluid_count.device
    if not lists.room:
        store = wp.zeros(slots * rows, dtype, device)
        return store, _windows(store, (rows, slots), (slots, 1) if lists.lanes > 1 else (1, rows))
    windows = -(-rows // int(BLOCK)) * lists.room
    # The last windows extend past the last block.
    store = wp.zeros(16 * windows + slots, dtype, device)
    return store, _windows(store, (windows, slots), (16, 1))


def _windows(store: wp.array, shape: tuple[int, int], steps: tuple[int, int]) -> wp.array:
    """Return windows on ``store``. They do not keep ``store`` alive.

    ``steps`` are the numbers of entries from one window to the next, and from one slot to the next.
    """
    size = wp.types.type_size_in_bytes(store.dtype)
    strides = steps[0] * size, steps[1] * size
    return wp.array(ptr=store.ptr, dtype=store.dtype, shape=shape, strides=strides, device=store.device)


class CellGrid:
    """Cells for ``runs`` clouds of points, each with the same number of points and its own box of cells.

    Points outside the box are in border cells. Points that are lost or not yet released (``status``) are in no cell.
    """

    def __init__(
        self,
        low: Floats,
        high: Floats,
        size: float,
        position: wp.array,
        status: wp.array,
        launcher: Launcher,
        runs: int = 1,
        in_order: bool | None = None,
        index: wp.array[int] | None = None,
        present: wp.array[int] | None = None,
    ) -> None:
        """Prepare the cells.

        ``in_order`` is True if the device processes one point after the other, as a CPU does. If None, this depends on
        the device. ``index`` and ``present`` are the arrays of ``State``. Default: all points, in their current order.
        """
        device, points = str(position.device), len(position)
        count = np.maximum(np.ceil((high - low) / size).astype(int), 1)
        in_all = runs * int(count.prod())
        self._in_order = device == "cpu" if in_order is None else in_order
        self.cells = cells = device_code.CellArrays()
        axis = np.argsort(count, kind="stable")
        cells.axis = wp.vec3i(*map(int, axis))
        cells.corner = wp.vec3(*low[axis])
        cells.size = size
        cells.count = wp.vec3i(*map(int, count[axis]))
        cells.points_per_run = points // runs
        # There is an additional cell for points that are in no cell, and one more boundary than cells.
        cells.start = wp.zeros(in_all + 2, int, device)
        cells.x, cells.y, cells.z = (wp.zeros(points + SPARE, float, device) for _ in range(3))
        cells.number = wp.zeros(points + SPARE, int, device)
        cell, rank = wp.zeros(points, int, device), wp.zeros(points, int, device)
        if self._in_order:
            self._present = wp.full(1, points, int, device) if present is None else present
            cloud = in_order_code.Points()
            cloud.runs, cloud.position, cloud.status, cloud.cell, cloud.rank = runs, position, status, cell, rank
            cloud.present = self._present
            cloud.index = wp.array(np.arange(points), int, device=device) if index is None else index
            bind, of_points = partial(launcher.bind, extent=Extent(self._present, SLICE_POINTS)), fixed(1, device)
            self._find_cells = bind(in_order_code.find_cells_of, cloud, cells)
            self._count = bind(in_order_code.count_in_order, cloud, cells, extent=of_points)
            self._fill = bind(in_order_code.fill_in_order, cloud, cells)
        else:
            self._sorting = sorting = device_code.Sorting()
            sorting.cell, sorting.rank = cell, rank
            sorting.count = wp.zeros(in_all + 2, int, device)
            sorting.number = wp.zeros(points, int, device)
            self._count = launcher.bind_first(device_code.count_in_cells, cells, position, status, sorting)
            self._bring_together = launcher.bind_first(device_code.bring_together, cells, sorting)
            self._put_in_order = launcher.bind_first(device_code.put_in_order, position, sorting, cells)

    def fill(self, count: int) -> None:
        """Sort the first ``count`` points into cells. Points of the same cell keep their order, on any device.

        On a CPU, points without a cell come last. On a GPU, the rest of the arrays is not changed.
        """
        if self._in_order:
            self._present.fill_(count)
            self._find_cells(count)
            self._count(1)
            self._fill(count)
            return
        self._sorting.count.zero_()
        self._count(count)
        array_scan(self._sorting.count, self.cells.start, inclusive=False)
        self._bring_together(count)
        self._put_in_order(count)
