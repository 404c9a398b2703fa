"""A robot's cell, one TOML file: where the sample lies in it, what the arm may do, and what its languages need."""

import math
from typing import Annotated, Literal, Self, get_args

import numpy as np
from pydantic import Field, model_validator

from digitise.settings import OnFace
from sealtwin.settings import Settings

Format = Literal["txt", "csv", "spel", "gcode", "urscript"]
FORMATS: tuple[Format, ...] = get_args(Format)

InCell = Annotated[float, Field(ge=-10_000, le=10_000)]
"""A coordinate of the robot's frame, in mm: no arm reaches ten metres."""
Angle = Annotated[float, Field(ge=-360, le=360)]
SPEL_POINTS = 1000
"""P0 to P999: what an Epson controller's point file holds."""


class Taught(Settings):
    """One point on the face, as the sample knows it and as the arm's tip found it."""

    sample_mm: tuple[OnFace, OnFace]
    """x and y as in outline.json: x right and y up in the photo. With face_mm its lower left corner is [0, 0]."""
    robot_mm: tuple[InCell, InCell, InCell]
    """What the pendant shows with the nozzle's tip on that point."""


class Reach(Settings):
    """The box, in the robot's frame, that the nozzle's tip must not leave."""

    low_mm: tuple[InCell, InCell, InCell]
    high_mm: tuple[InCell, InCell, InCell]

    @model_validator(mode="after")
    def _a_box(self) -> Self:
        if not (np.array(self.low_mm) < self.high_mm).all():
            raise ValueError(f"low_mm {list(self.low_mm)} must be below high_mm {list(self.high_mm)} in x, y and z")
        return self


class Motion(Settings):
    """What the arm may do."""

    largest_speed_mm_s: float = Field(gt=0.01, le=5000)
    """Of the tip. No default: it is the cell's owner who knows."""
    acceleration_mm_s2: float = Field(gt=1, le=50_000)
    """Of the tip: what programs ask for, and what ramps and bends of the path may need."""
    approach_speed_mm_s: float = Field(default=20.0, gt=0.1, le=250)
    """On the way to the path and from it: from 50 mm up it takes 2.5 s, time to reach for the stop. 250 is the limit
    of manual operation in ISO 10218-1.
    """
    safe_height_mm: float = Field(default=50.0, gt=1, le=1000)
    """Of the tip above the face on that way: five times the height of the dams at open ends."""
    largest_tilt_deg: float = Field(default=5.0, gt=0, le=30)
    """Between nozzle and the face's normal: at 5 degrees, 3 mm above the face, the jet meets it 0.26 mm beside the
    path.
    """
    most_waypoints: int = Field(default=SPEL_POINTS - 2, ge=3, le=100_000)
    """What the controller holds. An Epson point file holds a thousand, two of them above the ends of the path."""


class Plunger(Settings):
    """The syringe, where the robot itself drives its plunger: by one of its axes, or as an extruder."""

    diameter_mm: float | None = Field(default=None, gt=0.5, le=300)
    """Inner diameter of the syringe, where a millimetre of the axis is one of the plunger."""
    mm3_per_mm: float | None = Field(default=None, gt=1e-4, le=1e5)
    """Sealant that a millimetre of the axis gives, where something is geared between: weigh what 10 mm give."""
    travel_mm: float = Field(gt=0.1, le=1000)
    """What the plunger may go from where it stands: a path that needs more is refused."""
    largest_speed_mm_s: float = Field(gt=0.001, le=500)
    """Of the plunger."""

    @property
    def area_mm2(self) -> float:
        """Sealant for each millimetre."""
        return self.mm3_per_mm or math.pi / 4 * (self.diameter_mm or 0.0) ** 2

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if (self.diameter_mm is None) == (self.mm3_per_mm is None):
            raise ValueError("give either diameter_mm or mm3_per_mm, one of the two and not both")
        return self


class Spel(Settings):
    """An Epson arm and its SPEL+ program."""

    motion: Literal["curve", "move"] = "curve"
    """curve: Curve and CVMove, one speed all along the crack; move: Move ... CP from point to point, each with its
    speed, for paths whose speed or dose changes.
    """
    dispenser: Literal["output", "z", "s", "t"]
    """output: a bit switches a dispenser of constant flow on and off. z, s or t: that axis presses the plunger; on z
    the arm can no longer lift the nozzle, as in the paper; of the added axes s and t, the other is sent to 0.
    """
    output_bit: int | None = Field(default=None, ge=0, le=8191)
    """With dispenser = "output"."""
    axis_start_mm: InCell | None = None
    """With z, s or t: the axis' coordinate with the plunger ready to give."""
    axis_gives: Literal["+", "-"] = "-"
    """The way of that axis that presses the plunger: down, for the paper's z."""
    hand: Literal["right", "left"] = "right"
    """The arm's posture: of a SCARA, on which side its elbow is not."""
    u_deg: Angle = 0.0
    """The tool's turn about the vertical, kept all along: a nozzle is round."""
    vw_deg: tuple[Angle, Angle] | None = None
    """V and W of a six-axis arm with the nozzle down; left out for a SCARA."""
    tool: int = Field(default=0, ge=0, le=15)
    """Number of the tool whose tip is the nozzle's; 0 is the bare flange."""
    local: int = Field(default=0, ge=0, le=15)
    """Number of the local frame that robot_mm was read in; 0 is the robot's own."""
    first_point: int = Field(default=0, ge=0, lt=SPEL_POINTS)
    """Points of the program's robot from this number on are overwritten."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if (self.dispenser == "output") != (self.output_bit is not None):
            raise ValueError('output_bit and dispenser = "output" go together: give both or neither')
        if (self.dispenser == "output") != (self.axis_start_mm is None):
            raise ValueError("axis_start_mm and a dispenser of z, s or t go together: give both or neither")
        if self.motion == "curve" and self.dispenser in ("s", "t"):
            raise ValueError(f'dispenser = "{self.dispenser}" with motion = "curve": a Curve has no added axis; "move"')
        return self


class Gcode(Settings):
    """A gantry with an extruder."""

    relative_e: bool = False
    """M83 in place of M82. Absolute E shows at any line how much has been given."""
    cold_extrusion: bool = False
    """Write M302 P1: Marlin moves no extruder below 170 degrees without it, and seals dry, without a word."""


class Urscript(Settings):
    """An arm of Universal Robots."""

    blend_mm: float = Field(default=0.4, gt=0.01, le=20)
    """Radius in which the arm rounds each waypoint: below half the spacing, which is 1 mm by default. With none it
    would stop at each.
    """
    dispenser: Literal["analog", "digital"]
    """analog: a standard analog output in proportion to the flow; digital: a standard output on and off."""
    port: int = Field(ge=0, le=7)
    """Analog: 0 or 1; digital: 0 to 7."""
    full_flow_mm3_s: float | None = Field(default=None, gt=1e-3, le=1e6)
    """With dispenser = "analog": what the dispenser gives at the output's full level."""
    tool_turn_deg: Angle = 0.0
    """About the nozzle, from the robot's x axis: for a camera or a cable that must not be in the way."""
    rotation_vector_rad: tuple[Angle, Angle, Angle] | None = None
    """In place of tool_turn_deg: rx, ry, rz as the pendant shows them with the nozzle square to the face."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if (self.dispenser == "analog") != (self.full_flow_mm3_s is not None):
            raise ValueError('full_flow_mm3_s and dispenser = "analog" go together: give both or neither')
        if self.dispenser == "analog" and self.port > 1:
            raise ValueError(f"port is {self.port}: a standard analog output is 0 or 1")
        if self.rotation_vector_rad is not None and self.tool_turn_deg:
            raise ValueError("tool_turn_deg beside rotation_vector_rad: the vector says how the tool is turned")
        return self


class Cell(Settings):
    """All of a cell file."""

    name: Annotated[str, Field(min_length=1, max_length=80)]
    """Of the cell, for the head of its programs."""
    formats: tuple[Format, ...] = Field(min_length=1)
    """What is written where --format does not say."""
    robot_z: Literal["up", "down"] = "up"
    """Which way the robot's z points; down where its base hangs from a ceiling."""
    frame_limit_mm: float = Field(default=0.5, gt=0, le=10)
    """The worst that a taught point may miss by: a sixth of the paper's 3.1 mm wide crack, and more than a tip that is
    touched to a mark by hand.
    """
    taught: tuple[Taught, ...] = Field(min_length=3, max_length=100)
    """Three or more points on the face, not in line. A fourth shows errors that three cannot."""
    reach: Reach
    motion: Motion
    plunger: Plunger | None = None
    spel: Spel | None = None
    gcode: Gcode | None = None
    urscript: Urscript | None = None

    @property
    def up(self) -> float:
        return 1.0 if self.robot_z == "up" else -1.0

    def missing_for(self, kind: Format) -> str | None:
        """The table that a format needs and the cell does not have."""
        if kind in ("spel", "gcode", "urscript") and getattr(self, kind) is None:
            return kind
        presses = kind == "gcode" or (kind == "spel" and self.spel is not None and self.spel.dispenser != "output")
        return "plunger" if presses and self.plunger is None else None

    @model_validator(mode="after")
    def _tables_for_formats(self) -> Self:
        for kind in self.formats:
            if (table := self.missing_for(kind)) is not None:
                raise ValueError(f'formats has "{kind}", but there is no [{table}] table: add it, or take "{kind}" out')
        return self
