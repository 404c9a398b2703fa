"""Files of scanners give points in mm, or a sentence that names what is wrong with them."""

import io
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.exchange.gltf import export_glb

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.scan.points_file import read_points
from sealtwin.scan.settings import Placement

POINTS = np.random.default_rng(0).uniform(-50, 150, (200, 3)).round(3)
MAP = Placement(step_mm=0.5, count_mm=0.01, up="z")


def ply(kind: str, order: str = "<") -> bytes:
    types = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat {kind} 1.0\nelement vertex {len(POINTS)}\n{types}end_header\n".encode()
    return head + (rows(POINTS).encode() if kind == "ascii" else POINTS.astype(f"{order}f4").tobytes())


def rows(points: Floats, separator: str = " ", order: Sequence[int] = (0, 1, 2), header: str = "") -> str:
    return header + "".join(separator.join(f"{row[k]:.3f}" for k in order) + "\n" for row in points)


def picture(pixels: np.ndarray, kind: str = "PNG") -> bytes:
    content = io.BytesIO()
    Image.fromarray(pixels).save(content, kind)
    return content.getvalue()


def read(folder: Path, name: str, content: str | bytes, placement: Placement | None = None) -> Floats:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_points(path, placement or Placement(units="mm", up="z"))


FORMATS: dict[str, str | bytes] = {
    "binary.ply": ply("binary_little_endian"),
    "big-endian.ply": ply("binary_big_endian", ">"),
    "text.ply": ply("ascii"),
    "points.obj": "".join(f"v {row}\n" for row in rows(POINTS).splitlines()),
    "colours.obj": "# app\n" + "".join(f"v {x} {y} {z} 0.5 0.5 0.5\n" for x, y, z in POINTS.tolist()),
    "points.glb": export_glb(trimesh.Scene(trimesh.PointCloud(POINTS))),
    "spaces.xyz": rows(POINTS),
    "count.pts": f"{len(POINTS)}\n" + rows(POINTS, order=(0, 1, 2, 0, 0)),
    "not measured first.xyz": "1 2 inf\n1 2 nan\n1 2 1e38\n" + rows(POINTS),
    "names and others.csv": rows(POINTS, ";", (0, 2, 1, 0), '"nx";"z_mm";"y_mm";"x_mm"\n'),
    "names with units.csv": rows(POINTS, ",", (2, 0, 1), "z [mm], x [mm], y [mm]\n"),
    "names with tabs.txt": rows(POINTS, "\t", (2, 0, 1), "z (mm)\tx (mm)\ty (mm)\n"),
    "names, and an empty line.csv": rows(POINTS, ",", (2, 0, 1), "z,x,y\n\n"),
    "byte-order mark.csv": "\ufeff" + rows(POINTS, ",", (2, 0, 1), "z,x,y\n"),
    "names, and a comment.csv": rows(POINTS, ",", (2, 0, 1), "z,x,y\n# height first\n"),
}


@pytest.mark.parametrize("name", FORMATS)
def test_each_format_and_order_of_columns_gives_the_same_points(tmp_path, name):
    points_mm = read(tmp_path, name, FORMATS[name], Placement(units="cm", up="z"))
    assert points_mm == pytest.approx(10 * POINTS, abs=2e-4)  # float32 has steps of 1e-5 at 150 cm


@pytest.mark.parametrize("name", ["plate.stl", "plate.ply", "plate.obj", "plate.glb"])
def test_triangles_count_by_their_area(tmp_path, name):
    """A plate of 40 x 10 mm, cut into three triangles, of which the left one is thin."""
    corners, faces = [(0, 0, 2), (0, 10, 2), (0, 5, 2), (40, 0, 2), (40, 10, 2)], [(0, 3, 2), (2, 3, 4), (2, 4, 1)]
    trimesh.Trimesh(corners, faces, process=False).export(tmp_path / name)
    points_mm = read_points(tmp_path / name, Placement(units="mm", up="z"))
    assert points_mm.mean(axis=0) == pytest.approx((20, 5, 2), abs=0.5)  # 10,000 points: 0.12 mm


@pytest.mark.parametrize("kind", ["PNG", "TIFF"])
def test_a_height_map_has_y_up_and_nothing_where_it_is_0(tmp_path, kind):
    pixels = np.full((20, 30), 500, np.uint16)
    pixels[0, 0], pixels[19, 29] = 700, 0
    points_mm = read(tmp_path, "map.png" if kind == "PNG" else "map.tif", picture(pixels, kind), MAP)
    assert len(points_mm) == 599
    assert points_mm[points_mm[:, 2] > 6] == pytest.approx(np.array([[0, 9.5, 7.0]]))


def test_a_map_of_floats_has_nothing_where_it_is_nan(tmp_path):
    """0 is a height: a levelled face has it."""
    pixels = np.zeros((20, 30), np.float32)
    pixels[0, 0], pixels[19, 29], pixels[19, 28] = -0.75, np.nan, np.inf
    points_mm = read(tmp_path, "map.tiff", picture(pixels, "TIFF"), Placement(step_mm=0.5, count_mm=1.0, up="z"))
    assert len(points_mm) == 598
    assert points_mm[points_mm[:, 2] != 0] == pytest.approx(np.array([[0, 9.5, -0.75]]))


def test_the_counts_of_a_depth_map_grow_away_from_the_sensor(tmp_path):
    """Its picture is not mirrored: only z changes its sign."""
    pixels = np.random.default_rng(1).integers(100, 900, (20, 30)).astype(np.uint16)
    up, away = (
        read(tmp_path, "a.png", picture(pixels), Placement(step_mm=0.5, count_mm=mm, up="z")) for mm in (0.01, -0.01)
    )
    assert away == pytest.approx(up * [1, 1, -1])
    with pytest.raises(InputError, match="count_mm is 0: give at least"):
        Placement(step_mm=0.5, count_mm=0.0)


FLAT = np.full((20, 30), 500, np.uint16)
REFUSED: dict[str, tuple[str, str | bytes, str]] = {
    "no points": ("scan.xyz", "", "three numbers"),
    "decimal commas": (
        "scan.csv",
        rows(POINTS, ";").replace(".", ","),
        r"commas, as in [^.]*\. Save it with decimal points\.$",
    ),
    "other names": ("scan.csv", rows(POINTS, ",", header="east,north,up\n"), "east, north, up"),
    "fewer names than columns": ("scan.csv", rows(POINTS, ",", (2, 0, 1, 0), "z,x,y\n"), "3 columns.*have 4"),
    "too many points": (
        "scan.ply",
        ply("ascii").replace(b"vertex 200", b"vertex 4000000000"),
        r"4,000,000,000 .*allowed\. Crop it or thin it out\.$",
    ),
    "fewer points than listed": (
        "scan.ply",
        ply("ascii").rpartition(b"\n")[0].rpartition(b"\n")[0] + b"\n",
        "lists 200 points, but 199 can",
    ),
    "far from the origin": ("scan.xyz", rows(POINTS + 2e5), "from the origin.*offset"),
    "8 bits": ("map.png", picture(FLAT.astype(np.uint8)), r"16 bits.*\. Save it as 16-bit PNG or TIFF[^.]*\.$"),
    "one vertex": ("scan.obj", "v 1 2 3\n", "1 points"),
    **{kind: (f"scan.{kind}", "", "CloudCompare.* as PLY") for kind in ("las", "laz", "e57", "pcd", "usdz")},
}


@pytest.mark.parametrize(("name", "content", "cause"), REFUSED.values(), ids=REFUSED)
def test_a_damaged_file_is_refused_with_its_cause(tmp_path, name, content, cause):
    with pytest.raises(InputError, match=f"(?s){name}: .*(?:{cause})"):
        read(tmp_path, name, content, MAP if name == "map.png" else None)


def test_no_unit_and_no_direction_is_guessed(tmp_path):
    with pytest.raises(InputError, match=r"placement\.units"):
        read(tmp_path, "scan.xyz", rows(POINTS), Placement())
    with pytest.raises(InputError, match=r"placement\.step_mm"):
        read(tmp_path, "map.png", b"", Placement(units="mm", up="z"))
    # A heap in a depth map has the shape of a bed.
    for name, placement in (("scan.xyz", Placement(units="mm")), ("a.png", Placement(step_mm=0.5, count_mm=0.01))):
        with pytest.raises(InputError, match=r"placement\.up"):
            read(tmp_path, name, rows(POINTS) if name == "scan.xyz" else b"", placement)


def test_a_line_without_end_is_refused_at_once(tmp_path):
    """A pattern that can divide digits in two ways took 4 s for 20,000 of them, and hours for 20 million."""
    begin = time.process_time()
    with pytest.raises(InputError, match="three numbers"):
        read(tmp_path, "scan.xyz", "1" * 20_000 + "\n1\n")
    assert time.process_time() - begin < 1.0


def test_a_height_map_may_have_two_steps(tmp_path):
    placement = Placement(step_mm=(0.5, 0.2), count_mm=0.01, up="z")
    points_mm = read(tmp_path, "a.png", picture(np.full((20, 30), 100, np.uint16)), placement)
    assert points_mm.max(axis=0).tolist() == pytest.approx([29 * 0.5, 19 * 0.2, 1.0])
