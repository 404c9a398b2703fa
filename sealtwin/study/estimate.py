"""Estimate the size and computing time of the runs of a study. The times of finished runs correct the estimate."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact
from sealtwin.study.study_folder import StudyRun
from simulate.pour import Pour

SETUP_S = 0.2
"""Time in s to prepare walls and distances and to measure the profile, on one core of the machine in docs/accuracy.md.

``REPORT_S`` and ``FAST_S`` were measured on the same machine."""
REPORT_S = 5.0  # Time in s for pictures and report after the last frame
FAST_S = 0.2  # Time in s for a run of the fast model
PARTICLE_BYTES = 240.0  # Memory of one particle in bytes: position, velocity, age and neighbour search
MOVER_BYTES = 1810.0
"""Additional memory of one moving particle in bytes: 224 neighbours of 4 bytes, 128 pairs of 6 bytes, work space."""


@dataclass(frozen=True)
class RunSize:
    """The size of a run, computed before it starts."""

    particles: int
    moving: int  # Largest number of particles that move at the same time
    work_s: float  # Computing time on one core
    substeps: int = 0  # Substeps per frame. All runs of one launch have the same number

    @property
    def bytes(self) -> float:
        """Memory of the run's arrays on the device, in bytes. Each run in a launch needs this memory."""
        return self.particles * PARTICLE_BYTES + self.moving * MOVER_BYTES


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


def slowness(runs: Iterable[StudyRun]) -> float:
    """Return the measured time of the finished runs, divided by their estimated time. 1 if no run is finished."""
    timed = [(run.work_s, run.wall_s) for run in runs if run.state == "done" and run.wall_s is not None]
    return sum(wall_s for _, wall_s in timed) / sum(work_s for work_s, _ in timed) if timed else 1.0


def waiting_s(runs: Iterable[StudyRun]) -> float:
    """Return the estimated time of the waiting runs in s."""
    return sum(run.work_s for run in runs if run.state == "waiting")


def time_left_s(runs: Sequence[StudyRun], jobs: int, elapsed_s: Sequence[float] = ()) -> float:
    """Return the time in s until the waiting runs are finished with ``jobs`` processes.

    ``elapsed_s`` are the times since the start of the runs that are being computed.
    """
    return max(0.0, slowness(runs) * waiting_s(runs) - sum(elapsed_s)) / max(1, jobs)


def require_memory(largest: RunSize, free_bytes: float, device: str, batch: int) -> None:
    """Raise InputError if a launch of ``batch`` runs does not fit into the memory of a GPU."""
    if (needed := batch * largest.bytes) > free_bytes:
        raise InputError(
            f"--batch {batch}: these runs together need {needed / 1e9:.1f} GB, but {free_bytes / 1e9:.1f} GB are free "
            f"on {device}. Give a smaller --batch."
        )
