"""Intervals of 95 % by the budget of the readings, for a weighted sum of levels and for the mean error.

The draws and their order are fixed, so that every run gives the same figures; a bootstrap of scipy.stats would move
them.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from sealtwin.core.records import Floats
from validate.uncertainty.readings_budget import Budget

SHARE = 0.95
DRAWS = 20_000  # Number of draws for a half-width, which they give to 0.7 %, less than its second digit
CURVES = 1_000
"""Number of sets of readings drawn for the mean error: they give its bias by noise to a twentieth of the interval."""


@dataclass(frozen=True)
class Doubt:
    """Uncertainty of one number that is a weighted sum of the stations' levels."""

    scatter_mm: float  # Standard uncertainty by the stations' independent errors, repeats and last digit
    freedom: float  # Degrees of freedom of the scatter; infinite where it is declared
    normal_mm: float  # Standard uncertainty by shared errors of normal distribution
    rectangular_mm: tuple[float, ...]  # Standard uncertainty by each shared error of rectangular distribution

    @property
    def standard_mm(self) -> float:
        return float(np.sqrt(self.scatter_mm**2 + self.systematic_mm**2))

    @property
    def systematic_mm(self) -> float:
        """Standard uncertainty that more stations would not reduce."""
        return float(np.sqrt(self.normal_mm**2 + np.square(self.rectangular_mm).sum()))

    @property
    def half_width_mm(self) -> float:
        """Half the 95 % interval, by propagating distributions (GUM supplement 1) from a fixed seed.

        A scatter of few repeats is Student's t and a limit is rectangular; neither is a normal distribution.
        """
        own, _ = _normal_draws()
        random = np.random.default_rng(1)
        spread = np.sqrt(random.chisquare(self.freedom, DRAWS) / self.freedom) if np.isfinite(self.freedom) else 1.0
        return self.half_width_with(self.scatter_mm * own / spread, random)

    def half_width_with(self, own_mm: Floats, random: np.random.Generator) -> float:
        """Return half the 95 % interval with other draws, (DRAWS,), of the stations' independent errors."""
        _, shared = _normal_draws()
        total = own_mm + self.normal_mm * shared
        for standard_mm in self.rectangular_mm:
            total += standard_mm * np.sqrt(3) * random.uniform(-1, 1, DRAWS)
        return float(np.quantile(np.abs(total), SHARE))


@cache
def _normal_draws() -> Floats:
    return np.random.default_rng(0).standard_normal((2, DRAWS))


def doubt_of(budget: Budget, weight: Floats) -> Doubt:
    """Return the uncertainty of the sum of ``weight``, (n,), times the stations' levels."""
    own = 0.0 if budget.scatter_mm is None else budget.scatter_mm
    own_variance = (weight * own) ** 2
    variance = float(own_variance.sum())
    freedom = np.inf
    if variance > 0:
        # A pooled estimate keeps its degrees of freedom; several have those of Welch and Satterthwaite.
        behind = own_variance > 0
        sum_of_squares = (own_variance[behind] ** 2 / budget.freedom[behind]).sum()
        freedom = float(budget.freedom[behind][0] if budget.pooled else variance**2 / sum_of_squares)
    normal, rectangular = 0.0, []
    for part in budget.parts:
        if not part.shared:
            digits = float(((weight * part.standard_mm) ** 2).sum())
            # The last digit is known exactly, so that the sum is better known than the scatter alone.
            freedom *= ((variance + digits) / variance) ** 2 if variance > 0 else 1.0
            variance += digits
        elif part.shape == "normal":
            normal += float(weight @ part.standard_mm) ** 2
        else:
            rectangular.append(abs(float(weight @ part.standard_mm)))
    return Doubt(float(np.sqrt(variance)), freedom, float(np.sqrt(normal)), tuple(rectangular))


def bands_mm(budget: Budget) -> Floats:
    """Return half the 95 % interval of each station's level, (n,), by the scatters that its repeats allow."""
    doubts = [doubt_of(replace(budget, scatter_mm=None), row) for row in np.eye(len(budget.freedom))]
    possible_mm = np.zeros((1, len(doubts))) if budget.own_mm is None else budget.own_mm
    normal, _ = _normal_draws()
    bands = []
    for doubt, own_mm in zip(doubts, possible_mm.T, strict=True):
        # Again and again in their order, as np.resize gives them, which joins 20,000 arrays of one number.
        scatter_mm = np.sqrt(own_mm**2 + doubt.scatter_mm**2)[np.arange(DRAWS) % len(own_mm)]
        bands.append(doubt.half_width_with(scatter_mm * normal, np.random.default_rng(1)))
    return np.array(bands)


def hats(x: Floats, s_mm: Floats) -> Floats:
    """Return the weight of each station's level at each x of a curve that is straight between stations, (len(x), n)."""
    return np.column_stack([np.interp(x, s_mm, row) for row in np.eye(len(s_mm))])


def mean_weights(x: Floats, hat: Floats, sign: Floats | None = None) -> Floats:
    """Return the weight of each station's level in the mean over x, (n,); ``sign`` is that of each piece."""
    piece = (np.diff(x) if sign is None else np.diff(x) * sign)[:, None]
    return (piece * (hat[:-1] + hat[1:]) / 2).sum(axis=0) / (x[-1] - x[0])


def mean_error_interval(x: Floats, error_mm: Floats, hat: Floats, budget: Budget) -> tuple[float, float]:
    """Return the ends of the 95 % interval of the mean of |error| against the true levels.

    ``error_mm`` is the simulated less the measured level at ``x``, every crossing among them, and straight between.

    Where the error keeps its sign the mean is a weighted sum of the levels. Scatter also adds to a mean of absolute
    values; how much is estimated by scattering the readings once more. Since they are scattered already, this finds
    less than there is, down to half where the true error is small: the upper end is lowered by the estimate and the
    lower one by twice as much, to 0 where scatter alone would give the mean.
    """
    middle = np.sign(error_mm[:-1] + error_mm[1:])
    weight = mean_weights(x, hat, middle)
    # Each error is drawn with its opposite, so that terms linear in them cancel.
    half_of_them = draw(budget, CURVES // 2)
    errors_mm = np.concatenate([half_of_them, -half_of_them])
    noise_mm = errors_mm @ hat.T
    found_mm = float(mean_absolute(x, error_mm))
    again_mm = mean_absolute(x, error_mm + noise_mm)
    added_mm = max(0.0, float(again_mm.mean()) - found_mm)
    # An error shared by all stations may turn signs along whole stretches: the mean is no weighted sum then.
    summed_mm, spread_mm = (np.quantile(np.abs(one), SHARE) for one in (errors_mm @ weight, again_mm - again_mm.mean()))
    half_mm = doubt_of(budget, weight).half_width_mm * (max(1.0, spread_mm / summed_mm) if summed_mm > 0 else 1.0)
    alone_mm = float(np.quantile(mean_absolute(x, noise_mm), (1 + SHARE) / 2))
    low_mm = 0.0 if found_mm <= alone_mm else max(0.0, found_mm - 2 * added_mm - half_mm)
    return low_mm, max(found_mm, found_mm - added_mm + half_mm)


def draw(budget: Budget, count: int) -> Floats:
    """Draw errors of the stations' means from the budget, (count, n), with a fixed seed."""
    random = np.random.default_rng(0)
    stations = len(budget.freedom)
    total = np.zeros((count, stations))
    if budget.scatter_mm is not None:
        spread = np.ones((count, stations))
        for freedom in set(budget.freedom[np.isfinite(budget.freedom)].tolist()):
            behind = budget.freedom == freedom
            shape = (count, 1 if budget.pooled else int(behind.sum()))
            spread[:, behind] = np.sqrt(random.chisquare(freedom, shape) / freedom)
        total += budget.scatter_mm * random.standard_normal((count, stations)) / spread
    for part in budget.parts:
        shape = (count, 1 if part.shared else stations)
        unit = random.standard_normal(shape) if part.shape == "normal" else np.sqrt(3) * random.uniform(-1, 1, shape)
        total += part.standard_mm * unit
    return total


def mean_absolute(x: Floats, value: Floats) -> Floats:
    """Return the exact mean of |value| over x, for curves (..., len(x)) that are straight between the x."""
    first, last = value[..., :-1], value[..., 1:]
    together = np.abs(first) + np.abs(last)
    crossing = (first**2 + last**2) / (2 * np.where(together > 0, together, 1.0))
    area = np.where(first * last >= 0, together / 2, crossing)
    return area @ np.diff(x) / (x[-1] - x[0])
