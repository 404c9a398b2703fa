"""Bounds of a plan by a robot's cell, its pump and the options, and what a crack needs that they do not allow."""

from pathlib import Path

import numpy as np

from digitise.robots.cell import RobotCell
from digitise.robots.pump import PumpTable
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Trajectory
from sealtwin.plan.shape import Limits

SLOWER, FASTER = 4.0, 2.0  # A plan's speed over the trial's, at most either way
SMALLEST_SHARE = 0.02  # Of the trial's own flow, where no pump says how little it can give
LARGEST_MM3_S = 1e4  # Flow of a plan without a cell and without --flow-max: more than pumps of a lab give


def limits_of(
    trajectory: Trajectory,
    cell: RobotCell | None,
    pump: PumpTable | None,
    flow_max_mm3_s: float | None,
    keep_speed: bool,
) -> Limits:
    """Return the bounds of flow and speed."""
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
    """Raise InputError where the flow for a section is out of bounds at every speed."""
    at_mm = trajectory.s_mm[trajectory.giving]
    needed = np.interp(at_mm, s_mm, area_mm2)
    (least, most), (slowest, fastest) = limits.flow_mm3_s, limits.speed_mm_s
    if (too_much := needed * slowest).max() > most:
        worst = int(too_much.argmax())
        raise InputError(
            f"{where}: s = {at_mm[worst]:.1f} mm needs {too_much[worst]:.4g} mm3/s even at {slowest:.3g} mm/s, and the "
            f"limit is {most:.4g}: slow down (a lower path.speed_mm_s, and no --keep-speed), or give a larger flow."
        )
    if (too_little := needed * fastest).min() < least:
        worst = int(too_little.argmin())
        raise InputError(
            f"{where}: s = {at_mm[worst]:.1f} mm needs {too_little[worst]:.4g} mm3/s even at {fastest:.3g} mm/s, and "
            f"the pump was weighed from {least:.4g} on: a higher path.speed_mm_s, or weigh it at less."
        )
