"""Room for the nozzle: nothing may be released inside a wall, where no step could ever keep it from leaving."""

import math
from collections.abc import Callable

import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline, Trajectory
from simulate.distance import CM, Barrier
from simulate.nozzle import Schedule, plan_releases

TICK_MM = 0.1
"""Diameters and heights are proposed in whole ticks."""
ROUNDING_MM = 1e-3
"""Of distances, which are float32: a release at just the clearance is allowed."""


def check_outlet(
    schedule: Schedule,
    trajectory: Trajectory,
    outline: Outline,
    barrier: Barrier,
    *,
    radius_mm: float,
    diameter_mm: float,
    seed: int,
) -> None:
    """Raises InputError where a particle would be released nearer to the solid than its clearance, or inside it.

    Says what would be allowed, each alone; a diameter and a height have been tried before they are proposed.
    """
    blocked = _blocked(schedule.position_mm, barrier)
    if not blocked.any():
        return
    at_s = trajectory.t_s[0] + schedule.frame_of * schedule.frame_s
    s_mm = np.interp(at_s, trajectory.t_s, trajectory.s_mm)[blocked]
    x, y, z = schedule.position_mm[blocked][0]
    begins_mm, ends_mm = trajectory.s_mm[trajectory.giving][[0, -1]]
    remedies = [
        _larger_trim(s_mm, outline.length_mm),
        _smaller_nozzle(trajectory, barrier, radius_mm, diameter_mm, seed),
        _higher_nozzle(schedule.position_mm, trajectory, barrier),
    ]
    allowed = ", or ".join(remedy for remedy in remedies if remedy) or "no path so near to the solid: move it"
    raise InputError(
        f"nozzle.diameter_mm is {diameter_mm:g}, path.trim_mm lets sealant flow from s = {begins_mm:g} to "
        f"{ends_mm:g} mm and path.nozzle_height_mm is {trajectory.position_mm[:, 2].min():g}: together they release "
        f"sealant inside the "
        f"solid, a dam at an open end for one, or nearer than {barrier.clearance / CM:.2f} mm to it; first at "
        f"s = {s_mm[0]:.1f} mm, ({x:.1f}, {y:.1f}, {z:.1f}) mm. Allowed is {allowed}."
    )


def _blocked(points_mm: Floats, barrier: Barrier) -> np.ndarray:
    """(n,) bool."""
    return barrier.exact_mm(points_mm) < barrier.clearance / CM - ROUNDING_MM


def _larger_trim(blocked_s_mm: Floats, length_mm: float) -> str:
    """In whole millimetres: each disc is turned by chance, and another path turns them anew."""
    from_end_mm = np.minimum(blocked_s_mm, length_mm - blocked_s_mm)
    trim_mm = math.floor(from_end_mm.max()) + 1
    return f"path.trim_mm of at least {trim_mm}" if 2 * trim_mm < length_mm - 1 else ""


def _smaller_nozzle(trajectory: Trajectory, barrier: Barrier, radius_mm: float, diameter_mm: float, seed: int) -> str:
    def fits(ticks: int) -> bool:
        try:
            schedule = plan_releases(trajectory, radius_mm, ticks * TICK_MM, seed)
        except InputError:
            return False
        return not _blocked(schedule.position_mm, barrier).any()

    smallest, blocked = math.ceil(2 * radius_mm / TICK_MM), math.ceil(diameter_mm / TICK_MM)
    if smallest >= blocked or not fits(smallest):
        return ""
    return f"nozzle.diameter_mm of at most {_bisect(smallest, blocked, fits) * TICK_MM:g}"


def _higher_nozzle(points_mm: Floats, trajectory: Trajectory, barrier: Barrier) -> str:
    low_mm = trajectory.position_mm[:, 2].min()
    top_mm = barrier.mesh.points.numpy()[:, 2].max() / CM + barrier.clearance / CM

    def fits(ticks: int) -> bool:
        return not _blocked(points_mm + np.array([0, 0, ticks * TICK_MM - low_mm]), barrier).any()

    blocked, highest = math.floor(low_mm / TICK_MM), math.ceil(top_mm / TICK_MM)
    if highest <= blocked or not fits(highest):
        return ""
    return f"path.nozzle_height_mm of at least {_bisect(highest, blocked, fits) * TICK_MM:g}"


def _bisect(good: int, bad: int, fits: Callable[[int], bool]) -> int:
    """Where ``fits`` changes, on the side of ``good``; it is known to hold there."""
    while abs(good - bad) > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if fits(middle) else (good, middle)
    return good
