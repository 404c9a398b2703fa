"""Compute runs of a study on digitised cracks: inject the sealant, measure the level, compare it, write the results."""

import pickle
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any

from sealtwin.core import files, record_files
from sealtwin.core.cluster import Lost, run_tasks
from sealtwin.core.errors import NumericalError, SealtwinError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile, Run, Sample
from sealtwin.study.estimate import Forecast, Timing, timings_of
from sealtwin.study.study_folder import (
    FILL,
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

SHOWN_EVERY_S = 2.0  # Time between two looks at the progress of runs
MOST_NUMBERS = 8  # Most coefficients of a baseline curve; a sweep of more settings is compared with that curve

SUMMARY = "summary.json"
INPUTS = "inputs"  # Folder of the copied readings, in a run folder


@dataclass(frozen=True)
class Sealing:
    """Result of a run that did not fail: its level, its figures and its computing time."""

    profile: Profile
    figures: RunFigures
    wall_s: float
    run: Run | None  # The particles; None unless they are written too
    fill: bytes | None = None  # Content of fill.npz, if it is written too


@dataclass(frozen=True)
class Computing:
    """Options for computing the waiting runs of a study."""

    device: str
    jobs: int  # Worker processes on this machine; 0 computes in the calling process
    batch: int = 1  # Largest number of runs in one launch
    keep_runs: bool = False
    keep_fills: bool = False  # Keep how the crack fills, of launches of one run by particles
    later_s: float = 0.0  # Expected time of what follows these runs in the command, by the model of ``estimate``
    scheduler: str | None = None  # Address of a Dask scheduler whose workers compute instead
    traced: dict[str, Any] = field(default_factory=dict)  # Of ``Job``, shared by the study's samples


def compute(
    folder: Path,
    runs: Sequence[StudyRun],
    how: Computing,
    title: str,
    progress: Progress,
    timings: Sequence[Timing] = (),
) -> list[StudyRun]:
    """Compute the waiting runs, write each result at once, and return all runs with their outcomes.

    If the process is killed, the next call computes the runs that were not finished. ``timings`` of other runs improve
    the estimate of the remaining time.
    """
    return launch(
        runs,
        how,
        title,
        progress,
        (seal_in_worker, lambda group: _arguments(folder, group, how), partial(_keep, folder)),
        timings,
    )


Work = tuple[
    Callable[..., Sequence[Any]],
    Callable[[Sequence[StudyRun]], tuple[Any, ...]],
    Callable[[StudyRun, Any], StudyRun],
]
"""Function of a worker, which returns an outcome for each run of a launch; function that returns its arguments; and
function that writes an outcome, or that of a lost worker, and returns the run with it."""


def launch(
    runs: Sequence[StudyRun],
    how: Computing,
    title: str,
    progress: Progress,
    work: Work,
    timings: Sequence[Timing] = (),
    left_s: Callable[[StudyRun], float | None] | None = None,
) -> list[StudyRun]:
    """Do ``work`` for the waiting runs, and return all runs with their outcomes. ``timings`` as for ``compute``.

    ``left_s`` returns the remaining time of a run that is being computed, or None if it is unknown; with it, progress
    is shown during the runs too.
    """
    function, arguments, keep = work
    current = {run.key: run for run in runs}
    work_s = sum(run.work_s for run in runs if run.state == "waiting")
    # In hundredths of a second, since a bar counts whole steps.
    progress.start(title, max(1, round(100 * work_s)))
    launches = {group[0].key: group for group in _groups(runs, how.batch)}
    jobs = min(how.jobs, len(launches))
    forecast = Forecast(jobs, [*timings, *timings_of(runs)])
    progress.later(forecast.scaled_s(how.later_s))

    def tasks() -> Iterator[tuple[list[StudyRun], tuple[Any, ...]]]:
        for key, group in [*launches.items()]:
            # A task is read when a local worker takes it. A scheduler's workers, of unknown number, take some ahead.
            if how.scheduler is None:
                forecast.begin(key, time.monotonic())
            yield group, arguments(group)

    def show() -> None:
        now_s = time.monotonic()
        if how.scheduler is None:
            progress.expect(forecast.left_s(launches.values(), now_s))
            progress.later(forecast.scaled_s(how.later_s))
        waiting_s = sum(run.work_s for run in current.values() if run.state == "waiting")
        states = Counter(run.state for run in current.values())
        counts = ", ".join(f"{states[state]} {state}" for state in STATES if state in states)
        running_s = 0.0 if left_s is None else forecast.done_s(launches.values(), now_s)
        # Of a run that is slower than it was thought, less may be done than before.
        reached[0] = max(reached[0], round(100 * (work_s - waiting_s + running_s)))
        progress.advance(reached[0], counts)

    def show_runs() -> None:
        while left_s is not None and not ended.wait(SHOWN_EVERY_S):
            with showing:
                for group in launches.values():
                    forecast.report(group[0].key, left_s(group[0]))
                show()

    reached, ended = [0], Event()
    showing, watching = Lock(), Thread(target=show_runs, daemon=True)
    watching.start()
    try:
        for group, outcomes in run_tasks(function, tasks(), jobs, how.scheduler, own_numbers):
            if isinstance(outcomes, Lost):
                outcomes = [outcomes] * len(group)
            with showing:
                for run, outcome in zip(group, outcomes, strict=True):
                    current[run.key] = keep(run, outcome)
                del launches[group[0].key]
                forecast.finish(group[0].key, (current[run.key] for run in group))
                show()
    finally:
        ended.set()
        watching.join()
    progress.later(0.0)
    return list(current.values())


def seal_in_worker(
    sample: bytes, trials: Sequence[Trial], device: str, keep_runs: bool, keep_fills: bool
) -> list[Sealing | Outcome]:
    """Call ``seal`` with a pickled ``Sample``. A process caches the last sample, with its wall particles."""
    return seal(_unpickled(sample), trials, device=device, keep_runs=keep_runs, keep_fills=keep_fills)


def seal(
    sample: Sample, trials: Sequence[Trial], *, device: str, keep_runs: bool, keep_fills: bool = False
) -> list[Sealing | Outcome]:
    """Compute runs that differ only in the fluid, in one launch. A run's result is the same as in a launch of its own.

    If a launch raises an exception, its runs are computed one by one, and an exception fails only its own run.
    """
    began = time.monotonic()
    # With the explicit solve the stiffest fluid sets the number of passes, which would change the other results.
    if len(trials) == 1 or trials[0].solver.viscosity_solve == "implicit":
        try:
            return [*_seal(sample, trials, device, keep_runs, keep_fills)]
        except Exception as fault:
            if len(trials) == 1:
                return [_failure(fault, time.monotonic() - began)]
    how: dict[str, Any] = {"device": device, "keep_runs": keep_runs, "keep_fills": keep_fills}
    return [outcome for trial in trials for outcome in seal(sample, [trial], **how)]


def _groups(runs: Sequence[StudyRun], batch: int) -> list[list[StudyRun]]:
    """Group the waiting runs into launches of at most ``batch`` runs of equal ``kin``, in the order of the study."""
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
    return sample, trials, how.device, how.keep_runs, how.keep_fills


@lru_cache(maxsize=1)
def _pickled(folder: Path, given: str) -> bytes:
    """Return a digitised sample with its readings, pickled, and cached for the next runs of the same sample.

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
    # The parent process made these bytes and Dask carried them like the task itself; they come from no file.
    return pickle.loads(sample)


def _keep(folder: Path, run: StudyRun, outcome: Sealing | Outcome | Lost) -> StudyRun:
    """Write the files of a run, with its outcome as the last one, and return the run with its outcome."""
    if isinstance(outcome, Lost):
        outcome = Outcome(
            "failed", 0.0, reason=f"{outcome.reason}: repeat the command with fewer --jobs and with --retry."
        )
    home = run_path(folder, run.key)
    if isinstance(outcome, Sealing):
        record_files.write_profile(home, outcome.profile)
        if outcome.run is not None:
            record_files.write_run(home, outcome.run)
        if outcome.fill is not None:
            files.write_bytes(home / FILL, outcome.fill)
        figures = outcome.figures.model_dump(exclude_unset=True)
        files.write_json(home / SUMMARY, {"settings": run.settings, "figures": figures})
        hashed = StudyFigures(**figures, profile_sha256=files.sha256(home / PROFILE))
        outcome = Outcome("done", outcome.wall_s, figures=hashed)
    write_outcome(folder, replace(run, **vars(replace(outcome, finished_unix_s=time.time()))))
    return with_outcome(folder, run)


def _seal(
    sample: Sample, trials: Sequence[Trial], device: str, keep_runs: bool, keep_fills: bool
) -> list[Sealing | Outcome]:
    """Compute one launch. Raises InputError if settings of a run cannot be used, and NumericalError if all diverge."""
    from sealtwin.study.kept_fill import KeptFill
    from simulate.run import fill_each

    began, first = time.monotonic(), trials[0]
    kept = (
        KeptFill(first.output.snapshots_s) if keep_fills and len(trials) == 1 and first.solver.has_particles else None
    )
    fluids, how = [trial.given_fluid for trial in trials], {"device": device, "slope": first.sample}
    watchers = () if kept is None else (kept,)
    outcomes = fill_each(sample, fluids, first.solver, first.nozzle, seed=first.seed, watchers=watchers, **how)
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
            particles, fill = run if keep_runs else None, None if kept is None else kept.content()
            judged.append(Sealing(profile, figures, launch_s + time.monotonic() - began, particles, fill))
    return judged


def _figures(run: Run) -> dict[str, Any]:
    """Return the figures of a run. Raises NumericalError if a particle went through a wall."""
    from validate.run_facts import fluid_warnings

    if run.escaped_particles:
        raise NumericalError(
            f"{run.escaped_particles} particles went through a wall, which must never happen; the results of this run "
            "are discarded. Please report it with its settings."
        )
    names = ("particles", "escaped_particles", "spilled_particles")
    counts = {name: getattr(run, name) for name in names} if run.has_particles else {"unfit": run.unfit}
    ratio = run.health.volume_ratio
    warnings = () if ratio is None else fluid_warnings(run, ratio)
    return {**counts, "volume_ratio": ratio, "fluid_warnings": warnings, "health": run.health}


def _compared(sample: Sample, trial: Trial, profile: Profile) -> dict[str, Any]:
    """Return the errors of a run's level against the readings; empty if there are no readings."""
    if trial.readings is None or sample.readings is None:
        return {}
    from validate.compare import compare
    from validate.metrics.baselines import best_curves

    crack, role = (sample.outline, sample.solid), trial.readings.role
    comparison = compare(profile, sample.readings, *crack, role=role, photo_data=trial.shown_by.data)
    stretch_mm = comparison.basis.covered_from_mm, comparison.basis.covered_to_mm
    curves = best_curves(sample.readings, *stretch_mm, range(1, MOST_NUMBERS + 1))
    figures = vars(comparison.errors) | {"stations_compared": comparison.basis.stations_compared, "baselines": curves}
    return {name: figures[name] for name in RunErrors.model_fields}


def _failure(fault: Exception, wall_s: float) -> Outcome:
    if isinstance(fault, SealtwinError):
        return Outcome("failed", wall_s, reason=str(fault))
    reason = f"{type(fault).__name__}: {fault}. A bug: please report it with the trace in the run's {OUTCOME}."
    return Outcome("failed", wall_s, reason=reason, trace="".join(traceback.format_exception(fault)))
