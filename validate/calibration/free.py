"""Settings that a calibration leaves free, each with its range and what was known of it before."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sealtwin.core.records import Floats
from validate.units import words

WIDE = 5.0  # Ratio of the ends of a range from which equal steps are equal ratios
INTERVAL = 0.9  # Share of a distribution between the ends that are stated of a free setting


@dataclass(frozen=True)
class Free:
    """A free setting: all values of its range are equally likely beforehand, or those near a measured one."""

    name: str  # Dotted name, as "fluid.yield_stress_pa"
    low: float
    high: float
    measured: tuple[float, float] | None = None  # Value and standard uncertainty where it was measured

    @property
    def label(self) -> str:
        """Name with its unit: "yield stress (Pa)"."""
        return words(self.name.rpartition(".")[2])

    @property
    def logarithmic(self) -> bool:
        return self.low > 0 and self.high >= WIDE * self.low

    def values(self, shares: Floats) -> Floats:
        """Return the values at shares of the range."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** shares
        return self.low + (self.high - self.low) * shares

    def log_prior(self, shares: Floats) -> Floats:
        """Return the logarithm of the density over the share, up to a constant."""
        if self.measured is None:
            return np.zeros_like(shares)
        values, (middle, standard) = self.values(shares), self.measured
        # Equal steps of the share are steps of the value in proportion to it where the range is logarithmic.
        return -(((values - middle) / standard) ** 2) / 2 + (np.log(values) if self.logarithmic else 0.0)

    @cached_property
    def prior(self) -> tuple[float, float]:
        """Width of the central 90 % interval beforehand and standard deviation, both as shares of the range."""
        shares = (np.arange(4000) + 0.5) / 4000
        log_density = self.log_prior(shares)
        weight = np.exp(log_density - log_density.max())
        weight /= weight.sum()
        low, high = np.interp([(1 - INTERVAL) / 2, (1 + INTERVAL) / 2], np.cumsum(weight), shares)
        middle = weight @ shares
        return float(high - low), float(np.sqrt(weight @ (shares - middle) ** 2))
