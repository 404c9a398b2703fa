"""Find the line along a crack's mouth, half way between its walls, from the mouth's polygon.

The centreline passes half way between places on both walls that face each other (``facing``). In a slot of constant
width it is the line along which the slot was drawn, even in bends with mitred corners: round an inner corner the pairs
turn, and the middle advances at half the pace of the outer wall. The same happens before an oblique end.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from manifold3d import CrossSection
from scipy.spatial import KDTree
from skimage.measure import points_in_poly

from digitise.crack_path import medial_axis
from digitise.crack_path.medial_axis import along_middle
from digitise.geometry.polyline import Box, at_arc_length, depth_inside, resampled, signed_area, smoothed, unit
from digitise.mesh_import.mouth_ends import ACROSS, MouthEnd, are_square, dense, end_before, fine, straight_on, stretch
from sealtwin.core.arc_length import arc_length
from sealtwin.core.coverage import coverage
from sealtwin.core.errors import ShapeError
from sealtwin.core.records import Floats, Integers
from sealtwin.core.solid_figures import EndKind

BOTH, LEFT, RIGHT = 0, 1, 2  # Steps of a pair: along both walls, or along one of them


# Limits of the line along a mouth. Lengths without a unit are in widths of the crack.
#
# Each line states what its value rests on. Steps and smoothing set how closely the line follows the walls. The other
# fields decide what is a front, a side crack or a fork, and which mouths are refused.
MIN_SLENDERNESS = 3.0  # Length over width: shorter, there is no direction to follow
SMOOTH = 0.0025  # Tolerance of the simplified rim: scans have corners without number
MOST_CELLS = 4_000_000  # Most cells of the raster for the rough path
MOST_STEPS = 4000  # Most steps along a wall
COVERED = 0.01  # Least share of a cell in the crack, above the rounding of a row of cells
STATIONS = 16  # Stations of the outline in the length of one width
SMOOTHING = 0.25  # Sigma of the centreline: bends over 1.5 widths stay
RETURNS = 4  # Corrections of the smoothed centreline
FRONT = 4.0  # Largest length of a front along each wall
PARTING = 1.0  # Gain of the walls' distance for each mm of both, above which they still part
FORK = 0.75  # Length of a side crack over that of the arm beside it from which a warning names the fork
UNSWEPT = 0.1  # Largest share of the area between both walls that is passed twice or not at all
CLEAR = 0.1  # Gap between a side crack and circles in the main one; the rough path is off by a third of it
MOST_LISTED = 4  # Most side arms whose lengths a warning lists
CIRCLES = 16  # Circles nearest to a place on the rim that may contain it
DEEP = 0.75  # Depth of a room, over the width of its mouth, that makes it a side crack
DEEPEST = 2.0  # The same at a bend over ``BEND_DEG``: an outer corner is shallower up to 150 degrees
BEND_DEG = 60.0  # Bend whose outer corner is a room too


@dataclass(frozen=True)
class MouthLine:
    """Centreline and both walls at stations along the crack, (n, 2) each."""

    centreline_mm: Floats
    left_mm: Floats
    right_mm: Floats
    ends: tuple[EndKind, EndKind]
    side_lines_mm: tuple[Floats, ...]  # From the centreline outward
    warnings: tuple[str, ...]


def line_of_mouth(mouth: CrossSection, face_mm: Box, between_mm: Floats | None = None) -> MouthLine:
    """Return the line along the longest way through the mouth, or on the way between two places, (2, 2).

    An open end is on the edge of the face; a closed one is the point at which the line, continued straight, meets the
    rim. A crack that continues past the given places is cut there, square to the line. Islands count as crack, side
    cracks do not. Raises InputError if the mouth is too short to have a direction, or if its walls do not face each
    other along one line.
    """
    ring_mm = _outer_ring(mouth)
    path_mm, width_mm = _rough_path(ring_mm, between_mm)
    ring_mm = _outer_ring(mouth.simplify(SMOOTH * width_mm))
    if arc_length(path_mm)[-1] < (MIN_SLENDERNESS - 1) * width_mm:
        raise ShapeError(
            f"The opening in the face is not a crack: it is about {arc_length(path_mm)[-1] + width_mm:.1f} mm long and "
            f"{width_mm:.1f} mm wide; a crack is at least {MIN_SLENDERNESS:g} times as long as wide."
        )
    rooms = _side_rooms(ring_mm, path_mm, width_mm)
    ends = [end_before(ring_mm, way_mm, width_mm, face_mm, between_mm is None) for way_mm in (path_mm, path_mm[::-1])]
    lines_mm = _lines(ring_mm, ends, rooms, width_mm, face_mm)
    if any(end.blunt for end in ends):
        ways_mm = lines_mm, lines_mm[::-1]
        choices = [straight_on(ring_mm, end, way_mm, width_mm) for end, way_mm in zip(ends, ways_mm, strict=True)]
        # A line that meets a front off its middle is longer.
        lines_mm = min(
            (_lines(ring_mm, pair, rooms, width_mm, face_mm) for pair in product(*choices)),
            key=lambda lines_mm: arc_length(lines_mm[:, :2])[-1],
        )
    centre_mm, left_mm, right_mm = np.hsplit(lines_mm, 3)
    _require_swept(centre_mm, left_mm, right_mm)
    side_lines_mm = tuple(_side_line(room, centre_mm) for room in rooms)
    return MouthLine(
        centre_mm,
        left_mm,
        right_mm,
        (ends[0].kind, ends[1].kind),
        side_lines_mm,
        (*_off_path(side_lines_mm), *(_doubts(centre_mm, side_lines_mm) if between_mm is None else ())),
    )


def _off_path(side_lines_mm: Sequence[Floats]) -> tuple[str, ...]:
    """Return a warning about side arms, which the solid includes and the path does not pass."""
    if not side_lines_mm:
        return ()
    longest_mm = sorted((float(arc_length(line_mm)[-1]) for line_mm in side_lines_mm), reverse=True)
    listed = ", ".join(f"{length_mm:.0f}" for length_mm in longest_mm[:MOST_LISTED])
    which = f"side arms of {listed} mm are" if len(longest_mm) > 1 else f"a side arm of {listed} mm is"
    more = f" ({len(longest_mm)} in all)" if len(longest_mm) > MOST_LISTED else ""
    return (
        f"{which} not on the path{more}: the cavity includes such arms, and the sealant for them is given along the "
        "path; set path.volume_ml to give another volume",
    )


def _doubts(centre_mm: Floats, side_lines_mm: Sequence[Floats]) -> tuple[str, ...]:
    """Return a warning for each side crack that is about as long as an arm of the crack that was followed."""
    s_mm, doubts = arc_length(centre_mm), []
    for line_mm in side_lines_mm:
        from_mm = float(s_mm[np.argmin(np.linalg.norm(centre_mm - line_mm[0], axis=1))])
        side_mm, arm_mm = float(arc_length(line_mm)[-1]), min(from_mm, float(s_mm[-1]) - from_mm)
        if side_mm > FORK * arm_mm:
            doubts.append(
                f"the crack forks at s = {from_mm:.0f} mm: a side crack of {side_mm:.0f} mm is about as long as the "
                f"arm on the path ({arm_mm:.0f} mm); give mesh.path to choose the other arm"
            )
    return tuple(doubts)


def _outer_ring(mouth: CrossSection) -> Floats:
    return max((np.asarray(ring, dtype=float) for ring in mouth.to_polygons()), key=signed_area)


def _require_swept(centre_mm: Floats, left_mm: Floats, right_mm: Floats) -> None:
    """Raise InputError if the lines from wall to wall, on their way along the crack, omit or repeat part of it."""
    between_mm2 = signed_area(np.concatenate([right_mm, left_mm[::-1]]))
    ahead_mm, across_mm = np.diff(centre_mm, axis=0), left_mm - right_mm
    across_mm = (across_mm[1:] + across_mm[:-1]) / 2
    swept_mm2 = float(np.abs(ahead_mm[:, 0] * across_mm[:, 1] - ahead_mm[:, 1] * across_mm[:, 0]).sum())
    if abs(swept_mm2 - between_mm2) > UNSWEPT * between_mm2:
        raise ShapeError(
            f"The crack's walls do not face each other along one line: the lines between them cover {swept_mm2:.0f} "
            f"mm², but the area between the walls is {between_mm2:.0f} mm².",
            "Give mesh.path, a line along the crack's middle that ends in a straight part of the crack, or crop the "
            "mesh.",
            "walls",
        )


def _lines(ring_mm: Floats, ends: Sequence[MouthEnd], rooms: Sequence[Floats], width_mm: float, face_mm: Box) -> Floats:
    """Return centreline, left and right wall at even stations, (n, 6)."""
    first, last = ends
    right_mm = stretch(ring_mm, first.leaves, last.arrives)
    left_mm = stretch(ring_mm, last.leaves, first.arrives)[::-1]
    step_mm = max(width_mm / ACROSS, max(arc_length(wall)[-1] for wall in (left_mm, right_mm)) / MOST_STEPS)
    left_mm, right_mm = (_without(wall, rooms, step_mm) for wall in (left_mm, right_mm))
    fronts, ways = [], (slice(None), slice(None, None, -1))
    for end, way in zip(ends, ways, strict=True):
        front, left_mm, right_mm = _front(left_mm[way], right_mm[way], width_mm, end)
        fronts.append(front[way])
        left_mm, right_mm = left_mm[way], right_mm[way]
    pairs = facing(left_mm, right_mm)
    walls_mm = np.concatenate([fronts[0], np.hstack([left_mm[pairs[:, 0]], right_mm[pairs[:, 1]]]), fronts[1]])
    lines_mm = _even(np.hstack([(walls_mm[:, :2] + walls_mm[:, 2:]) / 2, walls_mm]), width_mm)
    for end, way in zip(ends, ways, strict=True):
        if end.kind == "open":
            lines_mm = _from_edge(lines_mm[way], face_mm)[way]
        elif end.kind == "closed":
            lines_mm[way][0] = np.tile(lines_mm[way][0, :2], 3)
    lines_mm = _even(lines_mm, width_mm)
    lines_mm[1:-1, :2] = smoothed(lines_mm[:, :2], SMOOTHING * STATIONS, RETURNS)[1:-1]
    return _even(lines_mm, width_mm)


def _even(lines_mm: Floats, width_mm: float) -> Floats:
    """Return the lines at even stations along the first of them, the centreline."""
    s_mm = arc_length(lines_mm[:, :2])
    stations_mm = np.linspace(0.0, s_mm[-1], max(2, 1 + round(s_mm[-1] * STATIONS / width_mm)))
    return at_arc_length(lines_mm, s_mm, stations_mm)


def _from_edge(lines_mm: Floats, face_mm: Box) -> Floats:
    """Return the lines with a centreline that keeps half a width from the longer wall before an oblique open end.

    The middle between the corners of an oblique opening is off this line by the roughness of the walls.
    """
    facing_from = int(np.argmax(are_square(lines_mm)))
    if facing_from == 0:
        return lines_mm
    walls_mm = lines_mm[: facing_from + 1, 2:4], lines_mm[: facing_from + 1, 4:]
    longer_mm = max(walls_mm, key=lambda wall: arc_length(wall)[-1])
    shifted_mm = longer_mm + lines_mm[facing_from, :2] - longer_mm[-1]
    outside = np.flatnonzero(depth_inside(shifted_mm, face_mm) < 0)
    if len(outside):
        last, (here_mm, there_mm) = outside[-1], depth_inside(shifted_mm[outside[-1] :][:2], face_mm)
        edge_mm = shifted_mm[last] + here_mm / (here_mm - there_mm) * (shifted_mm[last + 1] - shifted_mm[last])
        shifted_mm = np.vstack([edge_mm, shifted_mm[last + 1 :]])
    s_mm = arc_length(shifted_mm)
    lines_mm = lines_mm.copy()
    lines_mm[: facing_from + 1, :2] = at_arc_length(shifted_mm, s_mm, np.linspace(0.0, s_mm[-1], facing_from + 1))
    return lines_mm


def _front(left_mm: Floats, right_mm: Floats, width_mm: float, end: MouthEnd) -> tuple[Floats, Floats, Floats]:
    """Return pairs across the front of a blunt end, (k, 4), and both walls from there on.

    At a blunt end both walls begin at one place and leave it at the same pace until they no longer part.
    """
    if not end.blunt:
        return np.empty((0, 4)), left_mm, right_mm
    arcs_mm = [arc_length(wall) for wall in (left_mm, right_mm)]
    at_mm = np.arange(0.0, min(FRONT * width_mm, arcs_mm[0][-1] / 2, arcs_mm[1][-1] / 2), width_mm / ACROSS / 4)
    pairs_mm = np.hstack(
        [at_arc_length(wall, arc_mm, at_mm) for wall, arc_mm in zip((left_mm, right_mm), arcs_mm, strict=True)]
    )
    apart_mm = np.linalg.norm(pairs_mm[:, :2] - pairs_mm[:, 2:], axis=1)
    window = ACROSS
    parting = apart_mm[window:] - apart_mm[:-window] > PARTING * (at_mm[window:] - at_mm[:-window])
    last = int(np.argmin(parting)) if not parting.all() else len(parting) - 1
    last += int(np.argmax(apart_mm[last : last + window + 1] > 0.999 * apart_mm[last : last + window + 1].max()))
    left_mm, right_mm = (
        np.vstack([pair_mm, wall[arc_mm > at_mm[last]]])
        for pair_mm, wall, arc_mm in zip(np.hsplit(pairs_mm[last], 2), (left_mm, right_mm), arcs_mm, strict=True)
    )
    return pairs_mm[:last], left_mm, right_mm


def _rough_path(ring_mm: Floats, between_mm: Floats | None) -> tuple[Floats, float]:
    """Return a path along the middle of the ring, and the ring's typical width.

    At a blunt end the path turns into a corner.
    """
    rim_mm = arc_length(np.vstack([ring_mm, ring_mm[:1]]))[-1]
    # The width of a long strip is twice its area over its rim.
    cell_mm = 2 * signed_area(ring_mm) / rim_mm / ACROSS
    size_mm = np.ptp(ring_mm, axis=0)
    cell_mm = max(cell_mm, float(np.sqrt(np.prod(size_mm) / MOST_CELLS)))
    origin_mm = ring_mm.min(axis=0) - 2 * cell_mm
    width, height = (int(np.ceil(side / cell_mm)) + 5 for side in size_mm)
    # Every cell with some cover counts, so that no neck parts the crack.
    region = coverage((ring_mm - origin_mm) / cell_mm, (width, height)) > COVERED
    to_rim = medial_axis.radius(region)
    if between_mm is None:
        way = medial_axis.longest_line(region)
        # From left to right, as a painted crack.
        way = way if way[0, 1] <= way[-1, 1] else way[::-1]
    else:
        way = along_middle(region, (between_mm - origin_mm) / cell_mm)
    usual = max(2 * float(np.median(to_rim[tuple(way.T)])) - 1, 1.0) if len(way) else 1.0
    path_mm = resampled(origin_mm + cell_mm * way[:, ::-1].astype(float), usual / ACROSS * 2 * cell_mm)
    # A cell at the rim has its centre outside.
    inside = np.flatnonzero(points_in_poly(path_mm, ring_mm))
    if len(inside) < 2:
        return path_mm[:1], usual * cell_mm
    return path_mm[inside[0] : inside[-1] + 1], usual * cell_mm


def _side_rooms(ring_mm: Floats, path_mm: Floats, width_mm: float) -> list[Floats]:
    """Return the rims of the side cracks, each from one lip of its mouth to the other.

    Circles along the path, each as large as fits into the mouth, cover the main crack. The rest of the rim consists of
    stretches, and each of them surrounds a room beside the main crack.
    """
    rim_mm = dense(ring_mm, width_mm / ACROSS)
    radius_mm = KDTree(rim_mm).query(path_mm)[0] + CLEAR * width_mm
    away_mm, circle = KDTree(path_mm).query(rim_mm, k=min(CIRCLES, len(path_mm)))
    circle = np.asarray(circle, dtype=int)
    beyond_mm = away_mm - radius_mm[circle]
    holds = beyond_mm.argmin(axis=1)[:, None]
    deep_mm = beyond_mm.min(axis=1)
    # Begin on the main crack, so that no stretch is split in two.
    start = int(np.argmin(deep_mm))
    nearest = np.roll(np.take_along_axis(circle, holds, axis=1)[:, 0], -start)
    rim_mm, deep_mm = np.roll(rim_mm, -start, axis=0), np.roll(deep_mm, -start)
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], deep_mm > 0, [False]]).astype(int))).reshape(-1, 2)
    s_mm, rooms = arc_length(path_mm), []
    for begin, end in bounds.tolist():
        room_mm, at_lips = rim_mm[begin:end], s_mm[nearest[[begin, end - 1]]]
        # A room next to an end belongs to that end.
        if end - begin < 3 or at_lips.min() < width_mm / 2 or at_lips.max() > s_mm[-1] - width_mm / 2:
            continue
        mouth_mm = max(float(np.linalg.norm(room_mm[0] - room_mm[-1])), width_mm / ACROSS)
        along = (room_mm[-1] - room_mm[0]) / mouth_mm
        away_mm = room_mm - room_mm[0]
        reach_mm = float(np.abs(along[0] * away_mm[:, 1] - along[1] * away_mm[:, 0]).max())
        first_mm, last_mm = np.sort(at_lips)
        stretch = np.array([first_mm - width_mm, first_mm, last_mm, last_mm + width_mm])
        before, _, after = np.diff(at_arc_length(path_mm, s_mm, stretch), axis=0)
        turn_deg = np.degrees(np.arccos(np.clip(unit(before) @ unit(after), -1, 1)))
        if reach_mm > (DEEPEST if turn_deg > BEND_DEG else DEEP) * mouth_mm:
            rooms.append(room_mm)
    return rooms


def _without(wall_mm: Floats, rooms: Sequence[Floats], step_mm: float) -> Floats:
    """Return a wall in fine steps, straight across the mouths of side cracks."""
    wall_mm = fine(wall_mm, step_mm)
    beside = np.zeros(len(wall_mm), dtype=bool)
    for room_mm in rooms:
        away_mm, lips = map(np.array, KDTree(wall_mm).query(room_mm[[0, -1]]))
        if away_mm.max() <= step_mm:
            # A wall that is walked clockwise meets the far lip first.
            beside[lips.min() + 1 : lips.max()] = True
    return fine(wall_mm[~beside], step_mm)


def _side_line(room_mm: Floats, centre_mm: Floats) -> Floats:
    """Return the line of a side crack from the centreline to its farthest place."""
    begin_mm = room_mm[[0, -1]].mean(axis=0)
    away_mm = np.linalg.norm(room_mm - begin_mm, axis=1)
    tip = int(np.clip(np.argmax(away_mm), 1, len(room_mm) - 2))
    right_mm, left_mm = room_mm[: tip + 1], room_mm[: tip - 1 : -1]
    pairs = facing(left_mm, right_mm)
    middle_mm = (left_mm[pairs[:, 0]] + right_mm[pairs[:, 1]]) / 2
    foot_mm = centre_mm[np.argmin(np.linalg.norm(centre_mm - begin_mm, axis=1))]
    return np.vstack([foot_mm, resampled(middle_mm, float(away_mm.max()) / ACROSS)])


def facing(left_mm: Floats, right_mm: Floats) -> Integers:
    """Pair the points of two walls in order, (k, 2). The first pair is both first points, the last both last points.

    The pairs minimise the distance between the walls, integrated over the arc length of both (the summed Fréchet
    distance). The method is dynamic programming along the anti-diagonals of all pairs.
    """
    count, other = len(left_mm), len(right_mm)
    left_step, right_step = (
        np.concatenate([[0.0], np.linalg.norm(np.diff(wall, axis=0), axis=1)]) for wall in (left_mm, right_mm)
    )
    # Costs and distances on the last two anti-diagonals, by the number of the left point plus one.
    cost, before = np.full((2, count + 1), np.inf)
    across, across_before = np.zeros((2, count + 1))
    came_by = np.zeros((count + other - 1, count), dtype=np.int8)
    for total in range(count + other - 1):
        left = np.arange(max(0, total - other + 1), min(count - 1, total) + 1)
        right = total - left
        here = np.hypot(*(left_mm[left] - right_mm[right]).T)
        along_left, along_right = left_step[left], right_step[right]
        ways = np.stack(
            [
                before[left] + (across_before[left] + here) / 2 * (along_left + along_right),
                cost[left] + (across[left] + here) / 2 * along_left,
                cost[left + 1] + (across[left + 1] + here) / 2 * along_right,
            ]
        )
        step = ways.argmin(axis=0)
        came_by[total, left] = step
        before, across_before = cost, across
        cost, across = np.full(count + 1, np.inf), np.zeros(count + 1)
        cost[left + 1] = ways[step, np.arange(len(left))] if total else 0.0
        across[left + 1] = here
    pair = (count - 1, other - 1)
    pairs = [pair]
    while pair != (0, 0):
        step = came_by[sum(pair), pair[0]]
        pair = pair[0] - (step != RIGHT), pair[1] - (step != LEFT)
        pairs.append((int(pair[0]), int(pair[1])))
        pair = pairs[-1]
    return np.array(pairs[::-1], dtype=np.int64)
