"""Area coverage of a ring on a grid: the share of each cell that the ring covers."""

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.records import Floats

ROWS_PER_PX = 8  # Sub-rows of a cell; with 8, edges are right to better than 0.01 of a cell


def coverage(ring: Floats, size_px: tuple[int, int]) -> NDArray[np.float32]:
    """Return the share of each pixel that is inside a ring, (height, width). OpenCV's fill would add half a pixel."""
    width, height = size_px
    start, end = ring, np.roll(ring, -1, axis=0)
    low, high = np.minimum(start[:, 1], end[:, 1]), np.maximum(start[:, 1], end[:, 1])
    # Sub-row r is sampled at y = (r + 0.5) / ROWS_PER_PX - 0.5.
    first = np.maximum(np.ceil((low + 0.5) * ROWS_PER_PX - 0.5), 0).astype(int)
    last = np.minimum(np.ceil((high + 0.5) * ROWS_PER_PX - 0.5), height * ROWS_PER_PX).astype(int)
    count = np.maximum(last - first, 0)
    edge = np.repeat(np.arange(len(ring)), count)
    row = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + first[edge]
    y = (row + 0.5) / ROWS_PER_PX - 0.5
    (x0, y0), (x1, y1) = start[edge].T, end[edge].T
    x = np.clip(x0 + (y - y0) * (x1 - x0) / (y1 - y0) + 0.5, 0, width)
    sign = np.sign(y1 - y0) / ROWS_PER_PX
    column = np.floor(x).astype(int)
    steps = np.zeros((height, width + 2), dtype=np.float64)
    np.add.at(steps, (row // ROWS_PER_PX, column), sign * (column + 1 - x))
    np.add.at(steps, (row // ROWS_PER_PX, column + 1), sign * (x - column))
    return np.abs(np.cumsum(steps, axis=1)[:, :width]).astype(np.float32)
