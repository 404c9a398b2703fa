"""What a step costs on the search map, and the way that costs least."""

import cv2
import numpy as np
from skimage.graph import MCP_Geometric

from digitise.finding.darkness import DarkMap
from sealtwin.records import Floats, Integers

CLEAR = 8.0
"""In noise units: a clearer line is no cheaper, or one strong grain would pay for a detour."""
NOTHING = 0.04
"""Worth of a step where there is no line: a gap costs as much as a line 25 times as long."""
LEAST_DARKNESS = 0.2
"""A wide crack is at least so much darker than the mortar beside it: stains and shadows stay below."""


def cost_of_thin(field: DarkMap) -> Floats:
    """Of a step along a thin crack: its clearness as a line counts."""
    return np.where(field.allowed, 1 / (NOTHING + np.clip(field.ridge, 0, CLEAR) / CLEAR), np.inf)


def cost_of_wide(field: DarkMap) -> Floats:
    """Of a step along a wide crack, which has no equal in darkness."""
    reference = max(float(np.percentile(field.dark[field.allowed], 99)), LEAST_DARKNESS)
    strength = np.clip(field.ridge, 0, CLEAR) / CLEAR * field.dark / reference
    return np.where(field.allowed, 1 / (0.03 + np.minimum(strength, 1.5) ** 1.5), np.inf)


def cost_off_centre(field: DarkMap, cells: Integers, darkness: float) -> Floats:
    """Cheapest in the middle of a wide crack, which is as dark everywhere.

    ``cells`` are a way along it, ``darkness`` its typical one.
    """
    to_rim = _to_rim(field, darkness)
    usual = max(float(np.percentile(to_rim[tuple(cells.T)], 75)), 1.0)
    return np.where(field.allowed, 1 / (0.03 + np.minimum(to_rim / usual, 1.5) ** 2), np.inf)


def cheapest(cost: Floats, start: Integers, end: Integers) -> Integers:
    """Rows and columns, (n, 2), of the way with the least cost times length."""
    search = MCP_Geometric(np.where(np.isfinite(cost), cost, -1), fully_connected=True)
    search.find_costs([tuple(start)], [tuple(end)])
    return np.array(search.traceback(tuple(end)), dtype=np.int64)


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
