"""Public reports on drawings."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from ezdxf.filemanagement import new

from tests.slow.reports.table import ALONG, BETWEEN, LENGTH, LINE, MM3, Check, refused, report, right, warned

SIXTY = right(LENGTH, 60, 1.5)
RING_OF_SIXTY = right(MM3, 2400, 24)
Draw = Callable[[Any, Any], object]


def new_drawing(version: str = "R2010", encoding: str = "utf8") -> tuple[Any, Any]:
    drawing: Any = new(version)
    drawing.encoding = encoding
    drawing.header["$INSUNITS"] = 4
    return drawing, drawing.modelspace()


def drawn(address: str, command: str, *sound: Check) -> Callable[[Draw], None]:
    """Add a report on a.dxf, which the function below draws."""

    def add(draw: Draw) -> None:
        def make(folder: Path) -> None:
            drawing, space = new_drawing()
            draw(drawing, space)
            drawing.saveas(folder / "a.dxf")

        make.__doc__ = draw.__doc__
        report(address, command, *sound)(make)

    return add


QUARTER_ELLIPSE_MM = 24.22
"""Length of a quarter of the ellipse with half axes of 20 and 10 mm."""


def walls(space: Any) -> None:
    """Draw two walls of 60 mm, 4 mm apart."""
    for layer, y in (("LOWER", 0), ("UPPER", 4)):
        space.add_lwpolyline([(0, y), (60, y)], dxfattribs={"layer": layer})


def dxf_of_lines(path: Path, version: str = "R2010") -> None:
    """A line from 0.5 to 60.5 mm, in six pieces."""
    drawing, space = new_drawing(version)
    for start in range(0, 60, 10):
        space.add_line((start + 0.5, 2.25), (start + 10.5, 2.25), dxfattribs={"layer": "CENTRELINE"})
    drawing.saveas(path)


COORDINATES = tuple(f"{code:>3}" for code in range(10, 40))
"""Group codes of a DXF whose values are coordinates."""


@drawn(
    "CadQuery/cadquery/pull/1384",
    ALONG,
    right(LENGTH, 30 + QUARTER_ELLIPSE_MM, 1.5),
    refused("a.dxf", "normal|extrusion|from below"),
)
def dxf_reversed_ellipse(drawing: Any, space: Any) -> None:
    """Part of an ellipse with a reversed normal is drawn mirrored."""
    here = {"layer": "CENTRELINE"}
    space.add_line((0, 0), (30, 0), dxfattribs=here)
    # With the normal -z the parameter runs clockwise: from (50, 10) to (30, 0).
    below = {**here, "extrusion": (0, 0, -1)}
    space.add_ellipse((30, 10), (20, 0, 0), 0.5, 0, np.pi / 2, dxfattribs=below)


@report("ixmilia/dxf/issues/107", f"digitise a.dxf --line Repère {LINE}", SIXTY)
def dxf_codepage(folder: Path) -> None:
    """Accents of layer names in ANSI_1252 become question marks. The file is an R2000 in cp1252."""
    drawing, space = new_drawing("R2000", "cp1252")
    drawing.layers.add("Repère")
    space.add_lwpolyline([(0, 0), (60, 0)], dxfattribs={"layer": "Repère"})
    drawing.saveas(folder / "a.dxf")


@drawn("skymakerolof/dxf/issues/58", f"{ALONG} --units mm", SIXTY, refused("a.dxf", "block|insert|array"))
def dxf_array(drawing: Any, space: Any) -> None:
    """Only the first copy is read of a block that is inserted as an array."""
    here = {"layer": "CENTRELINE"}
    drawing.blocks.new("PIECE").add_line((0, 0), (20, 0), dxfattribs=here)
    columns = {"column_count": 3, "column_spacing": 20.0}
    space.add_blockref("PIECE", (0, 0), dxfattribs=here | columns)


@report(
    "openscad/openscad/issues/593", f"{ALONG} --units mm", SIXTY, refused("a.dxf", "comma|number|readable|coordinate")
)
def dxf_of_commas(folder: Path) -> None:
    """A DXF with decimal commas is not refused."""
    path = folder / "a.dxf"
    dxf_of_lines(path, "R12")
    lines = path.read_text(encoding="utf-8").splitlines()
    for number in range(0, len(lines) - 1, 2):
        if lines[number] in COORDINATES:
            lines[number + 1] = lines[number + 1].replace(".", ",")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@report(
    "LibreDWG/libredwg/issues/1355",
    f"{ALONG} --units mm",
    refused("a.dxf", "cut short|truncat|ends early|ends before|incomplete|eof|its end|missing endsec"),
)
def dxf_cut_short(folder: Path) -> None:
    """A DXF that ends in the middle is read as a smaller drawing without a warning."""
    path = folder / "a.dxf"
    dxf_of_lines(path, "R12")
    before, _, _ = path.read_text(encoding="utf-8").rpartition("  0\nENDSEC\n  0\nEOF")
    *kept, _, _, _ = before.split("  0\nLINE\n")
    path.write_text("  0\nLINE\n".join(kept), encoding="utf-8")


@report("skymakerolof/dxf/issues/79", ALONG, SIXTY, refused("a.dxf", "binary|ascii|no readable dxf"))
def dxf_binary(folder: Path) -> None:
    """A binary DXF is not read."""
    drawing, space = new_drawing()
    space.add_lwpolyline([(0, 0), (60, 0)], dxfattribs={"layer": "CENTRELINE"})
    drawing.saveas(folder / "a.dxf", fmt="bin")


@drawn(
    "mozman/ezdxf/issues/330",
    BETWEEN,
    right(MM3, 2400, 10),
    refused("a.dxf", "arc|no length|open|speck|closed"),
    warned("arc|inside|stone"),
)
def dxf_arc_of_no_angle(drawing: Any, space: Any) -> None:
    """An arc whose angles are equal is a full circle to some and nothing to others."""
    walls(space)
    space.add_arc((30, 2), 1.5, 30, 30, dxfattribs={"layer": "LOWER"})


@drawn("mlightcad/realdwg-web/pull/171", BETWEEN, RING_OF_SIXTY, refused("a.dxf", "circle|radius"))
def dxf_circle_of_negative_radius(drawing: Any, space: Any) -> None:
    """One circle of negative radius makes all other lines of the file disappear."""
    walls(space)
    space.add_circle((30, 20), -5, dxfattribs={"layer": "NOTES"})


@report("mozman/ezdxf/issues/640", ALONG, SIXTY, refused("a.dxf", "no readable dxf"))
def dxf_with_lines_behind(folder: Path) -> None:
    """Empty lines after its end keep a DXF from being read."""
    drawing, space = new_drawing()
    space.add_lwpolyline([(0, 0), (60, 0)], dxfattribs={"layer": "CENTRELINE"})
    path = folder / "a.dxf"
    drawing.saveas(path)
    path.write_text(path.read_text(encoding="utf-8") + "\n\n\n", encoding="utf-8")


@drawn("heitzmann/gdspy/issues/91", ALONG, SIXTY, refused("a.dxf", "twice|no length"))
def dxf_corner_twice(drawing: Any, space: Any) -> None:
    """A repeated corner gives NaN."""
    space.add_lwpolyline([(0, 0), (30, 0), (30, 0), (60, 0)], dxfattribs={"layer": "CENTRELINE"})
