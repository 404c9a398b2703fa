"""Error budget of a comparison: random draws of each named error. All intervals, bands and verdicts follow from them.

The draws and their order are fixed, so every run gives the same figures. A standard uncertainty is defined as half the
half-width of a 95 % interval. With this definition, ± 2 u is the 95 % interval for any distribution.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, Literal

import numpy as np

from sealtwin.core.arrays import Booleans, Floats, Integers, rms
from sealtwin.core.facts import Fact, Facts
from validate.intervals import BudgetPart, BudgetSummary
from validate.sentences import assumed
from validate.settings import PASS_MM

DRAWS = 4_000
"""Number of draws of each error. Draws are stratified: the quantiles of a single error are exact, and the half-width of
a sum of several errors is known to 1 %."""
MOST = 1_000_000
"""Largest number of values in the draws of one error. A scan of more than 250 stations gets fewer draws."""
CURVES = 1_000  # Number of draws for the mean error, since its interval needs a search
FEW_STATIONS = 200
SHARE = 0.95
UNDECLARED_MM = 0.2  # Size in mm that the table of undeclared errors assumes
STEPS = "steps of the level between few stations"

Kind = Literal["readings", "numerics", "inputs", "model"]
Source = Literal["repeats", "detected", "declared", "allowed for", "assumed", "computed"]
"""Origin of an error's size. repeats: repeated readings. detected: the last digits of the readings. declared: the trial
file or a default. allowed for: the data cannot exclude it. assumed: no data. computed: extra runs."""


@dataclass(frozen=True)
class Component:
    """Draws of one error in mm, which is added to the measured level of each station."""

    name: str
    source: Source
    draws_mm: Floats  # (draws, n), or (draws, n - 1) for an error between stations
    shared: bool = False  # True for an error of many stations together, which does not average out
    between: bool = False  # True for the height of a straight line above the sealant, midway between stations
    kind: Kind = "readings"
    setting: str = ""  # Key of the trial file that declares the error


@dataclass(frozen=True)
class Curve:
    """An error along the crack: positions x, simulated minus measured level, and the weights of the stations."""

    x: Floats
    error_mm: Floats
    level_weights: Any  # (len(x), n): weight of each station's level
    height_weights: Any  # (len(x), n - 1): weight of each height between two stations

    @classmethod
    def of(cls, x: Floats, error_mm: Floats, s_mm: Floats) -> "Curve":
        """Return the curve of an error, interpolated linearly between the points ``x``.

        If there are few stations, points are added at the quarters of each gap between stations, to resolve the arch
        over the gap. The closely spaced stations of a scan do not need them.
        """
        parts = [0.0, 0.25, 0.5, 0.75] if len(s_mm) <= FEW_STATIONS else [0.0]
        quarters = (s_mm[:-1, None] + np.diff(s_mm)[:, None] * parts).ravel()
        fine = np.union1d(x, quarters[(quarters > x[0]) & (quarters < x[-1])])
        return cls(fine, np.interp(fine, x, error_mm), linear_weights(fine, s_mm), parabola_weights(fine, s_mm))

    def weights(self, sign: Floats | None = None) -> tuple[Floats, Floats]:
        """Return the weights in the mean over x: of the levels at stations, (n,), and of the heights between, (n - 1,).

        ``sign`` is the sign of each piece of the curve.
        """
        piece = (np.diff(self.x) if sign is None else np.diff(self.x) * sign) / (self.x[-1] - self.x[0])
        weight = (np.append(piece, 0.0) + np.append(0.0, piece)) / 2
        return self.level_weights.T @ weight, self.height_weights.T @ weight


@dataclass(frozen=True)
class Budget:
    """All errors of a comparison by name, and the undeclared errors that the data cannot show."""

    stations: int
    components: tuple[Component, ...]
    missing: tuple[Component, ...] = ()
    """Errors that are neither declared nor shown by the readings. Their size is ``UNDECLARED_MM`` or the usual size of
    such an error."""
    scatter_known: bool = True
    notes: Facts = ()  # Features of the readings
    steps_mm: float = 0.0
    """Change of the mean error, up or down, due to steps of the sealant's level between few stations. It is not an
    error of the level itself."""

    def where(self, keep: Callable[[Component], bool]) -> "Budget":
        return replace(self, components=tuple(component for component in self.components if keep(component)))

    def of_kind(self, *kinds: Kind) -> "Budget":
        return self.where(lambda component: component.kind in kinds)

    def at_stations(self, which: Booleans) -> "Budget":
        """Return the budget for a selection of stations, without the shape of the sealant between them."""
        components = [
            replace(component, draws_mm=component.draws_mm[:, which])
            for component in self.components
            if not component.between
        ]
        return replace(self, stations=int(which.sum()), components=tuple(components))

    @property
    def draws(self) -> int:
        """Number of draws of each error."""
        return len(self.components[0].draws_mm) if self.components else DRAWS

    @cached_property
    def at_stations_mm(self) -> Floats:
        """Draws of the error of the level at each station, (draws, n)."""
        return sum(
            (component.draws_mm for component in self.components if not component.between),
            start=np.zeros((self.draws, self.stations)),
        )

    @cached_property
    def between_mm(self) -> Floats:
        """Draws of the height of the straight line between two stations above the sealant, (draws, n - 1)."""
        start = np.zeros((self.draws, self.stations - 1))
        return sum((component.draws_mm for component in self.components if component.between), start=start)

    def along_mm(self, curve: Curve) -> Floats:
        """Return draws of the error at each x of a curve, (``CURVES``, len(x))."""
        along_mm = self.at_stations_mm[:CURVES] @ curve.level_weights.T
        return along_mm + self.between_mm[:CURVES] @ curve.height_weights.T if self.between_mm.any() else along_mm

    def mean_mm(self, weights: tuple[Floats, Floats]) -> float:
        """Return the half-width of the 95 % interval of a weighted sum of levels at stations and between them."""
        return float(half_width(self.at_stations_mm @ weights[0] + self.between_mm @ weights[1]))

    @cached_property
    def band_mm(self) -> Floats:
        """Half-width of the 95 % interval of the level at each single station, (n,)."""
        return half_width(self.at_stations_mm)

    @cached_property
    def profile_band_mm(self) -> Floats:
        """Half-width of the band that contains the levels at all stations in 95 % of cases, (n,).

        This is the band of single stations, multiplied by one factor: the 95 % quantile of the largest ratio (max-t,
        Montiel Olea & Plagborg-Møller 2019, J. Appl. Econom. 34:1).
        """
        positive = self.band_mm > 0
        if not positive.any():
            return self.band_mm
        worst = np.abs(self.at_stations_mm[:, positive] / self.band_mm[positive]).max(axis=1)
        return self.band_mm * max(1.0, float(np.quantile(worst, SHARE)))

    @property
    def by_chance(self) -> float:
        """Expected number of stations outside their own bands if the model's level were the true level."""
        return float((np.abs(self.at_stations_mm) > self.band_mm).sum(axis=1).mean())

    def mean_error_interval(self, curve: Curve) -> tuple[float, float]:
        """Return the ends of the 95 % interval of the mean of |error| relative to the true level."""
        low_mm, high_mm = self._between_straight_lines(curve)
        return max(0.0, low_mm - self.steps_mm), high_mm + self.steps_mm

    def _between_straight_lines(self, curve: Curve) -> tuple[float, float]:
        """Return the interval of the mean error for sealant without steps between stations.

        Scatter adds to a mean of absolute values, and it adds more if the true error is small. Some errors are
        one-sided: a probe reads too high, and so does a station with one outlier upward. The likely error is therefore
        the difference from the most likely true level.

        1. The true error is assumed to have the shape of the likely error, multiplied by a factor k.

        2. The lower end is the k at which readings with these errors give at least the likely error's mean in 2.5 % of
        all cases. The upper end is the k at which they give at most this mean in 2.5 %.

        3. A shared error may change the sign of the error along whole stretches. The upper end therefore also covers
        the error shifted by the shared errors.
        """
        from scipy.optimize import root_scalar

        x, mean_mm = curve.x, float(mean_absolute(curve.x, curve.error_mm))
        off_mm = self.along_mm(curve)
        # The measured level between stations is assumed straight, as in the mean error.
        middle_mm = curve.level_weights @ np.median(self.at_stations_mm, axis=0)
        off_mm, likely = off_mm - middle_mm, curve.error_mm + middle_mm
        likely_mm = float(mean_absolute(x, likely))
        most_mm = float(np.quantile(mean_absolute(x, off_mm), (1 + SHARE) / 2))
        if min(mean_mm, likely_mm, most_mm) == 0:
            return min(mean_mm, likely_mm), max(mean_mm, likely_mm) + most_mm

        def excess(times: float, share: float) -> float:
            drawn_mm = mean_absolute(x, times * likely - off_mm)
            return float(np.quantile(drawn_mm, share)) - likely_mm

        low, high = (1 - SHARE) / 2, (1 + SHARE) / 2
        reach = most_mm / likely_mm
        # If even an error of 0 would give a larger mean, there is nothing to search.
        bracket = max(0.0, 1 - reach), 1 + reach
        while min(excess(bracket[1], share) for share in (low, high)) <= 0:
            # The median of large errors that are not symmetric is far from their middle.
            bracket = bracket[0], 2 * bracket[1]
        least, most = (
            float(root_scalar(excess, args=(share,), bracket=bracket, xtol=4e-3 * reach).root)
            if excess(0.0, share) < 0
            else 0.0
            for share in (high, low)
        )
        moved_mm = mean_absolute(x, curve.error_mm + self.where(lambda component: component.shared).along_mm(curve))
        upper_mm = max(mean_mm, most * likely_mm, float(np.quantile(moved_mm, high)))
        return min(mean_mm, least * likely_mm), upper_mm

    def summary(self, curve: Curve) -> BudgetSummary:
        """Return the standard uncertainties of each component, as in report.json.

        They are given for the mean level, for the mean error and for the level at one station.
        """
        signs = np.sign(curve.error_mm[:-1] + curve.error_mm[1:])
        parts, missing = (
            tuple(self.part(component, curve, signs) for component in group)
            for group in (self.components, self.missing)
        )
        if self.steps_mm:
            parts += (BudgetPart(STEPS, "", "assumed", "readings", 0.0, self.steps_mm / 2, station_mm=0.0),)
        notes = self.notes + tuple(
            self._allowed(component, curve) for component in self.components if component.source == "allowed for"
        )
        return BudgetSummary(parts=parts, missing=missing, scatter_known=self.scatter_known, notes=notes)

    def _allowed(self, component: Component, curve: Curve) -> Fact:
        """Return the statement that the intervals allow for an undeclared error that the data cannot exclude."""
        with_it, without = (
            budget.mean_mm(curve.weights())
            for budget in (
                self.of_kind("readings"),
                self.of_kind("readings").where(lambda other: other is not component),
            )
        )
        times = with_it / max(without, 1e-9)
        return assumed("readings.allowed-for", times, pass_mm=PASS_MM, setting=component.setting)

    def part(self, component: Component, curve: Curve, signs: Floats | None = None) -> BudgetPart:
        """Return the standard uncertainties that one error causes by itself.

        For the uncertainty of the mean error, give ``signs`` of the error between its points.
        """
        alone = replace(self, components=(component,))
        level_mm = alone.mean_mm(curve.weights()) / 2
        error_mm = None if signs is None else alone.mean_mm(curve.weights(signs)) / 2
        station_mm = 0.0 if component.between else rms(half_width(component.draws_mm)) / 2
        return BudgetPart(
            component.name, component.setting, component.source, component.kind, level_mm, error_mm, station_mm
        )


def half_width(draws_mm: Floats) -> Floats:
    """Return the half-width of the 95 % interval about 0 of draws, which are along the first axis."""
    return np.quantile(np.abs(draws_mm), SHARE, axis=0)


def draws_for(stations: int) -> int:
    """Return the number of draws of each error for a number of stations."""
    return min(DRAWS, MOST // stations)


@cache
def uniforms(name: str, columns: int, draws: int = DRAWS) -> Floats:
    """Return stratified random numbers from 0 to 1 (a Latin hypercube), (draws, columns).

    The same name always gives the same numbers.
    """
    random = np.random.default_rng([columns, *name.encode()])
    places = np.tile((np.arange(draws) + 0.5) / draws, (columns, 1))
    return random.permuted(places, axis=1).T.copy()


def chi_squared(share: float | Floats, freedom: float) -> Any:
    """Return quantiles of a chi-squared distribution. ``scipy.stats`` also contains them, but takes 0.5 s to import."""
    from scipy.special import gammaincinv

    return 2 * gammaincinv(freedom / 2, share)


@cache
def normals(name: str, columns: int, draws: int = DRAWS) -> Floats:
    """Return stratified random numbers of the standard normal distribution, (draws, columns)."""
    from scipy.special import ndtri

    return ndtri(uniforms(name, columns, draws))


def linear_weights(x: Floats, s_mm: Floats) -> Any:
    """Return the weight of each station's level at each x, for a curve that is linear between stations, (len(x), n).

    The matrix is sparse, because only two stations influence an x.
    """
    gap, part = _gaps(x, s_mm)
    return _sparse(len(x), len(s_mm), (gap, 1 - part), (gap + 1, part))


def parabola_weights(x: Floats, s_mm: Floats) -> Any:
    """Return at each x the height of parabolas of height 1 over the gaps between stations, (len(x), n - 1), sparse."""
    gap, part = _gaps(x, s_mm)
    return _sparse(len(x), len(s_mm) - 1, (gap, 4 * part * (1 - part)))


def _gaps(x: Floats, s_mm: Floats) -> tuple[Integers, Floats]:
    """Return the gap between stations that contains each x, and the position of x in the gap from 0 to 1."""
    gap = np.clip(np.searchsorted(s_mm, x, side="right") - 1, 0, len(s_mm) - 2)
    return gap, np.clip((x - s_mm[gap]) / (s_mm[gap + 1] - s_mm[gap]), 0.0, 1.0)


def _sparse(rows: int, columns: int, *entries: tuple[Integers, Floats]) -> Any:
    """Return a sparse matrix. Each pair of columns and values gives one entry in each row."""
    from scipy.sparse import csr_array

    column, value = (np.concatenate(part) for part in zip(*entries, strict=True))
    return csr_array((value, (np.tile(np.arange(rows), len(entries)), column)), shape=(rows, columns))


def mean_absolute(x: Floats, value: Floats) -> Floats:
    """Return the exact mean of |value| over x, for curves (..., len(x)) that are linear between the points x."""
    size = np.abs(value)
    together = size[..., :-1] + size[..., 1:]
    # If the value changes its sign, the trapezium becomes two triangles.
    crosses = value[..., :-1] * value[..., 1:] < 0
    cut = np.where(crosses, size[..., :-1] * size[..., 1:] / np.where(crosses, together, 1.0), 0.0)
    return (together / 2 - cut) @ np.diff(x) / (x[-1] - x[0])
