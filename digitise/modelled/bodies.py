"""From a closed surface to the body that it bounds, for booleans."""

import numpy as np
from manifold3d import Error, Manifold, Mesh64, OpType

from digitise.mesh import check_mesh
from digitise.modelled.repair import Repair, Surface, without_needles
from sealtwin.errors import InputError

LOOSE = 0.01
"""Of the largest body's volume: less, in a piece apart, is no part of a sample."""


def bounded_body(surface: Surface) -> tuple[Manifold, tuple[Repair, ...]]:
    """The body, and all that was mended to get there: overlapping bodies united, hollows filled, crumbs left out.

    Raises InputError where the surface bounds nothing.
    """
    sound = without_needles(surface)
    body = Manifold(Mesh64(sound.vertices_mm, sound.faces.astype(np.uint64)))
    if body.status() != Error.NoError:
        faults = check_mesh(surface.vertices_mm, surface.faces)
        raise InputError(f"{faults[0]} Mend it in the program that made it.")
    pieces = body.decompose()
    largest_mm3 = max((piece.volume() for piece in pieces), default=0.0)
    if not largest_mm3 > 0:
        raise InputError("Mesh encloses no volume. Give the closed surface of a sample, or a sheet and its base_mm.")
    hollows = [piece for piece in pieces if piece.volume() < 0]
    crumbs = [piece for piece in pieces if 0 <= piece.volume() < LOOSE * largest_mm3]
    solid = [piece for piece in pieces if piece.volume() >= LOOSE * largest_mm3]
    united = Manifold.batch_boolean(solid, OpType.Add)
    repairs = list(surface.repairs)
    volume_mm3 = sum(piece.volume() for piece in pieces)
    for what, count, change_mm3 in (
        ("hollows inside the sample filled", len(hollows), -sum(piece.volume() for piece in hollows)),
        ("loose crumbs left out", len(crumbs), -sum(piece.volume() for piece in crumbs)),
        (
            "overlapping bodies united",
            len(solid) if len(solid) > len(united.decompose()) else 0,
            united.volume() - sum(piece.volume() for piece in solid),
        ),
    ):
        if count:
            repairs.append(Repair(what, count, change_mm3 / volume_mm3))
    return united, tuple(repairs)
