"""How crack-like each pixel of a photo is, on a copy small enough to search."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.photo import Photo
from digitise.raster import Map, blurred, shrunk
from sealtwin.records import Floats, Integers

WORK_PX = 1000
"""Longer side of the copy: a path needs no more, the walls are refined on the photo itself."""
RIDGE_SIGMAS_PX = (1.5, 3.0, 6.0, 12.0)
"""On the copy: cracks from 3 to 40 px wide answer to one of them."""
BACKGROUND_PX = 81
"""On the copy: dark things narrower than this do not count as background."""
EDGE_PX = 3
"""Of the photo: the outermost pixels of the face mix with what lies beside it."""


@dataclass(frozen=True)
class DarkMap:
    """A window of the photo, scaled down."""

    offset_px: tuple[float, float]
    """Of the window's left upper corner in the photo: x, y."""
    scale: float
    """Pixels here per pixel of the photo."""
    dark: Map
    """1 - brightness over local background, 0 to 1."""
    ridge: Map
    """Answer of a dark line of the best-fitting width, in units of its own noise."""
    allowed: NDArray[np.bool_]
    """On the face and on no marker."""

    def to_work(self, points_px: Floats) -> Floats:
        return (np.asarray(points_px, dtype=float) - self.offset_px + 0.5) * self.scale - 0.5

    def to_photo(self, points_work: Floats | Integers) -> Floats:
        return (np.asarray(points_work, dtype=float) + 0.5) / self.scale - 0.5 + self.offset_px

    def window(self, left: int, top: int, right: int, bottom: int) -> "DarkMap":
        """A part of the map, from a column and a row of it to others, these excluded."""
        part = np.s_[top:bottom, left:right]
        offset_px = (self.offset_px[0] + left / self.scale, self.offset_px[1] + top / self.scale)
        return DarkMap(offset_px, self.scale, self.dark[part], self.ridge[part], self.allowed[part])


def map_darkness(photo: Photo, region_px: Floats | None = None, seen_face_px: Floats | None = None) -> DarkMap:
    """Search map of the photo, or of the polygon ``region_px`` in it.

    ``seen_face_px`` are the corners of a face without a measured size: what is outside it is not searched.
    """
    left, top, right, bottom = _box(photo, region_px)
    light = photo.brightness[top:bottom, left:right]
    allowed = sample_mask(photo, seen_face_px)[top:bottom, left:right]
    if region_px is not None:
        allowed = np.minimum(allowed, _filled_polygon(allowed.shape, region_px - (left, top)))
    scale = min(1.0, WORK_PX / max(light.shape))
    size = (max(1, round(light.shape[1] * scale)), max(1, round(light.shape[0] * scale)))
    light = shrunk(light, size)
    allowed = shrunk(allowed.astype(np.float32), size) >= 254
    # What is beside the sample must look like sample, or its edge is the strongest line in the photo.
    light = _filled(light, allowed)
    dark = _flattened(blurred(light, 0.8))
    return DarkMap((left, top), scale, dark, np.where(allowed, _ridges(dark, allowed), 0).astype(np.float32), allowed)


def _box(photo: Photo, region_px: Floats | None) -> tuple[int, int, int, int]:
    """Left, top, right, bottom of what is searched; the last two excluded."""
    if region_px is None:
        return 0, 0, *photo.size_px
    left, top = np.maximum(np.floor(region_px.min(axis=0)), 0).astype(int)
    right, bottom = np.minimum(np.ceil(region_px.max(axis=0)) + 1, photo.size_px).astype(int)
    return int(left), int(top), int(right), int(bottom)


def _filled_polygon(shape: tuple[int, ...], corners_px: Floats) -> NDArray[np.uint8]:
    mask = np.zeros(shape, dtype=np.uint8)
    cv2.fillPoly(mask, [np.rint(corners_px * 16).astype(np.int32)], [255], shift=4)
    return mask


def sample_mask(photo: Photo, seen_face_px: Floats | None = None) -> NDArray[np.uint8]:
    """255 where the photo shows the sample's face and no marker, else 0, (height, width)."""
    width, height = photo.size_px
    face_px = photo.face_ring_px if photo.face_ring_px is not None else seen_face_px
    mask = np.full((height, width), 255, dtype=np.uint8)
    if face_px is not None:
        mask = _filled_polygon((height, width), face_px)
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * EDGE_PX + 1, 2 * EDGE_PX + 1))
        mask = np.asarray(cv2.erode(mask, disc), dtype=np.uint8)
    for quad in photo.markers_px:
        margin = quad.mean(axis=0) + 1.3 * (quad - quad.mean(axis=0))
        cv2.fillPoly(mask, [np.rint(margin * 16).astype(np.int32)], [0], shift=4)
    return mask


def _filled(light: Map, allowed: NDArray[np.bool_]) -> Map:
    """The picture with everything that is not allowed replaced by a smooth continuation of what is."""
    if allowed.all() or not allowed.any():
        return light
    weight = allowed.astype(np.float32)
    level = float(np.median(light[allowed]))
    sigma = BACKGROUND_PX / 4
    near = blurred(light * weight, sigma) + 1e-3 * level
    return np.where(allowed, light, near / (blurred(weight, sigma) + 1e-3)).astype(np.float32)


def _flattened(light: Map) -> Map:
    """Darkness relative to the brightness around: 0 on plain mortar in any light, near 1 in a deep crack."""
    size = min(BACKGROUND_PX, 2 * (min(light.shape) // 4) + 1)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    # Median first: a closing alone would rest on the brightest grains.
    background = cv2.morphologyEx(blurred(light, 3), cv2.MORPH_CLOSE, disc).astype(np.float32)
    background = blurred(background, size / 4)
    return np.clip(1 - light / np.maximum(background, 1e-4), 0, 1).astype(np.float32)


def _ridges(dark: Map, allowed: NDArray[np.bool_]) -> Map:
    """Largest principal curvature over scales (Lindeberg's normalisation, sigma squared), over its robust spread."""
    best = np.zeros_like(dark)
    for sigma in RIDGE_SIGMAS_PX:
        smooth = blurred(dark, sigma)
        xx = cv2.Sobel(smooth, cv2.CV_32F, 2, 0, ksize=3, scale=0.25)
        yy = cv2.Sobel(smooth, cv2.CV_32F, 0, 2, ksize=3, scale=0.25)
        xy = cv2.Sobel(smooth, cv2.CV_32F, 1, 1, ksize=3, scale=0.25)
        # A dark line is a crest of darkness: its curvature across is the most negative eigenvalue.
        across = -(xx + yy) / 2 + np.sqrt(((xx - yy) / 2) ** 2 + xy**2)
        spread = 1.4826 * float(np.median(np.abs(across[allowed]))) if allowed.any() else 0.0
        best = np.maximum(best, across * sigma**2 / max(spread * sigma**2, 2e-3))
    return best
