"""Files of the fourth draw, made as those of ``benchmarks.reported_files``."""

import shutil
from pathlib import Path

import numpy as np

from benchmarks.reported_files import (
    ENDS_ROW,
    WIDTH_PX,
    grey,
    lab,
    new_drawing,
    painted,
    photo,
    slotted_mesh,
    small_crack,
    small_trial,
)
from tests.meshes import Mesh, box, mesh_of
from tests.sheet_writers import rewritten

ARC_MM = 30 + 0.5 * np.pi * 20
"""Length of a line of 30 mm and a quarter of a circle of radius 20 mm."""


def stale_orientation(folder: Path) -> None:
    """A photo whose rows were turned upright by an editor that left the tag of 180 degrees; a mask of what it shows."""
    from PIL import Image

    tags = Image.Exif()
    tags[274] = 3
    Image.fromarray(grey()).convert("RGB").save(folder / "photo.jpg", quality=95, exif=tags.tobytes())
    Image.fromarray(painted()).save(folder / "mask.png")


def mask_as_jpeg(folder: Path) -> None:
    from PIL import Image

    photo(folder)
    Image.fromarray(painted()).save(folder / "mask.jpg", quality=60)


def mask_of_transposed_shape(folder: Path) -> None:
    """The mask's values in their order, in rows of the photo's height."""
    from PIL import Image

    photo(folder)
    Image.fromarray(painted().reshape(painted().shape[::-1])).save(folder / "mask.png")


def mask_with_an_unused_clear_grey(folder: Path) -> None:
    """A grey mask whose tRNS chunk makes the value 1 transparent, which no pixel has."""
    from PIL import Image

    photo(folder)
    Image.fromarray(painted()).save(folder / "mask.png", transparency=1)


def _write_obj(path: Path, mesh: Mesh, *parts: str) -> None:
    """Write faces in as many parts, each behind its lines."""
    vertices, faces = mesh
    lines = [f"v {x} {y} {z}" for x, y, z in vertices]
    for head, share in zip(parts, np.array_split(faces + 1, len(parts)), strict=True):
        lines += [head, *(f"f {a} {b} {c}" for a, b, c in share)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def obj_of_two_objects(folder: Path) -> None:
    """One block whose faces are in two objects, each with its material named before its own name."""
    mesh = slotted_mesh()
    parts = ("usemtl stone\no Block.001", "usemtl wall\no Block")
    _write_obj(folder / "block.obj", (mesh.vertices, mesh.faces), *parts)


def stl_of_mixed_winding(folder: Path) -> None:
    """Every sixth triangle turned inside out, as by a program that orients each by itself."""
    import trimesh

    mesh = slotted_mesh()
    faces = mesh.faces.copy()
    faces[::6] = faces[::6, ::-1]
    trimesh.Trimesh(mesh.vertices, faces, process=False).export(folder / "block.stl")


def stl_of_overlapping_bodies(folder: Path) -> None:
    """The block in two closed parts that overlap by 20 mm, not united."""
    import trimesh

    slot = box((20.0, 18.0, -10.0), (80.0, 22.0, 1.0))
    parts = [box((low, 0.0, -20.0), (high, 40.0, 0.0)) - slot for low, high in ((0.0, 60.0), (40.0, 100.0))]
    bodies = [trimesh.Trimesh(*mesh_of(part), process=False) for part in parts]
    trimesh.util.concatenate(bodies).export(folder / "block.stl")


def dxf_layer_in_small_letters(folder: Path) -> None:
    drawing, space = new_drawing()
    drawing.layers.add("Centreline")
    space.add_lwpolyline([(0, 0), (60, 0)], dxfattribs={"layer": "Centreline"})
    drawing.saveas(folder / "a.dxf")


def dxf_binary(folder: Path) -> None:
    drawing, space = new_drawing()
    space.add_lwpolyline([(0, 0), (60, 0)], dxfattribs={"layer": "CENTRELINE"})
    drawing.saveas(folder / "a.dxf", fmt="bin")


def dxf_arc_over_zero(folder: Path) -> None:
    """A line of 30 mm, and an arc from its end that begins at 315 degrees and ends at 45."""
    drawing, space = new_drawing()
    here = {"layer": "CENTRELINE"}
    end = 20 * np.sqrt(0.5)
    space.add_line((end - 30, -end), (end, -end), dxfattribs=here)
    space.add_arc((0, 0), 20, 315, 45, dxfattribs=here)
    drawing.saveas(folder / "a.dxf")


def dxf_circle_of_no_radius(folder: Path) -> None:
    drawing, space = new_drawing()
    here = {"layer": "OUTLINE"}
    space.add_lwpolyline([(0, 0), (60, 0), (60, 4), (0, 4)], close=True, dxfattribs=here)
    space.add_circle((30, 2), 0, dxfattribs=here)
    drawing.saveas(folder / "a.dxf")


def cells_out_of_order(folder: Path) -> None:
    """Rows whose second cell stands first in the file, each with its place."""

    def word(place: str, text: str) -> str:
        return f'<c r="{place}" t="inlineStr"><is><t>{text}</t></is></c>'

    rows = f'<row r="1">{word("B1", "level_mm")}{word("A1", "s_mm")}</row>'
    for number, (s_mm, level_mm) in enumerate(((5, -2.0), (10, -2.1), (15, -2.2)), start=2):
        rows += f'<row r="{number}"><c r="B{number}"><v>{level_mm}</v></c><c r="A{number}"><v>{s_mm}</v></c></row>'
    rewritten(folder / "a.xlsx", sheet=rows, on_load=False)


def merged_stations(folder: Path) -> None:
    """Three readings at each of two stations, whose cell is merged over their rows."""
    import openpyxl

    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    for row in (("s_mm", "level_mm"), (5, -2.0), (None, -2.1), (None, -2.2), (10, -2.3), (None, -2.4), (None, -2.5)):
        sheet.append(row)
    sheet.merge_cells("A2:A4")
    sheet.merge_cells("A5:A7")
    book.save(folder / "a.xlsx")


def trial_with_a_key_elsewhere(folder: Path) -> None:
    """A setting of the photo behind the head of the next table."""
    trial = small_trial(folder)
    told = trial.read_text(encoding="utf-8").replace("mm_per_px = 0.1\n", "")
    trial.write_text(told.replace("[crack]\n", "[crack]\nmm_per_px = 0.1\n"), encoding="utf-8")


def photos_of_one_name(folder: Path) -> None:
    """Two photos of one name in two folders, their cracks 20 and 30 px wide."""
    for name, width_px in (("first", WIDTH_PX), ("second", 30)):
        (folder / name).mkdir()
        photo(folder / name, width_px=width_px)


def twins_by_case(folder: Path) -> None:
    """Two photos whose names differ in large and small letters alone."""
    lab(folder, {"P01_notes.csv": f"depth,8 mm\n{ENDS_ROW}"})
    small_crack(folder / "other.png", seed=5)
    shutil.move(folder / "other.png", folder / "p01.PNG")
