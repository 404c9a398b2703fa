"""Find walls as the rim of the dark region along a path, on ground whose grain is as coarse as the crack.

If stones beside the crack are as large as the crack is wide, a profile across the crack has many steps, so walls cannot
be followed from step to step. The light is therefore averaged along the crack before it is compared with the ground.
Each of the two rims is then moved as a whole to half the contrast of the mean profile across the rim.
"""

from dataclasses import replace

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d

from digitise.crack_path.hints import CrackPath
from digitise.geometry.polyline import left_normals, resampled, smoothed
from digitise.image.raster import Mask, lightness
from digitise.photo import Photo, smaller
from digitise.walls.centreline_and_walls import CENTRE_SMOOTHING, CORRECTIONS, MIN_WIDTH_PX
from digitise.walls.ends import Traced, to_its_ends
from digitise.walls.wall_profile import (
    Strip,
    between,
    cheapest_wall,
    median_along,
    outward,
    patch_around,
    steadied,
    straighten,
)
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

# Constants of the dark region. "widths" are crack widths, and distances without a unit are px of the photo.
#
# Chosen on drawn roads, and checked on public photos of roads, masonry and concrete.
ENOUGH_PX = 40.0  # A crack wider than this, in px, is measured in a smaller copy of the photo
REACH = 2.4  # The strip extends this many widths to either side, plus ``REACH_PX``, but at most ``MAX_REACH_PX``
REACH_PX = 14.0
MAX_REACH_PX = 140.0
MEDIAN_WIDTHS = 0.5  # Length in widths of the median along the crack, limited to ``MEDIAN_PX``
MEDIAN_PX = (3.0, 31.0)
CORE = 0.25  # The crack's darkness is measured within this many widths of the line
CORE_PERCENTILE = 30.0
GROUND = 1.2  # Ground begins this many widths from the line, plus ``GROUND_PX``
GROUND_PX = 4.0
STEADY = 2.0  # Length in widths of the medians of darkness and ground
MIN_CONTRAST = 4.0  # Minimum contrast of lightness
RIM = 0.5  # Fraction of the contrast that defines the rim of the region
PASSES = 3  # Number of searches for the region, each along the middle of the region found before
PATH_SMOOTHING = 0.6  # Sigma of the smoothing of the rough path, and below of the line between the rims, in widths
LINE_SMOOTHING = 0.4
INSIDE_PX = 2.5  # The mean profile is crack from this far inside the rim, and ground from ``OUTSIDE_PX`` outside it
OUTSIDE_PX = 3.0
MAX_MOVED = 0.35  # Largest distance in widths by which a wall is moved
WIDTH_ERROR = 0.10  # Relative uncertainty of the mean width that the profile does not show (half of the 95 % interval)


def trace_dark_region(photo: Photo, path: CrackPath, wall_share: float, hidden: Mask) -> Traced:
    """Return the crack between the rims of the dark region along ``path``, at ``wall_share`` of the contrast.

    Pixels that are ``hidden`` do not count. Raises InputError if the region is too narrow.
    """
    factor = max(1, int(path.width_px / ENOUGH_PX))
    if factor > 1:
        # Finer pixels would not improve the mean rim.
        copy = smaller(photo, factor)
        shape = copy.brightness.shape[::-1]
        hidden = np.asarray(cv2.resize(hidden, shape, interpolation=cv2.INTER_NEAREST), np.uint8)
        traced = trace_dark_region(copy, path.in_copy(factor), wall_share, hidden)
        return replace(traced, width_px=traced.width_px * factor)
    patch, px = patch_around(photo, path.points_px, 2 * MAX_REACH_PX, hidden), photo.mm_per_px

    def measure_rims(line_mm: Floats, width_px: float, smoothing: float) -> tuple[Strip, Floats, float]:
        line_mm = resampled(smoothed(line_mm, smoothing * width_px), px)
        reach_mm = round(min(REACH * width_px + REACH_PX, MAX_REACH_PX)) * px
        strip = straighten(photo, patch, line_mm, left_normals(line_mm), px, reach_mm)
        rims_px = _rims_px(strip, width_px)
        return strip, rims_px, max(float(np.median(rims_px.sum(axis=0))), 4.0)

    line_mm = smoothed(resampled(photo.to_mm(path.points_px), px), 4.0)
    strip, rims_px, width_px = measure_rims(line_mm, max(path.width_px, 4.0), PATH_SMOOTHING)
    for _ in range(PASSES - 1):
        middle_mm = strip.places_mm((rims_px[0] - rims_px[1]) / 2 * px)
        strip, rims_px, width_px = measure_rims(resampled(middle_mm, px), width_px, LINE_SMOOTHING)
    moves_px, soft_px = _moves_px(strip, rims_px, width_px, wall_share)
    left_px, right_px = rims_px + moves_px[:, None]
    right_px = np.maximum(right_px, 1.0 - left_px)
    if (width_px := (left_px + right_px).mean()) < MIN_WIDTH_PX:
        fault = f"the dark region along the path is {width_px:.1f} px wide, but {MIN_WIDTH_PX:g} px are needed."
        raise InputError(fault, photo.file)
    middle_mm, left_mm, right_mm = (
        strip.places_mm(aside_px * px) for aside_px in ((left_px - right_px) / 2, left_px, -right_px)
    )
    middle_mm = smoothed(middle_mm, CENTRE_SMOOTHING * width_px, CORRECTIONS)
    lines_px = photo.to_px(middle_mm), photo.to_px(left_mm), photo.to_px(right_mm)
    return to_its_ends(photo, patch, lines_px, width_px, float(np.hypot(WIDTH_ERROR, soft_px / width_px)))


def _rims_px(strip: Strip, width_px: float) -> Floats:
    """Return the distance of both rims of the dark region from the line in px, left and right, (2, stations)."""
    along = int(np.clip(MEDIAN_WIDTHS * width_px, *MEDIAN_PX)) | 1
    light = median_along(lightness(strip.light), along, axis=0)
    away_px = np.abs(strip.offset_mm) / strip.mm_per_px
    over = int(max(9, STEADY * width_px)) | 1
    core, ground = away_px <= max(1.5, CORE * width_px), (away_px >= GROUND * width_px + GROUND_PX) & strip.valid
    dark = gaussian_filter1d(steadied(light[None, :, core], over, CORE_PERCENTILE), over / 4, axis=1)
    # Each side has its own ground, since a shadow's edge may lie along the crack.
    bright = gaussian_filter1d(steadied(outward(strip, np.where(ground, light, np.nan)), over), over / 4, axis=1)
    share = (outward(strip, light) - dark[..., None]) / np.maximum(bright - dark, MIN_CONTRAST)[..., None]
    excess = np.where(outward(strip, strip.valid), np.clip(share - RIM, -0.5, 0.5), 0)
    return cheapest_wall(excess, strip.sample_px, strip.station_px)


def _moves_px(strip: Strip, rims_px: Floats, width_px: float, wall_share: float) -> tuple[Floats, float]:
    """Return the distance by which each rim has to be moved outward, (2,), and half the width's 95 % interval, in px.

    A rim is moved to ``wall_share`` of the contrast of the mean profile across it. The mean over all stations averages
    the grain of the ground. The interval is the change of the width if ``wall_share`` changes by 0.1.
    """
    relative_px = np.arange(-max(6.0, 0.5 * width_px), max(8.0, 0.6 * width_px) + 0.1, 0.5)
    moves_px, soft_px = np.zeros(2), 0.0
    shown = np.where(strip.valid, strip.light, np.nan)
    for side, sign in enumerate((1, -1)):
        light = between(shown, sign * (rims_px[side][:, None] + relative_px) + strip.middle)
        usual = np.isfinite(light).mean(axis=0) >= 0.3
        profile, at_px = np.nanmean(light[:, usual], axis=0), relative_px[usual]
        inside, outside = profile[at_px <= -INSIDE_PX], profile[at_px >= OUTSIDE_PX]
        if len(inside) < 2 or len(outside) < 3:
            continue
        dark, bright = np.percentile(inside, 25), np.median(outside)
        levels = dark + (bright - dark) * np.array([wall_share - 0.1, wall_share, wall_share + 0.1])
        low_px, place_px, high_px = np.interp(levels, np.maximum.accumulate(profile), at_px)
        moves_px[side] = np.clip(place_px, -MAX_MOVED * width_px, MAX_MOVED * width_px)
        soft_px += (high_px - low_px) / 2
    return moves_px, soft_px
