"""Find the straight edges of a quadrilateral to a few hundredths of a pixel, and its corners, which blur rounds off.

On synthetic photos, these corners of markers are off by 0.04 px RMS, those of ``cv2.cornerSubPix`` by 0.08 px, and
those of the refinements of ``cv2.aruco`` by 0.17 to 1 px.
"""

import numpy as np

from digitise.geometry.polyline import meeting, unit
from digitise.image.raster import Map, sampled
from sealtwin.core.records import Floats

REACH = (0.7, 0.35)  # Range to either side of an edge in each pass, in modules; the first corrects a rough detection
ACROSS, ALONG = 33, 48  # Samples of a marker's edge; more do not move it
STRAY_PX = 0.3  # Distance from the edge beyond which a sample is an outlier, moved by dirt or a shadow


def light_across(
    brightness: Map, corners_px: Floats, side: int, share: Floats, offset_px: Floats
) -> tuple[Floats, Floats, Floats]:
    """Sample the light across one side of a quadrilateral, (4, 2), outward.

    Returns the points at each ``share`` of the side, (n, 2), its normal, (2,), and the light at each offset, (n, k).
    """
    start, end = corners_px[side], corners_px[(side + 1) % 4]
    x, y = unit(end - start)
    outward = np.array([-y, x]) * np.sign(np.array([-y, x]) @ (start - corners_px.mean(axis=0)))
    foot = start + np.outer(share, end - start)
    return foot, outward, sampled(brightness, foot[:, None] + offset_px[:, None] * outward).astype(float)


def edge_line(foot: Floats, outward: Floats, across_px: Floats, least_px: float) -> tuple[Floats, Floats]:
    """Fit a line to most of the points ``across_px`` from ``foot``, which are in order along a straight side.

    Points off by three median distances and by ``least_px`` are left out. Returns a point and a direction, (2, 2), and
    the distances of the other points.
    """
    along = np.linalg.norm(foot - foot[0], axis=1)
    half = len(along) // 2
    # The first slope is the median between points half the length apart (Theil, Sen).
    slope = np.median((across_px[half:] - across_px[:-half]) / (along[half:] - along[:-half]))
    level = np.median(across_px - slope * along)
    near = np.ones(len(along), dtype=bool)
    for _ in range(5):
        miss_px = np.abs(across_px - level - slope * along)
        near = miss_px <= max(least_px, 3 * float(np.median(miss_px)))
        slope, level = np.polyfit(along[near], across_px[near], 1)
    ends = foot[[0, -1]] + (level + slope * along[[0, -1], None]) * outward
    return np.array([ends[0], unit(ends[1] - ends[0])]), (across_px - level - slope * along)[near]


def quadrilateral(lines: list[Floats]) -> Floats:
    """Return the corners of a quadrilateral, (4, 2), from its sides. Corner i is the one at which side i begins.

    A side is a point and a direction.
    """
    return np.array([meeting(lines[side - 1], lines[side]) for side in range(4)])


def refined_corners(brightness: Map, corners_px: Floats, module_px: float) -> Floats | None:
    """Refine corners of a black square, (4, 2), that are off by less than half a module. None if an edge is hidden.

    ``brightness`` is linear light.
    """
    for reach in REACH:
        edges = [_edge(brightness, corners_px, side, reach * module_px) for side in range(4)]
        lines = [edge for edge in edges if edge is not None]
        if len(lines) < 4:
            return None
        corners_px = quadrilateral(lines)
    return corners_px


def softness_px(brightness: Map, corners_px: Floats, module_px: float) -> float:
    """Return the distance over which light rises from black to white across a black square's softest side, in px."""
    offset_px = np.linspace(-module_px, module_px, 2 * ACROSS)
    shares = np.linspace(0.1, 0.9, ALONG)
    profiles = [
        np.median(light_across(brightness, corners_px, side, shares, offset_px)[2], axis=0) for side in range(4)
    ]
    return float(max(np.ptp(light) / np.gradient(light, offset_px).max() for light in profiles))


def _edge(brightness: Map, corners_px: Floats, side: int, reach_px: float) -> Floats | None:
    """Return the line, a point and a direction, half way between black and white. None if too little of it shows."""
    # Near the corners, blur mixes two edges.
    offset_px = np.linspace(-reach_px, reach_px, ACROSS)
    foot, outward, light = light_across(brightness, corners_px, side, np.linspace(0.1, 0.9, ALONG), offset_px)
    # White row by row, since light falls off along the edge, which is visible in white only.
    half = 0.5 * (np.median(light[:, : ACROSS // 5]) + np.median(light[:, -(ACROSS // 5) :], axis=1))
    after = (light > half[:, None]).argmax(axis=1)
    row = np.flatnonzero(after > 0)
    if len(row) < ALONG // 2:
        return None
    after = after[row]
    low, high = light[row, after - 1], light[row, after]
    crossing_px = np.interp(after - 1 + (half[row] - low) / (high - low), np.arange(ACROSS), offset_px)
    return edge_line(foot[row], outward, crossing_px, STRAY_PX)[0]
