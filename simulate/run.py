"""Fill a crack with the method that the settings choose: frame by frame with particles, or by the fast model."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.errors import NumericalError
from sealtwin.core.facts import Fact
from sealtwin.core.progress import Progress, in_words
from sealtwin.core.records import Profile, Run, Sample
from simulate.device import start_warp
from simulate.injection import FINER, Injection, case_of, prepare
from simulate.profile import CELL_MM, measure_profile, over_cavity, volume_ratio
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver, doubts_of_run
from simulate.setup.release_schedule import PARTICLE_S, frames_to_freeze
from simulate.setup.signed_distance import surface_of
from simulate.setup.wall_particles import Enclosure, enclose
from simulate.setup_checks import check_outlet, resolved
from simulate.slot.run import pour
from simulate.vessel import vessel_of
from simulate.watchers import Watcher

SMOOTHED = 10.0
"""Radii over which the change of a level is averaged, since single particles move in a bed at rest, and around sealant
that the nozzle has just left, where it is not judged."""
PLACES = 0.95  # Share of the places whose distance from rest is within the reported one
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
    for doubt in doubts_of_run(sample.outline, sample.solid, fluid, nozzle, slope):
        progress.warn(doubt.text)
    if not solver.has_particles:
        return pour(sample, fluid, solver, nozzle, seed=seed, slope=slope, advise=True)
    how: dict[str, Any] = {"seed": seed, "device": device, "slope": slope, "threads": threads}
    start_warp()
    begin = partial(prepare, sample, [fluid], solver, nozzle, **how)
    injection = _followed(begin, progress, watchers)
    (run,) = injection.results()
    if run.escaped_particles:
        progress.warn(
            f"{run.escaped_particles} particles went through a wall. Do not use this run; please report it.", "fault"
        )
    return _measured(injection, run)


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
                again = _followed(alone, Progress(), watchers if number == 0 else (), finer=2)
                filled.append(_measured(again, again.results()[0]))
            else:
                filled.append(_measured(injection, outcome, number))
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
    _, sized = resolved(sample, fluids[0], solver, nozzle)
    enclosure = _enclosure(sample, sized.size_mm, device)
    how: dict[str, Any] = {"seed": seed, "device": device, "slope": slope, "enclosure": enclosure, "finer": finer}
    return prepare(sample, fluids, solver, nozzle, **how)


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
    case = case_of(sample, [fluid], solver, nozzle, seed=seed, slope=slope)
    surface = surface_of(sample.solid, case.solver.size_mm, "cpu")
    check_outlet(case.schedule, sample.trajectory, sample.outline, surface, diameter_mm=nozzle.diameter_mm)


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
    finer, shown = max([finer, *(watcher.finer for watcher in watchers)]), set[Fact]()
    while True:
        injection = begin(finer=finer)
        remarks = injection.remarks_on(0)
        for remark in remarks:
            if remark not in shown:
                progress.warn(remark.text)
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


def _measured(injection: Injection, run: Run, number: int = 0) -> Filled:
    crack = injection.outline, injection.solid
    level = measure_profile(run, *crack)
    figures = {"volume_ratio": volume_ratio(run, injection.solid), **_rest(injection, run, level, number)}
    doubts = doubts_of_run(*crack, injection.fluids[number], injection.nozzle, injection.slope)
    return replace(run, health=run.health.model_copy(update=figures), doubts=doubts), level


def _rest(injection: Injection, run: Run, level: Profile, number: int) -> dict[str, float | None]:
    """Return how far a level is from that at rest, ``to_rest_mm``, at 95 % of the places.

    A fluid without yield stress that does not freeze has a flat level at rest, ``flat_mm``, if it is below the face of
    a level sample. The level of others approaches rest as 1 / t^n, t being the time since the last sealant was released
    (Matson and Hogg 2007, doi:10.1016/j.jnnfm.2006.05.003), so its change since frame ``looks_back`` shows what is
    left. Without settling, what is left behind the nozzle is as much at least.
    """
    solid, fluid, schedule, s_mm = injection.solid, injection.fluids[number], injection.schedule, level.s_mm
    flat_mm, off_mm = None, np.zeros_like(s_mm)
    if not (fluid.yields or fluid.freezes) and injection.slope.level:
        inside = (over_cavity(run.position_mm, solid) & ~run.spilled).sum()
        flat_mm = vessel_of(solid, CELL_MM).flat_mm(inside * run.particle_volume_mm3)
    if flat_mm is not None:
        off_mm = level.level_mm - np.maximum(flat_mm, -solid.depth_at_mm(s_mm))
    elif len(injection.earlier_mm) and not injection.at_rest:
        earlier = replace(run, position_mm=injection.earlier_mm[number * run.particles :][: run.particles])
        off_mm = level.level_mm - measure_profile(earlier, injection.outline, solid).level_mm
        since, ends = (frame - len(schedule.released) for frame in (injection.looks_back, injection.done))
        if since > 0:
            n, frozen = fluid.flow_index or 1.0, max(ends, frames_to_freeze(fluid, schedule.frame_s))
            off_mm *= (1 - (ends / frozen) ** n) / ((ends / since) ** n - 1)
        else:
            late_mm = schedule.position_mm[schedule.frame_of >= injection.looks_back, :2]
            fed_mm = arc_length_at(late_mm, injection.outline.centreline_mm)
            off_mm[np.abs(s_mm - fed_mm.mean()) < np.ptp(fed_mm) / 2 + SMOOTHED * run.radius_mm] = 0.0
    smooth_mm = uniform_filter1d(off_mm, round(SMOOTHED * run.radius_mm / s_mm[1]))
    return {"flat_mm": flat_mm, "to_rest_mm": float(np.quantile(np.abs(smooth_mm), PLACES))}
