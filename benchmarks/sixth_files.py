"""Files of the sixth draw, made as those of ``benchmarks.reported_files``."""

import csv
from pathlib import Path

import numpy as np

from benchmarks.reported_files import (
    grey,
    new_drawing,
    obj_of_polygons,
    painted,
    photo,
    sealtwin,
    slotted_mesh,
    small_crack,
    small_trial,
    text,
)
from tests.pictures import mortar, with_crack, write_png


def _srgb() -> bytes:
    from PIL import ImageCms

    return ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()


def white_zero_with_profile(folder: Path) -> None:
    """A grey TIFF whose 0 is white, with a profile of colours that is not its own."""
    import tifffile

    tifffile.imwrite(folder / "photo.tif", 255 - grey(), photometric="miniswhite", iccprofile=_srgb())


def grey_with_colour_profile(folder: Path) -> None:
    """A grey JPEG that kept the profile of the colours it had."""
    from PIL import Image

    Image.fromarray(grey()).save(folder / "photo.jpg", quality=95, icc_profile=_srgb())


def mask_with_a_speck(folder: Path) -> None:
    """A mask with one more pixel, far from the crack."""
    from PIL import Image

    photo(folder)
    mask = painted()
    mask[280, 20] = 255
    Image.fromarray(mask).save(folder / "mask.png")


def ply_of_polygons(folder: Path) -> None:
    """The block of polygons that the OBJ has, in a PLY with a normal and a place in a picture at each corner."""
    obj_of_polygons(folder)
    lines = [line.split() for line in (folder / "block.obj").read_text(encoding="utf-8").splitlines()]
    (folder / "block.obj").unlink()
    corners = [line[1:] for line in lines if line[0] == "v"]
    faces = [[str(int(corner) - 1) for corner in line[1:]] for line in lines if line[0] == "f"]
    head = ["ply", "format ascii 1.0", f"element vertex {len(corners)}"]
    head += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "s", "t")]
    head += [f"element face {len(faces)}", "property list uchar uint vertex_indices", "end_header"]
    rows = [" ".join([*corner, "0 0 1 0.5 0.5"]) for corner in corners]
    rows += [" ".join([str(len(face)), *face]) for face in faces]
    (folder / "block.ply").write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")


def off_with_remarks(folder: Path) -> None:
    """Remarks and empty lines between the parts of the file."""
    mesh = slotted_mesh()
    lines = ["OFF", "# a slotted block", f"{len(mesh.vertices)} {len(mesh.faces)} 0", "", "# corners"]
    lines += [f"{x} {y} {z}" for x, y, z in mesh.vertices]
    lines += ["", "# triangles", *(f"3 {a} {b} {c}" for a, b, c in mesh.faces)]
    (folder / "block.off").write_text("\n".join(lines) + "\n", encoding="utf-8")


def off_of_one_head(folder: Path) -> None:
    """The counts directly behind the first word, as in a public collection of shapes."""
    mesh = slotted_mesh()
    lines = [f"OFF{len(mesh.vertices)} {len(mesh.faces)} 0", *(f"{x} {y} {z}" for x, y, z in mesh.vertices)]
    lines += [f"3 {a} {b} {c}" for a, b, c in mesh.faces]
    (folder / "block.off").write_text("\n".join(lines) + "\n", encoding="utf-8")


def dxf_arc_that_closes(folder: Path) -> None:
    """60 x 4 mm with half a circle at the near end: the bulge of the last corner, to the first."""
    drawing, space = new_drawing()
    corners = [(0, 0, 0), (60, 0, 0), (60, 4, 0), (0, 4, 1)]
    space.add_lwpolyline(corners, format="xyb", close=True, dxfattribs={"layer": "OUTLINE"})
    drawing.saveas(folder / "a.dxf")


def dxf_scaled_block(folder: Path) -> None:
    """A line of 6 mm in a block that is inserted ten times as large."""
    drawing, space = new_drawing()
    here = {"layer": "CENTRELINE"}
    drawing.blocks.new("PIECE").add_line((0, 0), (6, 0), dxfattribs=here)
    space.add_blockref("PIECE", (0, 0), dxfattribs=here | {"xscale": 10, "yscale": 10})
    drawing.saveas(folder / "a.dxf")


def dxf_ring_not_marked(folder: Path) -> None:
    """An outline that ends where it begins, and is not marked as closed."""
    drawing, space = new_drawing()
    corners = [(0, 0), (60, 0), (60, 4), (0, 4), (0, 0)]
    space.add_lwpolyline(corners, dxfattribs={"layer": "OUTLINE"})
    drawing.saveas(folder / "a.dxf")


def dxf_corner_twice(folder: Path) -> None:
    drawing, space = new_drawing()
    space.add_lwpolyline([(0, 0), (30, 0), (30, 0), (60, 0)], dxfattribs={"layer": "CENTRELINE"})
    drawing.saveas(folder / "a.dxf")


def numbers_behind_apostrophes(folder: Path) -> None:
    """Numbers that were typed as texts, each behind an apostrophe, which is a mark of its cell."""
    import openpyxl
    from openpyxl.styles import Alignment

    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    for row in (("s_mm", "level_mm"), ("5", "-2.0"), ("10", "-2.1"), ("15", "-2.2")):
        sheet.append(row)
    for cell in (cell for cells in sheet["A2:B4"] for cell in cells):
        cell.alignment = Alignment(horizontal="left")
        cell.quotePrefix = True
    book.save(folder / "a.xlsx")


def trial_in_a_folder(folder: Path) -> None:
    """A trial beside its photo, and another photo of that name where the command runs: its crack is 30 px wide."""
    (folder / "sub").mkdir()
    small_trial(folder / "sub")
    crack_px = [(40, 101), (80, 97), (120, 103), (160, 98)]
    write_png(folder / "crack.png", with_crack(mortar((200, 200)), crack_px, 30))


def path_cut_short(folder: Path) -> None:
    """A digitised run whose path was cut in the middle of a row, as by a full disk."""
    small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out run")
    path = folder / "run" / "trajectory.csv"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def path_of_near_twins(folder: Path) -> None:
    """The path of a digitised crack as a planned one, with a row a millionth of a second and a nanometre behind one."""
    trial = small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out before")
    names = ["t_s", "x_mm", "y_mm", "z_mm", "flow_mm3_s"]
    with (folder / "before" / "trajectory.csv").open(encoding="utf-8", newline="") as file:
        rows = [[float(row[name]) for name in names] for row in csv.DictReader(file)]
    half = len(rows) // 2
    rows.insert(half + 1, list(np.add(rows[half], [1e-6, 1e-6, 0, 0, 0])))
    text("plan.csv", ",".join(names), *(",".join(f"{cell:.9f}" for cell in row) for row in rows))(folder)
    told = trial.read_text(encoding="utf-8")
    path = "volume_ml = 0.08\nspeed_mm_s = 20\ntrim_mm = 1\n"
    trial.write_text(told.replace(path, 'plan = "plan.csv"\n'), encoding="utf-8")


def square_photo(folder: Path) -> None:
    small_crack(folder / "crack.png")
