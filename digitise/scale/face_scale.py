"""The scale from the size of the sample's face and its four corners, which are given or detected by its edges."""

import cv2
import numpy as np

from digitise.geometry.polyline import Box, depth_inside, rectangle
from digitise.image.decoding import Pixels
from digitise.image.raster import Map
from digitise.scale.corners import refined_corners
from digitise.scale.view import MIDDLE, Scale, find_tilt, fit_corners, places_px
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

WORK_PX = 800  # Longer side of the copy on which the face is searched; its edges are refined on the photo itself
MIN_AREA = 0.1  # Smallest area of a face, over the photo's
LEAST_MARGIN = 0.02  # Margin around a detected face over the photo's shorter side: what reaches the border is a board
LEAST_FILLED = 0.7  # Smallest share of its quadrilateral that a face fills, less its crack and pores
MOST_SLENDER = 5.0  # Largest length over width of a face of unknown size; a straight crack is a longer rectangle
LEAST_PART = 0.3  # Smallest part of a face that a crack divides, over the largest; markers are a tenth of a face
ASPECT_TOLERANCE = 0.2  # Largest logarithm of the face's aspect over face_mm's; perspective changes it by far less
MOST_FORESHORTENED = 2.0  # The same ratio for given corners, by a camera 60 degrees off; a wrong order gives more
CLICKED_PX, FOUND_PX = 1.0, 0.5  # Standard deviation of a corner's coordinates, clicked or by edges with a soft shadow
FACE_MM = 0.25  # Standard uncertainty of each side of the face: a caliper on mortar is good to 0.5 mm, at two sigma


def scale_by_face(pixels: Pixels, settings: PhotoInput, face_mm: Box) -> Scale:
    """Fit the homography to four corners, given or detected; raise InputError if there is no such face."""
    width_mm, height_mm = face_mm[2:]
    corners_px, bend_px, noise_px = given_corners(pixels, settings), None, CLICKED_PX
    if corners_px is None:
        face = _face(pixels.brightness)
        if face is None:
            raise InputError(f"{pixels.file}: the face does not stand out from its surroundings; give face_corners_px.")
        (corners_px, bend_px), noise_px = face, FOUND_PX
        aspect, expected = _aspect(corners_px), width_mm / height_mm
        if not abs(np.log(aspect / expected)) <= ASPECT_TOLERANCE:
            raise InputError(
                f"{pixels.file}: the detected face is {aspect:.2f} times as wide as high, but face_mm is "
                f"{expected:.2f} times as wide as high: check face_mm (width, height in the photo), or give "
                "face_corners_px."
            )
    fit = fit_corners(corners_px, rectangle(face_mm), noise_px)
    places = places_px(fit.view, pixels.size_px, face_mm)
    mm_per_px = float(fit.view.mm_per_px_at(places)[MIDDLE])
    # The scale is the geometric mean of both directions, to which each side contributes half.
    by_caliper = FACE_MM * np.hypot(0.5 / width_mm, 0.5 / height_mm)
    return Scale(
        view=fit.view,
        mm_per_px=mm_per_px,
        scale_source=f"face of {width_mm:g} x {height_mm:g} mm, "
        f"{'corners given' if bend_px is None else 'found by its edges'}",
        scale_residual_mm=None if bend_px is None else bend_px * mm_per_px,
        scale_uncertainty=float(np.hypot(fit.spread_of_scale(places), by_caliper)),
        camera_tilt_deg=find_tilt(fit, places[MIDDLE], pixels.focal_px, settings.camera_distance_mm)[1],
        face_mm=face_mm,
    )


def given_corners(pixels: Pixels, settings: PhotoInput) -> Floats | None:
    """Return the user's corners of the face, (4, 2), or None; raise InputError if they cannot be a face's."""
    if settings.face_corners_px is None or settings.face_mm is None:
        return None
    corners_px, size_px = np.array(settings.face_corners_px, dtype=float), pixels.size_px
    # Counter-clockwise corners turn left at each.
    side = np.roll(corners_px, -1, axis=0) - corners_px
    after = np.roll(side, -1, axis=0)
    in_order = np.all(side[:, 0] * after[:, 1] < side[:, 1] * after[:, 0])
    # Corners that the photo's border cuts off may be half a photo away.
    near = np.all(depth_inside(corners_px, (0, 0, *size_px)) >= -max(size_px) / 2)
    aspect, expected = _aspect(corners_px), settings.face_mm[0] / settings.face_mm[1]
    if not (in_order and near and max(aspect / expected, expected / aspect) <= MOST_FORESHORTENED):
        listed = " ".join(f"({x:g}, {y:g})" for x, y in corners_px)
        raise InputError(
            f"{pixels.file}: face_corners_px {listed} are not a face's of face_mm = {settings.face_mm}, {expected:.2f} "
            f"times as wide as high, in a photo of {size_px[0]} x {size_px[1]} px: list lower left, lower right, upper "
            "right, upper left (px, x from the left and y from the top), or correct face_mm (width, height in the "
            "photo)."
        )
    return corners_px


def see_face(brightness: Map) -> Floats | None:
    """Find the corners in px of a face of unknown size, (4, 2). None if no filled region has straight sides.

    Without them, the shadow of a face would be the longest dark line in the photo. All four edges must be inside the
    photo.
    """
    face = _face(brightness)
    if face is None:
        return None
    height, width = brightness.shape
    inside_px = depth_inside(face[0], (0, 0, width - 1, height - 1)).min()
    slender = not 1 / MOST_SLENDER <= _aspect(face[0]) <= MOST_SLENDER
    return None if slender or inside_px <= LEAST_MARGIN * min(width, height) else face[0]


def _face(brightness: Map) -> tuple[Floats, float] | None:
    """Return the corners of the face and the RMS misfit of its edges in px, or None if there is none."""
    rough_px = _rough_corners(brightness)
    return None if rough_px is None else refined_corners(brightness, rough_px, max(6.0, 0.012 * max(brightness.shape)))


def _rough_corners(brightness: Map) -> Floats | None:
    """Return the largest filled region unlike the photo's border, bright or dark, as a quadrilateral, (4, 2)."""
    scale = min(1.0, WORK_PX / max(brightness.shape))
    small = cv2.resize(brightness, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    small = np.sqrt(cv2.GaussianBlur(small, (0, 0), 2))
    grey = np.rint(255 * small / max(small.max(), 1e-6)).astype(np.uint8)
    bright = cv2.threshold(grey, 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)[1]
    border = np.concatenate([bright[0], bright[-1], bright[:, 0], bright[:, -1]])
    face = (bright == (0 if border.mean() > 0.5 else 1)).astype(np.uint8)
    face = cv2.morphologyEx(face, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    count, label, stats, _ = cv2.connectedComponentsWithStats(face)
    if count < 2:
        return None
    area = stats[1:, cv2.CC_STAT_AREA]
    # An open crack divides the face in two.
    parts = np.isin(label, 1 + np.flatnonzero(area > LEAST_PART * area.max()))
    hull = cv2.convexHull(np.argwhere(parts)[:, ::-1].astype(np.int32))
    quad = cv2.approxPolyDP(hull, 0.02 * cv2.arcLength(hull, True), True)
    if len(quad) != 4:
        quad = cv2.boxPoints(cv2.minAreaRect(hull))
    quad_area = cv2.contourArea(quad.astype(np.float32))
    filled = cv2.contourArea(hull) >= 0.9 * quad_area and parts.sum() >= LEAST_FILLED * quad_area
    if not filled or cv2.contourArea(hull) < MIN_AREA * face.size:
        return None
    # Counter-clockwise as seen, from the lower left. OpenCV's clockwise is for y up.
    around = cv2.convexHull(quad.astype(np.float32), clockwise=True).reshape(4, 2).astype(float)
    return (np.roll(around, -int(np.argmax(around @ (-1, 1))), axis=0) + 0.5) / scale - 0.5


def _aspect(corners_px: Floats) -> float:
    """Return the mean width over the mean height of a quadrilateral whose corners are in order."""
    lower, right, upper, left = np.linalg.norm(np.roll(corners_px, -1, axis=0) - corners_px, axis=1)
    return float((lower + upper) / max(left + right, 1e-6))
