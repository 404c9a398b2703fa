"""Follow a crack from end to end: a line down its middle, and the walls along it, each found with the other's help."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from digitise.finding.crack_path import CrackPath
from digitise.finding.darkness import EDGE_PX
from digitise.geometry.polyline import depth_inside, extended, resampled, smoothed, tangents
from digitise.photo import Photo
from digitise.walls.ends import PathEnd, judge_end
from digitise.walls.patch import Patch, patch_around
from digitise.walls.rays import Crossing, Crossings, edge_crossing, rays_across
from digitise.walls.strip import Strip, sample_step_mm, straighten
from digitise.walls.tips import find_tip
from digitise.walls.walls import Walls, find_walls
from sealtwin.errors import InputError
from sealtwin.records import EndKind, Floats, arc_length

STATION_PX = 2.5
"""Between stations: 0.25 mm at 0.1 mm/px."""
PASSES, MOST_PASSES = 2, 8
"""Each centres the line between the walls that were found along it. Two bring a path that runs in the crack to within
0.01 mm; one that runs along a wall of a wide crack, whose width looked half of what it is, needs more.
"""
CENTRED = 0.05
"""Crack widths by which a line that needs no further pass was off the middle, nearly everywhere."""
REACH = 1.5
"""Crack widths to either side that are searched for a wall."""
BEYOND: dict[EndKind, float] = {"open": 3.0, "cut": 0.75, "closed": 1.0}
"""Crack widths that the line is carried past its ends: over an open edge however far inside it the path stopped, else
as much as smoothing needs.
"""
CLEAR = 0.25
"""Crack widths from the edge of the face, and twice the rim that the search leaves out, within which a path may follow
that rim to where somebody clicked; its direction there is none of the crack's.
"""
PATH_SMOOTHING = 0.75
"""Gaussian sigma of the rough path, in crack widths: its steps are cells of the search map."""
CENTRE_SMOOTHING, RETURNS = 0.25, 4
"""Gaussian sigma of the centreline, in crack widths, and how often it gets back what that took away: bends longer than
one and a half widths stay, the walls' own roughness goes.
"""
PATH_AHEAD, TIP_AHEAD = 2.0, 0.5
"""Crack widths before an end that give the direction in which the line runs on: of the rough path, and of the line
before a tip.
"""


LEAST_WIDTH_PX = 6.0
"""A width to begin with, however narrow the crack looked on the search map."""
MOST_UNSEEN = 0.2
"""Share of the path on which a wall may be missing, or lie outside the photo."""
ONWARD = 6
"""Stations, 15 px, before the place where the edge of the face hides a wall that tell how it runs on: fewer tell of
grain, twice as many of bends.
"""
BORDER_PX = 1.0
"""From the photo's outermost pixels: smoothing moves a wall by less."""


Ends = tuple[PathEnd, PathEnd]


@dataclass(frozen=True)
class Traced:
    """A line that runs past the crack's ends, and the walls along it."""

    line_mm: Floats
    """Down the middle, (n, 2); beside an open end, where one wall has left the face, half a width from the other."""
    left_mm: Floats
    right_mm: Floats
    walls: Walls
    kinds: tuple[EndKind, EndKind]
    span_mm: tuple[float, float]
    """Arc length on the line at which the crack begins and ends."""
    width_px: float
    """Median, in pixels of the photo."""
    unseen: float
    """Share of the crack on which a wall is missing."""
    beyond_mm: float
    """Length of path that is left out at its ends, because a wall lies outside the photo there."""


def trace(photo: Photo, path: CrackPath, edge_fraction: float) -> Traced:
    """Both walls along ``path``, from end to end. Raises InputError where too much of them is not found."""
    width_px = max(path.width_px, LEAST_WIDTH_PX)
    patch = patch_around(photo, path.points_px, (max(BEYOND.values()) + 2 * REACH) * width_px)
    spacing_mm, width_mm = STATION_PX * photo.mm_per_px, width_px * photo.mm_per_px

    def look(line_mm: Floats, ray: Floats, at_edge: bool = False) -> tuple[Strip, Walls]:
        step_mm = sample_step_mm(width_mm, photo.mm_per_px)
        strip = straighten(photo, patch, line_mm, ray, step_mm, REACH * width_mm)
        return strip, find_walls(strip, width_mm, edge_fraction, at_edge)

    line_mm = smoothed(resampled(photo.to_mm(path.points_px), spacing_mm), PATH_SMOOTHING * width_mm / spacing_mm)
    _, walls = look(line_mm, rays_across(line_mm, width_mm, (None, None)))
    ends = _judged_ends(photo, patch, path, walls)
    line_mm = _carried_on(photo, line_mm, ends, width_mm, spacing_mm)
    for number in range(MOST_PASSES):
        strip, walls = look(line_mm, rays_across(line_mm, width_mm, (None, None)))
        _check_seen(photo, strip, walls, (0.0, np.inf), most_unseen=1.0)
        span_mm = _span_mm(photo, patch, line_mm, walls, ends)
        width_mm = max(_usual_width_mm(walls), LEAST_WIDTH_PX * photo.mm_per_px)
        line_mm = _recentred(strip, walls, ends, span_mm, width_mm, spacing_mm)
        aside_mm = np.abs(walls.left_mm - walls.right_mm)[walls.both_seen] / 2
        if number + 1 >= PASSES and np.percentile(aside_mm, 95) < CENTRED * width_mm:
            break
    strip, walls = look(line_mm, rays_across(line_mm, width_mm, _crossings(photo, line_mm, ends)), at_edge=True)
    left_mm = _straight_on(strip.places_mm(walls.left_mm), walls.left_seen, ends)
    right_mm = _straight_on(strip.places_mm(-walls.right_mm), walls.right_seen, ends)
    whole_mm = _span_mm(photo, patch, line_mm, walls, ends)
    span_mm = _shown_span_mm(photo, line_mm, (left_mm, right_mm), whole_mm)
    kinds = (ends[0].kind if span_mm[0] == whole_mm[0] else "cut", ends[1].kind if span_mm[1] == whole_mm[1] else "cut")
    width_mm = _usual_width_mm(walls)
    unseen = _check_seen(photo, strip, walls, span_mm, MOST_UNSEEN)
    return Traced(
        line_mm=line_mm,
        left_mm=left_mm,
        right_mm=right_mm,
        walls=walls,
        kinds=kinds,
        span_mm=span_mm,
        width_px=width_mm / photo.mm_per_px,
        unseen=unseen,
        beyond_mm=(whole_mm[1] - whole_mm[0]) - (span_mm[1] - span_mm[0]),
    )


def _judged_ends(photo: Photo, patch: Patch, path: CrackPath, walls: Walls) -> Ends:
    threshold = (walls.dark + walls.bright) / 2

    def judged(points_px: Floats, at: int) -> PathEnd:
        behind_px = points_px[int(np.searchsorted(arc_length(points_px), 2 * path.width_px))]
        ahead = (points_px[0] - behind_px) / np.linalg.norm(points_px[0] - behind_px)
        return judge_end(photo, patch, points_px[0], ahead, path.width_px, float(threshold[at]))

    return judged(path.points_px, 0), judged(path.points_px[::-1], -1)


def _carried_on(photo: Photo, line_mm: Floats, ends: Ends, width_mm: float, spacing_mm: float) -> Floats:
    """The line to both tips and past all ends; an open one's from where the path is clear of the edge."""
    first, last = _clear_of_edges(photo, line_mm, ends, width_mm)
    s_mm = arc_length(line_mm)
    before_mm, after_mm = (BEYOND[end.kind] * width_mm for end in ends)
    before_mm, after_mm = before_mm + s_mm[first], after_mm + s_mm[-1] - s_mm[last]
    tips_mm = [photo.to_mm(end.place_px[None]) if end.kind == "closed" else np.empty((0, 2)) for end in ends]
    line_mm = np.concatenate([tips_mm[0], line_mm[first : last + 1], tips_mm[1]])
    return resampled(extended(line_mm, before_mm, after_mm, PATH_AHEAD * width_mm, spacing_mm), spacing_mm)


def _clear_of_edges(photo: Photo, line_mm: Floats, ends: Ends, width_mm: float) -> tuple[int, int]:
    """First and last point of a line that do not follow the edge of the face where it is to be met."""
    first, last = 0, len(line_mm) - 1
    if photo.face_mm is None:
        return first, last
    rim_mm = CLEAR * width_mm + 2 * EDGE_PX * photo.mm_per_px
    clear = np.flatnonzero(depth_inside(line_mm, photo.face_mm) > rim_mm)
    if len(clear) < 2:
        return first, last
    return (int(clear[0]) if ends[0].kind == "open" else first), (int(clear[-1]) if ends[1].kind == "open" else last)


def _recentred(
    strip: Strip, walls: Walls, ends: Ends, span_mm: tuple[float, float], width_mm: float, spacing_mm: float
) -> Floats:
    """A smooth line between the walls; past a tip, where there are none, straight on."""
    middle_mm = strip.places_mm((walls.left_mm - walls.right_mm) / 2)
    s_mm = arc_length(strip.line_mm)
    between = np.flatnonzero(walls.both_seen & (s_mm > span_mm[0]) & (s_mm < span_mm[1]))
    closed = [end.kind == "closed" and len(between) > 1 for end in ends]
    first = between[0] if closed[0] else 0
    last = between[-1] if closed[1] else len(s_mm) - 1
    sigma = CENTRE_SMOOTHING * width_mm / spacing_mm
    line_mm = smoothed(resampled(middle_mm[first : last + 1], spacing_mm), sigma, RETURNS)
    before_mm, after_mm = (BEYOND["closed"] * width_mm * is_closed for is_closed in closed)
    return resampled(extended(line_mm, before_mm, after_mm, TIP_AHEAD * width_mm, spacing_mm), spacing_mm)


def _span_mm(photo: Photo, patch: Patch, line_mm: Floats, walls: Walls, ends: Ends) -> tuple[float, float]:
    """Arc length on the line at which the crack begins and ends."""
    crossings = _crossings(photo, line_mm, ends)

    def end_mm(end: PathEnd, crossing: Crossing | None, outward: int) -> float:
        if crossing is not None:
            return crossing.s_mm
        near_mm = _nearest_mm(line_mm, photo.to_mm(end.place_px[None])[0])
        return find_tip(photo, patch, line_mm, walls, near_mm, outward) if end.kind == "closed" else near_mm

    return end_mm(ends[0], crossings[0], -1), end_mm(ends[1], crossings[1], 1)


def _straight_on(wall_mm: Floats, seen: NDArray[np.bool_], ends: Ends) -> Floats:
    """The wall, straight on past the last place where it was seen, at ends that are open.

    Its distance from the line, which may turn along the edge of the face there, would draw it along that edge as well.
    """
    wall_mm = wall_mm.copy()
    if np.count_nonzero(seen) <= ONWARD:
        return wall_mm
    for end, onward in zip(ends, (wall_mm[::-1], wall_mm), strict=True):
        if end.kind == "open":
            last = int(np.flatnonzero(seen if onward is wall_mm else seen[::-1])[-1])
            step_mm = (onward[last] - onward[last - ONWARD]) / ONWARD
            onward[last + 1 :] = onward[last] + np.arange(1, len(onward) - last)[:, None] * step_mm
    return wall_mm


def _shown_span_mm(
    photo: Photo, line_mm: Floats, walls_mm: tuple[Floats, Floats], span_mm: tuple[float, float]
) -> tuple[float, float]:
    """The longest part of a span on which the photo shows both walls: its edge cuts a crack as a user does.

    Raises InputError where little is left.
    """
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
    if lost > MOST_UNSEEN:
        raise InputError(
            f"{photo.file}: a wall lies outside the photo on {lost:.0%} of the path (at most {MOST_UNSEEN:.0%}); give "
            "ends_px farther inside, or a photo that shows both walls."
        )
    shown_mm = s_mm[~hidden & within]
    shown_mm = shown_mm[(shown_mm > stops_mm[longest]) & (shown_mm < stops_mm[longest + 1])]
    first_mm = span_mm[0] if longest == 0 else float(shown_mm[0])
    return first_mm, span_mm[1] if longest == len(stops_mm) - 2 else float(shown_mm[-1])


def _crossings(photo: Photo, line_mm: Floats, ends: Ends) -> Crossings:
    """Where the line meets the edge of the face, at ends that are open."""

    def crossing(end: PathEnd, at_start: bool) -> Crossing | None:
        if end.kind != "open":
            return None
        assert photo.face_mm is not None, "an open end needs an edge"
        found = edge_crossing(line_mm, photo.face_mm, at_start)
        if found is None:
            raise InputError(
                f"{photo.file}: the crack runs along the edge of the face without crossing it; give ends_px farther "
                "inside."
            )
        return found

    return crossing(ends[0], True), crossing(ends[1], False)


def _usual_width_mm(walls: Walls) -> float:
    return float(np.median(walls.width_mm[walls.both_seen]))


def _nearest_mm(line_mm: Floats, place_mm: Floats) -> float:
    """Arc length on a line beside a place."""
    s_mm = arc_length(line_mm)
    nearest = int(np.argmin(np.linalg.norm(line_mm - place_mm, axis=1)))
    beside_mm = float((place_mm - line_mm[nearest]) @ tangents(line_mm)[nearest])
    return float(np.clip(s_mm[nearest] + beside_mm, 0, s_mm[-1]))


def _check_seen(photo: Photo, strip: Strip, walls: Walls, span_mm: tuple[float, float], most_unseen: float) -> float:
    """Share of the crack, where it is on the sample, on which a wall is missing; refused above ``most_unseen``."""
    s_mm = arc_length(strip.line_mm)
    within = strip.valid[:, strip.middle] & (s_mm >= span_mm[0]) & (s_mm <= span_mm[1])
    unseen = 1 - float(np.mean((walls.both_seen & walls.open_line)[within])) if within.any() else 1.0
    if unseen > most_unseen or not walls.both_seen.any():
        raise InputError(
            f"{photo.file}: walls not found on {unseen:.0%} of the path (at most {MOST_UNSEEN:.0%}); look at the photo "
            "for shadows and dirt along the crack, or give ends_px of a clearer part."
        )
    return unseen
