"""A mapped study without any fluid run: levels that two settings move, and readings that one pair meets."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from sealtwin.core.records import Profile
from validate.figures.chart import (
    Chart,
    Excluded,
    Finished,
    RepeatedPairs,
    as_near_as_the_best,
    axes_of,
    hold,
)
from validate.settings import Readings, Uncertainty
from validate.uncertainty.budget import Budget
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.reading_errors import budget_of

S_MM = np.linspace(0.0, 80.0, 401)
STATIONS_MM = np.arange(0.0, 81.0, 5.0)
U = (0.03, 0.3, 1.0, 10.0, 30.0, 100.0, 1000.0)
D_CM = (1e-4, 1e-3, 0.01, 0.3, 3.0)
BEST = (30.0, 0.3)


def line(s_mm):
    return np.interp(s_mm, (0, 20, 30, 40, 80), (-16, -4, -4, 1, 1))


def error_mm(u: float, d_cm: float) -> float:
    """Least, 0.5, at ``BEST``; two thirds of a millimetre a power of ten of U away, a tenth for D."""
    return 0.5 + abs(np.log10(u / BEST[0])) * 2 / 3 + abs(np.log10(d_cm / BEST[1])) / 10


def make_readings(scatter_mm: float = 0.1) -> Profile:
    # In another order at each station, as of repeats that are no passes.
    off_mm = np.random.default_rng(0).permuted(np.tile([-scatter_mm, 0.0, scatter_mm], (len(STATIONS_MM), 1)), axis=1)
    repeats_mm = line(STATIONS_MM)[:, None] + off_mm
    return Profile(STATIONS_MM, line(STATIONS_MM), repeats_mm, "measured", "caliper.csv")


def make_budget(readings: Profile) -> Budget:
    settings = Readings.model_validate_json('{"file": "caliper.csv", "data": "measured", "role": "held-out"}')
    mouth = Mouth(readings.s_mm, np.full(len(readings.s_mm), 3.0), 1690.0)
    return budget_of(readings, settings, Uncertainty(pass_mm=0.0), mouth)


def make_runs(u: tuple[float, ...] = U, d_cm: tuple[float, ...] = D_CM) -> list[Finished]:
    pairs = [(one, other) for one in u for other in d_cm]
    return [
        Finished(
            number,
            {"fluid.U": pair[0], "fluid.D_cm": pair[1]},
            Profile(S_MM, line(S_MM) + error_mm(*pair), source="simulation"),
            10.0,
        )
        for number, pair in enumerate(pairs, start=1)
    ]


def make_chart(excluded: tuple[Excluded, ...] = (), **changes: Any) -> Chart:
    return replace(_chart(), excluded=excluded, **changes)


@cache
def _chart() -> Chart:
    readings, runs = make_readings(), make_runs()
    axes = axes_of([run.settings for run in runs])
    runs_on_axes = tuple(hold(run, readings, axes) for run in runs)
    budget = make_budget(readings)
    return Chart(
        name="study",
        axes=axes,
        runs=runs_on_axes,
        excluded=(),
        readings=readings,
        total=39,
        band_mm=budget.profile_band_mm,
        as_near=as_near_as_the_best(runs_on_axes, readings, budget, 0.1),
        replicates=RepeatedPairs(runs=4, pairs=1, scatter_mm=0.1),
    )
