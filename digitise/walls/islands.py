"""Stones left standing in a crack: mortar with crack all round it, seen before the walls are followed past it."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.measure import find_contours, points_in_poly

from digitise.finding.crack_path import CrackPath
from digitise.finding.medial import radius
from digitise.geometry.polyline import signed_area
from digitise.geometry.region import ISLAND_MM2
from digitise.photo import Photo
from digitise.walls.contrast import contrast
from digitise.walls.patch import Patch, patch_around
from digitise.walls.traced import LEAST_WIDTH_PX
from sealtwin.records import Floats, Outline

LEAST_MM2 = 0.3
"""Smaller bright places in a photo are glints, or grains of sand on the crack's floor."""
LEAST_SIDE = 0.15
"""Of the smallest stone, over the crack's width: a lesser one does not part the sealant."""
LEAST_PX = 30
"""With fewer pixels it may be noise."""
WIDEST = 1.0
"""Crack widths: what is wider parts two cracks, and the path goes along one of them."""
REACH = 2.5
"""Crack widths from the path, to either side, that are looked at."""
SKIRT_PX = 3
"""Blur brightens the crack so far around a stone."""


@dataclass(frozen=True)
class Islands:
    """Bright places with crack all round them."""

    rings_mm: tuple[Floats, ...]
    """Clockwise."""
    photo: Photo
    """The photo with the crack's own darkness where they stand: they hide no wall, and are none."""


def find_islands(photo: Photo, path: CrackPath, edge_fraction: float) -> Islands:
    """Each is drawn where light has risen by ``edge_fraction`` of the contrast, as the walls are."""
    patch = patch_around(photo, path.points_px, REACH * max(path.width_px, LEAST_WIDTH_PX))
    levels = contrast(photo, path, patch)
    share, dark = levels.share, levels.dark
    stones = _enclosed(photo, path, patch, share > edge_fraction)
    if not stones:
        return Islands((), photo)
    rings_mm: list[Floats] = []
    light = photo.brightness.copy()
    left, top = patch.offset_px
    window = light[top : top + share.shape[0], left : left + share.shape[1]]
    for stone in stones:
        around = cv2.dilate(stone, np.ones((2 * SKIRT_PX + 1,) * 2, np.uint8)) > 0
        alone = np.where(cv2.dilate(stone, np.ones((3, 3), np.uint8)) > 0, share, np.minimum(share, edge_fraction))
        rings = [photo.to_mm(ring[:-1, ::-1] + patch.offset_px) for ring in find_contours(alone, edge_fraction)]
        ring = max(rings, key=lambda ring: abs(signed_area(ring)))
        rings_mm.append(ring if signed_area(ring) < 0 else ring[::-1])
        window[around] = np.minimum(window, dark)[around]
    return Islands(tuple(rings_mm), replace(photo, brightness=light))


def with_islands(outline: Outline, islands: Islands) -> Outline:
    """The outline with those that stand in it, and a word about them."""
    standing = tuple(ring for ring in islands.rings_mm if points_in_poly(ring, outline.outline_mm).all())
    if not standing:
        return outline
    area_mm2 = sum(-signed_area(ring) for ring in standing)
    count = "1 island stands" if len(standing) == 1 else f"{len(standing)} islands stand"
    warning = f"{count} in the crack, {area_mm2:.1f} mm² in all: no sealant goes there"
    return replace(outline, islands_mm=(*standing, *outline.islands_mm), warnings=(*outline.warnings, warning))


def _enclosed(photo: Photo, path: CrackPath, patch: Patch, bright: NDArray[np.bool_]) -> list[NDArray[np.uint8]]:
    """Bright places in the crack that the path runs in, with that crack all round them; 1 in a picture of each."""
    crack = cv2.connectedComponents((~bright).astype(np.uint8), connectivity=4)[1]
    x, y = np.clip(np.rint(path.points_px - patch.offset_px).astype(int), 0, np.array(bright.shape[::-1]) - 1).T
    passed = crack[y, x][~bright[y, x]]
    if len(passed) == 0:
        return []
    own = crack == np.bincount(passed).argmax()
    _, label, stats, _ = cv2.connectedComponentsWithStats((~own).astype(np.uint8), connectivity=8)
    least_px = ISLAND_MM2 / photo.mm_per_px**2
    if path.source != "mask":
        least_px = max(LEAST_MM2 / photo.mm_per_px**2, (LEAST_SIDE * path.width_px) ** 2, LEAST_PX)
    low, high = stats[:, :2].min(axis=1) > 0, (stats[:, :2] + stats[:, 2:4] < bright.shape[::-1]).all(axis=1)
    large_enough = np.flatnonzero(low & high & (stats[:, cv2.CC_STAT_AREA] >= least_px))
    stones = [(label == number).astype(np.uint8) for number in large_enough if number > 0]
    return [stone for stone in stones if 2 * radius(stone > 0).max() <= WIDEST * path.width_px]
