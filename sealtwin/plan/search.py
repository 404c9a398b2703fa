"""The numbers of a plan, their bounds, and their search on the fast model.

The numbers are flow and speed at knots along the path, and the dwell at each end. The fast model is corrected by
particle runs (space mapping, Bandler et al. 1994).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from digitise.robots.cell import PumpTable, RobotCell
from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile, Sample, Trajectory
from simulate.pour import Pour
from simulate.slot.fill import Filled, HerschelBulkley
from simulate.slot.run import bed_of
from simulate.slot.sections import Trapezoids

CELLS, STEPS = 32, 60
"""Cells and time steps of the fast model in a search. A run takes a third of the usual time. The discrepancy (particles
minus fast model) includes the resulting change of level."""
OVER_WEIGHT = 1.3  # Weight of overfill relative to underfill
BEND_WEIGHT, SPEED_WEIGHT, DWELL_WEIGHT = 0.02, 0.01, 0.004
"""Three weights, relative to the weight of the areas' mean relative error: for second differences of flow and speed,
for the logarithm of the speed divided by the trial's, and for a dwell of 1 s. They are small, and cost a plan about 1 %
of its gain."""
MOST_STEPS, WIDEST, ENOUGH, TINY = 16, 0.5, 0.02, 1e-9
"""Largest number of steps; widest step, in logarithms and seconds; relative gain below which slopes are computed anew;
and a positive number close to 0. If the slopes are new already, such a small gain ends the search."""
STEP = 2e-2  # Step of the differences, in logarithms and seconds, far above the tolerance of the model's iteration
DECIMALS = 3
"""Decimals to which the result of a search is rounded. Further decimals depend on the processor, since
BLAS orders sums differently, and any difference makes pours by particles diverge."""
SMOOTHED_MM = 3.0  # Standard deviation of the smoothing of a discrepancy: the level of one run has noise of 0.2 mm
LONGEST_DWELL_S = 5.0  # Longest dwell at each end; a longer one overfills it
SHORTEST_S = 1e-6  # Least distance of two bounds, for example of a pump with one flow
SLOWER, FASTER = 4.0, 2.0  # Largest factors by which a plan may be slower or faster than the trial
SMALLEST_SHARE = 0.02  # Least flow as a share of the trial's, without a pump's table
LARGEST_MM3_S = 1e4  # Largest flow without a cell and without --flow-max: more than a lab's pump gives


@dataclass(frozen=True)
class Limits:
    flow_mm3_s: tuple[float, float]
    speed_mm_s: tuple[float, float]


@dataclass(frozen=True)
class Knots:
    """A trial's path, with the knots at which its flow and speed are free.

    Knots are evenly spaced along the part of the path with sealant. Between them the logarithms of flow and speed are
    linear. The nozzle dwells by moving very slowly over the first and the last step of that part, since robot programs
    do not stop.
    """

    path: Trajectory
    count: int

    def trajectory(self, plan: Floats) -> Trajectory:
        """Return the path with the flow and speed of a plan.

        ``plan`` has the logarithms of flow in mm3/s and of speed in mm/s at the knots, and the dwell at each end in s.
        """
        part = self.path.giving
        steps = slice(part.start, part.stop - 1)
        way_mm = arc_length(self.path.position_mm[part])
        middle = (way_mm[1:] + way_mm[:-1]) / 2 / way_mm[-1] * (self.count - 1)
        knots = np.arange(self.count)
        flow, speed = (np.exp(np.interp(middle, knots, part_of)) for part_of in self.parts(plan)[:2])
        lasts_s = np.diff(self.path.t_s)
        # On a ramp, the trial's path is slower than its speed, and its flow is smaller.
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
        """Return the parts of a plan: logarithms of flow and of speed, each (count,), and the dwells, (2,)."""
        return plan[: self.count], plan[self.count : -2], plan[-2:]

    def first_guess(self, area_mm2: Floats, s_mm: Floats, limits: Limits) -> Floats:
        """Return the plan that fills the sections, whose areas at ``s_mm`` are ``area_mm2``, at the path's speed.

        Flow and speed are clipped to ``limits``.
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
    """Raise InputError if a section cannot be filled because the flow would be out of bounds at every allowed speed."""
    at_mm = trajectory.s_mm[trajectory.giving]
    needed = np.interp(at_mm, s_mm, area_mm2)
    (least, most), (slowest, fastest) = limits.flow_mm3_s, limits.speed_mm_s
    if (too_much := needed * slowest).max() > most:
        worst = int(too_much.argmax())
        raise InputError(
            f"{where}: s = {at_mm[worst]:.1f} mm needs {too_much[worst]:.4g} mm3/s even at {slowest:.3g} mm/s, but the "
            f"limit is {most:.4g} mm3/s: slow down (a lower path.speed_mm_s, without --keep-speed), or allow more flow."
        )
    if (too_little := needed * fastest).min() < least:
        worst = int(too_little.argmin())
        raise InputError(
            f"{where}: s = {at_mm[worst]:.1f} mm needs only {too_little[worst]:.4g} mm3/s even at {fastest:.3g} mm/s, "
            f"but the pump's smallest weighed flow is {least:.4g} mm3/s: give a higher path.speed_mm_s, or weigh "
            "smaller flows."
        )


@dataclass(frozen=True)
class Case:
    """A pour and its paste in the fast model, to be filled along other paths."""

    pour: Pour
    paste: HerschelBulkley

    def fill(self, trajectory: Trajectory) -> Filled:
        return bed_of(self.pour, self.paste, trajectory, cells=CELLS, steps=STEPS)

    def along(self, path: NozzlePath) -> Filled:
        return self.fill(path_over(self.pour.sample, path))


@dataclass(frozen=True)
class Goal:
    """Target areas of the bed, and a correction that is added to the areas of the fast model."""

    target_mm2: Floats  # (cells,)
    discrepancy_mm2: Floats  # (cells,): particles minus fast model, for the plan of the latest run


def target_of(sections: Trapezoids, margin_mm: float) -> Floats:
    """Return the area of each section, (cells,), if it is filled to ``margin_mm`` below the face."""
    return sections.area_mm2(sections.depth_mm - margin_mm)[0]


def discrepancy(filled: Filled, level: Profile) -> Floats:
    """Return the smoothed difference of areas, (cells,): those of a level by particles minus those of the fast model.

    Both are areas under the level on the crack's centreline, since a plan is judged by this level.
    """
    sections = filled.sections
    apart = np.exp(-0.5 * ((sections.s_mm[:, None] - sections.s_mm) / SMOOTHED_MM) ** 2)
    return apart @ (areas_of(sections, level) - filled.read_mm2) / apart.sum(axis=1)


def corrected_level_mm(filled: Filled, discrepancy_mm2: Floats, sections: Trapezoids | None = None) -> Floats:
    """Return the level in the middle of each section, (cells,), if the areas of the fast model are corrected.

    ``sections`` are those of the paste for which the discrepancy was found; by default those of the filled one.
    """
    sections = sections or filled.sections
    return sections.bottom_mm + sections.height_mm(np.maximum(filled.read_mm2 + discrepancy_mm2, 0.0))


def path_over(sample: Sample, path: NozzlePath) -> Trajectory:
    return plan_trajectory(sample.outline, path, sample.solid.cavity_volume_mm3, sample.solid.sections)


def areas_of(sections: Trapezoids, level: Profile) -> Floats:
    """Return the area of each section, (cells,), under the mean of a level in its cell."""
    fine_mm = np.linspace(-0.5, 0.5, 11)[:, None] * sections.step_mm + sections.s_mm
    return sections.area_mm2(level.level_at_mm(fine_mm).mean(axis=0) - sections.bottom_mm)[0]


def search(
    cases: Sequence[Case],
    knots: Knots,
    limits: Limits,
    goal: Goal,
    start: Floats,
    report: Callable[[int], None] = lambda _: None,
    most: Floats | None = None,
) -> Floats:
    """Return the plan within the limits that has the least mean squared area error over ``cases``.

    If the plan ``most`` is given, the flow is nowhere above it, and speed and dwell are its own.
    The search begins at the plan ``start``. The error of a cell is relative to the mean target. The method is bounded
    Gauss-Newton steps; slopes are updated by Broyden's formula, and computed from differences if the gain is small.
    ``report`` is called with the number of each step.
    """
    from scipy.optimize import lsq_linear

    low, high = knots.bounds(limits)
    if most is not None:
        low[knots.count :], high = most[knots.count :], most
    own_speed = np.log(np.clip(knots.path.speed_mm_s[knots.path.giving].max(), *limits.speed_mm_s))
    weight = 1 / np.sqrt(len(cases) * len(goal.target_mm2)) / goal.target_mm2.mean()

    def errors(plan: Floats) -> Floats:
        trajectory = knots.trajectory(plan)
        areas = []
        for case in cases:
            off_mm2 = case.fill(trajectory).read_mm2 + goal.discrepancy_mm2 - goal.target_mm2
            areas.append(weight * np.where(off_mm2 > 0, OVER_WEIGHT, 1.0) * off_mm2)
        flow, speed, dwell_s = knots.parts(plan)
        smooth = [BEND_WEIGHT * np.diff(values, 2) for values in (flow, speed)]
        return np.concatenate([*areas, *smooth, SPEED_WEIGHT * (speed - own_speed), DWELL_WEIGHT * dwell_s])

    def slopes(plan: Floats, residual: Floats) -> Floats:
        columns = []
        for number in range(len(plan)):
            # Inwards at a bound.
            step = STEP if plan[number] + STEP <= high[number] else -STEP
            moved = plan.copy()
            moved[number] += step
            columns.append((errors(moved) - residual) / step)
        return np.column_stack(columns)

    plan = np.clip(start, low, high)
    residual, reach, fresh = errors(plan), WIDEST, True
    slope = slopes(plan, residual)
    for number in range(1, MOST_STEPS + 1):
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
