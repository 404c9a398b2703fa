"""Follow a crack from end to end. The line down its middle and the walls along it are measured in turn."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from digitise.crack_path.hints import CrackPath
from digitise.crack_path.sample_mask import EDGE_PX
from digitise.geometry.polyline import depth_inside, extended, resampled, smoothed, tangents, unit
from digitise.photo import Photo
from digitise.walls.ends import PathEnd, find_tip, judge_end
from digitise.walls.straightened import (
    Crossing,
    Crossings,
    Patch,
    Strip,
    edge_crossing,
    patch_around,
    rays_across,
    sample_step_mm,
    straighten,
)
from digitise.walls.stretches import MIN_WIDTH_PX, MOST_MISSING
from digitise.walls.wall_profile import Walls, find_walls
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.core.solid_figures import EndKind

STATION_PX = 2.5  # Spacing of stations: 0.25 mm at 0.1 mm/px
LEAST_WIDTH_PX = 6.0  # Least width to begin with


# Constants of following a crack. "widths" are crack widths.
#
# Chosen on drawn photos: the line is then within 0.01 mm of the middle after two passes. A longer ``REACH`` finds the
# walls from worse paths and sees more neighbouring cracks; less smoothing keeps sharper bends and more grain.
MOST_BLUR = 1 / 5  # Largest sigma of the blur over the width; above it blur decides the width
LEAST_SLENDERNESS = 3.0  # Least length over width; a shorter crack has no direction to follow
PASSES = 2  # Least number of passes that centre the line
MOST_PASSES = 8  # Largest number of passes; a path along a wall needs more than two
CENTRED = 0.05  # Widths off the middle, at 95 % of the stations, within which a line needs no further pass
REACH = 1.5  # Widths to either side that are searched for a wall
CLEAR = 0.25  # Widths from the face's edge, plus twice the search's rim, within which a path may follow it
PATH_SMOOTHING = 0.75  # Sigma of the rough path in widths: its steps are cells of the search map
CENTRE_SMOOTHING = 0.25  # Sigma of the centreline in widths
RETURNS = 4  # Corrections of that smoothing, so that bends of over 1.5 widths stay
PATH_AHEAD = 2.0  # Widths of the rough path before an end that give its direction
TIP_AHEAD = 0.5  # The same before a tip
ONWARD = 6  # Stations, 15 px, that give a wall's direction at the face's edge; fewer follow grain
BORDER_PX = 1.0  # Least distance from the photo's outermost pixels: smoothing moves a wall by less


BEYOND: dict[EndKind, float] = {"open": 3.0, "cut": 0.75, "closed": 1.0}  # Widths added to the line

Ends = tuple[PathEnd, PathEnd]


class WallsMissingError(InputError):
    """Too little of the walls is clear to follow them."""


class TooThinError(InputError):
    """The crack is too thin for walls; its width can be fitted."""


@dataclass(frozen=True)
class Traced:
    """A line past the crack's ends, and the walls along it."""

    line_mm: Floats  # Down the middle, (n, 2); half a width from one wall if the other has left the face
    left_mm: Floats
    right_mm: Floats
    kinds: tuple[EndKind, EndKind]
    span_mm: tuple[float, float]  # Arc length on the line at which the crack begins and ends
    width_px: float  # Median width in pixels of the photo
    missing: float  # Share of the crack with one or both walls missing
    beyond_mm: float  # Length of path omitted at its ends because a wall is outside the photo
    width_spread: float | None = None
    """Half the 95 % interval of a dark region's mean width, over that width; None if walls were followed."""


def trace(photo: Photo, path: CrackPath, wall_share: float) -> Traced:
    """Follow both walls along ``path``. Raises InputError if the crack is too short.

    Raises WallsMissingError if it is unclear, and TooThinError if blur would decide its width.
    """
    length_px = float(arc_length(path.points_px)[-1])
    if length_px < LEAST_SLENDERNESS * path.width_px:
        raise InputError(
            f"{photo.file}: the crack is {length_px:.0f} px long and {path.width_px:.0f} px wide; it must be "
            f"at least {LEAST_SLENDERNESS:g} times as long as wide: give ends_px farther apart."
        )
    width_px = max(path.width_px, LEAST_WIDTH_PX)
    patch = patch_around(photo, path.points_px, (max(BEYOND.values()) + 2 * REACH) * width_px)
    spacing_mm, width_mm = STATION_PX * photo.mm_per_px, width_px * photo.mm_per_px

    def look(line_mm: Floats, ray: Floats, at_edge: bool = False) -> tuple[Strip, Walls]:
        step_mm = sample_step_mm(width_mm, photo.mm_per_px)
        strip = straighten(photo, patch, line_mm, ray, step_mm, REACH * width_mm)
        return strip, find_walls(strip, width_mm, wall_share, at_edge)

    sigma = PATH_SMOOTHING * width_mm / spacing_mm
    line_mm = smoothed(resampled(photo.to_mm(path.points_px), spacing_mm), sigma)
    _, walls = look(line_mm, rays_across(line_mm, width_mm, (None, None)))
    ends = _judged_ends(photo, patch, path, walls)
    line_mm = _carried_on(photo, line_mm, ends, width_mm, spacing_mm)
    for number in range(MOST_PASSES):
        strip, walls = look(line_mm, rays_across(line_mm, width_mm, (None, None)))
        _check_found(photo, strip, walls, (0.0, np.inf), most_missing=1.0)
        span_mm = _span_mm(photo, patch, line_mm, walls, ends)
        width_mm = max(_usual_width_mm(walls), LEAST_WIDTH_PX * photo.mm_per_px)
        line_mm = _recentred(strip, walls, ends, span_mm, width_mm, spacing_mm)
        aside_mm = np.abs(walls.left_mm - walls.right_mm)[walls.both_found] / 2
        if number + 1 >= PASSES and np.percentile(aside_mm, 95) < CENTRED * width_mm:
            break
    strip, walls = look(line_mm, rays_across(line_mm, width_mm, _crossings(photo, line_mm, ends)), at_edge=True)
    left_mm = _straight_on(strip.places_mm(walls.left_mm), walls.left_found, ends)
    right_mm = _straight_on(strip.places_mm(-walls.right_mm), walls.right_found, ends)
    whole_mm = _span_mm(photo, patch, line_mm, walls, ends)
    span_mm = _shown_span_mm(photo, line_mm, (left_mm, right_mm), whole_mm)
    kinds = (ends[0].kind if span_mm[0] == whole_mm[0] else "cut", ends[1].kind if span_mm[1] == whole_mm[1] else "cut")
    width_mm = _usual_width_mm(walls)
    missing = _check_found(photo, strip, walls, span_mm, MOST_MISSING)
    least_px = max(MIN_WIDTH_PX, walls.blur_px / MOST_BLUR)
    if width_mm < least_px * photo.mm_per_px:
        raise TooThinError(
            f"{photo.file}: the crack is {width_mm / photo.mm_per_px:.1f} px wide; {least_px:.2g} px are needed "
            "between its walls."
        )
    beyond_mm = (whole_mm[1] - whole_mm[0]) - (span_mm[1] - span_mm[0])
    return Traced(line_mm, left_mm, right_mm, kinds, span_mm, width_mm / photo.mm_per_px, missing, beyond_mm)


def _judged_ends(photo: Photo, patch: Patch, path: CrackPath, walls: Walls) -> Ends:
    threshold = (walls.dark + walls.bright) / 2

    def judged(points_px: Floats, at: int) -> PathEnd:
        behind_px = points_px[int(np.searchsorted(arc_length(points_px), 2 * path.width_px))]
        ahead = unit(points_px[0] - behind_px)
        return judge_end(photo, patch, points_px[0], ahead, path.width_px, float(threshold[at]))

    return judged(path.points_px, 0), judged(path.points_px[::-1], -1)


def _carried_on(photo: Photo, line_mm: Floats, ends: Ends, width_mm: float, spacing_mm: float) -> Floats:
    """Return the line extended to its tips and past its ends. At an open end, its part near the edge is replaced."""
    first, last = 0, len(line_mm) - 1
    if photo.face_mm is not None:
        rim_mm = CLEAR * width_mm + 2 * EDGE_PX * photo.mm_per_px
        clear = np.flatnonzero(depth_inside(line_mm, photo.face_mm) > rim_mm)
        if len(clear) >= 2:
            first = clear[0] if ends[0].kind == "open" else first
            last = clear[-1] if ends[1].kind == "open" else last
    s_mm = arc_length(line_mm)
    before_mm, after_mm = (BEYOND[end.kind] * width_mm for end in ends)
    before_mm, after_mm = before_mm + s_mm[first], after_mm + s_mm[-1] - s_mm[last]
    tips_mm = [photo.to_mm(end.place_px[None]) if end.kind == "closed" else np.empty((0, 2)) for end in ends]
    line_mm = np.concatenate([tips_mm[0], line_mm[first : last + 1], tips_mm[1]])
    return resampled(extended(line_mm, before_mm, after_mm, PATH_AHEAD * width_mm, spacing_mm), spacing_mm)


def _recentred(
    strip: Strip, walls: Walls, ends: Ends, span_mm: tuple[float, float], width_mm: float, spacing_mm: float
) -> Floats:
    """Return a smooth line between the walls, straight past a tip."""
    middle_mm = strip.places_mm((walls.left_mm - walls.right_mm) / 2)
    s_mm = arc_length(strip.line_mm)
    between = np.flatnonzero(walls.both_found & (s_mm > span_mm[0]) & (s_mm < span_mm[1]))
    closed = [end.kind == "closed" and len(between) > 1 for end in ends]
    first = between[0] if closed[0] else 0
    last = between[-1] if closed[1] else len(s_mm) - 1
    sigma = CENTRE_SMOOTHING * width_mm / spacing_mm
    line_mm = smoothed(resampled(middle_mm[first : last + 1], spacing_mm), sigma, RETURNS)
    before_mm, after_mm = (BEYOND["closed"] * width_mm * is_closed for is_closed in closed)
    return resampled(extended(line_mm, before_mm, after_mm, TIP_AHEAD * width_mm, spacing_mm), spacing_mm)


def _span_mm(photo: Photo, patch: Patch, line_mm: Floats, walls: Walls, ends: Ends) -> tuple[float, float]:
    """Return the arc lengths on the line at which the crack begins and ends."""
    crossings = _crossings(photo, line_mm, ends)

    def end_mm(end: PathEnd, crossing: Crossing | None, outward: int) -> float:
        if crossing is not None:
            return crossing.s_mm
        near_mm = _nearest_mm(line_mm, photo.to_mm(end.place_px[None])[0])
        return find_tip(photo, patch, line_mm, walls, near_mm, outward) if end.kind == "closed" else near_mm

    return end_mm(ends[0], crossings[0], -1), end_mm(ends[1], crossings[1], 1)


def _straight_on(wall_mm: Floats, has_step: NDArray[np.bool_], ends: Ends) -> Floats:
    """Return the wall, continued straight past its last step at open ends. Rays would draw it along the edge there."""
    wall_mm = wall_mm.copy()
    if np.count_nonzero(has_step) <= ONWARD:
        return wall_mm
    for end, onward in zip(ends, (wall_mm[::-1], wall_mm), strict=True):
        if end.kind == "open":
            last = int(np.flatnonzero(has_step if onward is wall_mm else has_step[::-1])[-1])
            step_mm = (onward[last] - onward[last - ONWARD]) / ONWARD
            onward[last + 1 :] = onward[last] + np.arange(1, len(onward) - last)[:, None] * step_mm
    return wall_mm


def _shown_span_mm(
    photo: Photo, line_mm: Floats, walls_mm: tuple[Floats, Floats], span_mm: tuple[float, float]
) -> tuple[float, float]:
    """Return the longest part of a span with both walls in the photo; raise InputError if that is too short."""
    width, height = photo.size_px
    hidden = np.zeros(len(line_mm), dtype=bool)
    for wall_mm in walls_mm:
        outside = depth_inside(photo.to_px(wall_mm), (0, 0, width - 1, height - 1)) < BORDER_PX
        # A wall beyond the edge of the face ends there anyway.
        hidden |= outside & (True if photo.face_mm is None else depth_inside(wall_mm, photo.face_mm) > 0)
    s_mm = arc_length(line_mm)
    within = (s_mm > span_mm[0]) & (s_mm < span_mm[1])
    stops_mm = np.concatenate([[span_mm[0]], s_mm[hidden & within], [span_mm[1]]])
    longest = int(np.argmax(np.diff(stops_mm)))
    lost = 1 - float(stops_mm[longest + 1] - stops_mm[longest]) / (span_mm[1] - span_mm[0])
    if lost > MOST_MISSING:
        raise InputError(
            f"{photo.file}: a wall is outside the photo on {lost:.0%} of the path (at most {MOST_MISSING:.0%}); give "
            "ends_px farther inside, or a photo that shows both walls."
        )
    shown_mm = s_mm[~hidden & within]
    shown_mm = shown_mm[(shown_mm > stops_mm[longest]) & (shown_mm < stops_mm[longest + 1])]
    first_mm = span_mm[0] if longest == 0 else float(shown_mm[0])
    return first_mm, span_mm[1] if longest == len(stops_mm) - 2 else float(shown_mm[-1])


def _crossings(photo: Photo, line_mm: Floats, ends: Ends) -> Crossings:
    """Return the crossings of the line with the edge of the face at open ends."""
    crossings: list[Crossing | None] = [None, None]
    for number, end in enumerate(ends):
        if end.kind == "open" and photo.face_mm is not None:
            crossings[number] = edge_crossing(line_mm, photo.face_mm, at_start=number == 0)
            if crossings[number] is None:
                raise InputError(
                    f"{photo.file}: the crack runs along the edge of the face without crossing it; give ends_px "
                    "farther inside."
                )
    return crossings[0], crossings[1]


def _usual_width_mm(walls: Walls) -> float:
    return float(np.median(walls.width_mm[walls.both_found]))


def _nearest_mm(line_mm: Floats, place_mm: Floats) -> float:
    """Return the arc length of the point of a line nearest to a place."""
    s_mm = arc_length(line_mm)
    nearest = int(np.argmin(np.linalg.norm(line_mm - place_mm, axis=1)))
    beside_mm = float((place_mm - line_mm[nearest]) @ tangents(line_mm)[nearest])
    return float(np.clip(s_mm[nearest] + beside_mm, 0, s_mm[-1]))


def _check_found(photo: Photo, strip: Strip, walls: Walls, span_mm: tuple[float, float], most_missing: float) -> float:
    """Return the share of the crack on the sample with a wall missing; raise InputError above ``most_missing``."""
    s_mm = arc_length(strip.line_mm)
    within = strip.valid[:, strip.middle] & (s_mm >= span_mm[0]) & (s_mm <= span_mm[1])
    missing = 1 - float(np.mean((walls.both_found & walls.open_line)[within])) if within.any() else 1.0
    if missing > most_missing or not walls.both_found.any():
        raise WallsMissingError(
            f"{photo.file}: walls not found on {missing:.0%} of the path (at most {MOST_MISSING:.0%}); look at the "
            "photo for shadows and dirt along the crack, and give ends_px of a clearer part; or draw over what is "
            "surely crack and what is surely ground in crack_strokes_px and ground_strokes_px; or paint the crack by "
            "hand in photo.mask, for example if the ground is coarse."
        )
    return missing
