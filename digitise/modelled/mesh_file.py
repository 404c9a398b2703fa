"""A mesh from a file that somebody else has written: checked before it is believed, and never more than it holds.

The readers are our own. They allocate what the file's bytes can fill and not what its header claims, and open nothing
beside it: no material, no texture, no second buffer, no network.
"""

import json
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from xml.parsers.expat import ExpatError

import numpy as np

from digitise.modelled.mesh_3mf import read_3mf
from digitise.modelled.mesh_glb import read_glb
from digitise.modelled.mesh_ply import read_ply
from digitise.modelled.mesh_stl import read_stl
from digitise.modelled.mesh_text import read_obj, read_off
from digitise.modelled.triangles import Triangles
from sealtwin.errors import InputError

LARGEST_BYTES = 200_000_000
"""Twice a binary STL of two million triangles; larger text is better saved as binary."""
BEYOND_ANY_UNIT = 1e9
"""A kilometre in microns."""
READERS: dict[str, Callable[[bytes], Triangles]] = {
    ".stl": read_stl,
    ".ply": read_ply,
    ".obj": read_obj,
    ".off": read_off,
    ".glb": read_glb,
    ".3mf": read_3mf,
}
INSTEAD = {
    ".gltf": "a .gltf keeps its numbers in other files; save it as .glb, which is one",
    **dict.fromkeys(
        (".step", ".stp", ".iges", ".igs"), "this holds CAD surfaces; export triangles from the CAD program"
    ),
    **dict.fromkeys((".las", ".laz", ".xyz", ".pts", ".e57"), "this holds points without faces; mesh them first"),
}
FAULTS = (
    # Whatever content that is not what it says it is can trip a reader with; our own bugs in a test trip it as well.
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    EOFError,
    RecursionError,
    NotImplementedError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
    ExpatError,
)


def read_mesh(path: Path) -> Triangles:
    """Triangles of an STL, PLY, OBJ, OFF, GLB or 3MF file, as they stand in it.

    Raises InputError where the file is missing, too large, of another kind, not what its name says, or holds no
    triangle or a number that is none.
    """
    kind = path.suffix.lower()
    if not path.is_file():
        raise InputError(f"{path}: no such mesh file; what mesh.file names is looked for beside its trial file.")
    if kind not in READERS:
        reason = INSTEAD.get(kind, "no mesh format that is read")
        raise InputError(f"{path}: {reason}. Give one of {', '.join(name[1:].upper() for name in READERS)}.")
    size = path.stat().st_size
    if size > LARGEST_BYTES:
        raise InputError(
            f"{path}: {size / 1e6:.0f} MB; {LARGEST_BYTES / 1e6:.0f} MB are allowed. Simplify or crop the mesh, or "
            "save it as a binary file."
        )
    try:
        # Numbers near the largest there are overflow in the shape of a polygon; the checks below find them.
        with np.errstate(over="ignore", invalid="ignore"):
            mesh = READERS[kind](path.read_bytes())
    except FAULTS as fault:
        raise InputError(f"{path}: no readable {kind[1:].upper()}: {_in_words(fault)}. Save it again.") from fault
    if not len(mesh.faces):
        raise InputError(f"{path}: holds no triangle. Save the mesh with its faces.")
    wrong = np.flatnonzero(~(np.abs(mesh.vertices) < BEYOND_ANY_UNIT).all(axis=1))
    if len(wrong):
        raise InputError(
            f"{path}: {len(wrong)} of {len(mesh.vertices)} vertices are no finite numbers or beyond "
            f"{BEYOND_ANY_UNIT:g}; the first is vertex {wrong[0]}, counted from 0. Remove them and save the mesh again."
        )
    return mesh


def _in_words(fault: Exception) -> str:
    if isinstance(fault, json.JSONDecodeError):
        return f"its description is no JSON ({fault.msg})"
    if isinstance(fault, LookupError | TypeError | AttributeError):
        return f"something that it must hold is missing or of another kind ({fault})"
    return str(fault).rstrip(".")
