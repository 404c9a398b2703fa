"""Clean a mesh after boolean operations, so that rounding to float32 opens no holes at edges as short as 1e-10 mm."""

from collections import defaultdict

import numpy as np
import trimesh
from manifold3d import Manifold

from digitise.geometry.mesh_topology import directed_edges
from sealtwin.core.arrays import Floats, Integers, lengths, normals

DUST_MM3 = 1e-3
WELD_DIGITS = 5  # Vertices that agree to this many decimals of a mm are joined. This is float32's step at 160 mm
NEEDLE_MM = 1e-7  # A triangle with a smaller height is a needle: a thousandth of float32's step at 160 mm
MAX_ROUNDS = 50  # Largest number of rounds that remove needles. Each needle of a stack may need a round
SHORT_MM = 2e-3  # Shorter edges are collapsed: a hundredth of a particle's radius, 100 times float32's step at 160 mm
ROUNDS = (1, 1, 2, 4)
"""Length limit of each round of collapses, in multiples of SHORT_MM. Limits grow because a collapse shortens the edges
next to it, and because an edge just above the limit may block a collapse."""


def tidy(body: Manifold) -> tuple[Floats, Integers]:
    """Return the cleaned mesh of a body: vertices, (v, 3) in mm, and faces, (f, 3).

    Pieces smaller than ``DUST_MM3`` are dropped, equal vertices joined, short edges collapsed, and triangles without
    height merged with their neighbours.
    """
    pieces = [piece for piece in body.decompose() if abs(piece.volume()) >= DUST_MM3]
    vertices, faces, alike = welded(*arrays_of(Manifold.compose(pieces)), WELD_DIGITS)
    # Two faces with the same corners enclose nothing.
    faces = faces[np.bincount(alike)[alike] == 1]
    for limit in ROUNDS:
        if limit == 1 or len(_edges_below(vertices, faces, SHORT_MM / 2)):
            faces = _collapsed(vertices, faces, limit * SHORT_MM)
    used, renumbered = np.unique(without_needles(vertices, faces), return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3)


def arrays_of(body: Manifold) -> tuple[Floats, Integers]:
    """Return copies of the vertices, (v, 3), and faces, (f, 3), of a body.

    The library's own arrays keep its mesh alive. At the end of a command it would report the mesh on stderr.
    """
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, np.int64)


def welded(vertices: Floats, faces: Integers, digits: int) -> tuple[Floats, Integers, Integers]:
    """Join vertices that are equal to ``digits`` decimals, and drop faces with fewer than three distinct corners.

    Returns vertices, faces, and a number for each face, (f,). Faces with the same corners have the same number.
    """
    first, group = trimesh.grouping.unique_rows(vertices, digits=digits)
    faces = group[faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    return vertices[first], faces, trimesh.grouping.unique_rows(np.sort(faces, axis=1))[1]


def _edges_below(vertices: Floats, faces: Integers, limit_mm: float) -> Integers:
    """Return the edges of a closed mesh that are shorter than a limit, shortest first, (n, 2)."""
    edges = directed_edges(faces)
    edges = edges[edges[:, 0] < edges[:, 1]]
    length_mm = lengths(np.subtract(*vertices[edges.T]))
    order = np.argsort(length_mm)
    return edges[order[length_mm[order] < limit_mm]]


def _collapsed(vertices: Floats, faces: Integers, limit_mm: float) -> Integers:
    """Collapse edges shorter than a limit to one of their ends, unless this changes topology or shape."""
    edges, faces, present = _edges_below(vertices, faces, limit_mm), faces.copy(), np.ones(len(faces), bool)
    users: defaultdict[int, set[int]] = defaultdict(set)
    for row in np.flatnonzero(np.isin(faces, edges).any(axis=1)).tolist():
        for vertex in faces[row].tolist():
            users[vertex].add(row)
    for a, b in edges.tolist():
        shared = users[a] & users[b]
        # The link condition: a and b may have only two common neighbours, the third corners of the edge's two faces.
        if len(shared) != 2 or len(np.intersect1d(faces[[*users[a]]], faces[[*users[b]]])) != 4:
            continue
        rest = {gone: sorted(users[gone] - shared) for gone in (a, b)}
        swept_mm3, gone = min((_swept_mm3(vertices, faces[rest[end]], end, a + b - end, limit_mm), end) for end in rest)
        if swept_mm3 < np.inf:
            for vertex in np.unique(faces[[*shared]]).tolist():
                users[vertex] -= shared
            present[[*shared]] = False
            faces[rest[gone]] = np.where(faces[rest[gone]] == gone, a + b - gone, faces[rest[gone]])
            users[a + b - gone] |= users.pop(gone)
    return faces[present]


def _swept_mm3(vertices: Floats, faces: Integers, gone: int, target: int, limit_mm: float) -> float:
    """Return the volume that is swept when the vertex ``gone`` moves to ``target``.

    Returns inf if a face would flip. Faces too thin to have a reliable direction are ignored.
    """
    corners = vertices[faces]
    old, new = normals(corners), normals(vertices[np.where(faces == gone, target, faces)])
    double_mm2 = lengths(old)
    turned = (old * new).sum(axis=1) < 0.5 * double_mm2 * lengths(new)
    # Needles thinner than the collapsed edge have no reliable direction.
    longest_mm = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    if (turned & (double_mm2 > limit_mm * longest_mm)).any():
        return np.inf
    return np.abs(old @ (vertices[target] - vertices[gone])).sum() / 6


def without_needles(vertices_mm: Floats, faces: Integers) -> Integers:
    """Merge each triangle without height with the neighbour at its longest edge.

    The triangle's third corner then splits the neighbour. The library Manifold (3.5.4) would remove such triangles on
    reading and might move their neighbours: a block of 127,039 mm³ lost 226 mm³.
    """
    faces = faces.copy()
    for _ in range(MAX_ROUNDS):
        corners_mm = vertices_mm[faces]
        edges_mm = np.linalg.norm(np.roll(corners_mm, -1, axis=1) - corners_mm, axis=2)
        needles = np.flatnonzero(lengths(normals(corners_mm)) <= NEEDLE_MM * edges_mm.max(axis=1))
        beside = np.flatnonzero(np.isin(faces, faces[needles]).any(axis=1))
        edges = map(tuple, directed_edges(faces[beside]).tolist())
        face_of = dict(zip(edges, np.repeat(beside, 3).tolist(), strict=True))
        turned = set[int]()
        for needle in needles.tolist():
            p, q, b = np.roll(faces[needle], -edges_mm[needle].argmax()).tolist()
            other = face_of.get((q, p), needle)
            d = int(faces[other].sum()) - p - q
            # Each face is changed at most once in a round. Other needles follow in the next round.
            if b == d or turned & {needle, other} or {(b, d), (d, b)} & face_of.keys():
                continue
            face_of[b, d] = needle
            faces[needle], faces[other] = (b, p, d), (d, q, b)
            turned |= {needle, other}
        if not turned:
            break
    return faces
