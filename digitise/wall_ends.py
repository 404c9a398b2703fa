"""Walls that end where the crack does: at an open end, on the edge of the face."""

import numpy as np

from digitise.polyline import Box, at_arc_length, depth_inside
from sealtwin.records import Floats


def walls_on_face(
    left_mm: Floats, right_mm: Floats, s_mm: Floats, stations_mm: Floats, face_mm: Box, open_ends: tuple[bool, bool]
) -> tuple[Floats, Floats]:
    """Both walls at each of ``stations_mm``, none of it beyond the face.

    The walls are known at ``s_mm`` along a line that runs on past both open ends. The normals of an oblique crack's
    last stations leave the face on one side and miss a corner of it on the other: there the one wall stands still where
    it met the edge, and the other spreads the same stations over what is left of it, up to the edge.
    """
    met = [_edge_places_mm(wall, s_mm, stations_mm, face_mm, open_ends) for wall in (left_mm, right_mm)]
    middle = (stations_mm[0] + stations_mm[-1]) / 2
    # Between these two, both walls lie inside the face.
    begin = min(max(stations_mm[0], met[0][0], met[1][0]), middle)
    end = max(min(stations_mm[-1], met[0][1], met[1][1]), middle)
    low, high = face_mm[:2], face_mm[2:]
    walls = []
    for wall, (first, last) in zip((left_mm, right_mm), met, strict=True):
        places = np.interp(stations_mm, [stations_mm[0], begin, end, stations_mm[-1]], [first, begin, end, last])
        places[[0, -1]] = first, last
        walls.append(np.clip(at_arc_length(wall, s_mm, np.clip(places, first, last)), low, high))
    return walls[0], walls[1]


def _edge_places_mm(
    wall_mm: Floats, s_mm: Floats, stations_mm: Floats, face_mm: Box, open_ends: tuple[bool, bool]
) -> tuple[float, float]:
    """Where along the line a wall comes onto the face and leaves it: the first and last station at ends not open.

    A wall that does not reach the edge, as beside a very oblique end, ends where it is last known.
    """
    depth_mm = depth_inside(wall_mm, face_mm)
    middle = int(np.argmin(np.abs(s_mm - (stations_mm[0] + stations_mm[-1]) / 2)))
    outside = np.flatnonzero(depth_mm < 0)
    before, after = outside[outside < middle], outside[outside > middle]
    first, last = stations_mm[0], stations_mm[-1]
    if open_ends[0]:
        first = _crossing_mm(depth_mm, s_mm, int(before[-1]), 1) if len(before) else s_mm[0]
    if open_ends[1]:
        last = _crossing_mm(depth_mm, s_mm, int(after[0]), -1) if len(after) else s_mm[-1]
    return float(first), float(last)


def _crossing_mm(depth_mm: Floats, s_mm: Floats, outside: int, inward: int) -> float:
    inside = outside + inward
    fraction = depth_mm[inside] / (depth_mm[inside] - depth_mm[outside])
    return float(s_mm[inside] + fraction * (s_mm[outside] - s_mm[inside]))
