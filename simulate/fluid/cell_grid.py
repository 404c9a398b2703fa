"""Points sorted into cells, for neighbour search: the fluid anew in each substep, the walls once."""

from typing import Any

import numpy as np
import warp as wp
from warp.utils import array_scan, radix_sort_pairs

from sealtwin.core.records import Floats
from simulate.fluid.launcher import Launcher
from simulate.kernels import neighbours as device_code

NEIGHBOURS = 128  # Slots of a list, a whole number of sixteens. Fluid at rest fills about 50, at twice its density 100.
WALL_NEIGHBOURS = 96  # Slots of a list. A flat wall fills about 13, a narrow corner three times that.
SPARE = 16  # Entries past the last one that a loop over sixteen points at a time may read


def neighbour_lists(rows: int, wall_particle: wp.array, device: str) -> Any:
    """Empty neighbour lists of at most ``rows`` movers."""
    lists = device_code.Neighbours()
    lists.fluid, lists.wall = (pairs_of(rows, slots, int, device) for slots in (NEIGHBOURS, WALL_NEIGHBOURS))
    lists.fluid_count, lists.wall_count = (wp.zeros(rows, dtype=int, device=device) for _ in range(2))
    lists.wall_particle = wall_particle
    return lists


def pairs_of(rows: int, slots: int, dtype: type, device: str) -> wp.array:
    """An array of a value for each pair, (rows, slots): a GPU reads one slot of many rows at once, a CPU a row."""
    if device == "cpu":
        return wp.zeros((rows, slots), dtype=dtype, device=device)
    return wp.zeros((slots, rows), dtype=dtype, device=device).transpose()


class CellGrid:
    """A box of cells for each of ``runs`` clouds of as many points; points beyond it belong to border cells.

    Points whose ``status`` says that they are gone, or not released yet, are left out.
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
    ) -> None:
        """``in_order`` says that the device takes one point after the other, as a CPU does; None asks the device."""
        device, points = str(position.device), len(position)
        count = np.maximum(np.ceil((high - low) / size).astype(int), 1)
        cells = runs * int(count.prod())
        self._in_order = device == "cpu" if in_order is None else in_order
        self._bits = cells.bit_length()  # Bits of a cell's number. To sort by all 32 would be twice the work.
        # One cell more for points left out, and one end more than cells.
        self._counts = wp.zeros(cells + 2, dtype=int, device=device)
        self._ends = wp.zeros(cells + 2, dtype=int, device=device)
        # A sort needs as much room again.
        room = points if self._in_order else 2 * points
        self._cell = wp.zeros(room, dtype=int, device=device)
        self._number = wp.zeros(room + SPARE, dtype=int, device=device)
        self._rank = wp.zeros(points, dtype=int, device=device) if self._in_order else self._number
        self.cells = device_code.CellArrays()
        self.cells.corner = wp.vec3(*low)
        self.cells.size = size
        self.cells.count = wp.vec3i(*map(int, count))
        self.cells.points_per_run = points // runs
        self.cells.start = self._ends
        self.cells.x, self.cells.y, self.cells.z = (
            wp.zeros(points + SPARE, dtype=float, device=device) for _ in range(3)
        )
        self.cells.number = self._number
        to = [self.cells.x, self.cells.y, self.cells.z]
        self._count = launcher.bind_first(
            device_code.count_in_cells, self.cells, runs, position, status, self._cell, self._rank, self._counts
        )
        self._put = launcher.bind_first(
            device_code.put_in_cells, self._cell, self._rank, self._ends, position, *to, self._number
        )
        self._number_all = launcher.bind_first(device_code.number_points, self._number)
        self._gather = launcher.bind_first(device_code.gather, self._number, position, *to)

    def fill(self, count: int) -> None:
        """Sort the first ``count`` points; the order within a cell is theirs, on any device."""
        self._counts.zero_()
        self._count(count)
        array_scan(self._counts, self._ends, inclusive=False)
        if self._in_order:
            # The rank of a point in its cell is its place in the sorted order: half the time of a sort.
            self._put(count)
        else:
            self._number_all(count)
            radix_sort_pairs(self._cell, self._number, count, end_bit=self._bits)
            self._gather(count)
