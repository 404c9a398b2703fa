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

RING = ((0.0, 0.0), (40.0, 0.0), (40.0, 3.0), (0.0, 3.0))


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


def ring(space: Any, layer: str = "OUTLINE", at: tuple[float, float] = (0.0, 0.0), **attributes: object) -> None:
    corners = [(x + at[0], y + at[1]) for x, y in RING]
    space.add_lwpolyline(corners, close=True, dxfattribs=on(layer, **attributes))


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
    ring(space)
    ring(space, at=(0, 10), invisible=1)
    ring(space)
    space.add_text("a crack", dxfattribs=on("OUTLINE"))
    space.add_point((1, 1), dxfattribs=on("OUTLINE"))


DRAWN = "import-dxf {given}/a.dxf --depth-mm 8 --out {out}"
ALONG = " --line L --width-mm 3"
OF_A_MESH = ("mesh.up", "drawing.stl", "Mesh", "Trace it again", "R2010", "px")
ROW = {"more", "code", "lacks"}


def drawn(name: str, draw: Draw, *names: str, **others: Any) -> WrongInput:
    """Return a row for a drawing; ``others`` are fields of the row, and unit and header of the drawing."""
    row = {key: others.pop(key) for key in ROW & others.keys()}
    return answers(DRAWN)(name, drawing(draw, **others), *names, **row)


# fmt: off
DRAWINGS = [
    drawn("frame of a spline-fit line", framed, "the drawn line is 41.2 mm long", more=ALONG, code=0),
    drawn("stone off the crack",
        lambda _, space: (ring(space), space.add_circle((20, 20), 1, dxfattribs=on("ISLANDS"))), "a.dxf",
        "(20, 20) is not inside"),
    drawn("round sample", lambda _, space: (ring(space), space.add_circle((20, 1.5), 60, dxfattribs=on("FACE"))),
        "a.dxf", "layer FACE", "Expected is one rectangle", lacks=OF_A_MESH),
    drawn("no crack but a square", lambda _, space: space.add_circle((5, 5), 6, dxfattribs=on("OUTLINE")), "a.dxf",
        "mm wide", "--units", lacks=OF_A_MESH),
    drawn("far line", lambda _, space: lines(space, ((0, 0), (9e9, 0))), "layer L: its LINE #", more=ALONG),
    drawn("drawn in mm, said to be in inches", lambda _, space: ring(space, at=(0, 0)),
        "unit of the drawing: mm (by --units; the drawing states inch)", "40 x 3 mm", more=" --units mm",
        unit=units.IN, code=0),
    drawn("too large in the drawing's unit", lambda _, space: ring(space), "The unit is inch, by the drawing",
        "1000 mm", "--units mm", unit=units.IN, MEASUREMENT=1, lacks=OF_A_MESH),
    drawn("gaps of some µm", lambda _, space: lines(space, ((0, 0), (20, 0)), ((20.004, 0), (40, 0))),
        "a.dxf, layer L", "gap is 0.004 mm at (20", more=ALONG),
    drawn("line with an arm", lambda _, space: lines(space, ((0, 0), (20, 0)), ((20, 0), (40, 0)), ((20, 0), (30, 9))),
        "3 lines meet at (20, 0)", more=ALONG),
    drawn("texts, a hidden and a second edge", beside_lines,
        "layer OUTLINE: these parts were left out: exact copies of lines (1), invisible lines (1), TEXT (1), POINT (1)",
        code=0),
    drawn("drawn upright", lambda _, space: lines(space, ((0, 0, 0), (20, 0, 6)), ((20, 0, 6), (40, 0, 0))), "layer L",
        "z is 0 to 6 mm", "XY plane", more=ALONG),
    drawn("edge that crosses itself evenly",
        lambda _, space: space.add_lwpolyline(RING[::2] + RING[1::2], close=True, dxfattribs=on("OUTLINE")),
        "a.dxf", "(20.0, 1.5)", "crosses itself", lacks=OF_A_MESH),
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


def line_beside(text: str) -> Callable[[Path], object]:
    def write(folder: Path) -> None:
        mesh(as_stl)(folder)
        (folder / "line.csv").write_text(text)

    return write


IMPORT = "import-mesh {given}/m.stl --units mm --out {out}"
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
    imported("decimal commas in a path", line_beside("x_mm;y_mm\n20,5;20,0\n79,5;20,0\n"), "line.csv",
        "row 1", "x_mm;y_mm", "separated by commas", "decimal points", more=" --set mesh.path={given}/line.csv"),
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
