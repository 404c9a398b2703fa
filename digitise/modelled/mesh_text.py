"""OBJ and OFF: vertices and polygons as lines of text."""

from collections.abc import Iterator, Sequence
from itertools import islice
from operator import itemgetter

import numpy as np

from digitise.modelled.triangles import MOST_TRIANGLES, MOST_VERTICES, Polygons, Triangles, UnreadableError
from sealtwin.records import Floats

AT_ONCE = 50_000
"""Lines turned into numbers at a time: as Python objects they take twenty times their room."""
LONGEST_LINE = 100_000
"""A polygon of 10,000 corners."""


def read_obj(content: bytes) -> Triangles:
    """Vertices and faces alone: materials and textures lie in other files, which are not opened."""
    places: list[list[bytes]] = []
    parts = [np.empty((0, 3))]
    polygons = Polygons()
    count = 0
    for line in content_lines(content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")):
        word, *rest = line.split()
        if word == b"v":
            places.append(rest[:3])
            count += 1
            if len(places) == AT_ONCE:
                parts.append(_numbers(places))
                places.clear()
        elif word == b"f":
            # Indices count from 1, or backward from the last vertex so far.
            named = [int(corner.partition(b"/")[0]) for corner in rest]
            polygons.add([index - 1 if index > 0 else count + index for index in named])
    vertices = np.concatenate([*parts, _numbers(places)])
    return Triangles(vertices, polygons.triangles(vertices))


def read_off(content: bytes) -> Triangles:
    lines = content_lines(content)
    first = next(lines, b"").split()
    if not first or not first[0].upper().endswith(b"OFF") or b"BINARY" in first:
        raise UnreadableError("its first line does not say OFF")
    if first[0].upper() not in (b"OFF", b"COFF", b"NOFF", b"CNOFF"):
        raise UnreadableError(f"{first[0].decode('ascii', 'replace')} is a variant that is not read")
    counts = first[1:] or next(lines, b"").split()
    vertex_count, face_count = (int(count) for count in counts[:2])
    if not 0 <= vertex_count <= MOST_VERTICES or not 0 <= face_count <= MOST_TRIANGLES:
        raise UnreadableError(f"its header names {vertex_count} vertices and {face_count} faces")
    vertices = read_vertices(lines, vertex_count)
    polygons = read_polygons(lines, face_count)
    return Triangles(vertices, polygons.triangles(vertices))


def read_vertices(lines: Iterator[bytes], count: int, columns: Sequence[int] = (0, 1, 2)) -> Floats:
    """From the next lines, each with x, y and z in these columns, (count, 3)."""
    parts = [np.empty((0, 3))]
    left = count
    pick = itemgetter(*columns)
    while left and (batch := [line.split() for line in islice(lines, min(left, AT_ONCE))]):
        if any(len(row) <= max(columns) for row in batch):
            raise UnreadableError("a vertex is not three numbers")
        parts.append(_numbers([pick(row) for row in batch]))
        left -= len(batch)
    if left:
        raise UnreadableError(f"its header names {count} vertices, but {count - left} follow")
    return np.concatenate(parts)


def read_polygons(lines: Iterator[bytes], count: int) -> Polygons:
    """From lines that first count their own corners: 3 4 5 6."""
    polygons = Polygons()
    for number in range(count):
        if (line := next(lines, None)) is None:
            raise UnreadableError(f"its header names {count} faces, but {number} follow")
        size, *rest = line.split()
        corners = [int(index) for index in rest[: max(int(size), 0)]]
        if len(corners) != int(size):
            raise UnreadableError(f"a face of {int(size)} corners lists {len(corners)}")
        polygons.add(corners)
    return polygons


def _numbers(rows: Sequence[Sequence[bytes]]) -> Floats:
    if any(len(row) != 3 for row in rows):
        raise UnreadableError("a vertex is not three numbers")
    return np.array([[float(number) for number in row] for row in rows]).reshape(-1, 3)


def content_lines(content: bytes, begin: int = 0) -> Iterator[bytes]:
    """Without comments and blank lines; one at a time."""
    while begin < len(content):
        end = content.find(b"\n", begin)
        end = len(content) if end < 0 else end
        if end - begin > LONGEST_LINE:
            raise UnreadableError(f"a line of {end - begin} bytes, {LONGEST_LINE} are allowed")
        if line := content[begin:end].partition(b"#")[0].strip():
            yield line
        begin = end + 1
