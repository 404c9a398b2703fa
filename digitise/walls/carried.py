"""Walls where they are not seen: bridged in between, and carried on past the last place where they were seen."""

import numpy as np
from numpy.typing import NDArray

from sealtwin.records import Floats

RECENT, USUAL = 0.25, 8.0
"""Crack widths before the place where a wall is lost. The width beyond is expected halfway between the mean of the
first and the median of the second: a wandering width goes back to what is usual.
"""
TREND = 4
"""Stations before that place that tell how a wall was turning: fewer tell of grain."""
STEEPEST = 0.5
"""Sideways over along: steeper turns are those of a pore or a grain."""
TURNING = 0.5
"""Crack widths over which it stops to turn."""

Side = tuple[Floats, NDArray[np.bool_]]
"""Distance of a wall from the line, and where it was seen, (stations,)."""


def completed(left: Side, right: Side, across: float, station: float, both_reach_edge: bool) -> tuple[Floats, Floats]:
    """Both walls at every station; ``across`` is the number of stations in one crack width, ``station`` their distance.

    At the ends a wall that is lost before the other one goes with it, at the width that the crack has there: the edge
    of the face hides it. With ``both_reach_edge`` the rays lie along that edge, and each wall just keeps its way.
    """
    number = np.arange(len(left[0]))
    walls = [np.interp(number, number[seen], wall[seen]) if seen.any() else wall.copy() for wall, seen in (left, right)]
    if not (left[1].any() and right[1].any()):
        return walls[0], walls[1]
    for onward in (slice(None), slice(None, None, -1)):
        lasts = [int(np.flatnonzero(seen[onward])[-1]) for _, seen in (left, right)]
        near, far = (walls[side][onward] for side in np.argsort(lasts, kind="stable"))
        last, last_far = sorted(lasts)
        if both_reach_edge:
            _keep_turning(near, last, across, STEEPEST * station)
            _keep_turning(far, last_far, across, STEEPEST * station)
        else:
            far[last_far:] = far[last_far]
            near[last + 1 :] = np.maximum(_expected_width(near + far, last, across) - far[last + 1 :], 0)
    return walls[0], walls[1]


def _expected_width(width: Floats, last: int, across: float) -> float:
    def before(widths: float) -> Floats:
        return width[max(0, last + 1 - max(1, round(widths * across))) : last + 1]

    return float(np.mean(before(RECENT)) + np.median(before(USUAL))) / 2


def _keep_turning(wall: Floats, last: int, across: float, steepest: float) -> None:
    """Write what lies past ``last``."""
    known = np.arange(max(0, last + 1 - TREND), last + 1)
    past = np.arange(last + 1, len(wall))
    slope = float(np.polyfit(known, wall[known], 1)[0]) if len(known) > 1 else 0.0
    slope, reach = np.clip(slope, -steepest, steepest), TURNING * across
    wall[past] = np.mean(wall[known]) + slope * (last - np.mean(known) + reach * (1 - np.exp(-(past - last) / reach)))
