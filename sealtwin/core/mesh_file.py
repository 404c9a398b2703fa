"""Readers of mesh files. STL, PLY, GLB and 3MF are read with trimesh, OBJ with our own reader.

trimesh gets the bytes of the file and no resolver, so it cannot open a second file such as a material, a texture or a
buffer. What it would lose in silence is refused or taken from the file: the last solid of a text STL that is cut short,
digits of a text PLY, and notches of polygons, which it cuts into fans.
"""

import importlib.util
import io
import json
import re
import signal
import sys
import threading
import warnings
import zipfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.records import Floats, Integers

LARGEST_BYTES = 200_000_000
"""Largest file that is read: twice the size of a binary STL of two million triangles. Larger texts should be saved as
binary."""
LARGEST_MODEL = 300_000_000  # Largest 3MF after unpacking: two million triangles take 240 MB of XML
MOST_TRIANGLES = 2_000_000
"""Largest number of triangles: those of a face of 160 x 40 mm scanned every 0.08 mm, a tenth of a particle. Checking
and cutting so many takes 2 GB of memory."""
BEYOND_ANY_UNIT = 1e9  # A kilometre in microns
FLAT = 1e-9  # Share of a polygon's squared area by which a triangle of its fan may be turned: corners on a line

FileUnit = Literal["micron", "mm", "cm", "m", "inch", "foot"]
UNITS_OF_3MF: dict[str, FileUnit] = {
    "micron": "micron",
    "millimeter": "mm",
    "millimeters": "mm",  # trimesh's word for a file without a unit
    "centimeter": "cm",
    "inch": "inch",
    "foot": "foot",
    "meter": "m",
}
COMMA = re.compile(rb"^[ \t]*(?:v[ \t]|vertex[ \t])?[ \t]*([-+]?[0-9]+,[0-9]+)", re.IGNORECASE | re.MULTILINE)
"""A line of coordinates whose first number has a decimal comma."""


class UnreadableError(ValueError):
    """Fault in the content of a mesh file. Its text is the end of a sentence about the file."""


@dataclass(frozen=True)
class Triangles:
    """Triangles of a mesh file, in its own unit and axes."""

    vertices: Floats  # Coordinates, (v, 3)
    faces: Integers  # Vertex numbers of the triangles, (f, 3)
    unit: FileUnit | None = None  # Unit given in the file; most formats have none


def read_mesh(path: Path, remedy: str = "Save it again.") -> Triangles:
    """Read the triangles of an STL, PLY, OBJ, GLB or 3MF file, in the file's own unit and axes.

    Raises InputError if the file is missing or too large, its format does not match its suffix, or it lacks triangles
    or has a number that is not finite. The message ends with ``remedy`` if the content is at fault.
    """
    kind = path.suffix.lower()
    if not path.is_file():
        raise InputError(f"{path}: no such mesh file. {remedy}")
    if kind not in READERS:
        names = ", ".join(name[1:].upper() for name in READERS)
        raise InputError(f"{path}: not a supported mesh format. Export triangles, in one file, as one of {names}.")
    if (size := path.stat().st_size) > LARGEST_BYTES:
        raise InputError(
            f"{path}: {size / 1e6:.0f} MB; at most {LARGEST_BYTES / 1e6:.0f} MB are allowed. Simplify or crop the "
            "mesh, or save it as a binary file."
        )
    if kind == ".3mf" and importlib.util.find_spec("lxml") is None:
        raise InputError(f"{path}: 3MF needs lxml: install sealtwin[3mf], or save the mesh as STL.")
    content = read_bytes(path, LARGEST_BYTES)
    load_trimesh()
    try:
        return _parsed(lambda: READERS[kind](content))
    except UnreadableError as fault:
        if comma := COMMA.search(content):
            number = comma[1].decode()
            raise InputError(
                f"{path}: its decimals are commas, as in {number}. Save it with decimal points."
            ) from fault
        raise InputError(f"{path}: not a readable {kind[1:].upper()}: {fault}. {remedy}") from fault


def _parsed(parse: Callable[[], Triangles]) -> Triangles:
    try:
        # Numbers near the largest float overflow, and signalling NaNs warn; both are refused.
        with warnings.catch_warnings(), np.errstate(over="ignore", invalid="ignore"):
            warnings.simplefilter("ignore")
            # numpy only warns if a text that is not a number ends an array early, and triangles would be lost.
            warnings.filterwarnings("error", "string or file could not be read", DeprecationWarning)
            return parse()
    except UnreadableError:
        raise
    except Exception as fault:  # On damaged bytes, trimesh and zipfile raise errors of any kind.
        raise UnreadableError(f"its content cannot be parsed ({str(fault) or type(fault).__name__})") from fault


def _refuse_too_many(count: int) -> None:
    if count > MOST_TRIANGLES:
        raise UnreadableError(
            f"it has {count} triangles; at most {MOST_TRIANGLES} are allowed: simplify or crop the mesh"
        )


def _checked(vertices: Floats, faces: Iterable[Sequence[int]], unit: FileUnit | None = None) -> Triangles:
    """Return the triangles of polygons, each inside its polygon. Faces with less than three corners are omitted."""
    if isinstance(faces, np.ndarray) and faces.ndim == 2:
        alike = {faces.shape[1]: faces}
    else:
        alike = dict[int, Any]()
        for ring in faces:
            alike.setdefault(len(ring), []).append(ring)
    polygons = [np.array(alike[size], dtype=np.int64) for size in sorted(alike) if size > 2 and len(alike[size])]
    _refuse_too_many(sum(rings.size - 2 * len(rings) for rings in polygons))
    if not polygons:
        raise UnreadableError("it has no triangle")
    count = len(vertices)
    for rings in polygons:
        if not 0 <= rings.min() <= rings.max() < count:
            raise UnreadableError(f"a face names vertex {rings.max()} of {count}, counted from 0")
    if (wrong := ~(np.abs(vertices) < BEYOND_ANY_UNIT).all(axis=1)).any():
        raise UnreadableError(
            f"{wrong.sum()} of {count} vertices are not finite or beyond {BEYOND_ANY_UNIT:g}; the first is vertex "
            f"{wrong.argmax()}, counted from 0"
        )
    return Triangles(vertices, np.concatenate([_triangles(vertices, rings) for rings in polygons]), unit)


def _triangles(vertices: Floats, rings: Integers) -> Integers:
    """Return polygons (n, corners) as fans (f, 3). Raises UnreadableError if a fan leaves its polygon."""
    fans = np.stack([rings[:, [0, k, k + 1]] for k in range(1, rings.shape[1] - 1)], axis=1)
    a, b, c = np.moveaxis(vertices[fans], 2, 0)
    across = np.cross(b - a, c - a)
    normal = across.sum(axis=1, keepdims=True)
    alike = (across * normal).sum(axis=2) >= -FLAT * (normal**2).sum(axis=2)
    if not alike.all():
        corners = [vertex + 1 for vertex in rings[np.argmin(alike.all(axis=1))].tolist()]
        raise UnreadableError(f"the face with the corners {corners} has a notch: let its program save triangles")
    return fans.reshape(-1, 3)


def _read_stl(content: bytes) -> Triangles:
    is_text = b"\0" not in content or (content[:200].lstrip()[:5].lower() == b"solid" and b"facet" in content[:2000])
    count, follow = int.from_bytes(content[80:84], "little"), len(content) - 84
    if is_text:
        content = _in_ascii(content)
    elif follow != 50 * count:
        raise UnreadableError(f"its header counts {count} triangles of 50 bytes, but {follow} bytes follow")
    triangles = _read_scene(content, "stl")
    named = len(re.findall(rb"^[ \t]*vertex\b", content, re.IGNORECASE | re.MULTILINE))
    # trimesh omits a solid whose end is missing.
    if is_text and named != 3 * len(triangles.faces):
        raise UnreadableError(
            f"it is cut short: it lists {named} corners, but only {3 * len(triangles.faces)} are three numbers in a "
            "finished solid"
        )
    return triangles


def _in_ascii(text: bytes) -> bytes:
    """Replace each byte that is not ASCII, for example in a comment, by a question mark."""
    return text.decode("ascii", "replace").encode("ascii", "replace")


def _read_ply(content: bytes) -> Triangles:
    from trimesh.exchange.ply import load_ply

    header, end, body = content.partition(b"end_header")
    if b"format ascii" in header:
        # trimesh rounds the digits of a text to the type in its header.
        header = re.sub(rb"property float(32)? ", b"property double ", header)
    stream = io.BytesIO(_in_ascii(header) + end + body)
    loaded = load_ply(stream, skip_materials=True, fix_texture=False)
    elements, vertices = loaded["metadata"]["_ply_raw"], loaded.get("vertices", ())
    if not {"vertex", "face"} <= elements.keys():
        raise UnreadableError(f"it must have vertices and faces, but has {', '.join(elements) or 'nothing'}")
    # trimesh cuts polygons into fans: take the rows of the file.
    table: Any = elements["face"].get("data", {"vertex_index": ()})
    rings = table[next(name for name in ("vertex_indices", "vertex_index") if name in elements["face"]["properties"])]
    faces = rings["f1"] if isinstance(table, np.ndarray) else rings
    for rows, element in ((vertices, "vertex"), (faces, "face")):
        if len(rows) != elements[element]["length"]:
            raise UnreadableError(
                f"its header gives {elements[element]['length']} of {element}, but {len(rows)} follow"
            )
    return _checked(np.array(vertices, dtype=float).reshape(-1, 3), faces)


def _read_glb(content: bytes) -> Triangles:
    scene = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
    if required := scene.get("extensionsRequired"):
        raise UnreadableError(f"it needs the extension {required[0]}: save it uncompressed")
    # trimesh fills an accessor without numbers with as many zeros as its count claims.
    _refuse_too_many(max((accessor["count"] for accessor in scene.get("accessors", ())), default=0) // 3)
    return _read_scene(content, "glb")


def _read_3mf(content: bytes) -> Triangles:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entries = archive.infolist()
        models = [entry for entry in entries if entry.filename.lower().endswith(".model")]
        if len(models) != 1:
            raise UnreadableError(
                f"it has {len(models)} models, but only one can be read: save all parts as one object"
            )
        if (size := sum(entry.file_size for entry in entries)) > LARGEST_MODEL:
            raise UnreadableError(f"it unpacks to {size} bytes; at most {LARGEST_MODEL} are allowed")
        if not re.search(rb"<(\w+:)?item\b", archive.read(models[0])):
            raise UnreadableError("it has no build item, so none of its objects is placed: put one on the plate")
    return _read_scene(content, "3mf")


def _read_scene(content: bytes, kind: str) -> Triangles:
    """Return the triangles of all meshes of a scene, each at the position that its nodes define."""
    import trimesh

    scene = trimesh.load_scene(io.BytesIO(content), file_type=kind, process=False, skip_materials=True)
    nodes = [scene.graph[name][1] for name in scene.graph.nodes_geometry]
    _refuse_too_many(sum(len(getattr(scene.geometry[name], "faces", ())) for name in nodes))
    mesh, unit = scene.to_mesh(), None
    if kind == "3mf" and (unit := UNITS_OF_3MF.get(scene.metadata["units"])) is None:
        raise UnreadableError(f"its unit is {scene.metadata['units']}, which is not a unit of 3MF")
    return _checked(np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.int64), unit)


def _read_obj(content: bytes) -> Triangles:
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for words in map(bytes.split, re.sub(rb"\\\r?\n|#.*", b" ", content).splitlines()):
        if words[:1] == [b"v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == [b"f"]:
            named = [int(word.partition(b"/")[0]) for word in words[1:]]
            # Counted from 1, or backward from the latest vertex.
            faces.append([number - 1 if number > 0 else len(vertices) + number for number in named])
    return _checked(np.array(vertices, dtype=float).reshape(-1, 3), faces)


READERS: dict[str, Callable[[bytes], Triangles]] = {
    ".stl": _read_stl,
    ".ply": _read_ply,
    ".obj": _read_obj,
    ".glb": _read_glb,
    ".3mf": _read_3mf,
}
"""Reader of each format, by the suffix of a file."""


def load_trimesh() -> None:
    """Import trimesh, and delay Ctrl-C until it is imported.

    trimesh catches every exception during its own imports, including an interrupt, which would then be lost.
    """
    if "trimesh" in sys.modules or threading.current_thread() is not threading.main_thread():
        return
    interrupts = list[int]()
    before = signal.signal(signal.SIGINT, lambda number, _: interrupts.append(number))
    try:
        import trimesh  # noqa: F401  # pyright: ignore[reportUnusedImport]
    finally:
        signal.signal(signal.SIGINT, before or signal.default_int_handler)
    if interrupts:
        signal.raise_signal(signal.SIGINT)
