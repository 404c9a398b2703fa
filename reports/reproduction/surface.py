"""A study's mean errors over U and D, for one set of readings: what the paper's claims are about."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sealtwin.core.records import Floats, Profile
from validate.figures.chart import Chart
from validate.metrics.curve_distances import CLOSE_MM, Difference, error_bins

CHOSEN = (30.0, 0.3)
"""U, and D in cm, that the paper chose."""
START_MM = 10.0
AROUND = 0.12
"""Width of the neighbourhood of a pair, of the map's: about one and a half steps of 12 values."""


@dataclass(frozen=True)
class Along:
    """The error along the crack of one run."""

    mean_mm: float
    share_under_1_mm: float
    """Of the length."""
    worst_mm: float
    worst_at_mm: float
    bins_mm: tuple[float, ...]
    """Mean error of each of its pieces of 10 mm, as the paper's Fig. 9b has it; infinite where nothing was read."""

    @property
    def bins_under_1_mm(self) -> float:
        """The share of the pieces whose mean error is less than that."""
        return float(np.mean(np.array(self.bins_mm) < CLOSE_MM))


@dataclass(frozen=True)
class Surface:
    """Of all runs of a study, (r,) each."""

    u: Floats
    d_cm: Floats
    seen_mm: Floats
    """Mean errors of the runs as they were computed."""
    error_mm: Floats
    """The same with one more scatter of the runs, where that is asked about; else the same."""
    chosen: Along
    """Of the pair that the paper chose."""
    smooth_mm: Floats
    """Mean errors by planes through neighbouring pairs, in which little scatter is left."""

    @property
    def best(self) -> int:
        return int(np.argmin(self.error_mm))

    @property
    def worst(self) -> int:
        return int(np.argmax(self.error_mm))

    @property
    def least_mm(self) -> float:
        """The least mean error, less the bias of a least.

        The least of many noisy numbers is too low: by as much as scatter lowers the least of a smooth surface like this
        one. Where no scatter is asked about it is the least as it was seen.
        """
        return self._less_bias(lambda error_mm: float(error_mm.min()))

    @property
    def most_mm(self) -> float:
        """The largest mean error, likewise less its bias."""
        return self._less_bias(lambda error_mm: float(error_mm.max()))

    @property
    def given_away_mm(self) -> float:
        """The chosen pair's mean error over the least of all others, likewise less the bias of that least."""
        chosen = self.index(CHOSEN)
        return self._less_bias(lambda error_mm: float(error_mm[chosen] - np.delete(error_mm, chosen).min()))

    def _less_bias(self, of: Callable[[Floats], float]) -> float:
        scattered_mm = self.smooth_mm + (self.error_mm - self.seen_mm)
        return of(self.seen_mm) - (of(scattered_mm) - of(self.smooth_mm))

    def index(self, pair: tuple[float, float]) -> int:
        return int(np.flatnonzero((self.u == pair[0]) & (self.d_cm == pair[1]))[0])

    def pair(self, index: int) -> tuple[float, float]:
        return float(self.u[index]), float(self.d_cm[index])

    def by_d(self) -> tuple[Floats, Floats]:
        """Values of D in cm, increasing, and the mean error over U of each."""
        values = np.unique(self.d_cm)
        return values, np.array([self.error_mm[self.d_cm == value].mean() for value in values])

    def along_u(self, d_cm: float) -> tuple[Floats, Floats]:
        """Values of U, increasing, and the mean error at one D of each."""
        return _sorted(self.u, self.error_mm, self.d_cm == d_cm)

    def along_d(self, u: float) -> tuple[Floats, Floats]:
        """Values of D in cm, increasing, and the mean error at one U of each."""
        return _sorted(self.d_cm, self.error_mm, self.u == u)

    def mean_mm(self, u: tuple[float, float], d_cm: tuple[float, float]) -> float:
        """Over the pairs in a range of U and of D, ends included."""
        inside = (self.u >= u[0]) & (self.u <= u[1]) & (self.d_cm >= d_cm[0]) & (self.d_cm <= d_cm[1])
        return float(self.error_mm[inside].mean())

    def on_grid(self) -> Floats:
        """Mean errors by U and D, both increasing; NaN where the study has no such pair."""
        (u, row), (d_cm, column) = (np.unique(each, return_inverse=True) for each in (self.u, self.d_cm))
        grid_mm = np.full((len(u), len(d_cm)), np.nan)
        grid_mm[row, column] = self.error_mm
        return grid_mm

    def scattered(self, by_mm: Floats, chosen: Along) -> "Surface":
        """Return the same runs with one more scatter, (r,), and another run of the chosen pair."""
        return replace(self, error_mm=self.seen_mm + by_mm, chosen=chosen)


def planes(u: Floats, d_cm: Floats) -> Floats:
    """Weights, (r, r), that replace the value of each pair by that of a plane through the pairs around it."""
    places = np.column_stack([np.log10(each) for each in (u, d_cm)])
    places = (places - places.min(axis=0)) / np.ptp(places, axis=0)
    weights = np.empty((len(u), len(u)))
    for row, place in enumerate(places):
        offset = places - place
        near = np.exp(-(offset**2).sum(axis=1) / (2 * AROUND**2))
        plane = np.column_stack([np.ones(len(u)), offset])
        # The plane's height at the pair is a weighted sum of all values.
        weights[row] = (np.linalg.pinv(np.sqrt(near)[:, None] * plane) * np.sqrt(near))[0]
    return weights


def surface_of(chart: Chart) -> Surface:
    """Against the readings as they are. Raises StopIteration where the study lacks the pair that the paper chose."""
    (surface,) = surfaces_of(chart, chart.errors_mm[None], [chart.readings])
    return surface


def surfaces_of(chart: Chart, errors_mm: Floats, redrawn: Sequence[Profile]) -> list[Surface]:
    """Against each of some sets of readings; ``errors_mm`` (sets, r) are the runs' mean errors."""
    u, d_cm = np.array([run.at for run in chart.runs]).T
    chosen = next(run for run in chart.runs if run.at == CHOSEN).profile
    smooth_mm = errors_mm @ planes(u, d_cm).T
    return [
        Surface(u, d_cm, row, row, along(chosen, readings), smooth)
        for row, smooth, readings in zip(errors_mm, smooth_mm, redrawn, strict=True)
    ]


def along(profile: Profile, readings: Profile) -> Along:
    error = Difference(profile.s_mm, profile.level_mm, readings.s_mm, readings.level_mm)
    size = np.abs(error.value)
    worst = int(np.argmax(size))
    pieces = error_bins(profile, readings, float(profile.s_mm[-1]))
    return Along(
        float(np.trapezoid(size, error.x) / error.length_mm),
        error.size.share_below(CLOSE_MM),
        float(size[worst]),
        float(error.x[worst]),
        tuple(np.inf if piece.mean_error_mm is None else piece.mean_error_mm for piece in pieces),
    )


def _sorted(settings: Floats, error_mm: Floats, where: np.ndarray) -> tuple[Floats, Floats]:
    order = np.argsort(settings[where])
    return settings[where][order], error_mm[where][order]
