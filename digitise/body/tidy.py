"""From what booleans leave to a mesh that stays watertight in a float32 file.

Exact booleans leave dust, doubled vertices, folds without volume and edges down to 1e-10 mm. Each is harmless in
memory; an STL, which knows vertices only by their rounded coordinates, falls apart over them.
"""

import numpy as np
from manifold3d import Manifold
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from digitise.geometry.edges import edge_uses
from digitise.geometry.equal_rows import equal_rows
from sealtwin.records import Floats, Integers

DUST_MM3 = 1e-3
WELD_MM = 1e-5
SHORT_MM = 2e-3
"""Edges below this are collapsed: a hundredth of a particle's radius, and a hundred times float32's step at 160 mm."""


def tidy(body: Manifold) -> tuple[Floats, Integers]:
    """Vertices (v, 3) in mm and faces (f, 3): dust dropped, vertices welded, folds removed, short edges collapsed."""
    vertices, faces = _without_dust(body)
    vertices, faces = _welded(vertices, faces)
    faces = _without_opposite_pairs(faces)
    faces = _without_empty_patches(vertices, faces)
    faces = _collapsed(vertices, faces)
    return _compact(vertices, faces)


def _without_dust(body: Manifold) -> tuple[Floats, Integers]:
    pieces = [piece.to_mesh64() for piece in body.decompose() if abs(piece.volume()) >= DUST_MM3]
    offsets = np.cumsum([0, *(len(piece.vert_properties) for piece in pieces)])
    vertices = np.vstack([np.array(piece.vert_properties[:, :3]) for piece in pieces])
    faces = np.vstack(
        [np.array(piece.tri_verts, dtype=np.int64) + at for piece, at in zip(pieces, offsets[:-1], strict=True)]
    )
    return vertices, faces


def _welded(vertices: Floats, faces: Integers) -> tuple[Floats, Integers]:
    near = KDTree(vertices).query_pairs(WELD_MM, output_type="ndarray")
    if not len(near):
        return vertices, faces
    links = coo_array((np.ones(len(near)), near.T), shape=(len(vertices),) * 2)
    _, group = connected_components(links, directed=False)
    _, representative = np.unique(group, return_index=True)
    return vertices, _proper(representative[group][faces])


def _proper(faces: Integers) -> Integers:
    """Faces with three different corners."""
    return faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]


def _without_opposite_pairs(faces: Integers) -> Integers:
    """Two faces on the same corners that look opposite ways enclose nothing: both go."""
    corners = np.sort(faces, axis=1)
    first = faces.argmin(axis=1)
    rows = np.arange(len(faces))
    looks_up = faces[rows, (first + 1) % 3] < faces[rows, (first + 2) % 3]
    group = equal_rows(corners).group
    balance = np.bincount(group, weights=np.where(looks_up, 1.0, -1.0))
    # Of a stack on the same corners as many stay as do not cancel.
    keep = np.zeros(len(faces), dtype=bool)
    for up in (True, False):
        same = np.flatnonzero(looks_up == up)
        by_group = same[np.argsort(group[same], kind="stable")]
        rank = np.arange(len(by_group)) - np.searchsorted(group[by_group], group[by_group])
        keep[by_group] = rank < np.maximum(0, balance[group[by_group]] * (1 if up else -1))
    return faces[keep]


def _without_empty_patches(vertices: Floats, faces: Integers) -> Integers:
    """Cut at edges where more than two faces meet, and drop the patches that then enclose nothing."""
    _, uses = edge_uses(faces)
    pairs = uses.begins[uses.count == 2]
    links = coo_array(
        (np.ones(len(pairs)), (uses.order[pairs] // 3, uses.order[pairs + 1] // 3)), shape=(len(faces),) * 2
    )
    count, patch = connected_components(links, directed=False)
    keep = np.ones(len(faces), dtype=bool)
    for number in range(count):
        members = patch == number
        corners = vertices[faces[members]]
        corners = corners - corners[0, 0]
        if abs(float(np.linalg.det(corners).sum())) / 6 < DUST_MM3:
            keep[members] = False
    return faces[keep]


def _collapsed(vertices: Floats, faces: Integers) -> Integers:
    """Shrink short edges to one of their ends, where that changes neither topology nor shape."""
    # An edge may be held by a neighbour just above the limit: then the next round reaches a little farther.
    for reach in (1, 2, 4):
        if reach > 1 and not len(_edges_below(vertices, faces, SHORT_MM / 2)):
            break
        mesh = _Fans(vertices, faces, reach * SHORT_MM)
        queue = [(int(a), int(b)) for a, b in _edges_below(vertices, faces, reach * SHORT_MM)]
        while queue:
            a, b = queue.pop(0)
            queue += mesh.collapse(a, b)
        faces = mesh.faces()
    return faces


def _edges_below(vertices: Floats, faces: Integers, limit_mm: float) -> Integers:
    """Shortest first, (n, 2)."""
    directed, uses = edge_uses(faces)
    edges = np.sort(directed[uses.first], axis=1)
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    order = np.argsort(length)
    return edges[order[length[order] < limit_mm]]


class _Fans:
    """Faces by vertex, so that one edge can be collapsed at a time."""

    def __init__(self, vertices: Floats, faces: Integers, short_mm: float) -> None:
        self._vertices = vertices
        self._short_mm = short_mm
        self._faces = faces.copy()
        self._there = np.ones(len(faces), dtype=bool)
        self._users = np.argsort(faces.reshape(-1), kind="stable") // 3
        self._begins = np.concatenate([[0], np.cumsum(np.bincount(faces.reshape(-1), minlength=len(vertices)))])
        self._known: dict[int, set[int]] = {}

    def faces(self) -> Integers:
        return self._faces[self._there]

    def collapse(self, a: int, b: int) -> list[tuple[int, int]]:
        """Merge the edge's ends if allowed; returns the short edges that this made."""
        shared = self._around(a) & self._around(b)
        # The link condition: only the two faces of the edge itself may join a's neighbours to b's.
        if len(shared) != 2 or len(self._neighbours(a) & self._neighbours(b)) != 2:
            return []
        best = min(((self._change(gone, kept, shared), kept, gone) for kept, gone in ((a, b), (b, a))))
        if best[0] == np.inf:
            return []
        _, kept, gone = best
        for number in shared:
            for vertex in self._corners(number):
                self._around(vertex).discard(number)
            self._there[number] = False
        for number in self._known[gone]:
            self._faces[number, self._faces[number] == gone] = kept
        self._known[kept] |= self._known[gone]
        self._known[gone] = set()
        at = self._vertices[kept]
        return [(kept, v) for v in self._neighbours(kept) if np.linalg.norm(self._vertices[v] - at) < self._short_mm]

    def _neighbours(self, vertex: int) -> set[int]:
        return {v for number in self._around(vertex) for v in self._corners(number)} - {vertex}

    def _corners(self, number: int) -> list[int]:
        return self._faces[number].tolist()

    def _around(self, vertex: int) -> set[int]:
        """Faces at a vertex: found when first asked for, since few vertices of a scan have a short edge."""
        if vertex not in self._known:
            users = self._users[self._begins[vertex] : self._begins[vertex + 1]]
            self._known[vertex] = set(users[self._there[users]].tolist())
        return self._known[vertex]

    def _change(self, gone: int, kept: int, shared: set[int]) -> float:
        """Volume that moving ``gone`` onto ``kept`` sweeps; infinite where a face of some size would turn over."""
        rest = self._faces[list(self._around(gone) - shared)]
        before, after = self._vertices[rest], self._vertices[np.where(rest == gone, kept, rest)]
        normals = [np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]) for c in (before, after)]
        areas = [np.linalg.norm(normal, axis=1) for normal in normals]
        turned = (normals[0] * normals[1]).sum(axis=1) < 0.5 * areas[0] * areas[1]
        # Needles thinner than the edge that goes have no direction worth keeping.
        longest = np.linalg.norm(before - np.roll(before, 1, axis=1), axis=2).max(axis=1)
        if (turned & (areas[0] > self._short_mm * longest)).any():
            return np.inf
        step = self._vertices[kept] - self._vertices[gone]
        return float(np.abs((normals[0] @ step) / 6).sum())


def _compact(vertices: Floats, faces: Integers) -> tuple[Floats, Integers]:
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3).astype(np.int64)
