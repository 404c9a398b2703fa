"""The nearest place on a ring, exactly: at a corner, the corner itself."""

import numpy as np

from sealtwin.records import Floats

AT_ONCE = 2_000_000
"""Pairs of a point and an edge that are weighed at a time."""


def nearest_on_ring(points: Floats, ring: Floats) -> Floats:
    """For each point, (n, 2)."""
    start, step = ring, np.roll(ring, -1, axis=0) - ring
    length_squared = (step**2).sum(axis=1)
    found = []
    for some in np.array_split(points, 1 + len(points) * len(ring) // AT_ONCE):
        along = ((some[:, None] - start) * step).sum(axis=2)
        share = np.divide(along, length_squared, out=np.zeros_like(along), where=length_squared > 0).clip(0, 1)
        place = start + share[:, :, None] * step
        best = ((place - some[:, None]) ** 2).sum(axis=2).argmin(axis=1)
        found.append(place[np.arange(len(some)), best])
    return np.concatenate(found)
