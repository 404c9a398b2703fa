"""Find stones in a crack and side cracks that leave it, in the dark region connected to its path.

The walls are then followed as if there were no stones and side cracks: past a stone, and straight across the mouth of a
side crack.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from manifold3d import CrossSection, FillRule
from scipy.spatial import KDTree
from skimage.measure import find_contours
from skimage.segmentation import clear_border

from digitise.crack_path.hints import CrackPath
from digitise.crack_path.medial_axis import (
    MIN_BRANCH,
    MIN_BRANCH_PX,
    distance_outside,
    holding,
    pieces,
    radius,
    side_lines,
)
from digitise.crack_path.profiles import unlike_length_px
from digitise.geometry.polyline import extended, resampled, signed_area, smoothed
from digitise.geometry.region import ISLAND_MM2
from digitise.image.raster import (
    Map,
    Mask,
    blurred,
    continued,
    draw_line,
    median_of,
    resized,
    scaled_down,
    shrunk,
    widened,
    window_around,
)
from digitise.photo import Photo
from digitise.walls.doubts import with_doubts
from digitise.walls.wall_profile import BLUR_PX, MIN_SEARCH_WIDTH_PX
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import present
from sealtwin.core.facts import doubt
from sealtwin.core.records import Booleans, Floats, Outline

# Constants of stones and side cracks. "widths" are crack widths.
#
# Chosen on drawn photos, checked on the tiers of benchmarks.tracing and on the sound trials. With lower limits of
# size, more grains, pores and stains are taken for stones and side cracks.
PAINT_DARK, PAINT_BRIGHT = 0.05, 0.8  # Brightness of a deep crack and of light mortar
WORK_PX = 20.0  # Width of the crack in the searched copy. A side crack a seventh as wide then has three pixels
REACH, AROUND = 2.5, 0.5  # Margin of the copy around the path: in widths, or in lengths of the path if that is more
# The crack is within the first number of widths of the path. Beyond the second are mortar or side cracks
CRACK, MORTAR = 0.25, 0.8
LEVEL_PX = 8.0  # Width of the crack in the small picture in which the levels are measured
SPREAD = 2.0  # Sigma of a Gaussian, in widths, over which a level is averaged
MIN_MM2 = 0.3  # Minimum area of a stone in a photo. Smaller bright spots are glints, or grains on the floor
MIN_SIDE = 0.15  # Minimum side of a stone in widths. A smaller stone does not divide the sealant
MIN_PX = 30  # Minimum number of pixels of a stone. Fewer may be noise
BRIGHT_WIDTHS = 1.0  # A bright area wider than this many widths is the ground between two cracks
SKIRT_PX = 3  # Reach of the blur around a stone and beside a side crack
AS_DARK = 0.6  # Largest lightness of a side crack, as a fraction of ``wall_share``. Scratches and stains are lighter
AS_WIDE = 1.5  # Largest width of a side crack, divided by the width of the main crack
SLENDER = 3.0  # Minimum length of a side crack, divided by its width. Shorter ones are pores, stains and broken edges
EDGE = 0.9  # A line is an edge, for example of a sample, if this fraction of its length has unlike sides
SWELLING = 2.0  # Largest distance of a side crack's rim from its line, in half widths. More is a pore or a stain
STEP_PX = 0.5  # Spacing of the centreline from which side cracks are drawn


class SideCrack(NamedTuple):
    """A side crack, in pixels of the photo."""

    line_px: Floats  # Middle line from the main crack's wall to the side crack's tip, or to the wall again, (n, 2)
    half_px: float  # Median half width
    comes_back: bool  # True if the side crack ends on the main crack's wall again
    rings_px: tuple[Floats, ...]  # Rim of the side crack, which ends within the main crack, and rims of stones in it


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Stones and side cracks of a path, and the pixels that they cover."""

    islands_mm: tuple[Floats, ...]  # Clockwise rings
    side_cracks: tuple[SideCrack, ...]
    hidden: Mask  # 255 on stones and side cracks in the photo, 0 elsewhere


class _Copy(NamedTuple):
    """A part of the photo at a resolution that suits the crack's width."""

    low_px: Floats
    factor: int  # Pixels of the photo per pixel of the copy
    way: Floats  # The path in the copy
    share: Map  # Lightness as a fraction of the contrast: 0 in the crack, 1 on mortar
    sample: Booleans  # True for pixels of the sample's face that no marker covers

    def to_photo(self, places: Floats) -> Floats:
        return (places + 0.5) * self.factor - 0.5 + self.low_px


def photo_of_paint(photo: Photo, path: CrackPath) -> Photo:
    """Return the painted piece under the path as a photo, dark on bright, so that it can be traced like a photo."""
    piece = holding(present(photo.drawn, "the paint"), path.points_px, connectivity=8)
    paint = np.where(piece, PAINT_DARK, PAINT_BRIGHT).astype(np.float32)
    return replace(photo, brightness=paint)


def find_surroundings(photo: Photo, path: CrackPath, wall_share: float) -> Surroundings:
    """Find the stones and side cracks of a path. Their rims are at ``wall_share`` of the contrast."""
    width_px = max(path.width_px, MIN_SEARCH_WIDTH_PX)
    copy = _copied(photo, path.points_px, width_px)
    crack = holding((copy.share <= wall_share) & copy.sample, copy.way)
    least = ISLAND_MM2 / photo.mm_per_px**2
    if path.source != "mask":
        least = max(MIN_MM2 / photo.mm_per_px**2, (MIN_SIDE * path.width_px) ** 2, MIN_PX)
    islands_px = []
    for stone in _enclosed(crack, least / copy.factor**2, BRIGHT_WIDTHS * path.width_px / copy.factor):
        alone = np.where(widened(stone, 1), copy.share, np.minimum(copy.share, wall_share))
        ring = max(_contours(copy, alone, wall_share, 0.0), key=lambda ring: abs(signed_area(ring)))
        islands_px.append(ring if signed_area(photo.to_mm(ring)) < 0 else ring[::-1])
        crack |= stone
    side_cracks = tuple(_side_cracks(photo, copy, crack, width_px / copy.factor, wall_share))
    hidden = np.zeros(photo.brightness.shape, np.uint8)
    for ring_px in islands_px:
        whole = [np.rint(ring_px).astype(np.int32)]
        cv2.fillPoly(hidden, whole, 255)
        cv2.polylines(hidden, whole, True, 255, 2 * SKIRT_PX + 1)
    for side in side_cracks:
        draw_line(hidden, side.line_px, width=2 * (side.half_px + SKIRT_PX))
    return Surroundings(tuple(photo.to_mm(ring_px) for ring_px in islands_px), side_cracks, hidden)


def _copied(photo: Photo, points_px: Floats, width_px: float) -> _Copy:
    """Return the copy of the photo around a path."""
    reach_px, factor = max(REACH * width_px, AROUND * arc_length(points_px)[-1]), max(1, int(width_px / WORK_PX))
    low, window = window_around(points_px, reach_px, photo.size_px)
    down, across = (side // factor for side in photo.brightness[window].shape)
    whole = np.s_[: down * factor, : across * factor]
    light = blurred(shrunk(photo.brightness[window][whole], (across, down)), BLUR_PX)
    sample = shrunk(photo.sample_mask()[window][whole], (across, down)) > 0.99 * 255
    way = (points_px - low + 0.5) / factor - 0.5
    return _Copy(low, factor, way, _share(light, sample, way, width_px / factor), sample)


def _share(light: Map, sample: Booleans, way: Floats, width: float) -> Map:
    """Return the lightness of each pixel as a fraction of the contrast: 0 for the crack along ``way``, 1 for mortar."""
    scale = min(1.0, LEVEL_PX / width)
    small = scaled_down(light, scale)
    shown = shrunk(sample.astype(np.float32), small.shape[::-1]) > 0.99
    on_path = np.zeros(small.shape, np.uint8)
    draw_line(on_path, (way + 0.5) * scale - 0.5)
    away = distance_outside(on_path > 0) / (width * scale)
    inside, beside = shown & (away < CRACK), shown & (away > MORTAR)
    # Farther away, more than half may be brighter than the sample, such as the paper of a frame.
    dark, usual = median_of(small[inside]), median_of(small[beside & (away < REACH)])
    # Side cracks, pores and paper are not mortar.
    mortar = beside & (small > (2 * dark + usual) / 3) & (small < 2 * usual)
    sigma = SPREAD * width * scale
    low, high = (resized(continued(small, where, sigma), light.shape) for where in (inside, mortar))
    return np.asarray((light - low) / np.maximum(high - low, np.float32(1e-6)), np.float32)


def _enclosed(crack: Booleans, least: float, widest: float) -> list[Booleans]:
    """Return a mask for each area that the crack surrounds.

    Areas with fewer than ``least`` cells, or wider than ``widest`` cells, are left out.
    """
    label, area = pieces(clear_border(~crack))
    stones = [label == number for number in np.flatnonzero(area >= least)]
    return [stone for stone in stones if 2 * radius(stone).max() <= widest]


def _side_cracks(photo: Photo, copy: _Copy, crack: Booleans, width: float, wall_share: float) -> list[SideCrack]:
    """Return the side cracks: side lines of the path that are dark and slender, and not the edge of a bright area."""
    to_rim, side_cracks = radius(crack), []
    way = np.clip(np.rint(copy.way[:, ::-1]).astype(np.int64), 0, np.array(crack.shape) - 1)
    way = way[crack[tuple(way.T)]]
    least = max(MIN_BRANCH * width, MIN_BRANCH_PX / copy.factor)
    for cells, comes_back in side_lines(crack, way, least) if len(way) > 1 else ():
        halves = to_rim[tuple(cells.T)]
        half = float(np.median(halves))
        # A skeleton ends before a round tip.
        line = extended(cells[:, ::-1].astype(float), 0, 0 if comes_back else halves[-1], 2 * halves[-1] + 3, 1.0)
        slender = arc_length(line)[-1] >= SLENDER * 2 * halves.max() and 2 * half < AS_WIDE * width
        if not slender or np.median(copy.share[tuple(cells.T)]) >= AS_DARK * wall_share:
            continue
        line_px, half_px = smoothed(resampled(copy.to_photo(line), 1.0), half * copy.factor), half * copy.factor
        if unlike_length_px(photo, line_px, 2 * half_px) < EDGE * len(line_px):
            near = np.zeros(crack.shape, np.uint8)
            draw_line(near, line, width=2 * SWELLING * half)
            alone = np.where(widened(holding(crack & (near > 0), line), 1), copy.share, 1)
            side_cracks.append(SideCrack(line_px, half_px, comes_back, tuple(_contours(copy, alone, wall_share, 1.0))))
    return side_cracks


def _contours(copy: _Copy, share: Map, level: float, beyond: float) -> list[Floats]:
    """Return the closed contours of ``share`` at ``level``, (n, 2) each in px of the photo.

    Outside the copy, the value of ``share`` is ``beyond``.
    """
    rings = find_contours(np.pad(share, 1, constant_values=beyond), level)
    return [copy.to_photo(ring[:-1, ::-1] - 1) for ring in rings]


def with_side_cracks(
    photo: Photo, outline: Outline, side_cracks: tuple[SideCrack, ...], keep: bool, least_width_px: float
) -> Outline:
    """Return the main crack's outline with its side cracks, and warnings about side cracks that are left out.

    If ``keep`` is True, side cracks of at least ``least_width_px`` become part of the outline's ring, and areas that
    they enclose become islands.
    """
    main, centreline = CrossSection([outline.outline_mm], FillRule.Positive), KDTree(outline.centreline_mm)
    joined, wide_mm, narrow_mm = main, [], []
    for side in side_cracks:
        line_mm, ends = photo.to_mm(side.line_px), [0, -1][: 1 + side.comes_back]
        feet_mm = outline.centreline_mm[np.asarray(centreline.query(line_mm[ends])[1])]
        rim = CrossSection([photo.to_mm(ring_px) for ring_px in side.rings_px], FillRule.EvenOdd)
        is_wide = (rim - main).area() >= least_width_px * photo.mm_per_px * arc_length(line_mm)[-1]
        (wide_mm if is_wide else narrow_mm).append(np.concatenate([feet_mm[:1], line_mm, feet_mm[1:]]))
        joined += rim if is_wide else CrossSection()
    warnings, ring_mm, enclosed_mm = [], outline.outline_mm, ()
    if wide_mm and keep:
        piece = max(joined.decompose(), key=lambda piece: piece.area())
        rings = [np.asarray(ring, float) for ring in piece.to_polygons()]
        ring_mm = max(rings, key=signed_area)
        enclosed_mm = tuple(ring for ring in rings if signed_area(ring) <= -ISLAND_MM2)
    elif wide_mm:
        text = f'{_left_out(wide_mm, photo.unit)}. Set photo.branches = "keep" to include side cracks'
        warnings.append(doubt("walls.side-cracks", text, len(wide_mm)))
    if narrow_mm:
        text = f"{_left_out(narrow_mm, photo.unit)}: under {least_width_px:g} px wide, which is too narrow to measure"
        warnings.append(doubt("walls.narrow-side-cracks", text, len(narrow_mm)))
    return with_doubts(
        outline,
        *warnings,
        **photo.in_both_units(outline=ring_mm),
        branches_mm=(*wide_mm, *narrow_mm),
        branches_kept=bool(wide_mm) and keep,
        islands_mm=enclosed_mm,
    )


def _left_out(lines_mm: list[Floats], unit: str) -> str:
    """Return number and lengths of side cracks as text, for example "2 side cracks (12 and 7 mm) are left out"."""
    lengths = " and ".join(f"{arc_length(line)[-1]:.0f}" for line in lines_mm)
    many = len(lines_mm) > 1
    return f"{len(lines_mm)} side crack{'s' * many} ({lengths} {unit}) {'are' if many else 'is'} left out"
