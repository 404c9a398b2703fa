"""Volume between the walls of the solid and the surface of the settled sealant, summed over vertical lines."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sealtwin.core.arrays import counted_up, cross
from sealtwin.core.records import Booleans, Floats, Integers, Solid
from simulate.kernels.beds import Lines, Liquid, raise_surface
from simulate.kernels.status import Span

TURN = np.cos(np.radians(18.0)), np.sin(np.radians(18.0))
"""Cosine and sine of the angle by which the solid is rotated about the z axis."""
LEVELS = 200  # Number of levels between which the volume of a flat liquid is interpolated
ROUNDED = 1e-6  # Tolerance for the position of a cell's middle, in cells


class Vessel:
    """The solid as vertical lines through the middles of square cells, along which sealant is measured."""

    def __init__(self, solid: Solid, cell_mm: float) -> None:
        # The solid is rotated by 18 degrees, so that walls along an axis, or at 30, 45 or 60 degrees to it, are not
        # parallel to the cells. A slot of 3.1 mm parallel to them would be 7 or 8 cells of 0.4 mm wide instead of 7.75.
        triangle_mm = _turned(solid.vertices_mm)[solid.faces]
        low = np.floor(triangle_mm[:, :, :2].min(axis=(0, 1)) / cell_mm).astype(int)
        shape = np.floor(triangle_mm[:, :, :2].max(axis=(0, 1)) / cell_mm).astype(int) - low + 1
        cell, z_mm, upward = _crossings(triangle_mm, cell_mm, low, shape)
        order = np.lexsort((z_mm, cell))
        cell, self._z_mm, inside = cell[order], z_mm[order], upward[order]
        last = np.full(shape.prod(), -1)
        last[cell] = np.arange(len(order))
        self._ceiling_mm = np.full(len(order), np.inf)
        same_cell = cell[1:] == cell[:-1]
        self._ceiling_mm[:-1][same_cell] = self._z_mm[1:][same_cell]
        self._grid, self._last, self._cell, self._upward = (cell_mm, low, shape), last, cell, inside
        self._lines = self.lines_on("cpu")
        # In a slot 6 mm wide, cells of 0.5 mm have up to 0.3 % too little volume. Their area is therefore scaled so
        # that the empty cavity has its exact volume.
        lines_mm = float((np.minimum(self._ceiling_mm, 0.0)[inside] - np.minimum(self._z_mm, 0.0)[inside]).sum())
        has_cavity = lines_mm > 0 and solid.cavity_volume_mm3 > 0
        self.cell_mm2 = solid.cavity_volume_mm3 / lines_mm if has_cavity else cell_mm**2

    def volume_mm3(self, position_mm: Floats, half_mm: float) -> float:
        """Return the volume in mm3 below the surface of particles, (n, 3), whose liquid ends ``half_mm`` above them.

        The volume is summed over the free parts of the cells' vertical lines. A free part begins at a facet that faces
        up, and ends at the next facet that faces down, if there is one. It is filled from its lower end to the highest
        particle in it.
        """
        liquid = Liquid()
        liquid.top_mm = wp.full(len(self._z_mm), -np.inf, wp.float64, "cpu")
        liquid.position_mm = wp.array(_turned(position_mm), wp.vec3d, device="cpu")
        rows = Span()
        rows.end = rows.step = len(position_mm)
        inputs = [rows, 0, len(position_mm), half_mm, np.sqrt(2) * half_mm, self._lines, liquid]
        wp.launch(raise_surface, len(position_mm), inputs=inputs, device="cpu")
        reached_mm = liquid.top_mm.numpy()
        wet = np.isfinite(reached_mm)
        return float((np.minimum(reached_mm, self._ceiling_mm) - self._z_mm)[wet].sum()) * self.cell_mm2

    def flat_mm(self, volume_mm3: float) -> float | None:
        """Return the level of a flat liquid of this volume, relative to the face, in mm.

        Returns None if the liquid does not fit into the cavity.
        """
        foot_mm, ceiling_mm = self._z_mm[self._upward], self._ceiling_mm[self._upward]
        level_mm = np.linspace(foot_mm.min(), 0.0, LEVELS)
        held_mm = [(np.clip(level, foot_mm, ceiling_mm) - foot_mm).sum() for level in level_mm]
        height_mm = volume_mm3 / self.cell_mm2
        return float(np.interp(height_mm, held_mm, level_mm)) if height_mm < held_mm[-1] else None

    def lines_on(self, device: str) -> Any:
        """Return the vertical lines as arrays on a device."""
        cell_mm, low, shape = self._grid
        lines = Lines()
        lines.cell_mm, lines.low, lines.shape = cell_mm, wp.vec2i(*map(int, low)), wp.vec2i(*map(int, shape))
        lines.z_mm = wp.array(self._z_mm, wp.float64, device=device)
        lines.ceiling_mm = wp.array(self._ceiling_mm, wp.float64, device=device)
        lines.last = wp.array(self._last, int, device=device)
        lines.cell = wp.array(self._cell, int, device=device)
        lines.upward = wp.array(self._upward, int, device=device)
        return lines


@lru_cache(maxsize=2)
def vessel_of(solid: Solid, cell_mm: float) -> Vessel:
    """Return the vessel of a solid. The last two results are cached, because all runs of a study need the same two."""
    return Vessel(solid, cell_mm)


def _turned(point_mm: Floats) -> Floats:
    """Return the points, (..., 3), rotated about the z axis by 18 degrees."""
    cosine, sine = TURN
    return point_mm @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _crossings(
    triangle_mm: Floats, cell_mm: float, low: Integers, shape: Integers
) -> tuple[Integers, Floats, Booleans]:
    """Return the crossings of the cells' vertical lines with the facets, (n,) each: cell, height, and upward.

    ``upward`` is True for a facet that faces up.
    """
    a, b, c = triangle_mm.transpose(1, 0, 2)
    triangle_mm = triangle_mm[np.abs(cross(b - a, c - a)) >= 1e-12]
    # Cells are searched row by row along y, so that the cost of an oblique needle is proportional to its length.
    x_mm = triangle_mm[:, :, 0]
    owner, row = whole_numbers(*_cells_between(x_mm.min(axis=1), x_mm.max(axis=1), cell_mm, low[0], shape[0]))
    ends_mm = _stretch(triangle_mm[owner], (row + low[0] + 0.5) * cell_mm)
    which, column = whole_numbers(*_cells_between(*ends_mm, cell_mm, low[1], shape[1]))
    row, triangle_mm = row[which], triangle_mm[owner[which]]
    middle_mm = (np.column_stack([row, column]) + low + 0.5) * cell_mm
    hit = in_triangle(triangle_mm[:, :, :2].transpose(1, 0, 2), middle_mm)
    (a, b, c), middle_mm = triangle_mm[hit].transpose(1, 0, 2), middle_mm[hit]
    beside_mm, doubled_area = middle_mm - a[:, :2], cross(b - a, c - a)
    to_b, to_c = cross(beside_mm, c - a) / doubled_area, cross(b - a, beside_mm) / doubled_area
    height_mm = a[:, 2] + to_b * (b - a)[:, 2] + to_c * (c - a)[:, 2]
    return row[hit] * shape[1] + column[hit], height_mm, doubled_area > 0


def _stretch(triangle_mm: Floats, x_mm: Floats) -> tuple[Floats, Floats]:
    """Return the smallest and largest y of the line at ``x_mm`` inside each triangle, (n,) each."""
    x0, y0 = triangle_mm[:, :, 0], triangle_mm[:, :, 1]
    x1, y1 = np.roll(x0, -1, axis=1), np.roll(y0, -1, axis=1)
    x_mm = np.clip(x_mm, x0.min(axis=1), x0.max(axis=1))[:, np.newaxis]
    crosses = (np.minimum(x0, x1) <= x_mm) & (x_mm <= np.maximum(x0, x1)) & (x0 != x1)
    y_mm = y0 + (x_mm - x0) / np.where(crosses, x1 - x0, 1.0) * (y1 - y0)
    return np.where(crosses, y_mm, np.inf).min(axis=1), np.where(crosses, y_mm, -np.inf).max(axis=1)


def _cells_between(low_mm: Floats, high_mm: Floats, cell_mm: float, low: int, count: int) -> tuple[Integers, Integers]:
    """Return the first and last cell, counted from cell ``low``, whose middle is on each stretch along an axis.

    Middles at the ends of a stretch (within rounding) are included. Whether they belong to a facet is tested later.
    """
    first = np.ceil(low_mm / cell_mm - 0.5 - ROUNDED).astype(int) - low
    last = np.floor(high_mm / cell_mm - 0.5 + ROUNDED).astype(int) - low
    return np.maximum(first, 0), np.minimum(last, count - 1)


def whole_numbers(first: Integers, last: Integers) -> tuple[Integers, Integers]:
    """Return the range of each whole number, and the numbers of all ranges, one range after the other."""
    return counted_up(last - first + 1, first)


def in_triangle(corners: Sequence[Floats] | Floats, point: NDArray[np.floating]) -> Booleans:
    """Return the mask of points inside or on the edge of a triangle in the plane, (n,).

    No point is inside a triangle without area.
    """
    a, b, c = corners
    sign = np.sign(cross(b - a, c - a))
    beside = [sign * cross(n - m, point - m) >= 0 for m, n in ((a, b), (b, c), (c, a))]
    return (sign != 0) & np.logical_and.reduce(beside)
