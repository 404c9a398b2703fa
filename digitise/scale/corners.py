"""Find corners of a black square to a few hundredths of a pixel from its edges, since blur rounds the corners off."""

import cv2
import numpy as np

from digitise.geometry.polyline import meeting, unit
from digitise.image.raster import Map, sampled
from sealtwin.core.records import Floats

REACH = (0.7, 0.35)  # Range to either side of an edge in each pass, in modules; the first corrects a rough detection
ACROSS, ALONG = 33, 48  # Samples of an edge; more do not move it
STRAY_PX = 0.3  # Distance from the edge beyond which a sample is an outlier, moved by dirt or a shadow


def fit_line(points: Floats) -> tuple[Floats, Floats]:
    """Fit a line by least squares: a point and a direction, (2, 2), and each point's signed distance from it, (n,)."""
    centre = points.mean(axis=0)
    direction = np.linalg.svd(points - centre, full_matrices=False)[2][0]
    return np.array([centre, direction]), (points - centre) @ _across(direction)


def fit_line_to_most(points: Floats, least: float) -> tuple[Floats, Floats]:
    """Fit a line to points in order along it, without those off by three median distances and by ``least``."""
    miss = _miss_of_most(points)
    line = np.empty((2, 2))
    for _ in range(5):
        points = points[np.abs(miss) <= max(least, 3 * float(np.median(np.abs(miss))))]
        line, miss = fit_line(points)
    return line, miss


def _miss_of_most(points: Floats) -> Floats:
    """Return the distances of points from a line, whose slope is the median between points half its length apart.

    The method is that of Theil and Sen.
    """
    (centre, direction), aside = fit_line(points)
    along = (points - centre) @ direction
    half = len(points) // 2
    run = along[half:] - along[: len(points) - half]
    slope = np.median((aside[half:] - aside[: len(points) - half]) / np.where(run == 0, np.inf, run))
    level = aside - slope * along
    return level - np.median(level)


def _across(direction: Floats) -> Floats:
    return np.array([-direction[1], direction[0]])


def light_across(
    brightness: Map, corners_px: Floats, side: int, share: Floats, offset_px: Floats, border: int = cv2.BORDER_REPLICATE
) -> tuple[Floats, Floats, Map]:
    """Sample the light across one side of a quadrilateral, (4, 2), outward.

    Returns the points at each ``share`` of the side, (n, 2), its normal, (2,), and the light at each offset, (n, k).
    """
    start, end = corners_px[side], corners_px[(side + 1) % 4]
    outward = _across(unit(end - start))
    outward *= np.sign(outward @ (start - corners_px.mean(axis=0)))
    foot = start + np.outer(share, end - start)
    return foot, outward, sampled(brightness, foot[:, None] + offset_px[:, None] * outward, beyond=border)


def quadrilateral(lines: list[Floats]) -> Floats:
    """Return the corners of a quadrilateral, (4, 2), from its sides. Corner i is the one at which side i begins.

    A side is a point and a direction.
    """
    return np.array([meeting(lines[side - 1], lines[side]) for side in range(4)])


def refined_corners(brightness: Map, corners_px: Floats, module_px: float) -> Floats | None:
    """Refine corners, (4, 2), that are off by less than half a module. None if an edge is hidden.

    ``brightness`` is linear light.
    """
    for reach in REACH:
        edges = [_edge(brightness, corners_px, side, reach * module_px) for side in range(4)]
        lines = [edge for edge in edges if edge is not None]
        if len(lines) < 4:
            return None
        corners_px = quadrilateral(lines)
    return corners_px


def _edge(brightness: Map, corners_px: Floats, side: int, reach_px: float) -> Floats | None:
    """Return the line, a point and a direction, half way between black and white. None if too little of it shows."""
    # Near the corners, blur mixes two edges.
    offset = np.linspace(-reach_px, reach_px, ACROSS)
    foot, outward, light = light_across(brightness, corners_px, side, np.linspace(0.1, 0.9, ALONG), offset)
    light = light.astype(float)
    black = np.median(light[:, : ACROSS // 5])
    # Row by row, since light falls off along the edge, which is visible in white only.
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
