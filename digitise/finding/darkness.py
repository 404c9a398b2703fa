"""How crack-like each pixel of a photo is, on a copy small enough to search."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.finding.lines import strength
from digitise.finding.surroundings import surroundings
from digitise.photo import Photo
from digitise.pictures.raster import Map, blurred, shrunk
from sealtwin.records import Floats, Integers

WORK_PX = 1000
"""Longer side of the copy: a path needs no more, the walls are refined on the photo itself."""
BACKGROUND_PX = 81
"""On the copy: dark things narrower than half of this do not count as background."""
EVEN_PX = 20.0
"""On the copy: sigma of the mean that brightness is compared with where lines are looked for."""
LEAST_LIGHT = 0.05
"""Of display brightness: what is darker is compared with this, or the noise of a black board would be lines."""
DISPLAY_GAMMA = 2.2
"""Of lightness as the eye and the camera's file count it: there, grain is as strong in the shade as in the light."""
DARKEST = 99
"""Percentile of darkness that a crack's middle has."""
EDGE_PX = 3
"""Of the photo: the outermost pixels of the face mix with what lies beside it."""
RIM_PX = 3
"""Of the copy: lines so close to its rim have no mortar on one side; many photos come with a frame."""


@dataclass(frozen=True)
class DarkMap:
    """A window of the photo, scaled down."""

    offset_px: tuple[float, float]
    """Of the window's left upper corner in the photo: x, y."""
    scale: float
    """Pixels here per pixel of the photo."""
    dark: Map
    """1 - brightness over local background, 0 to 1."""
    even: Map
    """Brightness as displayed, over its local mean."""
    ridge: Map
    """Answer of a dark line of the best-fitting width, in units of the noise around."""
    allowed: NDArray[np.bool_]
    """On the face and on no marker."""
    darkest: float
    """Darkness that one cell in a hundred of the whole map has: a crack's, where there is one."""

    def to_work(self, points_px: Floats) -> Floats:
        return (np.asarray(points_px, dtype=float) - self.offset_px + 0.5) * self.scale - 0.5

    def to_photo(self, points_work: Floats | Integers) -> Floats:
        return (np.asarray(points_work, dtype=float) + 0.5) / self.scale - 0.5 + self.offset_px

    def window(self, left: int, top: int, right: int, bottom: int) -> "DarkMap":
        """A part of the map, from a column and a row of it to others, these excluded."""
        part = np.s_[top:bottom, left:right]
        offset_px = (self.offset_px[0] + left / self.scale, self.offset_px[1] + top / self.scale)
        return replace(
            self,
            offset_px=offset_px,
            dark=self.dark[part],
            even=self.even[part],
            ridge=self.ridge[part],
            allowed=self.allowed[part],
        )


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
    if photo.face_px is None and seen_face_px is None:
        allowed &= ~surroundings(_around(_shown(light)))
    # What is beside the sample must look like sample, or its edge is the strongest line in the photo.
    light = _filled(light, allowed)
    shown = _shown(light)
    even = (shown / np.maximum(blurred(shown, EVEN_PX), LEAST_LIGHT)).astype(np.float32)
    ridge = np.where(inner(allowed), strength(even, allowed), 0).astype(np.float32)
    dark = _darkness(light, _around(shown))
    darkest = float(np.percentile(dark[allowed], DARKEST)) if allowed.any() else 0.0
    return DarkMap((left, top), scale, dark, even, ridge, allowed, darkest)


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


def inner(allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Less the rim of the map."""
    kept = allowed.copy()
    kept[:RIM_PX] = kept[-RIM_PX:] = False
    kept[:, :RIM_PX] = kept[:, -RIM_PX:] = False
    return kept


def _shown(light: Map) -> Map:
    """Brightness as displayed, 0 to 1."""
    return np.asarray(np.power(np.clip(light, 0, 1), 1 / DISPLAY_GAMMA), dtype=np.float32)


def _around(shown: Map) -> Map:
    """Displayed brightness less what is narrow; a median keeps the edges of shadows where they are."""
    size = min(BACKGROUND_PX, 2 * (min(shown.shape) // 4) + 1)
    # OpenCV's large medians are of whole numbers.
    around = cv2.medianBlur(np.rint(255 * shown).astype(np.uint8), size)
    return np.asarray(around, dtype=np.float32) / np.float32(255)


def _darkness(light: Map, around: Map) -> Map:
    """Darkness relative to the light around: 0 on plain mortar in any light, near 1 in a deep crack."""
    background = blurred(np.power(around, np.float32(DISPLAY_GAMMA)), BACKGROUND_PX / 16)
    return np.clip(1 - blurred(light, 0.8) / np.maximum(background, 1e-4), 0, 1).astype(np.float32)
