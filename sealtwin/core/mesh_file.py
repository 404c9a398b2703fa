"""Readers of mesh files. STL, PLY and GLB, and OBJ of a scan, are read with trimesh.

trimesh gets the bytes of the file and no resolver, so it cannot open a second file such as a material, a texture or a
buffer. The number of triangles that trimesh reads is compared with the number that the file lists, for two reasons.
trimesh leaves out a solid whose end is missing. It also cuts polygons into fans of triangles, which is wrong for a
polygon with a notch.
"""

import io
import json
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.records import Floats, Integers

LARGEST_BYTES = 200_000_000
"""Largest mesh file that is read, in bytes: twice the size of a binary STL with two million triangles."""
MAX_TRIANGLES = 2_000_000
"""Largest number of triangles that are read. Checking and cutting them takes 2 GB of memory.

The limit allows a scan of a face of 160 x 40 mm with a point every 0.08 mm, a tenth of a particle."""
MAX_POINTS = 5_000_000  # Largest number of vertices of a PLY, and of points of a scan
BEYOND_ANY_UNIT = 1e9  # Limit of a coordinate, in the unit of the file: one kilometre in micrometres

T = TypeVar("T")
COMMA = re.compile(rb"^[ \t]*(?:v[ \t]|vertex[ \t])?[ \t]*([-+]?[0-9]+,[0-9]+)", re.IGNORECASE | re.MULTILINE)
"""Pattern of a line of coordinates whose first number has a decimal comma."""


class UnreadableError(ValueError):
    """Fault in the content of a file. Its text completes a sentence that begins with the name of the file.

    ``remedy`` is a sentence that says what to do.
    """

    def __init__(self, fault: str, remedy: str = "Save it again.") -> None:
        self.remedy = remedy
        super().__init__(fault)


@dataclass(frozen=True)
class Triangles:
    """Triangles of a mesh file, in the unit and the axes of the file."""

    vertices: Floats  # Coordinates, (v, 3)
    faces: Integers  # Vertex numbers of the triangles, (f, 3). No rows for a file of points


def read_mesh(path: Path, remedy: str | None = None, *, is_scan: bool = False) -> Triangles:
    """Read the triangles of an STL, PLY or GLB file, in the unit and the axes of the file.

    A scan may also be an OBJ file, or have points instead of triangles.

    Raises InputError if the file is missing or too large, if its format does not match its suffix, or if it has no
    triangles, polygons with more than three corners, or a number that is not finite. If the content is at fault, the
    message ends with ``remedy``. Without it, the message has the remedy of the fault.
    """
    suffix, readers = path.suffix.lower(), {**READERS, ".obj": _read_obj} if is_scan else READERS
    if suffix not in readers and path.is_file():
        names = ", ".join(name[1:].upper() for name in readers)
        raise InputError(f"{path}: not a supported mesh format. Export triangles to one file: {names}.")

    def read(content: bytes) -> Triangles:
        try:
            mesh = readers[suffix](content)
        except Exception as fault:
            if comma := COMMA.search(content):
                raise UnreadableError(
                    f"numbers have decimal commas, as in {comma[1].decode()}", "Save the mesh with decimal points."
                ) from fault
            raise
        if not (is_scan or len(mesh.faces)):
            raise UnreadableError("it has no triangles")
        return mesh

    return read_refusing_damage(path, read, remedy)


def read_refusing_damage(path: Path, read: Callable[[bytes], T], remedy: str | None = None) -> T:
    """Return what ``read`` makes of a file's content.

    Raises InputError if the file is missing or too large, or if ``read`` raises any error. The message ends with
    ``remedy``, or else with that of an UnreadableError.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file. {remedy or 'Correct its path.'}")
    if (size := path.stat().st_size) > LARGEST_BYTES:
        raise InputError(
            f"{path}: the file has {size / 1e6:.0f} MB, but at most {LARGEST_BYTES / 1e6:.0f} MB are allowed. Simplify "
            "or crop it, or save it as a binary file."
        )
    content = read_bytes(path, LARGEST_BYTES)
    try:
        # Very large numbers and signalling NaNs cause warnings here. Both are refused elsewhere.
        with warnings.catch_warnings(), np.errstate(over="ignore", invalid="ignore"):
            warnings.simplefilter("ignore")
            # NumPy only warns if text that is not a number ends an array early, and numbers would then be lost.
            warnings.filterwarnings("error", "string or file could not be read", DeprecationWarning)
            return read(content)
    except Exception as fault:  # For damaged bytes, readers raise exceptions of any kind.
        wrong = fault
        if not isinstance(wrong, UnreadableError):
            wrong = UnreadableError(f"its content cannot be parsed ({str(fault) or type(fault).__name__})")
        kind = path.suffix[1:].upper()
        raise InputError(f"{path}: not a readable {kind}: {wrong!s:.300}. {remedy or wrong.remedy}") from fault


def refuse_too_many(count: int, limit: int = MAX_TRIANGLES, noun: str = "triangles") -> None:
    """Raise UnreadableError if a file has more than ``limit`` triangles or other parts."""
    if count > limit:
        raise UnreadableError(f"it has {count:,} {noun}, but at most {limit:,} are allowed", "Crop it or thin it out.")


def _checked(vertices: Floats, faces: Integers) -> Triangles:
    refuse_too_many(len(faces))
    if not len(faces):
        return Triangles(vertices, faces)
    count = len(vertices)
    if not 0 <= faces.min() <= faces.max() < count:
        raise UnreadableError(f"a face refers to vertex {faces.max()} (counted from 0), but there are {count} vertices")
    if (wrong := ~(np.abs(vertices) < BEYOND_ANY_UNIT).all(axis=1)).any():
        raise UnreadableError(
            f"vertex {wrong.argmax()} (counted from 0) has a coordinate that is not within +-{BEYOND_ANY_UNIT:g}"
        )
    return Triangles(vertices, faces)


def _read_scene(content: bytes, kind: str, listed: float | None = None) -> Triangles:
    """Return the triangles of all meshes of a scene, placed by the scene's nodes, or its points if it has no triangles.

    ``listed`` is the number of faces that the file lists. Raises UnreadableError if trimesh reads another number.
    """
    import trimesh

    scene = trimesh.load_scene(io.BytesIO(content), file_type=kind, process=False, skip_materials=True)
    nodes = [scene.graph[name][1] for name in scene.graph.nodes_geometry]
    count = sum(len(getattr(scene.geometry[name], "faces", ())) for name in nodes)
    refuse_too_many(count)
    if listed not in (None, count):
        raise UnreadableError(
            f"it lists {listed:g} faces, but {count} triangles can be read; the file is incomplete or has polygons"
        )
    if not count and nodes:
        points = np.vstack([getattr(part, "vertices", np.empty((0, 3))) for part in scene.dump()])
        return Triangles(np.asarray(points, float), np.empty((0, 3), np.int64))
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
    points, faces = (
        int(count[1]) if (count := re.search(rb"^element %b (\d+)" % name, header, re.MULTILINE)) else 0
        for name in (b"vertex", b"face")
    )
    refuse_too_many(points, MAX_POINTS, "points")
    if b"format ascii" in header:
        # trimesh rounds the numbers of a text file to the type that the header states.
        header = re.sub(rb"property float(32)? ", b"property double ", header)
    mesh = _read_scene(_in_ascii(header) + end + body, "ply", faces)
    if not faces and len(mesh.vertices) != points:
        raise UnreadableError(f"it lists {points:,} points, but {len(mesh.vertices):,} can be read")
    return mesh


def _read_obj(content: bytes) -> Triangles:
    return _read_scene(content, "obj")


def _read_glb(content: bytes) -> Triangles:
    scene = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
    # For an accessor without data, trimesh makes as many zeros as the file's count claims.
    refuse_too_many(max((accessor["count"] for accessor in scene.get("accessors", ())), default=0) // 3)
    return _read_scene(content, "glb")


READERS: dict[str, Callable[[bytes], Triangles]] = {".stl": _read_stl, ".ply": _read_ply, ".glb": _read_glb}
"""Reader of each mesh format, by file suffix."""
