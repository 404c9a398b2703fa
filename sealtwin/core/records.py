"""Records that stages exchange: frozen, plain arrays, in millimetres and seconds.

Conventions, everywhere:

- ``_px``: x right, y down, origin at the centre of the photo's first pixel.
- ``_mm``: right-handed; x right and y UP in the photo, z out of the face, z = 0 on it. The origin is the lower left
  corner of the face if the face is known, else the centre of the photo's lower left pixel.
- ``s_mm`` is the arc length along the centreline from the first end given, where the nozzle starts. At an open end,
  s = 0 is the point at which the centreline meets the edge of the face.
- Polylines are open, rings are counter-clockwise in mm and do not repeat their first point.
"""

from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, with_config

from sealtwin.core.arc_length import arc_length
from sealtwin.core.arrays import FROM_JSON, Booleans, Floats, Integers, Numbers, Points, Shown, require_as_long, unit
from sealtwin.core.doubts import Doubt, QuantityMean, ReadSheet
from sealtwin.core.facts import Fact
from sealtwin.core.run_figures import FastFill, FilledBy, RunHealth
from sealtwin.core.solid_figures import EndKind, SolidFigures, Span

FACING = 0.98  # Least cosine at which the line between two walls counts as square to the centreline: 11 degrees

PathSource = Literal["ends", "via", "automatic", "choice", "mask", "mesh", "line", "drawn"]
"""Source of a crack's path.

ends: given ends; via: given ends and points between them; automatic: search; choice: a person's choice among the cracks
of a search; mask: a painted mask; mesh: the crack's mouth in a mesh; line: a given line in a mesh; drawn: lines given
in mm. An automatic path is a proposal until a person has looked at it.
"""

WidthSource = Literal["walls", "region", "fit", "gauge", "none"]
"""Source of a crack's width.

walls: measured between the walls; region: between the rims of the dark region along the path, on coarse ground; fit:
fitted to the blurred profile of a crack too thin for walls; gauge: given, for example as measured with a gauge; none: a
path without walls, for which both walls are on the centreline.
"""

Origins = tuple[tuple[str, str], ...]
"""Kind, and main figures with a digest, of each record that a record was made of; empty if unknown."""

DataKind = Literal["measured", "reconstructed", "synthetic", "undeclared"]
"""Origin of data. Only ``measured`` may ever be called validated."""


SHOWN_AROUND = np.array([0.42, 0.08])
"""Margins, x and y, of the photo that a report shows around a crack, as shares of its extent. x has the ends' names."""

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")

WallMethod = Literal["edge", "region", "fit", "gauge", "drawn", "bridged"]
"""Method that placed a wall.

edge: its step from dark to bright; region, fit, gauge: as of a width's source; drawn: lines drawn by hand; bridged:
straight between its neighbours, since it is not in view."""


@with_config(FROM_JSON)
@dataclass(frozen=True)
class WallStretch:
    """Origin of a stretch of a wall."""

    s_from_mm: float
    s_to_mm: float
    side: Side
    method: WallMethod
    doubt_mm: Span | None
    """Least and largest distance from the centreline at which the wall may be; None if unknown."""
    why: str

    def sentence(self, unit: str = "mm") -> str:
        """Return the stretch in words: "left wall by edge: in the middle of the step from dark to bright"."""
        may_be = "; it may be {:.2f} to {:.2f} {} from the centreline"
        doubt = may_be.format(*self.doubt_mm, unit) if self.doubt_mm else ""
        return f"{self.side} wall by {self.method}: {self.why}{doubt}"


class FaceLabel(IntEnum):
    """Part of a solid that a triangle belongs to."""

    TOP = 0
    WALL = 1
    FLOOR = 2
    END = 3  # Vertical wall across a cut end, or the inner side of the dam at an open end
    OUTSIDE = 4


@with_config(FROM_JSON)
@dataclass(frozen=True, repr=False)
class Outline(Shown):
    """Crack on the face of a sample, in plan view.

    ``left_wall`` is on the left in the direction of growing s (mm frame, y up). At an oblique open end, one wall
    reaches the edge of the face before the other. It then repeats its last point until the other wall reaches the edge.
    """

    centreline_mm: Points  # (n, 2), first row at s = 0
    left_wall_mm: Points  # (n, 2), point by point with the centreline
    right_wall_mm: Points  # (n, 2)
    outline_mm: Points  # (m, 2), ring
    centreline_px: Points
    left_wall_px: Points
    right_wall_px: Points
    outline_px: Points
    ends: tuple[EndKind, EndKind]
    face_mm: tuple[float, float, float, float] | None
    """x_min, y_min, x_max, y_max of the sample's face; None if unknown."""
    mm_per_px: float  # Local scale at the middle of the crack
    scale_source: str  # Description, for example "8 ArUco markers" or "given: 0.35 mm/px (assumed)"
    scale_residual_mm: float | None  # RMS misfit of the scale's control points; None if there are none
    path_source: PathSource
    warnings: tuple[Fact, ...] = ()
    islands_mm: tuple[Points, ...] = ()  # Rings inside the outline that are no crack, clockwise
    bands_mm: tuple[Points, ...] = ()
    """Rings around bands along the walls that may be crack or ground, as of debris. ``width_95_mm`` covers both."""
    branches_mm: tuple[Points, ...] = ()
    """Centrelines of the side cracks, from the main crack outward."""
    branches_kept: bool = False  # True if the outline includes the side cracks
    scale_uncertainty: float | None = None
    """Relative standard uncertainty of every length due to the scale; None if unknown."""
    camera_tilt_deg: float | None = None
    """Angle between the camera's axis and the normal of the face; None if the photo does not show it."""
    photo_size_px: tuple[int, int] | None = None  # Width and height of the photo; None of an outline made by hand
    width_source: WidthSource = "walls"
    width_95_mm: Span | None = None
    """95 % interval of the mean width, without the scale's uncertainty; None if the method gives no interval."""
    walls: tuple[WallStretch, ...] = ()
    """Origin of the walls, each from end to end. A later stretch counts where it overlaps. Empty without a photo."""

    def __post_init__(self) -> None:
        require_as_long(self, "centreline_mm", "left_wall_mm", "right_wall_mm")
        require_as_long(self, "centreline_px", "left_wall_px", "right_wall_px")

    @property
    def main_figures(self) -> dict[str, str]:
        if self.width_source == "none":
            width = "without walls"
        elif self.width_95_mm is None:
            width = f"{self.mean_width_mm:.2f} mm"
        else:
            width = "{:.2f} mm ({:.2f} to {:.2f})".format(self.mean_width_mm, *self.width_95_mm)
        figures = {"length": f"{self.length_mm:.1f} mm", "mean width": width, "ends": " and ".join(self.ends)}
        return figures | {"path": self.path_source, "warnings": str(len(self.warnings))}

    @property
    def shown_px(self) -> Floats:
        """Lower and upper corner of the part of the photo that a report shows, (2, 2).

        A corner may be outside the photo.
        """
        around_px = SHOWN_AROUND * float(np.ptp(self.outline_px, axis=0).max())
        return np.array([self.outline_px.min(axis=0) - around_px, self.outline_px.max(axis=0) + around_px])

    @property
    def seen_in(self) -> Literal["photo", "mesh", "drawing"]:
        """Kind of input that showed the crack."""
        if self.path_source == "drawn":
            return "drawing"
        return "mesh" if self.path_source in ("mesh", "line") else "photo"

    @property
    def s_mm(self) -> Floats:
        """Arc length at each centreline point, (n,)."""
        return arc_length(self.centreline_mm)

    @property
    def length_mm(self) -> float:
        return float(self.s_mm[-1])

    @property
    def width_mm(self) -> Floats:
        """Width at each centreline point: the distance between the walls, square to the centreline, (n,).

        At an oblique open end both wall points are on the edge of the face, and the square part of their distance is as
        rough as the walls. There the width is the mean of that part, up to the nearest point whose walls face each
        other. In a sharp bend, where the outer wall turns around the inner corner, the width is the square part itself.
        So the widths add up to the crack's area.
        """
        s_mm, across_mm = self.s_mm, self.left_wall_mm - self.right_wall_mm
        width_mm = np.linalg.norm(across_mm, axis=1)
        # A hand-written centreline may turn on the spot, where no direction is square to it.
        ahead = unit(np.gradient(self.centreline_mm, axis=0))
        square_mm = np.abs(ahead[:, 0] * across_mm[:, 1] - ahead[:, 1] * across_mm[:, 0])
        facing = np.flatnonzero(square_mm >= FACING * width_mm)
        if len(facing):
            between = slice(facing[0], facing[-1] + 1)
            bends = square_mm[between] < FACING * width_mm[between]
            width_mm[between][bends] = square_mm[between][bends]
            oblique = slice(0, facing[0] + 1), slice(facing[-1], len(s_mm))
            for kind, stations in zip(self.ends, oblique, strict=True):
                piece_mm = np.ptp(s_mm[stations])
                if kind == "open" and piece_mm > 0:
                    width_mm[stations] = np.trapezoid(square_mm[stations], s_mm[stations]) / piece_mm
        return width_mm

    @cached_property
    def mean_width_mm(self) -> float:
        """Width averaged over the arc length."""
        return float(np.trapezoid(self.width_mm, self.s_mm) / self.length_mm)

    @property
    def width_doubt_mm(self) -> float | None:
        """Standard uncertainty of the mean width: a quarter of its 95 % interval's length; None without an interval."""
        return None if self.width_95_mm is None else (self.width_95_mm[1] - self.width_95_mm[0]) / 4


@dataclass(frozen=True)
class Sections:
    """Depth and area of a cavity along its crack's centreline."""

    s_mm: Numbers  # (k,), increasing
    depth_mm: Numbers  # (k,)
    area_mm2: Numbers  # (k,): of the section square to the centreline, below the face
    levels_mm: Numbers | None = None  # (n,), from the deepest floor up to 0; None if the walls are straight
    below_mm2: Numbers | None = None  # (k, n): area of each section below each level

    def __post_init__(self) -> None:
        require_as_long(self, "s_mm", "depth_mm", "area_mm2", "below_mm2")
        if len(self.s_mm) == 0 or self.s_mm.ndim != 1 or (np.diff(self.s_mm) <= 0).any():
            raise ValueError("s_mm should grow from station to station")
        if self.below_mm2 is not None:
            levels = 0 if self.levels_mm is None else len(self.levels_mm)
            if levels < 2 or self.below_mm2.shape[1:] != (levels,):
                raise ValueError("below_mm2 should have one column for each of levels_mm, and at least two")

    @property
    def by_level(self) -> bool:
        """True if areas are tabulated by level, for walls without a constant angle."""
        return self.below_mm2 is not None

    def below_at_mm2(self, s_mm: Floats, level_mm: Floats) -> Floats:
        """Return the area of the sections at ``s_mm`` below ``level_mm``, (m,) each. A level above 0 counts as 0.

        Raises ValueError for straight walls: their areas follow from their angles.
        """
        if self.levels_mm is None or self.below_mm2 is None:
            raise ValueError("sections with straight walls have no table of areas by level")
        columns = np.array([np.interp(s_mm, self.s_mm, area_mm2) for area_mm2 in self.below_mm2.T])
        step_mm = self.levels_mm[1] - self.levels_mm[0]
        steps = np.clip((level_mm - self.levels_mm[0]) / step_mm, 0.0, len(self.levels_mm) - 1.0)
        row, station = np.minimum(steps.astype(int), len(self.levels_mm) - 2), np.arange(len(s_mm))
        lower_mm2, upper_mm2 = columns[row, station], columns[row + 1, station]
        return lower_mm2 + (steps - row) * (upper_mm2 - lower_mm2)


@dataclass(frozen=True, eq=False, repr=False)
class Solid(Shown):
    """Sample: a block minus the crack's cavity, with dams at open ends. It is watertight, and its faces point outward.

    Solids are compared by identity, so that a solid can be the key of a cache.
    """

    vertices_mm: Floats  # (v, 3)
    faces: Integers  # (f, 3)
    face_label: Integers  # (f,), FaceLabel values
    block_mm: tuple[float, float, float, float]  # x_min, y_min, x_max, y_max of the block; dams may be outside
    depth_mm: float  # Largest depth
    tilt: str  # Interpretation of the walls' tilt; "modelled" for a mesh whose walls have no constant angle
    wall_angles_deg: tuple[float, float]  # Angles of the left and the right wall from vertical
    cavity_volume_mm3: float  # Volume between the walls, below the face, inside the block
    sections: Sections  # Cavity along the centreline, without side cracks and the parts beyond its ends
    figures: SolidFigures
    made_of: Origins = ()

    @property
    def main_figures(self) -> dict[str, str]:
        angles = " and ".join(f"{angle:g}" for angle in self.wall_angles_deg)
        return {
            "depth": f"{self.depth_mm:g} mm",
            "walls": self.tilt if self.tilt == "modelled" else f"{self.tilt}, {angles} deg",
            "cavity": f"{self.cavity_volume_mm3 / 1000:.2f} ml",
        }

    @property
    def doubts(self) -> tuple[Fact, ...]:
        """Doubts about the solid."""
        return self.figures.warnings

    def depth_at_mm(self, s_mm: Floats) -> Floats:
        """Return the depth of the cavity's floor at each arc length along the centreline, (n,)."""
        return np.interp(s_mm, self.sections.s_mm, self.sections.depth_mm)


@dataclass(frozen=True, repr=False)
class Trajectory(Shown):
    """Timed nozzle path: waypoints, each with the speed and flow up to the next one.

    The last row has speed 0 and flow 0.
    """

    t_s: Floats  # (n,)
    position_mm: Floats  # (n, 3): the nozzle tip
    s_mm: Floats  # (n,): arc length on the crack's centreline
    speed_mm_s: Floats  # (n,)
    flow_mm3_s: Floats  # (n,)
    made_of: Origins = ()

    @property
    def main_figures(self) -> dict[str, str]:
        return {
            "length": f"{self.length_mm:.1f} mm",
            "time": f"{self.duration_s:.1f} s",
            "sealant": f"{self.dispensed_mm3 / 1000:.2f} ml",
        }

    @property
    def duration_s(self) -> float:
        return float(self.t_s[-1] - self.t_s[0])

    @property
    def length_mm(self) -> float:
        """Length of the path from waypoint to waypoint; smoothing makes it shorter than the centreline."""
        return float(arc_length(self.position_mm)[-1])

    @property
    def given_mm3(self) -> Floats:
        """Sealant dispensed between each waypoint and the next, (n - 1,)."""
        return self.flow_mm3_s[:-1] * np.diff(self.t_s)

    @property
    def dispensed_mm3(self) -> float:
        return float(self.given_mm3.sum())

    @property
    def giving(self) -> slice:
        """Waypoints from the first sealant to the last, without leads. All waypoints if the path gives no sealant."""
        flowing = np.flatnonzero(self.flow_mm3_s[:-1] > 0)
        return slice(int(flowing[0]), int(flowing[-1]) + 2) if len(flowing) else slice(0, len(self.t_s))


class JsonRecord(BaseModel):
    """A frozen record that is written as JSON, key by key."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


@dataclass(frozen=True, repr=False)
class Bed:
    """Particles, falling or at rest: the input for measuring levels and volumes."""

    position_mm: Floats  # (n, 3)
    velocity_mm_s: Floats  # (n, 3)
    spilled: Booleans  # (n,): over the sample's edge
    radius_mm: float
    particle_volume_mm3: float  # Dispensed volume over the number of particles: Eq. 6 of the paper.
    settings: dict[str, Any]  # Effective settings of the solver after its preset is resolved

    @property
    def particles(self) -> int:
        return len(self.position_mm)

    @property
    def spilled_particles(self) -> int:
        return int(self.spilled.sum())


@dataclass(frozen=True, repr=False)
class Run(Shown, Bed, FilledBy):
    """Finished fluid run, by particles or by the fast model, which does not use particles."""

    age_s: Floats  # (n,): since release
    escaped_particles: int  # Particles that went through a wall; anything but 0 is a fault
    device: str
    health: RunHealth  # Numbers that show whether the run can be trusted: density error, neighbours, iterations, times
    fast_fill: FastFill | None = None
    remarks: tuple[Fact, ...] = ()  # Known before the first frame: what the run cannot show of its sealant
    level: "Profile | None" = None  # Level by the fast model; None for particles, whose level is measured from them
    doubts: tuple[Fact, ...] = ()  # Settings outside their likely ranges
    made_of: Origins = ()

    @property
    def main_figures(self) -> dict[str, str]:
        ratio = self.health.volume_ratio
        figures = {"dispensed": f"{self.dispensed_volume_mm3 / 1000:.2f} ml", "device": self.device}
        if self.fast_fill is None:
            figures |= {"particles": f"{self.particles}, {self.radius_mm:g} mm", "escaped": str(self.escaped_particles)}
        return figures | ({} if ratio is None else {"volume kept": f"{ratio:.3f}"})

    @property
    def dispensed_volume_mm3(self) -> float:
        if self.fast_fill is not None:
            return self.fast_fill.dispensed_mm3
        return self.particles * self.particle_volume_mm3

    @property
    def density_kg_m3(self) -> float | None:
        """Density of the sealant; None if the settings do not have it."""
        return self.settings.get("fluid", {}).get("density_kg_m3")

    @property
    def share_below_face(self) -> float:
        """Share of the sealant on the sample that is below the face; 0 if there is no sealant."""
        if self.fast_fill is not None:
            return self.fast_fill.in_crack_mm3 / (self.fast_fill.in_crack_mm3 + self.fast_fill.above_face_mm3)
        height_mm = self.position_mm[~self.spilled, 2]
        return float((height_mm <= 0).mean()) if len(height_mm) else 0.0


@dataclass(frozen=True, repr=False)
class Profile(Shown):
    """Level of the sealant along the crack, relative to the face: negative below it, positive above."""

    s_mm: Floats  # (n,), increasing
    level_mm: Floats  # (n,)
    repeats_mm: Floats | None = None  # Single readings of a measured profile, (n, r); NaN for a missing one
    data: DataKind = "synthetic"
    source: str = ""
    dialect: str = ""  # Sentence on the interpretation of the sheet of readings; empty for a simulated profile
    doubts: tuple[str, ...] = ()  # Doubts about the interpretation, a sentence each with the cell and how to answer
    questions: tuple[Doubt, ...] = ()  # The same doubts in parts
    understood: ReadSheet | None = None  # Interpretation of the sheet of readings
    means: dict[str, QuantityMean] = field(default_factory=dict[str, QuantityMean])
    """Means of the other quantities in the sheet of readings, by quantity."""
    is_depth: bool = False  # True if the sheet counts downward from its datum
    made_of: Origins = ()

    @property
    def main_figures(self) -> dict[str, str]:
        return {
            "stations": f"{len(self.s_mm)}, {self.s_mm[0]:g} to {self.s_mm[-1]:.4g} mm",
            "level": f"{self.level_mm.min():.2f} to {self.level_mm.max():.2f} mm",
            "data": self.data,
        }

    def level_at_mm(self, s_mm: Floats) -> Floats:
        """Return the level at other stations, (k,), which is linear between the profile's own."""
        return np.interp(s_mm, self.s_mm, self.level_mm)


@dataclass(frozen=True, eq=False)
class Sample:
    """A digitised crack, its solid and the nozzle's path: all that a run takes from a photo or a mesh.

    Samples are compared by identity, so that a sample can be the key of a cache.
    """

    outline: Outline
    solid: Solid
    trajectory: Trajectory
    readings: Profile | None = None
