"""Fill a crack with the method that the settings choose: with particles, frame by frame, or with the fast model."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.errors import NumericalError
from sealtwin.core.facts import Fact
from sealtwin.core.progress import in_words
from sealtwin.core.records import Profile, Run
from simulate.device import start_warp
from simulate.injection import SUBSTEP_FACTORS, ComputeOptions, Injection, case_of, prepare
from simulate.pour import Pour
from simulate.profile import CELL_MM, measure_profile, over_cavity, volume_ratio
from simulate.setup.release_schedule import PARTICLE_S, frames_to_freeze
from simulate.setup.signed_distance import surface_of
from simulate.setup_checks import check_outlet
from simulate.shear_law import power_at_rest
from simulate.slot.run import pour as pour_fast
from simulate.vessel import vessel_of

SMOOTHED = 10.0
"""Length, in particle radii, over which the change of a level is averaged, because single particles move in sealant at
rest. Within this distance of the sealant that the nozzle released last, the change is ignored."""
PLACES = 0.95  # Fraction of the positions at which the distance from rest is at most the reported distance
WORTH_SAYING_S = 20.0  # If the expected time of a run, in s, is longer, it is printed at the start
Filled = tuple[Run, Profile]  # A run with its volume ratio, and the run's level


def fill(pour: Pour, options: ComputeOptions | None = None) -> Filled:
    """Pour the only fluid along the trajectory, let it settle for ``solver.settle_s``, and measure its level.

    ``solver.model`` selects the method. The fast model ignores the options. On the same CPU, the same input and seed
    give bit-identical results with any number of threads. Raises InputError if the settings do not fit the crack.
    Raises NumericalError if the run has a numerical fault.
    """
    (outcome,) = fill_each(pour, options or ComputeOptions())
    if isinstance(outcome, NumericalError):
        raise outcome
    return outcome


def fill_each(pour: Pour, options: ComputeOptions) -> list[Filled | NumericalError]:
    """Fill one crack with each of several fluids in one launch. The results equal the results of ``fill``.

    A run with a numerical fault is computed again with twice the substeps, and again up to the last factor of
    ``SUBSTEP_FACTORS``. If it still fails, or if the user set the number of substeps, the error is the
    result. Raises InputError if one of the fluids cannot be simulated.
    """
    for fluid in pour.each:
        for doubt in fluid.doubts:
            options.progress.warn(doubt)
    if not pour.solver.has_particles:
        return [pour_fast(fluid) for fluid in pour.each]
    injection = _computed(pour, options, max([1, *(watcher.finer for watcher in options.watchers)]))
    return [_result(pour, options, injection, number, outcome) for number, outcome in enumerate(injection.outcomes())]


def check(pour: Pour) -> None:
    """Raise InputError for the same inputs as ``fill``, without computing a run.

    Wall particles are not made, because that takes seconds.
    """
    if not pour.solver.has_particles:
        pour_fast(pour)
        return
    start_warp()
    case, sample = case_of(pour), pour.sample
    surface = surface_of(sample.solid, case.pour.solver.size_mm, "cpu")
    check_outlet(case.schedule, sample.trajectory, sample.outline, surface, diameter_mm=pour.nozzle.size_mm)


def run_to_end(injection: Injection, options: ComputeOptions) -> None:
    """Compute the remaining frames, until the last frame or until nothing moves.

    Raises NumericalError if every run has failed.
    """
    progress, watchers, work = options.progress, options.watchers, injection.work
    for watcher in watchers:
        watcher.begin(injection)
    progress.start("Simulating", work[-1], work[injection.done])
    model_s = PARTICLE_S * injection.engine.substeps * float(work[-1] - work[injection.done]) + progress.later_s
    if model_s > WORTH_SAYING_S and injection.engine.state.device == "cpu":
        progress.note(f"The run takes about {in_words(model_s)} (estimate). A better one follows after a tenth.")
    while injection.done < injection.frames and not injection.at_rest:
        injection.advance()
        for watcher in reversed(watchers):
            watcher.after_frame(injection)
        progress.advance(work[injection.done], f"{injection.out} particles, {injection.moving} moving")


def _computed(pour: Pour, options: ComputeOptions, finer: int, shown: Collection[Fact] = ()) -> Injection:
    """Compute all runs of a launch. Failed runs are in ``Injection.failed``. Warnings in ``shown`` are not printed."""
    injection = prepare(pour, options, finer)
    for remark in injection.remarks_on(0):
        if remark not in shown:
            options.progress.warn(remark)
    try:
        run_to_end(injection, options)
    except NumericalError:
        if len(injection.failed) < len(pour.fluids):
            raise
    return injection


def _result(
    pour: Pour, options: ComputeOptions, injection: Injection, number: int, outcome: Run | NumericalError
) -> Filled | NumericalError:
    """Measure a run of a launch. If the run failed, compute it again by itself, with twice the substeps."""
    if not isinstance(outcome, NumericalError):
        if outcome.escaped_particles:
            escaped = outcome.escaped_particles
            text = f"{escaped} particles went through a wall. Do not use this run, and please report it."
            options.progress.warn(Fact("fluid.escaped", text, escaped, level="fault"), "fault")
        try:
            return _measured(injection, outcome, number)
        except NumericalError as fault:
            return fault
    if pour.solver.substeps is not None or injection.finer == SUBSTEP_FACTORS[-1]:
        return outcome
    options = replace(options, watchers=options.watchers if number == 0 else ())
    alone = pour.each[number]
    again = _computed(alone, options, 2 * injection.finer, injection.remarks_on(number))
    (outcome,) = again.outcomes()
    return _result(alone, options, again, 0, outcome)


def _measured(injection: Injection, run: Run, number: int) -> Filled:
    sample, doubts = injection.pour.sample, injection.pour.each[number].doubts
    level = measure_profile(run, sample.outline, sample.solid)
    figures = {"volume_ratio": volume_ratio(run, sample.solid), **_rest(injection, run, level, number)}
    return replace(run, health=run.health.model_copy(update=figures), doubts=doubts), level


def _rest(injection: Injection, run: Run, level: Profile, number: int) -> dict[str, float | None]:
    """Return ``to_rest_mm``, the distance of a level from the level at rest, which 95 % of the positions do not exceed.

    Also returns ``flat_mm``, the level at rest of a fluid without a yield stress that does not freeze. It is None for
    other fluids, on a slope, and above the face. The level of other fluids approaches rest as 1 / t^n, where t is the
    time since the last release (Matson and Hogg 2007, doi:10.1016/j.jnnfm.2006.05.003). The remaining change is
    therefore computed from the change since frame ``looks_back``. If there was no settling, the change itself is used,
    which is a lower bound behind the nozzle.
    """
    pour, schedule, s_mm = injection.pour, injection.schedule, level.s_mm
    solid, outline, fluid = pour.sample.solid, pour.sample.outline, pour.fluids[number]
    flat_mm, off_mm = None, np.zeros_like(s_mm)
    if not (fluid.yields or fluid.freezes) and pour.slope.level:
        inside = (over_cavity(run.position_mm, solid) & ~run.spilled).sum()
        flat_mm = vessel_of(solid, CELL_MM).flat_mm(inside * run.particle_volume_mm3)
    if flat_mm is not None:
        off_mm = level.level_mm - np.maximum(flat_mm, -solid.depth_at_mm(s_mm))
    elif len(injection.earlier_mm) and not injection.at_rest:
        earlier = replace(run, position_mm=injection.earlier_mm[number * run.particles :][: run.particles])
        off_mm = level.level_mm - measure_profile(earlier, outline, solid).level_mm
        since, ends = (frame - len(schedule.released) for frame in (injection.looks_back, injection.done))
        if since > 0:
            n = power_at_rest(fluid.law, fluid.flow_index or 1.0)
            frozen = max(ends, frames_to_freeze(fluid, schedule.frame_s))
            off_mm *= (1 - (ends / frozen) ** n) / ((ends / since) ** n - 1)
        else:
            late_mm = schedule.position_mm[schedule.frame_of >= injection.looks_back, :2]
            fed_mm = arc_length_at(late_mm, outline.centreline_mm)
            off_mm[np.abs(s_mm - fed_mm.mean()) < np.ptp(fed_mm) / 2 + SMOOTHED * run.radius_mm] = 0.0
    smooth_mm = uniform_filter1d(off_mm, round(SMOOTHED * run.radius_mm / s_mm[1]))
    return {"flat_mm": flat_mm, "to_rest_mm": float(np.quantile(np.abs(smooth_mm), PLACES))}
