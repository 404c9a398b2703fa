"""Files of the second draw, made as those of ``benchmarks.reported_files``."""

import csv
import struct
import zlib
from pathlib import Path

import numpy as np

from benchmarks.reported_files import (
    CORNERS,
    RATES,
    SAMPLE_CORNERS,
    Maker,
    grey,
    new_drawing,
    painted,
    photo,
    sealtwin,
    slotted_mesh,
    small_trial,
    text,
)


def planar_tiff(folder: Path) -> None:
    """Colour whose planes lie one behind the other, each of another brightness."""
    import tifffile

    planes = np.stack([grey(), 0.9 * grey(), 0.75 * grey()]).astype(np.uint8)
    tifffile.imwrite(folder / "photo.tif", planes, photometric="rgb", planarconfig="separate")


def tiled_tiff(folder: Path) -> None:
    """Tiles of 128 px in a picture of 500 x 300 px: those at two edges are not full."""
    import tifffile

    tifffile.imwrite(folder / "photo.tif", np.stack([grey()] * 3, axis=-1), photometric="rgb", tile=(128, 128))


def mask_of_white_zero(folder: Path) -> None:
    """A mask in a TIFF whose 0 is white, by its tag 262."""
    import tifffile

    photo(folder)
    tifffile.imwrite(folder / "mask.tif", 255 - painted(), photometric="miniswhite")


ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
"""First column and row, and steps, of each pass."""


def _grey_png(path: Path, values: np.ndarray, bits: int, interlaced: bool = False) -> None:
    """Write a grey PNG of any depth, by its specification."""

    def rows_of(part: np.ndarray) -> bytes:
        if bits == 16:
            packed = part.astype(">u2").view(np.uint8).reshape(len(part), -1)
        else:
            of_value = np.unpackbits(part.astype(np.uint8)[..., None], axis=-1)[..., 8 - bits :]
            packed = np.packbits(of_value.reshape(len(part), -1), axis=1)
        return b"".join(b"\0" + row.tobytes() for row in packed)

    def chunk(name: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    passes = ADAM7 if interlaced else ((0, 0, 1, 1),)
    content = b"".join(rows_of(values[y::down, x::right]) for x, y, right, down in passes)
    height, width = values.shape
    head = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, int(interlaced))
    chunks = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(content)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


def interlaced_of_16_bits(folder: Path) -> None:
    _grey_png(folder / "photo.png", grey().astype(np.uint16) * 257, 16, interlaced=True)


def mask_of_2_bits(folder: Path) -> None:
    photo(folder)
    _grey_png(folder / "mask.png", painted() // 85, 2)


def turned_webp(folder: Path) -> None:
    from PIL import Image

    tags = Image.Exif()
    tags[274] = 6
    stored = Image.fromarray(grey()).convert("RGB").transpose(Image.Transpose.ROTATE_90)
    stored.save(folder / "photo.webp", lossless=True, exif=tags.tobytes())


def size_of_before(folder: Path) -> None:
    """A photo made smaller, whose EXIF still has the size and the orientation's default of the camera's."""
    from PIL import Image

    tags = Image.Exif()
    tags[274] = 1
    tags.get_ifd(34665).update({40962: 4000, 40963: 2400, 41989: 26})
    Image.fromarray(grey()).convert("RGB").save(folder / "photo.jpg", quality=95, exif=tags.tobytes())


def cmyk_by_adobe(folder: Path) -> None:
    """A JPEG in CMYK with Adobe's marker, its inks inverted as Adobe has it."""
    from PIL import Image

    Image.fromarray(grey()).convert("RGB").convert("CMYK").save(folder / "photo.jpg", quality=95)


def mask_by_transparency(folder: Path) -> None:
    """White all over; what is painted is what is not transparent."""
    from PIL import Image

    photo(folder)
    white = np.full((*painted().shape, 3), 255, dtype=np.uint8)
    Image.fromarray(np.dstack([white, painted()])).save(folder / "mask.png")


def photo_and_depths(*rows: str) -> Maker:
    def make(folder: Path) -> None:
        photo(folder)
        text("depths.csv", "s_mm,depth_mm", *rows)(folder)

    return make


def aged_material(*rows: str) -> Maker:
    """Return a function that makes a trial whose fluid is a table over age."""

    def make(folder: Path) -> None:
        trial = small_trial(folder)
        fluid = "U = 30.0\nD_cm = 0.3\n"
        told = trial.read_text(encoding="utf-8").replace(fluid, 'curve = "material.csv"\n')
        trial.write_text(told, encoding="utf-8")
        text("material.csv", "age_s,viscosity_pa_s,yield_stress_pa", *rows)(folder)

    return make


PAUSE_S = 2.0


def path_with_a_pause(folder: Path) -> None:
    """The path of a digitised crack, as a planned one in which the nozzle stands still for 2 s, without flow."""
    trial = small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out before")
    names = ["t_s", "x_mm", "y_mm", "z_mm", "flow_mm3_s"]
    with (folder / "before" / "trajectory.csv").open(encoding="utf-8", newline="") as file:
        rows = [{name: float(row[name]) for name in names} for row in csv.DictReader(file)]
    half = len(rows) // 2
    late = [{**row, "t_s": row["t_s"] + PAUSE_S} for row in rows[half:]]
    rows = [*rows[:half], {**rows[half], "flow_mm3_s": 0.0}, *late]
    text("plan.csv", ",".join(names), *(",".join(f"{row[name]:.6f}" for name in names) for row in rows))(folder)
    told = trial.read_text(encoding="utf-8")
    path = "volume_ml = 0.08\nspeed_mm_s = 20\ntrim_mm = 1\n"
    trial.write_text(told.replace(path, 'plan = "plan.csv"\n'), encoding="utf-8")


def stl_with_flat_triangles(folder: Path) -> None:
    """An edge cut in two on one of its sides; a triangle without area joins the two halves to the other side."""
    import trimesh

    mesh = slotted_mesh()
    a, b, c = mesh.faces[0]
    middle = len(mesh.vertices)
    vertices = np.vstack([mesh.vertices, (mesh.vertices[a] + mesh.vertices[b]) / 2])
    faces = np.vstack([mesh.faces[1:], [(a, middle, c), (middle, b, c), (a, b, middle)]])
    trimesh.Trimesh(vertices, faces, process=False).export(folder / "block.stl")


BULGED = [(0, 0, 0), (60, 0, 1), (60, 4, 0), (0, 4, 0)]
BULGED_MM3 = 10 * (240 + 2 * np.pi)
"""60 x 4 mm with half a circle at the far end, 10 mm deep."""


def dxf_mirrored_block(folder: Path) -> None:
    """That outline in a block that is inserted mirrored."""
    drawing, space = new_drawing()
    here = {"layer": "OUTLINE"}
    block = drawing.blocks.new("RISS")
    block.add_lwpolyline(BULGED, format="xyb", close=True, dxfattribs=here)
    space.add_blockref("RISS", (100, 0), dxfattribs=here | {"xscale": -1, "yscale": 1})
    drawing.saveas(folder / "a.dxf")


def dxf_drawn_twice(folder: Path) -> None:
    """An outline of 60 x 4 mm, and its copy upon itself."""
    drawing, space = new_drawing()
    for _ in range(2):
        space.add_lwpolyline([(0, 0), (60, 0), (60, 4), (0, 4)], close=True, dxfattribs={"layer": "OUTLINE"})
    drawing.saveas(folder / "a.dxf")


TWICE_UP = [f"{rate},{20 + 2 * rate:g}" for rate in RATES] + [f"{rate},{12 + 1.5 * rate:g}" for rate in RATES]
"""Two ways up, one behind the other: 20 Pa in the first, 12 Pa in the second."""
FOUR_CORNERS = (*SAMPLE_CORNERS, (50, 30))
ONE_TOO_HIGH = (*CORNERS, (220, -30, 60))
"""The fourth point touched 5 mm above the face."""
