"""Lines that look like cracks, over a whole photo, best first."""

import cv2
import numpy as np
from skimage.filters import apply_hysteresis_threshold
from skimage.graph import MCP_Geometric
from skimage.measure import label, regionprops
from skimage.morphology import skeletonize

from digitise.darkness import DarkMap
from sealtwin.records import arc_length

SURE, LIKELY = 5.0, 2.5
"""Ridge strength, in noise units, that starts a line and that lets it go on."""
LEAST_DARKNESS = 0.2
MIN_LENGTH = 0.12
"""Of the map's diagonal; shorter lines are pores and scratches."""
MIN_SLENDERNESS = 5.0
"""Length over width of whatever may be called a crack."""


def longest_lines(field: DarkMap) -> list[tuple[np.ndarray, float]]:
    """Rows and columns along each candidate, (n, 2), with its score: darkness summed along its length."""
    sure = apply_hysteresis_threshold(field.ridge, LIKELY, SURE) & (field.dark > LEAST_DARKNESS) & field.allowed
    joined = cv2.morphologyEx(sure.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)).astype(bool)
    bones = skeletonize(joined)
    least = MIN_LENGTH * float(np.hypot(*field.dark.shape))
    lines = []
    for part in regionprops(label(bones, connectivity=2)):
        if part.area < least:
            continue
        line = _longest_walk(part.image) + np.array(part.bbox[:2])
        length = float(arc_length(line.astype(float))[-1])
        area = float(joined[tuple(line.T)].sum())
        if length >= max(least, MIN_SLENDERNESS * _width(joined, line)) and area:
            lines.append((line, length * float(np.mean(field.dark[tuple(line.T)]))))
    return sorted(lines, key=lambda item: -item[1])


def _width(mask: np.ndarray, line: np.ndarray) -> float:
    inside = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    return 2 * float(np.median(inside[tuple(line.T)]))


def _longest_walk(bones: np.ndarray) -> np.ndarray:
    """The longest shortest way within one piece of skeleton: the farthest point from anywhere, and back."""
    cost = np.where(bones, 1.0, -1.0)
    start = tuple(np.argwhere(bones)[0])
    for _ in range(2):
        walk = MCP_Geometric(cost, fully_connected=True)
        reached, _ = walk.find_costs([start])
        origin, start = start, np.unravel_index(np.argmax(np.where(np.isfinite(reached), reached, -1)), reached.shape)
    return np.array(walk.traceback(start))
