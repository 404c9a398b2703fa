"""Intervals of 95 % from a budget of the readings: of any weighted sum of levels, and of the mean error."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from sealtwin.records import Floats
from validate.uncertainty.readings import Budget

SHARE = 0.95
DRAWS = 20_000
"""For a half-width: known to 0.7 % by them, which is less than the second digit that anybody reads."""
CURVES = 1_000
"""Sets of readings drawn for the mean error: its bias by noise is known to a twentieth of the interval."""


@dataclass(frozen=True)
class Interval:
    low: float
    high: float

    def holds(self, value: float) -> bool:
        return self.low <= value <= self.high


@dataclass(frozen=True)
class Doubt:
    """Of one number that is a weighted sum of the stations' levels."""

    scatter_mm: float
    """Standard uncertainty by what each station errs for itself, repeats and last digit."""
    freedom: float
    normal_mm: float
    """By shared errors of normal distribution."""
    rectangular_mm: tuple[float, ...]
    """By each shared error of rectangular distribution."""

    @property
    def standard_mm(self) -> float:
        return float(np.sqrt(self.scatter_mm**2 + self.systematic_mm**2))

    @property
    def systematic_mm(self) -> float:
        """What more stations would not make smaller."""
        return float(np.sqrt(self.normal_mm**2 + np.square(self.rectangular_mm).sum()))

    @property
    def half_width_mm(self) -> float:
        """Half of the interval that holds the truth in 95 of 100 cases.

        By propagating distributions (GUM supplement 1) from a fixed seed: a scatter of few repeats is Student's t, a
        limit is rectangular, and neither is a normal distribution.
        """
        own, _ = _normal_draws()
        random = np.random.default_rng(1)
        spread = np.sqrt(random.chisquare(self.freedom, DRAWS) / self.freedom) if np.isfinite(self.freedom) else 1.0
        return self.half_width_with(self.scatter_mm * own / spread, random)

    def half_width_with(self, own_mm: Floats, random: np.random.Generator) -> float:
        """The same with other draws, (DRAWS,), of what each station errs for itself."""
        _, shared = _normal_draws()
        total = own_mm + self.normal_mm * shared
        for standard_mm in self.rectangular_mm:
            total += standard_mm * np.sqrt(3) * random.uniform(-1, 1, DRAWS)
        return float(np.quantile(np.abs(total), SHARE))


@cache
def _normal_draws() -> Floats:
    return np.random.default_rng(0).standard_normal((2, DRAWS))


def doubt_of(budget: Budget, weight: Floats) -> Doubt:
    """Of the sum of ``weight``, (n,), times the stations' levels."""
    own = 0.0 if budget.scatter_mm is None else budget.scatter_mm
    own_variance = (weight * own) ** 2
    variance = float(own_variance.sum())
    freedom = np.inf
    if variance > 0:
        # One estimate behind all stations keeps its own freedom; of many, Welch and Satterthwaite's.
        behind = own_variance > 0
        sum_of_squares = (own_variance[behind] ** 2 / budget.freedom[behind]).sum()
        freedom = float(budget.freedom[behind][0] if budget.pooled else variance**2 / sum_of_squares)
    normal, rectangular = 0.0, []
    for part in budget.parts:
        if not part.shared:
            digits = float(((weight * part.standard_mm) ** 2).sum())
            # Known exactly, it makes the sum better known than the scatter alone.
            freedom *= ((variance + digits) / variance) ** 2 if variance > 0 else 1.0
            variance += digits
        elif part.shape == "normal":
            normal += float(weight @ part.standard_mm) ** 2
        else:
            rectangular.append(abs(float(weight @ part.standard_mm)))
    return Doubt(float(np.sqrt(variance)), freedom, float(np.sqrt(normal)), tuple(rectangular))


def bands_mm(budget: Budget) -> Floats:
    """Half of the 95 % interval of each station's level, (n,), by the scatters that its own repeats leave possible."""
    doubts = [doubt_of(replace(budget, scatter_mm=None), row) for row in np.eye(len(budget.freedom))]
    possible_mm = np.zeros((1, len(doubts))) if budget.own_mm is None else budget.own_mm
    normal, _ = _normal_draws()
    known: dict[tuple[Doubt, bytes], float] = {}
    for doubt, own_mm in zip(doubts, possible_mm.T, strict=True):
        # Stations with a declared scatter are often all alike.
        if (doubt, own_mm.tobytes()) not in known:
            scatter_mm = np.resize(np.sqrt(own_mm**2 + doubt.scatter_mm**2), DRAWS)
            known[doubt, own_mm.tobytes()] = doubt.half_width_with(scatter_mm * normal, np.random.default_rng(1))
    return np.array([known[doubt, own_mm.tobytes()] for doubt, own_mm in zip(doubts, possible_mm.T, strict=True)])


def hats(x: Floats, s_mm: Floats) -> Floats:
    """What each station's level counts at each x of a curve that is straight between stations, (len(x), n)."""
    return np.column_stack([np.interp(x, s_mm, row) for row in np.eye(len(s_mm))])


def mean_weights(x: Floats, hat: Floats, sign: Floats | None = None) -> Floats:
    """What each station's level counts in the mean over x, (n,); ``sign`` is that of each piece, (len(x) - 1,)."""
    piece = (np.diff(x) if sign is None else np.diff(x) * sign)[:, None]
    return (piece * (hat[:-1] + hat[1:]) / 2).sum(axis=0) / (x[-1] - x[0])


def mean_error_interval(x: Floats, error_mm: Floats, hat: Floats, budget: Budget) -> Interval:
    """95 % interval of the mean of |error| against the true levels.

    ``error_mm`` is the simulated less the measured level at ``x``, every crossing among them; straight between.

    Where the error keeps its sign the mean is a weighted sum of the levels. Scatter also adds to a mean of absolute
    values, however small the true ones are: how much is seen by scattering the readings once more. Scattered already,
    they show less of it than there is, down to half where the true error is small: the upper end gives way by it, the
    lower one by twice as much, and to 0 where scatter alone would make as much.
    """
    middle = np.sign(error_mm[:-1] + error_mm[1:])
    weight = mean_weights(x, hat, middle)
    # Each error drawn with its opposite: what is linear in them then adds nothing, not even by chance.
    half_of_them = draw(budget, CURVES // 2)
    errors_mm = np.concatenate([half_of_them, -half_of_them])
    noise_mm = errors_mm @ hat.T
    found_mm = float(mean_absolute(x, error_mm))
    again_mm = mean_absolute(x, error_mm + noise_mm)
    added_mm = max(0.0, float(again_mm.mean()) - found_mm)
    # Shared by all stations, an error may turn signs along whole stretches: no weighted sum any more.
    summed_mm, spread_mm = (np.quantile(np.abs(one), SHARE) for one in (errors_mm @ weight, again_mm - again_mm.mean()))
    half_mm = doubt_of(budget, weight).half_width_mm * (max(1.0, spread_mm / summed_mm) if summed_mm > 0 else 1.0)
    alone_mm = float(np.quantile(mean_absolute(x, noise_mm), (1 + SHARE) / 2))
    low_mm = 0.0 if found_mm <= alone_mm else max(0.0, found_mm - 2 * added_mm - half_mm)
    return Interval(low_mm, max(found_mm, found_mm - added_mm + half_mm))


def draw(budget: Budget, count: int) -> Floats:
    """Errors of the stations' means that the budget holds for possible, (count, n), from a fixed seed."""
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
    """Mean over x of |value|, straight between x, exact with any crossings; of curves (..., len(x))."""
    first, last = value[..., :-1], value[..., 1:]
    together = np.abs(first) + np.abs(last)
    crossing = (first**2 + last**2) / (2 * np.where(together > 0, together, 1.0))
    area = np.where(first * last >= 0, together / 2, crossing)
    return area @ np.diff(x) / (x[-1] - x[0])
