"""Follow a wall through a straightened crack: the smoothest line that parts dark from bright."""

import numpy as np

from sealtwin.records import Floats

STEEPEST = 3.2
"""Sideways per step along the crack: a wall at 73 degrees to its line."""
STIFFNESS = 0.5
"""Price, in px, of a step sideways as far as along, against a px of misplaced mortar: a round pore or a thin branch
costs more to go round than to pass, a real bend does not.
"""


def follow(excess: Floats, sample_px: float, station_px: float) -> Floats:
    """The wall of each side in px from the line, (sides, stations), to a sample.

    ``excess``, (sides, stations, samples), is negative in the crack and positive on the mortar. The wall that splits
    them best has the least sum of excess inside it; dynamic programming weighs that against steps sideways.
    """
    inside = np.cumsum(excess, axis=2) * sample_px
    sides, stations, samples = inside.shape
    most = max(1, round(STEEPEST * station_px / sample_px))
    steps = np.arange(-most, most + 1)
    price = STIFFNESS / station_px * (steps * sample_px) ** 2
    reached = np.full((sides, samples + 2 * most), np.inf)
    best = inside[:, 0]
    came_by = np.zeros((stations, sides, samples), dtype=np.intp)
    for station in range(1, stations):
        reached[:, most:-most] = best
        options = np.lib.stride_tricks.sliding_window_view(reached, 2 * most + 1, axis=1) + price
        came_by[station] = options.argmin(axis=2)
        best = np.take_along_axis(options, came_by[station][..., None], axis=2)[..., 0] + inside[:, station]
    place = np.empty((sides, stations), dtype=np.int_)
    place[:, -1] = best.argmin(axis=1)
    side = np.arange(sides)
    for station in range(stations - 1, 0, -1):
        place[:, station - 1] = place[:, station] + steps[came_by[station, side, place[:, station]]]
    return np.asarray((place + 0.5) * sample_px, dtype=float)
