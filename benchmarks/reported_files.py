"""Files of the forms that public reports describe, each made in a folder by code: no foreign content is in them."""

import json
import os
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.lab_folder import DEFAULTS, ENDS, S_MM, levels_mm
from tests.pictures import mortar, with_crack, write_png
from tests.sheet_writers import Hand, write_sheet
from tests.studies import TRIAL

Maker = Callable[[Path], object]
"""Makes the files of a report in a folder."""
CRACK_PX = [(40, 150), (250, 140), (460, 160)]
CRACK_MM = 44.12
"""Length of that crack at 0.1 mm per pixel, with its round ends."""
WIDTH_PX = 20
LONG_SLOT_MM3 = 60.0 * 4.0 * 10.0


def photo(folder: Path, name: str = "photo.png", width_px: int = WIDTH_PX) -> Path:
    return write_png(folder / name, with_crack(mortar(), CRACK_PX, width_px))


def grey(width_px: int = WIDTH_PX) -> np.ndarray:
    light = with_crack(mortar(), CRACK_PX, width_px)
    return np.rint(255 * np.clip(light, 0, 1) ** (1 / 2.2)).astype(np.uint8)


def painted() -> np.ndarray:
    """Return the mask of that crack, 255 on 0."""
    import cv2

    mask = np.zeros((300, 500), dtype=np.uint8)
    cv2.polylines(mask, [np.array(CRACK_PX, dtype=np.int32)], False, 255, WIDTH_PX)
    return mask


def mask_enlarged(folder: Path) -> None:
    """A mask of a quarter of the size, enlarged by bilinear interpolation: values between 0 and 255."""
    import cv2

    photo(folder)
    small = (cv2.resize(painted(), (125, 75), interpolation=cv2.INTER_AREA) > 127).astype(np.uint8) * 255
    cv2.imwrite(str(folder / "mask.png"), cv2.resize(small, (500, 300), interpolation=cv2.INTER_LINEAR))


def mask_inverted(folder: Path) -> None:
    import cv2

    photo(folder)
    cv2.imwrite(str(folder / "mask.png"), 255 - painted())


def mask_of_16_bits(folder: Path) -> None:
    import cv2

    photo(folder)
    cv2.imwrite(str(folder / "mask.png"), painted().astype(np.uint16) * 257)


def two_pages(folder: Path) -> None:
    """Two photos in one TIFF: a crack half as wide on the first page."""
    from PIL import Image

    first, second = Image.fromarray(grey(WIDTH_PX // 2)), Image.fromarray(grey())
    first.save(folder / "photo.tif", save_all=True, append_images=[second])


def turned_tiff(folder: Path) -> None:
    """A TIFF whose rows are stored turned, and whose tag 274 says so, as scanners write it."""
    from PIL import Image

    upright = Image.fromarray(grey())
    upright.transpose(Image.Transpose.ROTATE_90).save(folder / "photo.tif", tiffinfo={274: 6})


def new_drawing(version: str = "R2010", encoding: str = "utf8") -> tuple[Any, Any]:
    from ezdxf.filemanagement import new

    drawing = new(version)
    drawing.encoding = encoding
    drawing.header["$INSUNITS"] = 4
    return drawing, drawing.modelspace()


def dxf_reversed_ellipse(folder: Path) -> None:
    """A line of 30 mm, and a quarter of an ellipse from its end whose normal points away from the viewer."""
    drawing, space = new_drawing()
    here = {"layer": "CENTRELINE"}
    space.add_line((0, 0), (30, 0), dxfattribs=here)
    # With the normal -z the parameter runs clockwise: from (50, 10) to (30, 0).
    below = {**here, "extrusion": (0, 0, -1)}
    space.add_ellipse((30, 10), (20, 0, 0), 0.5, 0, np.pi / 2, dxfattribs=below)
    drawing.saveas(folder / "a.dxf")


QUARTER_ELLIPSE_MM = 24.22
"""Of half axes 20 and 10 mm."""


def dxf_codepage(folder: Path) -> None:
    """R2000 in cp1252, a layer with an accent."""
    drawing, space = new_drawing("R2000", "cp1252")
    drawing.layers.add("Repère")
    space.add_lwpolyline([(0, 0), (60, 0)], dxfattribs={"layer": "Repère"})
    drawing.saveas(folder / "a.dxf")


WEIGHT = 5.0


def dxf_rational_spline(folder: Path) -> None:
    drawing, space = new_drawing()
    points = [(30, 0, 0), (30, 30, 0), (0, 30, 0)]
    space.add_rational_spline(
        points, [1, WEIGHT, 1], degree=2, knots=[0, 0, 0, 1, 1, 1], dxfattribs={"layer": "CENTRELINE"}
    )
    drawing.saveas(folder / "a.dxf")


def conic_mm(weight: float = WEIGHT) -> float:
    """Length of that spline. Without its weights it would be 48.7 mm."""
    t = np.linspace(0, 1, 20_001)[:, None]
    basis = np.hstack([(1 - t) ** 2, 2 * t * (1 - t) * weight, t**2])
    line = basis @ np.array([(30.0, 0.0), (30.0, 30.0), (0.0, 30.0)]) / basis.sum(axis=1)[:, None]
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


RING = [(float(x), -2.0) for x in range(0, 70, 10)] + [(float(x), 2.0) for x in range(60, -10, -10)] + [(0.0, -2.0)]
RING_KNOTS = [0.0] * 3 + [float(knot) for knot in range(len(RING) - 2)] + [float(len(RING) - 3)] * 3


def dxf_periodic_spline(folder: Path) -> None:
    """A closed cubic that is marked periodic and has no weights; it ends at its first control point."""
    drawing, space = new_drawing()
    spline = space.add_open_spline([(x, y, 0.0) for x, y in RING], 3, RING_KNOTS, dxfattribs={"layer": "OUTLINE"})
    spline.dxf.flags = 11
    drawing.saveas(folder / "a.dxf")


def ring_mm2() -> float:
    """Area within that spline, without the code that reads drawings."""
    from scipy.interpolate import BSpline

    x, y = BSpline(RING_KNOTS, np.array(RING), 3)(np.linspace(0, RING_KNOTS[-1], 5000)).T
    return float(abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2)


def dxf_with_dimensions(folder: Path) -> None:
    """An outline of 60 x 4 mm, and on the same layer its dimension, a text and a leader's point."""
    drawing, space = new_drawing()
    here = {"layer": "OUTLINE"}
    space.add_lwpolyline([(0, 0), (60, 0), (60, 4), (0, 4)], close=True, dxfattribs=here)
    space.add_linear_dim(base=(0, 12), p1=(0, 4), p2=(60, 4), dxfattribs=here).render()
    space.add_text("Riss 4", dxfattribs=here | {"insert": (10, 20)})
    space.add_point((0, 0), dxfattribs=here)
    drawing.saveas(folder / "a.dxf")


def obj_of_polygons(folder: Path) -> None:
    """A block of 100 x 40 x 20 mm in polygons as modellers write it; a slot of 60 x 4 x 10 mm, open at one end.

    Its top and one side are concave: a fan from the first corner covers the slot.
    """
    top = [(0, 0), (100, 0), (100, 18), (40, 18), (40, 22), (100, 22), (100, 40), (0, 40)]
    corners = [(*point, 0) for point in top] + [(*top[i], -20) for i in (0, 1, 6, 7)]
    corners += [(*top[i], -10) for i in (2, 3, 4, 5)]
    a, b, c, d, e, f, g, h, a0, b0, g0, h0, cs, ds, es, fs = range(1, 17)
    faces = [
        (a, b, c, d, e, f, g, h),
        (b, a, a0, b0),
        (a, h, h0, a0),
        (h, g, g0, h0),
        (c, b, b0, g0, g, f, fs, cs),
        (d, c, cs, ds),
        (e, d, ds, es),
        (f, e, es, fs),
        (ds, cs, fs, es),
        (a0, h0, g0, b0),
    ]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {' '.join(map(str, face))}" for face in faces]
    (folder / "block.obj").write_text("\n".join(lines) + "\n")


def slotted_mesh() -> Any:
    import trimesh

    from tests.meshes import mesh_of, slotted

    vertices, faces = mesh_of(slotted())
    return trimesh.Trimesh(vertices, faces, process=False)


def glb_mirrored(folder: Path) -> None:
    """A node scaled by -1 along x, as Blender's mirrored copies are."""
    import trimesh

    scene = trimesh.Scene()
    scene.add_geometry(slotted_mesh(), transform=np.diag([-1.0, 1.0, 1.0, 1.0]))
    scene.export(folder / "block.glb")


def glb_y_up(folder: Path) -> None:
    """Metres and y upward, as the format has it and exporters convert to."""
    mesh = slotted_mesh()
    x, y, z = mesh.vertices.T / 1000
    mesh.vertices = np.column_stack([x, z, -y])
    mesh.export(folder / "block.glb")


def three_mf_in_cm(folder: Path) -> None:
    """A 3MF that states centimetres, its block 10 x 4 x 2 of them."""
    write_three_mf(folder, "centimeter", '<item objectid="1"/>')


def write_three_mf(folder: Path, unit: str, build: str, further: str = "") -> None:
    """Write block.3mf: the slotted block as object 1, with a tenth of its mm as numbers, and ``further`` objects."""
    mesh = slotted_mesh()
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in mesh.vertices / 10)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces)
    head = '<?xml version="1.0" encoding="UTF-8"?>'
    model = (
        f'{head}<model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        f'<object id="1" type="model"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>'
        f"</object>{further}</resources><build>{build}</build></model>"
    )
    of_package = "http://schemas.openxmlformats.org/package/2006"
    kinds = (
        f'{head}<Types xmlns="{of_package}/content-types"><Default Extension="rels" ContentType="application/vnd.'
        'openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.'
        '3dmanufacturing-3dmodel+xml"/></Types>'
    )
    links = (
        f'{head}<Relationships xmlns="{of_package}/relationships"><Relationship Target="/3D/3dmodel.model" Id="r0" '
        'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
    )
    with zipfile.ZipFile(folder / "block.3mf", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", kinds)
        archive.writestr("_rels/.rels", links)
        archive.writestr("3D/3dmodel.model", model)


def ply_cut_short(folder: Path) -> None:
    """A binary PLY that ends three faces before its header's count."""
    mesh = slotted_mesh()
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {len(mesh.faces)}\nproperty list uchar int vertex_indices\n"
        "end_header\n"
    )
    points = mesh.vertices.astype("<f4").tobytes()
    faces = b"".join(struct.pack("<Biii", 3, *face) for face in mesh.faces[:-3])
    (folder / "block.ply").write_bytes(header.encode() + points + faces)


def text(name: str, *lines: str) -> Maker:
    """Return a function that writes a file of lines."""

    def make(folder: Path) -> None:
        (folder / name).write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")

    return make


def percent_cells(folder: Path) -> None:
    """Depths typed into cells with the format 0.00%: the workbook has 0.0199 where the screen shows 1.99%."""
    import openpyxl

    lab(folder, {"P01_notes.csv": f"depth,8 mm\n{ENDS_ROW}"})
    (folder / "P01.csv").unlink()
    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    sheet.append(["s_mm", "level_mm"])
    for s_mm, levels in zip(S_MM, levels_mm("P01"), strict=True):
        sheet.append([s_mm, float(levels[0]) / 100])
        sheet.cell(sheet.max_row, 2).number_format = "0.00%"
    book.save(folder / "P01.xlsx")


ENDS_ROW = "ends,40 101 160 98\n"


def lab(folder: Path, notes: Mapping[str, str], samples: Sequence[str] = ("P01",), defaults: str = DEFAULTS) -> None:
    for sample in samples:
        small_crack(folder / f"{sample}.png", int(sample[1:]))
        write_sheet(folder / f"{sample}.csv", Hand(), S_MM, levels_mm(sample))
    for name, content in notes.items():
        (folder / name).write_text(content, encoding="utf-8")
    (folder / "lab.toml").write_text(defaults, encoding="utf-8")


def small_crack(path: Path, seed: int = 1) -> None:
    """12 mm long and 2 mm wide at 0.1 mm per pixel."""
    crack_px = [(40, 101), (80, 97), (120, 103), (160, 98)]
    write_png(path, with_crack(mortar((200, 200), seed=seed), crack_px, 20))


def noted(depth: str) -> Maker:
    """Return a function that makes a sound sample, but for the words of its depth."""
    return lambda folder: lab(folder, {"P01_notes.csv": f"depth,{depth}\n{ENDS_ROW}"})


def greek_mu(folder: Path) -> None:
    """The scale in micrometres by the Greek letter, U+03BC; the folder's own is another."""
    note = f"depth,8 mm\nscale,100 \u03bcm/px\n{ENDS_ROW}"
    lab(folder, {"P01_notes.csv": note}, defaults=DEFAULTS.replace("mm_per_px = 0.1", "mm_per_px = 0.2"))


def one_note_of_two(folder: Path) -> None:
    """One sheet of words for two samples, one below the other; the ends of each are in its own note."""
    ends = f"photo.ends_px = {ENDS}\n"
    notes = {"P01_ends.toml": ends, "P02_ends.toml": ends}
    notes["notes.csv"] = "sample,P01\ndepth,8 mm\nsample,P02\ndepth,12 mm\n"
    lab(folder, notes, ("P01", "P02"))


def dangling_link(folder: Path) -> None:
    lab(folder, {"P01_notes.csv": f"depth,8 mm\n{ENDS_ROW}"})
    (folder / "P02.png").symlink_to("/nowhere/P02.png")


def small_trial(folder: Path) -> Path:
    small_crack(folder / "crack.png")
    trial = folder / "trial.toml"
    trial.write_text(TRIAL.split("[readings]")[0], encoding="utf-8")
    return trial


def sealtwin(folder: Path, command: str) -> None:
    words = [sys.executable, "-m", "sealtwin", *command.split()]
    subprocess.run(words, cwd=folder, check=True, capture_output=True)


def trial_by_notepad(folder: Path) -> None:
    """UTF-8 with a byte order mark, and CRLF."""
    trial = small_trial(folder)
    lines = trial.read_text(encoding="utf-8").replace("\n", "\r\n")
    trial.write_bytes(b"\xef\xbb\xbf" + lines.encode())


def manifest_emptied(folder: Path) -> None:
    """A run folder whose manifest has no bytes, as a power cut leaves a file that was just written."""
    small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out run")
    os.truncate(folder / "run" / "manifest.json", 0)


def lock_of_another(folder: Path) -> None:
    """A lock file that a killed process left, with a number that another process has now."""
    small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out run")
    lock = folder / "run" / ".lock"
    lock.unlink(missing_ok=True)
    lock.write_text(f"{os.getpid()}\n")


def photo_replaced_in_its_time(folder: Path) -> None:
    """A digitised photo, then another of the same name, size in bytes and time of change: a crack of 30 px."""
    from PIL import Image

    path = folder / "photo.tif"
    Image.fromarray(grey()).save(path)
    sealtwin(folder, "digitise photo.tif --depth-mm 10 --mm-per-px 0.1 --ends 40,150 460,160 --out run")
    before = path.stat()
    Image.fromarray(grey(30)).save(path)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    if path.stat().st_size != before.st_size:
        raise ValueError("the photos differ in size")


def flow_curve(*rows: str, header: str = "shear_rate_per_s,stress_pa") -> Maker:
    return text("curve.csv", header, *rows)


RATES = (1, 2, 5, 10, 20, 30, 40, 50, 60, 80, 100)
UP_AND_DOWN = [f"{rate},{20 + 2 * rate:g}" for rate in RATES]
UP_AND_DOWN += [f"{rate},{10 + 1.5 * rate:g}" for rate in reversed(RATES)]
"""A thixotropic paste: 20 Pa on the way up, 10 Pa on the way down."""
SATURATED = [f"{rate},{min(12 + 1.5 * rate, 60):g}" for rate in RATES]
"""12 Pa and 1.5 Pa s by a transducer that shows 60 Pa at most."""


def robot_cell(points_mm: Sequence[Sequence[float]], samples_mm: Sequence[Sequence[float]], more: str = "") -> Maker:
    """Return a function that makes a digitised run and a cell file with those taught points."""

    def make(folder: Path) -> None:
        photo(folder)
        sealtwin(folder, "digitise photo.png --depth-mm 10 --mm-per-px 0.1 --ends 40,150 460,160 --out run")
        taught = "".join(
            f"[[taught]]\nsample_mm = {json.dumps(list(sample))}\nrobot_mm = {json.dumps(list(point))}\n"
            for sample, point in zip(samples_mm, points_mm, strict=True)
        )
        (folder / "cell.toml").write_text(CELL_HEAD + taught + CELL_REST + more, encoding="utf-8")
        rows = ["asked_mm3_s,weighed_g,time_s,delay_s"]
        # 20 s each, written in minutes.
        rows += [f"{flow},{flow * 20 * 1.69e-3 * part:.3f},0.3333,0.3" for flow in (100, 400) for part in (1, 1.01)]
        (folder / "pump.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")

    return make


CELL_HEAD = 'name = "bench"\nformats = ["csv"]\nrobot_z = "up"\nframe_limit_mm = 0.5\n'
CELL_REST = """
[reach]
low_mm = [-300.0, -300.0, 0.0]
high_mm = [600.0, 600.0, 300.0]

[motion]
largest_speed_mm_s = 100.0
acceleration_mm_s2 = 200.0
approach_speed_mm_s = 20.0
safe_height_mm = 50.0
largest_tilt_deg = 5.0

[plunger]
diameter_mm = 20.0
travel_mm = 60.0
largest_speed_mm_s = 5.0

[gcode]

[urscript]
blend_mm = 0.1
dispenser = "digital"
port = 0
"""
MINUTES = '[pump]\nfile = "pump.csv"\ndensity_kg_m3 = 1690.0\n'
SAMPLE_CORNERS = ((0, 0), (50, 0), (0, 30))
CORNERS = ((250, -80, 55), (250, -30, 55), (220, -80, 55))
"""Of the sample in the robot's frame: its x is the robot's y, its y the robot's -x."""
SWAPPED = tuple((y, x, z) for x, y, z in CORNERS)
NEARLY_IN_LINE = ((0, 0), (50, 0), (25, 1))
ALMOST_ONE_LINE = ((250, -80, 55), (250, -30, 55), (249, -55, 55.05))
"""The third point 1 mm beside the line of the others, and touched 0.05 mm too high: the frame tilts by 2.9 degrees."""
