"""Free settings of a calibration: the prior of each, and what the readings determine."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sealtwin.core.records import Floats
from validate.units import setting_name, words

WIDE = 5.0  # Ratio of the ends of a range from which on it is sampled on a log scale
INTERVAL = 0.9  # Probability of the stated interval of a free setting


@dataclass(frozen=True)
class Free:
    """A free setting. Its prior is uniform over the range, or centred on a measured value."""

    name: str  # Dotted name, as "fluid.yield_stress_pa"
    low: float
    high: float
    measured: tuple[float, float] | None = None  # Value and standard uncertainty if it was measured

    @property
    def label(self) -> str:
        """Name with its unit, for example "yield stress (Pa)"."""
        return words(self.name.rpartition(".")[2])

    @property
    def logarithmic(self) -> bool:
        return self.low > 0 and self.high >= WIDE * self.low

    def values(self, shares: Floats) -> Floats:
        """Return the values of the setting at fractions of its range, from 0 to 1."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** shares
        return self.low + (self.high - self.low) * shares

    def log_prior(self, shares: Floats) -> Floats:
        """Return the logarithm of the prior density at fractions of the range, up to a constant."""
        if self.measured is None:
            return np.zeros_like(shares)
        values, (middle, standard) = self.values(shares), self.measured
        # On a log scale, equal steps of the share are steps in proportion to the value.
        return -(((values - middle) / standard) ** 2) / 2 + (np.log(values) if self.logarithmic else 0.0)

    @cached_property
    def prior(self) -> tuple[float, float]:
        """Width of the prior's central 90 % interval and its standard deviation, both as shares of the range."""
        shares = (np.arange(4000) + 0.5) / 4000
        log_density = self.log_prior(shares)
        weight = np.exp(log_density - log_density.max())
        weight /= weight.sum()
        low, high = np.interp([(1 - INTERVAL) / 2, (1 + INTERVAL) / 2], np.cumsum(weight), shares)
        middle = weight @ shares
        return float(high - low), float(np.sqrt(weight @ (shares - middle) ** 2))


LIMIT = 0.5  # Width of an interval over that of the prior, above which a setting is not identified
CONFOUNDED = 0.8  # Correlation from which on two settings are confounded
NAMED = 0.2  # Smallest listed share of a setting in a combination


@dataclass(frozen=True)
class Marginal:
    """Posterior of one free setting."""

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
    """A direction in the space of the settings, in units of their prior standard deviations."""

    parts: tuple[float, ...]  # Unit vector
    deviation: float  # Standard deviation along it; 1 if the readings contain no information

    def said(self, frees: Sequence[Free]) -> str:
        """Return the direction as text, for example "0.8 ln viscosity - 0.6 yield stress"."""
        terms = ""
        for part, free in sorted(zip(self.parts, frees, strict=True), key=lambda each: -abs(each[0])):
            if abs(part) >= NAMED:
                sign = "-" if part < 0 else "+" if terms else ""
                terms += f" {sign} {abs(part):.1f} {'ln ' if free.logarithmic else ''}{setting_name(free.name)}"
        return " ".join(terms.split())


def marginals_of(frees: Sequence[Free], draws: Floats, best: Floats) -> list[Marginal]:
    """Return the posterior of each setting, from draws in the unit cube, (count, d)."""
    ends = np.quantile(draws, [(1 - INTERVAL) / 2, (1 + INTERVAL) / 2], axis=0)
    marginals = []
    for number, free in enumerate(frees):
        low, high = free.values(ends[:, number])
        width = float(np.diff(ends[:, number])[0]) / free.prior[0]
        marginals.append(Marginal(free, float(free.values(best[number])), float(low), float(high), width))
    return marginals


def combinations_of(frees: Sequence[Free], draws: Floats) -> list[Combination]:
    """Return the eigenvectors of the draws' covariance, beginning with the best determined one."""
    scaled = draws / np.array([free.prior[1] for free in frees])
    variance, vectors = np.linalg.eigh(np.atleast_2d(np.cov(scaled.T)))
    combinations = []
    for size, vector in zip(variance, vectors.T, strict=True):
        turned = vector * np.sign(vector[np.abs(vector).argmax()])
        combinations.append(Combination(tuple(turned.tolist()), float(np.sqrt(max(size, 0.0)))))
    return combinations


def confounded_pairs(frees: Sequence[Free], draws: Floats) -> list[tuple[Free, Free, float]]:
    """Return pairs of settings that the readings cannot separate, with their correlation."""
    together = np.atleast_2d(np.corrcoef(draws.T))
    pairs = zip(*np.nonzero(np.triu(np.abs(together) > CONFOUNDED, 1)), strict=True)
    return [(frees[int(a)], frees[int(b)], float(together[a, b])) for a, b in pairs]
