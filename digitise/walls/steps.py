"""The middle of the step from crack to mortar, judged by the brightness just inside it and just outside."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import ndtr, ndtri

from sealtwin.records import Floats

CLEAR = 1.5
"""Sigmas from the step beyond which a blurred edge has come within a fifteenth of its levels."""
INSIDE, OUTSIDE = 0.8, 3.0
"""Sigmas beyond that which show a level: more would reach past a lit rim inside, or into the next stain outside."""
SNAP_PX = 2.0
"""Between a wall as it is followed and the step that is taken for it."""
SHARPEST_PX, SOFTEST_PX = 0.8, 3.5
"""Of sigma: sharper than the softening itself no edge can be; softer, pixels measure nothing any more."""
OUTER = 0.84
"""Share of the contrast at which an edge is measured for its softness: one sigma out from its middle."""
LEAST_STEP = 0.25
"""Of the crack's contrast: less is no wall."""


def softness_px(share: Floats, place_px: Floats, sample_px: float, edge_fraction: float) -> float:
    """Sigma of the blurred edge, from the outer half of the sharper wall's: light on a wall spoils the inner one.

    ``share`` of the contrast, (2, stations, samples), is 0 in the crack, 1 on mortar and ``edge_fraction`` at the
    places.
    """
    rel_px = np.arange(0, 3 * SOFTEST_PX, 0.5 * sample_px)
    sigmas_px = [SOFTEST_PX]
    for side, places_px in zip(share, place_px, strict=True):
        profile = usual_profile(side, places_px, rel_px, sample_px)
        inner, outer = (reached(profile, rel_px, level) for level in (edge_fraction, OUTER))
        if outer is not None:
            sigmas_px.append((outer - (inner or 0.0)) / (ndtri(OUTER) - ndtri(edge_fraction)))
    return float(np.clip(min(sigmas_px), SHARPEST_PX, SOFTEST_PX))


def refined(
    light: Floats,
    valid: NDArray[np.bool_],
    place_px: Floats,
    sigma_px: float,
    sample_px: float,
    over: int,
    contrast: Floats,
    rim: Floats,
) -> tuple[Floats, NDArray[np.bool_]]:
    """Distance of each wall from the line in px, (2, stations), and where its step is seen.

    ``light`` and ``valid`` run from the line outward, (2, stations, samples); ``place_px`` is where the walls were
    followed, ``over`` the stations over which levels are steadied. Just inside a wall it is no darker than ``rim``,
    (2, stations), 0 where none is lit: what is read there is the crack itself where a lit rim is narrow.
    """
    width_px = np.maximum(median_filter(place_px.sum(axis=0), over, mode="nearest"), 1.0)[:, None]
    outer_px = np.arange(CLEAR * sigma_px, (CLEAR + OUTSIDE) * sigma_px, sample_px)
    inner_px = -np.arange(CLEAR * sigma_px, (CLEAR + INSIDE) * sigma_px, sample_px)
    # Not past the middle of the crack, where the other wall's light begins.
    inner_px = np.maximum(inner_px, -width_px / 2)
    shown = np.where(valid, light, np.nan)
    outer, inner = (
        _level(_between(shown, (place_px[..., None] + rel_px) / sample_px), over) for rel_px in (outer_px, inner_px)
    )
    inner = np.maximum(inner, rim)

    def brightened(rel_px: Floats) -> Floats:
        """Share of mortar in the blurred picture of a slot, so far from one wall."""
        return np.median(ndtr(rel_px / sigma_px) + ndtr(-(rel_px + width_px) / sigma_px), axis=1)

    low, middle, high = (brightened(rel_px) for rel_px in (inner_px, np.zeros(1), outer_px))
    threshold = inner + (outer - inner) * (middle - low) / (high - low)
    excess = light - threshold[..., None]
    rising = (excess[..., :-1] < 0) & (excess[..., 1:] >= 0) & valid[..., :-1] & valid[..., 1:]
    here, there = excess[..., :-1], excess[..., 1:]
    crossing_px = (np.arange(rising.shape[-1]) - here / np.where(rising, there - here, 1)) * sample_px
    away_px = np.where(rising, np.abs(crossing_px - place_px[..., None]), np.inf)
    nearest = away_px.argmin(axis=-1)[..., None]
    stepped = np.take_along_axis(away_px, nearest, -1)[..., 0] <= SNAP_PX
    step_px = np.take_along_axis(crossing_px, nearest, -1)[..., 0]
    return np.where(stepped, step_px, place_px), stepped & (outer - inner >= LEAST_STEP * contrast)


def usual_profile(side: Floats, places_px: Floats, rel_px: Floats, sample_px: float) -> Floats:
    """Median over a wall's stations of its share of the contrast, at ``rel_px`` from ``places_px`` outward."""
    sample = np.minimum((places_px[:, None] + rel_px) / sample_px, side.shape[1] - 1)
    return np.median(_between(side, sample), axis=0)


def reached(profile: Floats, at: Floats, level: float) -> float | None:
    """Where a profile first comes to a level; None where it does not."""
    first = int(np.argmax(profile >= level))
    if profile[first] < level:
        return None
    if first == 0:
        return float(at[0])
    return float(np.interp(level, profile[first - 1 : first + 1], at[first - 1 : first + 1]))


def _level(values: Floats, over: int) -> Floats:
    """Median across, steadied along, (2, stations); where nothing is seen, that of the neighbours."""
    station = np.arange(values.shape[1])
    levels = np.zeros(values.shape[:2])
    for side, level in zip(values, levels, strict=True):
        known = np.isfinite(side).any(axis=1)
        if known.any():
            level[:] = np.interp(station, station[known], np.nanmedian(side[known], axis=1))
    return median_filter(levels, (1, over), mode="nearest")


def _between(values: Floats, column: Floats) -> Floats:
    """Each row of values at columns between its own, (..., n); NaN beyond the first and last."""
    last = values.shape[-1] - 1
    left = np.clip(column.astype(int), 0, last - 1)
    here, there = (np.take_along_axis(values, left + step, axis=-1) for step in (0, 1))
    return np.where((column >= 0) & (column <= last), here + (column - left) * (there - here), np.nan)
