"""The sealant that lands in each cell of a crack in each step of time."""

import numpy as np

from sealtwin.core.records import Floats, Trajectory

GRAVITY_MM_S2 = 9810.0
SAMPLES = 8  # Moments for each step at which the nozzle is looked at


def supplied_mm3(
    trajectory: Trajectory, times_s: Floats, edges_mm: Floats, *, nozzle_mm: float, surface_mm: float, down: Floats
) -> Floats:
    """Volume that lands in each cell in each step, (steps, cells); what lands after the last is in none.

    ``edges_mm`` are the cells' ends along the crack. Sealant leaves a disc square to the face and falls to
    ``surface_mm``, the level of a bed that lies flat; ``down`` is the unit vector of gravity along the crack and square
    to the face. What would land beyond an end lands in the last cell.
    """
    begin_s, end_s = trajectory.t_s[trajectory.giving][[0, -1]]
    moment_s = np.linspace(begin_s, end_s, SAMPLES * len(times_s) + 1)
    given_mm3 = np.concatenate([[0.0], np.cumsum(trajectory.given_mm3)])
    volume_mm3 = np.diff(np.interp(moment_s, trajectory.t_s, given_mm3))
    middle_s = (moment_s[1:] + moment_s[:-1]) / 2
    speed_mm_s = volume_mm3 / np.diff(moment_s) / (np.pi / 4 * nozzle_mm**2)
    height_mm = np.maximum(np.interp(middle_s, trajectory.t_s, trajectory.position_mm[:, 2]) - surface_mm, 0.0)
    pull_mm_s2 = GRAVITY_MM_S2 * down[1]
    falls_s = (np.sqrt(speed_mm_s**2 + 2 * pull_mm_s2 * height_mm) - speed_mm_s) / pull_mm_s2
    lands_mm = np.interp(middle_s, trajectory.t_s, trajectory.s_mm) + GRAVITY_MM_S2 * down[0] * falls_s**2 / 2
    share = np.diff(_below(2 * (edges_mm - lands_mm[:, None]) / nozzle_mm), axis=1)
    step = np.searchsorted(times_s, middle_s + falls_s) - 1
    landed_mm3 = np.zeros((len(times_s) - 1, len(edges_mm) - 1))
    in_time = step < len(landed_mm3)
    np.add.at(landed_mm3, step[in_time], volume_mm3[in_time, None] * share[in_time])
    return landed_mm3


def _below(place: Floats) -> Floats:
    """Share of a disc of radius 1 below each place, (n, edges); all of it lies between the first and the last edge."""
    x = np.clip(place, -1.0, 1.0)
    share = 0.5 + (np.arcsin(x) + x * np.sqrt(1 - x**2)) / np.pi
    share[:, 0], share[:, -1] = 0.0, 1.0
    return share
