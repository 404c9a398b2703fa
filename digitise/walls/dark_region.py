"""Find walls as the rim of the dark region along a path: for ground whose grain is as coarse as the crack.

Where stones beside the crack are as large as it is, a profile across it has steps of their own, and walls cannot be
followed from step to step. The light is therefore evened along the crack before it is compared with the ground. The
rim that results is then moved, on each side as a whole, to half the contrast of the profile that is aligned to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import (
    binary_fill_holes,
    distance_transform_edt,
    gaussian_filter,
    gaussian_filter1d,
    median_filter,
    uniform_filter1d,
)
from skimage.filters import apply_hysteresis_threshold
from skimage.measure import label

from digitise.crack_path.hints import CrackPath
from digitise.geometry.polyline import depth_inside, extended, left_normals, resampled, smoothed, unit
from digitise.image.raster import lightness, sampled
from digitise.photo import Photo, in_copy, smaller
from digitise.walls.centreline_and_walls import Traced
from digitise.walls.ends import PathEnd, judge_end
from digitise.walls.straightened import Patch, edge_crossing, patch_around
from digitise.walls.stretches import MIN_WIDTH_PX
from digitise.walls.wall_profile import cheapest_way
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.core.solid_figures import EndKind

# Constants of the dark region. "widths" are crack widths, distances without a unit are px of the photo.
#
# Chosen on public photos of roads and masonry and on drawn roads. Higher ``LOW`` and ``HIGH`` make the region smaller
# before its rims are moved; the gate's limits decide between bare ground that passes and cracks that are refused.
ENOUGH_PX = 40.0  # Width in px from which a crack is measured in a smaller copy of the photo
MOST_WIDTH_PX = 180.0  # Reach of the first look for the crack's width, to both sides together
REACH = 2.4  # Widths to either side of the strip, plus ``REACH_PX``, at most ``MOST_REACH_PX``
REACH_PX = 14.0
MOST_REACH_PX = 140.0
ALONG = 0.5  # Widths of the median along the crack, within ``ALONG_PX``
ALONG_PX = (3.0, 31.0)
CORE = 0.25  # Widths from the line that give the crack's darkness
CORE_PERCENTILE = 30.0
GROUND = 1.2  # Widths from the line, plus ``GROUND_PX``, beyond which is ground
GROUND_PX = 4.0
STEADY = 2.0  # Widths along which darkness and ground are medians
LEAST_CONTRAST = 4.0  # Of lightness
LOW = 0.5  # Share of the contrast from which a place may belong to the region, and surely does
HIGH = 0.8
MIDDLE_PX = 3  # Distance from the line that a part of the region must reach
OFF_REGION = 30.0  # Cost of the line outside the region, and on the path there; inside: 1/(0.5 + depth)^2
ON_PATH = 15.0
LINE_STEP = 0.5  # Cost of the line's step aside by a px
LINE_SMOOTHING = 0.4  # Sigma of the line in widths
MIDDLE_SMOOTHING = 0.25  # Sigma of the final line in widths, and corrections of it, as of followed walls
RETURNS = 4
WALL_STEP = 0.25  # Cost of a wall's step aside by a px
WALL_STEEPEST = 3  # Largest step aside in px per px
INSIDE_PX = 2.5  # Distance inside the rim from which the aligned profile is the crack's, and outside it
OUTSIDE_PX = 3.0
MOST_MOVED = 0.35  # Largest distance in widths by which a wall is moved
DARKEST = 0.36  # Gate: most light inside over beside
LEAST_STEP = 0.2  # Gate: least 20th percentile of the lesser step from inside to a side, over the ground
LEAST_DARK = 0.7  # Gate: least share of the line darker than half
INSISTED = 0.2  # Added to the interval, like ``SURE``, for a region that does not pass the gate
SURE = 0.10  # Half of the 95 % interval of the mean width over the width that no profile can show


@dataclass(frozen=True)
class _Strip:
    """Light along a line, (stations, offsets), 1 px apart in both directions."""

    line_px: Floats
    offset_px: Floats
    light: Floats
    valid: NDArray[np.bool_]

    @property
    def middle(self) -> int:
        return len(self.offset_px) // 2

    def places_px(self, offset_px: Floats) -> Floats:
        return self.line_px + offset_px[:, None] * left_normals(self.line_px)


@dataclass(frozen=True)
class DarkRegion:
    """Walls of a dark region along a line in the photo."""

    line_px: Floats  # Down the middle, (n, 2)
    left_px: Floats  # On the left of travel in the photo
    right_px: Floats
    width_px: float
    spread: float  # Half the 95 % interval of the mean width over the width
    fault: str | None  # Why it may not be a crack; None if it passes the gate


def trace_dark_region(photo: Photo, path: CrackPath, wall_share: float, insisted: bool = False) -> Traced:
    """Return the crack between the rims of the dark region along ``path``, at ``wall_share`` of the contrast.

    Raises InputError if it is too narrow, or does not stand out from the ground as a crack does, unless a user has
    ``insisted`` by strokes.
    """
    factor = max(1, int(path.width_px / ENOUGH_PX))
    if factor > 1:
        # Pixels finer than that add nothing to the mean rim.
        narrow = replace(path, points_px=in_copy(path.points_px, factor), width_px=path.width_px / factor)
        traced = trace_dark_region(smaller(photo, factor), narrow, wall_share, insisted)
        return replace(traced, width_px=traced.width_px * factor)
    patch = patch_around(photo, path.points_px, MOST_REACH_PX + MOST_WIDTH_PX)
    region = dark_region(photo, patch, path.points_px, wall_share)
    if region.fault is not None and insisted:
        region = replace(region, spread=float(np.hypot(INSISTED, region.spread)))
    elif region.fault is not None:
        raise InputError(f"{photo.file}: {region.fault}")
    return _placed(photo, patch, replace(path, width_px=region.width_px), region)


def dark_region(photo: Photo, patch: Patch, points_px: Floats, wall_share: float = 0.5) -> DarkRegion:
    """Measure the dark region along a path in the photo."""
    line_px = smoothed(resampled(points_px, 1.0), 4.0)
    width_px = _first_width_px(photo, patch, line_px)
    strip = _strip(photo, patch, smoothed(line_px, 0.6 * width_px), _reach_px(width_px))
    region = _region(strip, width_px)
    line_px, width_px = _middle_of(strip, region)
    strip = _strip(photo, patch, line_px, _reach_px(width_px))
    rims_px = _rims_px(strip, _region(strip, width_px))
    width_px = max(float(np.median(rims_px.sum(axis=0))), 1.0)
    moves_px, spread_px = _moves_px(strip, rims_px, width_px, wall_share)
    left_px, right_px = rims_px + moves_px[:, None]
    right_px = np.maximum(right_px, 1.0 - left_px)
    mean_px = float((left_px + right_px).mean())
    return DarkRegion(
        smoothed(strip.places_px((left_px - right_px) / 2), MIDDLE_SMOOTHING * mean_px, RETURNS),
        strip.places_px(left_px),
        strip.places_px(-right_px),
        mean_px,
        float(np.hypot(SURE, spread_px / max(mean_px, 1.0))),
        _fault(strip, left_px, right_px),
    )


def _reach_px(width_px: float) -> int:
    return round(min(REACH * width_px + REACH_PX, MOST_REACH_PX))


def _strip(photo: Photo, patch: Patch, line_px: Floats, reach_px: int) -> _Strip:
    line_px = resampled(line_px, 1.0)
    offset_px = np.arange(-reach_px, reach_px + 1.0)
    place_px = line_px[:, None] + offset_px[:, None] * left_normals(line_px)[:, None]
    width, height = photo.size_px
    valid = patch.on_sample(place_px, photo.to_mm(place_px.reshape(-1, 2)).reshape(place_px.shape))
    valid &= depth_inside(place_px, (0, 0, width - 1, height - 1)) >= 0
    return _Strip(line_px, offset_px, sampled(photo.brightness, place_px).astype(float), valid)


def _first_width_px(photo: Photo, patch: Patch, line_px: Floats) -> float:
    """Return the width of the dark band in the profile that is averaged along the whole path."""
    strip = _strip(photo, patch, line_px, round(min(MOST_WIDTH_PX / 2, min(photo.size_px) / 3)))
    shown = np.where(strip.valid, lightness(strip.light), np.nan)
    some = np.isfinite(shown).any(axis=0)
    profile = np.full(len(strip.offset_px), np.inf)
    profile[some] = np.nanmean(shown[:, some], axis=0)
    profile[some] = gaussian_filter1d(profile[some], 1.0)
    near = slice(strip.middle - 2, strip.middle + 3)
    darkest = strip.middle - 2 + int(np.argmin(profile[near]))
    half = (profile[darkest] + np.percentile(profile[some], 75)) / 2
    bright = np.flatnonzero(profile >= half)
    ends = bright[bright < darkest].max(initial=-1), bright[bright > darkest].min(initial=len(profile))
    return float(max(4.0, ends[1] - ends[0] - 1))


def _region(strip: _Strip, width_px: float) -> NDArray[np.bool_]:
    """Return the dark region of a strip: the parts that reach the line, with their holes filled."""
    along = int(np.clip(ALONG * width_px, *ALONG_PX)) | 1
    light = median_filter(lightness(strip.light), (along, 1), mode="nearest")
    away_px = np.abs(strip.offset_px)
    core = away_px <= max(1.5, CORE * width_px)
    beside = away_px >= GROUND * width_px + GROUND_PX
    dark = np.percentile(light[:, core], CORE_PERCENTILE, axis=1)
    station = np.arange(len(light))
    over = int(max(9, STEADY * width_px)) | 1

    def steady(level: Floats) -> Floats:
        return gaussian_filter1d(median_filter(level, over, mode="nearest"), over / 4)

    dark, share = steady(dark), np.zeros(light.shape)
    for side in (strip.offset_px >= 0, strip.offset_px <= 0):
        # Each side has its own ground, since a shadow's edge may lie along the crack.
        ground = np.where(strip.valid[:, beside & side], light[:, beside & side], np.nan)
        shown = np.isfinite(ground).any(axis=1)
        if shown.any():
            bright = steady(np.interp(station, station[shown], np.nanmedian(ground[shown], axis=1)))
            contrast = np.maximum(bright - dark, LEAST_CONTRAST)[:, None]
            share[:, side] = ((bright[:, None] - light) / contrast)[:, side]
    region = apply_hysteresis_threshold(np.where(strip.valid, share, 0), LOW, HIGH)
    parts = np.asarray(label(region, connectivity=2))
    own = np.unique(parts[:, strip.middle - MIDDLE_PX : strip.middle + MIDDLE_PX + 1])
    return np.asarray(binary_fill_holes(np.isin(parts, own[own > 0])))


def _middle_of(strip: _Strip, region: NDArray[np.bool_]) -> tuple[Floats, float]:
    """Return the line down the middle of a region, and the region's usual width."""
    # Beyond the photo the region goes on.
    depth_px = np.asarray(distance_transform_edt(np.pad(region, 1, mode="edge")))[1:-1, 1:-1]
    cost = np.where(region, 1 / (0.5 + depth_px) ** 2, OFF_REGION)
    cost[:, strip.middle] = np.minimum(cost[:, strip.middle], ON_PATH)
    price = LINE_STEP * np.arange(-2.0, 3.0) ** 2
    column = cheapest_way(cost[None], price)[0]
    width_px = max(4.0, 2 * float(np.median(depth_px[np.arange(len(column)), column])) - 1)
    line_px = strip.places_px(strip.offset_px[column])
    return smoothed(resampled(line_px, 1.0), LINE_SMOOTHING * width_px), width_px


def _rims_px(strip: _Strip, region: NDArray[np.bool_]) -> Floats:
    """Return the distance of both rims from the line, left and right, (2, stations)."""
    inside = gaussian_filter(region.astype(float), 1.0)
    excess = np.where(strip.valid, 0.5 - inside, 0)
    outward = np.stack([excess[:, strip.middle :], excess[:, strip.middle :: -1]])
    price = WALL_STEP * np.arange(-WALL_STEEPEST, WALL_STEEPEST + 1.0) ** 2
    return np.asarray(cheapest_way(np.cumsum(outward, axis=2), price) + 0.5, dtype=float)


def _moves_px(strip: _Strip, rims_px: Floats, width_px: float, wall_share: float) -> tuple[Floats, float]:
    """Return the distance outward from each rim to ``wall_share``, (2,), and half the width's 95 % interval.

    The profile is the mean over all stations, aligned to the rim, so that the grain of the ground averages out. The
    interval is from its softness: how far the width changes if the level does by 0.1.
    """
    relative_px = np.arange(-max(6.0, 0.5 * width_px), max(8.0, 0.6 * width_px) + 0.1, 0.5)
    inner, outer = relative_px <= -INSIDE_PX, relative_px >= OUTSIDE_PX
    moves_px, soft_px = np.zeros(2), 0.0
    levels = wall_share - 0.1, wall_share, wall_share + 0.1
    for side, sign in enumerate((1, -1)):
        column = sign * (rims_px[side][:, None] + relative_px) + strip.middle
        first = np.clip(column.astype(int), 0, len(strip.offset_px) - 2)
        here, there = (np.take_along_axis(strip.light, first + step, axis=1) for step in (0, 1))
        light = here + (column - first) * (there - here)
        shown = np.take_along_axis(strip.valid, first, axis=1) & (column >= 0) & (column <= len(strip.offset_px) - 1)
        usual = shown.mean(axis=0) >= 0.3
        if np.count_nonzero(usual & inner) < 2 or np.count_nonzero(usual & outer) < 3:
            continue
        profile = np.nanmean(np.where(shown, light, np.nan)[:, usual], axis=0)
        at_px = relative_px[usual]
        dark, bright = np.percentile(profile[inner[usual]], 25), np.median(profile[outer[usual]])
        places = [_crossing_px(profile, at_px, dark + level * (bright - dark)) for level in levels]
        if places[1] is not None:
            moves_px[side] = np.clip(places[1], -MOST_MOVED * width_px, MOST_MOVED * width_px)
        if places[0] is not None and places[2] is not None:
            soft_px += abs(places[2] - places[0]) / 2
    return moves_px, soft_px


def _crossing_px(profile: Floats, at_px: Floats, level: float) -> float | None:
    """Return the rising crossing of a level that is nearest to the rim; None if there is none."""
    rising = np.flatnonzero((profile[:-1] < level) & (profile[1:] >= level))
    if len(rising) == 0:
        return None
    here, there = profile[rising], profile[rising + 1]
    places = at_px[rising] + (level - here) / (there - here) * (at_px[1] - at_px[0])
    return float(places[np.argmin(np.abs(places))])


def _fault(strip: _Strip, left_px: Floats, right_px: Floats) -> str | None:
    """Return what a region lacks for a crack, in blocks of one width; None if it lacks nothing."""
    widths_px = left_px + right_px
    width_px, offset = float(np.median(widths_px)), strip.offset_px[None]
    if width_px < MIN_WIDTH_PX:
        return f"the dark region along the path is {width_px:.1f} px wide; {MIN_WIDTH_PX:g} px are needed."
    light = np.where(strip.valid, strip.light, np.nan)
    high, low = left_px[:, None], -right_px[:, None]
    inside = np.where((offset < high - 0.15 * width_px) & (offset > low + 0.15 * width_px), light, np.nan)
    left = np.where((offset > high + 0.25 * width_px + 1) & (offset < high + width_px + 3), light, np.nan)
    right = np.where((offset < low - 0.25 * width_px - 1) & (offset > low - width_px - 3), light, np.nan)
    blocks = max(1, len(left_px) // max(6, int(width_px)))
    dark, beside_left, beside_right = (_block_means(each, blocks) for each in (inside, left, right))
    sides = np.concatenate([beside_left, beside_right])
    if not np.isfinite(sides).any() or not np.isfinite(dark).any():
        return "the ground beside the path is not in view."
    ground = float(np.nanmedian(sides))
    step = np.fmin(beside_left, beside_right) - dark
    level = (ground + float(np.nanpercentile(dark, 20))) / 2
    along = uniform_filter1d(strip.light[:, strip.middle], max(3, int(width_px / 2)))
    ratio, worst, share = float(np.nanmedian(dark)) / ground, float(np.nanpercentile(step, 20)) / ground, along < level
    if ratio > DARKEST or worst < LEAST_STEP or share.mean() < LEAST_DARK:
        return (
            f"the dark region along the path does not stand out as a crack: inside it has {ratio:.0%} of the light "
            f"beside it (at most {DARKEST:.0%}), and {share.mean():.0%} of its middle is dark (at least "
            f"{LEAST_DARK:.0%})."
        )
    return None


def _block_means(values: Floats, blocks: int) -> Floats:
    """Return the mean of each of ``blocks`` stretches, without NaN; NaN for a stretch that has no values."""
    cuts = np.linspace(0, len(values), blocks + 1).astype(int)[:-1]
    shown = np.isfinite(values)
    total = np.add.reduceat(np.where(shown, values, 0).sum(axis=1), cuts)
    count = np.add.reduceat(shown.sum(axis=1), cuts)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _placed(photo: Photo, patch: Patch, path: CrackPath, region: DarkRegion) -> Traced:
    """Return the region's walls in mm, from end to end."""
    line_px, left_px, right_px = region.line_px, region.left_px, region.right_px
    beside_px = 1.2 * region.width_px * left_normals(line_px)
    threshold = float(np.median(patch.light(line_px)) + np.median(patch.light(line_px + beside_px))) / 2
    back = min(len(line_px) - 1, max(5, round(path.width_px)))
    aheads = unit(line_px[0] - line_px[back]), unit(line_px[-1] - line_px[-1 - back])
    ends = [
        judge_end(photo, patch, line_px[at], ahead, path.width_px, threshold)
        for at, ahead in zip((0, -1), aheads, strict=True)
    ]
    kinds: tuple[EndKind, EndKind] = (ends[0].kind, ends[1].kind)
    places = [photo.to_mm(_to_tips(each, ends, aheads, line_px)) for each in (line_px, left_px, right_px)]
    before_mm, after_mm = (1.5 * path.width_px * photo.mm_per_px * (kind == "open") for kind in kinds)
    over_mm, spacing_mm = path.width_px * photo.mm_per_px, photo.mm_per_px
    # y runs down in the photo, so that left in the photo is right on the face.
    line_mm, right_mm, left_mm = (extended(each, before_mm, after_mm, over_mm, spacing_mm) for each in places)
    s_mm = arc_length(line_mm)
    span_mm = [0.0, float(s_mm[-1])]
    for number, kind in enumerate(kinds):
        if kind == "open" and photo.face_mm is not None:
            crossing = edge_crossing(line_mm, photo.face_mm, at_start=number == 0)
            if crossing is not None:
                span_mm[number] = crossing.s_mm
    return Traced(line_mm, left_mm, right_mm, kinds, (span_mm[0], span_mm[1]), region.width_px, 0.0, 0.0, region.spread)


def _to_tips(places_px: Floats, ends: Sequence[PathEnd], aheads: Sequence[Floats], line_px: Floats) -> Floats:
    """Return a line or wall with the tips of closed ends that are beyond ``line_px``."""
    first, last = (
        end.place_px[None] if end.kind == "closed" and (end.place_px - line_px[at]) @ ahead > 1.0 else np.empty((0, 2))
        for end, ahead, at in zip(ends, aheads, (0, -1), strict=True)
    )
    return np.concatenate([first, places_px, last])
