"""Heights of a scanned surface above a plane, as the median of the points in square cells."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt
from skimage.measure import label

from sealtwin.core.arc_length import arc_length, at_arc_length
from sealtwin.core.arrays import Booleans, Floats, counted_up, unit

MAD = 1.4826  # Standard deviation of a normal distribution, in median distances from its median
STRAY = 6.0  # Distance of a stray cell from the median of its neighbours, in standard deviations of this distance
LEAST_MM, FEWEST_BESIDE = 0.2, 2  # Smallest distance of a stray cell; neighbours on its side that save a cell
AROUND = [(row, column) for row in range(3) for column in range(3) if (row, column) != (1, 1)]
MOST_COLUMNS = 1500  # Largest number of columns of a grid along a crack


def grid_along(centreline_mm: Floats, half_mm: float, cell_mm: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return a grid along a crack: s, distances to the left of the centreline, and x and y, (k,), (m,) and (m, k)."""
    points_s_mm = arc_length(centreline_mm)
    length_mm = float(points_s_mm[-1])
    s_mm = np.arange(0.0, length_mm, max(cell_mm, length_mm / MOST_COLUMNS))
    across_mm = np.linspace(-half_mm, half_mm, max(int(2 * half_mm / cell_mm), 8))
    ahead = unit(np.gradient(centreline_mm, axis=0))
    middle_mm, way = (at_arc_length(points, points_s_mm, s_mm) for points in (centreline_mm, ahead))
    x_mm = middle_mm[:, 0] - across_mm[:, None] * way[:, 1]
    return s_mm, across_mm, x_mm, middle_mm[:, 1] + across_mm[:, None] * way[:, 0]


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
        index = np.floor((points_mm[:, :2] - low_mm) / cell_mm).astype(np.int64)
        inside = ((index >= 0) & (index < [columns, rows])).all(axis=1)
        cell, height_mm = index[inside, 1] * columns + index[inside, 0], points_mm[inside, 2]
        order = np.lexsort((height_mm, cell))
        cell, height_mm = cell[order], height_mm[order]
        first = np.flatnonzero(np.diff(cell, prepend=-1))
        count = np.diff(np.append(first, len(cell)))
        heights = np.full(rows * columns, np.nan)
        heights[cell[first]] = (height_mm[first + (count - 1) // 2] + height_mm[first + count // 2]) / 2
        return cls(np.asarray(low_mm, dtype=float), cell_mm, heights.reshape(rows, columns)).without_strays()

    def without_strays(self) -> "HeightMap":
        """Return the map without cells far from the median of the 25 cells around them that stick out.

        A narrow crack or a steep wall is far from the median, but its cells lie between their neighbours.
        """
        if not self.known.any():
            return self
        away_mm = np.abs(self.height_mm - cv2.medianBlur(self.filled().astype(np.float32), 5))
        limit_mm = max(STRAY * MAD * float(np.nanmedian(away_mm)), LEAST_MM)
        rows, columns = self.height_mm.shape
        padded = np.pad(self.height_mm, 1, constant_values=np.nan)
        around_mm = np.stack([padded[row : row + rows, column : column + columns] for row, column in AROUND])
        not_lower = np.sum(around_mm > self.height_mm - limit_mm, axis=0)
        not_higher = np.sum(around_mm < self.height_mm + limit_mm, axis=0)
        stray = (away_mm > limit_mm) & (np.minimum(not_lower, not_higher) < FEWEST_BESIDE)
        return HeightMap(self.corner_mm, self.cell_mm, np.where(stray, np.nan, self.height_mm))

    def patches(self, region: Booleans, step_mm: float, area_mm2: float) -> Booleans:
        """Return the cells of a region in small patches, which a step separates from the rest of it, (rows, columns).

        Such patches are dirt, bubbles, or strays side by side. Speckles and missing cells make no step.
        """
        height_mm = cv2.medianBlur(self.filled().astype(np.float32), 3)
        # Links between cells lie between them in a grid of twice the size.
        linked = np.zeros(2 * np.array(region.shape) - 1, dtype=bool)
        linked[::2, ::2] = region
        for link, lower, upper in (
            (np.s_[1::2, ::2], np.s_[1:], np.s_[:-1]),
            (np.s_[::2, 1::2], np.s_[:, 1:], np.s_[:, :-1]),
        ):
            linked[link] = region[lower] & region[upper] & (np.abs(height_mm[lower] - height_mm[upper]) <= step_mm)
        patch = np.asarray(label(linked, connectivity=1))[::2, ::2]
        return region & (np.bincount(patch.ravel())[patch] * self.cell_mm**2 < area_mm2)

    def filled(self, cells: float = np.inf) -> Floats:
        """Return the heights, (rows, columns). A missing one up to ``cells`` from a known one gets its height."""
        answer: Any = distance_transform_edt(np.isnan(self.height_mm), return_indices=True)
        away, nearest = answer
        return np.where(np.asarray(away) <= cells, self.height_mm[tuple(np.asarray(nearest))], np.nan)

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
        rows, columns = self.height_mm.shape
        crossings = np.zeros((rows, columns + 1), dtype=np.int64)
        for ring in rings_mm:
            start = (ring - self.corner_mm) / self.cell_mm - 0.5
            step = np.roll(start, -1, axis=0) - start
            ends = np.ceil(np.stack([start[:, 1], start[:, 1] + step[:, 1]])).astype(int)
            low, high = ends.min(axis=0), ends.max(axis=0)
            edge, row = counted_up(high - low, low)
            column = np.ceil(start[edge, 0] + (row - start[edge, 1]) / step[edge, 1] * step[edge, 0])
            used = (row >= 0) & (row < rows)
            np.add.at(crossings, (row[used], column[used].clip(0, columns).astype(int)), 1)
        return np.cumsum(crossings, axis=1)[:, :-1] % 2 == 1

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
