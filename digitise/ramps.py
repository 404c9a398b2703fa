"""How a nozzle comes to speed and to a stop: at constant acceleration, over a given way."""

import numpy as np

from sealtwin.records import Floats


def times_along(way_mm: Floats, speed_mm_s: float, ramp_mm: float) -> Floats:
    """When each place of a path is reached, (n,) in s from 0.

    From rest the nozzle takes ``ramp_mm`` to ``speed_mm_s`` and the same back to rest, at the acceleration
    v² / (2 ramp): after x of a ramp, t = 2 sqrt(ramp x) / v, twice what it takes at speed where x is the whole ramp.

    Args:
        way_mm: Distance from the start, (n,), increasing from 0; its last is the length of the path.
        speed_mm_s: Between the ramps.
        ramp_mm: At most half the length; 0 is at speed at once.
    """
    length_mm = way_mm[-1]
    if ramp_mm == 0:
        return way_mm / speed_mm_s
    into_mm = np.minimum(way_mm, ramp_mm)
    left_mm = np.minimum(length_mm - way_mm, ramp_mm)
    even_mm = np.clip(way_mm - ramp_mm, 0.0, length_mm - 2 * ramp_mm)
    return (2 * np.sqrt(ramp_mm * into_mm) + even_mm + 2 * (ramp_mm - np.sqrt(ramp_mm * left_mm))) / speed_mm_s
