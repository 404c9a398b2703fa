"""A study's mean errors over U and D, for one set of readings: what the paper's claims are about."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats, Profile
from validate.metrics.curve_distances import CLOSE_MM, Difference, error_bins
from validate.study_figures.chart import Chart

CHOSEN = (30.0, 0.3)
"""U, and D in cm, that the paper chose."""
START_MM = 10.0


@dataclass(frozen=True)
class Surface:
    """Of all runs of a study, (r,) each."""

    u: Floats
    d_cm: Floats
    error_mm: Floats
    chosen: "Along"
    """Of the pair that the paper chose."""

    @property
    def best(self) -> int:
        return int(np.argmin(self.error_mm))

    @property
    def worst(self) -> int:
        return int(np.argmax(self.error_mm))

    def pair(self, index: int) -> tuple[float, float]:
        return float(self.u[index]), float(self.d_cm[index])

    def by_u(self) -> tuple[Floats, Floats]:
        """Values of U, increasing, and the mean error over D of each."""
        values = np.unique(self.u)
        return values, np.array([self.error_mm[self.u == value].mean() for value in values])

    def mean_mm(self, u: tuple[float, float], d_cm: tuple[float, float]) -> float:
        """Over the pairs in a range of U and of D, ends included."""
        inside = (self.u >= u[0]) & (self.u <= u[1]) & (self.d_cm >= d_cm[0]) & (self.d_cm <= d_cm[1])
        return float(self.error_mm[inside].mean())


@dataclass(frozen=True)
class Along:
    """The error along the crack of one run."""

    mean_mm: float
    share_under_1_mm: float
    """Of the length."""
    bins_under_1_mm: float
    """Share of its pieces of 10 mm whose mean error is less than that."""
    worst_mm: float
    worst_at_mm: float


def surface_of(chart: Chart) -> Surface:
    """Against the readings as they are. Raises StopIteration where the study lacks the pair that the paper chose."""
    return _surface(chart, chart.errors_mm, chart.readings)


def surfaces_of(chart: Chart, errors_mm: Floats, redrawn: Sequence[Profile]) -> list[Surface]:
    """Against each of some sets of readings; ``errors_mm`` (sets, r) are the runs' mean errors."""
    return [_surface(chart, row, readings) for row, readings in zip(errors_mm, redrawn, strict=True)]


def _surface(chart: Chart, error_mm: Floats, readings: Profile) -> Surface:
    u, d_cm = np.array([run.at for run in chart.runs]).T
    chosen = next(run for run in chart.runs if run.at == CHOSEN)
    profile = chosen.profile
    error = Difference(profile.s_mm, profile.level_mm, readings.s_mm, readings.level_mm)
    size = np.abs(error.value)
    worst = int(np.argmax(size))
    pieces = error_bins(profile, readings, float(profile.s_mm[-1]))
    along = Along(
        float(np.trapezoid(size, error.x) / error.length_mm),
        error.size.share_below(CLOSE_MM),
        float(np.mean([(piece.mean_error_mm or np.inf) < CLOSE_MM for piece in pieces])),
        float(size[worst]),
        float(error.x[worst]),
    )
    return Surface(u, d_cm, error_mm, along)
