"""The numbers that a plan is made of: flow and speed at knots along the path, and dwell at both of its ends."""

from dataclasses import dataclass, replace

import numpy as np

from sealtwin.core.records import Floats, Trajectory, arc_length

LONGEST_DWELL_S = 5.0  # At each end; what a plan gives there in a longer time has overfilled it
SHORTEST_S = 1e-6  # Dwell at which the logarithms of a plan begin


@dataclass(frozen=True)
class Limits:
    """Bounds of a plan by robot and pump."""

    flow_mm3_s: tuple[float, float]
    speed_mm_s: tuple[float, float]


@dataclass(frozen=True)
class Knots:
    """A path of the trial's own, and where its flow and speed are free.

    Flow and speed are linear between knots, which are even along the part of the path that gives sealant. The nozzle
    dwells by crawling over the first and the last step of that part: no robot's program has a stop in it.
    """

    path: Trajectory
    count: int

    @property
    def unknowns(self) -> int:
        return 2 * self.count + 2

    def trajectory(self, plan: Floats) -> Trajectory:
        """Return the path with the flow and speed of a plan.

        ``plan`` holds logarithms of flow in mm3/s and of speed in mm/s at the knots, and both dwells in s.
        """
        part = self.path.giving
        steps = slice(part.start, part.stop - 1)
        way_mm = arc_length(self.path.position_mm[part])
        middle = (way_mm[1:] + way_mm[:-1]) / 2 / way_mm[-1] * (self.count - 1)
        knots = np.arange(self.count)
        flow, speed = (np.exp(np.interp(middle, knots, part_of)) for part_of in self.parts(plan)[:2])
        lasts_s = np.diff(self.path.t_s)
        # On a ramp the trial's path is slower than its speed, and gives less.
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
        """Return logarithms of flow and of speed, (count,) each, and the dwells, (2,)."""
        return plan[: self.count], plan[self.count : -2], plan[-2:]

    def first_guess(self, area_mm2: Floats, s_mm: Floats, limits: Limits) -> Floats:
        """Return the plan that gives each place its own section, ``area_mm2`` at ``s_mm``, at the path's speed."""
        part = self.path.giving
        at_mm = np.interp(np.linspace(0, 1, self.count), *_share_and_s(self.path, part))
        speed = np.full(self.count, float(np.clip(self.path.speed_mm_s[part].max(), *limits.speed_mm_s)))
        flow = np.clip(np.interp(at_mm, s_mm, area_mm2) * speed, *limits.flow_mm3_s)
        return np.concatenate([np.log(flow), np.log(speed), [0.2, 0.2]])

    def bounds(self, limits: Limits) -> tuple[Floats, Floats]:
        """Return the least and the largest plan."""
        low, high = (
            np.concatenate([np.full(self.count, np.log(flow)), np.full(self.count, np.log(speed)), [dwell_s, dwell_s]])
            for flow, speed, dwell_s in zip(limits.flow_mm3_s, limits.speed_mm_s, (0.0, LONGEST_DWELL_S), strict=True)
        )
        # A search asks for room, also where a pump has one flow.
        return low, np.maximum(high, low + SHORTEST_S)


def _share_and_s(path: Trajectory, part: slice) -> tuple[Floats, Floats]:
    way_mm = arc_length(path.position_mm[part])
    return way_mm / way_mm[-1], path.s_mm[part]
