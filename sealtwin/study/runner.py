"""Runs of a study on cracks that are digitised already: inject, measure, compare, and keep the results."""

import pickle
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sealtwin.core import files, record_files
from sealtwin.core.cluster import Lost, run_tasks
from sealtwin.core.errors import NumericalError, SealtwinError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Outline, Profile, Run, Solid, Trajectory
from sealtwin.study.estimate import Forecast, Timing, timings_of
from sealtwin.study.study_folder import OUTCOME, PROFILE, STATES, StudyRun, run_path, with_outcome, write_outcome
from sealtwin.trial.stage_numbers import own_numbers
from sealtwin.trial.trial_file import Trial
from validate.settings import Readings

ERRORS = ("mean_error_mm", "worst_error_mm", "worst_at_mm", "flat_level_error_mm", "stations_compared")
MOST_NUMBERS = 8  # Of the curves that a run is held against; a sweep that varies more settings names the last

if TYPE_CHECKING:
    from simulate.injection import Injection
    from simulate.setup.wall_particles import Enclosure

SUMMARY = "summary.json"
INPUTS = "inputs"  # Folder in a run folder that holds the copy of the readings


@dataclass(frozen=True, eq=False)
class Bench:
    """The records that all runs of one sample share, which can be sent to another machine."""

    outline: Outline
    solid: Solid
    trajectory: Trajectory
    readings: Profile | None


@dataclass(frozen=True)
class Sealing:
    """The measured result of a run."""

    profile: Profile
    figures: dict[str, Any]  # The figures of ``StudyRun``, except the profile's hash
    wall_s: float
    run: Run | None  # The particles, if they are to be kept


@dataclass(frozen=True)
class Failure:
    """The outcome of a run that has no result."""

    reason: str
    wall_s: float = 0.0
    trace: str | None = None  # Traceback, where a bug made it fail


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
            outcomes = [Failure(f"{outcomes.reason}: give fewer --jobs, and --retry.")] * len(group)
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


def seal_in_worker(bench: bytes, trials: Sequence[Trial], device: str, keep_runs: bool) -> list[Sealing | Failure]:
    """Call ``seal`` with a pickled ``Bench``, of which a process keeps the last with the walls that it made."""
    if trials[0].solver.model != "slot":
        from simulate.device import start_warp

        start_warp()
    return seal(_unpickled(bench), trials, device=device, keep_runs=keep_runs)


def read_bench(folder: Path, settings: Readings | None) -> Bench:
    """Read a digitised run folder. Raises InputError if a file is missing or the readings cannot be read."""
    outline, solid = record_files.read_outline(folder), record_files.read_solid(folder)
    readings = None
    if settings is not None:
        from validate.readings.read_readings import read_readings

        sheet = folder / INPUTS / settings.file.name
        readings = read_readings(sheet, settings, outline.length_mm, solid.depth_mm)
    return Bench(outline, solid, record_files.read_trajectory(folder), readings)


def seal(bench: Bench, trials: Sequence[Trial], *, device: str, keep_runs: bool) -> list[Sealing | Failure]:
    """Compute runs that differ in their fluids alone in one launch, each with the result that it has alone.

    An exception becomes the failure of the run that caused it; the others are then computed one by one.
    """
    began = time.monotonic()
    # Explicit passes are as many as the stiffest of a launch needs, which is another result for the others.
    if len(trials) == 1 or trials[0].solver.viscosity_solve == "implicit":
        try:
            return [*_seal(bench, trials, device, keep_runs)]
        except Exception as fault:
            if len(trials) == 1:
                return [_failure(fault, time.monotonic() - began)]
    return [outcome for trial in trials for outcome in seal(bench, [trial], device=device, keep_runs=keep_runs)]


def ready(bench: Bench, trials: Sequence[Trial], device: str) -> "Injection":
    """Prepare runs that differ in their fluids alone. Raises InputError if one of them cannot be run."""
    from simulate.injection import prepare

    first, fluids = trials[0], [trial.fluid for trial in trials if trial.fluid is not None]
    sample = bench.solid, bench.outline, bench.trajectory
    enclosure = enclosure_of(bench, first.solver.for_crack(bench.outline.mean_width_mm).size_mm, device)
    how = {"seed": first.seed, "device": device, "slope": first.sample, "enclosure": enclosure}
    return prepare(*sample, fluids, first.solver, first.nozzle, **how)


@lru_cache(maxsize=1)
def enclosure_of(bench: Bench, radius_mm: float, device: str) -> "Enclosure":
    """Return the wall particles for a radius. The last are kept: they take a fifth of a run to make."""
    from simulate.setup.wall_particles import enclose

    return enclose(bench.solid, bench.outline, radius_mm, device)


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
    bench = _pickled(folder / "samples" / group[0].sample, "" if readings is None else readings.model_dump_json())
    return bench, trials, how.device, how.keep_runs


@lru_cache(maxsize=1)
def _pickled(sample: Path, readings: str) -> bytes:
    """Return the bench of a sample; runs of one sample mostly follow each other."""
    return pickle.dumps(read_bench(sample, Readings.model_validate_json(readings) if readings else None))


@lru_cache(maxsize=1)
def _unpickled(bench: bytes) -> Bench:
    # Made by this sweep's parent and carried by Dask like the task itself: no file is read.
    return pickle.loads(bench)


def _keep(folder: Path, run: StudyRun, outcome: Sealing | Failure) -> StudyRun:
    """Write the files of a run, its outcome last."""
    home = run_path(folder, run.key)
    finished = replace(run, wall_s=outcome.wall_s, finished_unix_s=time.time())
    if isinstance(outcome, Failure):
        finished = replace(finished, state="failed", reason=outcome.reason, trace=outcome.trace)
    else:
        record_files.write_profile(home, outcome.profile)
        if outcome.run is not None:
            record_files.write_run(home, outcome.run)
        files.write_json(home / SUMMARY, {"settings": run.settings, "figures": outcome.figures})
        figures = {**outcome.figures, "profile_sha256": files.sha256(home / PROFILE)}
        finished = replace(finished, state="done", figures=figures)
    write_outcome(folder, finished)
    return with_outcome(folder, run)


def _seal(bench: Bench, trials: Sequence[Trial], device: str, keep_runs: bool) -> list[Sealing | Failure]:
    """Compute one launch. Raises InputError from one of the runs, and NumericalError if all diverge."""
    from simulate.run import follow

    if trials[0].solver.model == "slot":
        return [_fill_fast(bench, trial) for trial in trials]
    began = time.monotonic()
    injection = ready(bench, trials, device)
    # No frame is written. Replayed on a CPU they take two thirds of the time, with the same bits, if freezing keeps few
    # particles moving: rows are launched for as many as may ever move.
    freezes = all(fluid.freeze_after_s != "never" for fluid in injection.fluids)
    if freezes and trials[0].solver.viscosity_solve == "implicit":
        injection.engine.replays = True
    follow(injection, Progress())
    outcomes = injection.outcomes()
    launch_s = (time.monotonic() - began) / len(trials)
    judged: list[Sealing | Failure] = []
    for trial, outcome in zip(trials, outcomes, strict=True):
        began = time.monotonic()
        try:
            profile, figures, run = _measure(bench, trial, outcome)
        except SealtwinError as fault:
            judged.append(_failure(fault, launch_s + time.monotonic() - began))
        else:
            judged.append(Sealing(profile, figures, launch_s + time.monotonic() - began, run if keep_runs else None))
    return judged


def _fill_fast(bench: Bench, trial: Trial) -> Sealing | Failure:
    """Compute a run of the fast model, which has no particles to keep."""
    from simulate.slot.run import pour

    began = time.monotonic()
    assert trial.fluid is not None, "a study without one is refused"
    try:
        sample = bench.solid, bench.outline, bench.trajectory
        run, profile = pour(*sample, trial.fluid, trial.solver, trial.nozzle, seed=trial.seed, slope=trial.sample)
    except SealtwinError as fault:
        return _failure(fault, time.monotonic() - began)
    assert run.bed is not None, "the fast model has one"
    ratio = run.health.volume_ratio
    figures: dict[str, Any] = {
        "volume_ratio": ratio,
        "unfit": list(run.bed.unfit),
        "fluid_warnings": _warnings_of(run, ratio),
        "health": run.health.recorded(),
        **_compared(bench, trial, profile),
    }
    return Sealing(profile, figures, time.monotonic() - began, None)


def _measure(bench: Bench, trial: Trial, run: Run | NumericalError) -> tuple[Profile, dict[str, Any], Run]:
    from simulate.profile import measure_profile, volume_ratio

    if isinstance(run, NumericalError):
        raise run
    if run.escaped_particles:
        raise NumericalError(
            f"{run.escaped_particles} particles went through a wall, which must never happen; no number of this run is "
            "kept. Please report it with its settings."
        )
    profile, ratio = measure_profile(run, bench.outline, bench.solid), volume_ratio(run, bench.solid)
    figures: dict[str, Any] = {
        "particles": len(run.position_mm),
        "escaped_particles": run.escaped_particles,
        "spilled_particles": run.spilled_particles,
        "volume_ratio": ratio,
        "fluid_warnings": _warnings_of(run, ratio),
        "health": run.health.recorded(),
        **_compared(bench, trial, profile),
    }
    return profile, figures, run


def _warnings_of(run: Run, volume_ratio: float | None) -> list[str]:
    from validate.wording.headline import fluid_warnings

    return [] if volume_ratio is None else list(fluid_warnings(run, volume_ratio))


def _compared(bench: Bench, trial: Trial, profile: Profile) -> dict[str, Any]:
    """Return the figures of a run against the readings; none without them."""
    if trial.readings is None or bench.readings is None:
        return {}
    from validate.compare import compare
    from validate.metrics.baselines import best_curves

    held, sample = trial.readings, (bench.outline, bench.solid)
    comparison = compare(profile, bench.readings, *sample, role=held.role, photo_data=trial.shown_by.data)
    stretch_mm = comparison.covered_from_mm, comparison.covered_to_mm
    curves = best_curves(bench.readings, *stretch_mm, range(1, MOST_NUMBERS + 1))
    return {**{name: getattr(comparison, name) for name in ERRORS}, "baselines": [asdict(one) for one in curves]}


def _failure(fault: Exception, wall_s: float) -> Failure:
    if isinstance(fault, SealtwinError):
        return Failure(str(fault), wall_s)
    reason = f"{type(fault).__name__}: {fault}. A bug: please report it with the trace in the run's {OUTCOME}."
    return Failure(reason, wall_s, "".join(traceback.format_exception(fault)))
