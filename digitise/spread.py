"""Find the outline of paste in a photo on the printed marker sheet, and area, mean radius and roundness of a blob."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.optimize import least_squares

from digitise.geometry.polyline import rectangle, resampled
from digitise.image.raster import Map, blurred, sampled
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats, Integers

RAYS = 360  # Rays from the middle along which the edge is searched
STEP_PX = 0.5
REACH = 0.12  # Range around the rough edge in which the exact one is searched, over the blob's radius
LEAST_RADIUS_PX = 40.0  # Below it half a pixel of the edge is over 6 % of the yield stress
LEAST_CONTRAST = 0.06  # Least change of light across the edge, over the sheet's light: blurred grain has a fifth of it
MOST_UNROUND = 0.10  # Largest RMS deviation over the mean radius; more means a sloped plate or a cone pulled aside
LEAST_SEEN, LEAST_SEEN_LONG = 0.8, 0.95
"""Smallest share of rays on which the edge must be found, first for a blob, then for a bead.

A hidden part of a round edge can be interpolated, but the end of a bead cannot."""
EDGE_PX = 0.5  # Standard uncertainty of the edge all around: paste ends in its blur, or on its wet rim


@dataclass(frozen=True)
class SpreadBlob:
    """A round blob in plan view."""

    radius_mm: float  # Radius of the circle of equal area
    radius_error_mm: float  # Standard uncertainty: scale, edge and shape
    unround: float  # Standard deviation of the outline's distance from the middle, over its mean
    diameters_mm: tuple[float, float]  # Least and largest distance of two parallel lines that touch it on both sides
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Rough:
    """Rough shape of the paste: a capsule. Rays from its spine find the edge. The spine of a round blob is a point."""

    middle_px: Floats
    half_spine_px: Floats  # From the middle to the spine's end, (2,)
    radius_px: float
    dark: bool  # True if darker than the sheet

    def rays(self) -> tuple[Floats, Floats]:
        """Return the start of each ray on the spine, and its direction, (RAYS, 2) each, at even steps of the edge."""
        half = float(np.linalg.norm(self.half_spine_px))
        forth = self.half_spine_px / half if half else np.array([0.0, 1.0])
        turn = np.linspace(0, np.pi, 10 * RAYS)[:, None]
        cap = self.radius_px * (np.cos(turn) * [forth[1], -forth[0]] + np.sin(turn) * forth)
        ring = np.vstack([cap[:1], cap + self.half_spine_px, -cap - self.half_spine_px, cap[:1]])
        edge = resampled(ring, arc_length(ring)[-1] / RAYS / 2)[1::2]
        starts = np.clip(edge @ forth, -half, half)[:, None] * forth
        return self.middle_px + starts, (edge - starts) / self.radius_px


def measure_spread(settings: PhotoInput, folder: Path) -> SpreadBlob:
    """Find the blob inside the frame of markers and measure it. Raises InputError if there is no round one."""
    photo, outline_px = paste_edge(settings, folder, long=False)
    outline_mm = photo.to_mm(outline_px)
    after_mm = np.roll(outline_mm, -1, axis=0)
    cross = outline_mm[:, 0] * after_mm[:, 1] - after_mm[:, 0] * outline_mm[:, 1]
    away_mm = np.linalg.norm(outline_mm - np.average(outline_mm + after_mm, axis=0, weights=cross) / 3, axis=1)
    radius_mm = float(np.sqrt(abs(cross.sum()) / 2 / np.pi))
    unround = float(away_mm.std() / away_mm.mean())
    if unround > MOST_UNROUND:
        raise InputError(
            f"{photo.file}: the blob is not round: its outline deviates from a circle by {unround:.0%} of its radius "
            f"(RMS); {MOST_UNROUND:.0%} are allowed. Level the plate, lift the cone straight up, and measure again."
        )
    ways = np.radians(np.arange(0, 180, 2.0))
    wide_mm = np.ptp(outline_mm @ np.array([np.cos(ways), np.sin(ways)]), axis=0)
    # The circle of its area and that of its mean radius differ by half the square of unround.
    of_scale_mm, of_shape_mm = (photo.scale_uncertainty or 0.0) * radius_mm, unround**2 * radius_mm
    error_mm = float(np.linalg.norm([of_scale_mm, EDGE_PX * photo.mm_per_px, of_shape_mm]))
    return SpreadBlob(radius_mm, error_mm, unround, (float(wide_mm.min()), float(wide_mm.max())), photo.warnings)


def paste_edge(settings: PhotoInput, folder: Path, *, long: bool) -> tuple[Photo, Floats]:
    """Return the photo, and the outline of the paste between the markers, (RAYS, 2) in px.

    ``long`` paste is a bead. Raises InputError if no edge is found.
    """
    photo, board, face_mm = load_photo(settings, folder), settings.markers, settings.face_mm
    if photo.scale_uncertainty is None or board is None or face_mm is None:
        raise InputError(
            f"{photo.file}: a photo of paste must have its scale from printed markers; give the table of the printed "
            "sheet, and face_mm."
        )
    inside = [marker.id for marker in board.markers if 0 < marker.x_mm < face_mm[0] and 0 < marker.y_mm < face_mm[1]]
    if inside:
        raise InputError(
            f"{photo.file}: face_mm is {face_mm[0]:g} x {face_mm[1]:g}, but marker {inside[0]} of the table is inside "
            "it: give the size of the opening."
        )
    field = _opening(photo)
    light = _levelled(photo.brightness, field)
    return photo, _edge(light, _rough(light, field, photo.file, long), field, photo.file)


def _opening(photo: Photo) -> NDArray[np.bool_]:
    """Return the mask of the sheet's free field, which is the opening of the frame less a margin."""
    # The cutting line is just inside the opening.
    margin_mm = max(3 * photo.mm_per_px, 1.0)
    x_min, y_min, x_max, y_max = present(photo.face_mm, "the face of a marker sheet")
    box = x_min + margin_mm, y_min + margin_mm, x_max - margin_mm, y_max - margin_mm
    ring = np.round(photo.to_px(rectangle(box))).astype(np.int32)
    inside = cv2.fillPoly(np.zeros(photo.brightness.shape, dtype=np.uint8), [ring], 1) > 0
    if inside.sum() < (2 * LEAST_RADIUS_PX) ** 2:
        raise InputError(
            f"{photo.file}: the field between the markers is too small in the photo; move the camera closer."
        )
    return inside


def _levelled(brightness: Map, inside: NDArray[np.bool_]) -> Map:
    """Divide by the light on the sheet. The logarithm of that light is a plane, fitted to the rim of the field."""
    distance = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, 3)
    y, x = np.nonzero(inside & (distance < 0.06 * float(distance.max()) + 2))
    light = np.log(np.maximum(blurred(brightness, 1.0)[y, x], 1e-4)).astype(float)
    height, width = brightness.shape
    axes = np.column_stack([np.ones(len(x)), x / width, y / height])
    # A shadow or a splash on the rim hardly counts.
    plane = least_squares(lambda plane: axes @ plane - light, np.zeros(3), loss="cauchy", f_scale=0.02).x
    along, down = np.arange(width) / width, np.arange(height)[:, None] / height
    return np.asarray(brightness / np.exp(plane[0] + plane[1] * along + plane[2] * down), np.float32)


def _rough(light: Map, inside: NDArray[np.bool_], file: Path, long: bool) -> Rough:
    """Return the largest blob unlike the sheet or, if ``long``, the capsule with its area and second moment."""
    soft, blobs = blurred(light, 2.0), list[tuple[int, NDArray[np.bool_], bool]]()
    for dark in (True, False):
        unlike = 1 - soft if dark else soft - 1
        if (high := float(np.quantile(unlike[inside], 0.99))) < LEAST_CONTRAST:
            continue
        opened = cv2.morphologyEx(((unlike > high / 2) & inside).astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5)))
        # Glints inside it are part of the paste.
        labels, count = ndimage.label(ndimage.binary_fill_holes(opened), np.ones((3, 3)))
        if count:
            areas = np.bincount(labels.ravel())[1:]
            blobs.append((int(areas.max()), labels == 1 + areas.argmax(), dark))
    if not blobs:
        raise InputError(
            f"{file}: no blob stands out between the markers: take the photo in even light, with paste that is darker "
            "or lighter than the sheet, or put a coloured film under it."
        )
    area, blob, dark = max(blobs, key=lambda blob: blob[0])
    places = np.argwhere(blob)[:, ::-1].astype(float)
    radius_px, half_spine_px = float(np.sqrt(area / np.pi)), np.zeros(2)
    if long:
        spread, axes = np.linalg.eigh(np.cov(places.T))
        # Across a long capsule the second moment is r^2 / 3; its length then follows from its area.
        radius_px = float(min(radius_px, np.sqrt(3 * spread[0])))
        half_spine_px = axes[:, 1] * max(0.0, (area / radius_px - np.pi * radius_px) / 4)
    if radius_px < LEAST_RADIUS_PX:
        raise InputError(
            f"{file}: the paste is {radius_px:.0f} px in {'half its width' if long else 'radius'}; at least "
            f"{LEAST_RADIUS_PX:g} are needed. Take the photo from closer."
        )
    return Rough(places.mean(axis=0), half_spine_px, radius_px, dark)


def _edge(light: Map, rough: Rough, inside: NDArray[np.bool_], file: Path) -> Floats:
    """Return the outline, (n, 2) in px: on each ray, the outermost crossing of half the contrast across the edge."""
    begins, rays = rough.rays()
    away = np.arange(0.3 * rough.radius_px, 1.8 * rough.radius_px, STEP_PX)
    places = begins[:, None] + away[None, :, None] * rays[:, None]
    free = sampled(inside.astype(np.float32), places) > 0.99
    unlike = (1 - sampled(blurred(light, 0.8), places).astype(float)) * (1 if rough.dark else -1) * free
    steps, paste = np.arange(len(away)), float(np.median(unlike[:, : len(away) // 6]))
    last = np.where(unlike > paste / 2, steps, -1).max(axis=1)
    # Half way between the paste inside this edge and the sheet outside: light differs around the blob.
    span = max(6, round(REACH * rough.radius_px / STEP_PX))

    def light_at(window: Integers) -> Floats:
        return np.median(np.take_along_axis(unlike, np.clip(last[:, None] + window, 0, steps[-1]), axis=1), axis=1)

    half = (light_at(np.arange(-span, -(span // 2))) + light_at(np.arange(span // 2, span))) / 2
    crossed = (unlike[:, :-1] >= half[:, None]) & (unlike[:, 1:] < half[:, None])
    at = np.where(crossed, np.abs(steps[:-1] - last[:, None]), len(steps)).argmin(axis=1)
    number = np.arange(RAYS)
    share = (unlike[number, at] - half) / np.maximum(unlike[number, at] - unlike[number, at + 1], 1e-9)
    radius = away[at] + share * STEP_PX
    measured = crossed.any(axis=1) & (last >= 0) & (last < steps[-1])
    measured &= free[number, np.minimum(last + 1, steps[-1])]
    least = LEAST_SEEN_LONG if rough.half_spine_px.any() else LEAST_SEEN
    if measured.mean() >= least:
        # A drop or a scratch at the edge affects few rays.
        filled = np.interp(number, number[measured], radius[measured], period=RAYS)
        usual = ndimage.median_filter(filled, 17, mode="wrap")
        measured &= np.abs(filled - usual) < max(2.0, 0.03 * rough.radius_px)
    if measured.mean() < least:
        raise InputError(
            f"{file}: the paste's edge is visible on only {measured.mean():.0%} of its circumference; {least:.0%} are "
            "needed. Keep the paste between the markers and away from them, and avoid shadows and smears at its edge."
        )
    radius = np.interp(number, number[measured], radius[measured], period=RAYS)
    return begins + radius[:, None] * rays
