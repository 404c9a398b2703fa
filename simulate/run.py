"""Fill a crack with the method that the settings choose: frame by frame with particles, or by the fast model."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

from sealtwin.core.errors import NumericalError
from sealtwin.core.progress import Progress, in_words
from sealtwin.core.records import Outline, Profile, Run, Sample, Solid
from simulate.device import start_warp
from simulate.injection import FINER, Injection, case_of, prepare
from simulate.profile import measure_profile, volume_ratio
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver, doubts_of_run
from simulate.setup.release_schedule import PARTICLE_S
from simulate.setup.signed_distance import surface_of
from simulate.setup.wall_particles import Enclosure, enclose
from simulate.slot.run import pour
from simulate.watchers import Watcher

WORTH_SAYING_S = 20.0  # Time above which a run says at its start how long it takes
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

    ``solver.model`` is the method. The fast model ignores device, threads and watchers. On one CPU, the same input,
    seed and number of threads give the same bits.

    Raises InputError if the settings do not fit the crack, and NumericalError if the run has a numerical fault.
    """
    progress = progress or Progress()
    doubts = doubts_of_run(sample.outline, sample.solid, fluid, nozzle, slope)
    for doubt in doubts:
        progress.warn(f"note: {doubt}")
    if not solver.has_particles:
        return pour(sample, fluid, solver, nozzle, seed=seed, slope=slope, advise=True)
    how: dict[str, Any] = {"seed": seed, "device": device, "slope": slope, "threads": threads}
    start_warp()
    begin = partial(prepare, sample.solid, sample.outline, sample.trajectory, [fluid], solver, nozzle, **how)
    (run,) = _followed(begin, progress, watchers).results()
    if run.escaped_particles:
        progress.warn(
            f"FAULT: {run.escaped_particles} particles went through a wall. Do not use this run; please report it."
        )
    return _measured(replace(run, doubts=doubts), sample.outline, sample.solid)


def fill_each(
    sample: Sample,
    fluids: Sequence[Fluid],
    solver: Solver,
    nozzle: Nozzle,
    *,
    seed: int,
    device: str,
    slope: SampleSlope = LEVEL,
    watchers: Sequence[Watcher] = (),
) -> list[Filled | NumericalError]:
    """Fill one crack with each of several fluids in one launch. The results are those of ``fill`` for each fluid.

    A run with a numerical fault has its error as its result. ``watchers`` see the first run only; the fast model
    ignores them.

    Raises InputError if one of the fluids cannot be run.
    """
    if not solver.has_particles:
        return [pour(sample, fluid, solver, nozzle, seed=seed, slope=slope) for fluid in fluids]
    how: dict[str, Any] = {"seed": seed, "device": device, "slope": slope}
    injection = ready(sample, fluids, solver, nozzle, **how)
    # On a CPU replayed frames take two thirds of the time, with the same bits, if few particles move because of
    # freezing: a replay launches rows for the largest number that can move.
    if all(fluid.freezes for fluid in fluids) and solver.viscosity_solve == "implicit":
        injection.engine.replays = True
    try:
        follow(injection, Progress(), watchers)
    except NumericalError:
        # If all runs failed, each outcome has its own error.
        if len(injection.failed) < len(fluids):
            raise
    filled: list[Filled | NumericalError] = []
    for number, outcome in enumerate(injection.outcomes()):
        try:
            if isinstance(outcome, NumericalError):
                if solver.substeps is not None:
                    raise outcome
                alone = partial(ready, sample, [fluids[number]], solver, nozzle, **how)
                (outcome,) = _followed(alone, Progress(), watchers if number == 0 else (), finer=2).results()
            filled.append(_measured(outcome, sample.outline, sample.solid))
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
    finer: int = 1,
) -> Injection:
    """Prepare particle runs for their first frame. The last call's walls are reused if they fit.

    They fit if sample, particle radius and device are the same: making walls takes a fifth of a run's time. Raises
    InputError if one of the fluids cannot be run.
    """
    start_warp()
    enclosure = _enclosure(sample, solver.for_crack(sample.outline.mean_width_mm, nozzle).size_mm, device)
    how: dict[str, Any] = {"seed": seed, "device": device, "slope": slope, "enclosure": enclosure, "finer": finer}
    return prepare(sample.solid, sample.outline, sample.trajectory, fluids, solver, nozzle, **how)


def check(
    sample: Sample, fluid: Fluid, solver: Solver, nozzle: Nozzle, *, seed: int, slope: SampleSlope = LEVEL
) -> None:
    """Raise InputError for the inputs for which ``fill`` raises it.

    Wall particles are not built, because that takes seconds.
    """
    if not solver.has_particles:
        pour(sample, fluid, solver, nozzle, seed=seed, slope=slope)
        return
    start_warp()
    crack, path = (sample.solid, sample.outline), sample.trajectory
    case = case_of(*crack, path, [fluid], solver, nozzle, seed=seed, slope=slope)
    case.check_outlet(surface_of(sample.solid, case.solver.size_mm, "cpu"), sample.outline, path, nozzle, seed)


def follow(injection: Injection, progress: Progress, watchers: Sequence[Watcher] = ()) -> None:
    """Compute the remaining frames, until the last one or until nothing moves.

    Raises NumericalError if every run was given up.
    """
    for watcher in watchers:
        watcher.begin(injection)
    work = injection.work
    progress.start("Simulating", work[-1], work[injection.done])
    model_s = PARTICLE_S * injection.engine.substeps * float(work[-1] - work[injection.done]) + progress.later_s
    if model_s > WORTH_SAYING_S and injection.engine.state.device == "cpu":
        progress.note(f"All of it takes about {in_words(model_s)}, by a model; the first tenth will correct it.")
    while injection.done < injection.frames and not injection.at_rest:
        injection.advance()
        for watcher in reversed(watchers):
            watcher.after_frame(injection)
        progress.advance(work[injection.done], f"{injection.out} particles, {injection.moving} moving")


def _followed(
    begin: Callable[..., Injection], progress: Progress, watchers: Sequence[Watcher] = (), *, finer: int = 1
) -> Injection:
    """Compute a run. If it fails, compute it anew with twice the substeps, unless their number is given.

    ``begin`` prepares the run for a keyword ``finer``. Raises NumericalError if the run fails with all of ``FINER``.
    """
    finer, shown = max([finer, *(watcher.finer for watcher in watchers)]), set[str]()
    while True:
        injection = begin(finer=finer)
        remarks = injection.remarks_on(0)
        for remark in remarks:
            if remark not in shown:
                progress.warn(f"note: {remark}")
        shown.update(remarks)
        try:
            follow(injection, progress, watchers)
        except NumericalError:
            if injection.solver.substeps is not None or finer == FINER[-1]:
                raise
            finer *= 2
        else:
            return injection


@lru_cache(maxsize=1)
def _enclosure(sample: Sample, radius_mm: float, device: str) -> Enclosure:
    return enclose(sample.solid, sample.outline, radius_mm, device)


def _measured(run: Run, outline: Outline, solid: Solid) -> Filled:
    health = run.health.model_copy(update={"volume_ratio": volume_ratio(run, solid)})
    return replace(run, health=health), measure_profile(run, outline, solid)
