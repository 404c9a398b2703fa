"""Points spread over a mesh's surface by its planes: however a plane is cut into triangles, they are the same points.

A square lattice lies in each plane, hung up at the origin of the world, and a triangle gets the nodes inside it. It is
turned by an irrational slope against the horizontal, so that a narrow upright facet gets its share of them too.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sealtwin.records import Floats, Integers

TURN = np.arctan((np.sqrt(5) - 1) / 2)
"""Of the golden ratio: no slope of small numbers is near it, so no row of points runs along an edge."""
SHIFT = np.array([np.sqrt(2) - 1, np.sqrt(3) - 1])
"""Of the lattice from the origin, in steps: a corner of the sample there shall be no point of it."""
OFF_NODE = 1e-3
"""Of a step, that points stand beside their nodes: else many would be exactly as near to one as to another, and how
coordinates round would decide between the two."""
LEVEL = 0.99
"""Vertical part of a normal beyond which a plane has no horizontal direction of its own, and takes x."""


@dataclass(frozen=True)
class SurfacePoints:
    place_mm: Floats  # (n, 3)
    face: Integers  # (n,): the triangle that each lies in
    lot: NDArray[np.uint64]  # (n,): as if drawn at random, yet of the node alone


def spread_points(triangles_mm: Floats, spacing_mm: float) -> SurfacePoints:
    """One for each square of ``spacing_mm`` on triangles (f, 3, 3); needles without area get none."""
    normal = np.cross(triangles_mm[:, 1] - triangles_mm[:, 0], triangles_mm[:, 2] - triangles_mm[:, 0])
    length = np.linalg.norm(normal, axis=1)
    face = np.flatnonzero(length > 0)
    axes = _axes(normal[face] / length[face, None])
    corner = np.einsum("fck,fak->fca", triangles_mm[face], axes) / spacing_mm - SHIFT
    row, which = _rows(corner[:, :, 0])
    first, last = _crossed(corner[which], row)
    count = np.maximum(last - first + 1, 0)
    node = np.column_stack([np.repeat(row, count), np.repeat(first, count) + _counting(count)])
    which = np.repeat(which, count)
    height = np.einsum("fk,fk->f", triangles_mm[face, 0], normal[face] / length[face, None])
    lot = _lots(node)
    beside = np.column_stack([lot >> np.uint64(40), lot & np.uint64(0xFFFFFF)]) / 2**24 * OFF_NODE
    place_mm = np.einsum("na,nak->nk", (node + SHIFT + beside) * spacing_mm, axes[which])
    place_mm += (height[:, None] * normal[face] / length[face, None])[which]
    return SurfacePoints(place_mm, face[which], lot)


def _lots(node: Integers) -> NDArray[np.uint64]:
    """A number for each pair of whole numbers, (n,), without any pattern: the mixer of splitmix64."""
    row, column = node.astype(np.uint64).T
    mixed = row * np.uint64(0x9E3779B97F4A7C15) + column * np.uint64(0xC2B2AE3D27D4EB4F)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    return mixed ^ (mixed >> np.uint64(31))


def _axes(normal: Floats) -> Floats:
    """Two unit vectors in each plane, (f, 2, 3), that follow from its normal alone."""
    along = np.column_stack([-normal[:, 1], normal[:, 0], np.zeros(len(normal))])
    level = np.abs(normal[:, 2]) > LEVEL
    along[level] = np.array([1.0, 0.0, 0.0]) - normal[level, :1] * normal[level]
    along /= np.linalg.norm(along, axis=1)[:, None]
    across = np.cross(normal, along)
    cosine, sine = np.cos(TURN), np.sin(TURN)
    return np.stack([cosine * along + sine * across, cosine * across - sine * along], axis=1)


def _rows(coordinate: Floats) -> tuple[Integers, Integers]:
    """Every whole number between the least and the greatest of each triangle's three, (n,), and whose it is."""
    first = np.ceil(coordinate.min(axis=1)).astype(np.int64)
    count = np.maximum(np.floor(coordinate.max(axis=1)).astype(np.int64) - first + 1, 0)
    return np.repeat(first, count) + _counting(count), np.repeat(np.arange(len(count)), count)


def _crossed(corner: Floats, row: Integers) -> tuple[Integers, Integers]:
    """First and last whole number inside each triangle (n, 3, 2), on the line where its first coordinate is ``row``."""
    low, high = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for one, other in ((0, 1), (1, 2), (2, 0)):
        a, b = corner[:, one], corner[:, other]
        crosses = (a[:, 0] - row) * (b[:, 0] - row) < 0
        share = (row - a[:, 0]) / np.where(crosses, b[:, 0] - a[:, 0], 1.0)
        at = a[:, 1] + share * (b[:, 1] - a[:, 1])
        low, high = np.where(crosses, np.minimum(low, at), low), np.where(crosses, np.maximum(high, at), high)
    met = low <= high
    return np.ceil(np.where(met, low, 0.0)).astype(np.int64), np.floor(np.where(met, high, -1.0)).astype(np.int64)


def _counting(count: Integers) -> Integers:
    """0, 1, ... up to each count, one after the other."""
    return np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
