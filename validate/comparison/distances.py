"""How far two levels along a crack lie apart: the area between them, in bins, by Frechet; and from a constant."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from sealtwin.records import Floats, Profile
from validate.comparison.curves import Difference, Pieces, polyline

BIN_MM = 10.0
"""Of the error histogram along the crack, as in the paper's Fig. 9b; the first and the last are its start and end."""
CLOSE_MM = 1.0
"""The paper states the share of the crack's length with an error below this."""
FRECHET_MM = 0.5
"""From point to point of the curves that Frechet's distance is taken of: it hangs on them, so they are always these."""
MOST_FRECHET = 400
"""Points: beyond them the time, which grows with their square, would be felt in a sweep."""


def area_between(x_a: ArrayLike, y_a: ArrayLike, x_b: ArrayLike, y_b: ArrayLike) -> float:
    """Integral of |a - b| over the common support of two polylines, exact. Units of x times units of y.

    Points may come in any order. Raises InputError for NaN, repeated x, fewer than two points or no common support.
    """
    difference = Difference(x_a, y_a, x_b, y_b)
    return float(np.sum(np.diff(difference.x) * (np.abs(difference.value[:-1]) + np.abs(difference.value[1:])) / 2))


def area_by_similaritymeasures(x_a: ArrayLike, y_a: ArrayLike, x_b: ArrayLike, y_b: ArrayLike) -> float:
    """The same area by the library that the paper used, given what it needs to be right.

    Its ``area_between_two_curves`` pairs points by their index, not by x, and does not see a crossing inside a pair:
    fed 17 against 801 stations it is off by a factor of 3. It is exact on one common grid with every crossing in it.
    """
    import similaritymeasures

    difference = Difference(x_a, y_a, x_b, y_b)
    base = np.interp(difference.x, *polyline(x_b, y_b))
    # At a crossing both curves get one common value; rounding would else leave a sliver that drops a triangle.
    return float(
        similaritymeasures.area_between_two_curves(
            np.column_stack([difference.x, base + difference.value]), np.column_stack([difference.x, base])
        )
    )


def error_bins(simulated: Profile, measured: Profile, length_mm: float) -> list[dict[str, float]]:
    """Mean |error| in each 10 mm of the crack's length, over what is covered of it; NaN where nothing is.

    The last bin takes a remainder of up to 5 mm, or ends by as much earlier.
    """
    edges_mm = np.arange(max(1, round(length_mm / BIN_MM)) + 1) * BIN_MM
    edges_mm[-1] = length_mm
    bins = []
    for begin_mm, end_mm in pairwise(edges_mm):
        low = max(begin_mm, simulated.s_mm[0], measured.s_mm[0])
        high = min(end_mm, simulated.s_mm[-1], measured.s_mm[-1])
        mean_mm = np.nan
        if high > low:
            part = (_clipped(profile, low, high) for profile in (simulated, measured))
            mean_mm = area_between(*(axis for curve in part for axis in curve)) / (high - low)
        bins.append(
            {
                "from_mm": float(begin_mm),
                "to_mm": float(end_mm),
                "covered_mm": float(max(high - low, 0.0)),
                "mean_error_mm": float(mean_mm),
            }
        )
    return bins


def frechet_mm(simulated: Profile, measured: Profile, from_mm: float, to_mm: float) -> float:
    """Discrete Frechet distance of two curves over a stretch of s, both read at the same even points of it.

    The shortest leash of a walk along both, forward only: unlike an area it forgives a step that comes early, and
    counts it along the crack. It takes s and level for the same kind of millimetre.
    """
    import similaritymeasures

    points = min(MOST_FRECHET, max(2, round((to_mm - from_mm) / FRECHET_MM) + 1))
    s_mm = np.linspace(from_mm, to_mm, points)
    first, second = (np.column_stack([s_mm, np.interp(s_mm, one.s_mm, one.level_mm)]) for one in (simulated, measured))
    return float(similaritymeasures.frechet_dist(first, second))


def best_flat_level(x: Floats, y: Floats) -> float:
    """The constant with the smallest mean distance from a polyline: its median over the length."""
    return Pieces(x, y).quantile(0.5)


def _clipped(profile: Profile, low: float, high: float) -> tuple[Floats, Floats]:
    """Stations and levels of a part of a profile, its ends interpolated."""
    inner = profile.s_mm[(profile.s_mm > low) & (profile.s_mm < high)]
    s_mm = np.concatenate([[low], inner, [high]])
    return s_mm, np.interp(s_mm, profile.s_mm, profile.level_mm)
