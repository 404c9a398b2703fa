"""Estimates of the time, memory and disk that a study takes, by a model that finished runs correct."""

from collections.abc import Sequence
from dataclasses import dataclass

from sealtwin.core.errors import InputError
from sealtwin.core.records import Trajectory
from sealtwin.study.study_folder import StudyRun
from sealtwin.trial.trial_file import Trial

SETUP_S = 0.2
"""Walls, distances and reading the profile, on a core of the machine that the README names; so are the next two."""
LAUNCHES_S = 0.5e-3  # A substep's launches, however many particles there are
PARTICLE_S = 2e-6  # A moving particle's part of a substep
PROCESS_BYTES = 300e6  # Python and its libraries, in a process that has done some runs
WALLS_BYTES = 18e3
"""Distance grid and wall particles, per particle: both get finer with it. 270 and 115 MB at radii of 0.4 and 0.6 mm."""
PARTICLE_BYTES = 240.0  # Position, velocity and age, the search's sorting, and its part of the cells
MOVER_BYTES = 1570.0
"""A moving particle's lists of 224 neighbours, the weights of its 128 pairs, 4 bytes each, and work space."""
RUN_BYTES = 25e3  # Files of a run without its particles
PARTICLE_ROW_BYTES = 75  # A line of particles.csv


@dataclass(frozen=True)
class RunSize:
    """The size of a run, known before it starts."""

    particles: int
    moving: int  # Largest number that move at the same time
    work_s: float  # Computing time on one core, by the model

    @property
    def bytes(self) -> float:
        """The memory of its arrays on the device, for each such run in a launch."""
        return self.particles * PARTICLE_BYTES + self.moving * MOVER_BYTES


@dataclass(frozen=True)
class Estimate:
    """The resources that the waiting runs of a study take."""

    runs: int
    time_s: float
    measured: bool  # True if finished runs have corrected the model, which alone may be off by a factor of three
    memory_bytes: float  # Memory of all processes together
    disk_bytes: float

    @property
    def sentence(self) -> str:
        basis = "by the runs that are done" if self.measured else "by a model; the first runs will correct it"
        return (
            f"{self.runs} runs are left: about {in_words(self.time_s)} ({basis}), {self.memory_bytes / 1e9:.1f} GB of "
            f"memory, {self.disk_bytes / 1e6:.1f} MB on disk."
        )


def size_of(trial: Trial, trajectory: Trajectory, width_mm: float) -> RunSize:
    """Return the size of a run on a crack of mean width ``width_mm``, from which a radius may follow.

    Raises InputError if the path gives no sealant, or more particles than are allowed.
    """
    from simulate.fluid.solver import substeps_for
    from simulate.setup.release_schedule import course_of, plan_releases

    assert trial.fluid is not None, "a study without one is refused"
    solver = trial.solver.for_crack(width_mm)
    schedule = plan_releases(trajectory, solver.size_mm, trial.nozzle.diameter_mm, trial.seed)
    course = course_of(schedule, trial.fluid, solver.settle_s)
    work_s = substeps_for(solver, schedule.frame_s) * (LAUNCHES_S * course.frames + PARTICLE_S * course.moving.sum())
    return RunSize(schedule.particles, int(course.moving.max()), SETUP_S + float(work_s))


def estimate(runs: Sequence[StudyRun], largest: RunSize, jobs: int, batch: int, *, keep_runs: bool) -> Estimate:
    """Estimate what the waiting runs among ``runs`` take with ``jobs`` processes."""
    left = [run for run in runs if run.state == "waiting"]
    jobs, batch = (max(1, min(most, len(left))) for most in (jobs, batch))
    timed = [(run.wall_s, run.work_s) for run in runs if run.state == "done" and run.wall_s is not None]
    pace = sum(wall for wall, _ in timed) / sum(work for _, work in timed) if timed else 1.0
    return Estimate(
        runs=len(left),
        time_s=pace * sum(run.work_s for run in left) / jobs,
        measured=bool(timed),
        memory_bytes=jobs * (PROCESS_BYTES + largest.particles * WALLS_BYTES + batch * largest.bytes),
        disk_bytes=len(left) * (RUN_BYTES + keep_runs * largest.particles * PARTICLE_ROW_BYTES),
    )


def require_disk(expected: Estimate, free_bytes: float, folder: str) -> None:
    """Raises InputError if the results do not fit on the disk."""
    if expected.disk_bytes > free_bytes:
        raise InputError(
            f"{folder}: {free_bytes / 1e6:.0f} MB are free there, the results need {expected.disk_bytes / 1e6:.0f} MB. "
            "Give --out another disk, or leave out --keep-runs."
        )


def require_memory(expected: Estimate, free_bytes: float, device: str, batch: int) -> None:
    """Raises InputError if a launch of ``batch`` runs does not fit a GPU."""
    if expected.memory_bytes > free_bytes:
        raise InputError(
            f"--batch {batch}: that many runs in one launch need {expected.memory_bytes / 1e9:.1f} GB, "
            f"{free_bytes / 1e9:.1f} GB are free on {device}. Give a smaller --batch, or fewer --jobs."
        )


def in_words(time_s: float) -> str:
    """Return a time in seconds below two minutes, in minutes below two hours, else in hours."""
    if time_s < 120:
        return f"{time_s:.0f} s"
    return f"{time_s / 60:.0f} min" if time_s < 7200 else f"{time_s / 3600:.1f} h"
