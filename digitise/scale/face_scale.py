"""Find the scale from the size of the sample's face and its four corners, and refine corners of quadrilaterals.

Blur rounds corners off. Each corner is therefore computed as the intersection of the lines that are fitted to the two
edges. On synthetic photos, the corners of markers are then off by 0.04 px RMS. The corners of ``cv2.cornerSubPix`` are
off by 0.08 px, and the refined corners of ``cv2.aruco`` by 0.17 to 1 px.
"""

import cv2
import numpy as np

from digitise.geometry.polyline import Box, depth_inside, meeting, rectangle, to_left, unit
from digitise.image.decoding import Pixels
from digitise.image.raster import Map, sampled
from digitise.scale.view import MIDDLE, Scale, fit_corners, places_px
from digitise.settings import PhotoInput
from sealtwin.core.arrays import Floats, lengths, rms
from sealtwin.core.errors import InputError

# Largest logarithm of the ratio of the corners' aspect to that of face_mm, for a camera 60 degrees off; a wrong order
# gives more
MAX_FORESHORTENED = 0.7
CLICKED_PX = 1.0  # Standard deviation of a clicked corner's coordinates
FACE_MM = 0.25  # Standard uncertainty of each side of the face: a caliper on mortar is good to 0.5 mm at two sigma
# Constants of the fit of a quadrilateral's straight edges, which are found to a few hundredths of a pixel.
ROWS = 100  # Samples along each edge. Cracks, dirt or shadows spoil some. More samples do not change the result
STEP_PX = 0.5  # Spacing of samples across an edge
MIN_REACH_PX = 3.0  # Minimum distance sampled to either side of an edge: six samples
# Standard deviation of a blur across an edge. Without it, grain would decide where the light changes most
SMOOTH_PX = 1.0
STRAY_PX = 0.3  # A sample this far from the edge may be an outlier
STRAIGHT_PX = 2.0  # Largest RMS deviation of a sawn or cast edge from a line. Hulls of other objects deviate more
# Minimum depth of a dark gap beside an edge, divided by the darker side's light plus a fifth of the brighter side's
GAP = 0.1


def scale_by_face(pixels: Pixels, settings: PhotoInput, face_mm: Box) -> Scale:
    """Return the scale from a homography that is fitted to the face's four corners.

    Raises InputError if the corners are missing or cannot be those of the face.
    """
    width_mm, height_mm = face_mm[2:]
    corners_px = given_corners(pixels, settings)
    if corners_px is None:
        raise InputError(
            f"{pixels.file}: face_mm gives the scale only together with face_corners_px, the four corners of the face. "
            "Click them with 'sealtwin trace', give '--set photo.face_corners_px=[[x, y], ...]', or give another scale."
        )
    fit = fit_corners(corners_px, rectangle(face_mm), CLICKED_PX)
    places = places_px(fit.view, face_mm)
    # The scale is the geometric mean of both directions, so that each side contributes half of its error.
    by_caliper = FACE_MM * np.hypot(0.5 / width_mm, 0.5 / height_mm)
    return Scale(
        view=fit.view,
        mm_per_px=float(fit.view.mm_per_px_at(places)[MIDDLE]),
        scale_source=f"face of {width_mm:g} x {height_mm:g} mm, corners given",
        scale_uncertainty=float(np.hypot(fit.spread_of_scale(places), by_caliper)),
        face_mm=face_mm,
    )


def given_corners(pixels: Pixels, settings: PhotoInput) -> Floats | None:
    """Return the four corners of the face that the user gave, (4, 2) in px. None if the user gave none.

    Raises InputError if these corners cannot belong to a face with the size ``face_mm``.
    """
    if settings.face_corners_px is None or settings.face_mm is None:
        return None
    corners_px, size_px = np.array(settings.face_corners_px, float), pixels.size_px
    ring = corners_px.astype(np.float32)
    # Counter-clockwise as seen, with y down.
    in_order = cv2.isContourConvex(ring) and cv2.contourArea(ring, oriented=True) < 0
    # Corners that the photo's border cuts off may be half a photo away.
    near = np.all(depth_inside(corners_px, (0, 0, *size_px)) >= -max(size_px) / 2)
    expected = settings.face_mm[0] / settings.face_mm[1]
    if not (in_order and near and abs(np.log(_aspect(corners_px) / expected)) <= MAX_FORESHORTENED):
        raise InputError(
            f"{pixels.file}: face_corners_px = {settings.face_corners_px} cannot be a face of face_mm = "
            f"{settings.face_mm}, {expected:.2f} times as wide as high, in a photo of {size_px[0]} x {size_px[1]} px. "
            "List lower left, lower right, upper right, upper left (px, x from the left and y from the top), or "
            "correct face_mm (width, height in the photo)."
        )
    return corners_px


def side_lengths(corners: Floats) -> Floats:
    """Return the lengths of the sides of a ring with n corners, (n,). Side i begins at corner i."""
    return lengths(np.roll(corners, -1, axis=0) - corners)


def _aspect(corners_px: Floats) -> float:
    """Return the ratio of mean width to mean height of a quadrilateral whose corners are in order."""
    lower, right, upper, left = side_lengths(corners_px)
    return float((lower + upper) / max(left + right, 1e-6))


def refined_corners(brightness: Map, rough_px: Floats, reach_px: float) -> tuple[Floats, float] | None:
    """Refine rough corners, (4, 2), with the edges within ``reach_px`` of the sides between them.

    Returns the corners, and the RMS distance of the edges' points from straight lines, in px. Returns None if an edge
    is not visible or not straight. ``brightness`` is linear light.
    """
    reach_px = max(reach_px, MIN_REACH_PX)
    lines, misses_px = zip(*(_edge(brightness, rough_px, side, reach_px) for side in range(4)), strict=True)
    bend_px = rms(np.concatenate(misses_px))
    if not bend_px <= STRAIGHT_PX:
        return None
    # Side i begins at corner i.
    return np.array([meeting(lines[side - 1], lines[side]) for side in range(4)]), bend_px


def _edge(brightness: Map, corners_px: Floats, side: int, reach_px: float) -> tuple[Floats, Floats]:
    """Fit a line through the steepest change of light along one side, inside any gap beside the side.

    Also returns the distances of the fitted points from the line, in px. The distance is infinite if half of the side
    shows no edge.
    """
    start, end = corners_px[side], corners_px[(side + 1) % 4]
    outward = to_left(unit(end - start))
    outward *= np.sign(outward @ (start - corners_px.mean(axis=0)))
    # Near the corners, blur mixes two edges.
    foot = start + np.outer(np.linspace(0.06, 0.94, ROWS), end - start)
    offset_px = np.arange(-reach_px, reach_px + STEP_PX / 2, STEP_PX)
    light = sampled(brightness, foot[:, None] + offset_px[:, None] * outward).astype(float)
    # Grain differs between neighbouring rows, so it is averaged along the edge.
    light = cv2.GaussianBlur(cv2.blur(light, (1, 9)), (0, 0), sigmaX=SMOOTH_PX / STEP_PX, sigmaY=1e-3)
    slope = np.gradient(light, axis=1)
    quarter = light.shape[1] // 4
    darker, brighter = np.sort([np.median(light[:, :quarter], axis=1), light[:, -quarter:].max(axis=1)], axis=0)
    if np.median((darker - light[:, quarter:].min(axis=1)) / (darker + 0.2 * brighter + 1e-6)) > GAP:
        # Most rows are darkest in a gap between face and board. The face ends where the light falls towards the gap.
        before = np.arange(light.shape[1]) <= light.argmin(axis=1)[:, None]
        slope = np.where(before, np.minimum(slope, 0), 0)
    slope = np.abs(slope)
    top = slope.argmax(axis=1)
    row = np.flatnonzero((top > 0) & (top < slope.shape[1] - 1))
    if len(row) < ROWS // 2:
        return np.array([foot[0], unit(foot[-1] - foot[0])]), np.array([np.inf])
    # A parabola through the neighbouring samples gives the peak between samples.
    low, high, after = (slope[row, top[row] + step] for step in (-1, 0, 1))
    peak = top[row] + 0.5 * (low - after) / np.minimum(low - 2 * high + after, -1e-12)
    return edge_line(foot[row], outward, STEP_PX * peak - reach_px)


def edge_line(foot: Floats, outward: Floats, across_px: Floats) -> tuple[Floats, Floats]:
    """Fit a line to most of the points at ``across_px`` from ``foot``, which are in order along a straight side.

    Points that are off by more than three median distances and ``STRAY_PX`` are left out. Returns a point and a
    direction, (2, 2), and the distances of the other points from the line.
    """
    along = lengths(foot - foot[0])
    slope, level = 0.0, np.median(across_px)
    near = np.ones(len(along), bool)
    for _ in range(5):
        miss_px = np.abs(across_px - level - slope * along)
        near = miss_px <= max(STRAY_PX, 3 * np.median(miss_px))
        slope, level = np.polyfit(along[near], across_px[near], 1)
    ends = foot[[0, -1]] + (level + slope * along[[0, -1], None]) * outward
    return np.array([ends[0], unit(ends[1] - ends[0])]), (across_px - level - slope * along)[near]
