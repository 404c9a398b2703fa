"""Settings that bring a scan into the frame of the sample: its unit, its upward axis, and named points."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sealtwin.core.settings import Settings

ScanUnit = Literal["mm", "cm", "m", "inch"]
MM: dict[ScanUnit, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
Coordinate = Annotated[float, Field(ge=-1e9, le=1e9)]
Step = Annotated[float, Field(ge=0.001, le=10)]
FEWEST_POINTS, MOST_POINTS = 3, 6
LEAST_COUNT_MM = 1e-6
DIRECTION = (
    'write "z" if the heights grow out of the face. If they grow away from the sensor, give a height map a negative '
    'count_mm, and points or triangles "-z"'
)


class NamedPoint(Settings):
    """A point that is seen in the scan and on the sample, such as a corner of the face or the centre of a marker."""

    name: Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[^\x00-\x1f\x7f]+$")]
    """Name of the point in messages."""
    scan: tuple[Coordinate, Coordinate, Coordinate]
    """Its coordinates x, y and z in the scan, in the unit of the scan."""
    sample_mm: tuple[Coordinate, Coordinate]
    """Its coordinates x and y on the sample's face in mm: x to the right and y up in the photo, from the lower left
    corner of the face."""


class Placement(Settings):
    """Unit and position of a scan."""

    units: ScanUnit | None = None
    """Unit of the file's numbers, which no format states. Required for points and triangles."""
    step_mm: Step | tuple[Step, Step] | None = None
    """Distance between the centres of neighbouring pixels of a height map in mm, or two if those along a row and along
    a column differ. Required for a height map."""
    count_mm: float | None = Field(default=None, ge=-1000, le=1000)
    """Height in mm of one count of a height map, such as 1 for a TIFF of heights in mm. Negative for a depth map, whose
    numbers grow away from the sensor. Required for a height map. 0 means no height in whole numbers, and NaN in others.
    """
    up: Literal["x", "y", "z", "-x", "-y", "-z"] | None = None
    """Axis of the scan that points out of the face, up to 30 degrees. "-z" for a camera's axes: x to the right, y down,
    z into the face. Required unless ``count_mm`` is negative, since a heap in a depth map looks like a bed."""
    points: Annotated[tuple[NamedPoint, ...], Field(max_length=MOST_POINTS)] = ()
    """Points whose coordinates are known in the scan and on the face, at least three. Default: the position is found by
    the face's plane and the crack's mouth. The scan's axes must then agree with the photo's up to 30 degrees."""

    @property
    def unit_mm(self) -> float:
        """Length of the scan's unit in mm."""
        return MM[self.units or "mm"]

    @property
    def states_direction(self) -> bool:
        """True if it is stated whether heights grow out of the face or away from the sensor."""
        return self.up is not None or (self.count_mm or 0.0) < 0

    @model_validator(mode="after")
    def _can_place(self) -> Self:
        if self.count_mm is not None and abs(self.count_mm) < LEAST_COUNT_MM:
            raise ValueError(f"count_mm is {self.count_mm:g}: give at least {LEAST_COUNT_MM:g}, or -{LEAST_COUNT_MM:g}")
        names = [point.name for point in self.points]
        if twice := [name for name in names if names.count(name) > 1]:
            raise ValueError(f'two points have the name "{twice[0]}": give each its own name')
        if 0 < len(names) < FEWEST_POINTS:
            raise ValueError(f"points has {len(names)} of at least {FEWEST_POINTS} points: add points, or omit points")
        return self


UPRIGHT_DEG = {
    "z": (0, 0),
    "-z": (180, 0),
    "y": (90, 0),
    "-y": (-90, 0),
    "x": (-90, -90),
    "-x": (0, 90),
}
"""Rotations about x, then y, after which the axis that points out of the face is z."""
