"""Corners of a black square on white, to a few hundredths of a pixel: where its four edges meet.

OpenCV's corner refinement looks at the corners themselves, which blur rounds off: it puts them 0.2 px into the square
behind a sharp lens, and 0.6 px in a blur of 2 px; the edges stay where they are.
"""

import cv2
import numpy as np

from digitise.pictures.raster import Map
from digitise.scaling.straight import fit_line_to_most, meeting
from sealtwin.records import Floats

REACH = (0.7, 0.35)
"""Of a module, to either side of an edge, in each pass: within it there is nothing but black inside and white outside.
The first pass finds edges that a smaller copy of the photo has put some pixels off.
"""
ACROSS, ALONG = 33, 48
"""Samples of an edge. More change nothing that can be seen."""
STRAY_PX = 0.3
"""From the edge, of samples that dirt or a neighbour's shadow has moved."""


def refined_corners(brightness: Map, corners_px: Floats, module_px: float) -> Floats | None:
    """Of a square whose corners are known to half a module, in linear light, (4, 2); None where an edge is hidden."""
    for reach in REACH:
        edges = [_edge(brightness, corners_px, side, reach * module_px) for side in range(4)]
        found = [edge for edge in edges if edge is not None]
        if len(found) < 4:
            return None
        corners_px = np.array([meeting(found[side - 1], found[side]) for side in range(4)])
    return corners_px


def _edge(brightness: Map, corners_px: Floats, side: int, reach_px: float) -> Floats | None:
    """The line, point and direction, where light is half way from black to white; None where it mostly is not."""
    start, end = corners_px[side], corners_px[(side + 1) % 4]
    along = (end - start) / np.linalg.norm(end - start)
    outward = np.array([along[1], -along[0]])
    outward *= np.sign(outward @ (start - corners_px.mean(axis=0)))
    # Near the corners, blur mixes two edges.
    foot = start + np.outer(np.linspace(0.1, 0.9, ALONG), end - start)
    offset = np.linspace(-reach_px, reach_px, ACROSS)
    place = (foot[:, None] + offset[:, None] * outward).astype(np.float32)
    light = cv2.remap(
        brightness, place[..., 0], place[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    ).astype(float)
    black = np.median(light[:, : ACROSS // 5])
    # Row by row, since the lamp fades along the edge and black hides that.
    white = np.median(light[:, -(ACROSS // 5) :], axis=1)
    passed = light > (0.5 * (black + white))[:, None]
    after = passed.argmax(axis=1)
    row = np.flatnonzero(after > 0)
    if len(row) < ALONG // 2:
        return None
    after = after[row]
    low, high = light[row, after - 1], light[row, after]
    share = (0.5 * (black + white[row]) - low) / (high - low)
    crossing = np.interp(after - 1 + share, np.arange(ACROSS), offset)
    return fit_line_to_most(foot[row] + crossing[:, None] * outward, STRAY_PX)[0]
