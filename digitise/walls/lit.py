"""A wall that the lamp lights: its rim, brighter than the crack and darker than mortar, is crack as well."""

import numpy as np
from scipy.special import ndtri

from digitise.walls.steps import SOFTEST_PX, reached, usual_profile
from sealtwin.records import Floats

HALF = 0.5
"""Of the contrast from crack to mortar: the middle of a blurred edge."""
RIM = 0.2
"""Sigmas of the blur by which a lit rim makes an edge wider than the blur does. Less is no rim: noise does as much."""


def lit_share(share: Floats, half_px: Floats, sigma_px: float, sample_px: float, edge_fraction: float) -> Floats:
    """Share of the contrast on the rim of each wall, (2,); 0 where the wall has none.

    The rim is what lies between half the contrast, at ``half_px``, (2, stations), and ``edge_fraction`` of it.
    ``share`` of the contrast is (2, stations, samples), from the line outward.
    """
    lit = np.zeros(2)
    for number, (side, places_px) in enumerate(zip(share, half_px, strict=True)):
        rel_px = np.arange(0, max(float(np.median(places_px)), 3 * SOFTEST_PX), 0.5 * sample_px)
        profile = usual_profile(side, places_px, rel_px, sample_px)
        inner_px, outer_px = (reached(profile, rel_px, level) for level in (HALF, edge_fraction))
        if inner_px is None or outer_px is None:
            continue
        if outer_px - inner_px > sigma_px * (ndtri(edge_fraction) + RIM):
            lit[number] = np.interp(np.linspace(inner_px, outer_px), rel_px, profile).mean()
    return lit
