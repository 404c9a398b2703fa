"""Follow a crack from end to end. Its centreline and the walls along it are measured in turn, in several passes."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from digitise.crack_path.hints import CrackPath, listed
from digitise.geometry.polyline import depth_inside, extended, resampled, smoothed
from digitise.image.raster import Mask, sampled
from digitise.photo import EDGE_PX, Photo
from digitise.walls.ends import Ends, Traced, crossings, find_tip, judge_ends
from digitise.walls.wall_profile import (
    MIN_SEARCH_WIDTH_PX,
    Crossings,
    Patch,
    Strip,
    Walls,
    find_walls,
    patch_around,
    rays_across,
    sample_step_mm,
    straighten,
)
from sealtwin.core.arc_length import arc_length
from sealtwin.core.arrays import runs
from sealtwin.core.errors import InputError
from sealtwin.core.records import Booleans, Floats
from sealtwin.core.solid_figures import EndKind, Span

STATION_PX = 2.5  # Spacing of stations: 0.25 mm at 0.1 mm/px


# Constants for following a crack. "widths" are crack widths.
#
# Chosen on drawn photos, in which the line is within 0.01 mm of the middle after two passes. The tiers of
# benchmarks.tracing, drawn later, and 117 photos of benchmarks/real_roads (benchmarks.line_constants) checked them. A
# longer ``REACH`` finds the walls from worse paths, but includes more neighbouring cracks. Less smoothing preserves
# sharper bends and more grain.
MIN_WIDTH_PX = 8.0  # Minimum width between walls. A smaller width depends more on blur and threshold than on the crack
MAX_BLUR = 1 / 5  # Largest sigma of the blur, divided by the width. With more, the width would be mostly blur
MAX_MISSING = 0.2  # Largest fraction of the path on which a wall may be missing or outside the photo
MIN_SLENDERNESS = 3.0  # Minimum ratio of length to width. A shorter crack has no direction to follow
PASSES = 2  # Minimum number of passes that centre the line
MAX_PASSES = 8  # Largest number of passes. A path along a wall needs more than two
CENTRED = 0.05  # A line needs no further pass if 95 % of its stations are within this many widths of the middle
REACH = 1.5  # A wall is searched for within this many widths to either side
EDGE_WIDTHS = 0.25  # A path may follow the face's edge within this many widths, plus twice the rim of the search
PATH_SMOOTHING = 0.75  # Sigma of the rough path's smoothing in widths, because its steps are cells of the search map
CENTRE_SMOOTHING = 0.25  # Sigma of the centreline's smoothing in widths
WALL_SMOOTHING = 3.0  # Sigma, in stations, with which the middle of the finished walls is smoothed
# Weight of that middle before an open end. Chosen on 40 drawn cracks (seeds 1 to 40), checked on others (41 to 80)
OPENING = 0.35
CORRECTIONS = 4  # Number of corrections of that smoothing. They preserve bends of more than 1.5 widths
PATH_AHEAD = 2.0  # Length of the rough path before an end, in widths, that defines the end's direction
TIP_AHEAD = 0.5  # Length of the centreline before a tip, in widths, that defines the tip's direction
ONWARD = 6  # Number of stations, 15 px, that define a wall's direction at the face's edge. Fewer would follow grain
BORDER_PX = 1.0  # Minimum distance from the photo's outermost pixels. Smoothing moves a wall by less
# Length by which the line is extended beyond an end, in widths
END_WIDTHS: dict[EndKind, float] = {"open": 3.0, "cut": 0.75, "closed": 1.0}


class WallsMissingError(InputError):
    """Raised if too few parts of the walls are clear enough to be followed."""


class TooThinError(InputError):
    """Raised if the crack is too thin for walls. Its width can be fitted instead."""


def trace(
    photo: Photo,
    path: CrackPath,
    wall_share: float,
    hidden: Mask,
    least_px: float = MIN_WIDTH_PX,
) -> Traced:
    """Follow both walls along ``path``. Across pixels that are ``hidden``, a wall is straight.

    A wall is placed at the fraction ``wall_share`` of the contrast. Raises InputError if the crack is too short,
    WallsMissingError if the walls are unclear, and TooThinError if the width is below ``least_px`` or mostly blur.
    """
    length_px = arc_length(path.points_px)[-1]
    if length_px < MIN_SLENDERNESS * path.width_px:
        raise InputError(
            f"{photo.file}: the crack is {length_px:.0f} px long and {path.width_px:.0f} px wide, but it must be at "
            f"least {MIN_SLENDERNESS:g} times as long as wide. Give ends_px farther apart."
        )
    width_mm = max(path.width_px, MIN_SEARCH_WIDTH_PX) * photo.mm_per_px
    patch = patch_around(
        photo, path.points_px, (max(END_WIDTHS.values()) + 2 * REACH) * width_mm / photo.mm_per_px, hidden
    )
    crack = _Crack(photo, patch, hidden, wall_share, STATION_PX * photo.mm_per_px)
    sigma = PATH_SMOOTHING * width_mm / crack.spacing_mm
    line_mm = smoothed(resampled(photo.to_mm(path.points_px), crack.spacing_mm), sigma)
    rim = crack.measure_walls(line_mm, width_mm)[1].rim
    inward_px = resampled(path.points_px, 1.0), resampled(path.points_px[::-1], 1.0)
    ends = judge_ends(photo, patch, inward_px, round(2 * path.width_px), path.width_px, (rim[0], rim[-1]))
    line_mm = _carried_on(photo, line_mm, ends, width_mm, crack.spacing_mm)
    for number in range(MAX_PASSES):
        strip, walls = crack.measure_walls(line_mm, width_mm)
        _check_found(photo, strip, walls.both_clear, (0.0, np.inf), 1.0)
        span_mm = crack.span_mm(line_mm, walls, ends)
        width_mm = max(walls.usual_width_mm, MIN_SEARCH_WIDTH_PX * photo.mm_per_px)
        line_mm = _recentred(strip, walls, ends, span_mm, width_mm, crack.spacing_mm)
        aside_mm = np.abs(np.diff(walls.away_mm, axis=0)[0][walls.both_clear]) / 2
        if number + 1 >= PASSES and np.percentile(aside_mm, 95) < CENTRED * width_mm:
            break
    strip, walls = crack.measure_walls(line_mm, width_mm, _crossings(photo, line_mm, ends))
    left_mm, right_mm = (
        _straight_on(strip.places_mm(away_mm), step, ends)
        for away_mm, step in zip(walls.away_mm * [[1], [-1]], walls.clear_step, strict=True)
    )
    line_mm = _to_openings(line_mm, left_mm, right_mm, ends)
    whole_mm = crack.span_mm(line_mm, walls, ends)
    span_mm = _shown_span_mm(photo, line_mm, (left_mm, right_mm), whole_mm)
    kinds = (ends[0].kind if span_mm[0] == whole_mm[0] else "cut", ends[1].kind if span_mm[1] == whole_mm[1] else "cut")
    width_px = walls.usual_width_mm / photo.mm_per_px
    seen = (walls.clear_step | walls.covered).all(axis=0) & (walls.open_line | walls.covered.any(axis=0))
    missing = _check_found(photo, strip, seen, span_mm, MAX_MISSING)
    least_px = max(least_px, walls.blur_px / MAX_BLUR)
    if width_px < least_px:
        raise TooThinError(
            f"{photo.file}: the crack is {width_px:.1f} px wide, but {least_px:.2g} px are needed between its walls."
        )
    beyond_mm = (whole_mm[1] - whole_mm[0]) - (span_mm[1] - span_mm[0])
    return Traced(line_mm, left_mm, right_mm, kinds, span_mm, width_px, missing, beyond_mm, clear_step=walls.clear_step)


@dataclass(frozen=True)
class _Crack:
    """Values that stay the same while a crack is followed."""

    photo: Photo
    patch: Patch
    hidden: Mask
    wall_share: float
    spacing_mm: float

    def measure_walls(
        self, line_mm: Floats, width_mm: float, crossings: Crossings | None = None
    ) -> tuple[Strip, Walls]:
        """Return the light across a line, and the walls in the light. At ``crossings``, rays follow the face's edge."""
        step_mm = sample_step_mm(width_mm, self.photo.mm_per_px)
        ray = rays_across(line_mm, width_mm, crossings or (None, None))
        strip = straighten(self.photo, self.patch, line_mm, ray, step_mm, REACH * width_mm)
        walls = find_walls(strip, width_mm, self.wall_share, crossings is not None)
        for side, sign in enumerate((1, -1)):
            wall_px = self.photo.to_px(strip.places_mm(sign * walls.away_mm[side]))
            covered = (sampled(self.hidden, wall_px) > 0) & ~walls.clear_step[side]
            _bridge(walls, side, covered, max(1, round(width_mm / self.spacing_mm)))
        return strip, walls

    def span_mm(self, line_mm: Floats, walls: Walls, ends: Ends) -> Span:
        """Return the arc lengths on the line at which the crack begins and ends."""
        s_mm, span_mm = arc_length(line_mm), []
        for end, crossing in zip(ends, _crossings(self.photo, line_mm, ends), strict=True):
            near_mm = s_mm[KDTree(line_mm).query(self.photo.to_mm(end.place_px))[1]]
            if crossing is not None:
                near_mm = crossing.s_mm
            elif end.kind == "closed":
                reach_mm = walls.usual_width_mm
                level = np.interp(near_mm, s_mm, walls.rim)
                near_mm = find_tip(self.photo, self.patch, line_mm, near_mm, reach_mm, level)
            span_mm.append(float(near_mm))
        return span_mm[0], span_mm[1]


def _bridge(walls: Walls, side: int, covered: Booleans, reach: int) -> None:
    """Make a wall straight across covered stations.

    On each side of the covered stations, the straight piece begins at the innermost point of the wall within ``reach``
    stations.
    """
    away_mm = walls.away_mm[side]
    for begin, end in runs(covered):
        first, last = max(begin - reach, 0), min(end + reach, len(away_mm))
        if first < begin and end < last:
            first, last = first + int(away_mm[first:begin].argmin()), end + int(away_mm[end:last].argmin())
            across = np.arange(first + 1, last)
            away_mm[across] = np.interp(across, [first, last], away_mm[[first, last]])
            walls.clear_step[side, across], walls.covered[side, across] = False, True


def _carried_on(photo: Photo, line_mm: Floats, ends: Ends, width_mm: float, spacing_mm: float) -> Floats:
    """Return the line extended to its tips and past its ends. Near an open end, it is replaced by a straight line."""
    first, last = 0, len(line_mm) - 1
    if photo.face_mm is not None:
        rim_mm = EDGE_WIDTHS * width_mm + 2 * EDGE_PX * photo.mm_per_px
        clear = np.flatnonzero(depth_inside(line_mm, photo.face_mm) > rim_mm)
        if len(clear) >= 2:
            first = clear[0] if ends[0].kind == "open" else first
            last = clear[-1] if ends[1].kind == "open" else last
    s_mm = arc_length(line_mm)
    before_mm, after_mm = (END_WIDTHS[end.kind] * width_mm for end in ends)
    before_mm, after_mm = before_mm + s_mm[first], after_mm + s_mm[-1] - s_mm[last]
    tips_mm = [photo.to_mm(end.place_px[None]) if end.kind == "closed" else np.empty((0, 2)) for end in ends]
    line_mm = np.concatenate([tips_mm[0], line_mm[first : last + 1], tips_mm[1]])
    return resampled(extended(line_mm, before_mm, after_mm, PATH_AHEAD * width_mm, spacing_mm), spacing_mm)


def _recentred(
    strip: Strip,
    walls: Walls,
    ends: Ends,
    span_mm: Span,
    width_mm: float,
    spacing_mm: float,
) -> Floats:
    """Return a smooth line half way between the walls. It continues straight past a tip."""
    middle_mm = strip.places_mm((walls.away_mm[0] - walls.away_mm[1]) / 2)
    s_mm = arc_length(strip.line_mm)
    between = np.flatnonzero(walls.both_clear & (s_mm > span_mm[0]) & (s_mm < span_mm[1]))
    closed = [end.kind == "closed" and len(between) > 1 for end in ends]
    first = between[0] if closed[0] else 0
    last = between[-1] if closed[1] else len(s_mm) - 1
    sigma = CENTRE_SMOOTHING * width_mm / spacing_mm
    line_mm = smoothed(resampled(middle_mm[first : last + 1], spacing_mm), sigma, CORRECTIONS)
    before_mm, after_mm = (END_WIDTHS["closed"] * width_mm * is_closed for is_closed in closed)
    return resampled(extended(line_mm, before_mm, after_mm, TIP_AHEAD * width_mm, spacing_mm), spacing_mm)


def _straight_on(wall_mm: Floats, has_step: Booleans, ends: Ends) -> Floats:
    """Return the wall, (n, 2), continued straight at open ends, where rays would otherwise follow the face's edge."""
    wall_mm = wall_mm.copy()
    for end, onward, step in zip(ends, (wall_mm[::-1], wall_mm), (has_step[::-1], has_step), strict=True):
        if end.kind == "open" and np.count_nonzero(step) > ONWARD:
            last = int(np.flatnonzero(step)[-1])
            step_mm = (onward[last] - onward[last - ONWARD]) / ONWARD
            onward[last + 1 :] = onward[last] + np.arange(1, len(onward) - last)[:, None] * step_mm
    return wall_mm


def _to_openings(line_mm: Floats, left_mm: Floats, right_mm: Floats, ends: Ends) -> Floats:
    """Return the line moved towards the middle of the finished walls in its half before an open end.

    Where the face's edge hides one wall, the line is at half the usual width from the other. The middle of the finished
    walls is that of the opening along the edge. The errors of both are independent.
    """
    opening_mm = smoothed((left_mm + right_mm) / 2, WALL_SMOOTHING)
    between_mm, half = line_mm + OPENING * (opening_mm - line_mm), len(line_mm) // 2
    first_mm, last_mm = (between_mm if end.kind == "open" else line_mm for end in ends)
    return np.concatenate([first_mm[:half], last_mm[half:]])


def _shown_span_mm(photo: Photo, line_mm: Floats, walls_mm: tuple[Floats, Floats], span_mm: Span) -> Span:
    """Return the longest part of a span with both walls in the photo. Raises InputError if that part is too short."""
    both_mm = np.concatenate(walls_mm)
    outside = photo.depth_px(photo.to_px(both_mm)) < BORDER_PX
    if photo.face_mm is not None:
        # Beyond the edge of the face, walls are not needed.
        outside &= depth_inside(both_mm, photo.face_mm) > 0
    hidden = np.logical_or(*outside.reshape(2, -1))
    s_mm = arc_length(line_mm)
    within = (s_mm >= span_mm[0]) & (s_mm <= span_mm[1])
    first, past = max(runs(within & ~hidden), key=np.ptp, default=(0, 1))
    if hidden[within].any():
        span_mm = float(max(span_mm[0], s_mm[first])), float(min(span_mm[1], s_mm[past - 1]))
    lost = 1 - (past - first) / max(np.count_nonzero(within), 1)
    if lost > MAX_MISSING:
        raise InputError(
            f"{photo.file}: a wall is outside the photo on {lost:.0%} of the path (at most {MAX_MISSING:.0%} is "
            "allowed). Give ends_px farther inside, or a photo that shows both walls."
        )
    return span_mm


def _crossings(photo: Photo, line_mm: Floats, ends: Ends) -> Crossings:
    """Return the line's crossings with the face's edge at open ends. Raises InputError if one is missing."""
    crossed = crossings(photo, line_mm, ends)
    if any(end.kind == "open" and crossing is None for end, crossing in zip(ends, crossed, strict=True)):
        raise InputError(
            f"{photo.file}: the crack runs along the edge of the face without crossing it. Give ends_px farther inside."
        )
    return crossed


def _check_found(photo: Photo, strip: Strip, seen: Booleans, span_mm: Span, most_missing: float) -> float:
    """Return the fraction of the crack along which a wall was not found.

    Raises WallsMissingError if the fraction is above ``most_missing``.
    """
    s_mm = arc_length(strip.line_mm)
    within = strip.valid[:, strip.middle] & (s_mm >= span_mm[0]) & (s_mm <= span_mm[1])
    missing = 1 - float(np.mean(seen[within])) if within.any() else 1.0
    if missing > most_missing or not seen.any():
        first, past = max(runs(within & ~seen), key=np.ptp, default=(0, len(s_mm)))
        stretch = listed(photo.to_px(strip.line_mm[[first, past - 1]]))
        raise WallsMissingError(
            f"{photo.file}: walls were not found along {missing:.0%} of the path (at most {MAX_MISSING:.0%} is "
            f"allowed), for example from {stretch} px. Check the photo for "
            "shadows and dirt along the crack, and give ends_px of a clearer part. Or draw the walls in walls_px, or "
            "paint the crack by hand in photo.mask, for example if the ground is coarse."
        )
    return missing
