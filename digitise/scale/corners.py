"""Find the straight edges of a quadrilateral to a few hundredths of a pixel, and its corners, which blur rounds off.

On synthetic photos, these corners of markers are off by 0.04 px RMS, those of ``cv2.cornerSubPix`` by 0.08 px, and
those of the refinements of ``cv2.aruco`` by 0.17 to 1 px.
"""

import cv2
import numpy as np

from digitise.geometry.polyline import meeting, unit
from digitise.image.raster import Map, sampled
from sealtwin.core.records import Floats

ROWS = 100  # Samples along each edge, some of which a crack, dirt or a shadow spoils; more do not move it
STEP_PX = 0.5  # Spacing of samples across an edge
LEAST_REACH_PX = 3.0  # Least range across an edge, six samples to either side
SMOOTH_PX = 1.0  # Standard deviation of the blur across an edge, without which grain decides where light is steepest
STRAY_PX = 0.3  # Distance from the edge beyond which a sample may be an outlier
STRAIGHT_PX = 2.0  # Largest RMS deviation of a sawn or cast edge from a line; hulls of other things exceed it
GAP = 0.1  # Least depth of a dark gap beside an edge, over the darker side's light and a fifth of the brighter side's


def refined_corners(brightness: Map, rough_px: Floats, reach_px: float) -> tuple[Floats, float] | None:
    """Refine corners, (4, 2), by the edges within ``reach_px`` of the sides between them. None if an edge is hidden.

    Also returns the RMS distance of the edges' points from straight lines, px. ``brightness`` is linear light.
    """
    reach_px = max(reach_px, LEAST_REACH_PX)
    lines, misses_px = zip(*(_edge(brightness, rough_px, side, reach_px) for side in range(4)), strict=True)
    bend_px = float(np.sqrt(np.mean(np.concatenate(misses_px) ** 2)))
    if not bend_px <= STRAIGHT_PX:
        return None
    # Corner i is the one at which side i begins.
    return np.array([meeting(lines[side - 1], lines[side]) for side in range(4)]), bend_px


def softness_px(brightness: Map, corners_px: Floats, reach_px: float) -> float:
    """Return the distance over which light rises from black to white across a black square's softest side, in px."""
    profiles = (light_across(brightness, corners_px, side, reach_px)[2].mean(axis=0) for side in range(4))
    return max(float(STEP_PX * np.ptp(profile) / np.gradient(profile).max()) for profile in profiles)


def light_across(brightness: Map, corners_px: Floats, side: int, reach_px: float) -> tuple[Floats, Floats, Floats]:
    """Sample the light across one side of a quadrilateral, (4, 2), outward.

    Returns points of the side, (n, 2), its normal, (2,), and the light, (n, k), every ``STEP_PX`` from ``-reach_px``.
    """
    start, end = corners_px[side], corners_px[(side + 1) % 4]
    x, y = unit(end - start)
    across = np.array([-y, x])
    outward = across * np.sign(across @ (start - corners_px.mean(axis=0)))
    # Near the corners, blur mixes two edges.
    foot = start + np.outer(np.linspace(0.06, 0.94, ROWS), end - start)
    offset_px = np.arange(-reach_px, reach_px + STEP_PX / 2, STEP_PX)
    return foot, outward, sampled(brightness, foot[:, None] + offset_px[:, None] * outward).astype(float)


def _edge(brightness: Map, corners_px: Floats, side: int, reach_px: float) -> tuple[Floats, Floats]:
    """Fit a line through the steepest light along one side, inside any gap. Also return its points' distances, px.

    These are infinite if half of the side shows no steepest place.
    """
    foot, outward, light = light_across(brightness, corners_px, side, reach_px)
    # Neighbouring rows share the edge, but not their grain.
    light = cv2.GaussianBlur(cv2.blur(light, (1, 9)), (0, 0), sigmaX=SMOOTH_PX / STEP_PX, sigmaY=1e-3)
    slope = np.gradient(light, axis=1)
    quarter = light.shape[1] // 4
    darker, brighter = np.sort([np.median(light[:, :quarter], axis=1), light[:, -quarter:].max(axis=1)], axis=0)
    if np.median((darker - light[:, quarter:].min(axis=1)) / (darker + 0.2 * brighter + 1e-6)) > GAP:
        # Most rows are darkest between face and board, which a crack does not cause: the face ends where light falls.
        before = np.arange(light.shape[1]) <= light.argmin(axis=1)[:, None]
        slope = np.where(before, np.minimum(slope, 0), 0)
    slope = np.abs(slope)
    top = slope.argmax(axis=1)
    row = np.flatnonzero((top > 0) & (top < slope.shape[1] - 1))
    if len(row) < ROWS // 2:
        return np.array([foot[0], unit(foot[-1] - foot[0])]), np.array([np.inf])
    # Between samples, by the parabola through the neighbours.
    low, high, after = (slope[row, top[row] + step] for step in (-1, 0, 1))
    peak = top[row] + 0.5 * (low - after) / np.minimum(low - 2 * high + after, -1e-12)
    return edge_line(foot[row], outward, STEP_PX * peak - reach_px)


def edge_line(foot: Floats, outward: Floats, across_px: Floats) -> tuple[Floats, Floats]:
    """Fit a line to most of the points ``across_px`` from ``foot``, which are in order along a straight side.

    Points off by three median distances and by ``STRAY_PX`` are left out. Returns a point and a direction, (2, 2), and
    the distances of the other points.
    """
    along = np.linalg.norm(foot - foot[0], axis=1)
    slope, level = 0.0, float(np.median(across_px))
    near = np.ones(len(along), dtype=bool)
    for _ in range(5):
        miss_px = np.abs(across_px - level - slope * along)
        near = miss_px <= max(STRAY_PX, 3 * float(np.median(miss_px)))
        slope, level = np.polyfit(along[near], across_px[near], 1)
    ends = foot[[0, -1]] + (level + slope * along[[0, -1], None]) * outward
    return np.array([ends[0], unit(ends[1] - ends[0])]), (across_px - level - slope * along)[near]
