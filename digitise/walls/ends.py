"""Classify the ends of a crack: open at the edge of the face, closed in a tip, or cut if the crack continues."""

from dataclasses import dataclass

import numpy as np

from digitise.crack_path.medial_axis import pieces
from digitise.geometry.polyline import depth_inside, extended, left_normals, to_left, unit
from digitise.image.raster import window_around
from digitise.photo import EDGE_PX, Photo
from digitise.walls.wall_profile import Crossings, Patch, edge_crossings
from sealtwin.core.arc_length import arc_length, at_arc_length
from sealtwin.core.arrays import Booleans, Floats, lengths
from sealtwin.core.solid_figures import EndKind, Span

STEP_PX = 0.25  # Spacing of samples along the line at a tip
LOOK_AHEAD = 2.0  # The edge of the face is searched for this many crack widths ahead of the end
GOES_ON = 1.5  # An end is cut if dark pixels extend more than this many crack widths from it
BLUNT = 0.25  # Length, in crack widths, behind the farthest point over which the middle of a blunt end is measured
JUDGED_PX = 8.0  # Minimum width with which an end is classified, because grain interrupts a hairline for a few px
GROUND_WIDTHS = 1.2  # Distance from the line, in widths, at which the ground is measured, plus ``GROUND_PX``
GROUND_PX = 3.0
# Length by which a line is extended to the edge of the face: widths, or px if that is more. The rim is not searched
TO_THE_EDGE, TO_THE_EDGE_PX = 1.5, 20.0


@dataclass(frozen=True)
class Traced:
    """A line that extends past the crack's ends, and the walls along it."""

    line_mm: Floats  # Centreline, (n, 2)
    left_mm: Floats
    right_mm: Floats
    kinds: tuple[EndKind, EndKind]
    span_mm: Span  # Arc lengths on the line at which the crack begins and ends
    width_px: float  # Median width in pixels of the photo
    missing: float = 0.0  # Fraction of the crack along which one or both walls are missing
    beyond_mm: float = 0.0  # Length of path left out at its ends because a wall is outside the photo
    width_spread: float | None = None
    """Relative uncertainty of a dark region's mean width: half of the 95 % interval, divided by the width. None if the
    walls were followed by steps in brightness."""
    clear_step: Booleans | None = None
    """True for stations at which the left or the right wall is a clear step in brightness, (2, n). None if the walls
    were not followed by steps."""


@dataclass(frozen=True)
class PathEnd:
    """One end of a crack, and its kind."""

    kind: EndKind
    place_px: Floats  # Tip of a closed end, and end of the path for other ends, (2,)
    ahead: Floats  # Unit vector that points out of the crack


Ends = tuple[PathEnd, PathEnd]


def find_tip(photo: Photo, patch: Patch, line_mm: Floats, near_mm: float, reach_mm: float, level: float) -> float:
    """Return the arc length at which the brightness along a line past a tip crosses ``level``.

    The crossing nearest to ``near_mm`` is used. If there is none within ``reach_mm``, returns ``near_mm``.
    """
    s_mm = arc_length(line_mm)
    fine_mm = np.arange(max(near_mm - reach_mm, 0), min(near_mm + reach_mm, s_mm[-1]), STEP_PX * photo.mm_per_px)
    light = patch.light(photo.to_px(at_arc_length(line_mm, s_mm, fine_mm)))
    places_mm = fine_mm[1:][(light[:-1] < level) != (light[1:] < level)]
    return min(places_mm, key=lambda place_mm: abs(place_mm - near_mm), default=near_mm)


def to_its_ends(
    photo: Photo, patch: Patch, lines_px: tuple[Floats, Floats, Floats], width_px: float, spread: float | None = None
) -> Traced:
    """Extend the traced middle and walls to the crack's two ends, and classify each end.

    ``lines_px`` are the middle, the left wall and the right wall in px. ``width_px`` is the mean width. ``spread``
    becomes the result's ``width_spread``.
    """
    middle_px = lines_px[0]
    beside_px = (GROUND_WIDTHS * width_px + GROUND_PX) * left_normals(middle_px)
    threshold = float(np.median(patch.light(middle_px)) + np.median(patch.light(middle_px + beside_px))) / 2
    inward_px, back_px = (middle_px, middle_px[::-1]), max(10, round(width_px))
    ends = judge_ends(photo, patch, inward_px, back_px, max(width_px, JUDGED_PX), (threshold, threshold))
    tips_px = [
        end.place_px[None][: int(end.kind == "closed" and (end.place_px - line_px[0]) @ end.ahead > 1.0)]
        for end, line_px in zip(ends, inward_px, strict=True)
    ]
    lines_mm = [photo.to_mm(np.concatenate([tips_px[0], line_px, tips_px[1]])) for line_px in lines_px]
    onward_mm = max(TO_THE_EDGE * width_px, TO_THE_EDGE_PX) * photo.mm_per_px
    before_mm, after_mm = (onward_mm * (end.kind == "open") for end in ends)
    line_mm, left_mm, right_mm = (
        extended(each_mm, before_mm, after_mm, width_px * photo.mm_per_px, photo.mm_per_px) for each_mm in lines_mm
    )
    first, last = crossings(photo, line_mm, ends)
    span_mm = (
        before_mm if first is None else first.s_mm,
        float(arc_length(line_mm)[-1]) - after_mm if last is None else last.s_mm,
    )
    kinds = ends[0].kind, ends[1].kind
    return Traced(line_mm, left_mm, right_mm, kinds, span_mm, width_px, width_spread=spread)


def crossings(photo: Photo, line_mm: Floats, ends: Ends) -> Crossings:
    """Return the crossings of a line with the edge of the face at both ends. None for an end that is not open."""
    if photo.face_mm is None:
        return None, None
    first, last = edge_crossings(line_mm, photo.face_mm)
    return first if ends[0].kind == "open" else None, last if ends[1].kind == "open" else None


def judge_ends(
    photo: Photo,
    patch: Patch,
    inward_px: tuple[Floats, Floats],
    back_px: int,
    width_px: float,
    thresholds: tuple[float, float],
) -> Ends:
    """Classify both ends of a line. ``inward_px`` is the line from its first end, and from its last end.

    The first ``back_px`` points from an end define the direction of the end.
    """
    first, last = (
        judge_end(photo, patch, line_px[0], unit(line_px[0] - line_px[: back_px + 1][-1]), width_px, threshold)
        for line_px, threshold in zip(inward_px, thresholds, strict=True)
    )
    return first, last


def judge_end(photo: Photo, patch: Patch, end_px: Floats, ahead: Floats, width_px: float, threshold: float) -> PathEnd:
    """Classify the end at ``end_px`` as "open", "closed" or "cut". ``ahead`` points out of the crack.

    An end at the edge of the photo is classified as "cut".
    """
    reached_px = np.vstack([end_px, _dark_ahead_px(photo, patch, end_px, ahead, width_px, threshold)])
    if photo.face_mm is not None:
        # The sample's mask ends a few px before the edge of the face.
        edge_px = np.abs(depth_inside(photo.to_mm(reached_px), photo.face_mm)) / photo.mm_per_px
        if edge_px.min() <= 2 * EDGE_PX:
            return PathEnd("open", end_px, ahead)
    away_px = reached_px - end_px
    goes_on = lengths(away_px).max() > GOES_ON * width_px
    if goes_on or photo.depth_px(reached_px).min() <= 1:
        return PathEnd("cut", end_px, ahead)
    # The tip is the farthest dark pixel ahead, or the middle of a blunt end.
    extent_px, aside = away_px @ ahead, to_left(ahead)
    sideways_px = away_px[extent_px > extent_px.max() - BLUNT * width_px] @ aside
    tip_px = end_px + extent_px.max() * ahead + (sideways_px.min() + sideways_px.max()) / 2 * aside
    return PathEnd("closed", tip_px, ahead)


def _dark_ahead_px(
    photo: Photo, patch: Patch, end_px: Floats, ahead: Floats, width_px: float, threshold: float
) -> Floats:
    """Return the dark pixels around and ahead of an end that are connected to the end, (n, 2)."""
    place_px, size_px = end_px[None] - patch.offset_px, (patch.soft.shape[1], patch.soft.shape[0])
    low, window = window_around(place_px, LOOK_AHEAD * width_px, size_px)
    soft = patch.soft[window]
    rows, columns = np.nonzero(soft < threshold)
    dark_px = np.column_stack([columns, rows]).astype(float) + low + patch.offset_px
    away_px = dark_px - end_px
    # A strip behind the end is included, so that a bright speck on the end does not separate it from the crack.
    near = (away_px @ ahead > -0.5 * width_px) & (lengths(away_px) <= LOOK_AHEAD * width_px)
    near[near] = patch.on_sample(dark_px[near], photo.to_mm(dark_px[near]))
    if not near.any():
        return dark_px[near]
    crack = np.zeros(soft.shape, bool)
    crack[rows[near], columns[near]] = True
    label = pieces(crack)[0][rows[near], columns[near]]
    return dark_px[near][label == label[np.argmin(lengths(away_px[near]))]]
