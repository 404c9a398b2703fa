"""Readers of mesh files. STL, PLY, GLB and 3MF are read with trimesh, OBJ with our own reader.

trimesh gets the bytes of the file and no resolver, so it cannot open a second file such as a material, a texture or a
buffer. It must read as many triangles as the file lists: it omits a solid whose end is missing, and cuts polygons into
fans, which leave those with a notch.
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
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

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

COMMA = re.compile(rb"^[ \t]*(?:v[ \t]|vertex[ \t])?[ \t]*([-+]?[0-9]+,[0-9]+)", re.IGNORECASE | re.MULTILINE)
"""A line of coordinates whose first number has a decimal comma."""


class UnreadableError(ValueError):
    """Fault in the content of a mesh file. Its text is the end of a sentence about the file."""


@dataclass(frozen=True)
class Triangles:
    """Triangles of a mesh file, in its own unit and axes."""

    vertices: Floats  # Coordinates, (v, 3)
    faces: Integers  # Vertex numbers of the triangles, (f, 3)
    unit_mm: float | None = None  # Unit that the file states, in mm; most formats have none


def read_mesh(path: Path, remedy: str = "Save it again.") -> Triangles:
    """Read the triangles of an STL, PLY, OBJ, GLB or 3MF file, in the file's own unit and axes.

    Raises InputError if the file is missing or too large, its format does not match its suffix, or it lacks triangles,
    has polygons, or has a number that is not finite. The message ends with ``remedy`` if the content is at fault.
    """
    suffix = path.suffix.lower()
    if not path.is_file():
        raise InputError(f"{path}: no such mesh file. {remedy}")
    if suffix not in READERS:
        names = ", ".join(name[1:].upper() for name in READERS)
        raise InputError(f"{path}: not a supported mesh format. Export triangles, in one file, as one of {names}.")
    if (size := path.stat().st_size) > LARGEST_BYTES:
        raise InputError(
            f"{path}: {size / 1e6:.0f} MB; at most {LARGEST_BYTES / 1e6:.0f} MB are allowed. Simplify or crop the "
            "mesh, or save it as a binary file."
        )
    if suffix == ".3mf" and importlib.util.find_spec("lxml") is None:
        raise InputError(f"{path}: 3MF needs lxml: install sealtwin[3mf], or save the mesh as STL.")
    content = read_bytes(path, LARGEST_BYTES)
    load_trimesh()
    try:
        # Numbers near the largest float overflow, and signalling NaNs warn; both are refused.
        with warnings.catch_warnings(), np.errstate(over="ignore", invalid="ignore"):
            warnings.simplefilter("ignore")
            # numpy only warns if a text that is not a number ends an array early, and triangles would be lost.
            warnings.filterwarnings("error", "string or file could not be read", DeprecationWarning)
            return READERS[suffix](content)
    except Exception as fault:  # On damaged bytes, trimesh and zipfile raise errors of any kind.
        if comma := COMMA.search(content):
            number = comma[1].decode()
            raise InputError(
                f"{path}: its decimals are commas, as in {number}. Save it with decimal points."
            ) from fault
        wrong = str(fault) or type(fault).__name__
        if not isinstance(fault, UnreadableError):
            wrong = f"its content cannot be parsed ({wrong})"
        raise InputError(f"{path}: not a readable {suffix[1:].upper()}: {wrong}. {remedy}") from fault


def _refuse_too_many(count: int) -> None:
    if count > MOST_TRIANGLES:
        raise UnreadableError(
            f"it has {count} triangles; at most {MOST_TRIANGLES} are allowed: simplify or crop the mesh"
        )


def _checked(vertices: Floats, faces: Integers, unit_mm: float | None = None) -> Triangles:
    _refuse_too_many(len(faces))
    if not len(faces):
        raise UnreadableError("it has no triangle")
    count = len(vertices)
    if not 0 <= faces.min() <= faces.max() < count:
        raise UnreadableError(f"a face names vertex {faces.max()} of {count}, counted from 0")
    if (wrong := ~(np.abs(vertices) < BEYOND_ANY_UNIT).all(axis=1)).any():
        raise UnreadableError(f"vertex {wrong.argmax()}, counted from 0, is not finite or beyond {BEYOND_ANY_UNIT:g}")
    return Triangles(vertices, faces, unit_mm)


def _read_scene(content: bytes, kind: str, listed: float | None = None) -> Triangles:
    """Return the triangles of all meshes of a scene, each at the position that its nodes define.

    ``listed`` is the number of faces that the file lists. Raises UnreadableError if trimesh reads more or less.
    """
    import trimesh

    scene = trimesh.load_scene(io.BytesIO(content), file_type=kind, process=False, skip_materials=True)
    nodes = [scene.graph[name][1] for name in scene.graph.nodes_geometry]
    count = sum(len(getattr(scene.geometry[name], "faces", ())) for name in nodes)
    _refuse_too_many(count)
    if listed not in (None, count):
        raise UnreadableError(
            f"it lists {listed:g} faces, but has {count} triangles that can be read: it is cut short, or has polygons"
        )
    mesh, is_3mf = scene.to_mesh(), kind == "3mf"
    unit_mm = float(trimesh.units.unit_conversion(scene.metadata["units"], "millimeter")) if is_3mf else None
    return _checked(np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.int64), unit_mm)


def _read_stl(content: bytes) -> Triangles:
    if content[:200].lstrip()[:5].lower() != b"solid" or b"facet" not in content[:2000].lower():
        count, follow = int.from_bytes(content[80:84], "little"), len(content) - 84
        if follow != 50 * count:
            raise UnreadableError(f"its header counts {count} triangles of 50 bytes, but {follow} bytes follow")
        return _read_scene(content, "stl", count)
    named = re.findall(rb"^[ \t]*vertex\b", content, re.IGNORECASE | re.MULTILINE)
    return _read_scene(_in_ascii(content), "stl", len(named) / 3)


def _in_ascii(text: bytes) -> bytes:
    """Replace each byte that is not ASCII, for example in a comment, by a question mark."""
    return text.decode("ascii", "replace").encode("ascii", "replace")


def _read_ply(content: bytes) -> Triangles:
    header, end, body = content.partition(b"end_header")
    count = re.search(rb"^element face (\d+)", header, re.MULTILINE)
    if not count:
        raise UnreadableError("it has no faces")
    if b"format ascii" in header:
        # trimesh rounds the digits of a text to the type in its header.
        header = re.sub(rb"property float(32)? ", b"property double ", header)
    return _read_scene(_in_ascii(header) + end + body, "ply", int(count[1]))


def _read_glb(content: bytes) -> Triangles:
    scene = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
    # trimesh fills an accessor without numbers with as many zeros as its count claims.
    _refuse_too_many(max((accessor["count"] for accessor in scene.get("accessors", ())), default=0) // 3)
    return _read_scene(content, "glb")


def _read_3mf(content: bytes) -> Triangles:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entries = archive.infolist()
        models = [entry for entry in entries if entry.filename.lower().endswith(".model")]
        if len(models) != 1:
            raise UnreadableError(f"it has {len(models)} models, not one: save all parts as one object")
        if (size := sum(entry.file_size for entry in entries)) > LARGEST_MODEL:
            raise UnreadableError(f"it unpacks to {size} bytes; at most {LARGEST_MODEL} are allowed")
        if not re.search(rb"<(\w+:)?item\b", archive.read(models[0])):
            raise UnreadableError("it has no build item, so none of its objects is placed: put one on the plate")
    return _read_scene(content, "3mf")


def _read_obj(content: bytes) -> Triangles:
    """Read an OBJ. trimesh counts backward from the last vertex of the file, and misses lines that are indented."""
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for words in map(bytes.split, re.sub(rb"\\\r?\n|#.*", b" ", content).splitlines()):
        if words[:1] == [b"v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == [b"f"]:
            if len(words) != 4:
                raise UnreadableError(f"a face has {len(words) - 1} corners: let its program save triangles")
            named = [int(word.partition(b"/")[0]) for word in words[1:]]
            # Counted from 1, or backward from the latest vertex.
            faces.append([number - 1 if number > 0 else len(vertices) + number for number in named])
    return _checked(np.array(vertices, dtype=float).reshape(-1, 3), np.array(faces, dtype=np.int64))


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
