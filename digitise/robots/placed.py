"""A nozzle's path as a robot is to follow it: in the robot's frame, and within what its cell allows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from digitise.path_report import radii_mm
from digitise.robots.cell import Cell
from digitise.robots.frame import Frame, fit_frame
from sealtwin.errors import InputError
from sealtwin.records import Floats, Trajectory, arc_length

ROUNDING = 1e-6
"""A trajectory.csv has six decimals."""
MUCH_GROWTH = 2.0
"""Of an error of touch: 0.2 mm, which is a good touch by hand, become more than 0.4."""


@dataclass(frozen=True)
class RobotPath:
    """What every robot's file is written from."""

    trajectory: Trajectory
    """Its positions are the robot's."""
    frame: Frame
    cell: Cell
    cell_file: str
    """Its name, for refusals."""
    warnings: tuple[str, ...]
    head: tuple[str, ...] = ()
    """Lines for the head of a program: from which run, by which frame. A user's words may stand in them: they come
    into a program through ``text.comments`` only.
    """

    @property
    def tilt_deg(self) -> float:
        """Of the face, from level."""
        return float(np.degrees(np.arccos(np.clip(self.cell.up * self.frame.normal[2], -1, 1))))

    @property
    def above_start_mm(self) -> Floats:
        """Over the first waypoint at the safe height, (3,)."""
        return self._above(0)

    @property
    def above_end_mm(self) -> Floats:
        return self._above(-1)

    def _above(self, row: int) -> Floats:
        tip_mm = self.trajectory.position_mm[row]
        height_mm = (tip_mm - self.frame.origin_mm) @ self.frame.normal
        return tip_mm + (self.cell.motion.safe_height_mm - height_mm) * self.frame.normal

    def refuse(self, faults: Sequence[str]) -> None:
        """Raises InputError with all ``faults``, each after the cell file's name, where there are any."""
        if faults:
            raise InputError("\n".join(f"{self.cell_file}: {fault}" for fault in faults))


def place_path(trajectory: Trajectory, cell: Cell, cell_file: str) -> RobotPath:
    """A path of the sample's frame in the robot's.

    Raises:
        InputError: the trajectory is none, the taught points are no frame, or the path is beyond a limit of the cell;
            all limits that it breaks are named.
    """
    _check_rows(trajectory)
    frame = fit_frame(
        np.array([point.sample_mm for point in cell.taught]),
        np.array([point.robot_mm for point in cell.taught]),
        limit_mm=cell.frame_limit_mm,
        up=cell.up,
        where=cell_file,
    )
    placed = replace(trajectory, position_mm=frame.to_robot_mm(trajectory.position_mm))
    path = RobotPath(placed, frame, cell, cell_file, _warnings(trajectory, frame, cell))
    path.refuse([*_motion_faults(trajectory, cell), *reach_faults("the path", placed.position_mm, cell)])
    return path


def reach_faults(what: str, places_mm: Floats, cell: Cell) -> list[str]:
    """Where ``what``, places (n, 3) of the robot, is furthest outside the reach box; empty where it is inside."""
    low_mm, high_mm = cell.reach.low_mm, cell.reach.high_mm
    outside_mm = np.maximum(np.array(low_mm) - places_mm, places_mm - high_mm).max(axis=1)
    if outside_mm.max() <= ROUNDING:
        return []
    x, y, z = places_mm[int(outside_mm.argmax())]
    return [
        f"{what} leads {outside_mm.max():.1f} mm out of the reach box, to ({x:.1f}, {y:.1f}, {z:.1f}) mm of the robot; "
        f"the box goes from {list(low_mm)} to {list(high_mm)}. Move the sample and teach it again, or correct [reach]."
    ]


def tilt_faults(path: RobotPath) -> list[str]:
    """Whether the face is too far from level for an arm whose nozzle is always vertical."""
    tilt_deg, allowed_deg = path.tilt_deg, path.cell.motion.largest_tilt_deg
    if tilt_deg <= allowed_deg:
        return []
    return [
        f"the face is tilted by {tilt_deg:.1f} degrees and the nozzle stays vertical; motion.largest_tilt_deg allows "
        f"{allowed_deg:g}. Level the sample and teach it again."
    ]


def level_flow_mm3_s(path: RobotPath, dispenser: str, remedy: str) -> float:
    """The one flow that a path has besides 0. Raises InputError where it has more: ``dispenser`` can give but one."""
    flow = path.trajectory.flow_mm3_s[:-1]
    flow = flow[flow > 0]
    if flow.max() > flow.min() * (1 + 10 * ROUNDING):
        raise InputError(
            f"{path.cell_file}: {dispenser} gives one flow or none, and the path's goes from {flow.min():.4g} to "
            f'{flow.max():.4g} mm³/s. Digitise with path.flow = "constant" and either no path.ramp_mm or leads as long '
            f"as it; or {remedy}."
        )
    return float(flow.mean())


def plunger_mm(path: RobotPath) -> Floats:
    """How far the plunger has gone at each waypoint, (n,). Raises InputError where it cannot go so far or so fast."""
    plunger = path.cell.plunger
    if plunger is None:
        raise ValueError("a cell without [plunger]")
    way_mm = np.concatenate([[0.0], np.cumsum(path.trajectory.given_mm3)]) / plunger.area_mm2
    faults = []
    if way_mm[-1] > plunger.travel_mm:
        faults.append(
            f"the path needs {way_mm[-1]:.1f} mm of the plunger; plunger.travel_mm is {plunger.travel_mm:g}. Fill the "
            "syringe, or digitise with a smaller path.volume_ml or path.fill."
        )
    speed_mm_s = path.trajectory.flow_mm3_s.max() / plunger.area_mm2
    if speed_mm_s > plunger.largest_speed_mm_s * (1 + ROUNDING):
        faults.append(
            f"the plunger would go at {speed_mm_s:.3g} mm/s; plunger.largest_speed_mm_s is "
            f"{plunger.largest_speed_mm_s:g}. Digitise with a lower path.speed_mm_s."
        )
    path.refuse(faults)
    return way_mm


def _check_rows(trajectory: Trajectory) -> None:
    """A trajectory.csv may have been written by anybody."""
    values = np.column_stack([trajectory.t_s, trajectory.position_mm, trajectory.speed_mm_s, trajectory.flow_mm3_s])
    way_mm = np.linalg.norm(np.diff(trajectory.position_mm, axis=0), axis=1)
    if len(values) < 2 or not np.isfinite(values).all() or not (np.diff(trajectory.t_s) > 0).all():
        raise InputError("trajectory.csv: needs two rows or more, numbers in all, and t_s that grows. Digitise again.")
    if not (trajectory.flow_mm3_s >= 0).all() or not trajectory.given_mm3.sum() > 0:
        raise InputError("trajectory.csv: flow_mm3_s must not be negative, and not 0 everywhere. Digitise again.")
    if not np.allclose(way_mm, trajectory.speed_mm_s[:-1] * np.diff(trajectory.t_s), rtol=1e-3, atol=1e-3):
        raise InputError("trajectory.csv: speed_mm_s is not what its places and times make. Digitise again.")


def _motion_faults(trajectory: Trajectory, cell: Cell) -> list[str]:
    motion, faults = cell.motion, []
    count, height_mm = len(trajectory.t_s), trajectory.position_mm[:, 2].max()
    # Each of three pieces, crack and leads, may end with a short step.
    enough_mm = math.ceil(100 * trajectory.length_mm / max(motion.most_waypoints - 4, 1)) / 100
    if count > motion.most_waypoints:
        faults.append(
            f"the path has {count} waypoints; motion.most_waypoints allows {motion.most_waypoints}. Digitise with a "
            f"path.spacing_mm of {enough_mm:g} or more."
        )
    if motion.safe_height_mm <= height_mm:
        faults.append(
            f"motion.safe_height_mm is {motion.safe_height_mm:g}, and the path itself runs {height_mm:g} mm above the "
            "face. Give a greater one."
        )
    fastest_mm_s = trajectory.speed_mm_s.max()
    if fastest_mm_s > motion.largest_speed_mm_s * (1 + ROUNDING):
        faults.append(
            f"the path runs at {fastest_mm_s:g} mm/s; motion.largest_speed_mm_s allows {motion.largest_speed_mm_s:g}. "
            "Digitise with a lower path.speed_mm_s."
        )
    if motion.approach_speed_mm_s > motion.largest_speed_mm_s:
        faults.append(
            f"motion.approach_speed_mm_s is {motion.approach_speed_mm_s:g}; motion.largest_speed_mm_s allows "
            f"{motion.largest_speed_mm_s:g}. Give a lower one."
        )
    return [*faults, *_acceleration_faults(trajectory, motion.acceleration_mm_s2)]


def _acceleration_faults(trajectory: Trajectory, allowed_mm_s2: float) -> list[str]:
    """What ramps ask for along the path, and bends across it."""
    faults = []
    speed_mm_s, lasts_s = trajectory.speed_mm_s[:-1], np.diff(trajectory.t_s)
    # A mean speed is that of the middle of its time.
    along = np.abs(np.diff(speed_mm_s)) / ((lasts_s[1:] + lasts_s[:-1]) / 2)
    if along.max(initial=0.0) > allowed_mm_s2 * 1.01:
        faults.append(
            f"a ramp of the path needs {along.max():.4g} mm/s²; motion.acceleration_mm_s2 allows {allowed_mm_s2:g}. "
            "Digitise with a longer path.ramp_mm."
        )
    across = np.maximum(speed_mm_s[1:], speed_mm_s[:-1]) ** 2 / radii_mm(trajectory.position_mm)
    if across.max(initial=0.0) > allowed_mm_s2:
        at = int(across.argmax())
        faults.append(
            f"the bend at s = {trajectory.s_mm[at + 1]:.1f} mm needs {across[at]:.4g} mm/s² at "
            f"{speed_mm_s[at]:.4g} mm/s; motion.acceleration_mm_s2 allows {allowed_mm_s2:g}. Digitise with a lower "
            "path.speed_mm_s or a larger path.smoothing_mm."
        )
    return faults


def _warnings(trajectory: Trajectory, frame: Frame, cell: Cell) -> tuple[str, ...]:
    warnings = []
    growth = frame.error_growth(trajectory.position_mm)
    if growth > MUCH_GROWTH:
        warnings.append(
            "the path runs so far outside the taught points that an error of touch of 0.1 mm at each becomes "
            f"{growth / 10:.2f} mm of the nozzle's height; teach points around the crack"
        )
    begins = trajectory.giving.start
    dry_mm = arc_length(trajectory.position_mm[: begins + 1])[-1]
    needed_mm = trajectory.speed_mm_s[begins] ** 2 / (2 * cell.motion.acceleration_mm_s2)
    if needed_mm > dry_mm + arc_length(trajectory.position_mm[begins : begins + 2])[-1]:
        warnings.append(
            f"the arm needs {needed_mm:.1f} mm to come to {trajectory.speed_mm_s[begins]:.4g} mm/s and has "
            f"{dry_mm:.1f} mm before the first sealant: a dispenser that goes by time gives too much there; digitise "
            "with a path.lead_in_mm or path.ramp_mm of at least as much"
        )
    return tuple(warnings)
