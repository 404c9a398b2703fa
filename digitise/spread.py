"""Find the outline of a round blob of paste in a photo on the printed marker sheet: its mean radius and roundness."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy import ndimage
from scipy.optimize import least_squares
from skimage.measure import find_contours, label

from digitise.geometry.polyline import rectangle, resampled
from digitise.image.raster import Map, blurred, continued, sampled
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput
from sealtwin.core.arc_length import arc_length
from sealtwin.core.arrays import Booleans, Floats, lengths
from sealtwin.core.errors import InputError, present
from sealtwin.core.facts import Facts

POINTS = 360  # Number of points of an outline
REACH = 0.06  # Distance from the edge at which the light beside it is measured, as a fraction of half the paste's width
MIN_HALF_PX = 40.0  # Minimum half width. Below it, an edge error of 0.5 px changes the yield stress by over 6 %
MIN_CONTRAST = 0.06  # Minimum change of light across the edge, relative to the sheet. Blurred grain has 1/5 of it
MAX_UNROUND = 0.10  # Largest RMS deviation from a circle, divided by the mean radius. A sloped plate causes more
MIN_SEEN = 0.95  # Minimum fraction of the edge that must be visible
EDGE_PX = 0.5  # Standard uncertainty of the whole edge's position, from blur and a wet rim


@dataclass(frozen=True)
class SpreadBlob:
    """A round blob of paste in plan view."""

    radius_mm: float  # Radius of the circle of equal area
    radius_error_mm: float  # Standard uncertainty, from scale, edge and shape
    unround: float  # Standard deviation of the outline's distance from the middle, divided by the mean distance
    # Smallest and largest width of the blob over all directions
    diameters_mm: tuple[float, float]
    warnings: Facts


def measure_spread(settings: PhotoInput, folder: Path) -> SpreadBlob:
    """Find the blob inside the frame of markers and measure it. Raises InputError if there is no round blob."""
    photo, outline_px = paste_edge(settings, folder)
    outline_mm = photo.to_mm(outline_px)
    moments = cv2.moments(outline_mm.astype(np.float32))
    middle_mm = np.array([moments["m10"], moments["m01"]]) / moments["m00"]
    away_mm, radius_mm = lengths(outline_mm - middle_mm), float(np.sqrt(moments["m00"] / np.pi))
    unround = float(away_mm.std() / away_mm.mean())
    if unround > MAX_UNROUND:
        raise InputError(
            f"{photo.file}: the blob is not round: its outline deviates from a circle by {unround:.0%} of its radius "
            f"(RMS), and at most {MAX_UNROUND:.0%} is allowed. Level the plate, lift the cone straight up, and "
            "measure again."
        )
    ways = np.radians(np.arange(0, 180, 2.0))
    wide_mm = np.ptp(outline_mm @ np.array([np.cos(ways), np.sin(ways)]), axis=0)
    # The radius of the circle of equal area and the mean radius differ by about half the square of unround.
    of_scale_mm, of_shape_mm = (photo.scale_uncertainty or 0.0) * radius_mm, unround**2 * radius_mm
    error_mm = float(np.linalg.norm([of_scale_mm, EDGE_PX * photo.mm_per_px, of_shape_mm]))
    return SpreadBlob(radius_mm, error_mm, unround, (float(wide_mm.min()), float(wide_mm.max())), photo.warnings)


def paste_edge(settings: PhotoInput, folder: Path) -> tuple[Photo, Floats]:
    """Return the photo, and the outline of the paste between the markers, (POINTS, 2) in px.

    Raises InputError if the scale is not from markers, or if no edge is found.
    """
    photo = load_photo(settings, folder)
    if photo.scale_uncertainty is None:
        raise InputError(
            f"{photo.file}: a photo of paste must have its scale from printed markers. Give the table of the printed "
            "sheet, and face_mm."
        )
    field = _opening(photo)
    light = _levelled(photo.brightness, field)
    blob, dark = _blob(light, field, photo.file)
    return photo, _edge(light, blob, dark, field, photo.file)


def _opening(photo: Photo) -> Booleans:
    """Return a mask of the opening of the marker frame, without a margin. Raises InputError if it is too small."""
    # The cutting line is just inside the opening.
    margin_mm = max(3 * photo.mm_per_px, 1.0)
    x_min, y_min, x_max, y_max = present(photo.face_mm, "the face of a marker sheet")
    box = x_min + margin_mm, y_min + margin_mm, x_max - margin_mm, y_max - margin_mm
    ring = np.round(photo.to_px(rectangle(box))).astype(np.int32)
    inside = cv2.fillPoly(np.zeros(photo.brightness.shape, np.uint8), [ring], 1) > 0
    if inside.sum() < (2 * MIN_HALF_PX) ** 2:
        raise InputError(
            f"{photo.file}: the field between the markers is too small in the photo. Move the camera closer."
        )
    return inside


def _levelled(brightness: Map, inside: Booleans) -> Map:
    """Return the brightness divided by the light on the sheet.

    The logarithm of the light is approximated by a plane that is fitted to the rim of the opening.
    """
    distance = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, 3)
    y, x = np.nonzero(inside & (distance < 0.06 * float(distance.max()) + 2))
    light = np.log(np.maximum(blurred(brightness, 1.0)[y, x], 1e-4)).astype(float)
    height, width = brightness.shape
    axes = np.column_stack([np.ones(len(x)), x / width, y / height])
    # The robust loss reduces the weight of a shadow or a splash on the rim.
    plane = least_squares(lambda plane: axes @ plane - light, np.zeros(3), loss="cauchy", f_scale=0.02).x
    along, down = np.arange(width) / width, np.arange(height)[:, None] / height
    return np.asarray(brightness / np.exp(plane[0] + plane[1] * along + plane[2] * down), np.float32)


def _blob(light: Map, inside: Booleans, file: Path) -> tuple[Booleans, bool]:
    """Return the mask of the largest blob that differs from the sheet, and True if it is darker than the sheet."""
    soft, blobs = blurred(light, 2.0), list[tuple[int, Booleans, bool]]()
    for dark in (True, False):
        unlike = 1 - soft if dark else soft - 1
        if (high := float(np.quantile(unlike[inside], 0.99))) < MIN_CONTRAST:
            continue
        opened = cv2.morphologyEx(((unlike > high / 2) & inside).astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5)))
        # Glints inside the blob are part of the paste.
        labels = np.asarray(label(ndimage.binary_fill_holes(opened)))
        if len(areas := np.bincount(labels.ravel())[1:]):
            blobs.append((int(areas.max()), labels == 1 + areas.argmax(), dark))
    if not blobs:
        raise InputError(
            f"{file}: no blob stands out between the markers. Take the photo in even light, with paste that is darker "
            "or lighter than the sheet, or put a coloured film under the paste."
        )
    return max(blobs, key=lambda blob: blob[0])[1:]


def _edge(light: Map, blob: Booleans, dark: bool, inside: Booleans, file: Path) -> Floats:
    """Return the outline, (POINTS, 2) in px: the line at half of the contrast between paste and nearby sheet.

    Raises InputError if the paste is too small in the photo, or if its edge is hidden.
    """
    depth_px = cv2.distanceTransform(blob.astype(np.uint8), cv2.DIST_L2, 5)
    if (half_px := float(depth_px.max())) < MIN_HALF_PX:
        raise InputError(
            f"{file}: half the width of the paste is {half_px:.0f} px, but at least {MIN_HALF_PX:g} px are needed. "
            "Take the photo from closer."
        )
    near_px = REACH * half_px
    away_px = cv2.distanceTransform((~blob).astype(np.uint8), cv2.DIST_L2, 5)
    paste = continued(light, depth_px > near_px, near_px)
    sheet = continued(light, (away_px > near_px) & inside, near_px)
    unlike = (blurred(light, 0.8) - (paste + sheet) / 2) * (-1 if dark else 1)
    contours = find_contours(np.where(inside, unlike, -1.0), 0.0)
    edge = max(contours, key=len)[:, ::-1]
    seen = sampled(ndimage.binary_erosion(inside, iterations=2).astype(np.float32), edge) > 0.99
    if seen.mean() < MIN_SEEN:
        raise InputError(
            f"{file}: the paste's edge is visible on only {seen.mean():.0%} of its circumference, but "
            f"{MIN_SEEN:.0%} is needed. Keep the paste between the markers and away from them, and avoid shadows "
            "and smears at its edge."
        )
    ring = edge[seen]
    return resampled(np.vstack([ring, ring[:1]]), arc_length(ring)[-1] / POINTS)[:-1]
