"""What a study will take: time, memory, disk. A model, which the runs that are done correct."""

from collections.abc import Sequence
from dataclasses import dataclass

from sealtwin.errors import InputError
from sealtwin.records import Trajectory
from sealtwin.study.ledger import StudyRun
from sealtwin.trials.trial import Trial

SETUP_S = 0.2
"""Walls, distances and reading the profile, on a core of the machine that the README names; so are the next two."""
LAUNCHES_S = 0.5e-3
"""A substep's launches, whatever they work on."""
PARTICLE_S = 2e-6
"""A moving particle's part of a substep."""
PROCESS_BYTES = 300e6
"""Python and its libraries, in a process that has done some runs."""
WALLS_BYTES = 18e3
"""Of the grid of distances and the wall particles, for each particle: both get finer with it. At their peak, seen at
radii of 0.4 and 0.6 mm: 270 and 115 MB.
"""
PARTICLE_BYTES = 170.0
"""Place, speed and age, the search's sorting, and its part of the cells."""
MOVER_BYTES = 1500.0
"""While it moves: lists of 224 neighbours, and the weights of its 128 pairs, of 4 bytes each; what the solves need."""
RUN_BYTES = 25e3
"""profile.csv and summary.json, and a row of the ledger."""
PARTICLE_ROW_BYTES = 75
"""A line of particles.csv."""


@dataclass(frozen=True)
class Size:
    """Of one run, before it starts."""

    particles: int
    moving: int
    """At one time, the most."""
    work_s: float
    """On one core, by the model."""

    @property
    def bytes(self) -> float:
        """Of its arrays on the device, each time that it is in a launch."""
        return self.particles * PARTICLE_BYTES + self.moving * MOVER_BYTES


@dataclass(frozen=True)
class Estimate:
    """Of what is left of a study."""

    runs: int
    time_s: float
    measured: bool
    """Whether runs that are done have corrected the model; without one it may be off by a factor of three."""
    memory_bytes: float
    """Of all processes together."""
    disk_bytes: float

    @property
    def sentence(self) -> str:
        basis = "by the runs that are done" if self.measured else "by a model; the first runs will correct it"
        return (
            f"{self.runs} runs are left: about {in_words(self.time_s)} ({basis}), {self.memory_bytes / 1e9:.1f} GB of "
            f"memory, {self.disk_bytes / 1e6:.1f} MB on disk."
        )


def size_of(trial: Trial, trajectory: Trajectory, width_mm: float) -> Size:
    """``width_mm`` is the crack's mean, from which a radius may follow.

    Raises InputError where the path gives no sealant, or more particles than are allowed.
    """
    from simulate.course import course_of
    from simulate.nozzle import plan_releases
    from simulate.solver import substeps_for

    assert trial.fluid is not None, "a study without one is refused"
    solver = trial.solver.for_crack(width_mm)
    schedule = plan_releases(trajectory, solver.size_mm, trial.nozzle.diameter_mm, trial.seed)
    course = course_of(schedule, trial.fluid, solver.settle_s)
    work_s = substeps_for(solver, schedule.frame_s) * (LAUNCHES_S * course.frames + PARTICLE_S * course.moving.sum())
    return Size(schedule.particles, int(course.moving.max()), SETUP_S + float(work_s))


def estimate(runs: Sequence[StudyRun], largest: Size, jobs: int, batch: int, *, keep_runs: bool) -> Estimate:
    """Of what is waiting among ``runs``, with ``jobs`` processes."""
    left = [run for run in runs if run.state == "waiting"]
    jobs, batch = (min(most, max(1, len(left))) for most in (jobs, batch))
    pace = measured_pace(runs)
    return Estimate(
        runs=len(left),
        time_s=(pace or 1.0) * sum(run.work_s for run in left) / jobs,
        measured=pace is not None,
        memory_bytes=jobs * (PROCESS_BYTES + largest.particles * WALLS_BYTES + batch * largest.bytes),
        disk_bytes=len(left) * (RUN_BYTES + keep_runs * largest.particles * PARTICLE_ROW_BYTES),
    )


def measured_pace(runs: Sequence[StudyRun]) -> float | None:
    """Time that runs took, over the model's; None where none is done."""
    timed = [(run.wall_s, run.work_s) for run in runs if run.state == "done" and run.wall_s is not None]
    return sum(wall for wall, _ in timed) / sum(work for _, work in timed) if timed else None


def require_disk(expected: Estimate, free_bytes: float, folder: str) -> None:
    """Raises InputError where the results will not fit."""
    if expected.disk_bytes > free_bytes:
        raise InputError(
            f"{folder}: {free_bytes / 1e6:.0f} MB are free there, the results need {expected.disk_bytes / 1e6:.0f} MB. "
            "Give --out another disk, or leave out --keep-runs."
        )


def require_memory(expected: Estimate, free_bytes: float, device: str, batch: int) -> None:
    """Raises InputError where a launch of ``batch`` runs will not fit a GPU."""
    if expected.memory_bytes > free_bytes:
        raise InputError(
            f"--batch {batch}: that many runs in one launch need {expected.memory_bytes / 1e9:.1f} GB, "
            f"{free_bytes / 1e9:.1f} GB are free on {device}. Give a smaller --batch, or fewer --jobs."
        )


def in_words(time_s: float) -> str:
    """As a person says it: seconds below two minutes, minutes below two hours."""
    if time_s < 120:
        return f"{time_s:.0f} s"
    return f"{time_s / 60:.0f} min" if time_s < 7200 else f"{time_s / 3600:.1f} h"
