"""What a step costs on the search map, and the way that costs least."""

import cv2
import numpy as np
from skimage.graph import MCP_Geometric

from digitise.finding.darkness import DarkMap
from sealtwin.records import Floats, Integers

CLEAR = 8.0
"""In noise units: a clearer line is no cheaper, or one strong grain would pay for a detour."""
ASIDE = 2
"""Cells: a first way runs up to so far beside the middle of a thin crack."""
NOTHING = 0.04
"""Worth of a step where there is no line: a gap costs as much as a line 25 times as long."""
LEAST_DARKNESS = 0.2
"""A wide crack is at least so much darker than the mortar beside it: stains and shadows stay below."""


def cost_of_thin(field: DarkMap, cells: Integers) -> Floats:
    """Of a step along a thin crack: its clearness as a line counts, up to that of the places ``cells``, mostly on it.

    A crack in a photo without noise is clear to the widest filters, far to its sides: only its middle is the clearest.
    """
    clearest = cv2.dilate(field.ridge, np.ones((1 + 2 * ASIDE, 1 + 2 * ASIDE), np.uint8))
    clear = max(CLEAR, float(np.median(clearest[tuple(cells.T)]))) if len(cells) else CLEAR
    return np.where(field.allowed, 1 / (NOTHING + np.clip(field.ridge, 0, clear) / clear), np.inf)


def cost_of_wide(field: DarkMap) -> Floats:
    """Of a step along a wide crack, which has no equal in darkness."""
    strength = np.clip(field.ridge, 0, CLEAR) / CLEAR * field.dark / max(field.darkest, LEAST_DARKNESS)
    return np.where(field.allowed, 1 / (0.03 + np.minimum(strength, 1.5) ** 1.5), np.inf)


def cost_off_centre(field: DarkMap, cells: Integers, darkness: float) -> Floats:
    """Cheapest in the middle of a wide crack, which is as dark everywhere.

    ``cells`` are a way along it, ``darkness`` its typical one.
    """
    to_rim = _to_rim(field, darkness)
    usual = max(float(np.percentile(to_rim[tuple(cells.T)], 75)), 1.0)
    return np.where(field.allowed, 1 / (0.03 + np.minimum(to_rim / usual, 1.5) ** 2), np.inf)


def cheapest(cost: Floats, start: Integers, end: Integers, margin: int) -> Integers:
    """Rows and columns, (n, 2), of the way with the least cost times length.

    It leaves the box of both cells by ``margin`` cells at most.
    """
    low = np.maximum(np.minimum(start, end) - margin, 0)
    high = np.maximum(start, end) + margin + 1
    near = cost[low[0] : high[0], low[1] : high[1]]
    search = MCP_Geometric(np.where(np.isfinite(near), near, -1), fully_connected=True)
    search.find_costs([tuple(start - low)], [tuple(end - low)])
    return low + np.array(search.traceback(tuple(end - low)), dtype=np.int64)


def measure(field: DarkMap, cells: Integers) -> tuple[float, float]:
    """Typical darkness along a way, and width of the dark around it in cells."""
    darkness = float(np.median(field.dark[tuple(cells.T)]))
    to_rim = _to_rim(field, darkness)[tuple(cells.T)]
    return darkness, float(2 * np.median(to_rim[to_rim > 0]) - 1) if np.any(to_rim > 0) else 0.0


def _to_rim(field: DarkMap, darkness: float) -> Floats:
    """Distance from the nearest cell that is not half as dark as the crack, or not on the sample or the map."""
    mask = ((field.dark > darkness / 2) & field.allowed).astype(np.uint8)
    mask[[0, -1]] = 0
    mask[:, [0, -1]] = 0
    return cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE).astype(float)
