"""Settings of the digitise stage: the tables [photo], [crack], [mesh] and [path] of a trial file."""

from math import hypot, inf
from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar

import numpy as np
from pydantic import Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

from digitise.planned_path import PathTable, PlanOrFile, read_planned_path
from digitise.weighing.fill import FillOrFile
from sealtwin.core.records import DataKind, Floats
from sealtwin.core.settings import Likely, Settings
from sealtwin.core.solid_figures import TILTS, Tilting
from sealtwin.scan.settings import Placement

InPhoto = Annotated[float, Field(ge=-1_000_000, le=1_000_000)]  # Column or row of a point in or beside a photo
Pixel = tuple[InPhoto, InPhoto]
PixelPair = tuple[Pixel, Pixel]
Clicks = tuple[Pixel, ...]  # Points that a user clicks
# Largest photo or mesh file: 50 million uncompressed pixels with transparency, plus 25 %
LARGEST_FILE_BYTES = 250_000_000
OnFace = Annotated[float, Field(ge=-10_000, le=10_000)]  # Coordinate on the face in mm, up to ten metres
FaceSide = Annotated[float, Field(gt=1, le=5000)]  # Side of a sample's face in mm. On 1 mm, no crack is visible
# Limits of the scale. Light does not resolve finer pixels. At the coarsest scale, a crack of 8 px would be 16 mm wide
FINEST_MM_PER_PX, COARSEST_MM_PER_PX = 0.001, 2.0
# Limits of the volume: three cartridges, and four particles of the paper's size
LARGEST_VOLUME_ML, SMALLEST_VOLUME_ML = 1000.0, 0.001
Tilt = Literal["lean", "flare", "funnel", "undercut", "vertical"]

# Angle of a wall in degrees. For walls that widen downward, use the tilt "undercut" and no negative angle
WallAngle = Annotated[float, Field(ge=0, lt=60)]
ONE, SEVERAL = "one", "several"
One = TypeVar("One")
Several = TypeVar("Several")
ByShape = Discriminator(lambda value: SEVERAL if isinstance(value, list | tuple) else ONE)
OneOrSeveral = Annotated[Annotated[One, Tag(ONE)] | Annotated[Several, Tag(SEVERAL)], ByShape]
"""One value or a table of values. A validation error refers to the form that the user gave."""
DEEPEST_MM = 500.0  # Largest depth. No sample is deeper
Depth = Annotated[float, Field(gt=0.1, le=DEEPEST_MM)]  # A crack less than a tenth of a millimetre deep is a scratch
SHALLOW = Likely(1.0, inf, "mm for a crack of this width", "in cm", of_width=True)  # Cracks are deeper than wide
SPEED = Likely(0.5, 200.0, "mm/s", "in m/s or mm/min")  # Small arms reach 200 mm/s over a winding crack
Station = Annotated[float, Field(ge=0, le=10_000)]  # Arc length from the nozzle's start, in mm
MAX_STATIONS = 1000  # Rows of a table along the crack
DepthTable = Annotated[tuple[tuple[Station, Depth], ...], Field(min_length=1, max_length=MAX_STATIONS)]
Width = Annotated[float, Field(gt=0.005, le=200)]  # Width of a crack in mm, from the finest that a gauge shows
WidthTable = Annotated[tuple[tuple[Station, Width], ...], Field(min_length=1, max_length=MAX_STATIONS)]
Trim = Annotated[float, Field(ge=0, le=1000)]  # Length in mm by which a path is shortened at an end
Dictionary = Literal["4x4_50", "5x5_100", "6x6_250", "apriltag_36h11"]
MeshUnit = Literal["mm", "cm", "m", "inch"]
# Largest number of stretches of wall drawn by hand, and of points of each. If more are needed, paint a mask
MAX_WALLS, MAX_WALL_POINTS = 50, 200
NO_SCALE = "no_scale"  # Error type of a photo without a scale
SCALES = "no scale: give [photo.markers], face_mm with face_corners_px, ruler_px or mm_per_px"
Region = Annotated[Clicks, Field(min_length=2, max_length=MAX_WALL_POINTS)]
Walls = Annotated[tuple[Region, ...], Field(max_length=MAX_WALLS)]
NEEDED_BY = {"ruler_px": "ruler_mm", "ruler_mm": "ruler_px", "face_corners_px": "face_mm", "via_px": "ends_px"}
NOT_BESIDE = {
    "mm_per_px": ("ruler_px", "markers", "face_mm"),
    "ruler_px": ("markers", "face_mm"),
    "crack": ("ends_px", "mask"),
    "mask": ("roi_px", "via_px", "walls_px", "wall"),
    "path_only": ("width_mm",),
}
"""Photo settings, each with the settings that it excludes. ``NEEDED_BY`` lists settings that require another one."""
MAX_RANKED = 5  # Largest number of cracks to choose from
MAX_VIA = 50  # Largest number of via points. If more are needed, a painted mask is better


def by_station(value: float | DepthTable) -> Floats:
    """Return a table of arc lengths and values along the crack, (k, 2), from one number or from rows."""
    return np.array(value if isinstance(value, tuple) else [(0.0, value)], float)


def require_order(name: str, stations_mm: Floats) -> None:
    """Raise ValueError unless the first column of a table, the stations, increases. ``name`` is the table's setting."""
    if (falls := np.diff(stations_mm[:, 0]) <= 0).any():
        before_mm, after_mm = stations_mm[int(falls.argmax()) :, 0][:2]
        raise ValueError(f"{name}: station {after_mm:g} mm follows {before_mm:g} mm. List the stations by increasing s")


DamHeight = Annotated[float, Field(ge=0, le=100)]


class Marker(Settings):
    """A printed marker in the plane of the face. The marker is upright in the photo."""

    id: int = Field(ge=0, lt=1000)
    """Number of the marker in its dictionary."""
    x_mm: OnFace
    """Distance of the marker's centre to the right of the face's lower left corner."""
    y_mm: OnFace
    """Distance of the marker's centre above the face's lower left corner."""


class MarkerBoard(Settings):
    """Markers whose positions in the plane of the face are known.

    If the markers are above or below that plane, the scale is off by that distance divided by the camera's distance.
    """

    dictionary: Dictionary = "4x4_50"
    """Dictionary of the printed markers."""
    size_mm: float = Field(gt=0.5, le=1000)
    """Side of the marker's black square. A marker below 0.5 mm does not print, and one above a metre is larger than a
    sample."""
    markers: tuple[Marker, ...] = Field(min_length=4, max_length=1000)
    """Numbers and positions of the markers. Four or more are needed, so that the scale does not depend on the error of
    one marker."""
    printed_ruler_mm: float | None = Field(default=None, gt=50, le=200)
    """Measured length of the ruler on the printed frame, which is nominally 100. Give it even if it is 100. All lengths
    of this table are then scaled by the same factor about the middle of the frame. Printers change the size by less
    than half. If this length is not given and the photo shows no edges of a face of known size, the scale's uncertainty
    includes 2 %."""

    def _check(self) -> None:
        numbers = [marker.id for marker in self.markers]
        if twice := {number for number in numbers if numbers.count(number) > 1}:
            raise ValueError(f"marker {min(twice)} is listed {numbers.count(min(twice))} times. List it once")


class PhotoInput(Settings):
    """A photo from above and its scale: markers, the face's size, a ruler, or millimetres per pixel."""

    file: Path
    """Path of the photo. It is absolute or relative to the trial file's folder."""
    data: DataKind
    """Origin of the photo. Reports state it unless it is "measured". Only measured photos allow a comparison to be a
    validation."""
    ends_px: PixelPair | None = None
    """Both ends of the crack, each as column and row. The nozzle starts at the first end. Without ends, lines that may
    be the crack are searched for, and ``crack`` chooses one."""
    crack: int | None = Field(default=None, ge=1, le=MAX_RANKED)
    """Number of the crack in the list that the search makes, best crack first. refused.png shows these numbers. Only
    without ends_px."""
    via_px: Clicks = Field(default=(), max_length=MAX_VIA)
    """Points on the crack between its ends, in order. They are needed if the crack forks or a darker crack is near."""
    roi_px: Region | None = None
    """Region to search in: two opposite corners of a box, or the corners of a polygon."""
    walls_px: Walls | None = None
    """Stretches of wall drawn by hand, for photos in which walls are measured wrongly. A stretch is a line from a point
    on a wall, along the true wall, to another point on the same wall. Draw stretches with 'sealtwin trace'."""
    wall: Literal[1, 2] | None = None
    """Number of the true wall if a wall may be on either side of a band, such as a shade: 1 leaves the band out of the
    crack, and 2 includes it. overlay.png shows both numbers. Without such a band, the number changes nothing."""
    mask: Path | None = None
    """Picture of the photo's size with the crack painted white on black, or opaque on transparent. The edges of the
    paint are the walls. The path is absolute or relative to the trial file's folder."""
    edge_fraction: float = Field(default=0.5, gt=0.2, lt=0.9)
    """Fraction of the step in brightness from crack to mortar at which a wall is placed. 0.5 is the middle of a blurred
    edge. 0.7 includes more of a lit wall. Beyond the bounds, noise in the crack or the mortar would place the walls."""
    width_mm: OneOrSeveral[Width, WidthTable] | None = None
    """Width of the crack, measured with a gauge or a microscope. It replaces the width in the photo. Give one number,
    or a table of [s, width] rows along the crack from the nozzle's start. The width is linear between rows and constant
    beyond them. Its uncertainty is width_mm in [uncertainty]. Default: the width is measured between the walls in the
    photo, or fitted to the brightness profile of a crack below 8 px."""
    path_only: bool | None = None
    """True to trace only the crack's path, without walls and solid. This needs no depth and is enough for a robot
    program. The nozzle gives sealant if path.volume_ml is a number."""
    branches: Literal["drop", "keep"] = "drop"
    """Use of side cracks. keep: side cracks are part of the outline and the solid. drop: they are left out. In both
    cases the nozzle follows only the main crack. A side crack is at least three times as long as wide."""
    markers: MarkerBoard | None = None
    """Markers around the crack. 'sealtwin markers' prints a frame of markers and writes this table."""
    lens: Literal["auto", "none"] = "auto"
    """Lens model. auto: fits one radial term if the markers show distortion. none: assumes no distortion."""
    camera_distance_mm: float | None = Field(default=None, gt=10, le=20_000)
    """Distance from the lens to the face. It is needed to estimate the error of markers above or below the face. Lenses
    do not focus below 10 mm, and a crack is not visible from above 20 m."""
    ruler_px: PixelPair | None = None
    """Two points on a ruler in the plane of the face, each as column and row. The camera must be square to the face."""
    ruler_mm: float | None = Field(default=None, gt=1, le=5000)
    """Distance between the two points ruler_px."""
    face_mm: tuple[FaceSide, FaceSide] | None = None
    """Width and height of the sample's face. Its lower left corner is the origin. If there are no markers, the face
    defines the scale. If there are markers, the face only defines the edge of the sample."""
    face_corners_px: tuple[Pixel, Pixel, Pixel, Pixel] | None = None
    """Corners of the face: lower left, lower right, upper right, upper left. Without markers, they give the scale,
    together with face_mm."""
    mm_per_px: float | None = Field(default=None, gt=FINEST_MM_PER_PX, le=COARSEST_MM_PER_PX)
    """Scale of a photo taken square to the face, in mm per pixel."""
    scale_is: Literal["measured", "assumed"] = "measured"
    """Origin of mm_per_px. If the scale is assumed, reports say so with every length."""

    @property
    def hints(self) -> tuple[PixelPair | None, Clicks, Clicks | None, int | None]:
        """Ends, via points, region and number of the crack, which are the arguments of ``find_path``."""
        return self.ends_px, self.via_px, self.roi_px, self.crack

    @property
    def width_stations_mm(self) -> Floats | None:
        """Rows of arc length and width from width_mm, (k, 2). None if width_mm is not given."""
        return None if self.width_mm is None else by_station(self.width_mm)

    def _check(self) -> None:
        if not (self.mm_per_px or self.ruler_px or self.markers or self.face_mm):
            raise PydanticCustomError(NO_SCALE, SCALES)
        for name, needed in NEEDED_BY.items():
            if getattr(self, name) and not getattr(self, needed):
                raise ValueError(f"{name} is given without {needed}: give both")
        for name, others in NOT_BESIDE.items():
            for other in others:
                if getattr(self, name) and getattr(self, other):
                    raise ValueError(f"{name} cannot be combined with {other}: give only one of them")
        if self.width_stations_mm is not None:
            require_order("width_mm", self.width_stations_mm)


class CrackShape(Settings):
    """Depth of the crack and tilt of its walls, which a photo does not show."""

    depth_mm: Annotated[OneOrSeveral[Depth, DepthTable], SHALLOW]
    """Depth of the crack: one number, or a table of [s, depth] rows along the crack from the nozzle's start. The depth
    is linear between rows and constant beyond them."""
    tilt: Tilt = "lean"
    """Tilt of the walls. lean: both walls lean to the same side. The mouth, the width and the volume between closed
    ends are then the same as with vertical walls. An open end stays in the side of the sample, so the volume is off by
    1 to 2 % if the crack bends there or meets the side obliquely. flare: the floor has the traced width, and the mouth
    is wider.
    funnel: the mouth has the traced width, and the walls close downward. undercut: the mouth has the traced width, and
    the walls open downward. An undercut is refused if the walls would meet below the face or leave the block. The
    paper's walls "funnel particles into the crack while keeping the appearance of the original crack", as lean does."""
    wall_angle_deg: OneOrSeveral[WallAngle, tuple[WallAngle, WallAngle]] = 11.0
    """Angle of both walls from the vertical, or two angles: of the left and of the right wall, as seen along the path.
    The default is the paper's angle."""
    fill: FillOrFile | None = None
    """CSV of a liquid that was weighed into the crack, or the table [crack.fill] with the same data. The weighing gives
    the angle of the walls, instead of wall_angle_deg, and corrects depth and width within their uncertainty."""
    scan: Path | None = None
    """Scan of the empty crack: points or triangles (PLY, STL, XYZ, CSV), or a height map (16-bit PNG or TIFF). Depths
    and walls are taken from it as far as they are seen. Elsewhere, depth_mm, tilt and wall_angle_deg are used."""
    placement: Placement | None = None
    """Unit and position of the scan. Required for a scan."""
    lean_to: Literal["left", "right"] = "left"
    """Side to which the floor is shifted from the mouth, as seen along the path. The paper does not state the side. The
    two choices give mirror images. If the two ends are exchanged, so are left and right."""
    floor_thickness_mm: float = Field(default=4.0, gt=0.1, le=500)
    """Thickness of the sample below the crack. The default is larger than a particle, and thin enough for 3D printing.
    Above 500, float32 would lose digits of the crack's coordinates."""
    margin_mm: float = Field(default=12.0, gt=0.5, le=1000)
    """Width of the block around the crack if the size of the face is unknown. Sealant that overflows needs this space.
    Walls under 0.5 mm break, and sealant never flows farther than a metre."""
    dam_height_mm: DamHeight = 10.0
    """Height above the face of the dam (tape) at an open end. The default is the paper's height. 0 means that the dam
    ends at the face."""

    @property
    def tilting(self) -> Tilting:
        """Row of the tilt in ``TILTS``."""
        return TILTS[self.tilt]

    @property
    def deepest_mm(self) -> float:
        return float(by_station(self.depth_mm)[:, 1].max())

    @property
    def wall_angles_deg(self) -> tuple[float, float]:
        """Angles of the left and the right wall from the vertical."""
        if not any(self.tilting):
            return 0.0, 0.0
        both = self.wall_angle_deg
        return both if isinstance(both, tuple) else (both, both)

    @property
    def depth_stations_mm(self) -> Floats:
        """Arc lengths at which depths are given, (k,)."""
        return by_station(self.depth_mm)[:, 0]

    def depth_at_mm(self, s_mm: Floats) -> Floats:
        """Return the depth at each arc length along the centreline, (n,)."""
        return np.interp(s_mm, *by_station(self.depth_mm).T)

    def _check(self) -> None:
        require_order("depth_mm", by_station(self.depth_mm))
        if (self.scan is None) != (self.placement is None):
            raise ValueError("scan and the table [crack.placement] with its unit belong together: give both or none")
        if self.scan is not None and self.fill is not None:
            raise ValueError("scan cannot be combined with fill: give only one of them")
        left_deg, right_deg = self.wall_angles_deg
        default = type(self).model_fields["wall_angle_deg"].default
        if self.fill is not None and self.tilting.opens and self.wall_angle_deg != default:
            raise ValueError(
                "wall_angle_deg cannot be combined with fill, which gives the angle. Leave wall_angle_deg out"
            )
        if self.tilting.lean and left_deg != right_deg:
            raise ValueError(
                f'wall_angle_deg is [{left_deg:g}, {right_deg:g}], but tilt = "lean" has a single angle. Give one '
                "number, or choose flare, funnel or undercut"
            )


class MeshInput(Settings):
    """A modelled or scanned sample, instead of a photo."""

    file: Path
    """STL, PLY or GLB file. The path is absolute or relative to the trial file's folder."""
    data: DataKind
    """Origin of the mesh. Reports state it unless it is "measured". Only measured meshes allow a comparison to be a
    validation."""
    units: MeshUnit
    """Unit of the file's numbers, which most formats do not state."""
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    """Axis of the file that points out of the cracked face."""
    dam_height_mm: DamHeight = 10.0
    """Height above the face of the dams at all points where the crack leaves the block, as in [crack]."""


class Dispensed(Settings):
    """The table [path.weighed]: mass and density of the sealant that reached the sample or was dispensed."""

    mass_g: float = Field(gt=0, le=1e4)
    """Mass of the sample after the pour, minus its mass before the pour. Or, if nothing dripped beside the sample, mass
    of the cartridge before the pour, minus its mass after the pour."""
    mass_sd_g: float = Field(gt=0, le=100)
    """Standard uncertainty of mass_g, which is 1.4 times the uncertainty of a single weighing."""
    density_kg_m3: float = Field(ge=500, le=5000)
    """Density of the sealant, for example from a cup of known volume that is weighed empty and full."""
    density_sd_kg_m3: float = Field(gt=0, le=500)
    """Standard uncertainty of density_kg_m3."""

    @property
    def volume_ml(self) -> float:
        return 1e3 * self.mass_g / self.density_kg_m3

    @property
    def volume_sd_ml(self) -> float:
        """Standard uncertainty of the volume, from the uncertainties of mass and density."""
        return self.volume_ml * hypot(self.mass_sd_g / self.mass_g, self.density_sd_kg_m3 / self.density_kg_m3)


class NozzlePath(Settings):
    """Path of the nozzle and its flow."""

    volume_ml: float | Literal["cavity"] = "cavity"
    """Volume of sealant along the crack. "cavity" means the cavity's volume times ``fill``."""
    fill: float = Field(default=0.6, gt=0.01, le=3)
    """Fraction of the cavity's volume to dispense, if volume_ml = "cavity". Paste with a yield stress slopes up towards
    the end of the path. With the default and 2 Pa, it rose at most 0.7 mm above the face in particle runs of 12 cracks,
    3 to 8 mm wide and 60 to 130 mm long. 1 fills a crack up to its face if the sealant levels."""
    weighed: Dispensed | None = None
    """Mass of the sealant that was dispensed. It replaces volume_ml and the uncertainty of volume_ml."""
    flow: Literal["constant", "cross_section"] = "constant"
    """Flow along the path. constant: equal for every millimetre. cross_section: proportional to the cavity's
    cross-section."""
    reverse: bool = False
    """True to start at the crack's second end. s is still measured from the first end."""
    trim_mm: OneOrSeveral[Trim, tuple[Trim, Trim]] = 5.0
    """Distance between the ends of the crack and the ends of the path. Give one number, or two: at s = 0 and at the far
    end. The default keeps the nozzle off the dams. The paper's distance is 10."""
    ramp_mm: float = Field(default=0.0, ge=0, le=200)
    """Distance over which the nozzle reaches full speed, and over which it stops, measured from the outer ends of the
    leads. Arms need at most 200. The flow is reduced with the speed, so each millimetre gets the volume set by flow."""
    lead_in_mm: float = Field(default=0.0, ge=0, le=500)
    """Length of the straight approach before the path, without flow, in which an arm accelerates. Few benches have
    space for more than 500."""
    lead_out_mm: float = Field(default=0.0, ge=0, le=500)
    """Length of the straight departure after the path, without flow."""
    speed_mm_s: Annotated[float, SPEED] = Field(default=4.0, gt=0.01, le=1000)
    """Speed of the nozzle. The default is the paper's speed. Below 0.01, sealant hardens in the nozzle. Above 1000,
    arms cannot follow."""
    spacing_mm: float = Field(default=1.0, gt=0.01, le=20)
    """Distance between waypoints. A distance below the default changes the path's length by less than 0.1 %. 0.01 is
    below an arm's repeatability. With more than 20, the path would leave a winding crack."""
    nozzle_height_mm: float = Field(default=3.0, gt=0.1, le=100)
    """Height of the nozzle's tip above the face."""
    smoothing_mm: float = Field(default=0.1, ge=0, le=2)
    """Largest RMS distance of the path from the centreline. With 0.1, the direction changes by less than 8 degrees at
    each waypoint of a winding crack, and sharp corners of the crack remain. Above 2, the nozzle leaves the crack."""
    plan: PlanOrFile | None = None
    """CSV with the columns t_s, x_mm, y_mm, z_mm, flow_mm3_s and, optionally, speed_mm_s, as 'sealtwin plan' writes it,
    or a table with these columns. It replaces all other settings of [path]."""

    @property
    def planned(self) -> PathTable | None:
        """Columns of the plan. None if there is no plan. Raises ValueError if its file was not read with ``loaded``."""
        if isinstance(self.plan, Path):
            raise ValueError("the plan is a file that is not read yet: call loaded() first")
        return self.plan

    def loaded(self, folder: Path) -> Self:
        """Return the settings with the plan's columns instead of its file, which is in ``folder``.

        Raises InputError if the file is not a valid path.
        """
        if not isinstance(self.plan, Path):
            return self
        return self.model_copy(update={"plan": read_planned_path(folder / self.plan)})

    @property
    def trims_mm(self) -> tuple[float, float]:
        """Trims at s = 0 and at the far end, in mm."""
        return self.trim_mm if isinstance(self.trim_mm, tuple) else (self.trim_mm, self.trim_mm)

    def _check(self) -> None:
        if self.plan is not None:
            fields = type(self).model_fields
            beside = [name for name, value in self if name != "plan" and value != fields[name].default]
            if beside:
                raise ValueError(f"plan gives path, speed and flow. Leave out {', '.join(beside)}")
        volume_ml = self.volume_ml if self.weighed is None else self.weighed.volume_ml
        if "volume_ml" in self.model_fields_set and self.volume_ml != volume_ml:
            raise ValueError(
                f"volume_ml cannot be combined with weighed, which gives {volume_ml:.4g} ml. Leave volume_ml out"
            )
        if volume_ml == "cavity":
            return
        if not SMALLEST_VOLUME_ML <= volume_ml <= LARGEST_VOLUME_ML:
            raise ValueError(
                f"{'volume_ml' if self.weighed is None else 'weighed'} is {volume_ml:.3g} ml. Give "
                f'{SMALLEST_VOLUME_ML:g} to {LARGEST_VOLUME_ML:g}, or volume_ml = "cavity" to fill the crack up to '
                "its face"
            )
        # The settings are frozen, but this value is computed from ``weighed``.
        object.__setattr__(self, "volume_ml", volume_ml)
        if self.fill != type(self).model_fields["fill"].default:
            raise ValueError(
                f"fill = {self.fill:g} is given with volume_ml = {self.volume_ml:g}, but fill applies only to "
                'volume_ml = "cavity". Remove fill, or set volume_ml = "cavity"'
            )
