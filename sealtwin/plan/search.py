"""Search for the numbers of a plan with the fast model, within bounds.

The numbers of a plan are the flow and the speed at knots along the path, and the dwell time at each end. Particle runs
correct the fast model (space mapping, Bandler et al. 1994).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from digitise.robots.cell import PumpTable, RobotCell
from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory
from sealtwin.core.arc_length import arc_length
from sealtwin.core.arrays import midpoints
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile, Sample, Trajectory
from simulate.pour import Pour
from simulate.slot.fill import Filled, HerschelBulkley
from simulate.slot.run import bed_of
from simulate.slot.sections import Trapezoids

CELLS, STEPS = 32, 60
"""Numbers of cells and time steps of the fast model in a search, which takes a third of the usual time.

The discrepancy (particles minus fast model) includes the resulting change of level."""
OVER_WEIGHT = 1.3  # Weight of overfill relative to underfill
BEND_WEIGHT, SPEED_WEIGHT, DWELL_WEIGHT = 0.02, 0.01, 0.004
"""Weights of the smoothness of flow and speed, of the difference from the trial's speed, and of the dwell times.

They are relative to the weight of the areas' mean relative error. The smoothness is measured by second differences, the
difference of speed by a logarithm, and the dwell times in s. The weights are small, and cost a plan about 1 % of its
gain."""
MAX_STEPS, WIDEST, ENOUGH, TINY = 16, 0.5, 0.02, 1e-9
"""Constants of the search: the largest number of steps, the widest step (in logarithms and seconds), the smallest
relative gain, and a positive number close to 0.

If the gain of a step is smaller than the smallest gain, the slopes are computed again. If they are already new, the
search ends."""
STEP = 2e-2  # Step for computing slopes, in logarithms and seconds. It is far above the model's iteration tolerance
DECIMALS = 3
"""Number of decimals to which the result of a search is rounded.

Further decimals depend on the processor, because BLAS adds numbers in different orders. Even a small difference makes
particle runs diverge."""
SMOOTHED_MM = 3.0  # Standard deviation in mm for smoothing a discrepancy. The level of one run has a noise of 0.2 mm
LONGEST_DWELL_S = 5.0  # Longest dwell time in s at each end. A longer time would overfill the end
SHORTEST_S = 1e-6  # Smallest difference between two bounds, for example for a pump with only one flow
SLOWER, FASTER = 4.0, 2.0  # Largest factors by which a plan may be slower or faster than the trial
SMALLEST_SHARE = 0.02  # Smallest flow without a pump's table, as a fraction of the trial's flow
LARGEST_MM3_S = 1e4  # Largest flow without a cell and without --flow-max-mm3-s. This is more than a lab's pump gives


@dataclass(frozen=True)
class Limits:
    flow_mm3_s: tuple[float, float]
    speed_mm_s: tuple[float, float]


@dataclass(frozen=True)
class Knots:
    """Path of a trial, with knots at which flow and speed are chosen.

    The knots are evenly spaced along the part of the path that dispenses sealant. Between knots, the logarithms of flow
    and speed are linear. Robot programs cannot stop on the path, so the nozzle dwells by moving very slowly over the
    first and the last step of that part.
    """

    path: Trajectory
    count: int

    def trajectory(self, plan: Floats) -> Trajectory:
        """Return the path with the flow and speed of a plan.

        ``plan`` contains the logarithms of flow in mm3/s and of speed in mm/s at the knots, and the dwell times in s.
        """
        part = self.path.giving
        steps = slice(part.start, part.stop - 1)
        way_mm = arc_length(self.path.position_mm[part])
        middle = midpoints(way_mm) / way_mm[-1] * (self.count - 1)
        knots = np.arange(self.count)
        flow, speed = (np.exp(np.interp(middle, knots, part_of)) for part_of in self.parts(plan)[:2])
        lasts_s = np.diff(self.path.t_s)
        # On a ramp, the trial's path is slower and its flow is smaller. The plan keeps these ratios.
        ramp = self.path.speed_mm_s[steps] / self.path.speed_mm_s[steps].max()
        given_s = np.diff(way_mm) / (speed * ramp)
        volume_mm3 = flow * ramp * given_s
        for end, dwell_s in zip((0, -1), self.parts(plan)[2], strict=True):
            given_s[end] += dwell_s
            volume_mm3[end] += flow[end] * dwell_s
        lasts_s[steps] = given_s
        flow_mm3_s = np.zeros(len(self.path.t_s))
        flow_mm3_s[steps] = volume_mm3 / given_s
        t_s = self.path.t_s[0] + np.cumulative_sum(lasts_s, include_initial=True)
        speed_mm_s = np.append(np.diff(arc_length(self.path.position_mm)) / lasts_s, 0.0)
        return replace(self.path, t_s=t_s, speed_mm_s=speed_mm_s, flow_mm3_s=flow_mm3_s)

    def parts(self, plan: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the parts of a plan: logarithms of flow and of speed, (count,) each, and the dwell times, (2,)."""
        return plan[: self.count], plan[self.count : -2], plan[-2:]

    def first_guess(self, area_mm2: Floats, s_mm: Floats, limits: Limits) -> Floats:
        """Return the plan that fills the areas ``area_mm2`` at the stations ``s_mm`` at the path's speed.

        Flow and speed are clipped to ``limits``. The plan has the shape (2 count + 2,).
        """
        part = self.path.giving
        way_mm = arc_length(self.path.position_mm[part])
        at_mm = np.interp(np.linspace(0, way_mm[-1], self.count), way_mm, self.path.s_mm[part])
        speed = np.full(self.count, float(np.clip(self.path.speed_mm_s[part].max(), *limits.speed_mm_s)))
        flow = np.clip(np.interp(at_mm, s_mm, area_mm2) * speed, *limits.flow_mm3_s)
        return np.concatenate([np.log(flow), np.log(speed), [0.2, 0.2]])

    def bounds(self, limits: Limits) -> tuple[Floats, Floats]:
        low, high = (
            np.concatenate([np.full(self.count, np.log(flow)), np.full(self.count, np.log(speed)), [dwell_s, dwell_s]])
            for flow, speed, dwell_s in zip(limits.flow_mm3_s, limits.speed_mm_s, (0.0, LONGEST_DWELL_S), strict=True)
        )
        return low, np.maximum(high, low + SHORTEST_S)


def limits_of(
    trajectory: Trajectory,
    cell: RobotCell | None,
    pump: PumpTable | None,
    flow_max_mm3_s: float | None,
    keep_speed: bool,
) -> Limits:
    own_mm_s = float(trajectory.speed_mm_s.max())
    slowest, fastest = (own_mm_s, own_mm_s) if keep_speed else (own_mm_s / SLOWER, own_mm_s * FASTER)
    most = [LARGEST_MM3_S if flow_max_mm3_s is None else flow_max_mm3_s]
    if cell is not None:
        fastest = max(slowest, min(fastest, cell.motion.largest_speed_mm_s))
        most += cell.flow_limits_mm3_s
    if pump is None:
        return Limits((SMALLEST_SHARE * float(trajectory.flow_mm3_s.max()), min(most)), (slowest, fastest))
    least, largest = pump.range_mm3_s
    return Limits((least, min(*most, largest)), (slowest, fastest))


def require_possible(limits: Limits, area_mm2: Floats, s_mm: Floats, trajectory: Trajectory, where: Path) -> None:
    """Raise InputError if a section cannot be filled, because its flow is out of bounds at every allowed speed."""
    at_mm = trajectory.s_mm[trajectory.giving]
    needed = np.interp(at_mm, s_mm, area_mm2)
    (least, most), (slowest, fastest) = limits.flow_mm3_s, limits.speed_mm_s
    if (too_much := needed * slowest).max() > most:
        worst = int(too_much.argmax())
        raise InputError(
            f"{where}: at s = {at_mm[worst]:.1f} mm, a flow of {too_much[worst]:.4g} mm3/s is needed even at "
            f"{slowest:.3g} mm/s, but the limit is {most:.4g} mm3/s. Give a lower path.speed_mm_s, omit --keep-speed, "
            "or allow more flow."
        )
    if (too_little := needed * fastest).min() < least:
        worst = int(too_little.argmin())
        raise InputError(
            f"{where}: at s = {at_mm[worst]:.1f} mm, a flow of only {too_little[worst]:.4g} mm3/s is needed even at "
            f"{fastest:.3g} mm/s, but the pump's smallest weighed flow is {least:.4g} mm3/s. Give a higher "
            "path.speed_mm_s, or weigh smaller flows."
        )


@dataclass(frozen=True)
class Case:
    """A pour, and its paste in the fast model. It can be filled along other paths."""

    pour: Pour
    paste: HerschelBulkley

    def fill(self, trajectory: Trajectory) -> Filled:
        return bed_of(self.pour, self.paste, trajectory, cells=CELLS, steps=STEPS)

    def along(self, path: NozzlePath) -> Filled:
        return self.fill(path_over(self.pour.sample, path))


@dataclass(frozen=True)
class Goal:
    """Target areas of the filled sections, and a correction that is added to the areas of the fast model."""

    target_mm2: Floats  # Target area of each section, (cells,)
    discrepancy_mm2: Floats  # Particles minus fast model for the plan of the latest run, (cells,)


def target_of(sections: Trapezoids, margin_mm: float) -> Floats:
    """Return the area of each section if it is filled to ``margin_mm`` below the face, (cells,)."""
    return sections.area_mm2(sections.depth_mm - margin_mm)[0]


def discrepancy(filled: Filled, level: Profile) -> Floats:
    """Return the smoothed difference between the areas of a particle run and of the fast model, in mm2, (cells,).

    ``level`` is the level of the particle run. Both areas are computed from the level on the crack's centreline,
    because a plan is judged by this level.
    """
    sections = filled.sections
    apart = np.exp(-0.5 * ((sections.s_mm[:, None] - sections.s_mm) / SMOOTHED_MM) ** 2)
    return apart @ (areas_of(sections, level) - filled.read_mm2) / apart.sum(axis=1)


def corrected_level_mm(filled: Filled, discrepancy_mm2: Floats, sections: Trapezoids | None = None) -> Floats:
    """Return the level in each section from the corrected areas of the fast model, (cells,).

    ``sections`` are the sections for the paste with which the discrepancy was computed. Default: ``filled.sections``.
    """
    sections = sections or filled.sections
    return sections.bottom_mm + sections.height_mm(np.maximum(filled.read_mm2 + discrepancy_mm2, 0.0))


def path_over(sample: Sample, path: NozzlePath) -> Trajectory:
    return plan_trajectory(sample.outline, path, sample.solid.cavity_volume_mm3, sample.solid.sections)


def areas_of(sections: Trapezoids, level: Profile) -> Floats:
    """Return the area of each section below the mean level in its cell, (cells,)."""
    fine_mm = np.linspace(-0.5, 0.5, 11)[:, None] * sections.step_mm + sections.s_mm
    return sections.area_mm2(level.level_at_mm(fine_mm).mean(axis=0) - sections.bottom_mm)[0]


def search(
    case: Case,
    knots: Knots,
    limits: Limits,
    goal: Goal,
    start: Floats,
    report: Callable[[int], None] = lambda _: None,
    most: Floats | None = None,
) -> Floats:
    """Return the plan within the limits that has the smallest mean squared area error.

    The search begins at the plan ``start``. If the plan ``most`` is given, the flow does not exceed its flow, and its
    speed and dwell times are used. The error of a section is relative to the mean target area. The method is
    Gauss-Newton with bounds. Slopes are updated by Broyden's formula, and computed from differences again if the gain
    is small. ``report`` is called with the number of each step.
    """
    from scipy.optimize import lsq_linear

    low, high = knots.bounds(limits)
    if most is not None:
        low[knots.count :], high = most[knots.count :], most
    own_speed = np.log(np.clip(knots.path.speed_mm_s[knots.path.giving].max(), *limits.speed_mm_s))
    weight = 1 / np.sqrt(len(goal.target_mm2)) / goal.target_mm2.mean()

    def errors(plan: Floats) -> Floats:
        off_mm2 = case.fill(knots.trajectory(plan)).read_mm2 + goal.discrepancy_mm2 - goal.target_mm2
        areas = weight * np.where(off_mm2 > 0, OVER_WEIGHT, 1.0) * off_mm2
        flow, speed, dwell_s = knots.parts(plan)
        smooth = [BEND_WEIGHT * np.diff(values, 2) for values in (flow, speed)]
        return np.concatenate([areas, *smooth, SPEED_WEIGHT * (speed - own_speed), DWELL_WEIGHT * dwell_s])

    def slopes(plan: Floats, residual: Floats) -> Floats:
        columns = []
        for number in range(len(plan)):
            # At an upper bound, the step is taken inwards.
            step = STEP if plan[number] + STEP <= high[number] else -STEP
            moved = plan.copy()
            moved[number] += step
            columns.append((errors(moved) - residual) / step)
        return np.column_stack(columns)

    plan = np.clip(start, low, high)
    residual, reach, fresh = errors(plan), WIDEST, True
    slope = slopes(plan, residual)
    for number in range(1, MAX_STEPS + 1):
        report(number)
        span = np.maximum(low - plan, -reach) - TINY, np.minimum(high - plan, reach) + TINY
        change = np.clip(lsq_linear(slope, -residual, span).x, low - plan, high - plan)
        next_residual = errors(plan + change)
        slope = slope + np.outer(next_residual - residual - slope @ change, change) / max(change @ change, TINY)
        gained = 1 - float(next_residual @ next_residual) / float(residual @ residual)
        if gained > 0:
            plan, residual = plan + change, next_residual
        if gained < ENOUGH:
            if fresh and gained <= 0:
                reach /= 4
            elif fresh:
                break
            if reach < STEP:
                break
            slope = slopes(plan, residual)
        fresh = gained < ENOUGH
    return np.clip(plan.round(DECIMALS), low, high)
