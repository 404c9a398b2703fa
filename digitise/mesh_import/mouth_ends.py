"""Ends of a crack in its mouth: an opening in the edge of the face, a tip, a blunt front, or a cut.

The mouth's rim is a ring of corners, counter-clockwise. A place on it is a number: the index of an edge's first corner,
plus the share of the edge up to the place.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from digitise.geometry.polyline import Box, at_arc_length, unit
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import FACING, Floats
from sealtwin.core.solid_figures import EndKind

Place = float
ON_SIDE_MM = 1e-3  # Distance from the edge of the face within which the mouth's rim is an opening
ACROSS = 20  # Steps along the rim in the length of one width
WAYS_ON = ((0.6, 0.4, True), (1.0, 1.0, False))  # Distance from a blunt end, length, in widths; True to use the walls
AHEAD = 2.0  # Widths ahead of a path within which the crack ends; a path with more crack ahead is cut there
OPENS, POINTED = 0.15, 0.15  # Largest growth of circles from a sharp tip on, and their largest radius in it, in widths


@dataclass(frozen=True)
class MouthEnd:
    """Places where the rim, followed counter-clockwise, enters and leaves an end of the crack."""

    kind: EndKind
    arrives: Place
    leaves: Place
    blunt: bool = False  # True of a tip with a front across the crack, in which both walls begin


def end_before(ring_mm: Floats, path_mm: Floats, width_mm: float, face_mm: Box, whole: bool) -> MouthEnd:
    """Return the end of the crack before the first point of a path. A ``whole`` path leads to the crack's own ends."""
    leaf_mm = path_mm[0]
    sharp = False
    if whole:
        s_mm = arc_length(path_mm)
        to_rim_mm = np.asarray(KDTree(dense(ring_mm, width_mm / ACROSS)).query(path_mm)[0])
        # Circles that fit shrink fast into the corner of a blunt end, and slowly into a sharp tip.
        grows_mm = np.interp(s_mm + width_mm / 2, s_mm, to_rim_mm) - to_rim_mm
        begin = int(np.argmax(grows_mm < OPENS * width_mm / 2))
        sharp = begin == 0 and to_rim_mm[0] < POINTED * width_mm
        path_mm = path_mm[begin:]
    place_mm, ahead = path_mm[0], ahead_of(path_mm, width_mm)
    at_mm, exit_at = first_exit(ring_mm, place_mm, ahead)
    for arrives, leaves in openings(ring_mm, face_mm):
        opening_mm = KDTree(fine(stretch(ring_mm, arrives, leaves), width_mm / ACROSS))
        if opening_mm.query(leaf_mm)[0] <= width_mm / 2 or (
            at_mm <= AHEAD * width_mm and within(exit_at, arrives, leaves)
        ):
            return MouthEnd("open", arrives, leaves)
    if at_mm <= AHEAD * width_mm and not sharp:
        return MouthEnd("closed", exit_at, exit_at, blunt=True)
    if whole:
        away_mm = np.linalg.norm(ring_mm - leaf_mm, axis=1)
        near = away_mm <= max(width_mm, away_mm.min())
        tip = int(np.argmax(np.where(near, (ring_mm - leaf_mm) @ ahead, -np.inf)))
        return MouthEnd("closed", tip, tip)
    aside = np.array([-ahead[1], ahead[0]])
    arrives, leaves = (first_exit(ring_mm, place_mm, turn * aside)[1] for turn in (-1, 1))
    return MouthEnd("cut", arrives, leaves)


def straight_on(ring_mm: Floats, end: MouthEnd, lines_mm: Floats, width_mm: float) -> list[MouthEnd]:
    """Return the places at which the centreline, continued straight, may meet a blunt end. Other ends do not change.

    ``lines_mm``, (n, 6), are centreline, left and right wall from this end on. In a bend the best continuation starts
    near the end and is square to the lines from wall to wall. Before a slanted front the best one starts farther from
    the end and follows the line itself.
    """
    if not end.blunt:
        return [end]
    s_mm, ends = arc_length(lines_mm[:, :2]), []
    for before, over, by_walls in WAYS_ON:
        near_mm = lines_mm[(s_mm >= before * width_mm) & (s_mm <= (before + over) * width_mm)]
        if len(near_mm) < 2:
            continue
        backward = near_mm[-1, :2] - near_mm[0, :2]
        x, y = (near_mm[:, 2:4] - near_mm[:, 4:]).sum(axis=0)
        ahead = np.array([y, -x]) * -np.sign(y * backward[0] - x * backward[1]) if by_walls else -backward
        at_mm, exit_at = first_exit(ring_mm, near_mm[0, :2], unit(ahead))
        if at_mm <= AHEAD * width_mm:
            ends.append(replace(end, arrives=exit_at, leaves=exit_at))
    return ends or [end]


def are_square(lines_mm: Floats) -> NDArray[np.bool_]:
    """Return True for each station whose walls face each other square to the centreline.

    ``lines_mm``, (n, 6), are centreline, left and right wall.
    """
    along, across_mm = np.gradient(lines_mm[:, :2], axis=0), lines_mm[:, 2:4] - lines_mm[:, 4:]
    square_mm2 = np.abs(along[:, 0] * across_mm[:, 1] - along[:, 1] * across_mm[:, 0])
    return square_mm2 >= FACING * np.linalg.norm(along, axis=1) * np.linalg.norm(across_mm, axis=1)


def ahead_of(path_mm: Floats, over_mm: float) -> Floats:
    """Return the direction out of a path at its first point, measured over the stretch ``over_mm`` behind it."""
    back = int(np.searchsorted(arc_length(path_mm), over_mm))
    return unit(path_mm[0] - path_mm[min(back, len(path_mm) - 1)])


def openings(ring_mm: Floats, face_mm: Box) -> list[tuple[float, float]]:
    """Return each stretch of the ring that is on a side of the face, as the numbers of its first and last vertex."""
    after_mm = np.roll(ring_mm, -1, axis=0)
    stretches = []
    for side in range(4):
        level_mm, axis = face_mm[side], side % 2
        on = (np.abs(ring_mm[:, axis] - level_mm) < ON_SIDE_MM) & (np.abs(after_mm[:, axis] - level_mm) < ON_SIDE_MM)
        for begin in np.flatnonzero(on & ~np.roll(on, 1)):
            count = int(np.argmin(np.roll(on, -begin)))
            stretches.append((float(begin), float((begin + count) % len(ring_mm))))
    return stretches


def first_exit(ring_mm: Floats, place_mm: Floats, ahead: Floats) -> tuple[float, float]:
    """Return the distance at which a ray from inside the ring meets it first, and the place on the ring."""
    start, step = ring_mm, np.roll(ring_mm, -1, axis=0) - ring_mm
    turn = ahead[0] * step[:, 1] - ahead[1] * step[:, 0]
    gap = start - place_mm
    with np.errstate(divide="ignore", invalid="ignore"):
        away_mm = (gap[:, 0] * step[:, 1] - gap[:, 1] * step[:, 0]) / turn
        share = (gap[:, 0] * ahead[1] - gap[:, 1] * ahead[0]) / turn
    met = (share >= 0) & (share <= 1) & (away_mm >= 0)
    if not met.any():
        return np.inf, 0.0
    first = int(np.argmin(np.where(met, away_mm, np.inf)))
    return float(away_mm[first]), first + float(share[first])


def within(at: float, begin: float, end: float) -> bool:
    return begin <= at <= end if begin <= end else at >= begin or at <= end


def stretch(ring_mm: Floats, begin: float, end: float) -> Floats:
    """Return the stretch of the ring from one place on it, counter-clockwise, to another."""
    count = len(ring_mm)
    closed = np.vstack([ring_mm, ring_mm, ring_mm[:1]])
    if end <= begin:
        end += count
    inner = np.arange(int(np.floor(begin)) + 1, int(np.ceil(end)))
    number = np.arange(len(closed), dtype=float)
    places = at_arc_length(closed, number, np.array([begin, end]))
    return np.vstack([places[:1], closed[inner], places[1:]])


def dense(ring_mm: Floats, step_mm: float) -> Floats:
    """Return the ring's vertices and points between them, no farther apart than a step."""
    return fine(np.vstack([ring_mm, ring_mm[:1]]), step_mm)[:-1]


def fine(line_mm: Floats, step_mm: float) -> Floats:
    """Return a polyline's vertices and points between them, no farther apart than a step."""
    s_mm = arc_length(line_mm)
    parts = np.maximum(np.ceil(np.diff(s_mm) / step_mm), 1).astype(int)
    at_mm = np.concatenate(
        [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(s_mm, s_mm[1:], parts, strict=False)]
    )
    return at_arc_length(line_mm, s_mm, np.append(at_mm, s_mm[-1]))
