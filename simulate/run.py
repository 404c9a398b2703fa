"""The loop of one run: all frames until the profile is taken, with watchers."""

from collections.abc import Sequence
from typing import Protocol

from sealtwin.core.progress import Progress
from sealtwin.core.records import Outline, Run, Solid, Trajectory
from simulate.injection import Injection, prepare
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver


class Watcher(Protocol):
    """Called after every frame of a run: writes frames, takes pictures, keeps a checkpoint.

    The first of several watchers begins first and is called last after a frame: when it keeps a checkpoint, the others
    have written theirs.
    """

    def begin(self, injection: Injection) -> None:
        """Called before the first frame of this process; a checkpoint may advance the injection."""
        ...

    def after_frame(self, injection: Injection) -> None: ...


def inject(
    solid: Solid,
    outline: Outline,
    trajectory: Trajectory,
    fluid: Fluid,
    solver: Solver,
    nozzle: Nozzle,
    *,
    seed: int,
    device: str,
    progress: Progress,
    slope: SampleSlope = LEVEL,
    threads: int = 1,
    watchers: Sequence[Watcher] = (),
) -> Run:
    """Follow the trajectory, then let the sealant settle for ``solver.settle_s``, or until nothing moves.

    Bit for bit the same on one CPU for the same input, seed and number of threads. Raises InputError where the
    settings do not fit the crack, NumericalError where the run has a numerical fault.
    """
    sample = solid, outline, trajectory
    injection = prepare(*sample, [fluid], solver, nozzle, seed=seed, device=device, slope=slope, threads=threads)
    for remark in injection.remarks_on(0):
        progress.warn(f"note: {remark}")
    follow(injection, progress, watchers)
    (run,) = injection.results()
    if run.escaped_particles:
        progress.warn(
            f"FAULT: {run.escaped_particles} particles went through a wall. Do not use this run; please report it."
        )
    return run


def follow(injection: Injection, progress: Progress, watchers: Sequence[Watcher] = ()) -> None:
    """Compute every frame that is left, until the last or until nothing moves.

    Raises NumericalError where every run was given up.
    """
    for watcher in watchers:
        watcher.begin(injection)
    work = injection.work
    progress.start("Simulating", work[-1], work[injection.done])
    while injection.done < injection.frames and not injection.at_rest:
        injection.advance()
        for watcher in reversed(watchers):
            watcher.after_frame(injection)
        progress.advance(work[injection.done], f"{injection.out} particles, {injection.moving} moving")
