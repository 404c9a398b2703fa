"""Triangles as a mesh file holds them, and from polygons with more corners."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from manifold3d import triangulate

from sealtwin.records import Floats, Integers

MOST_TRIANGLES = 2_000_000
"""A face of 160 x 40 mm scanned every 0.08 mm, a tenth of a particle. To mend and check so many takes 2 GB."""
MOST_VERTICES = 3 * MOST_TRIANGLES
FileUnit = Literal["micron", "mm", "cm", "m", "inch", "foot"]


class UnreadableError(ValueError):
    """What is wrong with the content of a mesh file, as the end of a sentence about it."""


@dataclass(frozen=True)
class Triangles:
    """What a mesh file holds, in its own unit and axes."""

    vertices: Floats  # (v, 3)
    faces: Integers  # (f, 3)
    unit: FileUnit | None = None
    """As the file itself says; most formats have no word for it."""


def refuse_too_many(count: int) -> None:
    if count > MOST_TRIANGLES:
        raise UnreadableError(
            f"it has {count} triangles, {MOST_TRIANGLES} are allowed: simplify or crop the mesh first"
        )


class Polygons:
    """Faces with any number of corners, in little room, until all vertices are known."""

    def __init__(self) -> None:
        self._corners: dict[int, array[int]] = {}
        self._triangles = 0

    def add(self, corners: Sequence[int]) -> None:
        """Fewer than three corners enclose nothing and are left out."""
        size = len(corners)
        if size < 3:
            return
        self._triangles += size - 2
        refuse_too_many(self._triangles)
        self._corners.setdefault(size, array("q")).extend(corners)

    def add_alike(self, rings: Integers) -> None:
        """Many with the same number of corners, (n, corners)."""
        count, size = rings.shape
        if size < 3:
            return
        self._triangles += count * (size - 2)
        refuse_too_many(self._triangles)
        self._corners.setdefault(size, array("q")).frombytes(np.ascontiguousarray(rings, dtype=np.int64).tobytes())

    def triangles(self, vertices: Floats) -> Integers:
        """(f, 3): triangles that do not leave their polygon, also where it is not convex."""
        pieces = [np.empty((0, 3), dtype=np.int64)]
        for size, corners in sorted(self._corners.items()):
            rings = np.array(corners, dtype=np.int64).reshape(-1, size)
            if rings.min() < 0 or rings.max() >= len(vertices):
                raise UnreadableError(f"a face names vertex {rings.max()} of {len(vertices)}, counted from 0")
            if size == 3:
                pieces.append(rings)
            elif size == 4:
                pieces.append(_halved(vertices, rings))
            else:
                pieces += [ring[fill_ring(vertices[ring])] for ring in rings]
        return np.concatenate(pieces)


def _halved(vertices: Floats, quads: Integers) -> Integers:
    """Along the diagonal on either side of which both halves look the same way."""
    a, b, c, d = vertices[quads].transpose(1, 0, 2)
    alike = (np.cross(b - a, c - a) * np.cross(c - a, d - a)).sum(axis=1) >= 0
    first = np.where(alike[:, None], quads[:, [0, 1, 2]], quads[:, [0, 1, 3]])
    second = np.where(alike[:, None], quads[:, [0, 2, 3]], quads[:, [1, 2, 3]])
    return np.concatenate([first, second])


def fill_ring(ring: Floats) -> Integers:
    """Triangles between the corners of a nearly flat ring (n, 3), looking as it runs, (n - 2, 3)."""
    ring = ring - ring[0]
    # Twice the area as a vector (Newell): the mean normal, whatever the ring's shape.
    normal = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    if not np.isfinite(ring).all() or not normal.any():
        raise UnreadableError(f"a face of {len(ring)} corners has no area")
    across = np.linalg.svd(normal[None] / np.abs(normal).max())[2][1:]
    if np.linalg.det(np.vstack([across, normal])) < 0:
        across = across[::-1]
    return np.asarray(triangulate([np.ascontiguousarray(ring @ across.T)]), dtype=np.int64)
