"""Places on the rim of a crack's mouth, which is a ring of corners, counter-clockwise.

A place is a number: the index of an edge's first corner, plus the share of the edge up to the place.
"""

import numpy as np

from digitise.geometry.polyline import Box, at_arc_length
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats

ON_SIDE_MM = 1e-3  # Distance from the edge of the face within which the mouth's rim is an opening
Place = float


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
