"""Points sorted into cells, for neighbour search: the fluid anew in each substep, the walls once."""

import numpy as np
import warp as wp
from warp.utils import array_scan, radix_sort_pairs

from sealtwin.records import Floats
from simulate import kernels_neighbours as device_code

SPARE = 16
"""Entries that a loop over sixteen points at a time may read past the last one."""


class CellGrid:
    """A box of cells for each of ``runs`` clouds of ``capacity`` points; points beyond it count to border cells."""

    def __init__(
        self,
        low: Floats,
        high: Floats,
        size: float,
        capacity: int,
        device: str,
        runs: int = 1,
        in_order: bool | None = None,
    ) -> None:
        """``in_order``: whether the device takes one point after the other; None is what it does."""
        count = np.maximum(np.ceil((high - low) / size).astype(int), 1)
        cells = runs * int(count.prod())
        points = runs * capacity
        self._device, self._runs = device, runs
        self._in_order = device == "cpu" if in_order is None else in_order
        self._bits = cells.bit_length()
        """Of a cell's number, the one more included. To sort by all 32 would be twice the work."""
        # One cell more for points left out, and one end more than cells.
        self._counts = wp.zeros(cells + 2, dtype=int, device=device)
        self._ends = wp.zeros(cells + 2, dtype=int, device=device)
        # A sort needs as much room again.
        room = points if self._in_order else 2 * points
        self._cell = wp.zeros(room, dtype=int, device=device)
        self._number = wp.zeros(room + SPARE, dtype=int, device=device)
        self._rank = wp.zeros(points, dtype=int, device=device) if self._in_order else self._number
        self.cells = device_code.Cells()
        self.cells.corner = wp.vec3(*low)
        self.cells.size = size
        self.cells.count = wp.vec3i(*map(int, count))
        self.cells.points_a_run = capacity
        self.cells.start = self._ends
        self.cells.x, self.cells.y, self.cells.z = (
            wp.zeros(points + SPARE, dtype=float, device=device) for _ in range(3)
        )
        self.cells.number = self._number

    def fill(self, place: wp.array, fate: wp.array, count: int) -> None:
        """Sort the first ``count`` points; the order within a cell is theirs, on any device."""
        cells = self.cells
        self._counts.zero_()
        wp.launch(
            device_code.count_in_cells,
            count,
            inputs=[cells, self._runs, place, fate, self._cell, self._rank, self._counts],
            device=self._device,
        )
        array_scan(self._counts, self._ends, inclusive=False)
        to = [cells.x, cells.y, cells.z]
        if self._in_order:
            # To know a point's rank is to have sorted it: half the time of a sort.
            wp.launch(
                device_code.put_in_cells,
                count,
                inputs=[self._cell, self._rank, self._ends, place, *to, self._number],
                device=self._device,
            )
        else:
            wp.launch(device_code.number_points, count, inputs=[self._number], device=self._device)
            radix_sort_pairs(self._cell, self._number, count, end_bit=self._bits)
            wp.launch(device_code.gather, count, inputs=[self._number, place, *to], device=self._device)
