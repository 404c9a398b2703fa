"""Records that the stages exchange. They are frozen dataclasses of arrays, in millimetres and seconds.

These conventions hold everywhere:

- ``_px``: x is right, y is down, and the origin is the centre of the photo's first pixel.
- ``_mm``: the frame is right-handed. x is right and y is UP in the photo, z points out of the face, and z = 0 on the
  face. The origin is the lower left corner of the face. If the face is unknown, it is the centre of the photo's lower
  left pixel.
- ``s_mm`` is the arc length along the centreline from the first end that the user gave, where the nozzle starts. At an
  open end, s = 0 is the point at which the centreline meets the edge of the face.
- Polylines are open. Rings are counter-clockwise in mm, and do not repeat their first point.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import ConfigDict, with_config

from sealtwin.core.arc_length import arc_length
from sealtwin.core.arrays import (
    FROM_JSON,
    Booleans,
    Floats,
    HasSummary,
    Integers,
    Numbers,
    Points,
    ReadOnly,
    lengths,
    require_as_long,
    unit,
)
from sealtwin.core.doubts import Doubt, ReadSheet
from sealtwin.core.facts import Facts
from sealtwin.core.run_figures import FastFill, FilledBy, RunHealth
from sealtwin.core.scan_figures import Scan
from sealtwin.core.settings_text import OwnNames
from sealtwin.core.solid_figures import TILTS, Box, EndKind, SolidFigures, Span, Tilting

if TYPE_CHECKING:
    from trimesh import Trimesh

FACING = 0.98  # A line between the walls counts as perpendicular if it deviates by up to 11 degrees (cosine)

PathSource = Literal["ends", "via", "choice", "found", "mask", "mesh", "drawn"]
"""Source of a crack's path.

ends: the user gave the ends; via: the user gave the ends and points between them; choice: the user chose one
of the lines that a search found; found: the search took the line that is probably the crack; mask: the user painted a
mask; mesh: it is the crack's mouth in a mesh; drawn: the user gave lines in mm.
"""

WidthSource = Literal["walls", "region", "fit", "gauge", "none"]
"""Source of a crack's width.

walls: measured between the walls; region: measured between the rims of the dark region along the path, on a coarse
surface; fit: fitted to the blurred profile of a crack too thin for walls; gauge: given by the user, for example from a
crack gauge; none: there is only a path, and both walls are on the centreline.
"""

DataKind = Literal["measured", "reconstructed", "synthetic", "undeclared"]
"""Origin of data. Only results from ``measured`` data may be called validated."""


SHOWN_AROUND = np.array([0.42, 0.08])
"""Margins in x and y around the crack in a report's photo, as fractions of the crack's larger extent.

The margin in x is wider, since it shows the names of the ends."""

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")

WallMethod = Literal["edge", "region", "fit", "gauge", "drawn", "bridged"]
"""Method that located a wall.

edge: at the step from dark to bright; region, fit, gauge: same as in ``WidthSource``; drawn: the user drew it; bridged:
the stretch is hidden, and the wall is a straight line between its neighbours."""


@with_config(FROM_JSON)
@dataclass(frozen=True)
class WallStretch:
    """Stretch of a wall, and the method that located it."""

    s_from_mm: float
    s_to_mm: float
    side: Side
    method: WallMethod
    doubt_mm: Span | None
    """Smallest and largest distance from the centreline at which the wall may be, in mm. None if unknown."""
    why: str

    def sentence(self, unit: str = "mm") -> str:
        """Return the stretch in words, such as "left wall by edge: in the middle of the step from dark to bright"."""
        may_be = "; it may be {:.2f} to {:.2f} {} from the centreline"
        doubt = may_be.format(*self.doubt_mm, unit) if self.doubt_mm else ""
        return f"{self.side} wall by {self.method}: {self.why}{doubt}"


class FaceLabel(IntEnum):
    """Part of the solid to which a triangle belongs."""

    TOP = 0
    WALL = 1
    FLOOR = 2
    END = 3  # Vertical wall across a cut end, or the inner side of the dam at an open end
    OUTSIDE = 4


@with_config(FROM_JSON)
@dataclass(frozen=True, eq=False, repr=False)
class Outline(ReadOnly, HasSummary):
    """Crack on the face of a sample, in plan view.

    ``left_wall`` is on the left in the direction of increasing s (mm frame, y up). At an oblique open end, one wall
    reaches the edge of the face before the other. That wall repeats its last point until the other reaches the edge.
    """

    centreline_mm: Points  # (n, 2), first row at s = 0
    left_wall_mm: Points  # (n, 2), one point for each point of the centreline
    right_wall_mm: Points  # (n, 2)
    outline_mm: Points  # (m, 2), ring
    centreline_px: Points
    left_wall_px: Points
    right_wall_px: Points
    outline_px: Points
    ends: tuple[EndKind, EndKind]
    face_mm: Box | None
    """x_min, y_min, x_max, y_max of the sample's face. None if unknown."""
    mm_per_px: float  # Local scale at the middle of the crack
    scale_source: str  # Description of the scale, such as "8 ArUco markers" or "given: 0.35 mm/px (assumed)"
    scale_residual_mm: float | None  # RMS misfit at the scale's control points. None if there are none
    path_source: PathSource
    warnings: Facts = ()
    path_verdict: Mapping[str, float] = field(default_factory=dict)
    """Probability that the path follows the crack, and the inputs that it follows from. Empty without a photo."""
    islands_mm: tuple[Points, ...] = ()  # Clockwise rings around parts inside the outline that are not crack
    bands_mm: tuple[Points, ...] = ()
    """Rings around bands along the walls that may or may not belong to the crack, for example debris.

    ``width_95_mm`` covers both cases."""
    branches_mm: tuple[Points, ...] = ()
    """Centrelines of the side cracks, from the main crack outward."""
    branches_kept: bool = False  # True if the outline includes the side cracks
    scale_uncertainty: float | None = None
    """Relative standard uncertainty of all lengths due to the scale. None if unknown."""
    camera_tilt_deg: float | None = None
    """Angle between the camera's axis and the normal of the face. None if the photo does not show it."""
    photo_size_px: tuple[int, int] | None = None  # Width and height of the photo. None for an outline made by hand
    width_source: WidthSource = "walls"
    width_95_mm: Span | None = None
    """95 % interval of the mean width at half of the step in light, without the scale's uncertainty.

    A painter draws the crack's edge elsewhere: of a thin crack farther out, of a wide one farther in. None if the
    method gives no interval."""
    walls: tuple[WallStretch, ...] = ()
    """Stretches of both walls, from end to end. Where two overlap, the later one is valid. Empty without a photo."""

    def __post_init__(self) -> None:
        super().__post_init__()
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

        The corners may be outside the photo.
        """
        around_px = SHOWN_AROUND * float(np.ptp(self.outline_px, axis=0).max())
        return np.array([self.outline_px.min(axis=0) - around_px, self.outline_px.max(axis=0) + around_px])

    @property
    def has_origin(self) -> bool:
        """False if [0, 0] is only the photo's corner, since the scale has neither markers nor the face's corners."""
        return self.face_mm is not None or self.scale_residual_mm is not None or self.seen_in != "photo"

    @property
    def seen_in(self) -> Literal["photo", "mesh", "drawing"]:
        """Kind of input from which the outline was made."""
        if self.path_source == "drawn":
            return "drawing"
        return "mesh" if self.path_source == "mesh" else "photo"

    @property
    def s_mm(self) -> Floats:
        """Arc length at each centreline point, (n,)."""
        return arc_length(self.centreline_mm)

    @property
    def length_mm(self) -> float:
        return float(self.s_mm[-1])

    @property
    def width_mm(self) -> Floats:
        """Width at each centreline point: the distance between the walls, perpendicular to the centreline, (n,).

        The widths add up to the crack's area. If the line between the two wall points is oblique, only its component
        perpendicular to the centreline counts. The line is oblique in a sharp bend, and at an oblique open end, where
        both wall points are on the edge of the face. At such an end, the components are as rough as the walls, so their
        mean is used from the end to the nearest point at which the walls face each other.
        """
        s_mm, across_mm = self.s_mm, self.left_wall_mm - self.right_wall_mm
        width_mm = lengths(across_mm)
        # A centreline made by hand may reverse at a point. No direction is perpendicular to it there.
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
        """Standard uncertainty of the mean width, which is a quarter of the length of its 95 % interval.

        None if the width has no interval.
        """
        return None if self.width_95_mm is None else (self.width_95_mm[1] - self.width_95_mm[0]) / 4


@dataclass(frozen=True, eq=False)
class Sections(ReadOnly):
    """Depth and area of the cavity's cross-sections along the centreline."""

    s_mm: Numbers  # (k,), increasing
    depth_mm: Numbers  # (k,)
    area_mm2: Numbers  # Area of each section below the face, perpendicular to the centreline, (k,)
    levels_mm: Numbers | None = None  # Levels of the table, from the deepest floor to 0, (n,). None for straight walls
    below_mm2: Numbers | None = None  # Area of each section below each level, (k, n). None for straight walls

    def __post_init__(self) -> None:
        super().__post_init__()
        require_as_long(self, "s_mm", "depth_mm", "area_mm2", "below_mm2")
        if len(self.s_mm) == 0 or self.s_mm.ndim != 1 or (np.diff(self.s_mm) <= 0).any():
            raise ValueError("s_mm should increase from station to station")
        if self.below_mm2 is not None:
            levels = 0 if self.levels_mm is None else len(self.levels_mm)
            if levels < 2 or self.below_mm2.shape[1:] != (levels,):
                raise ValueError("below_mm2 should have one column for each of levels_mm, and at least two columns")

    @property
    def by_level(self) -> bool:
        """True if the areas are tabulated by level, because the walls have no constant angle."""
        return self.below_mm2 is not None


@dataclass(frozen=True, eq=False, repr=False)
class Solid(ReadOnly, HasSummary):
    """Block of the sample with the crack's cavity cut out, and with dams at open ends.

    The mesh is watertight, and its faces point outward. Solids are compared by identity, so a solid can be the key of a
    cache.
    """

    vertices_mm: Floats  # (v, 3)
    faces: Integers  # (f, 3)
    face_label: Integers  # (f,), FaceLabel values
    block_mm: Box  # x_min, y_min, x_max, y_max of the block. Dams may be outside this box
    depth_mm: float  # Largest depth of the cavity
    tilt: str  # Kind of the walls' tilt, or "modelled" for a mesh whose walls have no constant angle
    wall_angles_deg: tuple[float, float]  # Angles of the left and the right wall from the vertical
    cavity_volume_mm3: float  # Volume between the walls, below the face and inside the block
    sections: Sections  # Cross-sections of the main crack, without side cracks and the parts beyond the ends
    figures: SolidFigures

    @property
    def tilting(self) -> Tilting:
        """Row of the tilt in ``TILTS``. Raises KeyError for an unknown tilt."""
        return TILTS[self.tilt]

    @property
    def main_figures(self) -> dict[str, str]:
        angles = " and ".join(f"{angle:g}" for angle in self.wall_angles_deg)
        return {
            "depth": self.depth_text,
            "walls": self.tilt if self.tilt == "modelled" else f"{self.tilt}, {angles} deg",
            "cavity": f"{self.cavity_volume_mm3 / 1000:.2f} ml",
        }

    @property
    def doubts(self) -> Facts:
        """Reasons why the solid may be wrong."""
        return self.figures.warnings

    @property
    def depth_text(self) -> str:
        """Depth of the floor, or its smallest and largest depth along the crack."""
        ends_mm = self.sections.depth_mm.min(), self.sections.depth_mm.max()
        return f"{' to '.join(dict.fromkeys(f'{end_mm:.4g}' for end_mm in ends_mm))} mm"

    def mesh(self) -> "Trimesh":
        """Return the mesh for trimesh, in mm."""
        import trimesh

        return trimesh.Trimesh(self.vertices_mm, self.faces, process=False)

    def depth_at_mm(self, s_mm: Floats) -> Floats:
        """Return the depth of the cavity's floor at each arc length ``s_mm`` along the centreline, (n,)."""
        return np.interp(s_mm, self.sections.s_mm, self.sections.depth_mm)


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(ReadOnly, HasSummary):
    """Timed path of the nozzle: waypoints, each with the speed and the flow until the next waypoint.

    Speed and flow are 0 at the last waypoint.
    """

    t_s: Floats  # (n,)
    position_mm: Floats  # Position of the nozzle's tip, (n, 3)
    s_mm: Floats  # Arc length on the crack's centreline, (n,)
    speed_mm_s: Floats  # (n,)
    flow_mm3_s: Floats  # (n,)
    has_origin: bool = True  # As in the outline of the crack. trajectory.csv does not contain it

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
        """Length of the path from waypoint to waypoint. Smoothing makes it shorter than the centreline."""
        return float(arc_length(self.position_mm)[-1])

    @property
    def given_mm3(self) -> Floats:
        """Volume of sealant dispensed between each waypoint and the next, in mm3, (n - 1,)."""
        return self.flow_mm3_s[:-1] * np.diff(self.t_s)

    @property
    def dispensed_mm3(self) -> float:
        return float(self.given_mm3.sum())

    @property
    def giving(self) -> slice:
        """Slice of the waypoints from where sealant first flows to where it stops, without leads.

        The slice contains all waypoints if the path dispenses no sealant.
        """
        flowing = np.flatnonzero(self.flow_mm3_s[:-1] > 0)
        return slice(int(flowing[0]), int(flowing[-1]) + 2) if len(flowing) else slice(0, len(self.t_s))


class JsonRecord(OwnNames):
    """Base class of frozen records that are written as JSON, with one key for each field."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


@dataclass(frozen=True, eq=False, repr=False)
class Bed(ReadOnly):
    """Particles, falling or at rest, from which levels and volumes are measured."""

    position_mm: Floats  # (n, 3)
    velocity_mm_s: Floats  # (n, 3)
    spilled: Booleans  # True for particles that left the sample over its edge, (n,)
    radius_mm: float
    particle_volume_mm3: float  # Dispensed volume divided by the number of particles (Eq. 6 of the paper)
    settings: dict[str, Any]  # Settings of the run, with the values of the solver's preset

    @property
    def particles(self) -> int:
        return len(self.position_mm)

    @property
    def spilled_particles(self) -> int:
        return int(self.spilled.sum())


@dataclass(frozen=True, eq=False, repr=False)
class Run(HasSummary, Bed, FilledBy):
    """Finished fluid run, computed with particles or with the fast model, which has no particles."""

    age_s: Floats  # Time since each particle's release, (n,)
    escaped_particles: int  # Number of particles that went through a wall. Anything but 0 is a fault
    device: str
    health: RunHealth  # Figures that show whether the run is reliable: density error, neighbours, iterations, times
    fast_fill: FastFill | None = None
    remarks: Facts = ()  # Sealant properties that the run cannot represent, found before the first frame
    fast_level: "Profile | None" = None  # Level computed by the fast model. None for a run with particles
    doubts: Facts = ()  # Warnings about settings outside their usual ranges

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
        """Density of the sealant. None if the settings do not state it."""
        return self.settings.get("fluid", {}).get("density_kg_m3")

    @property
    def share_below_face(self) -> float:
        """Fraction of the sealant on the sample that is below the face. 0 if there is no sealant."""
        if self.fast_fill is not None:
            return self.fast_fill.in_crack_mm3 / (self.fast_fill.in_crack_mm3 + self.fast_fill.above_face_mm3)
        height_mm = self.position_mm[~self.spilled, 2]
        return float((height_mm <= 0).mean()) if len(height_mm) else 0.0


@dataclass(frozen=True, eq=False, repr=False)
class Profile(ReadOnly, HasSummary):
    """Level of the sealant along the crack, relative to the face: negative below the face, positive above."""

    s_mm: Floats  # (n,), increasing
    level_mm: Floats  # (n,)
    repeats_mm: Floats | None = None  # Single readings of a measured profile, (n, r). A missing reading is NaN
    data: DataKind = "synthetic"
    source: str = ""
    dialect: str = ""  # Sentence that says how the sheet of readings was interpreted. Empty for a simulated profile
    doubts: tuple[str, ...] = ()  # Doubts about the readings. Each is a sentence with the cell and how to answer
    questions: tuple[Doubt, ...] = ()  # Same doubts as records
    understood: ReadSheet | None = None  # Interpretation of the sheet of readings
    is_depth: bool = False  # True if the sheet measures downward from its datum
    scan: Scan | None = None  # Scan from which the level was read. None for a sheet of caliper readings

    @property
    def main_figures(self) -> dict[str, str]:
        return {
            "stations": f"{len(self.s_mm)}, {self.s_mm[0]:g} to {self.s_mm[-1]:.4g} mm",
            "level": f"{self.level_mm.min():.2f} to {self.level_mm.max():.2f} mm",
            "data": self.data,
        }

    def __iter__(self) -> Iterator[dict[str, float]]:
        """Yield a row for each station, from which ``pandas.DataFrame`` makes a table."""
        rows = zip(self.s_mm.tolist(), self.level_mm.tolist(), strict=True)
        return ({"s_mm": s_mm, "level_mm": level_mm} for s_mm, level_mm in rows)

    def level_at_mm(self, s_mm: Floats) -> Floats:
        """Return the level at other stations, (k,), by linear interpolation."""
        return np.interp(s_mm, self.s_mm, self.level_mm)


@dataclass(frozen=True, eq=False)
class Sample:
    """A digitised crack with its solid and the nozzle's path: the geometric input of a run.

    Samples are compared by identity, so a sample can be the key of a cache.
    """

    outline: Outline
    solid: Solid
    trajectory: Trajectory
    readings: Profile | None = None
