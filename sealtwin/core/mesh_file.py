"""Readers of mesh files. STL, PLY and GLB are read with trimesh.

trimesh gets the bytes of the file and no resolver, so it cannot open a second file such as a material, a texture or a
buffer. The number of triangles that trimesh reads is compared with the number that the file lists, for two reasons.
trimesh leaves out a solid whose end is missing. It also cuts polygons into fans of triangles, which is wrong for a
polygon with a notch.
"""

import io
import json
import re
import signal
import sys
import threading
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.records import Floats, Integers

LARGEST_BYTES = 200_000_000
"""Largest mesh file that is read, in bytes: twice the size of a binary STL with two million triangles."""
MAX_TRIANGLES = 2_000_000
"""Largest number of triangles that are read. Checking and cutting them takes 2 GB of memory.

The limit allows a scan of a face of 160 x 40 mm with a point every 0.08 mm, a tenth of a particle."""
BEYOND_ANY_UNIT = 1e9  # Limit of a coordinate, in the unit of the file: one kilometre in micrometres

COMMA = re.compile(rb"^[ \t]*(?:v[ \t]|vertex[ \t])?[ \t]*([-+]?[0-9]+,[0-9]+)", re.IGNORECASE | re.MULTILINE)
"""Pattern of a line of coordinates whose first number has a decimal comma."""


class UnreadableError(ValueError):
    """Fault in the content of a mesh file. Its text completes a sentence that begins with the name of the file."""


@dataclass(frozen=True)
class Triangles:
    """Triangles of a mesh file, in the unit and the axes of the file."""

    vertices: Floats  # Coordinates, (v, 3)
    faces: Integers  # Vertex numbers of the triangles, (f, 3)


def read_mesh(path: Path, remedy: str = "Save it again.") -> Triangles:
    """Read the triangles of an STL, PLY or GLB file, in the unit and the axes of the file.

    Raises InputError if the file is missing or too large, if its format does not match its suffix, or if it has no
    triangles, polygons with more than three corners, or a number that is not finite. If the content is at fault, the
    message ends with ``remedy``.
    """
    suffix = path.suffix.lower()
    if not path.is_file():
        raise InputError(f"{path}: no such mesh file. {remedy}")
    if suffix not in READERS:
        names = ", ".join(name[1:].upper() for name in READERS)
        raise InputError(f"{path}: not a supported mesh format. Export triangles to one file: {names}.")
    if (size := path.stat().st_size) > LARGEST_BYTES:
        raise InputError(
            f"{path}: the file has {size / 1e6:.0f} MB, but at most {LARGEST_BYTES / 1e6:.0f} MB are allowed. Simplify "
            "or crop the mesh, or save it as a binary file."
        )
    content = read_bytes(path, LARGEST_BYTES)
    load_trimesh()
    try:
        # Very large numbers and signalling NaNs cause warnings here. Both are refused below.
        with warnings.catch_warnings(), np.errstate(over="ignore", invalid="ignore"):
            warnings.simplefilter("ignore")
            # NumPy only warns if text that is not a number ends an array early, and triangles would then be lost.
            warnings.filterwarnings("error", "string or file could not be read", DeprecationWarning)
            return READERS[suffix](content)
    except Exception as fault:  # For damaged bytes, trimesh raises exceptions of any kind.
        if comma := COMMA.search(content):
            number = comma[1].decode()
            raise InputError(
                f"{path}: numbers have decimal commas, as in {number}. Save the mesh with decimal points."
            ) from fault
        wrong = str(fault) or type(fault).__name__
        if not isinstance(fault, UnreadableError):
            wrong = f"its content cannot be parsed ({wrong})"
        raise InputError(f"{path}: not a readable {suffix[1:].upper()}: {wrong}. {remedy}") from fault


def _refuse_too_many(count: int) -> None:
    if count > MAX_TRIANGLES:
        raise UnreadableError(
            f"it has {count} triangles, but at most {MAX_TRIANGLES} are allowed; simplify or crop the mesh"
        )


def _checked(vertices: Floats, faces: Integers) -> Triangles:
    _refuse_too_many(len(faces))
    if not len(faces):
        raise UnreadableError("it has no triangles")
    count = len(vertices)
    if not 0 <= faces.min() <= faces.max() < count:
        raise UnreadableError(f"a face refers to vertex {faces.max()} (counted from 0), but there are {count} vertices")
    if (wrong := ~(np.abs(vertices) < BEYOND_ANY_UNIT).all(axis=1)).any():
        raise UnreadableError(
            f"vertex {wrong.argmax()} (counted from 0) has a coordinate that is not within +-{BEYOND_ANY_UNIT:g}"
        )
    return Triangles(vertices, faces)


def _read_scene(content: bytes, kind: str, listed: float | None = None) -> Triangles:
    """Return the triangles of all meshes of a scene, placed by the scene's nodes.

    ``listed`` is the number of faces that the file lists. Raises UnreadableError if trimesh reads another number.
    """
    import trimesh

    scene = trimesh.load_scene(io.BytesIO(content), file_type=kind, process=False, skip_materials=True)
    nodes = [scene.graph[name][1] for name in scene.graph.nodes_geometry]
    count = sum(len(getattr(scene.geometry[name], "faces", ())) for name in nodes)
    _refuse_too_many(count)
    if listed not in (None, count):
        raise UnreadableError(
            f"it lists {listed:g} faces, but {count} triangles can be read; the file is incomplete or has polygons"
        )
    mesh = scene.to_mesh()
    return _checked(np.array(mesh.vertices, float), np.array(mesh.faces, np.int64))


def _read_stl(content: bytes) -> Triangles:
    if content[:200].lstrip()[:5].lower() != b"solid" or b"facet" not in content[:2000].lower():
        count, follow = int.from_bytes(content[80:84], "little"), len(content) - 84
        if follow != 50 * count:
            raise UnreadableError(f"its header announces {count} triangles of 50 bytes, but {follow} bytes follow")
        return _read_scene(content, "stl", count)
    named = re.findall(rb"^[ \t]*vertex\b", content, re.IGNORECASE | re.MULTILINE)
    return _read_scene(_in_ascii(content), "stl", len(named) / 3)


def _in_ascii(text: bytes) -> bytes:
    """Return ``text`` with a question mark in place of each byte that is not ASCII."""
    return text.decode("ascii", "replace").encode("ascii", "replace")


def _read_ply(content: bytes) -> Triangles:
    header, end, body = content.partition(b"end_header")
    count = re.search(rb"^element face (\d+)", header, re.MULTILINE)
    if not count:
        raise UnreadableError("it has no faces")
    if b"format ascii" in header:
        # trimesh rounds the numbers of a text file to the type that the header states.
        header = re.sub(rb"property float(32)? ", b"property double ", header)
    return _read_scene(_in_ascii(header) + end + body, "ply", int(count[1]))


def _read_glb(content: bytes) -> Triangles:
    scene = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
    # For an accessor without data, trimesh makes as many zeros as the file's count claims.
    _refuse_too_many(max((accessor["count"] for accessor in scene.get("accessors", ())), default=0) // 3)
    return _read_scene(content, "glb")


READERS: dict[str, Callable[[bytes], Triangles]] = {".stl": _read_stl, ".ply": _read_ply, ".glb": _read_glb}
"""Reader of each mesh format, by file suffix."""


def load_trimesh() -> None:
    """Import trimesh, and delay Ctrl-C until it is imported.

    trimesh catches every exception during its imports. An interrupt would therefore be lost.
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
