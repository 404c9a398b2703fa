"""The search for a plan on the fast model, corrected by particle runs (space mapping, Bandler et al. 1994)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sealtwin.core.records import Floats, Outline, Solid, Trajectory
from sealtwin.plan.shape import Knots, Limits
from simulate.settings import LEVEL, SampleSlope
from simulate.slot.fill import Filled, fill
from simulate.slot.flux import HerschelBulkley
from simulate.slot.sections import Trapezoids

CELLS, STEPS = 32, 60
"""Size of the fast model in a search: a third of its usual time. The change of its level is in the discrepancy."""
OVER_WEIGHT = 1.3  # Weight of overfill relative to underfill
BENT, HURRIED, DWELT = 0.02, 0.01, 0.004
"""Weights, relative to that of the mean relative error of the areas: of second differences of flow and speed, of the
logarithm of the speed over the trial's, and of a dwell of 1 s. Small: they cost a plan about 1 % of its gain."""
MOST_STEPS, WIDEST, ENOUGH, TINY = 16, 0.5, 0.02, 1e-9
"""Largest number of steps; widest step, in logarithms and seconds; relative gain below which slopes are computed anew,
or, with new slopes, the search ends; and a positive number close to 0."""
STEP = 2e-2  # Step of the differences, in logarithms and seconds, far above the tolerance of the model's iteration
DECIMALS = 3
"""Decimals of a result of a search or a correction. Further decimals depend on the processor, since BLAS orders sums
differently, and pours by particles diverge at any difference."""
SMOOTHED_MM = 3.0  # Standard deviation of the smoothing of a discrepancy: the level of one run has noise of 0.2 mm


@dataclass(frozen=True)
class Case:
    """A crack and its paste in the fast model."""

    solid: Solid
    outline: Outline
    paste: HerschelBulkley
    nozzle_mm: float
    settle_s: float
    slope: SampleSlope = LEVEL

    def fill(
        self,
        trajectory: Trajectory,
        cells: int = CELLS,
        steps: int = STEPS,
        watch: Callable[[float, Floats], None] = lambda t_s, area_mm2: None,
    ) -> Filled:
        how: dict[str, Any] = {"nozzle_mm": self.nozzle_mm, "settle_s": self.settle_s, "slope": self.slope}
        sample = self.solid, self.outline, trajectory, self.paste
        return fill(*sample, **how, cells=cells, steps=steps, watch=watch)


@dataclass(frozen=True)
class Goal:
    """Target areas of the bed, and the correction of the areas of the fast model."""

    target_mm2: Floats  # (cells,)
    discrepancy_mm2: Floats  # (cells,): particles minus fast model, for the plan of the latest run


def target_of(sections: Trapezoids, margin_mm: float) -> Floats:
    """Return the area of each section filled to ``margin_mm`` below the face."""
    return sections.area_mm2(sections.depth_mm - margin_mm)[0]


def discrepancy(filled: Filled, s_mm: Floats, level_mm: Floats) -> Floats:
    """Return the areas of a level by particles minus those of the fast model, smoothed, (cells,).

    Both are areas under the level in the middle of the crack, by which a plan is judged.
    """
    it = filled.sections
    apart = np.exp(-0.5 * ((it.s_mm[:, None] - it.s_mm) / SMOOTHED_MM) ** 2)
    return apart @ (areas_of(it, s_mm, level_mm) - filled.read_mm2) / apart.sum(axis=1)


def areas_of(sections: Trapezoids, s_mm: Floats, level_mm: Floats) -> Floats:
    """Return the area of each section under the mean level in its cell, (cells,)."""
    fine_mm = np.linspace(-0.5, 0.5, 11)[:, None] * sections.step_mm + sections.s_mm
    return sections.area_mm2(np.interp(fine_mm, s_mm, level_mm).mean(axis=0) - sections.bottom_mm)[0]


def search(
    cases: Sequence[Case],
    knots: Knots,
    limits: Limits,
    goal: Goal,
    start: Floats,
    report: Callable[[int], None] = lambda _: None,
) -> Floats:
    """Return the plan with the least mean squared area error over ``cases``, from ``start`` on, within the limits.

    The error of a cell is relative to the mean target. Bounded Gauss-Newton steps, with slopes by differences at times
    and by Broyden's update in between. ``report`` is called with the number of each step.
    """
    from scipy.optimize import lsq_linear

    low, high = knots.bounds(limits)
    own_speed = np.log(np.clip(knots.path.speed_mm_s[knots.path.giving].max(), *limits.speed_mm_s))
    weight = 1 / np.sqrt(len(cases) * len(goal.target_mm2)) / goal.target_mm2.mean()

    def errors(plan: Floats) -> Floats:
        trajectory = knots.trajectory(plan)
        areas = []
        for case in cases:
            off_mm2 = case.fill(trajectory).read_mm2 + goal.discrepancy_mm2 - goal.target_mm2
            areas.append(weight * np.where(off_mm2 > 0, OVER_WEIGHT, 1.0) * off_mm2)
        flow, speed, dwell_s = knots.parts(plan)
        smooth = [BENT * np.diff(values, 2) for values in (flow, speed)]
        return np.concatenate([*areas, *smooth, HURRIED * (speed - own_speed), DWELT * dwell_s])

    def slopes(plan: Floats, here: Floats) -> Floats:
        columns = []
        for number in range(len(plan)):
            # Inwards at a bound.
            step = STEP if plan[number] + STEP <= high[number] else -STEP
            moved = plan.copy()
            moved[number] += step
            columns.append((errors(moved) - here) / step)
        return np.column_stack(columns)

    plan = np.clip(start, low, high)
    here, reach, fresh = errors(plan), WIDEST, True
    slope = slopes(plan, here)
    for number in range(1, MOST_STEPS + 1):
        report(number)
        span = np.maximum(low - plan, -reach) - TINY, np.minimum(high - plan, reach) + TINY
        change = np.clip(lsq_linear(slope, -here, span).x, low - plan, high - plan)
        there = errors(plan + change)
        slope = slope + np.outer(there - here - slope @ change, change) / max(change @ change, TINY)
        gained = 1 - float(there @ there) / float(here @ here)
        if gained > 0:
            plan, here = plan + change, there
        if gained < ENOUGH:
            if fresh and gained <= 0:
                reach /= 4
            elif fresh:
                break
            if reach < STEP:
                break
            slope = slopes(plan, here)
        fresh = gained < ENOUGH
    return np.clip(plan.round(DECIMALS), low, high)
