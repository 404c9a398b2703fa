"""Comparison of a study's runs with readings: the nearest pair of settings, and the pairs as near as it."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats, Profile
from validate.study_figures.run_errors import Axis, Excluded, HeldRun, errors_on_grid
from validate.uncertainty.intervals import draw, hats, mean_absolute
from validate.uncertainty.readings_budget import Budget

NEIGHBOURS = 8  # Number of a run's neighbours on the map: all around it on a grid
NORMAL_QUARTILE = 0.6745  # Median of |x| of the standard normal distribution
DRAWS = 2_000  # Number of random sets of readings, from which a share of 2.5 % is known to 0.35 %
CANNOT_TELL = 0.025
"""Share of the random sets of readings in which a run must be as near as the best one for the two to be equally near:
both tails of 95 %.
"""


@dataclass(frozen=True)
class Chart:
    """Runs of a study over two settings, compared with the same readings."""

    name: str
    axes: tuple[Axis, Axis]
    runs: tuple[HeldRun, ...]
    excluded: tuple[Excluded, ...]
    readings: Profile
    band_mm: Floats  # Half the 95 % interval of each reading's level, (n,)
    scatter_mm: float  # Standard deviation of a single run's mean error, estimated from its neighbours on the map
    by_readings: tuple[bool, ...]
    """Flag of each run that the readings cannot distinguish from the best one, itself included."""
    as_near: tuple[bool, ...]
    """Flag of each run that cannot be distinguished from the best one given the scatter of single runs too."""

    @property
    def errors_mm(self) -> Floats:
        return np.array([run.mean_error_mm for run in self.runs])

    @property
    def best(self) -> HeldRun:
        return self.runs[int(np.argmin(self.errors_mm))]

    @property
    def places(self) -> Floats:
        """Places of the runs on the map, from 0 to 1 along each axis, (n, 2)."""
        return _places(self.runs, self.axes)

    def said(self, run: HeldRun) -> str:
        """Return the two settings of a run, for a sentence."""
        return ", ".join(axis.said(value) for axis, value in zip(self.axes, run.at, strict=True))

    @property
    def flatness(self) -> str:
        """Statement about the pairs as near as the nearest one."""
        near = [run for run, alike in zip(self.runs, self.as_near, strict=True) if alike]
        others = sum(self.by_readings) - 1
        first = "By the readings alone no other pair comes as near"
        if others:
            first = f"The readings alone cannot tell {others} other pair{'s' if others > 1 else ''} from it"
        second = f"single runs scatter by {self.scatter_mm:.2f} mm at most (one standard deviation)"
        if len(near) == 1:
            return f"{first}; {second}, and with that none comes as near either."
        values = np.array([run.at for run in near]).T
        spans = [axis.span(along) for axis, along in zip(self.axes, values, strict=True)]
        return (
            f"{first}; {second}, and with that {len(near)} of {len(self.runs)} pairs come as near: "
            f"{' and '.join(spans)}, with mean errors up to {max(run.mean_error_mm for run in near):.2f} mm."
        )

    @property
    def exclusion(self) -> str:
        """Statement about the excluded runs and the reasons."""
        total = len(self.runs) + len(self.excluded)
        if not self.excluded:
            return f"All {total} runs of the study are in it."
        reasons = Counter(each.reason for each in self.excluded).most_common()
        told = "; ".join(f"{count}: {reason}" for reason, count in reasons)
        return f"{len(self.excluded)} of {total} runs are not in it. {told}"


def as_near_as_the_best(
    runs: Sequence[HeldRun], readings: Profile, budget: Budget, scatter_mm: float
) -> tuple[bool, ...]:
    """Return a flag for each run whose mean error cannot be distinguished from the least one.

    Random readings are drawn from their budget, and all runs are compared with each draw: an error of the readings
    changes the errors of similar runs alike, so that their difference is known far better than either.
    ``scatter_mm`` is added to each run independently.
    """
    s_mm, error_mm = errors_on_grid(runs, readings)
    off_mm = draw(budget, DRAWS) @ hats(s_mm, readings.s_mm).T
    random = np.random.default_rng(0)
    best = int(np.argmin([run.mean_error_mm for run in runs]))
    least_mm = mean_absolute(s_mm, error_mm[best] + off_mm) + scatter_mm * random.standard_normal(DRAWS)
    near = []
    for number, each_mm in enumerate(error_mm):
        here_mm = mean_absolute(s_mm, each_mm + off_mm) + scatter_mm * random.standard_normal(DRAWS)
        near.append(number == best or float((here_mm <= least_mm).mean()) > CANNOT_TELL)
    return tuple(near)


def scatter_of_runs(runs: Sequence[HeldRun], axes: tuple[Axis, Axis]) -> float:
    """Return the standard deviation of a single run's mean error, from its distance to a plane through its neighbours.

    It is estimated from the median over the runs, so that a ridge or a step counts little. Curvature between neighbours
    is included, so the estimate is an upper bound.
    """
    from scipy.spatial import KDTree

    places, values = _places(runs, axes), np.array([run.mean_error_mm for run in runs])
    _, found = KDTree(places).query(places, k=min(NEIGHBOURS + 1, len(places)))
    distances = []
    for index, around in enumerate(np.asarray(found)):
        others = around[around != index][:NEIGHBOURS]
        plane = np.column_stack([np.ones(len(others)), places[others] - places[index]])
        # The plane's height at the run is a weighted sum of its neighbours' values.
        weight = np.linalg.pinv(plane)[0]
        distances.append(abs(values[index] - weight @ values[others]) / np.sqrt(1 + weight @ weight))
    return float(np.median(distances)) / NORMAL_QUARTILE


def chosen_few(chart: Chart) -> list[HeldRun]:
    """Return about nine runs with low, high and the best run's values of the two settings.

    If the best run has the lowest or highest value, the middle one replaces it.
    """
    places = chart.places
    best = places[int(np.argmin(chart.errors_mm))]
    chosen: list[int] = []
    between = np.where((best > 0.1) & (best < 0.9), best, 0.5)
    for up in (1.0, between[1], 0.0):
        for across in (0.0, between[0], 1.0):
            nearest = int(np.argmin(((places - [across, up]) ** 2).sum(axis=1)))
            if nearest not in chosen:
                chosen.append(nearest)
    runs = [chart.runs[index] for index in chosen]
    return runs if chart.best in runs else [chart.best, *runs]


def _places(runs: Sequence[HeldRun], axes: tuple[Axis, Axis]) -> Floats:
    values = np.array([run.at for run in runs]).T
    places = np.column_stack([axis.spaced(each) for axis, each in zip(axes, values, strict=True)])
    return (places - places.min(axis=0)) / np.ptp(places, axis=0)
