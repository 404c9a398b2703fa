"""Figures of a solid: widths, volumes, quality of the mesh, dams, and the nozzle's path over it."""

from dataclasses import asdict, dataclass
from math import hypot
from typing import Any, Literal, NamedTuple

from pydantic import ConfigDict, with_config

from sealtwin.core.facts import Facts
from sealtwin.core.settings import without_none

EndKind = Literal["open", "closed", "cut"]
"""Kind of a crack's end.

open: at the edge of the face; closed: a tip; cut: the user cut a longer crack here, and a wall closes it."""

Point = tuple[float, float]
Span = tuple[float, float]  # Smallest and largest value
Box = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max


class Tilting(NamedTuple):
    """Directions in which the walls of a crack run from the face to the floor, and the edge that the photo shows."""

    opens: int
    """1 if both walls move out of the crack with depth, -1 if both move into it, and 0 if its width is constant."""
    lean: bool = False
    """True if both walls move to the same side."""
    floor_traced: bool = False
    """True if the photo shows the edge of the floor, and False if it shows that of the mouth."""

    @property
    def away(self) -> int:
        """1 if both walls move out of the crack from the traced edge to the other, -1 if into it, 0 as in ``opens``."""
        return -self.opens if self.floor_traced else self.opens


TILTS = {
    "lean": Tilting(0, lean=True),
    "flare": Tilting(-1, floor_traced=True),
    "funnel": Tilting(-1),
    "undercut": Tilting(1),
    "vertical": Tilting(0),
    "modelled": Tilting(0),
}
"""Tilts of a crack's walls. A wall of a mesh, "modelled", may have any shape."""


@dataclass(frozen=True)
class ClosingDepth:
    """Depth in mm at which two walls that lean towards each other meet. None if they do not meet."""

    min: float | None
    mean: float | None
    share_above_floor: float  # Fraction of the crack's length along which the walls meet above the floor


@dataclass(frozen=True)
class EndOfCrack:
    kind: EndKind
    centre_mm: Point
    outward: Point  # Unit vector along the crack, pointing away from it at this end


@dataclass(frozen=True)
class DamBox:
    """Dam that closes an open end of the crack. A dam is not part of the sample."""

    box_mm: tuple[float, float, float, float, float, float]  # x_min, y_min, z_min, x_max, y_max, z_max
    end: int | None = None  # Number of the crack's end. None for a solid read from a mesh


@dataclass(frozen=True)
class MeshOrigin:
    """Mesh file from which a solid was made, and the transformation from the file's coordinates."""

    file: str
    triangles_read: int
    sample_from_file: tuple[Box, ...]
    """Matrix that transforms coordinates of the file to coordinates of the sample, both in mm, (4, 4)."""
    face_tilt_deg: float
    face_roughness_mm: float
    mouth_seen_below_face_mm: float


@dataclass(frozen=True)
class PathFigures:
    """Figures of a nozzle path, without its leads."""

    length_mm: float
    centreline_mm: float  # Length of the part of the centreline that the nozzle follows
    smoothing_mm: float
    off_centreline_rms_mm: float
    off_centreline_worst_mm: float
    largest_turn_deg: float
    smallest_radius_mm: float | None  # Smallest radius of curvature. None for a straight path
    starts_at_s_mm: float
    ends_at_s_mm: float
    waypoints: int
    duration_s: float
    speed_mm_s: Span
    sealant_mm3_per_mm: Span


@dataclass(frozen=True)
class WeighedCavity:
    """Cavity measured by filling the crack with a liquid in weighed steps. Tuples contain a value for each step."""

    levels_mm: tuple[float, ...]  # Mean level relative to the face, corrected for the meniscus
    volumes_mm3: tuple[float, ...]  # Weighed volume of the liquid
    misfits_mm3: tuple[float, ...]  # Weighed volume minus the volume between the fitted walls
    misfit_sds_mm3: tuple[float, ...]  # Standard deviation of the misfit, from scale, level, density and meniscus
    width_mm: float  # Mean width from the fill and the photo together, at the level of the traced outline
    wall_angle_deg: float
    depth_mm: float
    steps: tuple[tuple[float, float, float], ...]
    """Cholesky factor (lower triangular) of the covariance matrix of width, angle and depth."""
    volume_95_mm3: Span
    findings: Facts = ()  # Contradictions between the fill, the photo and the declared tilt

    def __str__(self) -> str:
        """Return each fitted quantity in words, with twice its standard deviation."""
        values = (("width", self.width_mm, 2, " mm"), ("each wall", self.wall_angle_deg, 1, "°"))
        values += (("depth", self.depth_mm, 1, " mm"),)
        return ", ".join(
            f"{name} {value:.{digits}f} ± {2 * hypot(*row):.{digits}f}{unit}"
            for (name, value, digits, unit), row in zip(values, self.steps, strict=True)
            if any(row)
        )


@with_config(ConfigDict(strict=True, allow_inf_nan=False))
@dataclass(frozen=True, kw_only=True)
class SolidFigures:
    """Figures of a solid. A figure that does not apply is None or empty. solid.json contains the figures that apply."""

    photo_width_mm: float | None = None  # Mean width of the crack in the photo
    photo_width_95_mm: Span | None = None  # 95 % interval of the mean width in the photo
    cavity_volume_95_mm3: Span | None = None  # Interval of the cavity's volume that follows from the width's interval
    mouth_width_mm: float | None = None
    floor_width_mm: float | None = None
    closing_depth_mm: ClosingDepth | None = None
    mesh: MeshOrigin | None = None
    watertight: bool | None = None
    triangles: int | None = None
    euler: int | None = None  # Vertices minus edges plus faces
    min_edge_mm: float | None = None
    self_intersections: int | None = None
    jitter_mm: float | None = None  # Random shift of the outline's vertices. 0 if the solid was built without a shift
    ends: tuple[EndOfCrack, ...] | None = None
    dams: tuple[DamBox, ...] = ()
    weighed: WeighedCavity | None = None
    sealant_mm3: float | None = None
    cavity_to_sealant: float | None = None
    path: PathFigures | None = None
    warnings: Facts = ()

    def recorded(self) -> dict[str, Any]:
        """Return the figures that apply, as they are written to solid.json."""
        dams = [without_none(asdict(dam)) for dam in self.dams]
        return without_none(asdict(self)) | {"dams": dams}
