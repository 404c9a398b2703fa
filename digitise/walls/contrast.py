"""How much of the way from crack to mortar each pixel around a crack has brightened."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.finding.crack_path import CrackPath
from digitise.finding.darkness import sample_mask
from digitise.photo import Photo
from digitise.pictures.raster import Map, blurred, shrunk
from digitise.walls.patch import Patch
from digitise.walls.traced import LEAST_WIDTH_PX

CRACK, MORTAR = 0.25, 0.8
"""Crack widths from the path: within the first is crack, beyond the other there is mortar, save in side cracks."""
WORK_PX = 8.0
"""Width of the crack in the small picture that tells the levels, which change slowly."""
SPREAD = 2.0
"""Crack widths: sigma of what is taken together for a level."""
FAR = 1e-3
"""Weight of the usual level beside the one nearby: it counts where nothing is near."""


@dataclass(frozen=True)
class Contrast:
    """The levels of a crack and of the mortar around it, everywhere in a patch."""

    patch: Patch
    sample: NDArray[np.bool_]
    """Where the patch shows the sample's face, and no marker."""
    coarse_dark: Map
    coarse_bright: Map

    @cached_property
    def dark(self) -> Map:
        return _sized(self.coarse_dark, self.patch.soft.shape)

    @cached_property
    def bright(self) -> Map:
        return _sized(self.coarse_bright, self.patch.soft.shape)

    @cached_property
    def share(self) -> Map:
        """0 in the crack, 1 on mortar."""
        return self.share_of(self.patch.soft)

    def share_of(self, light: Map) -> Map:
        """The same of a copy of the patch in another size."""
        dark, bright = (_sized(level, light.shape) for level in (self.coarse_dark, self.coarse_bright))
        return np.asarray((light - dark) / np.maximum(bright - dark, np.float32(1e-6)), dtype=np.float32)


def contrast(photo: Photo, path: CrackPath, patch: Patch) -> Contrast:
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
    away = cv2.distanceTransform(off_path, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) / (width_px * scale)
    sigma = SPREAD * width_px * scale

    def level(where: NDArray[np.bool_]) -> Map:
        weight = where.astype(np.float32)
        usual = float(np.median(small[where])) if where.any() else 0.0
        mean = (blurred(small * weight, sigma) + FAR * usual) / (blurred(weight, sigma) + FAR)
        return np.asarray(mean, dtype=np.float32)

    inside, beside = shown & (away < CRACK), shown & (away > MORTAR)
    dark = float(np.median(small[inside])) if inside.any() else 0.0
    usual = float(np.median(small[beside])) if beside.any() else 0.0
    # Side cracks and pores are no mortar.
    return Contrast(patch, sample, level(inside), level(beside & (small > (2 * dark + usual) / 3)))


def _sized(level: Map, shape: tuple[int, ...]) -> Map:
    return np.asarray(cv2.resize(level, shape[::-1]), dtype=np.float32)
