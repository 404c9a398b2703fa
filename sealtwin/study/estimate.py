"""Estimate the time, memory and disk space of a study with a model. The times of finished runs correct the model."""

import heapq
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import log

from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact
from sealtwin.core.progress import in_words
from sealtwin.study.study_folder import StudyRun
from simulate.pour import Pour

SETUP_S = 0.2
"""Time in s to prepare walls and distances and to measure the profile, on one core of the machine in docs/accuracy.md.

``REPORT_S`` and ``FAST_S`` were measured on the same machine."""
REPORT_S = 5.0  # Time in s for pictures and report after the last frame
FAST_S = 0.2  # Time in s for a run of the fast model
PROCESS_BYTES = 300e6  # Memory of Python and its libraries in a worker process, in bytes
WALLS_BYTES = 18e3
"""Memory of the distance grid and the wall particles, in bytes per particle of sealant.

In total this is 270 MB for a particle radius of 0.4 mm, and 115 MB for 0.6 mm."""
PARTICLE_BYTES = 240.0  # Memory of one particle in bytes: position, velocity, age and neighbour search
MOVER_BYTES = 1810.0
"""Additional memory of one moving particle in bytes: 224 neighbours of 4 bytes, 128 pairs of 6 bytes, work space."""
TIME_TOLERANCE = 0.1  # Largest relative difference of the expected times of runs of about the same size
OVERDUE = 0.1  # Remaining time of a run that takes longer than expected, as a fraction of its time so far
RUN_BYTES = 25e3  # Size of a run's files in bytes, without fill.npz
FILL_PARTICLE_BYTES = 25  # Size of fill.npz in bytes per particle, as measured


@dataclass(frozen=True)
class RunSize:
    """The size of a run, computed before it starts."""

    particles: int
    moving: int  # Largest number of particles that move at the same time
    work_s: float  # Computing time on one core, estimated by the model
    substeps: int = 0  # Substeps per frame. All runs of one launch have the same number

    @property
    def bytes(self) -> float:
        """Memory of the run's arrays on the device, in bytes. Each run in a launch needs this memory."""
        return self.particles * PARTICLE_BYTES + self.moving * MOVER_BYTES


@dataclass(frozen=True)
class Estimate:
    """The resources that the waiting runs of a study need."""

    runs: int
    time_s: float  # Time until the last run is finished
    processor_s: float  # Total computing time of all runs
    measured: bool  # True if finished runs have corrected the model. Otherwise, it may be wrong by a factor of three
    memory_bytes: float  # Memory of all processes
    disk_bytes: float

    @property
    def sentence(self) -> str:
        basis = "from the finished runs" if self.measured else "from a model, which the first runs will correct"
        return (
            f"{self.runs} runs to compute: about {in_words(self.time_s)}, {in_words(self.processor_s)} of computing "
            f"time ({basis}), {self.memory_bytes / 1e9:.1f} GB of memory, {self.disk_bytes / 1e6:.1f} MB on disk."
        )


def size_of(pour: Pour) -> RunSize:
    """Return the size of a run. Raises the same errors as ``checked_size``."""
    return checked_size(pour)[0]


def checked_size(pour: Pour) -> tuple[RunSize, list[Fact]]:
    """Return the size of a run, and warnings about its settings and about sealant properties that it cannot represent.

    Raises InputError if the settings cannot be used for the crack, if the path dispenses no sealant or more particles
    than are allowed, or if the sealant is too viscous for particles of this size.
    """
    if not pour.solver.has_particles:
        return RunSize(0, 0, FAST_S), [*pour.doubts]
    from simulate.injection import case_of
    from simulate.remarks import remarks_on
    from simulate.setup.release_schedule import PARTICLE_S

    case = case_of(pour)
    (course,), pour = case.courses, case.pour
    work_s = SETUP_S + float(PARTICLE_S * case.substeps * course.work.sum())
    size = RunSize(case.schedule.particles, int(course.moving.max()), work_s, case.substeps)
    return size, [*pour.doubts, *remarks_on(pour, case.schedule)]


@dataclass
class WorkAhead:
    """Time that the model expects for the work of a command that has not begun."""

    model_s: float = 0.0


Timing = tuple[float, float]
"""Computing time of a finished run in s: the model's estimate, and the measured time."""


def estimate(
    runs: Sequence[StudyRun],
    largest: RunSize,
    jobs: int,
    batch: int,
    timings: Sequence[Timing] = (),
) -> Estimate:
    """Estimate the resources that the waiting runs in ``runs`` need with ``jobs`` processes.

    The finished runs in ``runs``, and ``timings`` of other runs, correct the model.
    """
    waiting = [run for run in runs if run.state == "waiting"]
    jobs, batch = (max(1, min(most, len(waiting))) for most in (jobs, batch))
    timed = [*timings, *timings_of(runs)]
    expected_s = [expected_time(run.work_s, timed) for run in waiting]
    return Estimate(
        runs=len(waiting),
        time_s=time_of_all(expected_s, [0.0] * jobs),
        processor_s=sum(expected_s),
        measured=bool(timed),
        memory_bytes=jobs * (PROCESS_BYTES + largest.particles * WALLS_BYTES + batch * largest.bytes),
        disk_bytes=len(waiting) * (RUN_BYTES + largest.particles * FILL_PARTICLE_BYTES),
    )


def timings_of(runs: Iterable[StudyRun]) -> list[Timing]:
    return [(run.work_s, run.wall_s) for run in runs if run.state == "done" and run.wall_s is not None]


def expected_time(work_s: float, timings: Sequence[Timing]) -> float:
    """Return the expected time of a run in s: the model's ``work_s``, corrected by ``timings`` of runs of similar size.

    Timings of other sizes are not used, because the model's error depends on the particle radius.
    """
    if not timings:
        return work_s
    apart = [abs(log(work / work_s)) for work, _ in timings]
    near = [timing for timing, far in zip(timings, apart, strict=True) if far <= min(apart) + TIME_TOLERANCE]
    return work_s * sum(wall for _, wall in near) / sum(work for work, _ in near)


def time_of_all(waiting_s: Iterable[float], busy_s: Sequence[float]) -> float:
    """Return the time until all tasks are finished, in s.

    ``busy_s`` is the remaining time of each process's current task, and ``waiting_s`` the time of each waiting task.
    Waiting tasks are started in this order.
    """
    free = [*busy_s]
    heapq.heapify(free)
    for task_s in waiting_s:
        heapq.heappushpop(free, free[0] + task_s)
    return max(free)


class Forecast:
    """Estimate the remaining time of a study while its launches are computed."""

    def __init__(self, jobs: int, timings: Sequence[Timing]) -> None:
        self._jobs, self._timings = max(1, jobs), [*timings]
        self._begun: dict[str, float] = {}
        self._reports: dict[str, tuple[float, float]] = {}  # Remaining time of a launch, and the time of this report

    def begin(self, key: str, now_s: float) -> None:
        """Record that a launch begins. ``key`` is the key of the launch's first run."""
        self._begun[key] = now_s

    def finish(self, key: str, runs: Iterable[StudyRun]) -> None:
        """Record that a launch has ended. ``runs`` are the runs of the launch with their outcomes."""
        self._begun.pop(key, None)
        self._reports.pop(key, None)
        self._timings += timings_of(runs)

    def report(self, key: str, left_s: float | None) -> None:
        """Record the remaining time that a running launch has reported. None is ignored."""
        if left_s is not None:
            self._reports[key] = left_s, time.monotonic()

    def done_s(self, groups: Iterable[Sequence[StudyRun]], now_s: float) -> float:
        """Return the work that the running launches have finished, in seconds of the model."""
        done_s = 0.0
        for group in groups:
            work_s, taken_s = sum(run.work_s for run in group), now_s - self._begun.get(group[0].key, now_s)
            done_s += work_s * taken_s / max(taken_s + self._busy_s(group, taken_s, now_s), 1e-9)
        return done_s

    def left_s(self, groups: Iterable[Sequence[StudyRun]], now_s: float) -> float:
        """Return the time until all launches in ``groups`` are finished, in s. A launch is running or waiting."""
        groups, busy_s, timings = [*groups], dict[str, float](), [*self._timings]
        for group in groups:
            key = group[0].key
            if (begun_s := self._begun.get(key)) is not None:
                busy_s[key] = self._busy_s(group, now_s - begun_s, now_s)
                if key in self._reports:
                    timings.append((sum(run.work_s for run in group), now_s - begun_s + busy_s[key]))
        waiting = (group for group in groups if group[0].key not in busy_s)
        waiting_s = [sum(expected_time(run.work_s, timings) for run in group) for group in waiting]
        return time_of_all(waiting_s, [*busy_s.values()] + [0.0] * (self._jobs - len(busy_s)))

    def _busy_s(self, group: Sequence[StudyRun], taken_s: float, now_s: float) -> float:
        """Return the remaining time of a running launch in s. ``taken_s`` is its time so far."""
        if (report := self._reports.get(group[0].key)) is not None:
            left_s, at_s = report
            return max(left_s - (now_s - at_s), 0.0)
        expected_s = sum(expected_time(run.work_s, self._timings) for run in group)
        return max(expected_s - taken_s, OVERDUE * taken_s)

    def scaled_s(self, model_s: float) -> float:
        """Return a time from the model, corrected by the times of all finished runs."""
        if not self._timings:
            return model_s
        return model_s * sum(wall for _, wall in self._timings) / sum(work for work, _ in self._timings)


def require_disk(expected: Estimate, free_bytes: float, folder: str) -> None:
    """Raise InputError if the results do not fit on the disk."""
    if expected.disk_bytes > free_bytes:
        raise InputError(
            f"{folder}: {free_bytes / 1e6:.0f} MB are free, but the results need {expected.disk_bytes / 1e6:.0f} MB. "
            "Give a folder on another disk as --out."
        )


def require_memory(expected: Estimate, free_bytes: float, device: str, batch: int) -> None:
    """Raise InputError if a launch of ``batch`` runs does not fit into the memory of a GPU."""
    if expected.memory_bytes > free_bytes:
        raise InputError(
            f"--batch {batch}: these runs together need {expected.memory_bytes / 1e9:.1f} GB, but "
            f"{free_bytes / 1e9:.1f} GB are free on {device}. Give a smaller --batch, or fewer --jobs."
        )
