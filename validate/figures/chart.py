"""A study's runs over two settings, compared with the same readings: the best pair, and pairs that fit as well."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact
from sealtwin.core.records import Floats, Profile
from sealtwin.core.vtk_files import Frame
from validate.comparison import Baseline, ErrorFigures
from validate.metrics.curve_distances import compared_stations, error_figures, level_difference
from validate.metrics.verdict import ALWAYS, against_baselines, best_curves
from validate.uncertainty.budget import Budget, linear_weights, mean_absolute
from validate.uncertainty.computed import require_different
from validate.units import counted, name_and_unit

DECADES = 100.0  # An axis is logarithmic if its largest value is at least this many times its smallest value
LEVELS = 16  # Largest number of values of a setting for which each value is drawn as a line
DRAWS = 2_000  # Number of random sets of readings. They determine a fraction of 2.5 % to within 0.35 %.
CANNOT_TELL = 0.025
"""A run fits as well as the best run if its error is smaller in more than this fraction of the random sets of readings.
The fraction is one tail outside a 95 % interval."""
FARTHEST_NEAR = 4 / 3  # Largest mean error of a run that fits equally well, divided by the smallest mean error
REPEATED = "seed"  # Setting in which repeated runs differ. It is never an axis.
NAMED = 8  # Largest number of runs that a sentence names
UNFIT = Fact("unfit", "the fast model is not valid for these settings.")
VOLUME_OFF = Fact("volume", "the settled volume differs from the dispensed volume by more than 5 %.")
CELLS = 240  # Number of cells of the map along each axis, which is finer than a page can show
STEPS = 12  # Number of equal bins into which the range of the number of moving particles is divided
FEWEST = 3  # Smallest number of frames in a bin, and smallest number of bins for fitting a straight line
MIN_VALUES, MIN_RUNS, MIN_SHARE = 4, 16, 2 / 3
"""A surface needs at least this many values of each setting, this many runs, and this fraction of the map's area
between the runs. On a grid this is 4 by 4 runs; 30 random runs enclose about 0.7 of the map. With fewer runs, the
surface would be a guess."""


@dataclass(frozen=True)
class Axis:
    """A setting that varies among the runs, as an axis of a map."""

    setting: str  # Dotted name, for example "fluid.D_cm"
    name: str  # Name in words without table and unit, for example "D"
    unit: str  # Empty for a pure number
    values: tuple[float, ...]  # Values among the runs, increasing

    @property
    def label(self) -> str:
        return f"{self.name} ({self.unit})" if self.unit else self.name

    @property
    def logarithmic(self) -> bool:
        return self.values[0] > 0 and self.values[-1] >= DECADES * self.values[0]

    def is_graded(self, runs: int) -> bool:
        """Return True if the setting has so few values that each can have its own line, as on a grid of runs."""
        return len(self.values) <= min(LEVELS, runs // 2)

    def spaced(self, values: Floats) -> Floats:
        """Return the positions of values on the axis, (n,). On a logarithmic axis these are the logarithms."""
        return np.log10(values) if self.logarithmic else np.asarray(values, float)

    def text_of(self, values: Floats | float) -> str:
        """Return a value or a range of values as text, for example "D = 0.3 cm" or "D from 0.03 to 0.3 cm"."""
        # Four digits, and 10000 for 1e+04.
        low, high = (f"{float(f'{value:.4g}'):g}" for value in (np.min(values), np.max(values)))
        return f"{self.name} {f'= {low}' if low == high else f'from {low} to {high}'} {self.unit}".rstrip()


def axes_of(settings: Sequence[Mapping[str, Any]]) -> tuple[Axis, Axis]:
    """Return the two settings, other than the seed, that vary among the runs. The first is the horizontal axis.

    Raises InputError unless exactly two settings vary, both are numbers, and the runs cover an area instead of a line.
    """
    values = {name: [setting[name] for setting in settings] for name in settings[0] if name != REPEATED}
    varying = [name for name, column in values.items() if len({str(value) for value in column}) > 1]
    if len(varying) != 2:
        these = "none varies" if not varying else f"{len(varying)} vary: {', '.join(varying)}"
        raise InputError(f"A map needs two settings that vary among the finished runs, but {these}. Vary exactly two.")
    for name in varying:
        if odd := [value for value in values[name] if isinstance(value, bool) or not isinstance(value, int | float)]:
            raise InputError(f"{name} = {odd[0]!r:.40} is not a number. A map needs two settings that are numbers.")
    across, up = (
        Axis(name, *name_and_unit(name.rpartition(".")[2]), tuple(sorted({float(value) for value in values[name]})))
        for name in varying
    )
    points = np.column_stack([axis.spaced(np.array(values[axis.setting], float)) for axis in (across, up)])
    reach = np.ptp(points, axis=0)
    if np.linalg.matrix_rank((points - points.mean(axis=0)) / reach, tol=1e-6) < 2:
        raise InputError(
            f"{across.setting} and {up.setting} vary together, so all runs are on one line. Vary them independently."
        )
    return across, up


@dataclass(frozen=True)
class Finished:
    """A finished run of a study."""

    number: int
    settings: Mapping[str, Any]  # Settings that vary, by dotted name
    profile: Profile
    wall_s: float


@dataclass(frozen=True)
class Excluded:
    """A run that has no result or is not ranked."""

    number: int
    settings: Mapping[str, Any]
    reason: Fact
    volume_ratio: float | None = None  # Settled volume, divided by the dispensed volume. None if there is no result.


@dataclass(frozen=True)
class HeldRun(Finished, ErrorFigures):
    """A finished run with the exact errors of its level (simulated minus measured), where both levels are known."""

    values: tuple[float, float]  # Values of the map's two settings


@dataclass(frozen=True)
class RepeatedPairs:
    """Runs that repeat pairs of settings with other seeds."""

    runs: int
    pairs: int  # Number of pairs that they repeat
    scatter_mm: float  # Standard deviation of a single run's mean error, pooled over the pairs


def hold(run: Finished, readings: Profile, axes: tuple[Axis, Axis]) -> HeldRun:
    """Compare a run with the readings. Raises InputError if both have no stretch of the crack in common."""
    errors = error_figures(level_difference(run.profile, readings), readings)
    across, up = (float(run.settings[axis.setting]) for axis in axes)
    return HeldRun(**vars(run), **vars(errors), values=(across, up))


def first_of_each_pair(
    runs: Sequence[HeldRun], where: str = "study", *, fast: bool = False
) -> tuple[tuple[HeldRun, ...], RepeatedPairs | None]:
    """Return the first run of each pair of settings, and the scatter of repeated runs.

    The scatter is None if no pair was repeated. It is also None for the ``fast`` model, whose runs do not depend on the
    seed. ``where`` is the start of an error message. Raises InputError if two runs of particles with different seeds
    have the same level.
    """
    pairs: dict[tuple[float, float], list[HeldRun]] = {}
    for run in runs:
        pairs.setdefault(run.values, []).append(run)
    firsts, repeated = tuple(alike[0] for alike in pairs.values()), [] if fast else list(pairs.values())
    for alike in repeated:
        names = [f"{run.number} (seed {run.settings.get(REPEATED, 0)})" for run in alike]
        require_different([run.profile.level_mm for run in alike], names, where)
    # A pair that was not repeated adds 0 to the squares and to the degrees of freedom.
    squares_mm2 = sum(len(alike) * np.var([run.mean_error_mm for run in alike]) for alike in repeated)
    if not (freedom := sum(len(alike) - 1 for alike in repeated)):
        return firsts, None
    pairs_repeated = sum(len(alike) > 1 for alike in repeated)
    return firsts, RepeatedPairs(freedom, pairs_repeated, float(np.sqrt(squares_mm2 / freedom)))


@dataclass(frozen=True)
class Chart:
    """Runs of a study over two settings, compared with the same readings."""

    name: str
    axes: tuple[Axis, Axis]
    runs: tuple[HeldRun, ...]
    excluded: tuple[Excluded, ...]
    readings: Profile
    total: int  # Number of runs of the study, including runs that repeat a pair
    band_mm: Floats  # Half-width of the 95 % band of all readings together, (n,)
    as_near: tuple[bool, ...]
    """True for each run that cannot be distinguished from the best run, (runs,). Without repeats, only for the best
    run."""
    replicates: RepeatedPairs | None
    screening: str = ""  # Sentence about the runs of the fast model or drafts. Empty if there are none.
    fast: bool = False  # True if the fast model computed all runs
    fluid_warnings: tuple[str, ...] = ()  # Sentences about faults of the runs' fluids
    fitted: int = 2  # Number of settings fitted to these readings: the map's two and the trial's declared ones

    @property
    def errors_mm(self) -> Floats:
        return np.array([run.mean_error_mm for run in self.runs])

    @property
    def best(self) -> HeldRun:
        return self.runs[int(np.argmin(self.errors_mm))]

    @cached_property
    def baselines(self) -> tuple[Baseline, ...]:
        """Best curves through the readings, over the stretch of the best run."""
        return best_curves(self.readings, *self._ends_mm, (*ALWAYS, self.fitted))

    @property
    def beside_baselines(self) -> str:
        """Sentence that compares the best run with the baselines.

        The run counts as calibrated, because these readings chose it.
        """
        stations = len(compared_stations(self.best.profile, self.readings).s_mm)
        return against_baselines(self.best.mean_error_mm, self.baselines, "calibrated-on", self.fitted, stations)

    @property
    def _ends_mm(self) -> tuple[float, float]:
        """Ends of the stretch that both the best run and the readings cover."""
        x = level_difference(self.best.profile, self.readings).x
        return float(x[0]), float(x[-1])

    @property
    def nearest(self) -> str:
        return f"nearest: {self.text_of(self.best)}, {self.best.mean_error_mm:.2f} mm"

    @property
    def pairs(self) -> Floats:
        """Values of the two settings for each run, (runs, 2)."""
        return np.array([run.values for run in self.runs])

    @property
    def spaced(self) -> Floats:
        """Positions of the runs on the map, in the units of the axes, (runs, 2)."""
        return np.column_stack([axis.spaced(along) for axis, along in zip(self.axes, self.pairs.T, strict=True)])

    @property
    def places(self) -> Floats:
        """Positions of the runs on the map, from 0 to 1 along each axis, (runs, 2)."""
        places = self.spaced
        return (places - places.min(axis=0)) / np.ptp(places, axis=0)

    @property
    def has_surface(self) -> bool:
        """True if there are enough runs for a surface between them."""
        from scipy.spatial import ConvexHull

        return (
            len(self.runs) >= MIN_RUNS
            and min(len(set(along)) for along in self.places.T) >= MIN_VALUES
            # The area, since the hull is in the plane.
            and ConvexHull(self.places).volume >= MIN_SHARE
        )

    def text_of(self, run: HeldRun) -> str:
        """Return the two settings of a run as text."""
        return ", ".join(axis.text_of(value) for axis, value in zip(self.axes, run.values, strict=True))

    @property
    def flatness(self) -> str:
        """Sentence about the pairs of settings that fit as well as the best one."""
        if self.replicates is None and self.fast:
            return "Runs of the fast model do not scatter. Their difference from runs with particles is unknown."
        if self.replicates is None:
            return (
                "No pair was repeated with another seed, so it is unknown how far single runs scatter and which other "
                "pairs fit equally well."
            )
        near = [run for run, alike in zip(self.runs, self.as_near, strict=True) if alike]
        pairs = f"{counted(self.replicates.pairs, 'pair')} repeated"
        freedom = f"{counted(self.replicates.runs, 'degree')} of freedom"
        scatter = f"{self.replicates.scatter_mm:.2f} mm (one standard deviation, {pairs}, {freedom})"
        first = f"Single runs scatter by {scatter}. Given this and the uncertainty of the readings,"
        if len(near) == 1:
            return f"{first} no other pair fits equally well."
        values = self.pairs[np.array(self.as_near)].T
        spans = [axis.text_of(along) for axis, along in zip(self.axes, values, strict=True)]
        return (
            f"{first} {len(near)} of {len(self.runs)} pairs fit equally well: {' and '.join(spans)}, with mean errors "
            f"up to {max(run.mean_error_mm for run in near):.2f} mm."
        )

    @property
    def exclusion(self) -> str:
        """Sentences about the excluded runs and the reasons for their exclusion."""
        if not self.excluded:
            return f"All {self.total} runs of the study are ranked."
        numbers: dict[str, list[str]] = {}
        for run in self.excluded:
            numbers.setdefault(run.reason.text, []).append(str(run.number))
        reasons = [
            f"Run {', '.join(runs[:NAMED])}{' ...' if len(runs) > NAMED else ''}: {reason}"
            for reason, runs in numbers.items()
        ]
        return f"{len(self.excluded)} of {self.total} runs are not ranked. {' '.join(reasons)}"


def as_near_as_the_best(
    runs: Sequence[HeldRun], readings: Profile, budget: Budget, scatter_mm: float
) -> tuple[bool, ...]:
    """Return True, (runs,), for each run whose mean error cannot be distinguished from the smallest one.

    All runs are compared with the same random readings, drawn from the budget of the readings. An error of the readings
    changes the errors of similar runs equally, so their difference is far more certain than each error. ``scatter_mm``
    is added to each run independently. A run whose mean error is over a third larger than the smallest one never fits
    equally well.
    """
    profiles = [readings, *(run.profile for run in runs)]
    # All stations in the stretch that all profiles share.
    s_mm = np.unique(np.concatenate([profile.s_mm for profile in profiles]))
    low_mm, high_mm = max(profile.s_mm[0] for profile in profiles), min(profile.s_mm[-1] for profile in profiles)
    s_mm = s_mm[(s_mm >= low_mm) & (s_mm <= high_mm)]
    read_mm, *levels_mm = (profile.level_at_mm(s_mm) for profile in profiles)
    off_mm = budget.at_stations_mm[:DRAWS] @ linear_weights(s_mm, readings.s_mm).T - read_mm
    random = np.random.default_rng(0)
    mean_mm = np.array([run.mean_error_mm for run in runs])
    best = int(np.argmin(mean_mm))

    def random_errors(level_mm: Floats) -> Floats:
        return mean_absolute(s_mm, level_mm + off_mm) + scatter_mm * random.standard_normal(len(off_mm))

    least_mm = random_errors(levels_mm[best])
    near = np.array([(random_errors(level_mm) <= least_mm).mean() > CANNOT_TELL for level_mm in levels_mm])
    near &= mean_mm <= FARTHEST_NEAR * mean_mm[best]
    near[best] = True
    return tuple(near.tolist())


def chosen_few(chart: Chart) -> list[HeldRun]:
    """Return about nine runs: the runs nearest to the lowest, best and highest value of each of the two settings.

    If the best run's value is near an end of the range, the middle of the range is used instead.
    """
    places, best = chart.places, int(np.argmin(chart.errors_mm))
    between = np.where((places[best] > 0.1) & (places[best] < 0.9), places[best], 0.5)
    targets = [(across, up) for up in (1.0, between[1], 0.0) for across in (0.0, between[0], 1.0)]
    nearest = [int(((places - target) ** 2).sum(axis=1).argmin()) for target in targets]
    chosen = dict.fromkeys(nearest if best in nearest else [best, *nearest])
    return [chart.runs[index] for index in chosen]


def heat(chart: Chart) -> tuple[Floats, Floats, Floats]:
    """Return values along both axes, (k,) each, and the mean error on their grid, (k, k).

    The error is interpolated between the runs by SciPy's linear griddata. A logarithmic axis is interpolated in its
    logarithm. Outside the convex hull of the runs, the error is NaN.
    """
    from scipy.interpolate import griddata

    lines = [np.linspace(along.min(), along.max(), CELLS) for along in chart.spaced.T]
    grid = tuple(np.meshgrid(*lines))
    error_mm = griddata(chart.spaced, chart.errors_mm, grid, method="linear", rescale=True)
    across, up = (10.0**line if axis.logarithmic else line for axis, line in zip(chart.axes, lines, strict=True))
    return across, up, error_mm


@dataclass(frozen=True)
class Watched:
    """Frames and computing times of a run."""

    frames: tuple[Frame, ...]  # Frames in order of time. The last one is at the end of the run.
    particles: Floats  # Number of moving particles, every few frames, (k,)
    frame_ms: Floats  # Computing time of a frame at the same moments, (k,)


def medians(particles: Floats, frame_ms: Floats) -> Floats:
    """Divide the frames into bins by particles, and return each bin's median number of particles and time, (2, k).

    Medians change little if other programs are running.
    """
    step = np.minimum((particles / particles.max() * STEPS).astype(int), STEPS - 1)
    inside = [step == number for number in range(STEPS) if (step == number).sum() >= FEWEST]
    return np.array([[np.median(values[part]) for part in inside] for values in (particles, frame_ms)])


def pace_of(particles: Floats, frame_ms: Floats) -> tuple[float, float, float] | None:
    """Fit a straight line to the median times by least squares.

    Returns three numbers: the time of a frame without particles in ms, the time that each moving particle adds in µs,
    and R², the fraction of the medians' variance that the line explains. Returns None if there are too few medians.
    """
    from scipy.stats import linregress

    particles, frame_ms = medians(particles, frame_ms)
    if len(particles) < FEWEST:
        return None
    line: Any = linregress(particles, frame_ms)
    return line.intercept, 1000 * line.slope, line.rvalue**2
