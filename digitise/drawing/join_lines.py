"""Lines of a drawing. Lines that meet end to end, such as the segments of CAD programs, are joined into one."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from sealtwin.core.errors import ShapeError
from sealtwin.core.records import Floats

MEETS_MM = 1e-3  # Largest gap between two lines that are one
COPY_MM = 1e-6  # Largest distance of a copy's points from the original's: rounding of the digits in a file
MOST_MEETING = 50  # Most lines that may end in one place: the time for a star of lines grows with their square


@dataclass(frozen=True)
class DrawnLine:
    """A polyline in mm; a closed one does not repeat its first point."""

    points_mm: Floats  # (n, 2)
    closed: bool


@dataclass(frozen=True)
class Gap:
    """A gap between the ends of open lines, or a place at which more than two lines meet."""

    place_mm: Floats  # (2,)
    size_mm: float  # 0 if lines meet
    lines: int  # Number of lines that meet there; 1 at a gap


def closes(points_mm: Floats) -> bool:
    """Return True if the last point of a line repeats its first."""
    return len(points_mm) > 3 and float(np.linalg.norm(points_mm[0] - points_mm[-1])) <= MEETS_MM


def without_copies(lines: Sequence[DrawnLine]) -> list[DrawnLine]:
    """Drop repeated copies of lines. A copy may start at the other end, or at another corner."""
    shapes, once = set[bytes](), []
    for line in lines:
        if (key := _shape(line)) not in shapes:
            shapes.add(key)
            once.append(line)
    return once


def _shape(line: DrawnLine) -> bytes:
    """Return bytes that are equal for all ways to write the same line."""
    # Adding zero turns -0 into 0.
    points = np.rint(line.points_mm / COPY_MM) + 0.0
    ways = [points, points[::-1]]
    if line.closed:
        ways = [np.roll(way, -int(np.lexsort(way.T[::-1])[0]), axis=0) for way in ways]
    return min(way.tobytes() for way in ways)


def joined(lines: Sequence[DrawnLine]) -> list[DrawnLine]:
    """Join open lines that meet end to end. If several lines meet at an end, the first drawn of them is joined."""
    done, ways = [line for line in lines if line.closed], [line.points_mm for line in lines if not line.closed]
    if not ways:
        return done
    places_mm = _ends_mm(ways)
    tree = KDTree(places_mm)
    meeting = np.asarray(tree.query_ball_point(places_mm, MEETS_MM, return_length=True))
    if meeting.max() > MOST_MEETING:
        x, y = places_mm[meeting.argmax()]
        raise ShapeError(f"{meeting.max()} lines meet near ({x:.6g}, {y:.6g}) mm.", "Draw one line.", "outline")
    near = [sorted(ends) for ends in tree.query_ball_point(places_mm, MEETS_MM)]
    waiting = np.ones(len(ways), dtype=bool)
    for number in range(len(ways) - 1, -1, -1):
        if waiting[number]:
            points_mm = _chain(number, ways, near, waiting)
            closed = closes(points_mm)
            done.append(DrawnLine(points_mm[:-1] if closed else points_mm, closed))
    return done


def _chain(number: int, ways: Sequence[Floats], near: Sequence[list[int]], waiting: NDArray[np.bool_]) -> Floats:
    """Return the points of a line and of all lines that continue it. Sets ``waiting`` to False for all of these lines.

    End 2 n is the first point of line n, and 2 n + 1 its last one.
    """
    parts = deque([ways[number]])
    waiting[number] = False
    ends = {False: 2 * number, True: 2 * number + 1}  # The chain's own ends, by whether they are its last one
    at_last = True  # The end at which the chain grows
    while True:
        # A line at the chain's beginning makes it grow in the other direction.
        ahead, behind = (
            next((end for end in near[ends[at]] if waiting[end // 2]), None) for at in (at_last, not at_last)
        )
        if behind is not None and (ahead is None or behind // 2 < ahead // 2):
            at_last, ahead = not at_last, behind
        if ahead is None:
            break
        following, by_its_last = divmod(ahead, 2)
        waiting[following] = False
        points_mm = ways[following][::-1] if by_its_last else ways[following]
        if at_last:
            parts.append(points_mm[1:])
        else:
            parts.appendleft(points_mm[:0:-1])
        ends[at_last] = ahead ^ 1
    points_mm = np.vstack(parts)
    return points_mm if at_last else points_mm[::-1]


def forks(lines: Sequence[DrawnLine]) -> list[Gap]:
    """Return the places at which more than two open lines meet. There it is not clear which line is the next one."""
    ways = [line.points_mm for line in lines if not line.closed]
    if not ways:
        return []
    places_mm = _ends_mm(ways)
    near = KDTree(places_mm).query_ball_point(places_mm, MEETS_MM)
    return [
        Gap(places_mm[number], 0.0, len(ends))
        for number, ends in enumerate(near)
        if len(ends) > 2 and number == min(ends)
    ]


def gaps(lines: Sequence[DrawnLine]) -> list[Gap]:
    """Return the gaps between the ends of open lines, the smallest first. Each gap is listed once."""
    ways = [line.points_mm for line in lines if not line.closed]
    if not ways:
        return []
    places_mm = _ends_mm(ways)
    away_mm, other = map(np.asarray, KDTree(places_mm).query(places_mm, k=2))
    by_ends = dict[frozenset[int], Gap]()
    for end, (sizes_mm, others) in enumerate(zip(away_mm, other, strict=True)):
        nearest, size_mm = (others[1], sizes_mm[1]) if others[0] == end else (others[0], sizes_mm[0])
        if size_mm > MEETS_MM:
            by_ends.setdefault(frozenset((end, int(nearest))), Gap(places_mm[end], float(size_mm), 1))
    return sorted(by_ends.values(), key=lambda gap: gap.size_mm)


def _ends_mm(ways: Sequence[Floats]) -> Floats:
    return np.array([way[end] for way in ways for end in (0, -1)])
