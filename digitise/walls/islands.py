"""Find stones that are surrounded by crack, before the walls are followed past them."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NewType

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.measure import find_contours

from digitise.crack_path.hints import CrackPath
from digitise.crack_path.medial_axis import distance_outside, holding, radius
from digitise.crack_path.sample_mask import sample_mask
from digitise.geometry.polyline import signed_area
from digitise.geometry.region import ISLAND_MM2
from digitise.image.raster import Map, continued, resized, shrunk, widened
from digitise.photo import Photo
from digitise.walls.centreline_and_walls import LEAST_WIDTH_PX
from digitise.walls.straightened import Patch, patch_around
from sealtwin.core.errors import present
from sealtwin.core.records import Floats

RetouchedPhoto = NewType("RetouchedPhoto", Photo)  # A photo with its own scale and partly changed brightness
PAINT_DARK, PAINT_BRIGHT = 0.05, 0.8  # Brightness of a deep crack and of light mortar
CRACK, MORTAR = 0.25, 0.8  # Crack widths from the path within which is crack, and beyond which mortar or side cracks
WORK_PX = 8.0  # Width of the crack in the small picture in which the levels are measured
SPREAD = 2.0  # Gaussian sigma over which a level is averaged, in crack widths
LEAST_MM2 = 0.3  # Least area of a stone in a photo; smaller bright places are glints, or grains on the floor
LEAST_SIDE = 0.15  # Least side of a stone over the crack's width; a smaller one does not divide the sealant
LEAST_PX = 30  # Least pixels of a stone; fewer may be noise
WIDEST = 1.0  # Crack widths above which a bright place is the ground between two cracks
REACH = 2.5  # Crack widths from the path to either side that are searched
SKIRT_PX = 3  # Reach of the blur that darkens mortar around a crack and brightens crack around mortar


def photo_of_paint(photo: Photo, path: CrackPath) -> RetouchedPhoto:
    """Return the painted piece under the path as a photo, dark on bright, so that the rules for photos apply to it."""
    piece = holding(present(photo.drawn, "the paint"), path.points_px, connectivity=8)
    paint = np.where(piece, PAINT_DARK, PAINT_BRIGHT).astype(np.float32)
    return RetouchedPhoto(replace(photo, brightness=paint))


@dataclass(frozen=True)
class Contrast:
    """Brightness levels of a crack and of the mortar around it at each place of a patch."""

    patch: Patch
    sample: NDArray[np.bool_]  # Pixels of the sample's face, and of no marker
    coarse_dark: Map
    coarse_bright: Map

    @cached_property
    def dark(self) -> Map:
        return resized(self.coarse_dark, self.patch.soft.shape)

    @cached_property
    def bright(self) -> Map:
        return resized(self.coarse_bright, self.patch.soft.shape)

    @cached_property
    def share(self) -> Map:
        """Share of the contrast: 0 in the crack, 1 on mortar."""
        return self.share_of(self.patch.soft)

    def share_of(self, light: Map) -> Map:
        """Return the share of the contrast of a copy of the patch in another size."""
        dark, bright = (resized(level, light.shape) for level in (self.coarse_dark, self.coarse_bright))
        return np.asarray((light - dark) / np.maximum(bright - dark, np.float32(1e-6)), dtype=np.float32)


def contrast(photo: Photo, path: CrackPath, patch: Patch) -> Contrast:
    """Measure the levels of the crack along ``path`` and of the mortar around it."""
    height, width = patch.soft.shape
    width_px = max(path.width_px, LEAST_WIDTH_PX)
    scale = min(1.0, WORK_PX / width_px)
    small = shrunk(patch.soft, (max(1, round(width * scale)), max(1, round(height * scale))))
    left, top = patch.offset_px
    sample = sample_mask(photo)[top : top + height, left : left + width] > 0
    shown = shrunk(sample.astype(np.float32), small.shape[::-1]) > 0.99
    off_path = np.ones(small.shape, dtype=np.uint8)
    cells = (path.points_px - patch.offset_px + 0.5) * scale - 0.5
    cv2.polylines(off_path, [np.rint(cells).astype(np.int32)], False, 0)
    away = distance_outside(off_path == 0) / (width_px * scale)
    sigma = SPREAD * width_px * scale
    inside, beside = shown & (away < CRACK), shown & (away > MORTAR)
    dark = float(np.median(small[inside])) if inside.any() else 0.0
    usual = float(np.median(small[beside])) if beside.any() else 0.0
    # Side cracks and pores are not mortar.
    mortar = beside & (small > (2 * dark + usual) / 3)
    return Contrast(patch, sample, continued(small, inside, sigma), continued(small, mortar, sigma))


def find_islands(photo: Photo, path: CrackPath, wall_share: float) -> tuple[tuple[Floats, ...], RetouchedPhoto]:
    """Return the stones, clockwise rings in mm at ``wall_share`` of the contrast, and the photo darkened there."""
    patch = patch_around(photo, path.points_px, REACH * max(path.width_px, LEAST_WIDTH_PX))
    levels = contrast(photo, path, patch)
    share, dark = levels.share, levels.dark
    stones = _enclosed(photo, path, patch, share > wall_share)
    if not stones:
        return (), RetouchedPhoto(photo)
    rings_mm: list[Floats] = []
    light = photo.brightness.copy()
    left, top = patch.offset_px
    window = light[top : top + share.shape[0], left : left + share.shape[1]]
    for stone in stones:
        around = widened(stone, SKIRT_PX)
        alone = np.where(widened(stone, 1), share, np.minimum(share, wall_share))
        rings = [photo.to_mm(ring[:-1, ::-1] + patch.offset_px) for ring in find_contours(alone, wall_share)]
        ring = max(rings, key=lambda ring: abs(signed_area(ring)))
        rings_mm.append(ring if signed_area(ring) < 0 else ring[::-1])
        window[around] = np.minimum(window, dark)[around]
    return tuple(rings_mm), RetouchedPhoto(replace(photo, brightness=light))


def _enclosed(photo: Photo, path: CrackPath, patch: Patch, bright: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
    """Return the bright places that the path's crack surrounds, one mask each."""
    own = holding(~bright, path.points_px - patch.offset_px)
    if not own.any():
        return []
    _, label, stats, _ = cv2.connectedComponentsWithStats((~own).astype(np.uint8), connectivity=8)
    least_px = ISLAND_MM2 / photo.mm_per_px**2
    if path.source != "mask":
        least_px = max(LEAST_MM2 / photo.mm_per_px**2, (LEAST_SIDE * path.width_px) ** 2, LEAST_PX)
    inside = (stats[:, :2] > 0).all(axis=1) & (stats[:, :2] + stats[:, 2:4] < bright.shape[::-1]).all(axis=1)
    numbers = np.flatnonzero(inside & (stats[:, cv2.CC_STAT_AREA] >= least_px))
    stones = [label == number for number in numbers if number > 0]
    return [stone for stone in stones if 2 * radius(stone).max() <= WIDEST * path.width_px]
