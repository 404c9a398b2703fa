"""One sealing of a crack that is digitised already: inject, measure, compare, keep what a study keeps of it."""

import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sealtwin.errors import NumericalError, SealtwinError
from sealtwin.progress import Progress
from sealtwin.records import Outline, Profile, Run, Solid, Trajectory
from sealtwin.store import files, stage_files
from sealtwin.study.ledger import PROFILE
from sealtwin.trials.trial import Trial
from validate.settings import Readings

if TYPE_CHECKING:
    from simulate.enclosure import Enclosure
    from simulate.injection import Injection

SUMMARY = "summary.json"
INPUTS = "inputs"
"""Where a run folder keeps its copy of the readings."""


@dataclass(frozen=True)
class Bench:
    """What all runs of one sample share. Plain records, which travel to another machine as they are."""

    outline: Outline
    solid: Solid
    trajectory: Trajectory
    readings: Profile | None
    _enclosures: dict[tuple[float, str], "Enclosure"] = field(default_factory=dict, compare=False, repr=False)

    def enclosure(self, radius_mm: float, device: str) -> "Enclosure":
        """For particles of that size. The last one is kept: it takes a fifth of a run, and most studies need one."""
        from simulate.enclosure import enclose

        wanted = radius_mm, device
        if wanted not in self._enclosures:
            self._enclosures.clear()
            self._enclosures[wanted] = enclose(self.solid, self.outline, radius_mm, device)
        return self._enclosures[wanted]


@dataclass(frozen=True)
class Sealing:
    """A finished run, measured."""

    profile: Profile
    figures: dict[str, Any]
    """As ``sealtwin.study.ledger.StudyRun`` has them, but for the profile's hash."""
    wall_s: float
    run: Run | None
    """Where its particles are wanted too."""


@dataclass(frozen=True)
class Failure:
    """A run without a result."""

    reason: str
    wall_s: float
    trace: str | None
    """Of a bug."""


def read_bench(folder: Path, settings: Readings | None) -> Bench:
    """From a digitised run folder. Raises InputError where it lacks a file, or the readings cannot be read."""
    outline, solid = stage_files.read_outline(folder), stage_files.read_solid(folder)
    readings = None
    if settings is not None:
        from validate.caliper import read_readings

        sheet = folder / INPUTS / settings.file.name
        readings = read_readings(sheet, settings, outline.length_mm, solid.depth_mm)
    return Bench(outline, solid, stage_files.read_trajectory(folder), readings)


def seal(
    bench: Bench, trials: Sequence[Trial], *, device: str, keep_runs: bool, progress: Progress
) -> list[Sealing | Failure]:
    """Runs that differ in their fluids alone, in one launch; each as if it were alone.

    Raises nothing of theirs: a run that fails costs no other one its result, and a bug no more than a second try.
    """
    began = time.monotonic()
    # Explicit passes are as many as the stiffest of a launch needs, which is another result for the others.
    if len(trials) == 1 or trials[0].solver.viscosity_solve == "implicit":
        try:
            return [*_seal(bench, trials, device, keep_runs, progress)]
        except Exception as fault:
            # What one run's settings wake before or beside its numbers must not cost the others theirs.
            if len(trials) == 1:
                return [_failure(fault, time.monotonic() - began)]
    return [
        outcome
        for trial in trials
        for outcome in seal(bench, [trial], device=device, keep_runs=keep_runs, progress=progress)
    ]


def write_sealing(folder: Path, sealing: Sealing, settings: Mapping[str, Any]) -> str:
    """profile.csv and summary.json, and the particles where they were kept. Returns the profile's hash."""
    stage_files.write_profile(folder, sealing.profile)
    if sealing.run is not None:
        stage_files.write_run(folder, sealing.run)
    files.write_json(folder / SUMMARY, {"settings": dict(settings), "figures": sealing.figures})
    return files.sha256(folder / PROFILE)


def _seal(
    bench: Bench, trials: Sequence[Trial], device: str, keep_runs: bool, progress: Progress
) -> list[Sealing | Failure]:
    """Raises InputError from one of them, and NumericalError where all diverge."""
    from simulate.run import follow

    began = time.monotonic()
    injection = ready(bench, trials, device)
    # Nobody watches these frames. Replayed on a CPU they take two thirds of the time, to the same bits, where freezing
    # keeps those that move few: rows are launched for as many as ever may.
    freezes = all(fluid.freeze_after_s != "never" for fluid in injection.fluids)
    if freezes and trials[0].solver.viscosity_solve == "implicit":
        injection.engine.replays = True
    follow(injection, progress)
    outcomes = injection.outcomes()
    launch_s = (time.monotonic() - began) / len(trials)
    return [_judge(bench, trial, outcome, launch_s, keep_runs) for trial, outcome in zip(trials, outcomes, strict=True)]


def ready(bench: Bench, trials: Sequence[Trial], device: str) -> "Injection":
    """Runs that differ in their fluids alone, before their first frame. Raises InputError from one of them."""
    from simulate.injection import prepare

    first = trials[0]
    return prepare(
        bench.solid,
        bench.outline,
        bench.trajectory,
        [trial.fluid for trial in trials if trial.fluid is not None],
        first.solver,
        first.nozzle,
        seed=first.seed,
        device=device,
        enclosure=bench.enclosure(first.solver.for_crack(bench.outline.mean_width_mm).size_mm, device),
    )


def _judge(
    bench: Bench, trial: Trial, outcome: Run | NumericalError, launch_s: float, keep_runs: bool
) -> Sealing | Failure:
    """``launch_s`` is the run's part of the launch."""
    began = time.monotonic()
    try:
        if isinstance(outcome, NumericalError):
            raise outcome
        profile, figures = _measure(bench, trial, outcome)
    except SealtwinError as fault:
        return _failure(fault, launch_s + time.monotonic() - began)
    return Sealing(profile, figures, launch_s + time.monotonic() - began, outcome if keep_runs else None)


def _measure(bench: Bench, trial: Trial, run: Run) -> tuple[Profile, dict[str, Any]]:
    from simulate.profile import measure_profile, volume_ratio

    if run.escaped_particles:
        raise NumericalError(
            f"{run.escaped_particles} particles went through a wall, which must never happen; of this run no number is "
            "kept. Please report it with its settings."
        )
    profile = measure_profile(run, bench.outline, bench.solid)
    figures: dict[str, Any] = {
        "particles": len(run.position_mm),
        "escaped_particles": run.escaped_particles,
        "spilled_particles": run.spilled_particles,
        "volume_ratio": volume_ratio(run, bench.solid),
        "health": run.health,
    }
    if trial.readings is not None and bench.readings is not None:
        from validate.compare import compare

        comparison = compare(
            profile,
            bench.readings,
            bench.outline,
            bench.solid,
            role=trial.readings.role,
            photo_data=trial.sample.data,
        )
        figures |= {
            "mean_error_mm": comparison.mean_error_mm,
            "worst_error_mm": comparison.worst_error_mm,
            "worst_at_mm": comparison.worst_at_mm,
        }
    return profile, figures


def _failure(fault: Exception, wall_s: float) -> Failure:
    if isinstance(fault, SealtwinError):
        return Failure(str(fault), wall_s, None)
    reason = f"{type(fault).__name__}: {fault}. A bug of ours: please report it with its trace in the ledger."
    return Failure(reason, wall_s, "".join(traceback.format_exception(fault)))
