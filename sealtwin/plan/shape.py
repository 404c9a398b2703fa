"""The numbers of a plan and their bounds: flow and speed at knots along the path, and the dwell at each end."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from digitise.robots.cell import RobotCell
from digitise.robots.pump import PumpTable
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Trajectory

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
        t_s = self.path.t_s[0] + np.concatenate([[0.0], np.cumsum(lasts_s)])
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
        if cell.plunger is not None:
            most.append(cell.plunger.area_mm2 * cell.plunger.largest_speed_mm_s)
        if cell.urscript is not None and cell.urscript.full_flow_mm3_s is not None:
            most.append(cell.urscript.full_flow_mm3_s)
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
