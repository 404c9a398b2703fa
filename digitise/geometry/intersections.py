"""Which triangles of a mesh pierce each other, in double precision."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sealtwin.records import Floats, Integers

CONTACT_MM = 1e-5
"""Touching by less is rounding, not crossing: float32 files move a vertex at 100 mm by as much."""
LEAF_FACES = 4
AT_ONCE = 50_000
"""Pairs of boxes that are opened at a time; each may become sixteen pairs of faces."""


def intersecting_faces(vertices_mm: Floats, faces: Integers) -> Integers:
    """Pairs of faces that cross, (n, 2). Coplanar overlap is not looked for; a fold shows as an edge used twice.

    Two triangles that cross do so along a segment that begins or ends where an edge of one passes through the other.
    """
    triangles = vertices_mm[faces]
    planes = _planes(triangles)
    found = [
        # Most neighbours lie to one side of each other, which costs far less to see than that no edge passes through.
        _crossing(vertices_mm, faces, _across(triangles, planes, _across(triangles, planes, pairs)[:, ::-1]))
        for pairs in _close_pairs(triangles)
    ]
    return np.concatenate([np.empty((0, 2), dtype=np.int64), *found])


def _crossing(vertices_mm: Floats, faces: Integers, pairs: Integers) -> Integers:
    """Those of the pairs that cross."""
    crossing = np.zeros(len(pairs), dtype=bool)
    for one, other in ((0, 1), (1, 0)):
        piercing = faces[pairs[:, one]]
        pierced = faces[pairs[:, other]]
        for corner in range(3):
            edge = np.stack([piercing[:, corner], piercing[:, (corner + 1) % 3]], axis=1)
            # An edge that shares a vertex with the triangle only touches it there.
            apart = ~(edge[:, :, None] == pierced[:, None, :]).any(axis=(1, 2))
            apart &= ~crossing
            crossing[apart] |= _pierces(vertices_mm[edge[apart]], vertices_mm[pierced[apart]])
    return pairs[crossing]


def _planes(triangles: Floats) -> Floats:
    """Unit normal of each triangle and how far along it its plane lies, (f, 4); NaN for a needle, which has none."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normal, axis=1)
    normal /= np.where(area < CONTACT_MM**2, np.nan, area)[:, None]
    return np.column_stack([normal, (triangles[:, 0] * normal).sum(axis=1)])


def _across(triangles: Floats, planes: Floats, pairs: Integers) -> Integers:
    """Pairs whose first triangle has corners on both sides of the second one's plane, by more than a contact."""
    plane = planes[pairs[:, 1]]
    height = np.einsum("nij,nj->ni", triangles[pairs[:, 0]], plane[:, :3]) - plane[:, 3:]
    to_one_side = (height.max(axis=1) <= CONTACT_MM) | (height.min(axis=1) >= -CONTACT_MM)
    return pairs[~to_one_side]


def _pierces(edge: Floats, triangle: Floats) -> NDArray[np.bool_]:
    """Whether each edge (n, 2, 3) passes through the inside of its triangle (n, 3, 3), by more than a contact."""
    a, b, c = triangle[:, 0], triangle[:, 1], triangle[:, 2]
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    flat = area < CONTACT_MM**2
    normal /= np.where(flat, 1.0, area)[:, None]
    above = np.einsum("ij,ij->i", edge[:, 0] - a, normal)
    below = np.einsum("ij,ij->i", edge[:, 1] - a, normal)
    through = ~flat & (above * below < 0) & (np.minimum(np.abs(above), np.abs(below)) > CONTACT_MM)
    share = above / np.where(through, above - below, 1.0)
    point = edge[:, 0] + share[:, None] * (edge[:, 1] - edge[:, 0])
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        length = np.linalg.norm(side, axis=1)
        inside = np.einsum("ij,ij->i", np.cross(side, point - start), normal) / np.where(length > 0, length, 1.0)
        through &= inside > CONTACT_MM
    return through


def _close_pairs(triangles: Floats) -> Iterator[Integers]:
    """Pairs of faces with overlapping boxes, (n, 2), first below second: a tree of boxes walked against itself.

    In parts, so that a scan of millions of faces takes no more room than one of a hundred thousand.
    """
    order = _along_a_curve(triangles.mean(axis=1))
    levels = int(np.ceil(np.log2(max(1.0, len(order) / LEAF_FACES))))
    slots = np.full(LEAF_FACES * 2**levels, -1, dtype=np.int64)
    slots[: len(order)] = order
    # Axis by axis, since most boxes that miss each other do so along the first.
    low, high = np.full((3, len(slots)), np.inf), np.full((3, len(slots)), -np.inf)
    low[:, : len(order)], high[:, : len(order)] = triangles[order].min(axis=1).T, triangles[order].max(axis=1).T
    boxes = [(low, high)]
    for children in (LEAF_FACES, *[2] * levels):
        low, high = boxes[-1]
        boxes.append((low.reshape(3, -1, children).min(axis=2), high.reshape(3, -1, children).max(axis=2)))
    waiting = [(0, np.zeros((2, 1), dtype=np.int64))]
    while waiting:
        level, pairs = waiting.pop()
        if pairs.shape[1] > AT_ONCE:
            waiting += [(level, half) for half in np.array_split(pairs, 2, axis=1)]
            continue
        children = LEAF_FACES if level == levels else 2
        steps = np.stack(np.meshgrid(np.arange(children), np.arange(children), indexing="ij")).reshape(2, 1, -1)
        first, second = (pairs[:, :, None] * children + steps).reshape(2, -1)
        ordered = first < second if level == levels else first <= second
        first, second = first[ordered], second[ordered]
        for low, high in zip(*boxes[levels - level], strict=True):
            near = (low[first] <= high[second]) & (low[second] <= high[first])
            first, second = first[near], second[near]
        if level < levels:
            waiting.append((level + 1, np.stack([first, second])))
        else:
            yield slots[np.column_stack([first, second])]


def _along_a_curve(centres: Floats) -> Integers:
    """Faces in the order of a Morton curve, so that neighbours in the list are neighbours in space."""
    low = centres.min(axis=0)
    cell = ((centres - low) / max(float(np.ptp(centres, axis=0).max()), 1e-9) * 1023).astype(np.int64)
    code = np.zeros(len(centres), dtype=np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")
