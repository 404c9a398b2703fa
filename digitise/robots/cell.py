"""Cell file of a robot, in TOML: its limits, its languages, and the sample's frame by points taught on its face."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal, Self, get_args

import numpy as np
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from digitise.robots.pump import Pump
from digitise.settings import OnFace
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.core.settings import Settings

Format = Literal["txt", "csv", "spel", "gcode", "urscript"]
FORMATS: tuple[Format, ...] = get_args(Format)

InCell = Annotated[float, Field(ge=-10_000, le=10_000)]  # Coordinate in mm of the robot: no arm reaches ten metres
Angle = Annotated[float, Field(ge=-360, le=360)]
SPEL_POINTS = 1000  # Number of points in an Epson controller's point file, P0 to P999
STEADY = (("spel", "motion", "curve"), ("spel", "dispenser", "output"), ("urscript", "dispenser", "digital"))
THINNEST_MM = 5.0  # Least RMS spread of taught points off their line: below it, an error of 0.2 mm tips the face by 2°


class Taught(Settings):
    """One point on the face, in the sample's frame and in the robot's."""

    sample_mm: tuple[OnFace, OnFace]
    """x and y as in outline.json: x right and y up in the photo. If face_mm is given, the face's lower left corner is
    [0, 0]."""
    robot_mm: tuple[InCell, InCell, InCell]
    """Coordinates that the pendant shows if the nozzle's tip is on that point."""


class Reach(Settings):
    """Box in the robot's frame that the nozzle's tip must not leave."""

    low_mm: tuple[InCell, InCell, InCell]
    """Smallest x, y and z of the box."""
    high_mm: tuple[InCell, InCell, InCell]
    """Largest x, y and z of the box."""

    @model_validator(mode="after")
    def _a_box(self) -> Self:
        if not (np.array(self.low_mm) < self.high_mm).all():
            raise ValueError(f"low_mm {list(self.low_mm)} must be below high_mm {list(self.high_mm)} in x, y and z")
        return self


class Motion(Settings):
    """Limits of the arm's motion."""

    largest_speed_mm_s: float = Field(gt=0.01, le=5000)
    """Largest speed of the tip. Required, since it depends on the cell."""
    acceleration_mm_s2: float = Field(gt=1, le=50_000)
    """Acceleration of the tip in programs, and the limit for ramps and bends of the path."""
    approach_speed_mm_s: float = Field(default=20.0, gt=0.1, le=250)
    """Speed to the path and away from it. At 20 mm/s the nozzle needs 2.5 s for 50 mm, long enough to press the stop.
    250 is the limit of manual operation in ISO 10218-1."""
    safe_height_mm: float = Field(default=50.0, gt=1, le=1000)
    """Height of the tip above the face before and after the path. The default is five times that of the dams at open
    ends."""
    largest_tilt_deg: float = Field(default=5.0, gt=0, le=30)
    """Largest angle between the nozzle and the face's normal. At 5 degrees, from 3 mm above the face, the jet meets the
    face 0.26 mm off the path."""


class Plunger(Settings):
    """Syringe whose plunger the robot itself drives, by one of its axes or as an extruder."""

    diameter_mm: float = Field(gt=0.5, le=300)
    """Inner diameter of the syringe. If the plunger is geared, the diameter of a syringe that gives as much for each
    millimetre of the axis: weigh the sealant of 10 mm to find it."""
    travel_mm: float = Field(gt=0.1, le=1000)
    """Remaining travel of the plunger. A path that needs more is refused."""
    largest_speed_mm_s: float = Field(gt=0.001, le=500)
    """Largest speed of the plunger."""

    @property
    def area_mm2(self) -> float:
        """Volume of sealant, in mm³, for each millimetre of the axis."""
        return math.pi / 4 * self.diameter_mm**2


class Spel(Settings):
    """Settings of an Epson arm and its SPEL+ program."""

    motion: Literal["curve", "move"] = "curve"
    """curve: Curve and CVMove, one speed all along the crack; move: Move ... CP from point to point, each with its
    speed, for paths whose speed or dose changes."""
    dispenser: Literal["output", "z", "s", "t"]
    """output: a bit switches a dispenser of constant flow on and off. z, s or t: that axis presses the plunger. With z
    the arm can no longer lift the nozzle, as in the paper. With s or t, the other one of these added axes is sent to 0.
    """
    output_bit: int | None = Field(default=None, ge=0, le=8191)
    """Number of the bit for dispenser = "output"."""
    axis_start_mm: InCell | None = None
    """Coordinate of the axis z, s or t at which the plunger is ready to give sealant."""
    axis_gives: Literal["+", "-"] = "-"
    """Direction of the axis, + or -, that presses the plunger. With the paper's z axis it is down."""
    hand: Literal["right", "left"] = "right"
    """Posture of the arm. The elbow of a SCARA is on the opposite side."""
    u_deg: Angle = 0.0
    """Angle of the tool about the vertical. It is constant along the path, because a nozzle is round."""
    vw_deg: tuple[Angle, Angle] | None = None
    """Angles V and W of a six-axis arm with the nozzle down; omit them for a SCARA."""
    tool: int = Field(default=0, ge=0, le=15)
    """Number of the tool whose tip is the nozzle's tip; 0 is the bare flange."""
    local: int = Field(default=0, ge=0, le=15)
    """Number of the local frame in which robot_mm was read; 0 is the robot's own frame."""
    first_point: int = Field(default=0, ge=0, lt=SPEL_POINTS)
    """Number of the first point that the program uses. Points of its robot from this number on are overwritten."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if len({self.dispenser == "output", self.output_bit is not None, self.axis_start_mm is None}) > 1:
            raise ValueError('dispenser = "output" needs output_bit alone, and z, s or t need axis_start_mm alone')
        if self.motion == "curve" and self.dispenser in ("s", "t"):
            raise ValueError(
                f'dispenser = "{self.dispenser}" cannot be combined with motion = "curve", since a Curve has no added '
                'axis: give motion = "move"'
            )
        return self


class Gcode(Settings):
    """Settings of a gantry with an extruder."""

    cold_extrusion: bool = False
    """Write M302 P1, without which Marlin silently moves no extruder below 170 degrees."""


class Urscript(Settings):
    """Settings of an arm of Universal Robots."""

    blend_mm: float = Field(default=0.4, gt=0.01, le=20)
    """Radius of the blend at each waypoint. It must be less than half the spacing, which is 1 mm by default. Without a
    blend the arm would stop at each waypoint."""
    dispenser: Literal["analog", "digital"]
    """analog: a standard analog output, proportional to the flow. digital: a standard output that is on or off."""
    port: int = Field(ge=0, le=7)
    """Number of the output: analog 0 or 1, digital 0 to 7."""
    full_flow_mm3_s: float | None = Field(default=None, gt=1e-3, le=1e6)
    """Flow at the output's full level, for dispenser = "analog"."""
    tool_turn_deg: Angle = 0.0
    """Angle of the tool about the nozzle, measured from the robot's x axis. It keeps a camera or a cable at the tool's
    side clear."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if (self.dispenser == "analog") != (self.full_flow_mm3_s is not None):
            raise ValueError('full_flow_mm3_s and dispenser = "analog" go together: give both or neither')
        if self.dispenser == "analog" and self.port > 1:
            raise ValueError(f"port is {self.port}: give 0 or 1, the standard analog outputs")
        return self


class RobotCell(Settings):
    """Content of a cell file."""

    name: Annotated[str, Field(min_length=1, max_length=80)]
    """Name of the cell, written at the head of its programs."""
    formats: tuple[Format, ...] = Field(min_length=1)
    """Formats that are written unless --format names others."""
    frame_limit_mm: float = Field(default=0.5, gt=0, le=10)
    """Largest residual that a taught point may have. The default is a sixth of the width of the paper's 3.1 mm wide
    crack, and more than the error of touching a mark by hand."""
    taught: tuple[Taught, ...] = Field(min_length=3, max_length=100)
    """Three or more points on the face, not all on one line. A fourth reveals errors that three cannot."""
    reach: Reach
    motion: Motion
    plunger: Plunger | None = None
    pump: Pump | None = None
    """Weighings of the pump. With them, programs request the flow at which the pump gives what the path needs. Default:
    the pump gives what is requested."""
    spel: Spel | None = None
    gcode: Gcode | None = None
    urscript: Urscript | None = None

    @property
    def steady_settings(self) -> list[str]:
        """Settings, as written in the file, that keep a program at one speed or one flow."""
        return [
            f'{kind}.{name} = "{value}"'
            for kind, name, value in STEADY
            if kind in self.formats and getattr(getattr(self, kind), name) == value
        ]

    def missing_for(self, kind: Format) -> str | None:
        """Return the table that a format needs and the cell does not have; None if no table is missing."""
        if kind in ("spel", "gcode", "urscript") and getattr(self, kind) is None:
            return kind
        presses = kind == "gcode" or (kind == "spel" and self.spel is not None and self.spel.dispenser != "output")
        return "plunger" if presses and self.plunger is None else None

    @model_validator(mode="after")
    def _tables_for_formats(self) -> Self:
        for kind in self.formats:
            if (table := self.missing_for(kind)) is not None:
                raise ValueError(f'formats has "{kind}", but there is no [{table}] table: add it, or remove "{kind}"')
        return self


@dataclass(frozen=True)
class RobotFrame:
    """Rigid transform from the sample's millimetres to the robot's, between right-handed frames."""

    rotation: Floats  # (3, 3): its columns are the sample's axes in the robot's frame
    origin_mm: Floats  # (3,): the sample's origin in the robot's frame
    taught_mm: Floats  # (n, 2): the fitted points on the face
    residual_mm: Floats  # (n,): distance of the robot's points from the fitted ones
    scale: float  # Ratio of the robot's distances to the sample's: 1 without touch errors

    @property
    def normal(self) -> Floats:
        """Normal of the face in the robot's frame, (3,)."""
        return self.rotation[:, 2]

    def to_robot_mm(self, sample_mm: Floats) -> Floats:
        """Map points (n, 3) of the sample's frame to the robot's."""
        return sample_mm @ self.rotation.T + self.origin_mm

    def error_growth(self, sample_mm: Floats) -> float:
        """Return the factor by which a touch error grows at the worst point, (n, 2 or 3), sqrt(1 / n + x' S^-1 x)."""
        planes = [np.column_stack([np.ones(len(at_mm)), at_mm[:, :2]]) for at_mm in (self.taught_mm, sample_mm)]
        return float(np.linalg.norm(planes[1] @ np.linalg.pinv(planes[0]), axis=1).max())


def fit_frame(sample_mm: Floats, robot_mm: Floats, *, limit_mm: float, where: str) -> RobotFrame:
    """Fit rotation and shift of points on the face, (n, 2), to the same points as taught, (n, 3) (Kabsch 1976).

    Raises InputError, which names ``where``, if the points are in line, mirrored or of another scale, or do not fit
    within ``limit_mm``.
    """
    taught = np.column_stack([sample_mm, np.zeros(len(sample_mm))])
    middle, robot_middle = taught.mean(axis=0), robot_mm.mean(axis=0)
    spread, robot_spread = taught - middle, robot_mm - robot_middle
    thin_mm = np.linalg.svd(spread, compute_uv=False)[1] / np.sqrt(len(spread))
    if thin_mm < THINNEST_MM:
        raise InputError(
            f"{where}: the taught points are within {thin_mm:.2g} mm of a line, so the face's tilt about it is "
            f"unknown; they must deviate from the line by at least {THINNEST_MM:g} mm (RMS). Teach a point far from "
            "the others, such as a corner of the face."
        )
    rotation = Rotation.align_vectors(robot_spread, spread)[0].as_matrix()
    scale = float(np.sum(robot_spread * (spread @ rotation.T)) / np.sum(spread**2))
    origin_mm = robot_middle - rotation @ middle
    residual_mm = np.linalg.norm(taught @ rotation.T + origin_mm - robot_mm, axis=1)
    if residual_mm.max() > limit_mm:
        worst = int(residual_mm.argmax())
        x, y = sample_mm[worst]
        raise InputError(
            f"{where}: the taught points do not fit a sample that is only turned and shifted: point {worst + 1}, "
            f"sample_mm = [{x:g}, {y:g}], is {residual_mm[worst]:.2f} mm off; {limit_mm:g} mm are allowed "
            f"(frame_limit_mm). The robot's points are {scale:.4g} times as far apart as the sample's; both are in "
            "millimetres. Teach them again, or check their order, their numbers and the photo's scale."
        )
    if rotation[2, 2] <= 0:
        raise InputError(
            f"{where}: the taught points are mirrored: they put the sample's face downward. Perhaps two of them are "
            "exchanged, or their y counts downward; y must count upward as in outline.json. For an arm that hangs, "
            "teach them in a frame of the controller whose z points up."
        )
    return RobotFrame(rotation, origin_mm, sample_mm, residual_mm, scale)
