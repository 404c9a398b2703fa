"""Search a plan on the fast model, corrected by particle runs (space mapping, Bandler et al. 1994)."""

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
"""Cells and time steps of the fast model in a search. A run takes a third of the usual time. The discrepancy (particles
minus fast model) includes the resulting change of level."""
OVER_WEIGHT = 1.3  # Weight of overfill relative to underfill
BENT, HURRIED, DWELT = 0.02, 0.01, 0.004
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


@dataclass(frozen=True)
class Case:
    """A crack and its paste in the fast model."""

    solid: Solid
    outline: Outline
    paste: HerschelBulkley
    nozzle_mm: float
    settle_s: float
    slope: SampleSlope = LEVEL

    def fill(self, trajectory: Trajectory) -> Filled:
        how: dict[str, Any] = {"nozzle_mm": self.nozzle_mm, "settle_s": self.settle_s, "slope": self.slope}
        return fill(self.solid, self.outline, trajectory, self.paste, **how, cells=CELLS, steps=STEPS)


@dataclass(frozen=True)
class Goal:
    """Target areas of the bed, and a correction that is added to the areas of the fast model."""

    target_mm2: Floats  # (cells,)
    discrepancy_mm2: Floats  # (cells,): particles minus fast model, for the plan of the latest run


def target_of(sections: Trapezoids, margin_mm: float) -> Floats:
    """Return the area of each section, (cells,), if it is filled to ``margin_mm`` below the face."""
    return sections.area_mm2(sections.depth_mm - margin_mm)[0]


def discrepancy(filled: Filled, s_mm: Floats, level_mm: Floats) -> Floats:
    """Return the smoothed difference of areas, (cells,): those of a level by particles minus those of the fast model.

    Both are areas under the level on the crack's centreline, since a plan is judged by this level.
    """
    it = filled.sections
    apart = np.exp(-0.5 * ((it.s_mm[:, None] - it.s_mm) / SMOOTHED_MM) ** 2)
    return apart @ (areas_of(it, s_mm, level_mm) - filled.read_mm2) / apart.sum(axis=1)


def areas_of(sections: Trapezoids, s_mm: Floats, level_mm: Floats) -> Floats:
    """Return the area of each section, (cells,), under the mean of the level ``level_mm`` in its cell."""
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
    """Return the plan within the limits that has the least mean squared area error over ``cases``.

    The search begins at the plan ``start``. The error of a cell is relative to the mean target. The method is bounded
    Gauss-Newton steps; slopes are updated by Broyden's formula, and computed from differences if the gain is small.
    ``report`` is called with the number of each step.
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
