"""Choices made before a crack is digitised: the tables [photo], [crack] and [path] of a trial file."""

from pathlib import Path
from typing import Literal, Self

from pydantic import Field, model_validator

from sealtwin.records import DataKind
from sealtwin.settings import Settings

Pixel = tuple[float, float]
Tilt = Literal["lean", "flare", "funnel", "vertical"]


class Marker(Settings):
    """One printed marker, upright, lying in the plane of the face."""

    id: int = Field(ge=0)
    x_mm: float
    """Of its centre, from the lower left corner of the face."""
    y_mm: float


class MarkerBoard(Settings):
    """Markers of known place in the plane of the face.

    Markers nearer or farther than the face give a wrong scale: the error is their offset over the camera's distance.
    """

    dictionary: Literal["4x4_50", "5x5_100", "6x6_250", "apriltag_36h11"] = "4x4_50"
    size_mm: float = Field(gt=0)
    """Outer edge of the black square."""
    markers: tuple[Marker, ...] = Field(min_length=4)
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
    face_mm: tuple[float, float] | None = None
    """Width and height of the sample's face, its lower left corner the origin. Beside markers it says where the
    sample ends; alone it gives the scale.
    """
    face_corners_px: tuple[Pixel, Pixel, Pixel, Pixel] | None = None
    """Lower left, lower right, upper right, upper left; left out, they are searched for."""
    mm_per_px: float | None = Field(default=None, gt=0)
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
        if self.face_mm is not None and min(self.face_mm) <= 0:
            raise ValueError(f"face_mm is {self.face_mm}: both sides must be above 0")
        return self


class CrackShape(Settings):
    """What the photo cannot show: depth and the tilt of the walls."""

    depth_mm: float = Field(gt=0, le=500)
    tilt: Tilt = "lean"
    """lean: both walls lean the same way, so mouth, width and volume are the photo's. flare: the floor keeps the
    traced width, the mouth opens. funnel: the mouth keeps it, the walls close. The paper tilts its walls to "funnel
    particles into the crack while keeping the appearance of the original crack", which lean does.
    """
    wall_angle_deg: float = Field(default=11.0, ge=0, lt=60)
    """Each wall's angle from vertical; 11 in the paper. Not used when vertical."""
    lean_to: Literal["left", "right"] = "left"
    """Where the floor lies from the mouth, seen along the path: the paper does not say, and the choice mirrors."""
    floor_thickness_mm: float = Field(default=4.0, gt=0)
    """Sample kept below the crack: more than a particle can cross unseen, and thin enough to print."""
    margin_mm: float = Field(default=12.0, gt=0)
    """Block around the crack where the size of the face is not known: room for sealant that overflows."""
    dam_height_mm: float = Field(default=10.0, ge=0)
    """Tape at open ends stands this far above the face, so that nothing leaves where the paper's was taped."""


class NozzlePath(Settings):
    """Where the nozzle goes, and how much it gives."""

    volume_ml: float | Literal["cavity"] = "cavity"
    """Sealant given between the first waypoint and the last; "cavity" fills the crack up to its face."""
    trim_mm: float = Field(default=10.0, ge=0)
    """The path starts and ends this far along the centreline from the crack's ends, as in the paper."""
    speed_mm_s: float = Field(default=4.0, gt=0)
    """The paper's."""
    spacing_mm: float = Field(default=1.0, gt=0)
    """Between waypoints: finer changes the length by less than 0.1 %."""
    nozzle_height_mm: float = Field(default=3.0, gt=0)
    """Of the nozzle's tip above the face."""
    smoothing_mm: float = Field(default=0.1, ge=0)
    """Bound of the RMS distance from the centreline: at 0.1 no turn between waypoints of a wandering crack exceeds 8
    degrees; the corner of a dog-leg stays.
    """

    @model_validator(mode="after")
    def _positive_volume(self) -> Self:
        if self.volume_ml != "cavity" and not 0 < self.volume_ml <= 1000:
            raise ValueError(f'volume_ml is {self.volume_ml}: above 0 and at most 1000, or "cavity"')
        return self
