"""Runs of a study on cracks that are digitised already: inject, measure, compare, and keep the results."""

import pickle
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from sealtwin.core import files, record_files
from sealtwin.core.cluster import Lost, run_tasks
from sealtwin.core.errors import NumericalError, SealtwinError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile, Run, Sample
from sealtwin.study.estimate import Forecast, Timing, timings_of
from sealtwin.study.study_folder import (
    OUTCOME,
    PROFILE,
    STATES,
    Outcome,
    RunErrors,
    RunFigures,
    StudyFigures,
    StudyRun,
    run_path,
    with_outcome,
    write_outcome,
)
from sealtwin.trial.stage_numbers import own_numbers
from sealtwin.trial.trial_file import Trial
from validate.settings import Readings

MOST_NUMBERS = 8  # Of the curves that a run is held against; a sweep that varies more settings names the last

SUMMARY = "summary.json"
INPUTS = "inputs"  # Folder in a run folder that holds the copy of the readings


@dataclass(frozen=True)
class Sealing:
    """The measured result of a run."""

    profile: Profile
    figures: RunFigures
    wall_s: float
    run: Run | None  # The particles, if they are to be kept


@dataclass(frozen=True)
class Computing:
    """Options for computing the waiting runs of a study."""

    device: str
    jobs: int  # Worker processes on this machine; 0 computes in the calling process
    batch: int = 1  # Largest number of runs in one launch
    keep_runs: bool = False
    scheduler: str | None = None  # Address of a Dask scheduler whose workers compute instead


def compute(
    folder: Path,
    runs: Sequence[StudyRun],
    how: Computing,
    title: str,
    progress: Progress,
    timings: Sequence[Timing] = (),
) -> list[StudyRun]:
    """Compute the runs that wait, write each result as soon as it is there, and return all runs with their outcomes.

    Runs that were computed when a process was killed are computed again by the next call. ``timings`` are of other
    runs, for the time that these will take.
    """
    current = {run.key: run for run in runs}
    work_s = sum(run.work_s for run in runs if run.state == "waiting")
    # Hundredths, since a bar counts in whole steps.
    progress.start(title, max(1, round(100 * work_s)))
    left = {group[0].key: group for group in _groups(runs, how.batch)}
    jobs = min(how.jobs, len(left))
    forecast = Forecast(jobs, [*timings, *timings_of(runs)])

    def tasks() -> Iterator[tuple[list[StudyRun], tuple[Any, ...]]]:
        for key, group in [*left.items()]:
            # It is read when a worker takes it, except by the workers of a scheduler, whose number is not known here.
            if how.scheduler is None:
                forecast.begin(key, time.monotonic())
            yield group, _arguments(folder, group, how)

    for group, outcomes in run_tasks(seal_in_worker, tasks(), jobs, how.scheduler, own_numbers):
        if isinstance(outcomes, Lost):
            outcomes = [Outcome("failed", 0.0, reason=f"{outcomes.reason}: give fewer --jobs, and --retry.")] * len(
                group
            )
        for run, outcome in zip(group, outcomes, strict=True):
            current[run.key] = _keep(folder, run, outcome)
        del left[group[0].key]
        forecast.finish(group[0].key, (current[run.key] for run in group))
        if how.scheduler is None:
            progress.expect(forecast.left_s(left.values(), time.monotonic()))
        left_s = sum(run.work_s for run in current.values() if run.state == "waiting")
        states = [run.state for run in current.values()]
        told = ", ".join(f"{states.count(state)} {state}" for state in STATES if state in states)
        progress.advance(round(100 * (work_s - left_s)), told)
    return list(current.values())


def seal_in_worker(sample: bytes, trials: Sequence[Trial], device: str, keep_runs: bool) -> list[Sealing | Outcome]:
    """Call ``seal`` with a pickled ``Sample``, of which a process keeps the last with the walls that it made."""
    return seal(_unpickled(sample), trials, device=device, keep_runs=keep_runs)


def seal(sample: Sample, trials: Sequence[Trial], *, device: str, keep_runs: bool) -> list[Sealing | Outcome]:
    """Compute runs that differ in their fluids alone in one launch, each with the result that it has alone.

    An exception becomes the failure of the run that caused it; the others are then computed one by one.
    """
    began = time.monotonic()
    # Explicit passes are as many as the stiffest of a launch needs, which is another result for the others.
    if len(trials) == 1 or trials[0].solver.viscosity_solve == "implicit":
        try:
            return [*_seal(sample, trials, device, keep_runs)]
        except Exception as fault:
            if len(trials) == 1:
                return [_failure(fault, time.monotonic() - began)]
    return [outcome for trial in trials for outcome in seal(sample, [trial], device=device, keep_runs=keep_runs)]


def _groups(runs: Sequence[StudyRun], batch: int) -> list[list[StudyRun]]:
    """Waiting runs in launches of at most ``batch`` that differ in the fluid alone, in the order of the study."""
    alike: dict[str, list[StudyRun]] = {}
    for run in runs:
        if run.state == "waiting":
            alike.setdefault(run.kin, []).append(run)
    groups = [kin[start : start + batch] for kin in alike.values() for start in range(0, len(kin), batch)]
    return sorted(groups, key=lambda group: group[0].number)


def _arguments(folder: Path, group: Sequence[StudyRun], how: Computing) -> tuple[Any, ...]:
    trials = [run.checked_trial for run in group]
    readings = trials[0].readings
    sample = _pickled(folder / "samples" / group[0].sample, "" if readings is None else readings.model_dump_json())
    return sample, trials, how.device, how.keep_runs


@lru_cache(maxsize=1)
def _pickled(folder: Path, given: str) -> bytes:
    """Return a digitised sample with its readings, pickled; runs of one sample mostly follow each other.

    Raises InputError if a file is missing or cannot be read.
    """
    sample = record_files.read_sample(folder)
    if given:
        from validate.readings.read_readings import read_readings

        settings = Readings.model_validate_json(given)
        sheet = folder / INPUTS / settings.file.name
        readings = read_readings(sheet, settings, sample.outline.length_mm, sample.solid.depth_mm)
        sample = replace(sample, readings=readings)
    return pickle.dumps(sample)


@lru_cache(maxsize=1)
def _unpickled(sample: bytes) -> Sample:
    # Made by this sweep's parent and carried by Dask like the task itself: no file is read.
    return pickle.loads(sample)


def _keep(folder: Path, run: StudyRun, outcome: Sealing | Outcome) -> StudyRun:
    """Write the files of a run, its outcome last."""
    home = run_path(folder, run.key)
    if isinstance(outcome, Sealing):
        record_files.write_profile(home, outcome.profile)
        if outcome.run is not None:
            record_files.write_run(home, outcome.run)
        figures = outcome.figures.model_dump(exclude_unset=True)
        files.write_json(home / SUMMARY, {"settings": run.settings, "figures": figures})
        hashed = StudyFigures(**figures, profile_sha256=files.sha256(home / PROFILE))
        outcome = Outcome("done", outcome.wall_s, figures=hashed)
    write_outcome(folder, replace(run, **vars(replace(outcome, finished_unix_s=time.time()))))
    return with_outcome(folder, run)


def _seal(sample: Sample, trials: Sequence[Trial], device: str, keep_runs: bool) -> list[Sealing | Outcome]:
    """Compute one launch. Raises InputError from one of the runs, and NumericalError if all diverge."""
    from simulate.run import fill_each

    began, first = time.monotonic(), trials[0]
    fluids, how = [trial.given_fluid for trial in trials], {"device": device, "slope": first.sample}
    outcomes = fill_each(sample, fluids, first.solver, first.nozzle, seed=first.seed, **how)
    launch_s = (time.monotonic() - began) / len(trials)
    judged: list[Sealing | Outcome] = []
    for trial, outcome in zip(trials, outcomes, strict=True):
        began = time.monotonic()
        try:
            if isinstance(outcome, NumericalError):
                raise outcome
            run, profile = outcome
            figures = RunFigures(**_figures(run), **_compared(sample, trial, profile))
        except SealtwinError as fault:
            judged.append(_failure(fault, launch_s + time.monotonic() - began))
        else:
            judged.append(Sealing(profile, figures, launch_s + time.monotonic() - began, run if keep_runs else None))
    return judged


def _figures(run: Run) -> dict[str, Any]:
    """Return the figures of a run. Raises NumericalError if a particle went through a wall."""
    from validate.wording.headline import fluid_warnings

    if run.escaped_particles:
        raise NumericalError(
            f"{run.escaped_particles} particles went through a wall, which must never happen; no number of this run is "
            "kept. Please report it with its settings."
        )
    names = ("particles", "escaped_particles", "spilled_particles")
    counts = {name: getattr(run, name) for name in names} if run.has_particles else {"unfit": run.unfit}
    ratio = run.health.volume_ratio
    warnings = () if ratio is None else fluid_warnings(run, ratio)
    return {**counts, "volume_ratio": ratio, "fluid_warnings": warnings, "health": run.health}


def _compared(sample: Sample, trial: Trial, profile: Profile) -> dict[str, Any]:
    """Return the figures of a run against the readings; none without them."""
    if trial.readings is None or sample.readings is None:
        return {}
    from validate.compare import compare
    from validate.metrics.baselines import best_curves

    crack, role = (sample.outline, sample.solid), trial.readings.role
    comparison = compare(profile, sample.readings, *crack, role=role, photo_data=trial.shown_by.data)
    stretch_mm = comparison.covered_from_mm, comparison.covered_to_mm
    curves = best_curves(sample.readings, *stretch_mm, range(1, MOST_NUMBERS + 1))
    return {**{name: getattr(comparison, name) for name in RunErrors.model_fields}, "baselines": curves}


def _failure(fault: Exception, wall_s: float) -> Outcome:
    if isinstance(fault, SealtwinError):
        return Outcome("failed", wall_s, reason=str(fault))
    reason = f"{type(fault).__name__}: {fault}. A bug: please report it with the trace in the run's {OUTCOME}."
    return Outcome("failed", wall_s, reason=reason, trace="".join(traceback.format_exception(fault)))
