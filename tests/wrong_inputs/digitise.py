"""Wrong drawings and meshes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf.filemanagement
import manifold3d
import trimesh
from ezdxf import units

from tests.support.meshes import box, mesh_of, slotted
from tests.wrong_inputs.table import WrongInput, answers

Draw = Callable[[Any, Any], object]


def drawing(draw: Draw, unit: int = units.MM, **header: int) -> Callable[[Path], object]:
    """Return a writer of a.dxf, drawn by a function of the document and its model space."""

    def write(folder: Path) -> None:
        document: Any = ezdxf.filemanagement.new(units=unit)
        for name, value in header.items():
            document.header[f"${name}"] = value
        draw(document, document.modelspace())
        document.saveas(folder / "a.dxf")

    return write


def on(layer: str, **attributes: object) -> dict[str, object]:
    return {"layer": layer, **attributes}


def walls(space: Any, y: float = 3.0, **attributes: object) -> None:
    """Draw two walls from x = 0 to 40: at y = 0 on the layer A, and at ``y`` on the layer B."""
    for layer, height in (("A", 0.0), ("B", y)):
        space.add_lwpolyline([(0.0, height), (40.0, height)], dxfattribs=on(layer, **attributes))


def lines(space: Any, *ways: tuple[tuple[float, ...], tuple[float, ...]], layer: str = "L") -> None:
    for first, last in ways:
        space.add_line(first, last, dxfattribs=on(layer))


def framed(_: Any, space: Any) -> None:
    """Draw a spline-fit polyline, whose control points come before the points of the curve."""
    line = space.add_polyline2d([(0, 0), (20, 30), (40, 0)], dxfattribs=on("L", flags=4))
    line.append_vertices([(0, 0), (20, 5), (40, 0)])
    for number, vertex in enumerate(line.vertices):
        vertex.dxf.flags = 16 if number < 3 else 8


def beside_lines(_: Any, space: Any) -> None:
    walls(space)
    walls(space)
    space.add_line((0, 10), (40, 10), dxfattribs=on("A", invisible=1))
    space.add_text("a crack", dxfattribs=on("A"))
    space.add_point((1, 1), dxfattribs=on("A"))


DRAWN = "digitise {given}/a.dxf --depth-mm 8 --out {out}"
ALONG, BETWEEN = " --line L --width-mm 3", " --walls A B"
OF_A_MESH = ("mesh.up", "drawing.stl", "Mesh", "Trace it again", "R2010", "px")
ROW = {"more", "code", "lacks"}


def drawn(name: str, draw: Draw, *names: str, **others: Any) -> WrongInput:
    """Return a row for a drawing; ``others`` are fields of the row, and unit and header of the drawing."""
    row = {key: others.pop(key) for key in ROW & others.keys()}
    return answers(DRAWN)(name, drawing(draw, **others), *names, **row)


# fmt: off
DRAWINGS = [
    drawn("frame of a spline-fit line", framed, "41.2 mm long", more=ALONG, code=0),
    drawn("no crack but a square", lambda _, space: walls(space, y=20.0), "a.dxf", "is not a crack", more=BETWEEN,
        lacks=OF_A_MESH),
    drawn("edge of the sample through the crack", lambda _, space: lines(space, ((0, 0), (20, 9)), ((20, 9), (40, 0))),
        "a.dxf", "outside the face of 40 x 5 mm", more=f"{ALONG} --face-mm 40x5"),
    drawn("far line", lambda _, space: lines(space, ((0, 0), (9e9, 0))), "layer L: its LINE #", more=ALONG),
    drawn("drawn in mm, said to be in inches", lambda _, space: walls(space),
        "unit of the drawing: mm (by --units; the drawing states inch)", "40 x 3 mm", "closed at both ends",
        more=f"{BETWEEN} --units mm", unit=units.IN, code=0),
    drawn("too large in the drawing's unit", lambda _, space: walls(space), "The unit is inch, by the drawing",
        "1000 mm", "--units mm", more=BETWEEN, unit=units.IN, MEASUREMENT=1, lacks=OF_A_MESH),
    drawn("gaps of some µm", lambda _, space: lines(space, ((0, 0), (20, 0)), ((20.004, 0), (40, 0))),
        "a.dxf, layer L", "gap is 0.004 mm at (20", more=ALONG),
    drawn("line with an arm", lambda _, space: lines(space, ((0, 0), (20, 0)), ((20, 0), (40, 0)), ((20, 0), (30, 9))),
        "3 lines meet at (20, 0)", more=ALONG),
    drawn("texts, a hidden line and copies", beside_lines,
        "layer A: these parts were left out: exact copies of lines (1), invisible lines (1), TEXT (1), POINT (1)",
        more=BETWEEN, code=0),
    drawn("drawn upright", lambda _, space: lines(space, ((0, 0, 0), (20, 0, 6)), ((20, 0, 6), (40, 0, 0))), "layer L",
        "z is 0 to 6 mm", "XY plane", more=ALONG),
    drawn("walls that cross", lambda _, space: (lines(space, ((0, 0), (40, 2)), layer="A"),
        lines(space, ((0, 3), (40, 0)), layer="B")), "a.dxf", "walls cross", more=BETWEEN, lacks=OF_A_MESH),
]
# fmt: on


def mesh(content: Callable[[trimesh.Trimesh], bytes], *bodies: manifold3d.Manifold) -> Callable[[Path], object]:
    """Return a writer of a slotted block and other bodies."""

    def write(folder: Path) -> None:
        parts = [trimesh.Trimesh(*mesh_of(body), process=False) for body in (slotted(), *bodies)]
        whole: Any = trimesh.util.concatenate(parts)
        (folder / "m.stl").write_bytes(content(whole))

    return write


def as_stl(shape: trimesh.Trimesh, kind: str = "stl") -> bytes:
    text: Any = shape.export(file_type=kind)
    return text if isinstance(text, bytes) else text.encode()


def far_away(shape: trimesh.Trimesh) -> trimesh.Trimesh:
    """Move a shape far from the origin and enlarge it a little, so that its coordinates are no integers."""
    return shape.apply_scale(1.003).apply_translation((0.0, 3e7, 0.0))


IMPORT = "digitise {given}/m.stl --units mm --out {out}"
imported = answers(IMPORT)


POCKET = box((0.0, 0.0, -16.0), (60.0, 40.0, 0.0)) - box((24.0, 16.0, -8.0), (36.0, 24.0, 1.0))
SIDE_ARM = box((60.0, 22.0, -10.0), (62.0, 32.0, 1.0))
OF_A_LIBRARY = ("charset_normalizer", "unmatched data", "codec")
# fmt: off
MESHES = [
    imported("a pocket in place of a crack", mesh(lambda _: as_stl(trimesh.Trimesh(*mesh_of(POCKET), process=False))),
        "m.stl", "long", lacks=("px", "--ends", "photo", "mask", "walls were not found")),
    imported("decimal commas", mesh(lambda shape: as_stl(shape, "stl_ascii").replace(b".", b",")), "m.stl",
        "numbers have decimal commas, as in ", lacks=OF_A_LIBRARY),
    imported("so far from the origin that its crack is rough", mesh(lambda shape: as_stl(far_away(shape))), "m.stl",
        "steps of 2 mm", "origin"),
    imported("a small body beside the sample", mesh(as_stl, box((102, 0, -20), (110, 40, 0))), "m.stl",
        "2 separate bodies", "8 x 40 x 20 mm around (106, 20, -10)"),
    imported("mesh with a side arm",
        mesh(lambda _: as_stl(trimesh.Trimesh(*mesh_of(slotted(SIDE_ARM)), process=False))),
        "side arms (1, up to 12 mm long", code=0),
]
# fmt: on
CASES: list[WrongInput] = [*DRAWINGS, *MESHES]
