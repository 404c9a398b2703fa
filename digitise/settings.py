"""Choices made before a crack is digitised: the tables [photo], [crack], [mesh] and [path] of a trial file."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from sealtwin.records import DataKind, Floats
from sealtwin.settings import Settings

InPhoto = Annotated[float, Field(ge=-1_000_000, le=1_000_000)]
"""A pixel's column or row, or that of a place beside the photo: no photo that is read has a side of a million."""
Pixel = tuple[InPhoto, InPhoto]
LARGEST_FILE_BYTES = 250_000_000
"""Of a photo or a mesh: what 50 million pixels with transparency take uncompressed, and a quarter more."""
OnFace = Annotated[float, Field(ge=-10_000, le=10_000)]
"""A place on the face, in mm: none lies ten metres off."""
FaceSide = Annotated[float, Field(gt=1, le=5000)]
"""A side of a sample's face, in mm: below 1 mm there is no crack to see, above 5 m it is no sample."""
FINEST_MM_PER_PX, COARSEST_MM_PER_PX = 0.001, 2.0
"""Of any scale, given or found: a pixel finer than 1 µm is below what light resolves; at 2 mm the narrowest crack that
can be measured, 8 px, would be 16 mm wide.
"""
LARGEST_VOLUME_ML, SMALLEST_VOLUME_ML = 1000.0, 0.001
"""Of sealant in one path: a litre is three cartridges; a microlitre is four particles of the paper's size."""
Tilt = Literal["lean", "flare", "funnel", "vertical"]
WallAngle = Annotated[float, Field(ge=0, lt=60)]
ONE, SEVERAL = "one", "several"
ByShape = Discriminator(lambda value: SEVERAL if isinstance(value, list | tuple) else ONE)
"""For settings that are one number or several: a fault is then told of the form that was given, not of both."""
DEEPEST_MM = 500.0
"""Deeper than any sample; a tenth of a millimetre, at the other end, is a scratch."""
Depth = Annotated[float, Field(gt=0.1, le=DEEPEST_MM)]
DepthStation = tuple[Annotated[float, Field(ge=0, le=10_000)], Depth]
"""Arc length along the centreline from where the nozzle starts, and the depth there; both in mm."""
Trim = Annotated[float, Field(ge=0, le=1000)]
"""A metre is more than half of any crack on a sample."""
MeshUnit = Literal["mm", "cm", "m", "inch"]
MOST_VIA = 50
"""Clicks between the ends: more would be drawing the crack, which a mask does better."""


def _tape_or_none(height_mm: float) -> float:
    if 0 < height_mm < 0.1:
        raise ValueError("give 0, or 0.1 to 100")
    return height_mm


DamHeight = Annotated[float, Field(ge=0, le=100), AfterValidator(_tape_or_none)]


class Marker(Settings):
    """One printed marker, upright, lying in the plane of the face."""

    id: int = Field(ge=0, lt=1000)
    """No dictionary has a thousand."""
    x_mm: OnFace
    """Of its centre, from the lower left corner of the face."""
    y_mm: OnFace


class MarkerBoard(Settings):
    """Markers of known place in the plane of the face.

    Markers nearer or farther than the face give a wrong scale: the error is their offset over the camera's distance.
    """

    dictionary: Literal["4x4_50", "5x5_100", "6x6_250", "apriltag_36h11"] = "4x4_50"
    size_mm: float = Field(gt=0.5, le=1000)
    """Outer edge of the black square: finer does not print, and a metre is larger than a sample."""
    markers: tuple[Marker, ...] = Field(min_length=4, max_length=1000)
    """Four corners fix a homography; fewer markers leave it to the noise of one."""

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        numbers = [marker.id for marker in self.markers]
        if twice := {number for number in numbers if numbers.count(number) > 1}:
            raise ValueError(f"marker {min(twice)} is listed {numbers.count(min(twice))} times; it lies in one place")
        return self


class PhotoInput(Settings):
    """A top-down photo and what gives it a scale: markers, the face's size, or millimetres per pixel."""

    file: Path
    """Beside the trial file, or absolute."""
    data: DataKind
    """Where the photo comes from; anything but "measured" is said so in every report."""
    ends_px: tuple[Pixel, Pixel] | None = None
    """The two ends of the crack; the nozzle starts at the first. Left out, the crack is searched for: then look at
    overlay.png before you trust what follows.
    """
    via_px: tuple[Pixel, ...] = Field(default=(), max_length=MOST_VIA)
    """Points between the ends that the crack passes, in its order: where it forks, or another one is darker."""
    roi_px: tuple[Pixel, ...] | None = Field(default=None, min_length=2, max_length=200)
    """The crack is searched for inside this only: two opposite corners of a box, or the corners of a polygon."""
    mask: Path | None = None
    """A picture of the photo's size in which the crack is painted, white on black or opaque on transparent. Its walls
    are then the painted ones, and nothing is searched for. Beside the trial file, or absolute.
    """
    second_photo: Path | None = None
    """The same sample from the same camera, lit from the other side: where one lamp lights a wall, the other leaves it
    dark, so the darker of both pixels is taken.
    """
    edge_fraction: float = Field(default=0.5, gt=0.2, lt=0.9)
    """Share of the contrast, from crack to mortar, at which a wall is drawn. Half is the middle of a blurred edge; 0.7
    finds more of a wall that the lamp lights. Beyond 0.2 and 0.9 the noise of crack or mortar draws it.
    """
    branches: Literal["drop", "keep"] = "drop"
    """Side cracks are reported; kept, they are part of outline and solid. The nozzle follows the main crack."""
    markers: MarkerBoard | None = None
    lens: Literal["auto", "none"] = "auto"
    """One radial term of the lens, fitted from the markers where they show it; none: a straight-line camera."""
    camera_distance_mm: float | None = Field(default=None, gt=10, le=20_000)
    """From lens to face, to say what markers above or below the face would cost. Nearer than a centimetre no lens
    focuses; beyond 20 m no crack is seen.
    """
    ruler_px: tuple[Pixel, Pixel] | None = None
    """Two points on a ruler that lies in the plane of the face; the photo is then taken to be square to it."""
    ruler_mm: float | None = Field(default=None, gt=1, le=5000)
    """Their distance on the ruler."""
    face_mm: tuple[FaceSide, FaceSide] | None = None
    """Width and height of the sample's face, its lower left corner the origin. Beside markers it says where the
    sample ends; alone it gives the scale.
    """
    face_corners_px: tuple[Pixel, Pixel, Pixel, Pixel] | None = None
    """Lower left, lower right, upper right, upper left; left out, they are searched for."""
    mm_per_px: float | None = Field(default=None, gt=FINEST_MM_PER_PX, le=COARSEST_MM_PER_PX)
    """See FINEST_MM_PER_PX for the reasons of its bounds."""
    scale_is: Literal["measured", "assumed"] = "measured"
    """Of mm_per_px: an assumed scale is named so wherever a length is shown."""

    @model_validator(mode="after")
    def _one_scale(self) -> Self:
        if (self.ruler_px is None) != (self.ruler_mm is None):
            raise ValueError("a ruler needs both ruler_px, its two points, and ruler_mm, their distance")
        flat = {"mm_per_px": self.mm_per_px, "ruler_px": self.ruler_px}
        given = [name for name, value in flat.items() if value is not None]
        if len(given) > 1 or (given and (self.markers or self.face_mm)):
            raise ValueError(
                f"{given[0]} beside {' and '.join(given[1:]) or 'markers or face_mm'}: give one scale, not two"
            )
        if not given and self.markers is None and self.face_mm is None:
            raise ValueError("no scale: give [photo.markers], face_mm, ruler_px or mm_per_px; it is never guessed")
        if self.face_corners_px is not None and self.face_mm is None:
            raise ValueError("face_corners_px without face_mm: corners need the face's size")
        return self

    @model_validator(mode="after")
    def _hints_go_together(self) -> Self:
        if self.via_px and self.ends_px is None:
            raise ValueError("via_px without ends_px: points between the ends need the ends")
        if self.mask is not None and (self.roi_px is not None or self.via_px):
            raise ValueError("mask beside roi_px or via_px: the mask says where the crack is; give ends_px at most")
        return self


class CrackShape(Settings):
    """What the photo cannot show: depth and the tilt of the walls."""

    depth_mm: Annotated[
        Annotated[Depth, Tag(ONE)]
        | Annotated[tuple[DepthStation, ...], Field(min_length=1, max_length=1000), Tag(SEVERAL)],
        ByShape,
    ]
    """One depth, or a table of [s, depth] along the crack from where the nozzle starts: linear between, and constant
    before the first and after the last.
    """
    tilt: Tilt = "lean"
    """lean: both walls lean the same way, so mouth and width are the photo's, and so is the volume between closed or
    cut ends; open ends stay vertical, in the side of the sample, so that where the crack bends there, or meets the side
    obliquely, the volume is off by 1 to 2 %. flare: the floor keeps the traced width, the mouth opens. funnel: the
    mouth keeps it, the walls close. The paper tilts its walls to "funnel particles into the crack while keeping the
    appearance of the original crack", which lean does.
    """
    wall_angle_deg: Annotated[
        Annotated[WallAngle, Tag(ONE)] | Annotated[tuple[WallAngle, WallAngle], Tag(SEVERAL)], ByShape
    ] = 11.0
    """Each wall's angle from vertical, or that of the left wall and of the right one, seen along the path; 11 in the
    paper. Not used when vertical.
    """
    lean_to: Literal["left", "right"] = "left"
    """Where the floor lies from the mouth, seen along the path: the paper does not say, and the choice mirrors. It
    follows the path: with the ends swapped, the same word leans the crack to the other side of the sample.
    """
    floor_thickness_mm: float = Field(default=4.0, gt=0.1, le=500)
    """Sample kept below the crack: more than a particle can cross unseen, and thin enough to print. More than half a
    metre of it costs the file's float32 the digits of the crack.
    """
    margin_mm: float = Field(default=12.0, gt=0.5, le=1000)
    """Block around the crack where the size of the face is not known: room for sealant that overflows. Thinner walls
    would break, and a metre is more than any spill.
    """
    dam_height_mm: DamHeight = 10.0
    """Tape at open ends stands this far above the face, so that nothing leaves where the paper's was taped: 0 for none
    above it, else at least 0.1, which is the thickness of the tape itself.
    """

    @property
    def deepest_mm(self) -> float:
        return float(self.depth_at_mm(self.depth_stations_mm).max())

    @property
    def wall_angles_deg(self) -> tuple[float, float]:
        """Of the left wall and of the right one."""
        if self.tilt == "vertical":
            return 0.0, 0.0
        both = self.wall_angle_deg
        return both if isinstance(both, tuple) else (both, both)

    @property
    def depth_stations_mm(self) -> Floats:
        """Arc lengths at which the depth is given, (k,)."""
        return np.array(self._stations, dtype=float)[:, 0]

    def depth_at_mm(self, s_mm: Floats) -> Floats:
        """Depth at each arc length along the centreline, (n,)."""
        return np.interp(s_mm, *np.array(self._stations, dtype=float).T)

    @property
    def level_depths_mm(self) -> Floats:
        """Depths at which the floor is level for a while, (k,), increasing: the first and the last belong to them."""
        depth_mm = np.array(self._stations, dtype=float)[:, 1]
        return np.unique(np.concatenate([depth_mm[:-1][np.diff(depth_mm) == 0], depth_mm[[0, -1]]]))

    @property
    def _stations(self) -> tuple[tuple[float, float], ...]:
        return self.depth_mm if isinstance(self.depth_mm, tuple) else ((0.0, self.depth_mm),)

    @model_validator(mode="after")
    def _stations_in_order(self) -> Self:
        for (before_mm, _), (after_mm, _) in pairwise(self._stations):
            if after_mm <= before_mm:
                raise ValueError(f"depth_mm: station {after_mm:g} after {before_mm:g}; s must grow from row to row")
        return self

    @model_validator(mode="after")
    def _lean_alike(self) -> Self:
        left_deg, right_deg = self.wall_angles_deg
        if self.tilt == "lean" and left_deg != right_deg:
            raise ValueError(
                f"wall_angle_deg is [{left_deg:g}, {right_deg:g}] with tilt lean, in which both walls lean alike: give "
                "one angle, or choose flare or funnel"
            )
        return self


class MeshInput(Settings):
    """A sample that somebody has modelled or scanned, in place of a photo."""

    file: Path
    """STL, PLY, OBJ, OFF, GLB or 3MF; beside the trial file, or absolute."""
    data: DataKind
    """Where the mesh comes from; anything but "measured" is said so in every report."""
    units: MeshUnit
    """Of its numbers. Most formats do not say, so it is never guessed."""
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    """The axis of the file that points out of the cracked face."""
    path: Path | None = None
    """Centreline as x y in mm a line, in the file's own frame turned upright; left out, it is found in a section just
    under the face.
    """
    base_mm: float | None = Field(default=None, gt=0.1, le=1000)
    """Of a scan that is open below: it gets upright sides, and a flat underside this far below the face."""
    dam_height_mm: DamHeight = 10.0
    """As in [crack]: a dam stands wherever the crack leaves the block."""


class NozzlePath(Settings):
    """Where the nozzle goes, and how much it gives."""

    volume_ml: float | Literal["cavity"] = "cavity"
    """Sealant given along the crack; "cavity" fills the share ``fill`` of it."""
    fill: float = Field(default=1.0, gt=0.01, le=3)
    """With volume_ml = "cavity": 1 fills the crack up to its face. Thrice that is a spill."""
    flow: Literal["constant", "cross_section"] = "constant"
    """constant: as much for every second of the way; cross_section: in proportion to the cavity's section there, so
    that a wide or deep place gets more.
    """
    reverse: bool = False
    """Start from the crack's second end. s still counts from the first."""
    trim_mm: Annotated[Annotated[Trim, Tag(ONE)] | Annotated[tuple[Trim, Trim], Tag(SEVERAL)], ByShape] = 10.0
    """The path starts and ends this far along the centreline from the crack's ends, as in the paper; two numbers for
    two ends, that of s = 0 first.
    """
    ramp_mm: float = Field(default=0.0, ge=0, le=200)
    """At both ends, from the outer end of a lead where there is one, the nozzle takes this far to come to speed and to
    a stop, with the flow in proportion, so that every millimetre gets what it would get at speed. Further than 200 no
    arm needs.
    """
    lead_in_mm: float = Field(default=0.0, ge=0, le=500)
    """A straight approach before the path, in its direction and without flow: what an arm needs to come to speed.
    Half a metre is more than a bench has.
    """
    lead_out_mm: float = Field(default=0.0, ge=0, le=500)
    """The same after it."""
    speed_mm_s: float = Field(default=4.0, gt=0.01, le=1000)
    """The paper's. Below a hundredth, 80 mm take hours, and sealant sets in the nozzle; a metre a second is the end of
    what an arm can follow.
    """
    spacing_mm: float = Field(default=1.0, gt=0.01, le=20)
    """Between waypoints: finer changes the length by less than 0.1 %. A hundredth is below what an arm repeats; beyond
    20 the straight pieces leave a crack that wanders.
    """
    nozzle_height_mm: float = Field(default=3.0, gt=0.1, le=100)
    """Of the nozzle's tip above the face: a tenth clears its grain, from 10 cm sealant no longer meets a crack."""
    smoothing_mm: float = Field(default=0.1, ge=0, le=2)
    """Bound of the RMS distance from the centreline: at 0.1 no turn between waypoints of a wandering crack exceeds 8
    degrees; the corner of a dog-leg stays. Beyond 2 the nozzle would leave the crack.
    """

    @property
    def trims_mm(self) -> tuple[float, float]:
        """At s = 0 and at the far end."""
        return self.trim_mm if isinstance(self.trim_mm, tuple) else (self.trim_mm, self.trim_mm)

    @model_validator(mode="after")
    def _possible_volume(self) -> Self:
        if self.volume_ml != "cavity" and not SMALLEST_VOLUME_ML <= self.volume_ml <= LARGEST_VOLUME_ML:
            raise ValueError(
                f"volume_ml is {self.volume_ml:g}: give {SMALLEST_VOLUME_ML:g} to {LARGEST_VOLUME_ML:g}, "
                'or "cavity" to fill the crack up to its face'
            )
        if self.volume_ml != "cavity" and self.fill != 1:
            raise ValueError(
                f'fill is {self.fill:g} beside volume_ml = {self.volume_ml:g}: a share is of volume_ml = "cavity" only'
            )
        return self
