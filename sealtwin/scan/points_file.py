"""Read the points of a scan in mm: PLY, STL, OBJ, GLB, text with x, y and z, or a height map."""

import io
import re
from pathlib import Path

import numpy as np
from PIL import Image

from sealtwin.core.arrays import Floats
from sealtwin.core.errors import InputError, present
from sealtwin.core.mesh_file import (
    BEYOND_ANY_UNIT,
    MAX_POINTS,
    Triangles,
    UnreadableError,
    read_mesh,
    read_refusing_damage,
    refuse_too_many,
)
from sealtwin.scan.settings import DIRECTION, Placement

FARTHEST_MM = 100_000.0
"""Largest distance of a scan from its origin in mm. Farther away, single-precision numbers have steps above 0.004 mm,
and a scan of a sample has no reason to be there."""
PER_MM2 = 25.0  # Number of points per mm² that are taken from triangles: every 0.2 mm
TEXT = "Save it as lines of x, y and z."
HEADER_LINES = 30  # Largest number of lines before the first point of a text
NUMBER = rb"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|[-+]?(?:nan|inf)"
POINT_LINE = re.compile(rb"\s*(?:(?:%b)(?:\s*[,;]\s*|\s+|\s*$)){3,}" % NUMBER, re.IGNORECASE)
DECIMAL_COMMA = re.compile(rb"\s*[-+]?[0-9]+,[0-9]+(?:\s*;\s*|[ \t]+)[-+]?[0-9]+,[0-9]+(?:\s*;|[ \t]|\s*$)")
TEXTS, MAPS = (".xyz", ".csv", ".txt", ".pts", ".asc"), (".png", ".tif", ".tiff")
MESHES = (".ply", ".stl", ".obj", ".glb")


def read_points(path: Path, placement: Placement) -> Floats:
    """Return the points of a scan in mm and in the scan's own axes, (n, 3).

    Points without finite coordinates, or with one beyond 1e9 mm, are left out. The surface of triangles is covered with
    points. A height map has x to the right, y up, and one point for each pixel with a height. If ``count_mm`` is
    negative, z is minus the distance from the sensor.

    Raises InputError if the file is missing, too large or damaged, if its unit or direction is not given, or if it
    is far from its origin.
    """
    suffix = path.suffix.lower()
    if suffix not in TEXTS + MESHES + MAPS:
        raise InputError(
            f"{path}: not a scan that can be read. Open it in CloudCompare, or in the scanner's software, and save it "
            "as PLY. STL, OBJ, GLB, XYZ and CSV, and height maps as PNG or TIFF, can be read too."
        )
    if suffix in MAPS and (placement.step_mm is None or placement.count_mm is None):
        raise InputError(
            f"{path}: a height map has no scale of its own: give readings.placement.step_mm, the distance between "
            "pixels, and count_mm, the height of one count: 1 for heights in mm, negative if counts grow away from the "
            "sensor."
        )
    if suffix not in MAPS and placement.units is None:
        raise InputError(f'{path}: no unit is given: set readings.placement.units to "mm", "cm", "m" or "inch".')
    if not placement.states_direction:
        raise InputError(f"{path}: readings.placement.up is missing: {DIRECTION}.")
    if suffix in MAPS:
        points_mm = read_refusing_damage(path, lambda content: _of_map(content, placement))
    elif suffix in TEXTS:
        points_mm = placement.unit_mm * read_refusing_damage(path, _of_text)
    else:
        points_mm = _on_surface(read_mesh(path, is_scan=True), placement.unit_mm)
    points_mm = points_mm[(np.abs(points_mm) < BEYOND_ANY_UNIT).all(axis=1)]
    if len(points_mm) < 100:
        raise InputError(
            f"{path}: has {len(points_mm)} points with finite coordinates; a scan has thousands. "
            "A text has a line of x, y and z for each; save a grid of heights as TIFF."
        )
    away_mm = float(np.abs(np.median(points_mm, axis=0)).max())
    if away_mm > FARTHEST_MM:
        raise InputError(
            f"{path}: the points are {away_mm:,.0f} mm from the origin of the scan, where numbers lose "
            f"their last digits; at most {FARTHEST_MM:,.0f} mm are allowed. Correct its unit, or subtract the offset."
        )
    return points_mm


def _on_surface(mesh: Triangles, mm: float) -> Floats:
    """Return the vertices of a file without triangles, or random points on its triangles: large ones count by area."""
    if not len(mesh.faces):
        return mm * mesh.vertices
    import trimesh

    surface = trimesh.Trimesh(mm * mesh.vertices, mesh.faces, process=False)
    count = int(np.clip(PER_MM2 * surface.area, 10_000, MAX_POINTS))
    return np.asarray(trimesh.sample.sample_surface(surface, count, seed=0)[0], dtype=float)


def _of_text(content: bytes) -> Floats:
    """Read lines of numbers. Columns are x, y and z, in this order unless a header names them."""
    content = content.removeprefix(b"\xef\xbb\xbf")  # UTF-8 byte-order mark
    if b"\0" in content[:4096]:
        raise UnreadableError("it is not a text", TEXT)
    lines = content[:1_000_000].splitlines(keepends=True)[:HEADER_LINES]
    begin = next((number for number, line in enumerate(lines) if POINT_LINE.match(line)), None)
    if begin is None or DECIMAL_COMMA.match(lines[begin]):
        if comma := next((line for line in lines if DECIMAL_COMMA.match(line)), None):
            example = comma.strip().decode("ascii", "replace")
            raise UnreadableError(f"numbers have decimal commas, as in {example:.40}", "Save it with decimal points.")
        raise UnreadableError(f"none of its first {HEADER_LINES} lines begins with three numbers", TEXT)
    separator = next((mark for mark in (",", ";") if mark.encode() in lines[begin]), None)
    columns = _columns([line.decode("ascii", "replace") for line in lines[: begin + 1]], separator)
    refuse_too_many(content.count(b"\n") - begin, MAX_POINTS, "lines")
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
        fault = f"the line above the points names {', '.join(names)}, but {missing[0]} not once"
        raise UnreadableError(fault, "Name the columns x, y and z.")
    if len(names) != count:
        fault = f"a line above the points names {len(names)} columns, but the points have {count}"
        raise UnreadableError(fault, "Name each column once.")
    return tuple(names.index(axis) for axis in "xyz")


def _fields(line: str, separator: str | None) -> list[str]:
    line = line.strip(" \t\r\n#/,;")
    mark = next((mark for mark in (separator, "\t") if mark and mark in line), None)
    return line.split(mark) if mark else re.split(r"[,;\s]+", line)


def _of_map(content: bytes, placement: Placement) -> Floats:
    with Image.open(io.BytesIO(content), formats=("PNG", "TIFF")) as picture:
        refuse_too_many(picture.width * picture.height, MAX_POINTS, "pixels")
        # Pillow's names for one channel of 16 bits begin with I;16, and F is one of 32-bit floating point.
        if not picture.mode.startswith(("I;16", "F")):
            raise UnreadableError(
                f"its pixels are {picture.mode}, but a height map has one channel of 16 bits, or of 32-bit floats",
                "Save it as 16-bit PNG or TIFF, or as 32-bit TIFF.",
            )
        counts = np.asarray(picture, dtype=float)
    # No height is 0 in whole numbers, and NaN in others, of which 0 may be the height of the face.
    row, column = np.nonzero(counts if picture.mode != "F" else np.isfinite(counts))
    points = np.column_stack([column, len(counts) - 1 - row, counts[row, column]]).astype(float)
    step_mm = np.broadcast_to(present(placement.step_mm, "placement.step_mm"), 2)
    return points * [*step_mm, present(placement.count_mm, "placement.count_mm")]
