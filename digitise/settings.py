"""Choices made before a crack is digitised: the tables [photo], [crack] and [path] of a trial file."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sealtwin.records import DataKind
from sealtwin.settings import Settings

Pixel = tuple[float, float]
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
    markers: MarkerBoard | None = None
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
        if self.mm_per_px is not None and (self.markers or self.face_mm):
            raise ValueError("mm_per_px beside markers or face_mm: give one scale, not two")
        if self.mm_per_px is None and self.markers is None and self.face_mm is None:
            raise ValueError("no scale: give [photo.markers], face_mm or mm_per_px; it is never guessed")
        if self.face_corners_px is not None and self.face_mm is None:
            raise ValueError("face_corners_px without face_mm: corners need the face's size")
        return self


class CrackShape(Settings):
    """What the photo cannot show: depth and the tilt of the walls."""

    depth_mm: float = Field(gt=0.1, le=500)
    """A tenth of a millimetre is a scratch, half a metre is deeper than any sample."""
    tilt: Tilt = "lean"
    """lean: both walls lean the same way, so mouth and width are the photo's, and so is the volume between closed or
    cut ends; open ends stay vertical, in the side of the sample, so that where the crack bends there, or meets the side
    obliquely, the volume is off by 1 to 2 %. flare: the floor keeps the traced width, the mouth opens. funnel: the
    mouth keeps it, the walls close. The paper tilts its walls to "funnel particles into the crack while keeping the
    appearance of the original crack", which lean does.
    """
    wall_angle_deg: float = Field(default=11.0, ge=0, lt=60)
    """Each wall's angle from vertical; 11 in the paper. Not used when vertical."""
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
    dam_height_mm: float = Field(default=10.0, ge=0, le=100)
    """Tape at open ends stands this far above the face, so that nothing leaves where the paper's was taped: 0 for none
    above it, else at least 0.1, which is the thickness of the tape itself.
    """

    @model_validator(mode="after")
    def _dam_or_none(self) -> Self:
        if 0 < self.dam_height_mm < 0.1:
            raise ValueError(f"dam_height_mm is {self.dam_height_mm:g}: give 0, or 0.1 to 100")
        return self


class NozzlePath(Settings):
    """Where the nozzle goes, and how much it gives."""

    volume_ml: float | Literal["cavity"] = "cavity"
    """Sealant given between the first waypoint and the last; "cavity" fills the crack up to its face."""
    trim_mm: float = Field(default=10.0, ge=0, le=1000)
    """The path starts and ends this far along the centreline from the crack's ends, as in the paper. A metre is more
    than half of any crack on a sample.
    """
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

    @model_validator(mode="after")
    def _possible_volume(self) -> Self:
        if self.volume_ml != "cavity" and not SMALLEST_VOLUME_ML <= self.volume_ml <= LARGEST_VOLUME_ML:
            raise ValueError(
                f"volume_ml is {self.volume_ml:g}: give {SMALLEST_VOLUME_ML:g} to {LARGEST_VOLUME_ML:g}, "
                'or "cavity" to fill the crack up to its face'
            )
        return self
