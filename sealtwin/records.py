"""What the stages hand to each other: frozen records of plain arrays, in millimetres and seconds.

Conventions, everywhere:

- ``_px``: x right, y down, origin at the centre of the photo's first pixel.
- ``_mm``: right-handed; x right and y UP in the photo, z out of the face, z = 0 on it. The origin is the lower left
  corner of the face where the face is known, else the centre of the photo's lower left pixel.
- ``s_mm`` runs along the centreline from the first end given, where the nozzle starts. At an open end s = 0 is where
  the centreline meets the edge of the face.
- Polylines are open, rings are counter-clockwise in mm and do not repeat their first point.
"""

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Pixels = NDArray[np.uint8]
"""(height, width, 3), RGB."""

FACING = 0.98
"""Cosine up to which the line between two walls counts as square to the centreline: 11 degrees."""

EndKind = Literal["open", "closed", "cut"]
"""open: at the edge of the face; closed: a tip; cut: the user cut a longer crack here, with a wall across it."""

PathSource = Literal["ends", "via", "automatic", "mask", "mesh", "line"]
"""How the crack was found: between given ends, also by given points between, by itself, as painted; in a mesh along its
mouth, or along a given line. An automatic path is a proposal until somebody has looked at it.
"""

DataKind = Literal["measured", "reconstructed", "synthetic"]
"""Where data come from. Only ``measured`` may ever be called validated."""


class FaceLabel(IntEnum):
    """What each triangle of a solid is part of."""

    TOP = 0
    WALL = 1
    FLOOR = 2
    END = 3
    """Vertical wall across a cut end, or the inner side of the dam at an open end."""
    OUTSIDE = 4


@dataclass(frozen=True)
class Outline:
    """A crack on the face of a sample, as seen from above.

    ``left_wall`` lies to the left of someone who walks along the centreline from s = 0 (mm frame, y up). Beside an open
    end that is oblique one wall stands still on the edge of the face, and the other spreads as many stations up to it.
    """

    centreline_mm: Floats  # (n, 2), first row at s = 0
    left_wall_mm: Floats  # (n, 2), station by station with the centreline
    right_wall_mm: Floats  # (n, 2)
    outline_mm: Floats  # (m, 2), ring
    centreline_px: Floats
    left_wall_px: Floats
    right_wall_px: Floats
    outline_px: Floats
    ends: tuple[EndKind, EndKind]
    face_mm: tuple[float, float, float, float] | None
    """x_min, y_min, x_max, y_max of the sample's face, where it is known."""
    mm_per_px: float
    """Local scale at the middle of the crack."""
    scale_source: str
    """In words, for example "8 ArUco markers" or "given: 0.35 mm/px (assumed)"."""
    scale_residual_mm: float | None
    """RMS misfit of the scale's control points; None where there are none to misfit."""
    path_source: PathSource
    warnings: tuple[str, ...] = ()
    islands_mm: tuple[Floats, ...] = ()
    """Rings inside the outline that are no crack, clockwise."""
    branches_mm: tuple[Floats, ...] = ()
    """Centre polylines of side cracks that were seen, from the main crack outward."""
    branches_kept: bool = False
    """Whether the outline holds the branches."""
    scale_uncertainty: float | None = None
    """Standard uncertainty of every length for the scale alone, over the length; None where nothing tells it."""
    camera_tilt_deg: float | None = None
    """Between the camera's axis and the normal of the face, where the photo shows it."""

    @property
    def seen_in(self) -> Literal["photo", "mesh"]:
        """What the crack was found in."""
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
        """Distance between the two walls at each station, square to the centreline, (n,).

        Beside an open end that is oblique the two walls of a station lie along the edge of the face, and what is square
        of that is as rough as the walls are along the edge: there the width is its mean, up to the nearest station
        whose walls face each other. So widths add up to the crack's area.
        """
        s_mm, across_mm = self.s_mm, self.left_wall_mm - self.right_wall_mm
        width_mm = np.linalg.norm(across_mm, axis=1)
        square_mm = np.abs(_cross(_unit(np.gradient(self.centreline_mm, axis=0)), across_mm))
        facing = np.flatnonzero(square_mm >= FACING * width_mm)
        if len(facing):
            oblique = slice(0, facing[0] + 1), slice(facing[-1], len(s_mm))
            for kind, stations in zip(self.ends, oblique, strict=True):
                piece_mm = np.ptp(s_mm[stations])
                if kind == "open" and piece_mm > 0:
                    width_mm[stations] = np.trapezoid(square_mm[stations], s_mm[stations]) / piece_mm
        return width_mm

    @property
    def mean_width_mm(self) -> float:
        """Width averaged over the arc length."""
        return float(np.trapezoid(self.width_mm, self.s_mm) / self.length_mm)


@dataclass(frozen=True)
class Sections:
    """What a cavity is along its crack's centreline."""

    s_mm: Floats  # (k,), increasing
    depth_mm: Floats  # (k,)
    area_mm2: Floats  # (k,): of the section square to the centreline, below the face


@dataclass(frozen=True)
class Solid:
    """The sample: a block less the crack's cavity, dams at open ends included. Watertight, faces outward."""

    vertices_mm: Floats  # (v, 3)
    faces: Integers  # (f, 3)
    face_label: Integers  # (f,), FaceLabel values
    block_mm: tuple[float, float, float, float]
    """x_min, y_min, x_max, y_max of the block; its dams may stand outside."""
    depth_mm: float
    """Where it is deepest."""
    tilt: str
    """A reading of the tilt; "modelled" where a mesh has walls of its own, which no angle tells."""
    wall_angles_deg: tuple[float, float]
    """From vertical: of the left wall and of the right one, seen along the centreline."""
    cavity_volume_mm3: float
    """Between the walls, below the face, inside the block."""
    sections: Sections
    """Of the cavity along the centreline; side cracks and what lies beyond its ends apart."""
    report: dict[str, Any]
    """Widths, the volume of each tilt reading, where walls close: the content of solid.json."""

    def depth_at_mm(self, s_mm: Floats) -> Floats:
        """Depth of the cavity's floor at each arc length along the centreline, (n,)."""
        return np.interp(s_mm, self.sections.s_mm, self.sections.depth_mm)


@dataclass(frozen=True)
class Trajectory:
    """A timed nozzle path: waypoints, each with the speed and flow that hold until the next.

    The last row has speed 0 and flow 0: whoever holds it stands still and gives no more.
    """

    t_s: Floats  # (n,)
    position_mm: Floats  # (n, 3): the nozzle tip
    s_mm: Floats  # (n,): arc length on the crack's centreline
    speed_mm_s: Floats  # (n,)
    flow_mm3_s: Floats  # (n,)

    @property
    def duration_s(self) -> float:
        return float(self.t_s[-1] - self.t_s[0])

    @property
    def length_mm(self) -> float:
        """Of the path from waypoint to waypoint: less than the arc of the centreline by what smoothing takes."""
        return float(arc_length(self.position_mm)[-1])

    @property
    def given_mm3(self) -> Floats:
        """Sealant given between each waypoint and the next, (n - 1,)."""
        return self.flow_mm3_s[:-1] * np.diff(self.t_s)

    @property
    def giving(self) -> slice:
        """Waypoints from where the first sealant leaves to where the last does: leads are without."""
        flowing = np.flatnonzero(self.flow_mm3_s[:-1] > 0)
        return slice(int(flowing[0]), int(flowing[-1]) + 2) if len(flowing) else slice(0, 0)


@dataclass(frozen=True)
class Run:
    """A finished fluid run."""

    position_mm: Floats  # (n, 3): particles as they lie when the profile is taken
    velocity_mm_s: Floats  # (n, 3)
    age_s: Floats  # (n,): since release
    spilled: NDArray[np.bool_]  # (n,): over the sample's edge
    radius_mm: float
    particle_volume_mm3: float
    """Dispensed volume over particles: Eq. 6 of the paper."""
    escaped_particles: int
    """Went through a wall. Anything but 0 is a fault."""
    device: str
    settings: dict[str, Any]
    """Effective settings of the solver after its preset is resolved."""
    health: dict[str, Any]
    """Numbers that say whether the run can be trusted: density error, neighbours, iterations, times."""

    @property
    def spilled_particles(self) -> int:
        return int(self.spilled.sum())

    @property
    def dispensed_volume_mm3(self) -> float:
        return len(self.position_mm) * self.particle_volume_mm3


class ParticleState(IntEnum):
    """What a particle does at one moment."""

    MOVING = 0
    ASLEEP = 1
    """At rest below the yield stress, until something hits it."""
    FROZEN = 2
    """By its age, for good."""
    SPILLED = 3
    """Over the sample's edge."""
    ESCAPED = 4
    """Through a wall: a fault."""


@dataclass(frozen=True)
class Frame:
    """The particles that have left the nozzle, in that order, at one moment of a fluid run."""

    t_s: float
    position_mm: Floats  # (n, 3)
    velocity_mm_s: Floats  # (n, 3)
    age_s: Floats  # (n,): since release
    density: Floats  # (n,): over rest density
    state: Integers  # (n,), ParticleState values

    @property
    def speed_mm_s(self) -> Floats:
        return np.linalg.norm(self.velocity_mm_s, axis=1)


@dataclass(frozen=True)
class Profile:
    """Level of the sealant along the crack, relative to the face: negative below it, positive above."""

    s_mm: Floats  # (n,), increasing
    level_mm: Floats  # (n,)
    repeats_mm: Floats | None = None
    """(n, r) single readings where the profile was measured; NaN where one is missing."""
    data: DataKind = "synthetic"
    source: str = ""
    dialect: str = ""
    """How the sheet of readings was understood, in one sentence; empty where there is none."""


Outcome = Literal["passed", "failed", "undecided", "open"]
"""Of a comparison: its gate is kept, and the readings can tell; is not kept, or the run leaks; nobody can tell; there
is none. See decision 0079."""


@dataclass(frozen=True)
class Comparison:
    """A simulated surface held against a measured one."""

    mean_error_mm: float
    """Area between the two curves over the covered length, exact."""
    worst_error_mm: float
    worst_at_mm: float
    metrics: dict[str, Any]
    """The content of comparison.json."""
    gate: dict[str, float] = field(default_factory=dict)
    """Limits that the trial declared, by metric."""
    passed: bool | None = None
    """Whether what was found keeps the gate; None where the trial declares none. False where a particle escaped."""
    outcome: Outcome = "open"
    """The same with what the readings can tell."""
    verdict: str = ""
    findings: tuple[str, ...] = ()
    """What ASME V&V 20 allows one to say, to be read with the verdict; empty where there is none, or no interval."""


def _unit(vectors: Floats) -> Floats:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _cross(first: Floats, second: Floats) -> Floats:
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def arc_length(points_mm: Floats) -> Floats:
    """Distance along an open polyline from its first point, (n,)."""
    steps = np.linalg.norm(np.diff(points_mm, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def arc_length_at(points_mm: Floats, polyline_mm: Floats) -> Floats:
    """Arc length of the nearest point of a polyline, (n,); beyond its ends the polyline runs on straight.

    One pass over the segments: exact, and fast enough for 15,000 points and 1,000 segments (0.4 s).
    """
    begins_mm, steps = arc_length(polyline_mm), np.diff(polyline_mm, axis=0)
    nearest = np.full(len(points_mm), np.inf)
    s_mm = np.zeros(len(points_mm))
    last = len(steps) - 1
    for index, step in enumerate(steps):
        length_mm = np.hypot(*step)
        if length_mm == 0:
            continue
        offset = points_mm - polyline_mm[index]
        along = np.clip(offset @ step / length_mm**2, -np.inf if index == 0 else 0.0, np.inf if index == last else 1.0)
        distance = ((offset - along[:, None] * step) ** 2).sum(axis=1)
        closer = distance < nearest
        nearest[closer] = distance[closer]
        s_mm[closer] = begins_mm[index] + along[closer] * length_mm
    return s_mm
