"""The scale from the size of the sample's face and its four corners, which are given or detected by its edges."""

from pathlib import Path

import cv2
import numpy as np

from digitise.geometry.polyline import Box, depth_inside, rectangle
from digitise.image.decoding import Pixels
from digitise.image.raster import Map
from digitise.scale.corners import edge_line, light_across, quadrilateral
from digitise.scale.view import MIDDLE, Scale, find_tilt, fit_corners, places_px
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

WORK_PX = 800  # Longer side of the copy on which the face is searched; its edges are refined on the photo itself
MIN_AREA = 0.1  # Smallest area of a face, over the photo's
LEAST_MARGIN = 0.02  # Margin around a detected face over the photo's shorter side: what reaches the border is a board
GAP_BRIGHTNESS = 0.8  # Largest brightness of a gap between face and board over the darker of both; plain edges have 0.9
LEAST_FILLED = 0.7  # Smallest share of its quadrilateral that a face of unknown size fills, less its crack and pores
MOST_SLENDER = 5.0  # Largest length over width of a face of unknown size; a straight crack is a longer rectangle
LEAST_PART = 0.1  # Smallest part of a face that a crack divides, over the largest
LEAST_PART_UNMEASURED = 0.3  # The same for a face of unknown size, whose parts could be markers, each a tenth of a face
STRAIGHT_PX = 2.0  # Largest RMS deviation of a sawn or cast edge from a line; hulls of other things exceed it
ASPECT_TOLERANCE = 0.2  # Largest logarithm of the face's aspect over face_mm's; perspective changes it by far less
CLICKED_PX, FOUND_PX = 1.0, 0.5  # Standard deviation of a corner's coordinates, clicked or by edges with a soft shadow
FACE_MM = 0.25  # Standard uncertainty of each side of the face: a caliper on mortar is good to 0.5 mm, at two sigma

MOST_FORESHORTENED = 2.0  # Largest ratio of aspects, by a camera 60 degrees off square; a wrong order gives more


def find_face(brightness: Map, size_mm: tuple[float, float], file: Path) -> tuple[Floats, float]:
    """Find the face's corners in px, (4, 2), from the lower left counter-clockwise, and its edges' RMS misfit in px."""
    rough = _rough_corners(brightness)
    if rough is None:
        raise InputError(f"{file}: the face does not stand out from its surroundings; give face_corners_px.")
    corners, bend_px = by_edges(brightness, rough)
    aspect, expected = _aspect(corners), size_mm[0] / size_mm[1]
    if not np.isfinite(aspect) or abs(np.log(aspect / expected)) > ASPECT_TOLERANCE:
        raise InputError(
            f"{file}: the detected face is {aspect:.2f} times as wide as high, but face_mm is {expected:.2f} times as "
            "wide as high: check face_mm (width, height in the photo), or give face_corners_px."
        )
    return corners, bend_px


def see_face(brightness: Map) -> Floats | None:
    """Find the corners in px of a face of unknown size, (4, 2). None if no filled region has straight sides.

    Without them, the shadow of a face would be the longest dark line in the photo. All four edges must be inside the
    photo.
    """
    rough = _rough_corners(brightness, LEAST_PART_UNMEASURED, LEAST_FILLED)
    if rough is None:
        return None
    sides_px = np.linalg.norm(rough[1:3] - rough[:2], axis=1)
    if sides_px.max() > MOST_SLENDER * max(sides_px.min(), 1e-6):
        return None
    corners, bend_px = by_edges(brightness, rough)
    height, width = brightness.shape
    inside_px = depth_inside(corners, (0, 0, width - 1, height - 1)).min()
    return corners if bend_px <= STRAIGHT_PX and inside_px > LEAST_MARGIN * min(width, height) else None


def by_edges(brightness: Map, rough_px: Floats, reach_px: float = 0.0) -> tuple[Floats, float]:
    """Refine rough corners, (4, 2), by the edges between them, within ``reach_px`` of their sides.

    Also returns the RMS distance of edge points from straight sides, px.
    """
    reach_px = reach_px or max(6.0, 0.012 * max(brightness.shape))
    lines, misses_px = zip(*(_edge(brightness, rough_px, side, reach_px) for side in range(4)), strict=True)
    return quadrilateral(list(lines)), float(np.sqrt(np.mean(np.concatenate(misses_px) ** 2)))


def _rough_corners(brightness: Map, least_part: float = LEAST_PART, least_filled: float = 0.0) -> Floats | None:
    """Return the largest filled region unlike the photo's border, bright or dark, as a quadrilateral, (4, 2)."""
    scale = min(1.0, WORK_PX / max(brightness.shape))
    small = cv2.resize(brightness, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    small = np.sqrt(cv2.GaussianBlur(small, (0, 0), 2))
    grey = cv2.normalize(small, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)  # pyright: ignore[reportCallIssue, reportArgumentType]
    _, bright = cv2.threshold(grey, 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    border = np.concatenate([bright[0], bright[-1], bright[:, 0], bright[:, -1]])
    face = (bright == (0 if border.mean() > 0.5 else 1)).astype(np.uint8)
    face = cv2.morphologyEx(face, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    count, label, stats, _ = cv2.connectedComponentsWithStats(face)
    if count < 2:
        return None
    area = stats[1:, cv2.CC_STAT_AREA]
    # An open crack divides the face in two.
    parts = 1 + np.flatnonzero(area > least_part * area.max())
    y, x = np.nonzero(np.isin(label, parts))
    hull = cv2.convexHull(np.column_stack([x, y]).astype(np.int32))
    if cv2.contourArea(hull) < MIN_AREA * face.size:
        return None
    box = cv2.boxPoints(cv2.minAreaRect(hull)).astype(float)
    quad = cv2.approxPolyDP(hull, 0.02 * cv2.arcLength(hull, True), True)[:, 0].astype(float)
    corners = _ordered(quad if len(quad) == 4 else box)
    corners_area = cv2.contourArea(corners.astype(np.float32))
    if cv2.contourArea(hull) < 0.9 * corners_area or len(x) < least_filled * corners_area:
        return None
    return (corners + 0.5) / scale - 0.5


def _aspect(corners: Floats) -> float:
    """Return the mean width over the mean height of a quadrilateral whose corners are in order."""
    lower, right, upper, left = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    return float((lower + upper) / (left + right))


def _ordered(corners: Floats) -> Floats:
    """Order corners as lower left, lower right, upper right, upper left in the photo (y down)."""
    centre = corners.mean(axis=0)
    angle = np.arctan2(-(corners - centre)[:, 1], (corners - centre)[:, 0])
    around = corners[np.argsort(angle)]  # counter-clockwise as seen, from -180 degrees: lower left first or second
    lower_left = int(np.argmax(around[:, 1] - around[:, 0]))
    return np.roll(around, -lower_left, axis=0)


def _edge(brightness: Map, corners_px: Floats, side: int, reach_px: float) -> tuple[Floats, Floats]:
    """Fit a line through the steepest light along one side, inside any gap. Also return its points' distances, px."""
    offset_px = np.arange(-reach_px, reach_px + 0.25, 0.5)
    foot, outward, light = light_across(brightness, corners_px, side, np.linspace(0.04, 0.96, 200), offset_px)
    # Neighbouring rows share the edge, but not their grain.
    light = cv2.GaussianBlur(cv2.blur(light, (1, 9)), (0, 0), sigmaX=2, sigmaY=1e-3)
    slope = np.abs(np.gradient(light, axis=1))
    quarter = light.shape[1] // 4
    inner, outer = np.median(light[:, :quarter], axis=1), light[:, -quarter:].max(axis=1)
    if np.median(light.min(axis=1) / np.maximum(np.minimum(inner, outer), 1e-6)) < GAP_BRIGHTNESS:
        # Most rows are darkest between face and board, which a crack does not cause: the face ends where light falls.
        before = np.arange(light.shape[1]) <= light.argmin(axis=1)[:, None]
        slope = np.where(before, np.maximum(-np.gradient(light, axis=1), 0), 0)
    top = np.clip(np.argmax(slope, axis=1), 1, slope.shape[1] - 2)
    # Between samples, by the parabola through the neighbours.
    low, high, after = (slope[np.arange(len(top)), top + step] for step in (-1, 0, 1))
    shift = 0.5 * (low - after) / np.minimum(low - 2 * high + after, -1e-12)
    steepest_px = offset_px[0] + 0.5 * (top + np.clip(shift, -0.5, 0.5))
    return edge_line(foot, outward, steepest_px, 1.0)


def scale_by_face(pixels: Pixels, settings: PhotoInput, face_mm: Box) -> Scale:
    """Fit the homography to four corners, detected or given; raise InputError if there is no such face."""
    size_px, (width_mm, height_mm) = pixels.size_px, face_mm[2:]
    corners_px, bend_px, noise_px = given_corners(pixels, settings), None, CLICKED_PX
    if corners_px is None:
        corners_px, bend_px = find_face(pixels.brightness, (width_mm, height_mm), pixels.file)
        noise_px = FOUND_PX
    fit = fit_corners(corners_px, rectangle(face_mm), noise_px)
    places = places_px(fit.view, size_px, face_mm)
    mm_per_px = float(fit.view.mm_per_px_at(places)[MIDDLE])
    _, tilt_deg = find_tilt(fit, places[MIDDLE], pixels.focal_px, settings.camera_distance_mm)
    source = "corners given" if bend_px is None else "found by its edges"
    # The scale is the geometric mean of both directions, to which each side contributes half.
    by_caliper = FACE_MM * np.hypot(0.5 / width_mm, 0.5 / height_mm)
    return Scale(
        view=fit.view,
        mm_per_px=mm_per_px,
        scale_source=f"face of {width_mm:g} x {height_mm:g} mm, {source}",
        scale_residual_mm=None if bend_px is None else bend_px * mm_per_px,
        scale_uncertainty=float(np.hypot(fit.spread_of_scale(places), by_caliper)),
        camera_tilt_deg=tilt_deg,
        face_mm=face_mm,
    )


def given_corners(pixels: Pixels, settings: PhotoInput) -> Floats | None:
    """Return the user's corners of the face, (4, 2), or None; raise InputError if they cannot be a face's."""
    if settings.face_corners_px is None or settings.face_mm is None:
        return None
    corners_px, size_px, file = np.array(settings.face_corners_px, dtype=float), pixels.size_px, pixels.file
    # Corners that the photo's border cuts off may be half a photo away.
    for (x, y), beyond in zip(corners_px, -depth_inside(corners_px, (0, 0, *size_px)), strict=True):
        if beyond > max(size_px) / 2:
            raise InputError(
                f"{file}: face_corners_px has ({x:g}, {y:g}), {beyond:.3g} px outside the photo of {size_px[0]} x "
                f"{size_px[1]} px; x counts from the left and y from the top."
            )
    # Counter-clockwise corners turn left at each.
    side = np.roll(corners_px, -1, axis=0) - corners_px
    after = np.roll(side, -1, axis=0)
    if not np.all(side[:, 0] * after[:, 1] - side[:, 1] * after[:, 0] < 0):
        listed = " ".join(f"({x:g}, {y:g})" for x, y in corners_px)
        raise InputError(
            f"{file}: face_corners_px {listed} are out of order; list lower left, lower right, upper right, upper left "
            "(px, y down)."
        )
    aspect, expected = _aspect(corners_px), settings.face_mm[0] / settings.face_mm[1]
    if max(aspect / expected, expected / aspect) > MOST_FORESHORTENED:
        raise InputError(
            f"{file}: the face within face_corners_px is {aspect:.2f} times as wide as high, but face_mm is "
            f"{expected:.2f} times as wide as high; list lower left, lower right, upper right, upper left (px, y "
            "down), or correct face_mm (width, height in the photo)."
        )
    return corners_px
