"""Find the line along a crack's mouth, half way between its walls, from the mouth's polygon.

The two ends of the crack divide the mouth's rim into two walls. The centreline is half way between points of the two
walls that face each other (``facing``). In a slot of constant width, this is the line along which the slot was drawn,
also in bends with mitred corners. Around an inner corner, the point on the inner wall does not move, and the middle
advances half as fast as the point on the outer wall. The same happens before an oblique end.

The rim is a counter-clockwise ring of corners. A position on the rim is a number: the index of an edge's first corner,
plus the fraction of the edge up to the position.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist
from skimage.graph import route_through_array
from skimage.measure import points_in_poly

from digitise.crack_path import medial_axis
from digitise.geometry.polyline import (
    Box,
    nearest_side,
    resampled,
    signed_area,
    smoothed,
    to_left,
    unit,
)
from digitise.mesh_import.cavity import seen_from_above, strip_width_mm
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length, at_arc_length
from sealtwin.core.arrays import cross, lengths, midpoints, runs
from sealtwin.core.errors import ShapeError
from sealtwin.core.facts import Facts, doubt
from sealtwin.core.records import Floats, Integers, Outline, PathSource
from sealtwin.core.solid_figures import EndKind

# Limits of the line along a mouth. Lengths without a unit are in widths of the crack.
#
# Steps and smoothing decide how closely the line follows the walls. The other values decide what is an end or a side
# arm, and which mouths are refused.
MIN_SLENDERNESS = 3.0  # Minimum ratio of length to width. A shorter mouth has no direction to follow
RING_SHARE = 0.5  # A crack that fills less than this fraction of the area inside its outer rim is a ring
SMOOTH = 0.0025  # Tolerance of the simplified rim. Scans have very many corners
COVERED = 0.01  # A pixel is crack if more than this fraction is covered, so that narrow necks do not divide the crack
STEPS_ACROSS, MAX_STEPS = 20, 2000  # Steps along a wall per width, and largest number of steps
STATIONS = 16  # Stations of the outline per width
# Sigma of the centreline's smoothing, and number of corrections. They preserve bends over more than 1.5 widths
SMOOTHING, RETURNS = 0.25, 4
# Circles that fit between the walls grow from a corner: distance of measurement, and largest growth off a corner
OPENS_OVER, OPENS = 0.25, 0.15
ON_SIDE_MM = 1e-3  # The rim is an opening within this distance of the face's edge
ARM_GAP = 0.1  # Gap between a side arm and the circles in the main crack
# Minimum depth of a side arm, divided by the width of its mouth. At a bend, outer corners are shallower than the second
DEEP, DEEP_AT_BEND = 0.75, 2.0
UNSWEPT = 0.1  # Largest fraction of the area between the walls that lines from wall to wall may omit or repeat


@dataclass(frozen=True)
class MouthLine:
    """Centreline and walls of a mouth at stations along the crack, (n, 2) each."""

    centreline_mm: Floats
    left_mm: Floats
    right_mm: Floats
    ends: tuple[EndKind, EndKind]
    side_lines_mm: tuple[Floats, ...]  # Line from the centreline to the tip of each side arm
    warnings: Facts


@dataclass(frozen=True)
class _End:
    """An end of the crack, given by the positions at which the counter-clockwise rim enters and leaves it."""

    kind: EndKind
    arrives: float
    leaves: float
    tip: tuple[float, ...] = ()  # Position of the middle of a closed end. Empty for other ends


def line_of_mouth(mouth: CrossSection, face_mm: Box) -> MouthLine:
    """Return the line along the longest way through the mouth, from its left end.

    An open end is on the edge of the face, half way between the walls. A closed end is where the straight continuation
    of the middle meets the crack's front. Islands count as crack, and side arms do not.
    Raises ShapeError if the mouth is a ring or too short, or if its walls do not face each other along one line.
    """
    rings_mm = [np.asarray(ring, float) for ring in mouth.to_polygons()]
    outer = CrossSection([max(rings_mm, key=signed_area)])
    if mouth.area() < RING_SHARE * outer.area():
        x, y = min(rings_mm, key=signed_area).mean(axis=0)
        raise ShapeError(
            f"The crack is a ring around ({x:.1f}, {y:.1f}) mm, so it has no two ends.",
            "Close it at one point.",
        )
    path_mm, width_mm = _rough_path(outer)
    ring_mm = np.asarray(outer.simplify(SMOOTH * width_mm).to_polygons()[0], float)
    # A pixel at the rim has its centre outside.
    inside = np.flatnonzero(points_in_poly(path_mm, ring_mm))
    path_mm = path_mm[inside[0] : inside[-1] + 1] if len(inside) else path_mm[:1]
    length_mm = arc_length(path_mm)[-1]
    if length_mm < (MIN_SLENDERNESS - 1) * width_mm:
        x, y = np.ptp(ring_mm, axis=0)
        raise ShapeError(
            f"The opening in the face, {x:.1f} x {y:.1f} mm, is not a crack: its middle line is {length_mm:.1f} mm "
            f"long, and it is {width_mm:.1f} mm wide. A crack is at least {MIN_SLENDERNESS:g} times as long as wide."
        )
    ring_mm, arms = _without_arms(ring_mm, path_mm, width_mm)
    first, last = (_end_before(ring_mm, way_mm, width_mm, face_mm) for way_mm in (path_mm, path_mm[::-1]))
    right_mm, left_mm = _stretch(ring_mm, first.leaves, last.arrives), _stretch(ring_mm, last.leaves, first.arrives)
    tips_mm = [_ring_points(ring_mm, end.tip) for end in (first, last)]
    lines_mm = _middle(left_mm[::-1], right_mm, tips_mm, width_mm)
    _require_swept(lines_mm)
    centre_mm, left_mm, right_mm = np.hsplit(lines_mm, 3)
    side_lines_mm, warnings = _side_lines(arms, centre_mm)
    return MouthLine(centre_mm, left_mm, right_mm, (first.kind, last.kind), side_lines_mm, warnings)


def outline_of(line: MouthLine, mouth: CrossSection, photo: Photo, source: PathSource) -> Outline:
    """Return the outline of the crack along a line through its mouth. The outline's ring is the rim of the mouth."""
    ring_mm, *islands_mm = sorted(map(np.asarray, mouth.to_polygons()), key=signed_area, reverse=True)
    return Outline(
        **photo.in_both_units(
            centreline=line.centreline_mm, left_wall=line.left_mm, right_wall=line.right_mm, outline=ring_mm
        ),
        ends=line.ends,
        **photo.facts_of_outline,
        path_source=source,
        warnings=(*photo.warnings, *line.warnings),
        islands_mm=tuple(islands_mm),
        branches_mm=line.side_lines_mm,
        branches_kept=bool(line.side_lines_mm),
    )


def _side_lines(arms_mm: Sequence[Floats], centre_mm: Floats) -> tuple[tuple[Floats, ...], Facts]:
    """Return a line to the tip of each side arm, and a warning if there are any.

    The solid includes side arms, but the nozzle path does not follow them.
    """
    if not arms_mm:
        return (), ()
    away_mm, feet = map(np.asarray, KDTree(centre_mm).query([lips_mm for lips_mm, _ in arms_mm]))
    reach_mm = away_mm + lengths(np.diff(arms_mm, axis=1)[:, 0])
    warning = (
        f"the path does not follow the side arms ({len(feet)}, up to {reach_mm.max():.0f} mm long; the longest at s = "
        f"{arc_length(centre_mm)[feet[reach_mm.argmax()]]:.0f} mm). The cavity includes them, and their sealant is "
        "given along the path. Set path.volume_ml to give another volume"
    )
    lines_mm = tuple(np.vstack([centre_mm[foot], arm_mm]) for foot, arm_mm in zip(feet, arms_mm, strict=True))
    return lines_mm, (doubt("mesh.side-arms", warning, float(reach_mm.max()), "mm"),)


def _require_swept(lines_mm: Floats) -> None:
    """Raise ShapeError if the lines from wall to wall, from end to end, omit or repeat part of the crack."""
    centre_mm, left_mm, right_mm = np.hsplit(lines_mm, 3)
    between_mm2 = signed_area(np.concatenate([right_mm, left_mm[::-1]]))
    ahead_mm, across_mm = np.diff(centre_mm, axis=0), left_mm - right_mm
    across_mm = midpoints(across_mm)
    swept_mm2 = np.abs(cross(ahead_mm, across_mm)).sum()
    if abs(swept_mm2 - between_mm2) > UNSWEPT * between_mm2:
        raise ShapeError(
            f"The crack's walls do not face each other along one line: the lines between them cover {swept_mm2:.0f} "
            f"mm², but the area between the walls is {between_mm2:.0f} mm².",
            "Crop the mesh, so that the crack ends in a straight part.",
        )


def _rough_path(outer: CrossSection) -> tuple[Floats, float]:
    """Return a path along the middle of a region without islands, (n, 2), and the region's typical width."""
    low, high = np.reshape(outer.bounds(), (2, 2))
    view, mm_per_px, share = seen_from_above(outer, strip_width_mm(outer), low, high)
    region = share > COVERED
    to_rim = medial_axis.radius(region)
    way = medial_axis.rightward(medial_axis.longest_line(region))
    width_mm = max(2 * np.median(to_rim[tuple(way.T)]) - 1, 1.0) * mm_per_px
    return resampled(view.to_mm(way[:, ::-1].astype(float)), width_mm / STEPS_ACROSS), width_mm


def _without_arms(ring_mm: Floats, path_mm: Floats, width_mm: float) -> tuple[Floats, list[Floats]]:
    """Return the rim in fine steps without side arms, (n, 2), and the middle of mouth and the tip of each arm, (2, 2).

    The rim goes straight across an arm's mouth. Circles along the path, as large as the walls allow, cover the main
    crack. A stretch of the rim outside these circles surrounds an arm if it is deep compared with its width.
    """
    around_mm = np.vstack([ring_mm, ring_mm[:1]])
    s_mm = arc_length(around_mm)
    rim_mm = at_arc_length(around_mm, s_mm, np.union1d(s_mm, np.arange(0.0, s_mm[-1], width_mm / STEPS_ACROSS)))[:-1]
    radius_mm = KDTree(rim_mm).query(path_mm)[0] + ARM_GAP * width_mm
    away_mm, nearest = map(np.asarray, KDTree(path_mm).query(rim_mm))
    beyond_mm = away_mm - radius_mm[nearest]
    # Begin on the main crack, so that no stretch is split in two.
    order = np.roll(np.arange(len(rim_mm)), -int(beyond_mm.argmin()))
    rim_mm, beside, s_mm = rim_mm[order], beyond_mm[order] > 0, arc_length(path_mm)
    at_rim_mm, main, arms = s_mm[nearest[order]], np.ones(len(rim_mm), bool), list[Floats]()
    for begin, end in runs(beside).tolist():
        room_mm, (first_mm, last_mm) = rim_mm[begin:end], np.sort(at_rim_mm[[begin, end - 1]])
        # A stretch next to an end belongs to that end.
        if first_mm < width_mm / 2 or last_mm > s_mm[-1] - width_mm / 2:
            continue
        chord_mm = room_mm[-1] - room_mm[0]
        mouth_mm = max(np.linalg.norm(chord_mm), width_mm / STEPS_ACROSS)
        depth_mm = np.abs(cross(room_mm - room_mm[0], chord_mm)).max() / mouth_mm
        around_mm = np.array([first_mm - width_mm, first_mm, last_mm, last_mm + width_mm])
        before_mm, _, after_mm = np.diff(at_arc_length(path_mm, s_mm, around_mm), axis=0)
        if depth_mm > (DEEP if unit(before_mm) @ unit(after_mm) > 0.5 else DEEP_AT_BEND) * mouth_mm:
            main[begin:end] = False
            lips_mm = room_mm[[0, -1]].mean(axis=0)
            arms.append(np.array([lips_mm, room_mm[lengths(room_mm - lips_mm).argmax()]]))
    return rim_mm[main], arms


def _end_before(ring_mm: Floats, path_mm: Floats, width_mm: float, face_mm: Box) -> _End:
    """Return the end of the crack before the first point of a path."""
    s_mm = arc_length(path_mm)
    radius_mm = np.asarray(KDTree(ring_mm).query(path_mm)[0])
    # A skeleton turns into a corner of the front. There the circles that fit shrink fast.
    grows_mm = np.interp(s_mm + OPENS_OVER * width_mm, s_mm, radius_mm) - radius_mm
    begin = int(np.argmax(grows_mm < OPENS * OPENS_OVER * width_mm))
    inner = int(np.searchsorted(s_mm, s_mm[begin] + max(radius_mm[begin], OPENS_OVER * width_mm)))
    inner = min(inner, len(path_mm) - 1)
    aside = to_left(unit(path_mm[begin] - path_mm[inner]))
    sides = [[_exit(ring_mm, path_mm[number], turn * aside) for turn in (-1, 1)] for number in (begin, inner)]
    near_mm, far_mm = (_ring_points(ring_mm, places).mean(axis=0) for places in sides)
    tip = _exit(ring_mm, near_mm, unit(near_mm - far_mm))
    end_mm = _ring_points(ring_mm, [tip])[0]
    side = nearest_side(end_mm, face_mm)
    if abs(end_mm[side % 2] - face_mm[side]) < ON_SIDE_MM:
        beside, edge = np.abs(ring_mm[:, side % 2] - face_mm[side]) < ON_SIDE_MM, int(tip) + 1
        before, after = (int(np.argmin(np.roll(on, turn))) for on, turn in ((beside[::-1], edge), (beside, -edge)))
        return _End("open", (edge - before) % len(ring_mm), (edge - 1 + after) % len(ring_mm))
    before, after = _corner(ring_mm, sides[0][0], tip), _corner(ring_mm, tip, sides[0][1])
    return _End("closed", before, after, (tip,))


def _corner(ring_mm: Floats, begin: float, end: float) -> float:
    """Return the position on the ring, between two positions, that is farthest from the straight line between them."""
    points_mm = _stretch(ring_mm, begin, end) - _ring_points(ring_mm, [begin])
    corner = int(np.abs(cross(points_mm, points_mm[-1])).argmax())
    return (int(begin) + corner) % len(ring_mm) if corner else begin


def _exit(ring_mm: Floats, place_mm: Floats, ahead: Floats) -> float:
    """Return the position on the ring at which a ray from inside first meets it."""
    step, gap = np.roll(ring_mm, -1, axis=0) - ring_mm, ring_mm - place_mm
    turn = cross(ahead, step)
    with np.errstate(divide="ignore", invalid="ignore"):
        away_mm, share = cross(gap, step) / turn, cross(gap, ahead) / turn
    away_mm[~((share >= 0) & (share <= 1) & (away_mm >= 0))] = np.inf
    first = int(np.argmin(away_mm))
    return first + float(share[first])


def _ring_points(ring_mm: Floats, places: Sequence[float] | Floats) -> Floats:
    """Return positions on the ring as points in mm, (n, 2).

    A position beyond the last corner continues from the first corner.
    """
    twice_mm = np.vstack([ring_mm, ring_mm, ring_mm[:1]])
    return at_arc_length(twice_mm, np.arange(len(twice_mm), dtype=float), np.asarray(places, float))


def _stretch(ring_mm: Floats, begin: float, end: float) -> Floats:
    """Return the stretch of the ring, counter-clockwise, from one position on it to another."""
    end += len(ring_mm) * (end <= begin)
    return _ring_points(ring_mm, np.concatenate([[begin], np.arange(np.floor(begin) + 1, np.ceil(end)), [end]]))


def _middle(left_mm: Floats, right_mm: Floats, tips_mm: Sequence[Floats], width_mm: float) -> Floats:
    """Return centreline, left wall and right wall at evenly spaced stations, (n, 6)."""
    longest_mm = max(arc_length(wall)[-1] for wall in (left_mm, right_mm))
    step_mm = max(width_mm / STEPS_ACROSS, longest_mm / MAX_STEPS)
    left_mm, right_mm = resampled(left_mm, step_mm), resampled(right_mm, step_mm)
    left, right = facing(left_mm, right_mm).T
    first_mm, last_mm = (np.tile(tip_mm, 2) for tip_mm in tips_mm)
    walls_mm = np.concatenate([first_mm, np.hstack([left_mm[left], right_mm[right]]), last_mm])
    lines_mm = _even(np.hstack([(walls_mm[:, :2] + walls_mm[:, 2:]) / 2, walls_mm]), width_mm)
    lines_mm[1:-1, :2] = smoothed(lines_mm[:, :2], SMOOTHING * STATIONS, RETURNS)[1:-1]
    return _even(lines_mm, width_mm)


def _even(lines_mm: Floats, width_mm: float) -> Floats:
    """Return the lines, (n, 6), at stations that are evenly spaced along the first line, the centreline."""
    s_mm = arc_length(lines_mm[:, :2])
    stations_mm = np.linspace(0.0, s_mm[-1], max(2, 1 + round(s_mm[-1] * STATIONS / width_mm)))
    return at_arc_length(lines_mm, s_mm, stations_mm)


def facing(left_mm: Floats, right_mm: Floats) -> Integers:
    """Return pairs of indices of points on two walls that face each other, (k, 2), from the first points to the last.

    The points of a wall are evenly spaced. A pairing is a path in the plane of the two arc lengths. The chosen path
    minimises the integral of the squared distance between the walls.
    """
    across_mm2 = cdist(left_mm, right_mm, "sqeuclidean")
    way, _ = route_through_array(across_mm2, (0, 0), (len(left_mm) - 1, len(right_mm) - 1))
    return np.array(way, np.int64)
