"""Heights of a scanned surface above a plane, as the median of the points in square cells."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from sealtwin.core.arrays import Booleans, Floats

MAD = 1.4826  # Standard deviation of a normal distribution, in median distances from its median
STRAY = 6.0  # Distance of a stray cell from the median of its neighbours, in standard deviations of this distance
ALIKE_MM, FEWEST_ALIKE = 0.2, 2  # A cell with two neighbours within this height, or within ``STRAY``, is no stray
AROUND = [(row, column) for row in range(3) for column in range(3) if (row, column) != (1, 1)]
SUBPIXEL_BITS = 6


@dataclass(frozen=True)
class HeightMap:
    """Heights in square cells, rows along y. A cell without points is NaN."""

    corner_mm: Floats  # Lower left corner of the first cell, (2,)
    cell_mm: float
    height_mm: Floats  # (rows, columns)

    @classmethod
    def of(cls, points_mm: Floats, low_mm: Floats, high_mm: Floats, cell_mm: float) -> "HeightMap":
        """Return the median height of the points in each cell of a box, (2,) each. Stray cells are left out."""
        columns, rows = np.maximum(np.ceil((high_mm - low_mm) / cell_mm), 1).astype(int).tolist()
        column_row = np.floor((points_mm[:, :2] - low_mm) / cell_mm).astype(np.int64)
        inside = ((column_row >= 0) & (column_row < [columns, rows])).all(axis=1)
        cell, height_mm = column_row[inside, 1] * columns + column_row[inside, 0], points_mm[inside, 2]
        order = np.lexsort((height_mm, cell))
        cell, height_mm = cell[order], height_mm[order]
        first = np.flatnonzero(np.diff(cell, prepend=-1))
        count = np.diff(np.append(first, len(cell)))
        heights = np.full(rows * columns, np.nan)
        heights[cell[first]] = (height_mm[first + (count - 1) // 2] + height_mm[first + count // 2]) / 2
        whole = cls(np.asarray(low_mm, dtype=float), cell_mm, heights.reshape(rows, columns))
        return whole.without_strays()

    def without_strays(self) -> "HeightMap":
        """Return the map without cells far from the median of the 25 cells around them, and from their neighbours.

        A narrow crack is far from the median, but its cells are like their neighbours along the crack.
        """
        known = np.isfinite(self.height_mm)
        if not known.any():
            return self
        filled = self.filled().astype(np.float32)
        away_mm = np.abs(self.height_mm - cv2.medianBlur(filled, 5))
        limit_mm = STRAY * MAD * max(float(np.nanmedian(away_mm)), 1e-4)
        rows, columns = self.height_mm.shape
        padded = np.pad(self.height_mm, 1, constant_values=np.nan)
        alike = np.zeros((rows, columns), dtype=int)
        for row, column in AROUND:
            beside_mm = padded[row : row + rows, column : column + columns]
            alike += np.abs(beside_mm - self.height_mm) < max(limit_mm, ALIKE_MM)
        stray = (away_mm > limit_mm) & (alike < FEWEST_ALIKE)
        return HeightMap(self.corner_mm, self.cell_mm, np.where(stray, np.nan, self.height_mm))

    def filled(self) -> Floats:
        """Return the heights, each missing one replaced by the nearest known one, (rows, columns)."""
        missing = np.isnan(self.height_mm)
        nearest = distance_transform_edt(missing, return_distances=False, return_indices=True)
        return self.height_mm[tuple(np.asarray(nearest))]

    @property
    def middles_mm(self) -> tuple[Floats, Floats]:
        """X of the columns' and y of the rows' middles, (columns,) and (rows,)."""
        rows, columns = self.height_mm.shape
        return (
            self.corner_mm[0] + self.cell_mm * (np.arange(columns) + 0.5),
            self.corner_mm[1] + self.cell_mm * (np.arange(rows) + 0.5),
        )

    @property
    def known(self) -> Booleans:
        return np.isfinite(self.height_mm)

    def inside(self, rings_mm: Sequence[Floats]) -> Booleans:
        """Return which cells have their middle inside a region, (rows, columns). Inner rings are holes."""
        mask = np.zeros(self.height_mm.shape, np.uint8)
        scale = 2**SUBPIXEL_BITS / self.cell_mm
        rings = [np.rint((ring - self.corner_mm) * scale - 2**SUBPIXEL_BITS / 2).astype(np.int32) for ring in rings_mm]
        cv2.fillPoly(mask, rings, 1, shift=SUBPIXEL_BITS)
        return mask.astype(bool)

    def away_mm(self, inside: Booleans) -> Floats:
        """Return the distance of each cell from a region in mm: 0 inside, (rows, columns)."""
        return self.cell_mm * np.asarray(distance_transform_edt(~inside), dtype=float)

    def at_mm(self, x_mm: Floats, y_mm: Floats) -> Floats:
        """Return the height of the cell at each point, NaN outside the map or in a hole. All arrays have one shape."""
        column = np.floor((x_mm - self.corner_mm[0]) / self.cell_mm).astype(int)
        row = np.floor((y_mm - self.corner_mm[1]) / self.cell_mm).astype(int)
        rows, columns = self.height_mm.shape
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        heights = self.height_mm[np.where(inside, row, 0), np.where(inside, column, 0)]
        return np.where(inside, heights, np.nan)
