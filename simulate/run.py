"""The loop of one run: frame after frame, until the profile is taken, with whoever watches it."""

from collections.abc import Sequence
from typing import Protocol

from sealtwin.progress import Progress
from sealtwin.records import Outline, Run, Solid, Trajectory
from simulate.injection import Injection, prepare
from simulate.settings import Fluid, Nozzle, Solver


class Watcher(Protocol):
    """Sees a run as it goes: writes frames, takes pictures, keeps a checkpoint.

    The first of several is the first to begin and the last to see a frame: a checkpoint that is kept has behind it all
    that the others wrote.
    """

    def begin(self, injection: Injection) -> None:
        """Before the first frame of this process; a checkpoint may put the injection further on."""
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
    threads: int = 1,
    watchers: Sequence[Watcher] = (),
) -> Run:
    """Follow the trajectory, then let the sealant settle for ``solver.settle_s``, or until nothing moves.

    Bit for bit the same on one CPU for the same input, seed and number of threads. Raises InputError where the
    settings do not fit the crack, NumericalError where the numbers stop meaning anything.
    """
    injection = prepare(solid, outline, trajectory, [fluid], solver, nozzle, seed=seed, device=device, threads=threads)
    follow(injection, progress, watchers)
    (run,) = injection.results()
    if run.escaped_particles:
        progress.note(
            f"FAULT: {run.escaped_particles} particles went through a wall. Do not use this run; please report it."
        )
    return run


def follow(injection: Injection, progress: Progress, watchers: Sequence[Watcher] = ()) -> None:
    """Every frame that is left, until the last or until nothing moves.

    Raises NumericalError where the numbers of every run stopped meaning anything.
    """
    for watcher in watchers:
        watcher.begin(injection)
    progress.start("Simulating", injection.frames, injection.done)
    while injection.done < injection.frames and not injection.at_rest:
        injection.advance()
        for watcher in reversed(watchers):
            watcher.after_frame(injection)
        progress.advance(injection.done, f"{injection.out} particles, {injection.moving} moving")
