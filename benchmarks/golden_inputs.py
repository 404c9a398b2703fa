"""Photos, sheets, meshes, a lab's folder and a robot's cell for ``benchmarks/golden.py``, drawn without the packages.

Nothing here imports what the benchmark guards, nor the helpers of its tests: both may be renamed and moved. Everything
is a pure function of the seeds that stand here.
"""

import csv
import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import openpyxl
import trimesh
from numpy.typing import NDArray
from PIL import Image

Floats = NDArray[np.float64]
Point = tuple[float, float]

BLOCK_MM = (100.0, 40.0, 20.0)


def draw_photo(
    path: Path,
    cracks: Sequence[tuple[Sequence[Point], float]],
    *,
    size_px: tuple[int, int] = (360, 220),
    seed: int = 1,
    light: tuple[float, float] = (1.0, 1.0),
    glint: float = 0.0,
) -> Path:
    """Grainy mortar with dark, slightly wavy cracks: polylines in pixels, each with its width.

    ``light`` is the brightness at the left and the right edge; ``glint`` brightens a strip inside the wall on the right
    of a crack (below 0: on its left), as a lamp from the side does.
    """
    width, height = size_px
    grain = _blurred(np.random.default_rng(seed).standard_normal((height, width)))
    image = 0.35 * (1 + 0.3 * grain / grain.std() * 0.3) * np.linspace(*light, width)
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    wave_px = 0.6 * np.sin(x / 11.0 + seed) + 0.4 * np.sin(y / 7.0)
    for points, width_px in cracks:
        off_px, side = _distance(x, y, np.array(points, dtype=float))
        cover = np.clip(0.5 + (width_px / 2 + wave_px - off_px) / 2.0, 0, 1)
        lit = np.clip(1 - np.abs(off_px - 0.3 * width_px) / (0.15 * width_px), 0, 1) * (side * np.sign(glint) > 0)
        image = image * (1 - cover * (0.93 - abs(glint) * lit))
    Image.fromarray(np.rint(255 * np.clip(image, 0, 1) ** (1 / 2.2)).astype(np.uint8)).save(path)
    return path


def draw_mask(path: Path, points: Sequence[Point], width_px: float, size_px: tuple[int, int] = (360, 220)) -> Path:
    """The crack painted white on black."""
    x, y = np.meshgrid(np.arange(size_px[0], dtype=float), np.arange(size_px[1], dtype=float))
    off_px, _ = _distance(x, y, np.array(points, dtype=float))
    Image.fromarray(np.where(off_px < width_px / 2, 255, 0).astype(np.uint8)).save(path)
    return path


def _blurred(field: Floats) -> Floats:
    for axis in (0, 1, 0, 1):
        field = (np.roll(field, 1, axis) + field + np.roll(field, -1, axis)) / 3
    return field


def _distance(x: Floats, y: Floats, line: Floats) -> tuple[Floats, Floats]:
    """Distance to a polyline, and on which side of its nearest segment a pixel lies: 1 or -1."""
    nearest, side = np.full(x.shape, np.inf), np.ones(x.shape)
    for (x0, y0), (x1, y1) in itertools.pairwise(line):
        dx, dy = x1 - x0, y1 - y0
        along = np.clip(((x - x0) * dx + (y - y0) * dy) / (dx**2 + dy**2), 0, 1)
        off = np.hypot(x - x0 - along * dx, y - y0 - along * dy)
        closer = off < nearest
        nearest = np.where(closer, off, nearest)
        side = np.where(closer, np.where(dx * (y - y0) - dy * (x - x0) > 0, 1.0, -1.0), side)
    return nearest, side


def read_caliper(path: Path) -> tuple[Floats, Floats]:
    """The stations in mm and the levels in mm, (n,) and (n, repeats), of a sheet in the canonical form."""
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = np.array([[float(cell) for cell in row] for row in list(csv.reader(lines))[1:]])
    return rows[:, 0], rows[:, 1:]


def write_text_sheet(
    path: Path,
    header: Sequence[str],
    rows: Sequence[Sequence[float | str]],
    *,
    separator: str = ",",
    decimal: str = ".",
    encoding: str = "utf-8",
    digits: int = 3,
    newline: str = "\n",
    above: Sequence[str] = (),
) -> Path:
    def cell(value: float | str) -> str:
        return value if isinstance(value, str) else f"{value:.{digits}f}".replace(".", decimal)

    lines = [*above, separator.join(header), *(separator.join(cell(value) for value in row) for row in rows)]
    path.write_bytes((newline.join(lines) + newline).encode(encoding))
    return path


def write_workbook(path: Path, rows: Sequence[Sequence[float | str | None]]) -> Path:
    book = openpyxl.Workbook()
    for row in rows:
        book.worksheets[0].append([value.item() if isinstance(value, np.generic) else value for value in row])
    book.save(path)
    return path


def wide(s: Floats, values: Floats, scale: float = 1.0) -> list[list[float | str]]:
    """A row for each station, all repeats beside each other."""
    return [[float(a) * scale, *(float(b) * scale for b in row)] for a, row in zip(s, values, strict=True)]


def long(s: Floats, values: Floats, scale: float = 1.0) -> list[list[float | str]]:
    """A row for each reading: station, number of the repeat, reading."""
    return [
        [float(a) * scale, f"{number}", float(b) * scale]
        for a, row in zip(s, values, strict=True)
        for number, b in enumerate(row, 1)
    ]


def slotted_block(
    half_width_mm: float = 2.0, floor_half_mm: float = 2.0, depth_mm: float = 10.0, wander_mm: float = 0.0
) -> tuple[Floats, NDArray[np.int64]]:
    """A block of 100 x 40 x 20 mm, its face at z = 0, less a slot from x = 20 to 80 mm; vertices and outward faces.

    The slot wanders sideways by ``wander_mm`` and is narrower or wider at its floor.
    """
    length, width, height = BLOCK_MM
    x = np.array([0.0, *np.linspace(20.0, 80.0, 31), length])
    last = len(x) - 1
    vertices: list[tuple[float, float, float]] = []
    number: dict[tuple[str, int], int] = {}
    for i, at in enumerate(x):
        middle = width / 2 + wander_mm * np.sin((at - 20.0) / 60.0 * 2 * np.pi)
        places = {"b0": (0.0, -height), "b1": (width, -height), "t0": (0.0, 0.0), "t1": (width, 0.0)}
        if 0 < i < last:
            places |= {
                "l": (middle - half_width_mm, 0.0),
                "r": (middle + half_width_mm, 0.0),
                "fl": (middle - floor_half_mm, -depth_mm),
                "fr": (middle + floor_half_mm, -depth_mm),
            }
        for kind, (y, z) in places.items():
            number[kind, i] = len(vertices)
            vertices.append((float(at), float(y), float(z)))
    faces: list[tuple[int, int, int]] = []

    def fan(*corners: tuple[str, int]) -> None:
        ring = [number[corner] for corner in corners]
        faces.extend((ring[0], b, c) for b, c in itertools.pairwise(ring[1:]))

    for i in range(last):
        j = i + 1
        fan(("b0", i), ("b1", i), ("b1", j), ("b0", j))
        fan(("b0", i), ("b0", j), ("t0", j), ("t0", i))
        fan(("b1", j), ("b1", i), ("t1", i), ("t1", j))
        if i > 0 and j < last:
            fan(("t0", i), ("t0", j), ("l", j), ("l", i))
            fan(("r", i), ("r", j), ("t1", j), ("t1", i))
            fan(("fl", j), ("fl", i), ("l", i), ("l", j))
            fan(("fr", i), ("fr", j), ("r", j), ("r", i))
            fan(("fl", i), ("fl", j), ("fr", j), ("fr", i))
    fan(("t0", 0), ("t0", 1), ("l", 1), ("r", 1), ("t1", 1), ("t1", 0))
    end = last - 1
    fan(("t0", last), ("t1", last), ("t1", end), ("r", end), ("l", end), ("t0", end))
    fan(("b1", 0), ("b0", 0), ("t0", 0), ("t1", 0))
    fan(("b0", last), ("b1", last), ("t1", last), ("t0", last))
    fan(("fl", 1), ("fr", 1), ("r", 1), ("l", 1))
    fan(("fr", end), ("fl", end), ("l", end), ("r", end))
    return np.array(vertices), np.array(faces)


def write_mesh(path: Path, vertices: Floats, faces: NDArray[np.int64], *, text: bool = False) -> Path:
    """STL, PLY, OBJ, OFF or GLB by the name's ending; ``text`` for an STL in words."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    if path.suffix == ".glb":
        trimesh.Trimesh(vertices, faces, process=False).export(path)
    elif path.suffix == ".stl" and not text:
        kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        table = np.zeros(len(faces), dtype=kind)
        table["normal"], table["corners"] = normals, corners
        path.write_bytes(b"\0" * 80 + np.uint32(len(faces)).tobytes() + table.tobytes())
    else:
        path.write_text("\n".join(_mesh_lines(path.suffix, vertices, faces, normals)) + "\n", encoding="ascii")
    return path


def _mesh_lines(suffix: str, vertices: Floats, faces: NDArray[np.int64], normals: Floats) -> list[str]:
    points = [f"{x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    if suffix == ".stl":
        lines = ["solid block"]
        for face, (x, y, z) in zip(faces, normals, strict=True):
            lines += [f"facet normal {x:.6f} {y:.6f} {z:.6f}", "outer loop"]
            lines += [f"vertex {points[corner]}" for corner in face]
            lines += ["endloop", "endfacet"]
        return [*lines, "endsolid block"]
    if suffix == ".obj":
        return [*(f"v {point}" for point in points), *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces)]
    triangles = [f"3 {a} {b} {c}" for a, b, c in faces]
    if suffix == ".off":
        return ["OFF", f"{len(points)} {len(triangles)} 0", *points, *triangles]
    header = ["ply", "format ascii 1.0", f"element vertex {len(points)}"]
    header += [f"property float {axis}" for axis in "xyz"]
    header += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header"]
    return [*header, *points, *triangles]


LAB = """\
data = "synthetic"

[photo]
mm_per_px = 0.1

[crack]
tilt = "vertical"

[path]
volume_ml = 0.2
speed_mm_s = 20.0
trim_mm = 1.0

[fluid]
U = 30.0
D_cm = 0.3
freeze_after_s = 0.2

[solver]
radius_mm = 0.45

[output]
snapshots_s = []

[readings]
role = "held-out"
"""


def write_lab_folder(folder: Path) -> Path:
    """Three samples: in English with a TOML note, in German with a table of words, and with a workbook."""
    folder.mkdir(parents=True)
    ends = [(60.0, 112.0), (300.0, 105.0)]
    s = np.array([2.0, 6.0, 10.0, 14.0, 18.0, 22.0])
    for seed, name in enumerate(("K01", "K02", "K03"), 21):
        draw_photo(folder / f"{name}.png", [([ends[0], (140, 106), (220, 116), ends[1]], 18.0)], seed=seed)
    level = np.round(-1.5 + 0.04 * s[:, None] + np.random.default_rng(5).normal(0, 0.03, (3, 6, 3)), 2)
    (folder / "lab.toml").write_text(LAB, encoding="utf-8")
    pairs = "60 112 300 105"
    header = ["s_mm", "level_1_mm", "level_2_mm", "level_3_mm"]
    write_text_sheet(folder / "K01.csv", header, wide(s, level[0]), digits=2)
    (folder / "K01.toml").write_text(
        "[crack]\ndepth_mm = 8.0\n[photo]\nends_px = [[60.0, 112.0], [300.0, 105.0]]\n", encoding="utf-8"
    )
    header = ["Abstand vom Rissanfang [mm]", *(f"Tiefe {number} [mm]" for number in (1, 2, 3))]
    write_text_sheet(
        folder / "K02_Messung.csv", header, wide(s, -level[1]), separator=";", decimal=",", encoding="cp1252", digits=2
    )
    (folder / "K02_Notiz.csv").write_bytes(
        f"Angabe;Wert\nTiefe [mm];8,5\nPrüfer;A. Muster\nRissenden;{pairs}\n".encode("cp1252")
    )
    write_workbook(folder / "K03.xlsx", [["s_mm", "level_1_mm", "level_2_mm", "level_3_mm"], *wide(s, level[2])])
    (folder / "K03_notes.csv").write_text(f"key,value,unit\ndepth,7.5,mm\nends,{pairs},\n", encoding="utf-8")
    return folder


CELL = """\
name = "golden"
formats = ["csv"]

[[taught]]
sample_mm = [0.0, 0.0]
robot_mm = [250.0, -80.0, 55.0]

[[taught]]
sample_mm = [160.0, 0.0]
robot_mm = [249.0, 79.98, 55.5]

[[taught]]
sample_mm = [0.0, 40.0]
robot_mm = [210.0, -79.75, 55.2]

[reach]
low_mm = [100.0, -200.0, 40.0]
high_mm = [400.0, 200.0, 250.0]

[motion]
largest_speed_mm_s = 200.0
acceleration_mm_s2 = 2000.0

[plunger]
diameter_mm = 20.0
travel_mm = 100.0
largest_speed_mm_s = 20.0

[spel]
dispenser = "output"
output_bit = 8

[gcode]
cold_extrusion = true

[urscript]
dispenser = "analog"
port = 0
full_flow_mm3_s = 4000.0
"""
"""Three taught points a little turned and tipped, so that every number of a waypoint is computed."""
