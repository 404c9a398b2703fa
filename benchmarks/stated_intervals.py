"""How often the stated 95 % intervals hold the truth, on synthetic trials whose truth is known.

    python -m benchmarks.stated_intervals [--draws 1200] [--only NAME]

Each trial draws a bed like the paper's (floor, ramp, step, plateau), a simulation of it that is off by a smooth error,
and readings with the errors of its case. Held against the truth are the intervals of the bias, of the mean error and of
the levels at the stations, and the band that holds for all stations at once. An error that nobody declared and that all
repeats share has no target: its rows are reported.

The last rows are of the numerics: runs that scatter, at three particle sizes, of a level that is off by a power of the
size. Held against the truth is the trial's own run.

There are 1,200 trials of a case, and 2,000 where the interval shall not be too wide either: a method whose intervals
contain 95 %, and that refuses 1 % of true declarations, misses its bar in fewer than 1 of 1,000 draws of a row. Two
processes take the cases in turn.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from benchmarks.table import Row, one_of, processes, run_benchmark
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile
from validate.metrics.curve_distances import Difference
from validate.settings import Readings, Uncertainty
from validate.uncertainty.budget import Curve, half_width, mean_absolute
from validate.uncertainty.computed import Replicates, numerical_errors
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.reading_errors import budget_of

LENGTH_MM, WIDTH_MM = 80.0, 3.1
FINE_MM = np.linspace(0, LENGTH_MM, 41)
CORNERS_MM = np.array([[0.0, 20.0, 30.0, 40.0, 80.0], [-16.0, -4.0, -4.0, 1.0, 1.0]])
"""Place and level of the corners of the paper's bed, as its prose has them; each trial moves the inner ones."""
MOVED_MM = 2.5
MOVES = np.array([[0, 1, 1, 1, 0], [0, 0, 0, 0, 0]])
"""Which of them a trial moves along the crack, so that no corner is at a station for long."""
WANDERING_MM = 10.0  # Length over which a simulation is off alike
LIMIT_MM = 0.02

Law = Literal["normal", "lognormal", "exponential", "t3", "outliers"]


@dataclass(frozen=True)
class Case:
    """A way to read a sample: its errors, and what its trial file declares of them."""

    name: str
    stations: int = 17
    repeats: int = 3
    law: Law = "normal"
    scatter_mm: float = 0.15  # Standard deviation of a single reading, as in the fixture
    grows: float = 1.0  # Factor of the scatter from one end of the crack to the other
    left_out: float = 0.0  # Share of single readings that are missing
    operator_mm: float = 0.0  # Offset of each pass, standard deviation
    drift_mm: float = 0.0  # Offset of each pass in the middle, which grows from 0 along the crack
    step_mm: float = 0.01  # Last digit
    datum_mm: float = 0.0
    probe_mm: float = 0.0
    shift_mm: float = 0.0  # Of all stations along the crack, standard deviation
    each_mm: float = 0.0  # Of each station along the crack
    common_mm: float = 0.0  # Error that all repeats of a station share, alike over 10 mm
    bed: Literal["corners", "straight", "curved"] = "corners"
    error_mm: float = 1.0  # Of the simulation, root mean square; the paper's is 1.26 on average
    readings: Mapping[str, Any] = field(default_factory=dict)
    uncertainty: Mapping[str, Any] = field(default_factory=dict)
    only_noise: bool = False  # The interval shall not be too wide either
    hidden: bool = False  # An error that no repeats show and nobody declared


NO_PASSES = {"pass_mm": 0.0}
DRAWS, MORE_DRAWS = 1200, 2000
REFUSED = 2.0  # Percent of refusals of true declarations; of 1 %, by 1,200 draws more than three standard deviations
CASES: Sequence[Case] = (
    Case("no passes", uncertainty=NO_PASSES, only_noise=True),
    Case("no passes, lognormal", law="lognormal", uncertainty=NO_PASSES, only_noise=True),
    Case("no passes, exponential", law="exponential", uncertainty=NO_PASSES, only_noise=True),
    Case("no passes, Student's t of 3", law="t3", uncertainty=NO_PASSES, only_noise=True),
    Case("no passes, 3 % outliers", law="outliers", uncertainty=NO_PASSES, only_noise=True),
    Case("scatter alone"),
    Case("28 stations, scatter alone", stations=28),
    Case("5 stations x 2, lognormal", stations=5, repeats=2, law="lognormal", bed="straight"),
    Case("5 stations x 2, corners anywhere", stations=5, repeats=2),
    Case("scatter grows fourfold", grows=4.0),
    Case("a quarter of the readings missing", left_out=0.25),
    Case("error as small as 0.3 mm", error_mm=0.3),
    Case("operator 0.1 mm", operator_mm=0.1),
    Case("operator 0.2 mm", operator_mm=0.2),
    Case("drift of each pass", drift_mm=0.1),
    Case("steps of 0.5 mm", step_mm=0.5),
    Case("steps of 0.5 mm, scatter 0.05", step_mm=0.5, scatter_mm=0.05),
    Case("curved between stations", bed="curved"),
    Case("datum 0.2 mm declared", datum_mm=0.2, readings={"datum_error_mm": 0.2}),
    Case("probe 1 mm declared", probe_mm=1.0, readings={"probe_mm": 1.0}),
    Case("probe 4 mm declared, 9 stations", stations=9, probe_mm=4.0, readings={"probe_mm": 4.0}),
    Case("each station 0.5 mm declared", each_mm=0.5, uncertainty={"station_each_mm": 0.5}),
    Case("each station 1 mm declared", each_mm=1.0, uncertainty={"station_each_mm": 1.0}),
    Case("all stations 1 mm declared", shift_mm=1.0, uncertainty={"station_mm": 1.0}),
    Case("common to repeats, declared", common_mm=0.15, uncertainty={"common_mm": 0.15}),
    Case(
        "a lab with a bit of all",
        operator_mm=0.1,
        each_mm=0.5,
        datum_mm=0.05,
        step_mm=0.05,
        law="lognormal",
        readings={"datum_error_mm": 0.05},
        uncertainty={"station_each_mm": 0.5},
    ),
    Case("common to repeats, NOT declared", common_mm=0.15, hidden=True),
    Case("datum 0.2 mm, NOT declared", datum_mm=0.2, hidden=True),
    Case("all stations 1 mm, NOT declared", shift_mm=1.0, hidden=True),
)


@dataclass(frozen=True)
class Sizes:
    """A level that is off by ``error_mm`` on average at the middle of three particle sizes."""

    error_mm: float
    order: float = 1.0
    hidden: bool = False  # Beyond what the target is for

    @property
    def name(self) -> str:
        return f"numerics off by {self.error_mm:g} mm, order {self.order:g}"


RADII = np.array([1 / 1.3, 1.0, 1.3])
RUNS = 3  # Of each size
RUN_MM, PLACE_MM = 0.12, 0.3  # What a run scatters by, standard deviation: its mean level, and about that along s
UNEVEN = 0.5  # Share by which the error along s is larger and smaller than on average
HALF_WIDTH_MM = 1.5  # Most half-width in the median
NUMERICS: Sequence[Sizes] = (
    Sizes(0.0),
    *(Sizes(error_mm, order) for error_mm in (0.1, 0.3) for order in (0.5, 1.0, 2.0)),
    *(Sizes(1.0, order, hidden=True) for order in (0.5, 1.0, 2.0)),
)
NUMERICS_SEED = 20261121  # Not one of those that the method was chosen on


@dataclass(frozen=True)
class Coverage:
    """Shares of the trials, or of all their stations, whose interval held the truth."""

    bias: float
    mean_error: float
    station: float
    profile: float  # Share of the trials in which the band of the whole profile held at every station
    width_mm: float  # Mean width of the bias's interval
    refused: float = 0.0  # Share of the trials whose readings contradict the case's own declarations, which are true


def main(
    draws: int = DRAWS,
    only: Annotated[str | None, one_of(case.name for case in (*CASES, *NUMERICS))] = None,
) -> list[Row]:
    chosen = [case for case in (*CASES, *NUMERICS) if only in (None, case.name)]
    with processes(2) as pool:
        return list(chain.from_iterable(pool.map(partial(_judged, draws), chosen)))


def _judged(draws: int, case: Case | Sizes) -> list[Row]:
    if isinstance(case, Sizes):
        rows = numerics_rows(case, draws)
    else:
        rows = rows_of(case, coverage_of(case, draws * MORE_DRAWS // DRAWS if case.only_noise else draws))
    print(f"{case.name}: done", flush=True)
    return rows


def rows_of(case: Case, coverage: Coverage) -> list[Row]:
    low, high = (0.0, np.inf) if case.hidden else (93.0, 97.0) if case.only_noise else (92.0, np.inf)
    shares = (("bias", coverage.bias), ("mean error", coverage.mean_error), ("station", coverage.station))
    rows = [Row(f"{case.name}: {what}", 100 * share, "%", low, high, "95") for what, share in shares]
    off = 0.0 if case.hidden else 90.0
    rows.append(Row(f"{case.name}: whole profile", 100 * coverage.profile, "%", off, np.inf, "95"))
    rows.append(Row(f"{case.name}: width of the bias", coverage.width_mm, "mm"))
    if case.uncertainty or case.readings:
        rows.append(Row(f"{case.name}: true declarations refused", 100 * coverage.refused, "%", 0.0, REFUSED, "1"))
    return rows


def numerics_rows(sizes: Sizes, draws: int, seed: int = NUMERICS_SEED) -> list[Row]:
    random = np.random.default_rng([seed, NUMERICS.index(sizes)])
    holds = np.array([_numerics_held(sizes, random) for _ in range(draws)])
    level, station, _ = 100 * holds.mean(axis=0)
    low, most_mm = (0.0, np.inf) if sizes.hidden else (92.0, HALF_WIDTH_MM)
    return [
        Row(f"{sizes.name}: mean level", level, "%", low, np.inf, "95"),
        Row(f"{sizes.name}: station", station, "%", low, np.inf, "95"),
        Row(f"{sizes.name}: median half-width", float(np.median(holds[:, 2])), "mm", 0.0, most_mm),
    ]


def _numerics_held(sizes: Sizes, random: np.random.Generator) -> tuple[float, float, float]:
    """Whether the mean level of one run holds its truth, for which share of the stations, and its half-width."""
    wave = np.array([[_wave(WANDERING_MM, random)[::2] for _ in range(RUNS)] for _ in RADII])
    shape = sizes.error_mm * (1 + UNEVEN * np.cos(np.linspace(0, 2 * np.pi, wave.shape[2], endpoint=False)))
    along_mm = PLACE_MM * (wave - wave.mean(axis=2, keepdims=True))
    runs_mm = shape * RADII[:, None, None] ** sizes.order + along_mm + RUN_MM * random.standard_normal((3, RUNS, 1))
    errors = numerical_errors(Replicates(RADII.tolist(), list(runs_mm)), None)
    off_mm = np.sum([one.draws_mm for one in errors], axis=0)
    own_mm, half_mm = runs_mm[1, 0], float(half_width(off_mm.mean(axis=1)))
    return float(abs(own_mm.mean()) <= half_mm), float((np.abs(own_mm) <= half_width(off_mm)).mean()), half_mm


def coverage_of(case: Case, draws: int, seed: int = 0) -> Coverage:
    random = np.random.default_rng(seed)
    s_mm = np.linspace(0, LENGTH_MM, case.stations)
    trials = [_held(case, s_mm, random) for _ in range(draws)]
    holds = np.array([trial for trial in trials if trial is not None])
    return Coverage(*holds.mean(axis=0).tolist(), refused=1 - len(holds) / draws)


def _held(case: Case, s_mm: Floats, random: np.random.Generator) -> tuple[float, ...] | None:
    """Of a trial: whether each interval holds its truth, for which share of the stations, and the bias's width.

    None if its readings contradict what the case declares, by chance.
    """
    bed = bed_s_mm, bed_mm = _bed(case, random)
    simulated_mm = np.interp(FINE_MM, *bed) + case.error_mm * _wave(WANDERING_MM, random)
    repeats_mm = _read(case, s_mm, lambda places_mm: np.interp(places_mm, *bed), random)
    level_mm = np.nanmean(repeats_mm, axis=1)
    settings = Readings(file=Path("sheet.csv"), data="synthetic", role="held-out", limit_mm=LIMIT_MM, **case.readings)
    mouth = Mouth(s_mm, np.full(len(s_mm), WIDTH_MM), None)
    try:
        budget = budget_of(Profile(s_mm, level_mm, repeats_mm), settings, Uncertainty(**case.uncertainty), mouth)
    except InputError:
        return None
    difference, truth = (Difference(FINE_MM, simulated_mm, *level) for level in ((s_mm, level_mm), bed))
    curve = Curve.of(difference.x, difference.value, s_mm)
    half_mm = budget.mean_mm(curve.weights())
    low_mm, high_mm = budget.mean_error_interval(curve)
    off_mm = np.abs(level_mm - np.interp(s_mm, bed_s_mm, bed_mm))
    return (
        float(abs(difference.mean() - truth.mean()) <= half_mm),
        float(low_mm <= float(mean_absolute(truth.x, truth.value)) <= high_mm),
        float((off_mm <= budget.band_mm).mean()),
        float((off_mm <= budget.profile_band_mm).all()),
        2 * half_mm,
    )


def _bed(case: Case, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Draw the true level: corners anywhere, or at stations, with straight lines between; or one curve."""
    if case.bed == "curved":
        place = FINE_MM / random.uniform(12.0, 18.0)
        return FINE_MM, 1.0 - 17.0 * np.exp(-place)
    s_mm, level_mm = CORNERS_MM + MOVED_MM * MOVES * random.uniform(-1, 1, CORNERS_MM.shape)
    if case.bed == "straight":
        at_mm = np.linspace(0, LENGTH_MM, case.stations)
        return at_mm, np.interp(at_mm, s_mm, level_mm)
    return s_mm, level_mm


def _read(case: Case, s_mm: Floats, level_at: Callable[[Floats], Floats], random: np.random.Generator) -> Floats:
    """Draw the readings, (n, repeats), to the last digit."""
    size = (len(s_mm), case.repeats)
    at_mm = s_mm + case.shift_mm * random.standard_normal() + case.each_mm * random.standard_normal(len(s_mm))
    reach_mm = np.linspace(-case.probe_mm / 2, case.probe_mm / 2, 5)
    level_mm = level_at(at_mm[:, None] + reach_mm).max(axis=1)
    level_mm += LIMIT_MM * random.uniform(-1, 1) + case.datum_mm * random.standard_normal()
    level_mm += case.common_mm * np.interp(s_mm, FINE_MM, _wave(WANDERING_MM, random))
    passes_mm = case.operator_mm * random.standard_normal(case.repeats)
    passes_mm = passes_mm + case.drift_mm * random.standard_normal(case.repeats) * 2 * s_mm[:, None] / LENGTH_MM
    own_mm = case.scatter_mm * np.linspace(1, case.grows, len(s_mm))[:, None] * _noise(case.law, size, random)
    read_mm = level_mm[:, None] + passes_mm + own_mm
    missing = random.random(size) < case.left_out
    missing[:, 0] = False
    return np.where(missing, np.nan, np.round(read_mm / case.step_mm) * case.step_mm)


def _noise(law: Law, size: tuple[int, int], random: np.random.Generator) -> Floats:
    """Draw noise of mean 0 and standard deviation 1; of outliers the rest has it."""
    if law == "lognormal":
        spread = np.exp(0.6 * random.standard_normal(size))
        middle, variance = np.exp(0.18), np.exp(0.72) - np.exp(0.36)
        return (spread - middle) / np.sqrt(variance)
    if law == "exponential":
        return random.exponential(size=size) - 1
    if law == "t3":
        return random.standard_t(3, size) / np.sqrt(3)
    noise = random.standard_normal(size)
    return np.where(random.random(size) < 0.03, 10 * noise, noise) if law == "outliers" else noise


def _wave(length_mm: float, random: np.random.Generator) -> Floats:
    """A smooth random curve of unit height over FINE_MM: a Gaussian process, its covariance a bell of that length."""
    shapes = _shapes(length_mm)
    return shapes @ random.standard_normal(shapes.shape[1])


@cache
def _shapes(length_mm: float) -> Floats:
    values, vectors = np.linalg.eigh(np.exp(-(((FINE_MM[:, None] - FINE_MM) / length_mm) ** 2) / 2))
    return vectors * np.sqrt(np.maximum(values, 0.0))


if __name__ == "__main__":
    run_benchmark(main)
