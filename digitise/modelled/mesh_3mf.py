"""3MF: a zip with one model in XML, which says its own unit."""

import io
import zipfile
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

import numpy as np

from digitise.modelled.triangles import MOST_VERTICES, FileUnit, Triangles, UnreadableError, refuse_too_many
from sealtwin.records import Floats

LARGEST_MODEL = 300_000_000
"""Bytes of XML, read piece by piece: two million triangles take 240 million."""
MOST_ENTRIES = 10_000
PIECE = 1 << 20
MOST_COMPONENTS, DEEPEST_COMPONENT = 10_000, 32
UNITS: dict[str, FileUnit] = {
    "micron": "micron",
    "millimeter": "mm",
    "centimeter": "cm",
    "inch": "inch",
    "foot": "foot",
    "meter": "m",
}


@dataclass
class _Object:
    corners: array = field(default_factory=lambda: array("d"))
    faces: array = field(default_factory=lambda: array("q"))
    components: list[tuple[str, Floats]] = field(default_factory=list)


@dataclass
class _Model:
    unit: FileUnit = "mm"
    objects: dict[str, _Object] = field(default_factory=dict)
    items: list[tuple[str, Floats]] = field(default_factory=list)


def read_3mf(content: bytes) -> Triangles:
    """All that the build plate holds, where it places it."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        model = _parsed(archive, _model_entry(archive))
    vertices, faces = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)]
    known = 0
    for item, placed in _placed(model):
        refuse_too_many(len(item.faces) // 3 + sum(map(len, faces)))
        _refuse_many_vertices(known + len(item.corners) // 3)
        corners = np.array(item.corners).reshape(-1, 3) @ placed[:3] + placed[3]
        triangles = np.array(item.faces, dtype=np.int64).reshape(-1, 3)
        if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(corners):
            raise UnreadableError("its faces name vertices that are not there")
        # A mirror turns faces inside out.
        faces.append(known + (triangles[:, ::-1] if np.linalg.det(placed[:3]) < 0 else triangles))
        vertices.append(corners)
        known += len(corners)
    return Triangles(np.concatenate(vertices), np.concatenate(faces), model.unit)


def _refuse_many_vertices(count: int) -> None:
    if count > MOST_VERTICES:
        raise UnreadableError(f"it has more than {MOST_VERTICES} vertices: simplify or crop the mesh first")


def _model_entry(archive: zipfile.ZipFile) -> zipfile.ZipInfo:
    entries = archive.infolist()
    if len(entries) > MOST_ENTRIES:
        raise UnreadableError(f"it has {len(entries)} entries, {MOST_ENTRIES} are allowed")
    models = [entry for entry in entries if entry.filename.lower().endswith(".model")]
    if len(models) != 1:
        raise UnreadableError(f"it has {len(models)} models, one is read: save all parts as one object")
    if models[0].file_size > LARGEST_MODEL:
        raise UnreadableError(f"its model unpacks to {models[0].file_size} bytes, {LARGEST_MODEL} are allowed")
    return models[0]


def _parsed(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> _Model:
    model = _Model()
    current = _Object()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal current
        match tag.rpartition(":")[2]:
            case "vertex":
                current.corners.extend([float(attributes[axis]) for axis in "xyz"])
                _refuse_many_vertices(len(current.corners) // 3)
            case "triangle":
                current.faces.extend([int(attributes[corner]) for corner in ("v1", "v2", "v3")])
                refuse_too_many(len(current.faces) // 3)
            case "object":
                current = model.objects[attributes["id"]] = _Object()
            case "component":
                current.components.append((attributes["objectid"], _transform(attributes.get("transform"))))
            case "item":
                model.items.append((attributes["objectid"], _transform(attributes.get("transform"))))
            case "model":
                model.unit = UNITS[attributes.get("unit", "millimeter")]

    def refuse_declarations(*_: object) -> None:
        raise UnreadableError("its XML declares a document type, which no 3MF has")

    parser = expat.ParserCreate()
    parser.StartElementHandler = begin
    # Entities that name one another unfold to gigabytes; they can only be declared here.
    parser.StartDoctypeDeclHandler = refuse_declarations
    with archive.open(entry) as unpacked:
        read = 0
        while piece := unpacked.read(PIECE):
            read += len(piece)
            if read > LARGEST_MODEL:
                raise UnreadableError(f"its model unpacks to more than {LARGEST_MODEL} bytes")
            parser.Parse(piece, False)
    parser.Parse(b"", True)
    return model


def _transform(text: str | None) -> Floats:
    """(4, 3): three rows that turn, and one that moves, for row vectors."""
    if text is None:
        return np.eye(4, 3)
    return np.array([float(number) for number in text.split()]).reshape(4, 3)


def _placed(model: _Model) -> Iterator[tuple[_Object, Floats]]:
    """Each mesh on the build plate and its transform."""
    waiting = [(name, placed, 0) for name, placed in model.items]
    visited = 0
    while waiting:
        name, placed, depth = waiting.pop()
        visited += 1
        if visited > MOST_COMPONENTS or depth > DEEPEST_COMPONENT:
            raise UnreadableError("its components hang in a circle, or are too many")
        item = model.objects[name]
        yield item, placed
        for inner, local in item.components:
            waiting.append((inner, np.vstack([local[:3] @ placed[:3], local[3] @ placed[:3] + placed[3]]), depth + 1))
