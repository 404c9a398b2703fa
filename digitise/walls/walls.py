"""Both walls of a crack in a straightened photo, to a fraction of a pixel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from digitise.walls.carried import completed
from digitise.walls.follow import follow
from digitise.walls.lit import HALF, lit_share
from digitise.walls.steps import refined, softness_px
from digitise.walls.strip import Strip
from sealtwin.records import Floats

CRACK = 0.25
"""Crack widths from the line within which it is dark."""
MORTAR = (0.8, 1.5)
"""Crack widths from the line between which there is mortar."""

REFINEMENTS = 2
"""Levels beside a wall are read at distances from it: once from a sample near it, then from the wall."""


@dataclass(frozen=True)
class Walls:
    """Distance of each wall from the line, station by station, positive outward."""

    left_mm: Floats
    right_mm: Floats
    left_seen: NDArray[np.bool_]
    """The wall is in the picture there, with a clear step from dark to bright."""
    right_seen: NDArray[np.bool_]
    open_line: NDArray[np.bool_]
    """The line itself runs in the dark."""
    dark: Floats
    """Brightness of the crack, and of the mortar beside it."""
    bright: Floats

    @property
    def both_seen(self) -> NDArray[np.bool_]:
        return self.left_seen & self.right_seen

    @property
    def width_mm(self) -> Floats:
        return self.left_mm + self.right_mm


def find_walls(strip: Strip, width_mm: float, edge_fraction: float = 0.5, both_reach_edge: bool = False) -> Walls:
    """Both walls in the middle of their steps from dark to bright, followed as smoothly as the picture allows.

    ``width_mm`` is the typical width of the crack. Up to ``edge_fraction`` of the contrast, from crack to mortar, all
    is crack: below a half, less than a lit wall; above, less than a stain. Above, a wall with a lit rim is drawn midway
    from its brightness to the mortar's, one without in the middle of its step. Where a wall is lost it is completed.
    """
    across = width_mm / strip.mm_per_px / strip.station_px
    over = 2 * int(np.ceil(across)) + 1
    distance = np.abs(strip.offset_mm)
    dark = _level(strip, strip.valid & (distance < CRACK * width_mm), over)
    # A tip is narrower than the band and would pass mortar for its darkness.
    dark = np.minimum(dark, np.median(dark))
    beside = strip.valid & (distance > MORTAR[0] * width_mm) & (distance < MORTAR[1] * width_mm)
    usual = float(np.median(strip.light[beside])) if beside.any() else 0.0
    # Where the crack is wide, the band beside it is crack as well; that is not what mortar looks like.
    mortar = beside & (strip.light > (2 * dark[:, None] + usual) / 3)
    bright = np.stack([_level(strip, mortar & (sign * strip.offset_mm > 0), over) for sign in (1, -1)])
    light, valid = _outward(strip, strip.light), _outward(strip, strip.valid)
    contrast = np.maximum(bright - dark, 1e-6)
    share = np.clip((light - dark[:, None]) / contrast[..., None], 0, 1)

    def excess(fraction: float) -> Floats:
        # Where nothing is known, nothing pulls a wall.
        return np.where(valid, share - fraction, 0)

    fraction, lit = min(edge_fraction, HALF), np.zeros(2)
    place_px = follow(excess(fraction), strip.sample_px, strip.station_px)
    sigma_px = softness_px(share, place_px, strip.sample_px, fraction)
    if edge_fraction > HALF:
        lit = lit_share(share, place_px, sigma_px, strip.sample_px, edge_fraction)
        for side in np.flatnonzero(lit):
            midway = max(edge_fraction, (1 + lit[side]) / 2)
            place_px[side] = follow(excess(midway)[side : side + 1], strip.sample_px, strip.station_px)[0]
    rim = np.where(lit[:, None] > 0, dark + lit[:, None] * contrast, 0)
    seen = np.zeros(place_px.shape, dtype=bool)
    for _ in range(REFINEMENTS):
        place_px, seen = refined(light, valid, place_px, sigma_px, strip.sample_px, over, contrast, rim)
    left, right = zip(place_px * strip.mm_per_px, seen, strict=True)
    left_mm, right_mm = completed(left, right, across, strip.station_px * strip.mm_per_px, both_reach_edge)
    bright = bright.mean(axis=0)
    open_line = strip.light[:, strip.middle] < (dark + bright) / 2
    return Walls(left_mm, right_mm, seen[0], seen[1], open_line, dark, bright)


def _outward(strip: Strip, values: NDArray) -> NDArray:
    """Left and right half of a strip, both from the line outward, (2, stations, samples)."""
    return np.stack([values[:, strip.middle :], values[:, strip.middle :: -1]])


def _level(strip: Strip, where: NDArray[np.bool_], over: int) -> Floats:
    """Median brightness of some pixels of each station, steadied along the strip.

    Stations that have too few of them take their neighbours' value.
    """
    known = where.sum(axis=1) >= 3
    if not known.any():
        return np.zeros(len(strip.light))
    values = np.where(where[known], strip.light[known], np.nan)
    stations = np.arange(len(strip.light))
    level = np.interp(stations, stations[known], np.nanmedian(values, axis=1))
    return median_filter(level, size=over, mode="nearest")
