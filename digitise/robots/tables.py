"""A robot's path as plain numbers: x y z a line, and a table with times, speeds and flows."""

import numpy as np

from digitise.robots.placed import RobotPath
from digitise.robots.text import decimal
from sealtwin.store.stage_files import TRAJECTORY_COLUMNS


def points_text(path: RobotPath) -> str:
    """One waypoint a line, x y z in mm of the robot, and nothing else: what reads so little reads no head either."""
    return "".join(" ".join(decimal(value, 4) for value in place) + "\n" for place in path.trajectory.position_mm)


def table_text(path: RobotPath) -> str:
    """The columns of trajectory.csv, x, y and z being the robot's; each row holds until the next."""
    it = path.trajectory
    rows = np.column_stack([it.t_s, it.position_mm, it.s_mm, it.speed_mm_s, it.flow_mm3_s])
    lines = [",".join(TRAJECTORY_COLUMNS), *(",".join(decimal(value, 6) for value in row) for row in rows)]
    return "\n".join(lines) + "\n"
