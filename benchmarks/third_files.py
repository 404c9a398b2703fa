"""Files of the third draw, made as those of ``benchmarks.reported_files``."""

import csv
import json
import struct
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
    sealtwin,
    slotted_mesh,
    small_trial,
    text,
    write_three_mf,
)
from tests.lab_folder import S_MM, levels_mm
from tests.pictures import mortar, with_crack, write_png


def fax(folder: Path) -> None:
    """A scan of 254 dots per inch across and 127 down: its rows are twice as far apart as its columns."""
    from PIL import Image

    upright = Image.fromarray(grey())
    squashed = upright.resize((upright.width, upright.height // 2), Image.Resampling.BOX)
    squashed.save(folder / "photo.tif", resolution_unit=2, x_resolution=254.0, y_resolution=127.0)


def jpeg_cut_short(folder: Path) -> None:
    """A crack from top to bottom, in a JPEG of which the last 45 % of the bytes are missing."""
    from PIL import Image

    light = with_crack(mortar((300, 500)), [(150, 40), (140, 250), (160, 460)], WIDTH_PX)
    values = np.rint(255 * np.clip(light, 0, 1) ** (1 / 2.2)).astype(np.uint8)
    path = folder / "photo.jpg"
    Image.fromarray(values).convert("RGB").save(path, quality=92)
    content = path.read_bytes()
    path.write_bytes(content[: int(0.55 * len(content))])


def mask_of_probabilities(folder: Path) -> None:
    """A mask in a TIFF of 32-bit floats from 0 to 1, as segmentations are exported."""
    from PIL import Image

    photo(folder)
    Image.fromarray((painted() / 255).astype(np.float32), mode="F").save(folder / "mask.tif")


def square_photo(folder: Path) -> None:
    """200 x 200 px, its crack from (40, 101) to (160, 98): with row and column swapped, the ends lie on the ground."""
    crack_px = [(40, 101), (80, 97), (120, 103), (160, 98)]
    write_png(folder / "crack.png", with_crack(mortar((200, 200)), crack_px, WIDTH_PX))


def three_mf_scaled_by_its_build(folder: Path) -> None:
    """A 3MF in millimetres whose object is a tenth of the size, and whose build item has a transform of 10."""
    write_three_mf(folder, "millimeter", '<item objectid="1" transform="10 0 0 0 10 0 0 0 10 0 0 0"/>')


def glb_quantized(folder: Path) -> None:
    """Positions as normalised 16-bit integers, 1 for 65535, under a node that scales them to 0.1 m."""
    mesh = slotted_mesh()
    x, y, z = mesh.vertices.T / 1000
    standing = np.column_stack([x, z, -y])
    low, reach_m = standing.min(axis=0), 0.1
    stored = np.rint((standing - low) / reach_m * 65535).astype("<u2")
    # Rows of positions are padded to 8 bytes, as the format asks.
    padded = np.column_stack([stored, np.zeros(len(stored), dtype="<u2")])
    indices = mesh.faces.astype("<u2").tobytes()
    content = padded.tobytes() + indices + b"\0" * (-len(indices) % 4)
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": padded.nbytes, "byteStride": 8, "target": 34962},
        {"buffer": 0, "byteOffset": padded.nbytes, "byteLength": len(indices), "target": 34963},
    ]
    positions = {"bufferView": 0, "componentType": 5123, "normalized": True, "count": len(stored), "type": "VEC3"}
    positions |= {"min": stored.min(axis=0).tolist(), "max": stored.max(axis=0).tolist()}
    corners = {"bufferView": 1, "componentType": 5123, "count": mesh.faces.size, "type": "SCALAR"}
    tree = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_mesh_quantization"],
        "extensionsRequired": ["KHR_mesh_quantization"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "scale": [reach_m] * 3, "translation": low.tolist()}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [positions, corners],
        "bufferViews": views,
        "buffers": [{"byteLength": len(content)}],
    }
    described = json.dumps(tree).encode()
    described += b" " * (-len(described) % 4)
    total = 12 + 8 + len(described) + 8 + len(content)
    parts = struct.pack("<4sII", b"glTF", 2, total), struct.pack("<I4s", len(described), b"JSON"), described
    (folder / "block.glb").write_bytes(b"".join([*parts, struct.pack("<I4s", len(content), b"BIN\0"), content]))


def dxf_array(folder: Path) -> None:
    """A line of 20 mm in a block that is inserted as an array of three columns, 20 mm apart."""
    drawing, space = new_drawing()
    here = {"layer": "CENTRELINE"}
    drawing.blocks.new("PIECE").add_line((0, 0), (20, 0), dxfattribs=here)
    columns = {"column_count": 3, "column_spacing": 20.0}
    space.add_blockref("PIECE", (0, 0), dxfattribs=here | columns)
    drawing.saveas(folder / "a.dxf")


def dxf_of_lines(path: Path, version: str = "R2010") -> None:
    """A line from 0.5 to 60.5 mm, in six pieces."""
    drawing, space = new_drawing(version)
    for start in range(0, 60, 10):
        space.add_line((start + 0.5, 2.25), (start + 10.5, 2.25), dxfattribs={"layer": "CENTRELINE"})
    drawing.saveas(path)


COORDINATES = tuple(f"{code:>3}" for code in range(10, 40))
"""Group codes of a DXF whose values are coordinates."""


def dxf_of_commas(folder: Path) -> None:
    """Coordinates with decimal commas, as a program in German wrote them."""
    path = folder / "a.dxf"
    dxf_of_lines(path, "R12")
    lines = path.read_text(encoding="utf-8").splitlines()
    for number in range(0, len(lines) - 1, 2):
        if lines[number] in COORDINATES:
            lines[number + 1] = lines[number + 1].replace(".", ",")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def dxf_cut_short(folder: Path) -> None:
    """The same line in a file that ends behind the third piece: no end of section, and none of the file."""
    path = folder / "a.dxf"
    dxf_of_lines(path, "R12")
    before, _, _ = path.read_text(encoding="utf-8").rpartition("  0\nENDSEC\n  0\nEOF")
    *kept, _, _, _ = before.split("  0\nLINE\n")
    path.write_text("  0\nLINE\n".join(kept), encoding="utf-8")


def dxf_wide_line(folder: Path) -> None:
    """A polyline drawn 4 mm wide."""
    drawing, space = new_drawing()
    space.add_lwpolyline([(0, 0), (60, 0)], dxfattribs={"layer": "CENTRELINE", "const_width": 4.0})
    drawing.saveas(folder / "a.dxf")


def hidden_first_sheet(folder: Path) -> None:
    """A hidden worksheet of a former measurement in front of the visible one."""
    import openpyxl

    book = openpyxl.Workbook()
    former, current = book.worksheets[0], book.create_sheet("today")
    for sheet, levels in ((former, (-5.0, -5.1, -5.2)), (current, (-2.0, -2.1, -2.2))):
        sheet.append(["s_mm", "level_mm"])
        for s_mm, level_mm in zip((5, 10, 15), levels, strict=True):
            sheet.append([s_mm, level_mm])
    former.title, former.sheet_state, book.active = "former", "hidden", 1
    book.save(folder / "a.xlsx")


def struck_out(folder: Path) -> None:
    """A workbook of readings of which one, at a station of its own, was struck out."""
    import openpyxl
    from openpyxl.styles import Font

    lab(folder, {"P01_notes.csv": f"depth,8 mm\n{ENDS_ROW}"})
    (folder / "P01.csv").unlink()
    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    sheet.append(["s_mm", "level_mm"])
    for s_mm, levels in zip(S_MM, levels_mm("P01"), strict=True):
        sheet.append([s_mm, float(levels[0])])
        if s_mm == 5:
            sheet.append([6.0, -2.45])
            for cell in sheet[sheet.max_row]:
                cell.font = Font(strike=True)
    book.save(folder / "P01.xlsx")


def trial_with_true(folder: Path) -> None:
    trial = small_trial(folder)
    told = trial.read_text(encoding="utf-8")
    trial.write_text(told.replace("speed_mm_s = 20\n", "speed_mm_s = true\n"), encoding="utf-8")


def path_of_swapped_times(folder: Path) -> None:
    """The path of a digitised crack as a planned one, in which two rows stand in each other's place."""
    trial = small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out before")
    names = ["t_s", "x_mm", "y_mm", "z_mm", "flow_mm3_s"]
    with (folder / "before" / "trajectory.csv").open(encoding="utf-8", newline="") as file:
        rows = [",".join(row[name] for name in names) for row in csv.DictReader(file)]
    half = len(rows) // 2
    rows[half], rows[half + 1] = rows[half + 1], rows[half]
    text("plan.csv", ",".join(names), *rows)(folder)
    told = trial.read_text(encoding="utf-8")
    path = "volume_ml = 0.08\nspeed_mm_s = 20\ntrim_mm = 1\n"
    trial.write_text(told.replace(path, 'plan = "plan.csv"\n'), encoding="utf-8")
