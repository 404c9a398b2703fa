"""Read the points of a scan in mm: PLY, STL, text with x, y and z, or a 16-bit height map."""

import io
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from sealtwin.core.arrays import Floats
from sealtwin.core.errors import InputError, present
from sealtwin.core.mesh_file import BEYOND_ANY_UNIT, LARGEST_BYTES, UnreadableError, load_trimesh, read_mesh
from sealtwin.core.plain_files import opened, read_bytes
from sealtwin.scan.settings import Placement

MAX_POINTS = 5_000_000
FARTHEST_MM = 100_000.0
"""Largest distance of a scan from its origin in mm. Farther away, single-precision numbers have steps above 0.004 mm,
and a scan of a sample has no reason to be there."""
PER_MM2 = 25.0  # Number of points per mm² that are taken from triangles: every 0.2 mm
HEADER_LINES = 30  # Largest number of lines before the first point of a text
NUMBER = rb"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|[-+]?(?:nan|inf)"
POINT_LINE = re.compile(rb"\s*(?:(?:%b)(?:\s*[,;]\s*|\s+|\s*$)){3,}" % NUMBER, re.IGNORECASE)
DECIMAL_COMMA = re.compile(rb"\s*[-+]?[0-9]+,[0-9]+(?:\s*;\s*|[ \t]+)[-+]?[0-9]+,[0-9]+(?:\s*;|[ \t]|\s*$)")
TEXTS, MESHES, MAPS = (".xyz", ".csv", ".txt", ".pts", ".asc"), (".ply", ".stl"), (".png", ".tif", ".tiff")
DEEP_MODES = ("I;16", "I;16L", "I;16B", "I;16N")  # Pillow's names for one channel with 16 bits


def read_points(path: Path, placement: Placement) -> Floats:
    """Return the points of a scan in mm and in the scan's own axes, (n, 3).

    Points without a finite height are left out. The surface of triangles is covered with points. A height map has x to
    the right, y up, and one point for each pixel that is not 0.

    Raises InputError if the file is missing, too large or damaged, if its unit is not given, or if it is far from its
    origin.
    """
    suffix = path.suffix.lower()
    if suffix not in TEXTS + MESHES + MAPS:
        raise InputError(f"{path}: not a scan: expected PLY, STL, XYZ, CSV, or a height map as 16-bit PNG or TIFF.")
    if suffix in MAPS and (placement.step_mm is None or placement.count_mm is None):
        raise InputError(
            f"{path}: a height map has no scale of its own: give readings.placement.step_mm, the distance between "
            "pixels, and count_mm, the height of one count."
        )
    if suffix not in MAPS and placement.units is None:
        raise InputError(f'{path}: no unit is given: set readings.placement.units to "mm", "cm", "m" or "inch".')
    if not path.is_file():
        raise InputError(f"{path}: no such scan.")
    size = path.stat().st_size
    if size > LARGEST_BYTES:
        raise InputError(
            f"{path}: the file has {size / 1e6:.0f} MB, but at most {LARGEST_BYTES / 1e6:.0f} MB are allowed. Crop the "
            "scan to the face, or save it as binary PLY."
        )
    if suffix in MAPS:
        points_mm = _refusing_damage(path, lambda content: _of_map(content, placement))
    else:
        mm = placement.unit_mm
        if suffix == ".stl" or (suffix == ".ply" and _has_faces(path)):
            points_mm = _on_triangles(path, mm)
        else:
            points_mm = mm * _refusing_damage(path, _of_text if suffix in TEXTS else _of_ply)
    points_mm = points_mm[np.isfinite(points_mm).all(axis=1)]
    if len(points_mm) < 100:
        raise InputError(f"{path}: has {len(points_mm)} points with finite coordinates; a scan has thousands.")
    if (wrong := (np.abs(points_mm) > BEYOND_ANY_UNIT).any(axis=1)).any():
        raise InputError(
            f"{path}: {wrong.sum()} points have a coordinate beyond {BEYOND_ANY_UNIT:g} mm. Leave out points that were "
            "not measured, or write them as nan."
        )
    away_mm = float(np.abs(np.median(points_mm, axis=0)).max())
    if away_mm > FARTHEST_MM:
        raise InputError(
            f"{path}: the points are {away_mm:,.0f} mm from the origin of the scan, where numbers lose "
            f"their last digits; at most {FARTHEST_MM:,.0f} mm are allowed. Correct its unit, or subtract the offset."
        )
    return points_mm


def _refusing_damage(path: Path, read: Callable[[bytes], Floats]) -> Floats:
    """Return what ``read`` makes of the file's content. Whatever it raises becomes an InputError."""
    content = read_bytes(path, LARGEST_BYTES)
    try:
        with warnings.catch_warnings(), np.errstate(over="ignore", invalid="ignore"):
            warnings.simplefilter("ignore")
            warnings.filterwarnings("error", "string or file could not be read", DeprecationWarning)
            return read(content)
    except InputError:
        raise
    except Exception as fault:  # Readers raise exceptions of any kind for damaged bytes.
        reason = str(fault) if isinstance(fault, UnreadableError) else f"its content cannot be parsed ({fault})"
        raise InputError(f"{path}: not a readable {path.suffix[1:].upper()}: {reason:.300}. Save it again.") from fault


def _refuse_too_many(count: int, noun: str = "points") -> None:
    if count > MAX_POINTS:
        raise UnreadableError(f"it has {count:,} {noun}, but at most {MAX_POINTS:,} are allowed; crop or thin it out")


def _has_faces(path: Path) -> bool:
    with opened(path, LARGEST_BYTES) as content:
        header = content.read(65_536).partition(b"end_header")[0]
    count = re.search(rb"^element face (\d+)", header, re.MULTILINE)
    return count is not None and int(count[1]) > 0


def _on_triangles(path: Path, mm: float) -> Floats:
    """Cover the triangles of a mesh with random points, so that large triangles count by their area. The seed is 0."""
    mesh = read_mesh(path)
    import trimesh

    surface = trimesh.Trimesh(mm * mesh.vertices, mesh.faces, process=False)
    count = int(np.clip(PER_MM2 * surface.area, 10_000, MAX_POINTS))
    return np.asarray(trimesh.sample.sample_surface(surface, count, seed=0)[0], dtype=float)


def _of_ply(content: bytes) -> Floats:
    header, end, body = content.partition(b"\nend_header")
    header = re.sub(rb"^comment.*\n", b"", header, flags=re.MULTILINE)
    count = re.search(rb"^element vertex (\d+)", header, re.MULTILINE)
    if count is None:
        raise UnreadableError("its header has no 'element vertex'")
    _refuse_too_many(int(count[1]))
    if b"format ascii" in header:
        # trimesh rounds the numbers of a text file to the type that the header states.
        header = re.sub(rb"property float(32)? ", b"property double ", header)
    load_trimesh()
    import trimesh

    cloud = trimesh.load(io.BytesIO(header + end + body), file_type="ply", process=False)
    points = np.array(getattr(cloud, "vertices", ()), dtype=float).reshape(-1, 3)
    if len(points) != int(count[1]):
        raise UnreadableError(f"it lists {int(count[1]):,} points, but {len(points):,} can be read")
    return points


def _of_text(content: bytes) -> Floats:
    """Read lines of numbers. Columns are x, y and z, in this order unless a header names them."""
    content = content.removeprefix(b"\xef\xbb\xbf")  # UTF-8 byte-order mark
    if b"\0" in content[:4096]:
        raise UnreadableError("it is not a text")
    first = content.splitlines(keepends=True)[:HEADER_LINES] if len(content) < 1_000_000 else content[:1_000_000]
    lines = first if isinstance(first, list) else first.splitlines(keepends=True)[:HEADER_LINES]
    begin = next((number for number, line in enumerate(lines) if POINT_LINE.match(line)), None)
    if begin is None or DECIMAL_COMMA.match(lines[begin]):
        if comma := next((line for line in lines if DECIMAL_COMMA.match(line)), None):
            example = comma.strip().decode("ascii", "replace")
            raise UnreadableError(f"numbers have decimal commas, as in {example:.40}; save it with decimal points")
        raise UnreadableError(f"none of its first {HEADER_LINES} lines begins with three numbers")
    separator = next((mark for mark in (",", ";") if mark.encode() in lines[begin]), None)
    columns = _columns([line.decode("ascii", "replace") for line in lines[: begin + 1]], separator)
    _refuse_too_many(content.count(b"\n") - begin, "lines")
    stream = io.BytesIO(content)
    return np.asarray(
        np.loadtxt(stream, delimiter=separator, skiprows=begin, usecols=columns, comments=None, ndmin=2), dtype=float
    )


def _columns(lines: list[str], separator: str | None) -> tuple[int, ...]:
    """Return the columns named x, y and z above the first point, the last line, or the first three without names."""
    count = len(_fields(lines[-1], separator))
    header = [
        [re.sub(r"[^a-z].*", "", name.strip(' "').lower()) for name in _fields(line, separator)]
        for line in lines[:-1]
        if line.strip()
    ]
    complete = [names for names in header if all(names.count(axis) == 1 for axis in "xyz")]
    names = (complete or header or [[]])[-1]
    if not complete and (len(names) != count or not any(names)):
        return (0, 1, 2)
    if missing := [axis for axis in "xyz" if names.count(axis) != 1]:
        raise UnreadableError(f"the line above the points names {', '.join(names)}, but {missing[0]} not once")
    if len(names) != count:
        raise UnreadableError(f"a line above the points names {len(names)} columns, but the points have {count}")
    return tuple(names.index(axis) for axis in "xyz")


def _fields(line: str, separator: str | None) -> list[str]:
    line = line.strip(" \t\r\n#/,;")
    mark = next((mark for mark in (separator, "\t") if mark and mark in line), None)
    return line.split(mark) if mark else re.split(r"[,;\s]+", line)


def _of_map(content: bytes, placement: Placement) -> Floats:
    with Image.open(io.BytesIO(content), formats=("PNG", "TIFF")) as picture:
        _refuse_too_many(picture.width * picture.height, "pixels")
        if picture.mode not in DEEP_MODES:
            raise UnreadableError(f"its pixels are {picture.mode}, but a height map has one channel with 16 bits")
        counts = np.asarray(picture, dtype=np.uint16)
    row, column = np.nonzero(counts)
    points = np.column_stack([column, len(counts) - 1 - row, counts[row, column]]).astype(float)
    step_mm = np.broadcast_to(present(placement.step_mm, "placement.step_mm"), 2)
    return points * [*step_mm, present(placement.count_mm, "placement.count_mm")]
