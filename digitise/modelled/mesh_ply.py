"""PLY, text and binary of either byte order."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from digitise.modelled.mesh_text import content_lines, read_vertices
from digitise.modelled.triangles import MOST_TRIANGLES, MOST_VERTICES, Polygons, Triangles, UnreadableError
from sealtwin.records import Floats

LONGEST_HEADER = 64_000
KINDS = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
CORNERS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str
    size_kind: str | None
    """Of the number that precedes a list; None for a single value."""


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property]


def read_ply(content: bytes) -> Triangles:
    order, elements, begin = _header(content)
    names = [element.name for element in elements]
    if "vertex" not in names or "face" not in names:
        what = "triangle strips" if "tristrips" in names else f"no vertices and faces, but {', '.join(names) or 'none'}"
        raise UnreadableError(f"it holds {what}")
    if order == "text":
        vertices, polygons = _read_text(content_lines(content, begin), elements)
    else:
        vertices, polygons = _read_binary(content, begin, elements, order)
    return Triangles(vertices, polygons.triangles(vertices))


def _header(content: bytes) -> tuple[Literal["text", "<", ">"], list[_Element], int]:
    """Byte order, elements, and where their content begins."""
    marker = content[:LONGEST_HEADER].find(b"end_header")
    if not content.startswith(b"ply") or marker < 0:
        raise UnreadableError("it has no header from 'ply' to 'end_header'")
    begin = content.find(b"\n", marker) + 1 or len(content)
    orders: dict[str, Literal["text", "<", ">"]] = {
        "ascii": "text",
        "binary_little_endian": "<",
        "binary_big_endian": ">",
    }
    order = None
    elements: list[_Element] = []
    for line in content[:marker].decode("ascii", "replace").splitlines():
        match line.split():
            case ["format", name, _]:
                order = orders.get(name)
            case ["element", name, count]:
                elements.append(_Element(name, int(count), []))
            case ["property", "list", size_kind, kind, name] if elements:
                elements[-1].properties.append(_Property(name, KINDS[kind], KINDS[size_kind]))
            case ["property", kind, name] if elements:
                elements[-1].properties.append(_Property(name, KINDS[kind], None))
    if order is None:
        raise UnreadableError("its header names no format that is known")
    for element in elements:
        most = {"vertex": MOST_VERTICES, "face": MOST_TRIANGLES}.get(element.name, len(content))
        if not 0 <= element.count <= most:
            raise UnreadableError(f"its header names {element.count} of {element.name}, {most} are allowed")
    return order, elements, begin


def _read_text(lines: Iterator[bytes], elements: list[_Element]) -> tuple[Floats, Polygons]:
    vertices, polygons = np.empty((0, 3)), Polygons()
    for element in elements:
        if element.name == "vertex":
            names = [item.name for item in element.properties]
            vertices = read_vertices(lines, element.count, [names.index(axis) for axis in "xyz"])
            continue
        for _ in range(element.count):
            words = next(lines, b"").split()
            for item in element.properties:
                size = 1 if item.size_kind is None else int(words.pop(0))
                if len(words) < size:
                    raise UnreadableError(f"a line of {element.name} ends early")
                if element.name == "face" and item.name in CORNERS:
                    polygons.add([int(word) for word in words[:size]])
                del words[:size]
    return vertices, polygons


def _read_binary(content: bytes, at: int, elements: list[_Element], order: str) -> tuple[Floats, Polygons]:
    vertices, polygons = np.empty((0, 3)), Polygons()
    for element in elements:
        if all(item.size_kind is None for item in element.properties):
            row = np.dtype([(item.name, order + item.kind) for item in element.properties])
            _require(content, at, element.count * row.itemsize)
            if element.name == "vertex":
                table = np.frombuffer(content, row, element.count, at)
                vertices = np.column_stack([table[axis] for axis in "xyz"]).astype(float)
            at += element.count * row.itemsize
        else:
            at = _read_lists(content, at, element, order, polygons)
    return vertices, polygons


def _read_lists(content: bytes, at: int, element: _Element, order: str, polygons: Polygons) -> int:
    """Rows of any length, those of faces into ``polygons``; returns where they end.

    Rows mostly look like the one before: as many as do are read at once.
    """
    left = element.count
    while left:
        row, sizes = _row_like(content, at, element, order)
        alike = 1
        # Twice as many each time: what is read in vain costs no more than what is read.
        while (more := min(2 * alike, left)) > alike and at + more * row.itemsize <= len(content):
            table = np.frombuffer(content, row, more, at)
            if not all((table[name] == size).all() for name, size in sizes.items()):
                break
            alike = len(table)
        table = np.frombuffer(content, row, alike, at)
        for item in element.properties:
            if element.name == "face" and item.name in CORNERS and item.size_kind is not None:
                polygons.add_alike(table[item.name].astype(np.int64))
        at += alike * row.itemsize
        left -= alike
    return at


def _row_like(content: bytes, at: int, element: _Element, order: str) -> tuple[np.dtype, dict[str, int]]:
    """The layout of the row at ``at``, and the length of each of its lists by the name of its count."""
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    sizes = {}
    end = at
    for item in element.properties:
        if item.size_kind is not None:
            count = np.dtype(order + item.size_kind)
            _require(content, end, count.itemsize)
            size = int(np.frombuffer(content, count, 1, end)[0])
            if size < 0:
                raise UnreadableError(f"a list of {size} numbers")
            sizes[f"count of {item.name}"] = size
            fields += [(f"count of {item.name}", count.str), (item.name, order + item.kind, (size,))]
            end += count.itemsize + size * np.dtype(item.kind).itemsize
        else:
            fields.append((item.name, order + item.kind))
            end += np.dtype(item.kind).itemsize
        _require(content, end, 0)
    return np.dtype(fields), sizes


def _require(content: bytes, at: int, size: int) -> None:
    if at + size > len(content):
        raise UnreadableError(f"its header names more than the {len(content)} bytes of the file hold")
