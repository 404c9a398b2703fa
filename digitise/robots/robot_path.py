"""Place the nozzle's path in the robot's frame, check it against the cell's limits, and prepare it for programs."""

from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from digitise.robots.cell import LANGUAGES, PumpTable, RobotCell, RobotFrame, fit_frame
from digitise.robots.programs import EVEN_RANGE
from sealtwin.core.arc_length import arc_length, step_lengths
from sealtwin.core.arrays import midpoints
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats, Trajectory

ROUNDING = 1e-6  # Rounding error of trajectory.csv, which has six decimals
# A larger growth of the touch error gives a warning. An error of 0.2 mm, a good touch by hand, becomes over 0.4 mm
MUCH_GROWTH = 2.0

Limit = tuple[bool, str]  # True if a limit of the cell is exceeded, and the error message for that case


@dataclass(frozen=True)
class RobotPath:
    """The nozzle's path in the robot's frame, from which every format is written."""

    trajectory: Trajectory  # Positions in the robot's frame, and the flow requested from the pump
    frame: RobotFrame
    cell: RobotCell
    cell_file: str  # Name of the cell file, for messages
    warnings: tuple[str, ...]
    wanted_mm3: float  # Volume of sealant that the path should deliver
    hold_s: float  # Time that the nozzle waits, after the request to the pump, before it moves along the crack
    weighed: bool  # True if the trajectory's flow is the request to a weighed pump and not the flow that the path needs
    # Lines for the head of a program. They contain a user's words and must pass through ``comments``.
    head: tuple[str, ...] = ()

    @property
    def tilt_deg(self) -> float:
        """Angle between the face and the horizontal."""
        return float(np.degrees(np.arccos(np.clip(self.frame.normal[2], -1, 1))))

    @property
    def flow_mm3_s(self) -> Floats:
        """Flow in mm³/s at each point of the path from the first to the last point with sealant, (n,)."""
        return self.trajectory.flow_mm3_s[self.trajectory.giving][:-1]

    @property
    def held_mm3(self) -> float:
        """Volume of sealant requested while the nozzle waits for the first sealant."""
        return float(self.flow_mm3_s[0]) * self.hold_s

    @property
    def over_mm(self) -> Floats:
        """Points above the first and the last waypoint, at the safe height, (2, 3)."""
        ends_mm = self.trajectory.position_mm[[0, -1]]
        height_mm = (ends_mm - self.frame.origin_mm) @ self.frame.normal
        return ends_mm + (self.cell.motion.safe_height_mm - height_mm)[:, None] * self.frame.normal

    def require(self, *limits: Limit) -> None:
        """Raise InputError with the messages of all exceeded limits. Each message begins with the cell file's name."""
        if faults := [f"{self.cell_file}: {fault}" for exceeded, fault in limits if exceeded]:
            raise InputError("\n".join(faults))

    def reach_limit(self, points: str, places_mm: Floats) -> Limit:
        """Return the limit that points, (n, 3) in the robot's frame, must be in the reach box.

        ``points`` is the name of the points in the message.
        """
        low_mm, high_mm = self.cell.reach.low_mm, self.cell.reach.high_mm
        outside_mm = np.maximum(np.array(low_mm) - places_mm, places_mm - high_mm).max(axis=1)
        x, y, z = places_mm[int(outside_mm.argmax())]
        return (
            bool(outside_mm.max() > ROUNDING),
            f"{points} leads {outside_mm.max():.1f} mm out of the reach box, to ({x:.1f}, {y:.1f}, {z:.1f}) mm in the "
            f"robot's frame. The box extends from {list(low_mm)} to {list(high_mm)}. Move the sample and teach it "
            "again, or correct [reach].",
        )

    @property
    def tilt_limit(self) -> Limit:
        """Limit of the face's tilt, for an arm whose nozzle is always vertical."""
        fault = f"the face is tilted by {self.tilt_deg:.1f} degrees and the nozzle stays vertical"
        return self.limit("motion.largest_tilt_deg", self.tilt_deg, fault, "Level the sample and teach it again.")

    def limit(self, key: str, value: float, fault: str, remedy: str, rounding: float = 0.0) -> Limit:
        """Return the limit that the cell's setting ``key`` puts on ``value``.

        The message consists of ``fault``, which states the value, the limit, and ``remedy``. The value may exceed the
        limit by the relative tolerance ``rounding``.
        """
        allowed = attrgetter(key)(self.cell)
        return value > allowed * (1 + rounding), f"{fault}, but {key} allows at most {allowed:g}. {remedy}"

    def even_limit(self, cause: str, unit: str, values: Floats, remedy: str) -> Limit:
        """Return the limit that ``values`` must be constant, for a program with one speed or flow over the crack.

        The message begins with ``cause``.
        """
        return (
            values.max() > values.min() * (1 + EVEN_RANGE),
            f"{cause}, but the path needs {values.min():.4g} to {values.max():.4g} {unit} over the crack. {remedy}; or "
            'digitise with path.flow = "constant" and with leads as long as path.ramp_mm, or without path.ramp_mm.',
        )

    def plunger_mm(self, held_mm3: float = 0.0) -> Floats:
        """Return the plunger's travel at each waypoint, (n,).

        The travel does not include the volume ``held_mm3``, which is given while the nozzle waits before the path.
        Raises InputError if the plunger would move too far or too fast.
        """
        plunger = present(self.cell.plunger, "[plunger]")
        way_mm = np.concatenate([[0.0], np.cumsum(self.trajectory.given_mm3)]) / plunger.area_mm2
        speed_mm_s = self.trajectory.flow_mm3_s.max() / plunger.area_mm2
        needed_mm = way_mm[-1] + held_mm3 / plunger.area_mm2
        self.require(
            self.limit(
                "plunger.travel_mm",
                needed_mm,
                f"the path needs {needed_mm:.1f} mm of the plunger's travel",
                "Fill the syringe, or digitise with a smaller path.volume_ml or path.fill.",
            ),
            self.limit(
                "plunger.largest_speed_mm_s",
                speed_mm_s,
                f"the path needs a plunger speed of {speed_mm_s:.3g} mm/s",
                "Digitise with a lower path.speed_mm_s.",
                ROUNDING,
            ),
        )
        return way_mm


def place_path(trajectory: Trajectory, cell: RobotCell, cell_file: str, pump: PumpTable | None = None) -> RobotPath:
    """Transform a path from the sample's frame into the robot's. Raises InputError with all exceeded limits.

    If a weighed ``pump`` is given, the path's flow is replaced by the flow to request from the pump.
    """
    _check_rows(trajectory)
    cell.require_frame(trajectory.has_origin, cell_file)
    sample_mm, robot_mm = (
        np.array([getattr(point, field) for point in cell.taught]) for field in ("sample_mm", "robot_mm")
    )
    frame = fit_frame(sample_mm, robot_mm, limit_mm=cell.frame_limit_mm, where=cell_file)
    placed = replace(trajectory, position_mm=frame.to_robot_mm(trajectory.position_mm))
    warnings, hold_s = _warnings(trajectory, frame, cell), 0.0
    if pump is not None:
        hold_s = float(np.interp(trajectory.flow_mm3_s[trajectory.giving.start], pump.given_mm3_s, pump.delay_s))
        warnings += tuple(
            f"a {LANGUAGES[name].title} program whose axis presses the plunger cannot wait for the pump's delay of "
            f"{hold_s:.2g} s. Digitise with a path.lead_in_mm, and start the plunger by hand"
            for name, table in cell.languages.items()
            if hold_s > 0 and not table.waits_for_pump
        )
        placed = replace(placed, flow_mm3_s=pump.asked_for(trajectory.flow_mm3_s))
        warnings += pump.warnings
    path = RobotPath(placed, frame, cell, cell_file, warnings, trajectory.dispensed_mm3, hold_s, pump is not None)
    path.require(*_motion_limits(path, trajectory), path.reach_limit("the path", placed.position_mm))
    return path


def _check_rows(trajectory: Trajectory) -> None:
    """Raise InputError if trajectory.csv, which may have been edited, is not a valid path."""
    t_s = trajectory.t_s
    numbers = np.column_stack([t_s, trajectory.position_mm, trajectory.speed_mm_s, trajectory.flow_mm3_s])
    sound = (
        len(t_s) > 1 and np.isfinite(numbers).all() and (np.diff(t_s) > 0).all() and (trajectory.flow_mm3_s >= 0).all()
    )
    way_mm = step_lengths(trajectory.position_mm)
    if not sound or not np.allclose(way_mm, trajectory.speed_mm_s[:-1] * np.diff(t_s), rtol=1e-3, atol=1e-3):
        raise InputError(
            "trajectory.csv: it needs two or more rows of finite numbers, increasing t_s, flow_mm3_s of 0 or more, "
            "and the speed_mm_s that follows from positions and times. Digitise again."
        )
    if not trajectory.dispensed_mm3 > 0:
        raise InputError(
            "trajectory.csv: flow_mm3_s must be above 0 in at least one row. A trial with a path but without a solid "
            "needs path.volume_ml."
        )


def _motion_limits(path: RobotPath, trajectory: Trajectory) -> list[Limit]:
    """Return the limits of the motion along a path. ``trajectory`` is the same path in the sample's frame."""
    motion, limit = path.cell.motion, path.limit
    height_mm = trajectory.position_mm[:, 2].max()
    fastest_mm_s, approach_mm_s = trajectory.speed_mm_s.max(), motion.approach_speed_mm_s
    # The mean velocity between two rows is the velocity at the middle of the time between them. It changes on ramps,
    # and with the acceleration v^2 / r in bends.
    velocity = np.diff(trajectory.position_mm, axis=0) / (lasts_s := np.diff(trajectory.t_s))[:, None]
    change = step_lengths(velocity) / midpoints(lasts_s)
    most_mm_s2 = change.max(initial=0.0)
    place_mm = trajectory.s_mm[int(np.append(0.0, change).argmax())]
    return [
        (
            motion.safe_height_mm <= height_mm,
            f"motion.safe_height_mm is {motion.safe_height_mm:g}, but the path itself runs {height_mm:g} mm above the "
            "face. Give a larger motion.safe_height_mm.",
        ),
        limit(
            "motion.largest_speed_mm_s",
            max(fastest_mm_s, approach_mm_s),
            f"the path runs at {fastest_mm_s:g} mm/s, and motion.approach_speed_mm_s is {approach_mm_s:g}",
            "Give lower speeds.",
            ROUNDING,
        ),
        limit(
            "motion.acceleration_mm_s2",
            most_mm_s2,
            f"the ramp or bend at s = {place_mm:.1f} mm needs {most_mm_s2:.4g} mm/s²",
            "Digitise with a lower path.speed_mm_s, a longer path.ramp_mm or a larger path.smoothing_mm.",
            0.01,
        ),
    ]


def _warnings(trajectory: Trajectory, frame: RobotFrame, cell: RobotCell) -> tuple[str, ...]:
    warnings = []
    if (growth := frame.error_growth(trajectory.position_mm)) > MUCH_GROWTH:
        warnings.append(
            "the path runs so far outside the taught points that an error of 0.1 mm at each becomes an error of "
            f"{growth / 10:.2f} mm in the nozzle's height. Teach points around the crack"
        )
    begins, way_mm = trajectory.giving.start, arc_length(trajectory.position_mm)
    speed_mm_s = trajectory.speed_mm_s[begins]
    needed_mm = speed_mm_s**2 / (2 * cell.motion.acceleration_mm_s2)
    if needed_mm > way_mm[begins + 1]:
        warnings.append(
            f"the arm needs {needed_mm:.1f} mm to reach {speed_mm_s:.4g} mm/s, but has only {way_mm[begins]:.1f} mm "
            "before the first sealant. A dispenser that is timed by a clock gives too much there. Digitise with a "
            f"path.lead_in_mm or path.ramp_mm of at least {needed_mm:.1f}"
        )
    return tuple(warnings)
