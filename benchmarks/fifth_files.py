"""Files of the fifth draw, made as those of ``benchmarks.reported_files``."""

import io
import struct
from pathlib import Path

import numpy as np

from benchmarks.reported_files import grey, new_drawing, painted, photo, slotted_mesh, small_trial, write_three_mf
from tests.sheet_writers import rewritten


def mask_cut_short(folder: Path) -> None:
    """A PNG of a mask that ends in the middle of its pixels."""
    from PIL import Image

    photo(folder)
    path = folder / "mask.png"
    # Without compression, so that half of the bytes are half of the rows.
    Image.fromarray(painted()).save(path, compress_level=0)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def two_orientations(folder: Path) -> None:
    """A photo that lies on its side, with one tag for it and another, upright, for its thumbnail."""
    from PIL import Image

    def directory(orientation: int, following: int) -> bytes:
        return struct.pack("<HHHIHHI", 1, 274, 3, 1, orientation, 0, following)

    tags = b"Exif\0\0II*\0" + struct.pack("<I", 8) + directory(6, 26) + directory(1, 0)
    stored = Image.fromarray(grey()).convert("RGB").transpose(Image.Transpose.ROTATE_90)
    stored.save(folder / "photo.jpg", quality=95, exif=tags)


def webp_named_png(folder: Path) -> None:
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(grey()).convert("RGB").save(content, "WEBP", lossless=True)
    (folder / "photo.png").write_bytes(content.getvalue())


def obj_of_groups_named_twice(folder: Path) -> None:
    """Faces of one block in the groups a, b and a again."""
    mesh = slotted_mesh()
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices]
    for name, share in zip("aba", np.array_split(mesh.faces + 1, 3), strict=True):
        lines += [f"g {name}", *(f"f {a} {b} {c}" for a, b, c in share)]
    (folder / "block.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")


def three_mf_of_a_component(folder: Path) -> None:
    """An object a tenth of the size, which another one has as its component, 10 times as large; that one is built."""
    transform = 'transform="10 0 0 0 10 0 0 0 10 0 0 0"'
    component = f'<component objectid="1" {transform}/>'
    further = f'<object id="2" type="model"><components>{component}</components></object>'
    write_three_mf(folder, "millimeter", '<item objectid="2"/>', further)


def stl_without_its_count(folder: Path) -> None:
    """A binary STL whose header says that it has no triangle."""
    path = folder / "block.stl"
    slotted_mesh().export(path)
    content = path.read_bytes()
    path.write_bytes(content[:80] + struct.pack("<I", 0) + content[84:])


def dxf_arc_of_no_angle(folder: Path) -> None:
    """An outline of 60 x 4 mm, and inside it an arc that begins and ends at one angle."""
    drawing, space = new_drawing()
    here = {"layer": "OUTLINE"}
    space.add_lwpolyline([(0, 0), (60, 0), (60, 4), (0, 4)], close=True, dxfattribs=here)
    space.add_arc((30, 2), 1.5, 30, 30, dxfattribs=here)
    drawing.saveas(folder / "a.dxf")


def dxf_circle_of_negative_radius(folder: Path) -> None:
    """An outline, and on another layer a circle that no program can draw."""
    drawing, space = new_drawing()
    space.add_lwpolyline([(0, 0), (60, 0), (60, 4), (0, 4)], close=True, dxfattribs={"layer": "OUTLINE"})
    space.add_circle((30, 20), -5, dxfattribs={"layer": "NOTES"})
    drawing.saveas(folder / "a.dxf")


def dxf_with_lines_behind(folder: Path) -> None:
    """Empty lines behind the end of the file."""
    drawing, space = new_drawing()
    space.add_lwpolyline([(0, 0), (60, 0)], dxfattribs={"layer": "CENTRELINE"})
    path = folder / "a.dxf"
    drawing.saveas(path)
    path.write_text(path.read_text(encoding="utf-8") + "\n\n\n", encoding="utf-8")


def sheet_with_nul_bytes(folder: Path) -> None:
    """A logger's file in which a power cut left zeros in the place of a row."""
    (folder / "a.csv").write_bytes(b"s_mm,level_mm\n5,-2.0\n" + b"\0" * 8 + b"\n15,-2.2\n20,-2.3\n")


def cells_without_places(folder: Path) -> None:
    """Rows and cells without their places, but for one that leaves a column out."""

    def word(text: str) -> str:
        return f'<c t="inlineStr"><is><t>{text}</t></is></c>'

    rows = f"<row>{word('s_mm')}{word('note')}{word('level_mm')}</row>"
    for s_mm, level_mm in ((5, -2.0), (10, -2.1), (15, -2.2)):
        rows += f'<row><c><v>{s_mm}</v></c><c r="C{1 + s_mm // 5}"><v>{level_mm}</v></c></row>'
    rewritten(folder / "a.xlsx", sheet=rows, on_load=False)


def trial_with_a_table_twice(folder: Path) -> None:
    trial = small_trial(folder)
    trial.write_text(trial.read_text(encoding="utf-8") + "\n[crack]\nmargin_mm = 15\n", encoding="utf-8")
