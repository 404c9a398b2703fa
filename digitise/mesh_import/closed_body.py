"""Make one closed body of a mesh, or refuse it by what keeps it from being a solid, and by the place."""

import numpy as np
from manifold3d import Error, Manifold, Mesh64

from digitise.geometry.mesh_topology import edge_fault, mesh_volume_mm3
from digitise.solid.float_mesh import welded, without_needles
from sealtwin.core.errors import ShapeError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats, Integers

EQUAL_DIGITS = 8  # Decimals of mm to which vertices are one: a text format may round its last digit
LOOSE = 0.01  # Share of the sample's volume below which another closed surface is a crumb or a pore
LOST = 1e-7  # Largest share of a body's volume that reading or cutting it may lose
MEND = "Repair it in a mesh program (close holes, remove doubled parts, unite bodies), and export it again."


def one_surface(vertices_mm: Floats, faces: Integers) -> tuple[Floats, Integers, tuple[Fact, ...]]:
    """Join equal vertices, drop doubled and degenerate faces, and turn a mesh that is inside out.

    Returns vertices, faces and notes. Raises ShapeError if no face is left.
    """
    vertices_mm, faces, alike = welded(vertices_mm, faces, EQUAL_DIGITS)
    if not len(faces):
        raise ShapeError("Mesh has no face with three corners apart from each other.", "Check its units.", "closed")
    faces = faces[np.sort(np.unique(alike, return_index=True)[1])]
    if mesh_volume_mm3(vertices_mm, faces) >= 0:
        return vertices_mm, faces, ()
    turned = doubt("mesh.inside-out", "the mesh was inside out: all its faces were turned")
    return vertices_mm, faces[:, ::-1], (turned,)


def closed_body(vertices_mm: Floats, faces: Integers) -> tuple[Manifold, tuple[Fact, ...]]:
    """Return the enclosed body without crumbs and pores, and a note about those.

    Raises ShapeError if the mesh is not closed, has no inside, or encloses several bodies.
    """
    body = Manifold(Mesh64(vertices_mm, without_needles(vertices_mm, faces).astype(np.uint64)))
    if body.status() != Error.NoError:
        fault = edge_fault(vertices_mm, faces) or f"Mesh is not a solid ({body.status().name})."
        raise ShapeError(fault, MEND, "closed")
    require_whole(body.volume(), mesh_volume_mm3(vertices_mm, faces))
    *others, sample = sorted(body.decompose(), key=Manifold.volume) or [Manifold()]
    if not sample.volume() > 0:
        raise ShapeError("Mesh encloses no volume.", MEND, "closed")
    if large := [piece for piece in others if abs(piece.volume()) >= LOOSE * sample.volume()]:
        listed = ", ".join(map(_described, [sample, *reversed(large)]))
        raise ShapeError(f"Mesh has {1 + len(large)} separate bodies: {listed}.", "Save the sample alone.", "closed")
    if not others:
        return sample, ()
    crumbs = f"{len(others)} loose crumbs or closed pores of the mesh were left out"
    return sample, (doubt("mesh.crumbs", crumbs, len(others)),)


def require_whole(parts_mm3: float, whole_mm3: float) -> None:
    """Raise ShapeError if volumes differ: Manifold may move triangles if others are lower than its rounding."""
    if abs(parts_mm3 - whole_mm3) > LOST * abs(whole_mm3):
        wrong = "Mesh cannot be cut without loss: it crosses itself, or has triangles without height."
        raise ShapeError(wrong, MEND, "cut")


def _described(body: Manifold) -> str:
    low_mm, high_mm = np.reshape(body.bounding_box(), (2, 3))
    size = " x ".join(f"{side:.4g}" for side in high_mm - low_mm)
    return f"{size} mm around ({', '.join(f'{middle:.4g}' for middle in (low_mm + high_mm) / 2)})"
