"""Costs of a step on the search map, and paths of least cost."""

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.graph import MCP_Geometric, route_through_array

from digitise.crack_path.darkness import DarkMap
from digitise.crack_path.medial_axis import distance_outside, larger_pieces, radius
from digitise.image.raster import widened
from sealtwin.core.records import Floats, Integers

LEAST_VOTES = 11  # Least votes of a cell on a line: a hair of fewer cells gathers fewer
LONGEST_BRIDGE_PX = 20  # Cells that a line may run outside the region: a gap at a coarse grain or a stain
FAR_PX = 6.0  # Distance in cells from any line beyond which voters are a line that closes a loop
CLEAR = 8.0  # Noise units above which a clearer line is not cheaper; one strong grain must not pay for a detour
ASIDE = 2  # Largest distance in cells of a first path from the middle of a thin crack
NOTHING = 0.04  # Worth of a step off any line: a gap costs as much as a line 25 times as long
LEAST_DARKNESS = 0.2  # Least darkness of a wide crack against the mortar; stains and shadows have less

THIN_PX = 6.0  # Width in cells below which a crack is found by its shape as a line, above it by its darkness
WIDE_PX = 1.5 * THIN_PX  # Width in cells of a crack from which a path that looks thin runs along its wall
WIDEST = 80  # Percentile of the widths along a path taken for its wide part, which the map must show as dark
AROUND = np.argwhere(np.ones((3, 3))) - 1  # Steps to a cell's neighbours and to itself


def voted_lines(voters: NDArray[np.bool_], region: NDArray[np.bool_], cost: Floats) -> NDArray[np.bool_]:
    """Link the voters by lines of least cost, one cell wide. At most ``LONGEST_BRIDGE_PX`` are outside ``region``."""
    if not voters.any():
        return voters
    votes = _votes(voters, cost)
    lines = votes >= LEAST_VOTES
    lines &= ~larger_pieces(lines & ~widened(region, 3), LONGEST_BRIDGE_PX)
    return lines | larger_pieces(voters & (distance_outside(lines) > FAR_PX), LEAST_VOTES)


def _votes(voters: NDArray[np.bool_], cost: Floats) -> Integers:
    """Return for each cell the number of voters whose cheapest path to the root, the cheapest voter, crosses it."""
    cheapest = np.flatnonzero(voters & (cost == cost[voters].min()))
    # Many cost the same. The first would be the tip of the topmost line in the picture, which may be a hair.
    root = int(cheapest[len(cheapest) // 2])
    search = MCP_Geometric(cost)
    _, came_by = search.find_costs([np.unravel_index(root, cost.shape)])
    steps = np.array(search.offsets, dtype=np.int64) @ (cost.shape[1], 1)
    votes = np.zeros(cost.size, dtype=np.int64)
    place = np.flatnonzero(voters)
    place = place[came_by.ravel()[place] >= 0]
    carried = np.ones(len(place), dtype=np.int64)
    while len(place):
        votes[place] += carried
        moving = place != root
        place, merged = np.unique(place[moving] - steps[came_by.ravel()[place[moving]]], return_inverse=True)
        carried = np.bincount(merged, weights=carried[moving], minlength=len(place)).astype(np.int64)
    return votes.reshape(cost.shape)


def cost_of_thin(field: DarkMap, cells: Integers) -> Floats:
    """Cost of a step along a thin crack. It falls as clearness rises to that of ``cells``: the middle is cheapest."""
    clearest = cv2.dilate(field.ridge, np.ones((1 + 2 * ASIDE, 1 + 2 * ASIDE), np.uint8))
    clear = max(CLEAR, float(np.median(clearest[tuple(cells.T)]))) if len(cells) else CLEAR
    return np.where(field.allowed, 1 / (NOTHING + np.clip(field.ridge, 0, clear) / clear), np.inf)


def cost_of_wide(field: DarkMap) -> Floats:
    """Cost of a step along a wide crack. The darker and clearer a cell, the lower its cost."""
    strength = np.clip(field.ridge, 0, CLEAR) / CLEAR * field.dark / max(field.darkest, LEAST_DARKNESS)
    return np.where(field.allowed, 1 / (0.03 + np.minimum(strength, 1.5) ** 1.5), np.inf)


def cost_off_centre(field: DarkMap, cells: Integers, darkness: float) -> Floats:
    """Cost of a step along a wide crack of typical ``darkness``, least in the middle. ``cells`` run along the crack."""
    to_rim = _to_rim(field, darkness)
    usual = max(float(np.percentile(_from_middle(to_rim, cells), 75)), 1.0)
    return np.where(field.allowed, off_centre(to_rim, usual), np.inf)


def off_centre(to_rim: Floats, usual: float) -> Floats:
    """Cost of a step. It falls as the distance from the rim rises relative to the usual distance."""
    return 1 / (0.03 + np.minimum(to_rim / usual, 1.5) ** 2)


def cheapest(cost: Floats, start: Integers, end: Integers, margin: int) -> Integers:
    """Rows and columns, (n, 2), of the cheapest path. It stays within ``margin`` cells of the box around both ends."""
    low = np.maximum(np.minimum(start, end) - margin, 0)
    high = np.maximum(start, end) + margin + 1
    near = cost[low[0] : high[0], low[1] : high[1]]
    way, _ = route_through_array(near, start - low, end - low)
    return low + np.array(way, dtype=np.int64)


def along_middle(region: NDArray[np.bool_], ends: Floats) -> Integers:
    """Return the cells along the middle of a region, (n, 2).

    They lead from the cell nearest to the first of ``ends`` to the cell nearest to the second. Each end is a column and
    a row.
    """
    cells = np.argwhere(region)
    start, end = (cells[int(np.argmin(np.sum((cells - place[::-1]) ** 2, axis=1)))] for place in ends)
    to_rim = radius(region)
    usual = max(2 * float(np.median(to_rim[region])), 1.0)
    return cheapest(np.where(region, off_centre(to_rim, usual), np.inf), start, end, margin=max(region.shape))


def measure(field: DarkMap, cells: Integers) -> tuple[float, float]:
    """Return the typical darkness along a path, and the width in cells of the dark region around it."""
    darkness = float(np.median(field.dark[tuple(cells.T)]))
    to_rim = _from_middle(_to_rim(field, darkness), cells)
    return darkness, float(2 * np.median(to_rim[to_rim > 0]) - 1) if np.any(to_rim > 0) else 0.0


def middle_width(field: DarkMap, cells: Integers, darkness: float) -> float:
    """Width in cells of the dark region around the wide part of a path, measured at its local middle."""
    return float(2 * np.percentile(_uphill(_to_rim(field, darkness), cells), WIDEST) - 1)


def _from_middle(to_rim: Floats, cells: Integers) -> Floats:
    """Distances from the rim along a path, or at its local middle if the path follows a wall, the clearer line."""
    own, tops = to_rim[tuple(cells.T)], _uphill(to_rim, cells)
    hugs = 2 * np.median(own) - 1 < THIN_PX and 2 * np.median(tops) - 1 >= WIDE_PX
    return tops if hugs else own


def _uphill(distance: Floats, cells: Integers) -> Floats:
    """Return the distance at the local maximum uphill of each cell."""
    place = cells
    top = distance[tuple(place.T)]
    while True:
        around = np.clip(place[:, None] + AROUND, 0, np.array(distance.shape) - 1)
        values = distance[around[..., 0], around[..., 1]]
        highest = values.max(axis=1)
        if not np.any(highest > top):
            return top
        place, top = around[np.arange(len(place)), values.argmax(axis=1)], highest


def _to_rim(field: DarkMap, darkness: float) -> Floats:
    """Distance of each cell from the rim.

    The rim is the nearest cell that is less than half as dark as the crack, that is off the sample, or at the map's
    border.
    """
    outside = ~((field.dark > darkness / 2) & field.allowed)
    outside[[0, -1]] = True
    outside[:, [0, -1]] = True
    return distance_outside(outside).astype(float)
