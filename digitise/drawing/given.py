"""Settings of cracks that are given in mm or drawn in CAD, instead of traced in a photo."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from digitise.settings import FaceSide, OneOrSeveral, OnFace, Width, WidthTable, by_station, require_order
from sealtwin.core.records import DataKind, Floats
from sealtwin.core.settings import Settings
from sealtwin.core.solid_figures import Box

MAX_POINTS = 5000  # Largest number of points of a line in mm, ten times that of a traced line
Line = Annotated[tuple[tuple[OnFace, OnFace], ...], Field(min_length=2, max_length=MAX_POINTS)]
DrawnUnit = Literal["mm", "cm", "m", "inch", "foot"]
Layer = Annotated[str, Field(min_length=1, max_length=255)]  # Name of a layer of a drawing


class GivenCrack(Settings):
    """Settings of a crack that is given by lines in mm instead of a photo."""

    face_mm: tuple[FaceSide, FaceSide] | None = None
    """Width and height of the sample's face. The origin is its lower left corner. A crack that reaches the face's edge
    is open there. Default: the crack is closed at both ends, and the solid has a margin around it."""
    data: DataKind = "undeclared"
    """Origin of the numbers. Reports state it unless it is "measured". Only measured numbers allow a comparison to be a
    validation."""

    @property
    def box_mm(self) -> Box | None:
        """x_min, y_min, x_max, y_max of the face in mm. None if ``face_mm`` is not given."""
        return None if self.face_mm is None else (0.0, 0.0, *self.face_mm)


class GivenLine(GivenCrack):
    """A crack given by its centreline and its width."""

    points_mm: Line
    """Points of the centreline. s is 0 at the first point."""
    width_mm: OneOrSeveral[Width, WidthTable]
    """Width of the crack: one number, or a table of [s, width] rows. The width is linear between rows and constant
    beyond them."""

    @property
    def widths_mm(self) -> Floats:
        """Rows of arc length and width in mm, (k, 2)."""
        return by_station(self.width_mm)

    def _check(self) -> None:
        require_order("width_mm", self.widths_mm)


class GivenWalls(GivenCrack):
    """A crack given by its two walls."""

    left_mm: Line
    """Points of the wall on the left, seen in the direction of the crack. s is 0 at the first point."""
    right_mm: Line
    """Points of the right wall, in either direction."""


class DrawnLines(GivenCrack):
    """A crack drawn in CAD as two walls, or as a line with a width. s is 0 at its left end."""

    walls: tuple[Layer, Layer] | None = None
    """Two layers. Each contains one wall as an open line."""
    line: Layer | None = None
    """Layer with the crack's middle as an open line. It requires ``width_mm``."""
    width_mm: Width | None = None
    """Width of the crack whose middle is ``line``."""
    units: DrawnUnit | None = None
    """Unit of the drawing. It replaces the unit stated in the file and is required if the file states none."""

    def _check(self) -> None:
        if (self.line is None) != (self.width_mm is None):
            raise ValueError("give both line and width_mm, or neither: a line alone has no width")
        if (self.walls is None) == (self.line is None):
            raise ValueError("give the layers of the two walls, or line with width_mm")

    @property
    def layers(self) -> tuple[str, ...]:
        """Layers that are read: that of the line, or those of both walls."""
        return self.walls or ((self.line,) if self.line else ())


class DrawingInput(DrawnLines):
    """A crack that was drawn in CAD from above, instead of a photo."""

    file: Path
    """DXF file. The path is absolute or relative to the trial file's folder."""
