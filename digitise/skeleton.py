"""Lines that look like cracks, over a whole photo, best first."""

import cv2
import numpy as np
from skimage.filters import apply_hysteresis_threshold
from skimage.graph import MCP_Geometric
from skimage.measure import label, regionprops
from skimage.morphology import skeletonize

from digitise.darkness import DarkMap
from sealtwin.records import Floats, Integers, arc_length

SURE, LIKELY = 5.0, 2.5
"""Ridge strength, in noise units, that starts a line and that lets it go on."""
LEAST_DARKNESS = 0.2
MIN_LENGTH = 0.12
"""Of the map's diagonal; shorter lines are pores and scratches."""
MIN_SLENDERNESS = 5.0
"""Length over width of whatever may be called a crack."""
FADING = 0.5
"""Of a line's own median strength: where its ends fall below, it has left the crack."""


def longest_lines(field: DarkMap) -> list[tuple[Integers, float]]:
    """Rows and columns along each candidate, (n, 2), with its score: strength summed along its length."""
    likely = apply_hysteresis_threshold(field.ridge, LIKELY, SURE) & (field.dark > LEAST_DARKNESS) & field.allowed
    # The rim of the map has no mortar on one side and answers like a line.
    likely[[0, 1, -2, -1]] = False
    likely[:, [0, 1, -2, -1]] = False
    joined = cv2.morphologyEx(likely.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    to_rim = cv2.distanceTransform(np.pad(joined, 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
    strength = (np.clip(field.ridge, 0.1, 8) / 8 * field.dark).astype(float)
    least = MIN_LENGTH * float(np.hypot(*field.dark.shape))
    lines = []
    for bone in regionprops(label(skeletonize(joined > 0), connectivity=2)):
        if bone.area < least:
            continue
        corner = np.array(bone.bbox[:2])
        window = np.s_[bone.bbox[0] : bone.bbox[2], bone.bbox[1] : bone.bbox[3]]
        line = _strongest_walk(np.where(bone.image, strength[window], -1.0)) + corner
        line = _without_faint_ends(line, strength, to_rim)
        length = float(arc_length(line.astype(float))[-1]) if len(line) > 1 else 0.0
        if length >= max(least, MIN_SLENDERNESS * 2 * float(np.median(to_rim[tuple(line.T)]))):
            lines.append((line, length * float(np.mean(strength[tuple(line.T)]))))
    return sorted(lines, key=lambda item: -item[1])


def _strongest_walk(strength: Floats) -> Integers:
    """The way through one piece of skeleton along which most strength adds up: from anywhere to its far end, and back.

    ``strength`` is negative off the skeleton.
    """
    start = tuple(np.argwhere(strength > 0)[0])
    walk = MCP_Geometric(strength, fully_connected=True)
    for _ in range(2):
        walk = MCP_Geometric(strength, fully_connected=True)
        reached, _ = walk.find_costs([start])
        start = np.unravel_index(int(np.argmax(np.where(np.isfinite(reached), reached, -1))), reached.shape)
    return np.array(walk.traceback(start), dtype=np.int64)


def _without_faint_ends(line: Integers, strength: Floats, to_rim: np.ndarray) -> Integers:
    """Less what fades out, and less half a width more: a skeleton turns into the corners of a blunt end."""
    along = strength[tuple(line.T)]
    strong = np.flatnonzero(along >= FADING * np.median(along))
    line = line[strong[0] : strong[-1] + 1]
    back = round(float(np.median(to_rim[tuple(line.T)])))
    return line[back:-back] if 0 < 2 * back < len(line) else line
