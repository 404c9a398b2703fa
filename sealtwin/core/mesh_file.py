"""Readers of mesh files. STL, PLY, GLB and 3MF are read with trimesh, OBJ with our own reader.

trimesh gets the bytes of the file and no resolver, so it cannot open a second file such as a material, a texture or a
buffer.
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
"""Largest number of triangles: those of a face of 160 x 40 mm scanned every 0.08 mm, a tenth of a particle. Repairing
and checking so many takes 2 GB of memory."""
LARGEST_NUMBER = 2**31 - 1
BEYOND_ANY_UNIT = 1e9  # A kilometre in microns

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
INSTEAD = {
    ".gltf": "a .gltf has its numbers in other files; save it as .glb, which is one file",
    **dict.fromkeys((".step", ".stp", ".iges", ".igs"), "it has CAD surfaces; export triangles from the CAD program"),
    **dict.fromkeys((".las", ".laz", ".xyz", ".pts", ".e57"), "it has points without faces; mesh them first"),
}


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
        raise InputError(f"{path}: {INSTEAD.get(kind, 'not a supported mesh format')}. Give one of {names}.")
    if (size := path.stat().st_size) > LARGEST_BYTES:
        raise InputError(
            f"{path}: {size / 1e6:.0f} MB; at most {LARGEST_BYTES / 1e6:.0f} MB are allowed. Simplify or crop the "
            "mesh, or save it as a binary file."
        )
    if kind == ".3mf" and importlib.util.find_spec("lxml") is None:
        raise InputError(f"{path}: 3MF needs lxml: install sealtwin[3mf], or save the mesh as STL.")
    content = read_bytes(path, LARGEST_BYTES)
    try:
        # Numbers near the largest float overflow, and signalling NaNs warn; both are refused below.
        with np.errstate(over="ignore", invalid="ignore"):
            return READERS[kind](content)
    except UnreadableError as fault:
        if comma := COMMA.search(content):
            number = comma[1].decode()
            raise InputError(
                f"{path}: its decimals are commas, as in {number}. Save it with decimal points."
            ) from fault
        raise InputError(f"{path}: not a readable {kind[1:].upper()}: {fault}. {remedy}") from fault


def fill_ring(ring: Floats) -> Integers:
    """Triangulate a nearly flat ring (n, 3); return its triangles, oriented like the ring, (n - 2, 3).

    The ring need not be convex. Raises UnreadableError if its area is 0.
    """
    from manifold3d import triangulate

    ring = ring - ring[0]
    # Twice the area as a vector (Newell): the mean normal, whatever the ring's shape.
    normal = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    if not normal.any():
        raise UnreadableError(f"a face of {len(ring)} corners has no area")
    across = np.linalg.svd(normal[None] / np.abs(normal).max())[2][1:]
    if np.linalg.det(np.vstack([across, normal])) < 0:
        across = across[::-1]
    return np.asarray(triangulate([np.ascontiguousarray(ring @ across.T)]), dtype=np.int64)


def _refuse_too_many(count: int) -> None:
    if count > MOST_TRIANGLES:
        raise UnreadableError(
            f"it has {count} triangles; at most {MOST_TRIANGLES} are allowed: simplify or crop the mesh"
        )


def _checked(vertices: Floats, polygons: Sequence[Integers], unit: FileUnit | None = None) -> Triangles:
    """Return the triangles of polygons. ``polygons`` has one array (n, corners) for each number of corners."""
    _refuse_too_many(sum(len(rings) * (rings.shape[1] - 2) for rings in polygons))
    if not any(map(len, polygons)):
        raise UnreadableError("it has no triangle")
    count = len(vertices)
    for rings in polygons:
        if not 0 <= rings.min() <= rings.max() < count:
            raise UnreadableError(f"a face names vertex {rings.max()} of {count}, counted from 0")
    wrong = np.flatnonzero(~(np.abs(vertices) < BEYOND_ANY_UNIT).all(axis=1))
    if len(wrong):
        raise UnreadableError(
            f"{len(wrong)} of {count} vertices are not finite or beyond {BEYOND_ANY_UNIT:g}; the first is vertex "
            f"{wrong[0]}, counted from 0"
        )
    return Triangles(vertices, np.concatenate([_halved_or_filled(vertices, rings) for rings in polygons]), unit)


def _halved_or_filled(vertices: Floats, rings: Integers) -> Integers:
    """Return triangles (f, 3) of polygons (n, corners). Each triangle is inside its polygon."""
    if rings.shape[1] == 3:
        return rings
    if rings.shape[1] > 4:
        return np.concatenate([ring[fill_ring(vertices[ring])] for ring in rings])
    a, b, c, d = vertices[rings].transpose(1, 0, 2)
    # Cut along the diagonal whose two halves have the same orientation.
    alike = (np.cross(b - a, c - a) * np.cross(c - a, d - a)).sum(axis=1) >= 0
    first = np.where(alike[:, None], rings[:, [0, 1, 2]], rings[:, [0, 1, 3]])
    second = np.where(alike[:, None], rings[:, [0, 2, 3]], rings[:, [1, 2, 3]])
    return np.concatenate([first, second])


def _grouped(faces: Iterable[Sequence[int]]) -> list[Integers]:
    """Group faces by their number of corners. Faces with fewer than three corners are omitted."""
    if isinstance(faces, np.ndarray) and faces.ndim == 2:
        return [faces.astype(np.int64)] if faces.shape[1] > 2 else []
    alike: dict[int, list[Sequence[int]]] = {}
    for corners in faces:
        alike.setdefault(len(corners), []).append(corners)
    return [np.array(alike[size], dtype=np.int64) for size in sorted(alike) if size > 2]


def _parsed(parse: Callable[[], Any]) -> Any:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # numpy only warns if a text that is not a number ends an array early, and triangles would be lost.
            warnings.filterwarnings("error", "string or file could not be read", DeprecationWarning)
            return parse()
    except Exception as fault:  # On damaged bytes, trimesh and zipfile raise errors of any kind.
        raise UnreadableError(f"its content cannot be parsed ({str(fault) or type(fault).__name__})") from fault


def _read_stl(content: bytes) -> Triangles:
    load_trimesh()
    from trimesh.exchange.stl import load_stl

    is_binary = _is_binary_stl(content)
    text = content if is_binary else _in_ascii(content)
    loaded = _parsed(lambda: load_stl(io.BytesIO(text)))
    solids = [solid for solid in loaded.get("geometry", {"": loaded}).values() if solid]
    corners = np.concatenate([np.empty((0, 3)), *(solid["vertices"] for solid in solids)])
    # trimesh omits a solid whose end is missing.
    named = len(re.findall(rb"^[ \t]*vertex\b", content, re.IGNORECASE | re.MULTILINE))
    if not is_binary and named != len(corners):
        raise UnreadableError(
            f"it is cut short: it lists {named} corners, but only {len(corners)} are three numbers in a finished solid"
        )
    return _checked(corners, [np.arange(len(corners)).reshape(-1, 3)])


def _is_binary_stl(content: bytes) -> bool:
    """Return True for a binary STL. Raises UnreadableError if its size does not match its number of triangles."""
    if b"\0" not in content or (content[:200].lstrip().lower().startswith(b"solid") and b"facet" in content[:2000]):
        return False
    if len(content) < 84:
        raise UnreadableError(f"it has {len(content)} bytes; the header of a binary STL has 84")
    count = int.from_bytes(content[80:84], "little")
    more = len(content) - 84 - 50 * count
    if more > 0:
        raise UnreadableError(
            f"its header counts {count} triangles, but {more} {'byte follows' if more == 1 else 'bytes follow'} them"
        )
    if more < 0:
        raise UnreadableError(f"its header counts {count} triangles, but the file ends {-more} bytes before their end")
    return True


def _in_ascii(text: bytes) -> bytes:
    """Replace each byte that is not ASCII, for example in a comment, by a question mark."""
    return text.decode("ascii", "replace").encode("ascii", "replace")


def _read_ply(content: bytes) -> Triangles:
    load_trimesh()
    from trimesh.exchange.ply import load_ply

    header, end, body = content.partition(b"end_header")
    if b"format ascii" in header:
        # trimesh rounds the digits of a text to the type in its header.
        header = re.sub(rb"property float(32)? ", b"property double ", header)
    content = _in_ascii(header) + end + body
    loaded = _parsed(lambda: load_ply(io.BytesIO(content), skip_materials=True, fix_texture=False))
    elements = loaded["metadata"]["_ply_raw"]
    if not {"vertex", "face"} <= elements.keys() or "vertices" not in loaded:
        raise UnreadableError(f"it must have vertices and faces, but has {', '.join(elements) or 'nothing'}")
    # trimesh cuts polygons into fans, which is wrong for those that are not convex: take the rows of the file.
    table = elements["face"].get("data")
    named = [name for name in ("vertex_indices", "vertex_index") if name in elements["face"]["properties"]]
    faces: Any = [] if table is None or not named else table[named[0]]
    if isinstance(table, np.ndarray) and named:
        faces = faces["f1"]
    for rows, element in ((loaded["vertices"], "vertex"), (faces, "face")):
        if len(rows) != elements[element]["length"]:
            raise UnreadableError(
                f"its header gives {elements[element]['length']} of {element}, but {len(rows)} follow"
            )
    if loaded["vertices"].dtype == object:
        raise UnreadableError("a vertex is not three numbers")
    return _checked(loaded["vertices"].astype(float), _grouped(faces))


def _read_glb(content: bytes) -> Triangles:
    try:
        scene = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
        required = scene.get("extensionsRequired")
        most = max((accessor["count"] for accessor in scene.get("accessors", ())), default=0)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as fault:
        raise UnreadableError(f"its description is not the JSON of a glTF ({fault})") from fault
    if any("uri" in buffer for buffer in scene.get("buffers", ())):
        raise UnreadableError("its numbers are in another file, which is not opened: save all in one GLB")
    if required:
        raise UnreadableError(f"it needs the extension {required[0]}: save it uncompressed")
    # trimesh fills an accessor without numbers with as many zeros as its count claims.
    _refuse_too_many(most // 3)
    return _placed(content, "glb", "m")


def _read_3mf(content: bytes) -> Triangles:
    entries: list[zipfile.ZipInfo] = _parsed(lambda: zipfile.ZipFile(io.BytesIO(content)).infolist())
    models = sum(entry.filename.lower().endswith(".model") for entry in entries)
    if models != 1:
        raise UnreadableError(f"it has {models} models, but only one can be read: save all parts as one object")
    if (size := sum(entry.file_size for entry in entries)) > LARGEST_MODEL:
        raise UnreadableError(f"it unpacks to {size} bytes; at most {LARGEST_MODEL} are allowed")
    return _placed(content, "3mf", None)


def _placed(content: bytes, kind: str, unit: FileUnit | None) -> Triangles:
    """Return the triangles of all meshes of a scene, each at the position that its nodes define."""
    load_trimesh()
    import trimesh

    scene = _parsed(lambda: trimesh.load_scene(io.BytesIO(content), file_type=kind, process=False, skip_materials=True))
    nodes = [scene.graph[name][1] for name in scene.graph.nodes_geometry]
    _refuse_too_many(sum(len(getattr(scene.geometry[name], "faces", ())) for name in nodes))
    mesh = _parsed(scene.to_mesh)
    if unit is None and (unit := UNITS_OF_3MF.get(scene.metadata["units"])) is None:
        raise UnreadableError(f"its unit is {scene.metadata['units']}, which is not a unit of 3MF")
    return _checked(np.array(mesh.vertices, dtype=float), [np.array(mesh.faces, dtype=np.int64)], unit)


def _read_obj(content: bytes) -> Triangles:
    vertices: list[list[bytes]] = []
    faces: list[list[int]] = []
    for words in map(bytes.split, re.sub(rb"\\\r?\n|#.*", b" ", content).splitlines()):
        if words[:1] == [b"v"]:
            vertices.append(words[1:4])
        elif words[:1] == [b"f"]:
            named = _integers([word.partition(b"/")[0] for word in words[1:]])
            # Counted from 1, or backward from the latest vertex.
            faces.append([number - 1 if number > 0 else len(vertices) + number for number in named])
    return _checked(_coordinates(vertices), _grouped(faces))


def _integers(words: Sequence[bytes]) -> list[int]:
    try:
        numbers = [int(word) for word in words]
    except ValueError:
        raise UnreadableError("a vertex number is not a whole number") from None
    if any(abs(number) > LARGEST_NUMBER for number in numbers):
        raise UnreadableError(f"a vertex number is beyond {LARGEST_NUMBER}")
    return numbers


def _coordinates(rows: Iterable[Sequence[bytes]]) -> Floats:
    try:
        return np.array([[float(word) for word in row] for row in rows]).reshape(-1, 3)
    except ValueError:
        raise UnreadableError("a vertex is not three numbers") from None


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
