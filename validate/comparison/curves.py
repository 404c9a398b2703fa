"""Curves that are straight between their points, and what can be integrated of them without error."""

import numpy as np
from numpy.typing import ArrayLike

from sealtwin.errors import InputError
from sealtwin.records import Floats

ROUNDING = 1e-14
"""Of the largest value."""


class Pieces:
    """A continuous, piecewise linear function: values at increasing x, straight between."""

    def __init__(self, x: Floats, value: Floats) -> None:
        self.x, self.value = x, value
        self.length_mm = float(x[-1] - x[0])

    def mean(self) -> float:
        return float(np.trapezoid(self.value, self.x) / self.length_mm)

    def rms(self) -> float:
        first, last = self.value[:-1], self.value[1:]
        return float(np.sqrt(np.sum(np.diff(self.x) * (first**2 + first * last + last**2) / 3) / self.length_mm))

    def share_below(self, limit: float) -> float:
        """Share of the length on which the value is below a limit."""
        low, high = np.sort([self.value[:-1], self.value[1:]], axis=0)
        rise = high - low
        part = np.where(rise > 0, (limit - low) / np.where(rise > 0, rise, 1.0), limit > low)
        return float(np.sum(np.diff(self.x) * np.clip(part, 0.0, 1.0)) / self.length_mm)

    def quantile(self, share: float) -> float:
        """The limit below which the value lies on this share of the length."""
        low, high = float(self.value.min()), float(self.value.max())
        for _ in range(100):
            middle = (low + high) / 2
            if not low < middle < high:
                break
            low, high = (low, middle) if self.share_below(middle) >= share else (middle, high)
        return high


class Difference(Pieces):
    """a - b on the union of both curves' stations and every crossing, over their common support."""

    def __init__(self, x_a: ArrayLike, y_a: ArrayLike, x_b: ArrayLike, y_b: ArrayLike) -> None:
        x_a, y_a = polyline(x_a, y_a)
        x_b, y_b = polyline(x_b, y_b)
        low, high = max(x_a[0], x_b[0]), min(x_a[-1], x_b[-1])
        if not low < high:
            raise InputError(
                f"The curves do not overlap: {x_a[0]:g} to {x_a[-1]:g} and {x_b[0]:g} to {x_b[-1]:g}. "
                "Check that both count s from the same end, in mm."
            )
        x = np.unique(np.concatenate([x_a, x_b]))
        x = x[(x >= low) & (x <= high)]
        value = np.interp(x, x_a, y_a) - np.interp(x, x_b, y_b)
        # What rounding leaves of a crossing at a station is a crossing there, not one beside it.
        value[np.abs(value) < ROUNDING * np.abs(value).max()] = 0.0
        crosses = np.sign(value[:-1]) * np.sign(value[1:]) < 0
        first, last = value[:-1][crosses], value[1:][crosses]
        crossing = x[:-1][crosses] + np.diff(x)[crosses] * (first / (first - last))
        super().__init__(*_merged(x, value, crossing))

    def quantile(self, share: float) -> float:
        """Of |a - b|, which is as straight between the points, crossings being among them."""
        return Pieces(self.x, np.abs(self.value)).quantile(share)

    def share_within(self, limit: float) -> float:
        return Pieces(self.x, np.abs(self.value)).share_below(limit)


def _merged(x: Floats, value: Floats, crossing: Floats) -> tuple[Floats, Floats]:
    """Points with the crossings, where the value is 0, put among them."""
    # A crossing that rounds onto a station would double it; between stations so close it is worth no area.
    crossing = np.setdiff1d(crossing, x)
    order = np.argsort(np.concatenate([x, crossing]), kind="stable")
    return np.concatenate([x, crossing])[order], np.concatenate([value, np.zeros(len(crossing))])[order]


def polyline(x: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
    """Points in the order of x; refused where they make no function of x."""
    x, y = np.array(x, dtype=float), np.array(y, dtype=float)
    if x.ndim != 1 or x.shape != y.shape or len(x) < 2:
        raise InputError(f"A curve needs two or more points, as many x as y; found {x.shape} and {y.shape}.")
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise InputError("A curve holds NaN or infinity. Leave missing stations out.")
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    if (np.diff(x) == 0).any():
        repeated = x[1:][np.diff(x) == 0][0]
        raise InputError(f"A curve has two values at {repeated:g}. Give one value for each station.")
    return x, y
