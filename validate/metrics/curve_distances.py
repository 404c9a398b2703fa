"""Distances between two levels along a crack: the area between them, in total and in bins, and Frechet's distance.

Both levels are piecewise linear, so integrals and quantiles are exact. No library supports curves with different
stations. Every comparison checks the area with the library similaritymeasures.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from sealtwin.core.errors import InputError
from sealtwin.core.records import Booleans, Floats, Profile
from validate.comparison import ComparedStations, ErrorBin, ErrorFigures
from validate.intervals import Alignment, ShiftedError

BIN_MM = 10.0
"""Length of an error bin along the crack, as in the paper's Fig. 9b, whose outer bins are the start and end zones."""
CLOSE_MM = 1.0  # Error for which the paper states the fraction of the crack's length below it
FRECHET_MM = 0.5  # Spacing of the points for Frechet's distance. It is fixed, because the distance depends on it.
MAX_FRECHET = 400  # Largest number of points, since the time grows with its square
ROUNDING = 1e-14  # Rounding error of a difference, as a fraction of its largest value


class PiecewiseLinear:
    """A continuous, piecewise linear function: values at increasing x, straight lines between them."""

    def __init__(self, x: Floats, value: Floats) -> None:
        self.x, self.value = x, value
        self.length_mm = float(x[-1] - x[0])

    def mean(self) -> float:
        return float(np.trapezoid(self.value, self.x) / self.length_mm)

    def rms(self) -> float:
        first, last = self.value[:-1], self.value[1:]
        return float(np.sqrt(np.sum(np.diff(self.x) * (first**2 + first * last + last**2) / 3) / self.length_mm))

    def share_below(self, limit: float) -> float:
        """Return the fraction of the length on which the function is below a limit."""
        low, high = np.sort([self.value[:-1], self.value[1:]], axis=0)
        rise = high - low
        part = np.where(rise > 0, (limit - low) / np.where(rise > 0, rise, 1.0), limit > low)
        return float(np.sum(np.diff(self.x) * np.clip(part, 0.0, 1.0)) / self.length_mm)

    def quantile(self, share: float) -> float:
        """Return the value that the function does not exceed on the fraction ``share`` of the length."""
        low, high = float(self.value.min()), float(self.value.max())
        for _ in range(100):
            middle = (low + high) / 2
            low, high = (low, middle) if self.share_below(middle) >= share else (middle, high)
        return high


class Difference(PiecewiseLinear):
    """The difference a - b over the range that both curves cover, at the points of both and at each crossing."""

    def __init__(self, x_a: ArrayLike, y_a: ArrayLike, x_b: ArrayLike, y_b: ArrayLike) -> None:
        """Prepare the difference of two curves. Their points may have any order.

        Raises InputError for NaN, repeated x, fewer than two points or no overlap.
        """
        x_a, y_a = _polyline(x_a, y_a)
        x_b, y_b = _polyline(x_b, y_b)
        low, high = max(x_a[0], x_b[0]), min(x_a[-1], x_b[-1])
        if not low < high:
            raise InputError(
                f"The curves do not overlap: {x_a[0]:g} to {x_a[-1]:g} and {x_b[0]:g} to {x_b[-1]:g}. "
                "Check that both measure s from the same end, in mm."
            )
        x = np.unique(np.concatenate([x_a, x_b]))
        x = x[(x >= low) & (x <= high)]
        value = np.interp(x, x_a, y_a) - np.interp(x, x_b, y_b)
        # Rounding would move a crossing that is exactly at a station.
        value[np.abs(value) < ROUNDING * np.abs(value).max()] = 0.0
        crosses = np.sign(value[:-1]) * np.sign(value[1:]) < 0
        first, last = value[:-1][crosses], value[1:][crosses]
        # A crossing that rounds to a station would be a second point there. So close to a station, it adds no area.
        crossing = np.setdiff1d(x[:-1][crosses] + np.diff(x)[crosses] * (first / (first - last)), x)
        order = np.argsort(np.concatenate([x, crossing]), kind="stable")
        value = np.concatenate([value, np.zeros(len(crossing))])[order]
        super().__init__(np.concatenate([x, crossing])[order], value)
        self.base = PiecewiseLinear(self.x, np.interp(self.x, x_b, y_b))  # The second curve

    @property
    def area(self) -> float:
        """The integral of |a - b|, in units of x times units of y."""
        return float(np.trapezoid(np.abs(self.value), self.x))

    @property
    def mean_error(self) -> float:
        """The mean of |a - b| over the range that both curves cover."""
        return self.area / self.length_mm

    def area_by_similaritymeasures(self) -> float:
        """Return the area computed with the library that the paper used, on one grid that includes every crossing.

        The library's ``area_between_two_curves`` pairs points by index, not by x, and ignores a crossing inside a pair.
        For 17 and 801 stations it is wrong by a factor of 3. On a common grid it is exact.
        """
        import similaritymeasures

        # At a crossing both curves are equal; a rounding difference would lose a triangle.
        curves = (np.column_stack([self.x, level]) for level in (self.base.value + self.value, self.base.value))
        return float(similaritymeasures.area_between_two_curves(*curves))

    @property
    def size(self) -> PiecewiseLinear:
        """The absolute value |a - b|."""
        return PiecewiseLinear(self.x, np.abs(self.value))


def level_difference(simulated: Profile, measured: Profile) -> Difference:
    """Return the simulated minus the measured level. Raises InputError if the two do not overlap."""
    return Difference(simulated.s_mm, simulated.level_mm, measured.s_mm, measured.level_mm)


def are_compared(s_mm: Floats, from_mm: float, to_mm: float) -> Booleans:
    """Return True for each station on the compared stretch, including its ends, (n,)."""
    return (s_mm >= from_mm) & (s_mm <= to_mm)


def compared_stations(simulated: Profile, measured: Profile) -> ComparedStations:
    """Return the stations of the readings on the stretch that both levels cover, with both levels."""
    inside = are_compared(measured.s_mm, simulated.s_mm[0], simulated.s_mm[-1])
    s_mm, measured_mm = measured.s_mm[inside], measured.level_mm[inside]
    return ComparedStations(s_mm=s_mm, measured_mm=measured_mm, simulated_mm=simulated.level_at_mm(s_mm))


def _polyline(x: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
    """Return points sorted by x, (n,) each. Raises InputError if they are not a function of x."""
    x, y = np.array(x, float), np.array(y, float)
    if x.ndim != 1 or x.shape != y.shape or len(x) < 2:
        raise InputError(
            f"A curve needs at least two points, and as many x as y, but the shapes are {x.shape} and {y.shape}."
        )
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise InputError("A curve contains NaN or infinity. Remove missing stations.")
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    if (np.diff(x) == 0).any():
        repeated = x[1:][np.diff(x) == 0][0]
        raise InputError(f"A curve has two values at {repeated:g}. Give one value for each station.")
    return x, y


def error_figures(error: Difference, measured: Profile) -> ErrorFigures:
    """Return the errors of a level from ``error``, its difference from the readings."""
    size = error.size
    worst = int(np.argmax(size.value))
    # The nearest constant level is the readings' median over the length.
    flat_mm = error.base.quantile(0.5)
    line = Profile(error.x[[0, -1]], np.full(2, flat_mm))
    return ErrorFigures(
        mean_error_mm=error.mean_error,
        bias_mm=error.mean(),
        worst_error_mm=float(size.value[worst]),
        worst_at_mm=float(error.x[worst]),
        share_under_1_mm=size.share_below(CLOSE_MM),
        flat_level_mm=flat_mm,
        flat_level_error_mm=level_difference(line, measured).mean_error,
    )


def error_bins(simulated: Profile, measured: Profile, length_mm: float) -> tuple[ErrorBin, ...]:
    """Return the mean |error| in each 10 mm of the crack, over the part that both levels cover.

    The last bin is up to 5 mm longer or shorter than the others.
    """
    edges_mm = np.arange(max(1, round(length_mm / BIN_MM)) + 1) * BIN_MM
    edges_mm[-1] = length_mm
    bins = []
    for begin_mm, end_mm in pairwise(edges_mm):
        low = max(begin_mm, simulated.s_mm[0], measured.s_mm[0])
        high = min(end_mm, simulated.s_mm[-1], measured.s_mm[-1])
        mean_mm = None
        if high > low:
            part = Difference(*_clipped(simulated, low, high), *_clipped(measured, low, high))
            mean_mm = part.area / (high - low)
        bins.append(ErrorBin(float(begin_mm), float(end_mm), float(max(high - low, 0.0)), mean_mm))
    return tuple(bins)


def frechet_mm(simulated: Profile, measured: Profile, from_mm: float, to_mm: float) -> float:
    """Return the discrete Frechet distance of two curves over a stretch of s, both sampled at the same even points.

    If a step of the level is at the wrong s, this distance is the step's shift along the crack, because s and level
    have equal weight. The area between the curves would also depend on the height of the step.
    """
    import similaritymeasures

    points = min(MAX_FRECHET, max(2, round((to_mm - from_mm) / FRECHET_MM) + 1))
    s_mm = np.linspace(from_mm, to_mm, points)
    first, second = (np.column_stack([s_mm, profile.level_at_mm(s_mm)]) for profile in (simulated, measured))
    return float(similaritymeasures.frechet_dist(first, second))


def _clipped(profile: Profile, low: float, high: float) -> tuple[Floats, Floats]:
    """Return the stations and levels of a part of a profile, (n,) each, with interpolated ends."""
    inner = profile.s_mm[(profile.s_mm > low) & (profile.s_mm < high)]
    s_mm = np.concatenate([[low], inner, [high]])
    return s_mm, profile.level_at_mm(s_mm)


CHOICE = "both curves measure s from the crack's first end; neither is shifted to fit the other"
SHIFTS_MM = (-2.0, -1.0, 0.0, 1.0, 2.0)  # Possible errors in the position of a station, or of the end of a crack


def alignment(simulated: Profile, measured: Profile) -> Alignment:
    """Return the mean error and bias for each shift of the readings along the crack."""
    errors = [level_difference(simulated, replace(measured, s_mm=measured.s_mm + shift_mm)) for shift_mm in SHIFTS_MM]
    shifts = [
        ShiftedError(shift_mm, error.mean_error, error.mean())
        for shift_mm, error in zip(SHIFTS_MM, errors, strict=True)
    ]
    return Alignment(choice=CHOICE, shifts=tuple(shifts))
