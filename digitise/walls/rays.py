"""The directions in which the walls of a crack are looked for."""

from dataclasses import dataclass

import numpy as np

from digitise.geometry.polyline import Box, depth_inside, left_normals, tangents
from sealtwin.records import Floats, arc_length

SPREAD = 0.6
"""Crack widths to each side of the line within which no two rays meet: a little more than the crack is wide."""
MOST_OBLIQUE = 8.0
"""Cotangent of the angle to the edge, 7 degrees, up to which rays follow it."""


@dataclass(frozen=True)
class Crossing:
    """Where a line meets the edge of the face."""

    s_mm: float
    inward: Floats
    """Unit normal of that edge, onto the face."""


Crossings = tuple[Crossing | None, Crossing | None]
"""At the first end and at the last, where these are open."""


def edge_crossing(line_mm: Floats, face_mm: Box, at_start: bool) -> Crossing | None:
    """Where the line enters the face, or leaves it, as seen from its middle; None where it does not."""
    s_mm, depth_mm = arc_length(line_mm), depth_inside(line_mm, face_mm)
    outside = np.flatnonzero(depth_mm < 0)
    middle = len(line_mm) // 2
    beyond = outside[outside < middle] if at_start else outside[outside > middle]
    if len(beyond) == 0 or depth_mm[middle] < 0:
        return None
    out = int(beyond[-1] if at_start else beyond[0])
    inner = out + 1 if at_start else out - 1
    fraction = depth_mm[inner] / (depth_mm[inner] - depth_mm[out])
    place_mm = line_mm[inner] + fraction * (line_mm[out] - line_mm[inner])
    x_min, y_min, x_max, y_max = face_mm
    away_mm = np.abs(np.array([place_mm[0] - x_min, place_mm[1] - y_min, x_max - place_mm[0], y_max - place_mm[1]]))
    inward = np.array([[1, 0], [0, 1], [-1, 0], [0, -1.0]])[int(np.argmin(away_mm))]
    return Crossing(float(s_mm[inner] + fraction * (s_mm[out] - s_mm[inner])), inward)


def rays_across(line_mm: Floats, width_mm: float, crossings: Crossings) -> Floats:
    """From each station of a line to the left, (n, 2), as long as reaches 1 mm square to the line.

    Where the crack runs free they are square to it. Beside an open end they lie along the edge of the face, which an
    oblique crack's normals would meet before its wall; in between they turn from one to the other.
    """
    s_mm, along, normal = arc_length(line_mm), tangents(line_mm), left_normals(line_mm)
    shear, turned = np.zeros((2, len(line_mm)))
    for crossing in crossings:
        if crossing is None:
            continue
        to_edge = np.clip(-(normal @ crossing.inward) / _not_zero(along @ crossing.inward), -MOST_OBLIQUE, MOST_OBLIQUE)
        oblique = abs(float(np.interp(crossing.s_mm, s_mm, to_edge)))
        # The edge cuts off a normal's wall within half a width times the cotangent; turned over as much again and
        # more, rays do not meet within the crack.
        reaches = np.abs(s_mm - crossing.s_mm) / max(SPREAD * width_mm * oblique, 1e-9)
        share = np.clip(2 - reaches, 0, 1)
        shear, turned = shear + share * to_edge, turned + share
    return normal + (shear / np.maximum(turned, 1))[:, None] * along


def _not_zero(values: Floats) -> Floats:
    return np.copysign(np.maximum(np.abs(values), 1e-6), values)
