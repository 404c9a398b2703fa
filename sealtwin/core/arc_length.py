"""Arc length along an open polyline."""

import numpy as np

from sealtwin.core.arrays import Floats, lengths

STRETCH = 8  # Number of consecutive segments that are searched together; it affects only the speed
MOST_AT_ONCE = 50_000  # Number of points whose distances are in memory at once


def step_lengths(points: Floats) -> Floats:
    """Return the distance of each point from the next one, (n - 1,)."""
    return lengths(np.diff(points, axis=0))


def arc_length(points_mm: Floats) -> Floats:
    """Return the distance of each point of an open polyline from the first one, measured along the polyline, (n,)."""
    return np.cumulative_sum(step_lengths(points_mm), include_initial=True)


def at_arc_length(values: Floats, s: Floats, stations: Floats) -> Floats:
    """Interpolate each column of ``values`` linearly at ``stations``. The values are given at arc lengths ``s``."""
    return np.column_stack([np.interp(stations, s, column) for column in values.T])


def arc_length_at(points_mm: Floats, polyline_mm: Floats) -> Floats:
    """Return the arc length of the nearest point of a polyline to each of ``points_mm``, (n,).

    The polyline is extended straight beyond both ends. For speed, its segments are searched in groups. A group is
    skipped for the points that are certainly nearer to another group.
    """
    if len(points_mm) > MOST_AT_ONCE:
        parts = np.array_split(points_mm, len(points_mm) // MOST_AT_ONCE + 1)
        return np.concatenate([arc_length_at(part, polyline_mm) for part in parts])
    begins_mm, steps = arc_length(polyline_mm), np.diff(polyline_mm, axis=0)
    last = len(steps) - 1
    stretches = [slice(first, min(first + STRETCH, last + 1)) for first in range(0, last + 1, STRETCH)]
    middle_mm = np.array([polyline_mm[(part.start + part.stop) // 2] for part in stretches])
    corners = zip(stretches, middle_mm, strict=True)
    reach_mm = [np.hypot(*(polyline_mm[part.start : part.stop + 1] - middle).T).max() for part, middle in corners]
    away_mm = np.hypot(*(points_mm[:, None] - middle_mm).transpose(2, 0, 1))
    near = away_mm - reach_mm <= (away_mm + reach_mm).min(axis=1, initial=np.inf, keepdims=True)
    nearest = np.full(len(points_mm), np.inf)
    s_mm = np.zeros(len(points_mm))
    everything = np.arange(len(points_mm))
    for part, close in zip(stretches, map(np.flatnonzero, near.T), strict=True):
        for index in range(part.start, part.stop):
            step = steps[index]
            length_mm = np.hypot(*step)
            if length_mm == 0:
                continue
            these = everything if index in (0, last) else close
            offset = points_mm[these] - polyline_mm[index]
            least, most = -np.inf if index == 0 else 0.0, np.inf if index == last else 1.0
            along = np.clip(offset @ step / length_mm**2, least, most)
            distance = ((offset - along[:, None] * step) ** 2).sum(axis=1)
            closer = distance < nearest[these]
            nearest[these[closer]] = distance[closer]
            s_mm[these[closer]] = begins_mm[index] + along[closer] * length_mm
    return s_mm
