"""Points sorted into cells, for neighbour search: the fluid anew in each substep, the walls once."""

import numpy as np
import warp as wp
from warp.utils import array_scan, radix_sort_pairs

from sealtwin.records import Floats
from simulate import kernels


class CellGrid:
    """A box of cells with room for ``capacity`` points; points beyond the box count to its border cells."""

    def __init__(self, low: Floats, high: Floats, size: float, capacity: int, device: str) -> None:
        count = np.maximum(np.ceil((high - low) / size).astype(int), 1)
        cells = int(count.prod())
        self._device = device
        # One cell more for points left out, and one end more than cells.
        self._counts = wp.zeros(cells + 2, dtype=int, device=device)
        self._ends = wp.zeros(cells + 2, dtype=int, device=device)
        # The sort needs as much room again.
        self._cell = wp.zeros(2 * capacity, dtype=int, device=device)
        self._number = wp.zeros(2 * capacity, dtype=int, device=device)
        self.cells = kernels.Cells()
        self.cells.corner = wp.vec3(*low)
        self.cells.size = size
        self.cells.count = wp.vec3i(*map(int, count))
        self.cells.start = self._ends
        self.cells.point = wp.zeros(capacity, dtype=wp.vec3, device=device)
        self.cells.number = self._number

    def fill(self, point: wp.array, fate: wp.array, count: int) -> None:
        """Sort the first ``count`` points; the order within a cell is theirs, on any device."""
        self._counts.zero_()
        wp.launch(
            kernels.count_in_cells,
            count,
            inputs=[self.cells, point, fate, self._cell, self._number, self._counts],
            device=self._device,
        )
        array_scan(self._counts, self._ends, inclusive=False)
        radix_sort_pairs(self._cell, self._number, count)
        wp.launch(kernels.gather, count, inputs=[self._number, point, self.cells.point], device=self._device)
