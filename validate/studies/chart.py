"""A study against readings: which pair of settings comes nearest, and how many others come as near."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sealtwin.records import Floats, Profile
from validate.studies.axis import Axis
from validate.studies.held import Excluded, Held, errors_on_grid
from validate.uncertainty.intervals import draw, hats, mean_absolute
from validate.uncertainty.readings import Budget

NEIGHBOURS = 8
"""Of a run on the map: all around it on a grid."""
NORMAL_QUARTILE = 0.6745
"""Median of |x| of a normal distribution of standard deviation 1."""
DRAWS = 2_000
"""Sets of readings; a share of 2.5 % is known to 0.35 % by them."""
CANNOT_TELL = 0.025
"""In more than this share of what the readings may truly have been, a run comes as near as the best: the data cannot
tell the two apart, at 95 % and both ways.
"""


@dataclass(frozen=True)
class Chart:
    """A study, mapped."""

    name: str
    axes: tuple[Axis, Axis]
    runs: tuple[Held, ...]
    excluded: tuple[Excluded, ...]
    readings: Profile
    band_mm: Floats
    """Half of the 95 % interval of each station's level, (n,)."""
    scatter_mm: float
    """Standard deviation of a single run's mean error, by how roughly neighbours on the map differ."""
    by_readings: tuple[bool, ...]
    """Of each run: whether the readings cannot tell it from the best one, itself among them."""
    as_near: tuple[bool, ...]
    """Whether readings and the scatter of single runs together cannot."""

    @property
    def errors_mm(self) -> Floats:
        return np.array([run.mean_error_mm for run in self.runs])

    @property
    def best(self) -> Held:
        return self.runs[int(np.argmin(self.errors_mm))]

    @property
    def worst(self) -> Held:
        return self.runs[int(np.argmax(self.errors_mm))]

    def said(self, run: Held) -> str:
        """Its two settings, for a sentence."""
        return ", ".join(axis.said(value) for axis, value in zip(self.axes, run.at, strict=True))

    @property
    def flatness(self) -> str:
        """How flat the optimum is, in a sentence or two."""
        near = [run for run, alike in zip(self.runs, self.as_near, strict=True) if alike]
        others = sum(self.by_readings) - 1
        first = "By the readings alone no other pair comes as near"
        if others:
            first = f"The readings alone cannot tell {others} other pair{'s' if others > 1 else ''} from it"
        second = f"single runs scatter by {self.scatter_mm:.2f} mm at most (one standard deviation)"
        if len(near) == 1:
            return f"{first}; {second}, and with that none comes as near either."
        spans = [_span(axis, [run.at[index] for run in near]) for index, axis in enumerate(self.axes)]
        return (
            f"{first}; {second}, and with that {len(near)} of {len(self.runs)} pairs come as near: "
            f"{' and '.join(spans)}, with mean errors up to {max(run.mean_error_mm for run in near):.2f} mm."
        )

    @property
    def exclusion(self) -> str:
        """How many runs are not in it and why, in a sentence."""
        total = len(self.runs) + len(self.excluded)
        if not self.excluded:
            return f"All {total} runs of the study are in it."
        reasons = Counter(each.reason for each in self.excluded).most_common()
        told = "; ".join(f"{count}: {reason}" for reason, count in reasons)
        return f"{len(self.excluded)} of {total} runs are not in it. {told}"


def as_near_as_the_best(runs: Sequence[Held], readings: Profile, budget: Budget, scatter_mm: float) -> tuple[bool, ...]:
    """Which runs' mean errors cannot be told from the least one.

    What the stations' means may truly have been is drawn from the budget of the readings, and all runs are held against
    each draw: an error of the readings moves the errors of two runs that are alike in the same way, so that their
    difference is known far better than either. ``scatter_mm``, of each run for itself, is added to all.
    """
    s_mm, error_mm = errors_on_grid([run.run for run in runs], readings)
    off_mm = draw(budget, DRAWS) @ hats(s_mm, readings.s_mm).T
    random = np.random.default_rng(0)
    best = int(np.argmin([run.mean_error_mm for run in runs]))
    least_mm = mean_absolute(s_mm, error_mm[best] + off_mm) + scatter_mm * random.standard_normal(DRAWS)
    near = []
    for number, each_mm in enumerate(error_mm):
        here_mm = mean_absolute(s_mm, each_mm + off_mm) + scatter_mm * random.standard_normal(DRAWS)
        near.append(number == best or float((here_mm <= least_mm).mean()) > CANNOT_TELL)
    return tuple(near)


def scatter_of_runs(runs: Sequence[Held], axes: tuple[Axis, Axis]) -> float:
    """Standard deviation of a single run's mean error: of its distance from a plane through its neighbours on the map.

    The median over the runs, so that a ridge or a step counts little; what bends between neighbours is in it, so it is
    no less than the true one.
    """
    from scipy.spatial import KDTree

    places, values = _spaced(runs, axes), np.array([run.mean_error_mm for run in runs])
    _, found = KDTree(places).query(places, k=min(NEIGHBOURS + 1, len(places)))
    distances = []
    for index, around in enumerate(np.asarray(found)):
        others = around[around != index][:NEIGHBOURS]
        plane = np.column_stack([np.ones(len(others)), places[others] - places[index]])
        # The plane's height at the run is a weighted sum of its neighbours' values.
        weight = np.linalg.pinv(plane)[0]
        distances.append(abs(values[index] - weight @ values[others]) / np.sqrt(1 + weight @ weight))
    return float(np.median(distances)) / NORMAL_QUARTILE


def chosen_few(chart: Chart) -> list[Held]:
    """Some nine runs that show what the two settings do: low, high, and as in the best run.

    Where the best run has the lowest or the highest value, the middle one stands between.
    """
    places = _spaced(chart.runs, chart.axes)
    best = places[chart.runs.index(chart.best)]
    chosen: list[int] = []
    between = np.where((best > 0.1) & (best < 0.9), best, 0.5)
    for up in (1.0, between[1], 0.0):
        for across in (0.0, between[0], 1.0):
            nearest = int(np.argmin(((places - [across, up]) ** 2).sum(axis=1)))
            if nearest not in chosen:
                chosen.append(nearest)
    runs = [chart.runs[index] for index in chosen]
    return runs if chart.best in runs else [chart.best, *runs]


def _spaced(runs: Sequence[Held], axes: tuple[Axis, Axis]) -> Floats:
    """Places on the map from 0 to 1 along each axis, (n, 2)."""
    places = np.column_stack(
        [axis.spaced(np.array([run.at[index] for run in runs])) for index, axis in enumerate(axes)]
    )
    return (places - places.min(axis=0)) / np.ptp(places, axis=0)


def _span(axis: Axis, values: list[float]) -> str:
    low, high = min(values), max(values)
    if low == high:
        return axis.said(low)
    return f"{axis.name} from {axis.rounded(low)} to {axis.rounded(high)} {axis.unit}".rstrip()
