"""Compute runs of a study on digitised cracks: inject the sealant, measure the level, compare it, write the results."""

import pickle
import shutil
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any

from sealtwin.core import files, record_files
from sealtwin.core.cluster import Lost, run_tasks
from sealtwin.core.errors import InputError, NumericalError, SealtwinError
from sealtwin.core.facts import Fact
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile, Run, Sample
from sealtwin.core.run_folder import content_key, stage_key
from sealtwin.study.estimate import (
    Forecast,
    RunSize,
    Timing,
    checked_size,
    estimate,
    require_disk,
    require_memory,
    timings_of,
)
from sealtwin.study.study_file import raise_faults
from sealtwin.study.study_folder import (
    FILL,
    OUTCOME,
    PROFILE,
    STATES,
    Outcome,
    Plan,
    RunErrors,
    RunFigures,
    StudyFigures,
    StudyRun,
    resume,
    run_path,
    with_outcome,
    write_outcome,
)
from sealtwin.trial.job import DIGITISED, own_numbers, shown, stage_settings
from sealtwin.trial.trial_file import Trial
from validate.run_facts import facts_of_runs
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
    fill: bytes | None = None  # Content of fill.npz, if it is written too


@dataclass(frozen=True)
class StudyOptions:
    """Options for computing the waiting runs of a study."""

    device: str
    jobs: int  # Worker processes on this machine; 0 computes in the calling process
    batch: int = 1  # Largest number of runs in one launch
    keep_fills: bool = False  # Keep how the crack fills, of launches of one run by particles
    later_s: float = 0.0  # Expected time of what follows these runs in the command, by the model of ``estimate``
    scheduler: str | None = None  # Address of a Dask scheduler whose workers compute instead
    retry: bool = False  # Compute failed runs again
    dry_run: bool = False
    drafts: bool = True  # Compute drafts of the trials, unless the study or the caller sets the solver's resolution
    traced: dict[str, Any] = field(default_factory=dict)  # Of ``Job``, shared by the study's samples


@dataclass(frozen=True)
class WantedRun:
    """A run that a study wants. Its sample is in a folder below samples/."""

    number: int  # Position in the study, from 1
    settings: dict[str, Any]  # Varied settings
    trial: Trial
    sample: Sample
    home: str  # Name of the sample's folder
    inputs: Mapping[str, str]  # Hashes of the files that the run depends on
    depends: Mapping[str, Any]  # What it depends on besides the files, the device and the settings of its stage


def schedule(
    wanted: Sequence[WantedRun], device: str, numbers: Mapping[str, int]
) -> tuple[list[StudyRun], RunSize, list[Fact]]:
    """Return the runs with their keys, the size of the largest, and doubts about them.

    Raises InputError, with each fault and the numbers of its runs, if settings do not fit a crack.
    """
    runs, sizes = list[StudyRun](), list[RunSize]()
    doubts, faults = dict[int, list[Fact]](), dict[str, list[int]]()
    for run in wanted:
        try:
            size, doubts[run.number] = checked_size(run.trial.pour(run.sample))
        except InputError as fault:
            faults.setdefault(str(fault), []).append(run.number)
            continue
        settings = stage_settings(run.trial, "simulate")
        key = stage_key(run.inputs, {**settings, **run.depends, "device": device}, numbers)
        kin = content_key({**settings, "fluid": None, "bench": run.home, "substeps": size.substeps})
        runs.append(StudyRun(run.number, key, run.settings, run.trial.content, run.home, kin, size.work_s))
        sizes.append(size)
    raise_faults(faults)
    largest = max(sizes, key=lambda size: (size.particles, size.bytes))
    return runs, largest, facts_of_runs(doubts, len(runs))


def write_sample(folder: Path, run: WantedRun) -> None:
    """Write the sample of a run that was not digitised in its folder, unless it is there."""
    home = folder / "samples" / run.home
    if not all((home / file).is_file() for file in DIGITISED):
        record_files.write_sample(home, run.sample)


def bring_up_to_date(
    folder: Path,
    plan: Plan,
    largest: RunSize,
    options: StudyOptions,
    progress: Progress,
    title: str,
    announced: str = "",
    doubts: Sequence[Fact] = (),
    timings: Sequence[Timing] = (),
) -> Plan:
    """Compute the runs of a plan that are not done, unless it is a dry run, and return the plan with all outcomes.

    ``announced`` precedes a note on the resources that the runs need; nothing is noted if it is empty. ``timings`` of
    other runs improve the estimate.

    Raises InputError if disk or GPU are too small.
    """
    from simulate.device import free_bytes

    runs = resume(folder, plan, progress.note, retry=options.retry)
    expected = estimate(runs, largest, options.jobs, options.batch, timings)
    if announced and (expected.runs or options.dry_run):
        progress.note(f"{announced} {expected.sentence}")
    for doubt in doubts if expected.runs else ():
        progress.warn(doubt)
    require_disk(expected, shutil.disk_usage(folder).free, shown(folder))
    if options.scheduler is None and options.device:
        require_memory(expected, free_bytes(options.device), options.device, options.batch)
    if expected.runs and not options.dry_run:
        runs = compute(folder, runs, options, title, progress, timings)
    return replace(plan, runs=runs)


def require_done(folder: Path, runs: Sequence[StudyRun], so: str) -> None:
    """Raise NumericalError if a run failed, which names each with its reason. ``so`` is the consequence."""
    if failed := [run for run in runs if run.state == "failed"]:
        reasons = "\n".join(f"{words_of(run.settings)}: {run.reason}" for run in failed)
        raise NumericalError(
            f"{folder}: {len(failed)} of {len(runs)} runs failed, so {so}. The same command tries only these again.\n"
            f"{reasons}"
        )


def words_of(settings: Mapping[str, Any]) -> str:
    """Describe a run by the settings that vary: values, or how far a seed or an input is moved."""
    return ", ".join(
        f"{name} = {value}" if "." in name or isinstance(value, str) else f"{name} {value:+g} from the trial's"
        for name, value in settings.items()
    )


def compute(
    folder: Path,
    runs: Sequence[StudyRun],
    options: StudyOptions,
    title: str,
    progress: Progress,
    timings: Sequence[Timing] = (),
) -> list[StudyRun]:
    """Compute the waiting runs, write each result at once, and return all runs with their outcomes.

    If the process is killed, the next call computes the runs that were not finished. ``timings`` of other runs improve
    the estimate of the remaining time.
    """
    shared = replace(options, traced={})
    work = seal_in_worker, lambda group: (*_inputs(folder, group), shared), partial(_keep, folder)
    return launch(runs, options, title, progress, work, timings)


Work = tuple[
    Callable[..., Sequence[Any]],
    Callable[[Sequence[StudyRun]], tuple[Any, ...]],
    Callable[[StudyRun, Any], StudyRun],
]
"""Function of a worker, which returns an outcome for each run of a launch; function that returns its arguments; and
function that writes an outcome, or that of a lost worker, and returns the run with it."""


def launch(
    runs: Sequence[StudyRun],
    options: StudyOptions,
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
    launches = {group[0].key: group for group in _groups(runs, options.batch)}
    jobs = min(options.jobs, len(launches))
    forecast = Forecast(jobs, [*timings, *timings_of(runs)])
    progress.later(forecast.scaled_s(options.later_s))

    def tasks() -> Iterator[tuple[list[StudyRun], tuple[Any, ...]]]:
        for key, group in [*launches.items()]:
            # A task is read when a local worker takes it. A scheduler's workers, of unknown number, take some ahead.
            if options.scheduler is None:
                forecast.begin(key, time.monotonic())
            yield group, arguments(group)

    def show() -> None:
        now_s = time.monotonic()
        if options.scheduler is None:
            progress.expect(forecast.left_s(launches.values(), now_s))
            progress.later(forecast.scaled_s(options.later_s))
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
        for group, outcomes in run_tasks(function, tasks(), jobs, options.scheduler, own_numbers):
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


def seal_in_worker(sample: bytes, trials: Sequence[Trial], options: StudyOptions) -> list[Sealing | Outcome]:
    """Call ``seal`` with a pickled ``Sample``. A process caches the last sample, with its wall particles."""
    return seal(_unpickled(sample), trials, options)


def seal(sample: Sample, trials: Sequence[Trial], options: StudyOptions) -> list[Sealing | Outcome]:
    """Compute runs that differ only in the fluid, in one launch. A run's result is the same as in a launch of its own.

    If a launch raises an exception, its runs are computed one by one, and an exception fails only its own run.
    """
    began = time.monotonic()
    # With the explicit solve the stiffest fluid sets the number of passes, which would change the other results.
    if len(trials) == 1 or trials[0].solver.viscosity_solve == "implicit":
        try:
            return [*_seal(sample, trials, options)]
        except Exception as fault:
            if len(trials) == 1:
                return [_failure(fault, time.monotonic() - began)]
    return [outcome for trial in trials for outcome in seal(sample, [trial], options)]


def _groups(runs: Sequence[StudyRun], batch: int) -> list[list[StudyRun]]:
    """Group the waiting runs into launches of at most ``batch`` runs of equal ``kin``, in the order of the study."""
    alike: dict[str, list[StudyRun]] = {}
    for run in runs:
        if run.state == "waiting":
            alike.setdefault(run.kin, []).append(run)
    groups = [kin[start : start + batch] for kin in alike.values() for start in range(0, len(kin), batch)]
    return sorted(groups, key=lambda group: group[0].number)


def _inputs(folder: Path, group: Sequence[StudyRun]) -> tuple[bytes, list[Trial]]:
    """Return the pickled sample and the trials of a launch."""
    trials = [run.checked_trial for run in group]
    readings = trials[0].readings
    return _pickled(
        folder / "samples" / group[0].sample, "" if readings is None else readings.model_dump_json()
    ), trials


@lru_cache(maxsize=1)
def _pickled(folder: Path, settings_json: str) -> bytes:
    """Return a digitised sample with its readings, pickled, and cached for the next runs of the same sample.

    Raises InputError if a file is missing or cannot be read.
    """
    sample = record_files.read_sample(folder)
    if settings_json:
        from validate.readings.read_readings import read_readings

        settings = Readings.model_validate_json(settings_json)
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
    home = run_path(folder, run)
    if isinstance(outcome, Sealing):
        record_files.write_profile(home, outcome.profile)
        if outcome.fill is not None:
            files.write_bytes(home / FILL, outcome.fill)
        figures = outcome.figures.model_dump(exclude_unset=True)
        files.write_json(home / SUMMARY, {"settings": run.settings, "figures": figures})
        hashed = StudyFigures(**figures, profile_sha256=files.sha256(home / PROFILE))
        outcome = Outcome("done", outcome.wall_s, figures=hashed)
    write_outcome(folder, replace(run, **vars(replace(outcome, finished_unix_s=time.time()))))
    return with_outcome(folder, run)


def _seal(sample: Sample, trials: Sequence[Trial], options: StudyOptions) -> list[Sealing | Outcome]:
    """Compute one launch. Raises InputError if settings of a run cannot be used, and NumericalError if all diverge."""
    from simulate.injection import ComputeOptions
    from simulate.run import fill_each
    from simulate.watchers import KeptFill

    began, first = time.monotonic(), trials[0]
    kept = options.keep_fills and len(trials) == 1 and first.solver.has_particles
    fills = [KeptFill(first.output.snapshots_s)] if kept else []
    pour = replace(first.pour(sample), fluids=tuple(trial.given_fluid for trial in trials))
    outcomes = fill_each(pour, ComputeOptions(options.device, threads=1, watchers=fills))
    launch_s = (time.monotonic() - began) / len(trials)
    judged: list[Sealing | Outcome] = []
    for outcome in outcomes:
        began = time.monotonic()
        try:
            if isinstance(outcome, NumericalError):
                raise outcome
            run, profile = outcome
            figures = RunFigures(**_figures(run), **_compared(profile, sample.readings))
        except SealtwinError as fault:
            judged.append(_failure(fault, launch_s + time.monotonic() - began))
        else:
            content = next((fill.content() for fill in fills), None)
            wall_s = launch_s + time.monotonic() - began
            judged.append(Sealing(profile, figures, wall_s, content))
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


def _compared(simulated: Profile, measured: Profile | None) -> dict[str, Any]:
    """Return the errors of a run's level against the readings; empty if there are no readings."""
    if measured is None:
        return {}
    from validate.metrics.curve_distances import are_compared, error_figures, level_difference
    from validate.metrics.verdict import best_curves

    error = level_difference(simulated, measured)
    from_mm, to_mm = error.x[[0, -1]].tolist()
    figures = vars(error_figures(error, measured)) | {
        "stations_compared": int(are_compared(measured.s_mm, from_mm, to_mm).sum()),
        "baselines": best_curves(measured, from_mm, to_mm, range(1, MOST_NUMBERS + 1)),
    }
    return {name: figures[name] for name in RunErrors.model_fields}


def _failure(fault: Exception, wall_s: float) -> Outcome:
    if isinstance(fault, SealtwinError):
        return Outcome("failed", wall_s, reason=str(fault))
    reason = f"{type(fault).__name__}: {fault}. A bug: please report it with the trace in the run's {OUTCOME}."
    return Outcome("failed", wall_s, reason=reason, trace="".join(traceback.format_exception(fault)))
