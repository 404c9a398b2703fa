"""The part of a photo around a crack, softened once and sampled often."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import Box
from digitise.photo import Photo
from digitise.pictures.raster import Map, blurred
from sealtwin.records import Floats

BLUR_PX = 0.8
"""Of the brightness before it is sampled: quiets grain and noise; a straight edge stays in its place."""
RIM_PX = 8
"""Around what is asked for: the softening reaches four of its sigmas."""
EDGE_PX = 1.5
"""So near the edge of the face, brightness is half that of what lies beside it."""
MARGIN = 1.3
"""A marker's white rim is no part of the sample either; over its black square."""


@dataclass(frozen=True)
class Patch:
    """A window of the photo. Places are (..., 2)."""

    offset_px: tuple[int, int]
    """Of the window's first pixel in the photo: x, y."""
    soft: Map
    """Brightness, blurred by ``BLUR_PX``."""
    clear: NDArray[np.uint8]
    """255 where no marker is."""
    face_mm: Box | None
    mm_per_px: float

    def light(self, places_px: Floats) -> Floats:
        """Brightness at each place; beyond the photo that of its border."""
        return _sampled(self.soft, places_px - self.offset_px, cv2.INTER_CUBIC, cv2.BORDER_REPLICATE).astype(float)

    def on_sample(self, places_px: Floats, places_mm: Floats) -> NDArray[np.bool_]:
        """Whether each place, given both ways, shows the sample and nothing else."""
        shown = _sampled(self.clear, places_px - self.offset_px, cv2.INTER_LINEAR, cv2.BORDER_CONSTANT) >= 254
        if self.face_mm is None:
            return shown
        low, high = np.array(self.face_mm[:2]), np.array(self.face_mm[2:])
        inside_mm = np.minimum(places_mm - low, high - places_mm).min(axis=-1)
        return shown & (inside_mm >= EDGE_PX * self.mm_per_px)


def patch_around(photo: Photo, points_px: Floats, reach_px: float) -> Patch:
    """The box of some points, ``reach_px`` larger on every side, as far as the photo goes."""
    margin = reach_px + RIM_PX
    left, top = np.maximum(np.floor(points_px.min(axis=0) - margin), 0).astype(int)
    right, bottom = np.minimum(np.ceil(points_px.max(axis=0) + margin) + 1, photo.size_px).astype(int)
    soft = blurred(photo.brightness[top:bottom, left:right], BLUR_PX)
    clear = np.full(soft.shape, 255, dtype=np.uint8)
    for quad in photo.markers_px:
        middle = quad.mean(axis=0)
        corners = middle + MARGIN * (quad - middle) - (left, top)
        cv2.fillPoly(clear, [np.rint(corners * 16).astype(np.int32)], [0], shift=4)
    return Patch((int(left), int(top)), soft, clear, photo.face_mm, photo.mm_per_px)


def _sampled(picture: NDArray, places_px: Floats, how: int, border: int) -> NDArray:
    x, y = np.moveaxis(places_px.astype(np.float32), -1, 0)
    if x.size == 0:
        return np.zeros(x.shape, dtype=picture.dtype)
    flat = x.reshape(len(x), -1), y.reshape(len(x), -1)
    return cv2.remap(picture, *flat, how, borderMode=border, borderValue=0).reshape(x.shape)
