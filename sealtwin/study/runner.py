"""Compute the runs of a study: inject the sealant, measure and compare the level, and write the results."""

import pickle
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
from sealtwin.core.errors import InputError, NumericalError, SealtwinError
from sealtwin.core.facts import Fact
from sealtwin.core.progress import Progress, in_words
from sealtwin.core.records import Profile, Run, Sample
from sealtwin.core.run_folder import content_key, stage_key
from sealtwin.core.workers import Lost, run_tasks
from sealtwin.study.estimate import RunSize, checked_size, require_memory, slowness, time_left_s, waiting_s
from sealtwin.study.study_file import raise_faults
from sealtwin.study.study_folder import (
    FILL,
    OUTCOME,
    PROFILE,
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
from sealtwin.trial.job import DIGITISED, own_numbers, stage_settings
from sealtwin.trial.trial_file import Trial
from validate.run_facts import facts_of_runs
from validate.settings import Readings

SHOWN_EVERY_S = 2.0  # Time in s between two updates of the progress display
MAX_NUMBERS = 8  # Largest number of coefficients of a baseline curve, also for a sweep of more settings

SUMMARY = "summary.json"
INPUTS = "inputs"  # Name of the folder in a run folder with the copied readings


@dataclass(frozen=True)
class Sealing:
    """Result of a successful run: its level, figures and computing time."""

    profile: Profile
    figures: RunFigures
    wall_s: float
    fill: bytes | None = None  # Content of fill.npz. None if that file is not written


@dataclass(frozen=True)
class StudyOptions:
    """Options for computing the waiting runs of a study."""

    device: str
    jobs: int  # Number of worker processes on this machine. 0 computes in the calling process
    batch: int = 1  # Largest number of runs in one launch
    keep_fills: bool = False  # True to store how the crack fills, for launches of a single particle run
    later_s: float = 0.0  # Estimated time of the command's work after these runs
    scheduler: str | None = None  # Address of a Dask scheduler whose workers compute the runs
    retry: bool = False  # True to compute failed runs again
    dry_run: bool = False
    drafts: bool = True  # True to compute drafts, unless the study or the caller sets the solver's resolution
    traced: dict[str, Any] = field(default_factory=dict)  # Same as ``Job.traced``, shared by all samples of the study


@dataclass(frozen=True)
class WantedRun:
    """A run that a study requires. Its sample is in a folder in samples/."""

    number: int  # Position in the study, from 1
    settings: dict[str, Any]  # Varied settings
    trial: Trial
    sample: Sample
    home: str  # Name of the sample's folder
    inputs: Mapping[str, str]  # Hashes of the files that the run depends on
    depends: Mapping[str, Any]  # Further values that the run depends on, besides files, device and stage settings


def schedule(
    wanted: Sequence[WantedRun], device: str, numbers: Mapping[str, int]
) -> tuple[list[StudyRun], RunSize, list[Fact]]:
    """Return the runs with their keys, the size of the largest run, and warnings about the runs.

    Raises InputError if settings cannot be used for a crack. The message lists each fault with the numbers of its runs.
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
    """Write the sample of a run to its folder in samples/, unless the files are already there."""
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
) -> Plan:
    """Compute the runs of a plan that are not done, and return the plan with all outcomes. A dry run computes nothing.

    ``announced`` is the beginning of a note about the time that the runs need. If it is empty, there is no note. Raises
    InputError if the memory of the GPU is too small.
    """
    from simulate.device import free_bytes

    runs = resume(folder, plan, progress.note, retry=options.retry)
    waiting = sum(run.state == "waiting" for run in runs)
    if announced and (waiting or options.dry_run):
        left_s = time_left_s(runs, min(options.jobs, waiting)) + options.later_s
        progress.note(f"{announced} {waiting} runs to compute: about {in_words(left_s)}, which the runs will correct.")
    for doubt in doubts if waiting else ():
        progress.warn(doubt)
    if options.scheduler is None and options.device:
        require_memory(largest, free_bytes(options.device), options.device, min(options.batch, waiting))
    if waiting and not options.dry_run:
        runs = compute(folder, runs, options, title, progress)
    return replace(plan, runs=runs)


def require_done(folder: Path, runs: Sequence[StudyRun], so: str) -> None:
    """Raise NumericalError if a run failed. The message lists the failed runs and their reasons.

    ``so`` states the consequence, to complete a sentence.
    """
    if failed := [run for run in runs if run.state == "failed"]:
        reasons = "\n".join(f"{words_of(run.settings)}: {run.reason}" for run in failed)
        raise NumericalError(
            f"{folder}: {len(failed)} of {len(runs)} runs failed, so {so}. Repeat the command to try them again.\n"
            f"{reasons}"
        )


def words_of(settings: Mapping[str, Any]) -> str:
    """Return the varied settings of a run in words: their values, or the change of a seed or an input."""
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
) -> list[StudyRun]:
    """Compute the waiting runs, and return all runs with their outcomes. Each result is written immediately.

    If the process is killed, the next call computes the runs that were not finished.
    """
    shared = replace(options, traced={})
    work = seal_in_worker, lambda group: (*_inputs(folder, group), shared), partial(_keep, folder)
    return launch(runs, options, title, progress, work)


Work = tuple[
    Callable[..., Sequence[Any]],
    Callable[[Sequence[StudyRun]], tuple[Any, ...]],
    Callable[[StudyRun, Any], StudyRun],
]
"""Three functions that define the work for a launch.

The first runs in a worker, and returns an outcome for each run of the launch. The second returns the arguments of the
first. The third writes an outcome, which may be ``Lost``, and returns the run with the outcome."""


def launch(
    runs: Sequence[StudyRun], options: StudyOptions, title: str, progress: Progress, work: Work
) -> list[StudyRun]:
    """Do ``work`` for the waiting runs, and return all runs with their outcomes."""
    function, arguments, keep = work
    current = {run.key: run for run in runs}
    work_s = waiting_s(runs)
    # The unit is a hundredth of a second, since a progress bar counts whole steps.
    progress.start(title, max(1, round(100 * work_s)))
    launches = {group[0].key: group for group in _groups(runs, options.batch)}
    jobs, began_s = min(options.jobs, len(launches)), dict[str, float]()
    progress.later(slowness(runs) * options.later_s)

    def tasks() -> Iterator[tuple[list[StudyRun], tuple[Any, ...]]]:
        for key, group in [*launches.items()]:
            began_s[key] = time.monotonic()
            yield group, arguments(group)

    def show() -> None:
        runs = [*current.values()]
        elapsed_s = [time.monotonic() - began_s[key] for key in launches if key in began_s]
        # A local worker starts a task as soon as it is read. A scheduler reads more tasks than its workers start.
        if options.scheduler is None:
            progress.expect(time_left_s(runs, min(jobs, len(launches)), elapsed_s))
            progress.later(slowness(runs) * options.later_s)
        states = Counter(run.state for run in runs)
        counts = f"{states['done']} of {len(runs)} runs done, {len(elapsed_s)} begun, {states['failed']} failed"
        progress.advance(round(100 * (work_s - waiting_s(runs))), counts)

    def show_during_runs() -> None:
        while not ended.wait(SHOWN_EVERY_S):
            with showing:
                show()

    showing, ended = Lock(), Event()
    watching = Thread(target=show_during_runs, daemon=True)
    watching.start()
    try:
        for group, outcomes in run_tasks(function, tasks(), jobs, options.scheduler, own_numbers):
            if isinstance(outcomes, Lost):
                outcomes = [outcomes] * len(group)
            with showing:
                for run, outcome in zip(group, outcomes, strict=True):
                    current[run.key] = keep(run, outcome)
                del launches[group[0].key]
                show()
    finally:
        ended.set()
        watching.join()
    progress.later(0.0)
    return list(current.values())


def seal_in_worker(sample: bytes, trials: Sequence[Trial], options: StudyOptions) -> list[Sealing | Outcome]:
    """Call ``seal`` with a pickled ``Sample``. The process caches the last sample and its wall particles."""
    return seal(_unpickled(sample), trials, options)


def seal(sample: Sample, trials: Sequence[Trial], options: StudyOptions) -> list[Sealing | Outcome]:
    """Compute runs that differ only in the fluid, in one launch. The result of a run does not depend on the others.

    If the launch raises an exception, its runs are computed one by one, and only the runs with an exception fail.
    """
    began = time.monotonic()
    # In the explicit solve, the most viscous fluid sets the number of passes, which would change the other results.
    if len(trials) == 1 or trials[0].solver.viscosity_solve == "implicit":
        try:
            return [*_seal(sample, trials, options)]
        except Exception as fault:
            if len(trials) == 1:
                return [_failure(fault, time.monotonic() - began)]
    return [outcome for trial in trials for outcome in seal(sample, [trial], options)]


def _groups(runs: Sequence[StudyRun], batch: int) -> list[list[StudyRun]]:
    """Group the waiting runs into launches of at most ``batch`` runs with equal ``kin``, in the order of the study."""
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
    """Return a digitised sample with its readings, pickled. The result is cached for further runs of the same sample.

    Raises InputError if a file is missing or cannot be read.
    """
    sample = record_files.read_sample(folder)
    if settings_json:
        from validate.readings.read_readings import read_readings

        settings = Readings.model_validate_json(settings_json)
        sheet = folder / INPUTS / settings.path.name
        readings = read_readings(sheet, settings, crack=(sample.outline, sample.solid))
        sample = replace(sample, readings=readings)
    return pickle.dumps(sample)


@lru_cache(maxsize=1)
def _unpickled(sample: bytes) -> Sample:
    # Unpickling is safe here: the bytes come from the parent process and not from a file.
    return pickle.loads(sample)


def _keep(folder: Path, run: StudyRun, outcome: Sealing | Outcome | Lost) -> StudyRun:
    """Write the files of a run, the outcome last, and return the run with its outcome."""
    if isinstance(outcome, Lost):
        outcome = Outcome(
            "failed", 0.0, reason=f"{outcome.reason}. Repeat the command with fewer --jobs and with --retry."
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
    write_outcome(folder, replace(run, **vars(outcome)))
    return with_outcome(folder, run)


def _seal(sample: Sample, trials: Sequence[Trial], options: StudyOptions) -> list[Sealing | Outcome]:
    """Compute one launch.

    Raises InputError if settings of a run cannot be used, and NumericalError if all runs diverge.
    """
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
            figures = RunFigures(**_figures(run), **_level_errors(profile, sample.readings))
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
            f"{run.escaped_particles} particles went through a wall, which must never happen. The results of this run "
            "are discarded. Please report this bug with the settings of the run."
        )
    names = ("particles", "escaped_particles", "spilled_particles")
    counts = {name: getattr(run, name) for name in names} if run.has_particles else {"unfit": run.unfit}
    ratio = run.health.volume_ratio
    warnings = () if ratio is None else fluid_warnings(run, ratio)
    return {**counts, "volume_ratio": ratio, "fluid_warnings": warnings, "health": run.health}


def _level_errors(simulated: Profile, measured: Profile | None) -> dict[str, Any]:
    """Return the errors of a run's level relative to the readings. Empty if there are no readings."""
    if measured is None:
        return {}
    from validate.metrics.curve_distances import are_compared, error_figures, level_difference
    from validate.metrics.verdict import best_curves

    error = level_difference(simulated, measured)
    from_mm, to_mm = error.x[[0, -1]].tolist()
    figures = vars(error_figures(error, measured)) | {
        "stations_compared": int(are_compared(measured.s_mm, from_mm, to_mm).sum()),
        "baselines": best_curves(measured, from_mm, to_mm, range(1, MAX_NUMBERS + 1)),
    }
    return {name: figures[name] for name in RunErrors.model_fields}


def _failure(fault: Exception, wall_s: float) -> Outcome:
    if isinstance(fault, SealtwinError):
        return Outcome("failed", wall_s, reason=str(fault))
    reason = f"{type(fault).__name__}: {fault}. This is a bug; please report it with the trace in the run's {OUTCOME}."
    return Outcome("failed", wall_s, reason=reason, trace="".join(traceback.format_exception(fault)))
