"""Settings, and combinations of them, that the readings determine."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats
from validate.calibration.free import INTERVAL, Free
from validate.units import setting_name

LIMIT = 0.5  # Width of an interval over that beforehand, above which a setting counts as not identified
CONFOUNDED = 0.8  # Correlation from which two settings stand for each other
NAMED = 0.2  # Least share of a setting in a combination that is named


@dataclass(frozen=True)
class Marginal:
    """A free setting after the readings."""

    free: Free
    best: float  # Value at the draw with the highest density
    low: float
    high: float  # Ends of the central 90 % interval
    width_over_prior: float

    @property
    def identified(self) -> bool:
        return self.width_over_prior <= LIMIT


@dataclass(frozen=True)
class Combination:
    """A direction in the space of the settings, in units of their standard deviations beforehand."""

    parts: tuple[float, ...]  # Unit vector
    deviation: float  # Standard deviation along it; 1 where the readings say nothing

    def said(self, frees: Sequence[Free]) -> str:
        """Return it as "0.8 ln viscosity - 0.6 yield stress"."""
        told = ""
        for part, free in sorted(zip(self.parts, frees, strict=True), key=lambda each: -abs(each[0])):
            if abs(part) >= NAMED:
                sign = "-" if part < 0 else "+" if told else ""
                told += f" {sign} {abs(part):.1f} {'ln ' if free.logarithmic else ''}{setting_name(free.name)}"
        return " ".join(told.split())


def marginals_of(frees: Sequence[Free], draws: Floats, best: Floats) -> list[Marginal]:
    """Summarise draws in the unit cube, (count, d)."""
    ends = np.quantile(draws, [(1 - INTERVAL) / 2, (1 + INTERVAL) / 2], axis=0)
    found = []
    for number, free in enumerate(frees):
        low, high = free.values(ends[:, number])
        width = float(np.diff(ends[:, number])[0]) / free.prior[0]
        found.append(Marginal(free, float(free.values(best[number])), float(low), float(high), width))
    return found


def combinations_of(frees: Sequence[Free], draws: Floats) -> list[Combination]:
    """Return the eigenvectors of the draws' covariance, the best determined one first."""
    scaled = draws / np.array([free.prior[1] for free in frees])
    variance, vectors = np.linalg.eigh(np.atleast_2d(np.cov(scaled.T)))
    found = []
    for size, vector in zip(variance, vectors.T, strict=True):
        turned = vector * np.sign(vector[np.abs(vector).argmax()])
        found.append(Combination(tuple(turned.tolist()), float(np.sqrt(max(size, 0.0)))))
    return found


def confounded_pairs(frees: Sequence[Free], draws: Floats) -> list[tuple[Free, Free, float]]:
    """Return pairs of settings that the readings do not tell apart, with their correlation."""
    together = np.atleast_2d(np.corrcoef(draws.T))
    pairs = zip(*np.nonzero(np.triu(np.abs(together) > CONFOUNDED, 1)), strict=True)
    return [(frees[int(a)], frees[int(b)], float(together[a, b])) for a, b in pairs]
