"""One way to fill a crack, whichever method computes it: frame by frame with particles, or by the fast model."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

from sealtwin.core.errors import NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Outline, Profile, Run, Sample, Solid
from simulate.device import start_warp
from simulate.injection import Injection, prepare
from simulate.profile import measure_profile, volume_ratio
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver
from simulate.setup.wall_particles import Enclosure, enclose
from simulate.slot.run import pour
from simulate.watchers import Watcher

Filled = tuple[Run, Profile]  # A run, with its volume ratio, and its level


def fill(
    sample: Sample,
    fluid: Fluid,
    solver: Solver,
    nozzle: Nozzle,
    *,
    seed: int,
    device: str = "cpu",
    slope: SampleSlope = LEVEL,
    threads: int = 1,
    progress: Progress | None = None,
    watchers: Sequence[Watcher] = (),
) -> Filled:
    """Follow the trajectory, let the sealant settle for ``solver.settle_s`` and measure its level.

    ``solver.model`` names the method. The fast model takes no device and no threads, and calls no watcher. Bit for bit
    the same on one CPU for the same input, seed and number of threads.

    Raises InputError if the settings do not fit the crack, NumericalError if the run has a numerical fault.
    """
    if not solver.has_particles:
        return pour(sample, fluid, solver, nozzle, seed=seed, slope=slope, advise=True)
    progress = progress or Progress()
    how: dict[str, Any] = {"seed": seed, "device": device, "slope": slope, "threads": threads}
    start_warp()
    injection = prepare(sample.solid, sample.outline, sample.trajectory, [fluid], solver, nozzle, **how)
    for remark in injection.remarks_on(0):
        progress.warn(f"note: {remark}")
    follow(injection, progress, watchers)
    (run,) = injection.results()
    if run.escaped_particles:
        progress.warn(
            f"FAULT: {run.escaped_particles} particles went through a wall. Do not use this run; please report it."
        )
    return _measured(run, sample.outline, sample.solid)


def fill_each(
    sample: Sample,
    fluids: Sequence[Fluid],
    solver: Solver,
    nozzle: Nozzle,
    *,
    seed: int,
    device: str,
    slope: SampleSlope = LEVEL,
) -> list[Filled | NumericalError]:
    """Fill one crack with each fluid, all in one launch, with the results that ``fill`` has; no frame is shown.

    Raises InputError if one of the fluids cannot be run, NumericalError if all runs have a fault.
    """
    if not solver.has_particles:
        return [pour(sample, fluid, solver, nozzle, seed=seed, slope=slope) for fluid in fluids]
    injection = ready(sample, fluids, solver, nozzle, seed=seed, device=device, slope=slope)
    # Replayed on a CPU frames take two thirds of the time, with the same bits, if freezing keeps few particles moving:
    # rows are launched for as many as may ever move.
    if all(fluid.freezes for fluid in fluids) and solver.viscosity_solve == "implicit":
        injection.engine.replays = True
    follow(injection, Progress())
    filled: list[Filled | NumericalError] = []
    for outcome in injection.outcomes():
        try:
            filled.append(_measured(outcome, sample.outline, sample.solid) if isinstance(outcome, Run) else outcome)
        except NumericalError as fault:
            filled.append(fault)
    return filled


def ready(
    sample: Sample,
    fluids: Sequence[Fluid],
    solver: Solver,
    nozzle: Nozzle,
    *,
    seed: int,
    device: str,
    slope: SampleSlope = LEVEL,
) -> Injection:
    """Prepare particle runs for their first frame, with the walls of the last call if they are the same.

    Walls take a fifth of a run to make. Raises InputError if one of the fluids cannot be run.
    """
    start_warp()
    enclosure = _enclosure(sample, solver.for_crack(sample.outline.mean_width_mm).size_mm, device)
    how: dict[str, Any] = {"seed": seed, "device": device, "slope": slope, "enclosure": enclosure}
    return prepare(sample.solid, sample.outline, sample.trajectory, fluids, solver, nozzle, **how)


def check(
    sample: Sample, fluid: Fluid, solver: Solver, nozzle: Nozzle, *, seed: int, slope: SampleSlope = LEVEL
) -> None:
    """Prepare a run up to its first frame on this machine's CPU, and drop it. Raises InputError as ``fill`` would."""
    if not solver.has_particles:
        pour(sample, fluid, solver, nozzle, seed=seed, slope=slope)
        return
    ready(sample, [fluid], solver, nozzle, seed=seed, device="cpu", slope=slope)


def follow(injection: Injection, progress: Progress, watchers: Sequence[Watcher] = ()) -> None:
    """Compute every frame that is left, until the last or until nothing moves.

    Raises NumericalError if every run was given up.
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


@lru_cache(maxsize=1)
def _enclosure(sample: Sample, radius_mm: float, device: str) -> Enclosure:
    return enclose(sample.solid, sample.outline, radius_mm, device)


def _measured(run: Run, outline: Outline, solid: Solid) -> Filled:
    health = run.health.model_copy(update={"volume_ratio": volume_ratio(run, solid)})
    return replace(run, health=health), measure_profile(run, outline, solid)
