"""Choose and compute the runs of a calibration step by step, until the budget of runs is used.

The first sixteen runs are points of a Sobol sequence, and one of them is repeated with three more seeds. Each further
round computes three draws of the posterior: the most likely draw, and the draws at which the emulator is least certain.
At the end, three runs with new seeds confirm the most likely settings. The emulator models the profile, not its error
(Astudillo and Frazier 2019, Proc. Mach. Learn. Res. 97:354). A ``Twin`` runs a trial with other settings, in a folder
that is built like the folder of a study.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core import record_files
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.records import DataKind, Floats
from sealtwin.core.run_figures import RunHealth
from sealtwin.core.settings import checked, without_none
from sealtwin.study import study_folder
from sealtwin.study.runner import StudyOptions
from sealtwin.study.study_file import PlannedRun
from sealtwin.study.sweep import adopt, brought_up_to_date
from sealtwin.trial.job import check_sheet, require_sample
from sealtwin.trial.trial_file import SettingValues, Trial, as_run, load_trial, refuse_seeds, with_settings
from validate.calibration.emulator import Emulator
from validate.calibration.posterior import BasisReach, Free, Posterior, ReadLevels, reach_of, smooth_errors_mm2
from validate.metrics.curve_distances import are_compared
from validate.metrics.verdict import kept_volume
from validate.settings import Readings
from validate.uncertainty.computed import require_different

FIRST, AGAIN, ROUND, CONFIRM = 16, 3, 3, 3
"""Numbers of runs: in the first design, of one of these runs with further seeds, in a round, and to confirm the
result."""
FEWEST = FIRST + AGAIN + ROUND + CONFIRM
STOP_IMPLAUSIBILITY = 3.0
"""Implausibility of the best settings above which the search stops early.

It is larger than 1, because an emulator of few runs is overconfident. One of four searches with drafts began at 2.0,
although the readings were from a run of the same paste."""
MIN_USABLE = 0.75  # Smallest allowed fraction of runs with a valid result
DRAWS, STEPS, STEPS_OF_A_ROUND = 500, 1200, 200

Setting = dict[str, float]
Levels = Sequence[Floats | None]  # Level of each run at the stations, or None for a run that is not used
Runner = Callable[[Sequence[tuple[Setting, int]]], Levels]
"""Function that computes runs. Its argument lists, for each run so far, the settings and a number that is added to the
seed. The function computes only new runs, and returns the levels at the stations, or None for a run that is not
used."""


@dataclass
class WorkAhead:
    """Estimated time of the work of a command that has not begun."""

    model_s: float = 0.0


@dataclass(frozen=True)
class Source:
    """A trial whose readings are used for the calibration."""

    name: str
    evidence: ReadLevels
    run: Runner


@dataclass(frozen=True)
class SearchResult:
    frees: Sequence[Free]
    points: Floats  # Points of all runs in the unit cube, (r, d)
    levels_mm: Sequence[Levels]  # Levels of the runs, for each trial
    reaches: Sequence[BasisReach]
    posterior: Posterior
    least_implausibility: float
    draws: Floats | None  # Posterior draws in the unit cube, (500, d). None if no settings reproduce the readings
    mixing: float = 1.0
    best: Floats = field(default_factory=lambda: np.zeros(0))  # Most likely point in the unit cube, (d,)

    @property
    def possible(self) -> bool:
        return self.draws is not None

    @property
    def discrepancy_mm(self) -> float | None:
        """Posterior mean of the standard deviation of the model error. None if only one trial was used."""
        if self.draws is None or len(self.levels_mm) < 2:
            return None
        logs = self.posterior.log_densities(self.draws)
        chance = np.exp(logs - np.logaddexp.reduce(logs, axis=0)).mean(axis=1)
        return float(chance @ self.posterior.discrepancies_mm)

    def confirmed_mm(self, trial: int) -> Floats:
        """Return the levels of the runs that confirm the best settings, for m finished runs and n stations, (m, n)."""
        return np.array([level for level in self.levels_mm[trial][-CONFIRM:] if level is not None])


class _Search:
    def __init__(self, frees: Sequence[Free], sources: Sequence[Source]) -> None:
        self.frees, self.sources = frees, sources
        self.points = np.zeros((0, len(frees)))
        self.levels_mm: list[Levels] = [[] for _ in sources]

    def run(self, points: Floats) -> None:
        self.points = np.vstack([self.points, points])
        wanted = [(settings_at(self.frees, point), seed) for seed, point in enumerate(self.points)]
        self.levels_mm = [source.run(wanted) for source in self.sources]
        for source, levels_mm in zip(self.sources, self.levels_mm, strict=True):
            failed = sum(level is None for level in levels_mm)
            if failed > (1 - MIN_USABLE) * max(FIRST, len(levels_mm)):
                raise NumericalError(
                    f"{source.name}: {failed} of {len(levels_mm)} runs failed or have a volume error above 5 %, so too "
                    "few runs remain to cover the ranges. Give narrower ranges, or use smaller particles."
                )
            for point in np.unique(self.points, axis=0):
                alike = np.flatnonzero((self.points == point).all(axis=1)).tolist()
                again = {f"{number + 1} (seed + {number})": levels_mm[number] for number in alike}
                done = without_none(again)
                require_different(done.values(), list(done), source.name)

    def posterior(self) -> tuple[Posterior, list[BasisReach]]:
        emulators, reaches = [], []
        for source, all_mm in zip(self.sources, self.levels_mm, strict=True):
            done = [number for number, level_mm in enumerate(all_mm) if level_mm is not None]
            points, levels_mm = self.points[done], np.array([all_mm[number] for number in done])
            reach = reach_of(points, levels_mm, source.evidence)
            emulators.append(Emulator.fitted(points, levels_mm, reach.components))
            reaches.append(reach)
        return Posterior(self.frees, emulators, [source.evidence for source in self.sources]), reaches

    def nearest(self) -> int:
        """Return the index of the run whose levels are nearest to all readings, weighted by their covariance."""
        total = np.zeros(len(self.points))
        for levels_mm, source in zip(self.levels_mm, self.sources, strict=True):
            root = np.linalg.cholesky(source.evidence.covariance_mm2)
            for number, level_mm in enumerate(levels_mm):
                off = np.inf if level_mm is None else np.linalg.solve(root, level_mm - source.evidence.level_mm)
                total[number] += np.sum(np.square(off))
        return int(total.argmin())

    def next_round(self, posterior: Posterior, count: int) -> Floats:
        """Return ``count`` points for the next runs, (count, d).

        The first point is the most likely draw. Each further point is the draw at which the emulators are least
        certain, if the runs at the points before it are assumed to be computed.
        """
        posterior = replace(posterior, smooth=False)
        draws, _ = posterior.draws(DRAWS, STEPS_OF_A_ROUND)
        chosen = [draws[posterior.log_density(draws).argmax()]]
        while len(chosen) < count:
            open_mm2 = np.zeros(len(draws))
            for emulator in posterior.emulators:
                relative = emulator.scatter.relative(np.array(chosen))
                _, variance = emulator.processes.with_points(np.array(chosen), relative).predicted(draws)
                open_mm2 += variance.sum(axis=1)
            chosen.append(draws[open_mm2.argmax()])
        return np.array(chosen)


def settings_at(frees: Sequence[Free], point: Floats) -> Setting:
    """Return the settings at a point of the unit cube. Values are rounded to six digits, which is easy to read."""
    return {free.name: float(f"{free.values(share):.6g}") for free, share in zip(frees, point, strict=True)}


def search(frees: Sequence[Free], sources: Sequence[Source], budget: int, say: Callable[[str], None]) -> SearchResult:
    """Compute ``budget`` runs of each trial, at least ``FEWEST``, and return the posterior.

    ``say`` is called with a sentence about the progress. The search stops early if no settings in the ranges, or no
    combination of the runs' levels, can reproduce the readings. The search is deterministic. Raises NumericalError if
    more than a quarter of the runs cannot be used.
    """
    from scipy.stats import qmc

    state = _Search(frees, sources)
    state.run(qmc.Sobol(len(frees), rng=0).random(FIRST))
    state.run(np.repeat(state.points[[state.nearest()]], AGAIN, axis=0))
    posterior, reaches = state.posterior()
    while len(state.points) < budget - CONFIRM and posterior.least_implausibility <= STOP_IMPLAUSIBILITY:
        error = f"the implausibility of the best settings is {posterior.least_implausibility:.2f} (plausible up to 1)"
        say(f"{len(state.points)} of {budget} runs: {error}.")
        state.run(state.next_round(posterior, min(ROUND, budget - CONFIRM - len(state.points))))
        posterior, reaches = state.posterior()
    least = posterior.least_implausibility
    if least > 1 or not all(reach.possible for reach in reaches):
        return SearchResult(frees, state.points, state.levels_mm, reaches, posterior, least, None)
    best = state.next_round(posterior, 1)[0]
    state.run(np.tile(best, (CONFIRM, 1)))
    posterior, reaches = state.posterior()
    draws, mixing = posterior.draws(DRAWS, STEPS)
    return SearchResult(frees, state.points, state.levels_mm, reaches, posterior, least, draws, mixing, best)


JITTER_MM2 = 1e-6  # Variance in mm2 that makes the covariance of readings without a stated error invertible
SEEDS = 2**31


class Twin:
    """A digitised trial with its readings and the runs that have been computed."""

    def __init__(
        self,
        file: Path,
        library: Path,
        options: StudyOptions,
        progress: Progress,
        settings: SettingValues | None = None,
        drafts: int = 0,
    ) -> None:
        """Digitise the crack and read the sheet. The first ``drafts`` runs may be drafts.

        Raises the same errors as a sweep, and InputError if the trial has no readings.
        """
        from validate.readings.read_readings import read_readings
        from validate.uncertainty.meniscus import Mouth
        from validate.uncertainty.reading_errors import budget_of

        self.file, self._options, self._progress = file, options, progress
        self._first_accurate, self._done, self.ahead = drafts + 1, 0, WorkAhead()
        trial = load_trial(file, settings)
        sheet_settings = fit_to_calibrate(file, trial)
        self.trial = trial.loaded(file.parent)
        self.data: DataKind = sheet_settings.data
        self._content = self.trial.model_dump(mode="json", exclude_none=True, exclude={"readings", "gate"})
        self._content["fluid"].pop("material", None)
        self.folder = library / self.trial.folder_name
        adopt(self.folder, self.trial.name)
        kinds = [self._planned(number, {}, 0, accurate=accurate) for number, accurate in ((1, False), (2, True))]
        self.plan = self._plan(kinds, dry_run=True)
        self._work_s = [run.work_s for run in self.plan.runs]
        draft, accurate = self.plan.runs
        self.drafts = draft.key != accurate.key
        """True if some of the runs are drafts. False if all runs are accurate, or if the trial's preset is not
        "accurate"."""
        self._sample = record_files.read_sample(self.folder / "samples" / draft.sample)
        self.outline, self.solid = self._sample.outline, self._sample.solid
        self.sheet = file.parent / sheet_settings.path
        self.readings = read_readings(self.sheet, sheet_settings, crack=(self.outline, self.solid))
        s_mm = self.readings.s_mm
        mouth = Mouth.of(self.outline, self.solid, self.trial.given_fluid.density_kg_m3)
        budget = budget_of(self.readings, sheet_settings, self.trial.uncertainty, mouth)
        errors_mm = budget.at_stations_mm
        covariance_mm2 = np.cov(errors_mm.T) + JITTER_MM2 * np.eye(len(s_mm))
        # A reading is the level plus an error. The mean of the error may differ from 0, so it is subtracted.
        level_mm, path = self.readings.level_mm - errors_mm.mean(axis=0), self._sample.trajectory
        poured_mm = path.s_mm[path.giving]
        path_mm = float(poured_mm.min()), float(poured_mm.max())
        self.evidence = ReadLevels(s_mm, level_mm, covariance_mm2, smooth_errors_mm2(s_mm, path_mm))

    @property
    def name(self) -> str:
        return self.trial.name

    @property
    def radius_mm(self) -> float:
        """Particle radius of the runs that confirm the result. They are drafts only if the trial is a draft."""
        return as_run(self._planned(1, {}, 0).trial, self._sample).solver.size_mm

    def require(self, frees: Sequence[Free]) -> None:
        """Raise InputError if an end of a free setting's range is not allowed for this trial."""
        for free in frees:
            for end in (free.low, free.high):
                self._planned(1, {free.name: end}, 0)

    def work_s(self, done: int, end: int) -> float:
        """Return the estimated time in s of the runs after ``done`` up to ``end``."""
        return self._work_s[end >= self._first_accurate] * (end - done) / max(1, self._options.jobs)

    def run(self, wanted: Sequence[tuple[Setting, int]]) -> Levels:
        """Compute the runs that are not done. Return the levels at the stations, or None for a run that is not used.

        ``wanted`` begins with the runs of the last call.
        """
        self.ahead.model_s -= self.work_s(self._done, len(wanted))
        self._done = len(wanted)
        self._options = replace(self._options, later_s=self.ahead.model_s)
        planned = [
            self._planned(number, setting, seed, accurate=number >= self._first_accurate)
            for number, (setting, seed) in enumerate(wanted, start=1)
        ]
        self.plan = self._plan(planned)
        runs = {run.number: run for run in self.plan.runs}
        return [self._level_mm(runs[run.number]) for run in planned]

    def unused(self) -> list[tuple[int, str]]:
        """Return the number of each run that is not used, and the reason."""
        reasons = []
        for run in self.plan.runs:
            if run.state == "failed":
                reasons.append((run.number, run.reason or "failed"))
            elif run.figures is not None and not kept_volume(run.figures.volume_ratio):
                reasons.append((run.number, f"the volume error is above 5 % (ratio {run.figures.volume_ratio:.3f})"))
        return reasons

    @property
    def stations(self) -> int:
        """Number of stations within the length of the crack."""
        return int(are_compared(self.readings.s_mm, 0.0, self.outline.length_mm).sum())

    @property
    def fluid_warnings(self) -> list[str]:
        """Warnings about the fluid in this trial's runs."""
        return [f"{self.name}: {sentence}" for sentence in study_folder.fluid_warnings(self.plan.runs)]

    @property
    def health(self) -> RunHealth:
        """Numerical health of the last run.

        If that run failed, the health of a run with another seed and the same settings. Empty if all these runs failed.
        """
        last = max(self.plan.runs, key=lambda run: run.number)
        alike = [run for run in self.plan.runs if run.settings | {"seed": 0} == last.settings | {"seed": 0}]
        figures = [run.figures for run in sorted(alike, key=lambda run: run.number) if run.figures is not None]
        return figures[-1].health if figures else RunHealth()

    def _plan(self, planned: Sequence[PlannedRun], *, dry_run: bool = False) -> study_folder.Plan:
        options = replace(self._options, dry_run=dry_run)
        return brought_up_to_date(self.name, planned, self.file.parent, self.folder, options, self._progress, part=True)

    def _planned(self, number: int, settings: Setting, seed: int, *, accurate: bool = False) -> PlannedRun:
        changes: dict[str, Any] = dict(settings)
        if (start_mm := changes.get("path.trim_mm")) is not None:
            near_mm, far_mm = self.trial.path.trims_mm
            changes["path.trim_mm"] = [near_mm, start_mm] if self.trial.path.reverse else [start_mm, far_mm]
        changes["seed"] = (self.trial.seed + seed) % SEEDS
        trial = checked(Trial, self.file, with_settings(self._content, changes))
        return PlannedRun(number, changes, trial, accurate)

    def _level_mm(self, run: study_folder.StudyRun) -> Floats | None:
        if run.figures is None or not kept_volume(run.figures.volume_ratio):
            return None
        profile = study_folder.read_level(self.folder, run)
        return profile.level_at_mm(self.evidence.s_mm)


def fit_to_calibrate(file: Path, trial: Trial) -> Readings:
    """Return the settings of a trial's readings. Raises InputError if a calibration cannot use the trial."""
    refuse_seeds(trial, file)
    if trial.fluid is None:
        raise InputError(f"{file}: there is no table [fluid]. Give viscosity_pa_s, or U and D_cm.")
    if trial.readings is None:
        raise InputError(
            f"{file}: there is no table [readings]. Add it, since all trials of a calibration need readings."
        )
    if not trial.solver.has_particles:
        raise InputError(
            f'{file}: solver.model is "{trial.solver.model}", but a calibration requires "particles". Set this value.'
        )
    require_sample(trial, file.parent)
    check_sheet(file.parent / trial.readings.path, trial.readings)
    return trial.readings
