"""Clean-up of a boolean's mesh: doubled vertices, folds and edges of 1e-10 mm would open it once rounded to float32."""

import numpy as np
from manifold3d import Manifold
from scipy.spatial import KDTree

from digitise.geometry.mesh_topology import connected, edge_uses, equal_rows, neighbours, normals
from sealtwin.core.records import Floats, Integers

DUST_MM3 = 1e-3
WELD_MM = 1e-5
SHORT_MM = 2e-3  # Edges below are collapsed: a hundredth of a particle's radius, 100 times float32's step at 160 mm


def tidy(body: Manifold) -> tuple[Floats, Integers]:
    """Drop dust, weld vertices, remove folds, collapse short edges; return vertices (v, 3) in mm and faces (f, 3)."""
    vertices, faces = _welded(*_without_dust(body))
    faces = _without_empty_patches(vertices, _without_opposite_pairs(faces))
    faces = _collapsed(vertices, faces)
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3).astype(np.int64)


def corners_mm(body: Manifold) -> Floats:
    """Return the corners of each triangle of a body, (f, 3, 3)."""
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties[:, :3])[np.array(mesh.tri_verts, dtype=np.int64)]


def _without_dust(body: Manifold) -> tuple[Floats, Integers]:
    pieces = [piece.to_mesh64() for piece in body.decompose() if abs(piece.volume()) >= DUST_MM3]
    offsets = np.cumsum([0, *(len(piece.vert_properties) for piece in pieces)])
    vertices = np.vstack([np.array(piece.vert_properties[:, :3]) for piece in pieces])
    faces = np.vstack(
        [np.array(piece.tri_verts, dtype=np.int64) + at for piece, at in zip(pieces, offsets[:-1], strict=True)]
    )
    return vertices, faces


def representatives(places_mm: Floats, within_mm: float) -> Integers:
    """Return for each place the number of the first place linked to it by steps of at most ``within_mm``, (n,)."""
    near = KDTree(places_mm).query_pairs(within_mm, output_type="ndarray")
    _, group = connected(len(places_mm), *near.T)
    return np.unique(group, return_index=True)[1][group]


def _welded(vertices: Floats, faces: Integers) -> tuple[Floats, Integers]:
    faces = representatives(vertices, WELD_MM)[faces]
    return vertices, faces[(faces != np.roll(faces, -1, axis=1)).all(axis=1)]


def _without_opposite_pairs(faces: Integers) -> Integers:
    """Drop pairs of faces on the same corners with opposite orientation, which enclose nothing."""
    first, rows = faces.argmin(axis=1), np.arange(len(faces))
    sense = np.where(faces[rows, (first + 1) % 3] < faces[rows, (first + 2) % 3], 1.0, -1.0)
    group = equal_rows(np.sort(faces, axis=1)).group
    balance = np.bincount(group, weights=sense)[group]
    # Of the faces on the same corners, those that do not cancel stay.
    more = np.flatnonzero(sense * balance > 0)
    more = more[np.argsort(group[more], kind="stable")]
    rank = np.arange(len(more)) - np.searchsorted(group[more], group[more])
    return faces[np.sort(more[rank < np.abs(balance[more])])]


def _without_empty_patches(vertices: Floats, faces: Integers) -> Integers:
    """Cut at edges where more than two faces meet, and drop the patches that then enclose nothing."""
    one, other, _ = neighbours(faces)
    _, patch = connected(len(faces), one, other)
    _, first = np.unique(patch, return_index=True)
    corners = vertices[faces] - vertices[faces[first[patch], 0]][:, None]
    volume_mm3 = np.bincount(patch, np.linalg.det(corners)) / 6
    return faces[np.abs(volume_mm3[patch]) >= DUST_MM3]


def _collapsed(vertices: Floats, faces: Integers) -> Integers:
    """Collapse short edges to one of their ends, unless that changes topology or shape."""
    # An edge may be blocked by a neighbour just above the limit: then the next round has a higher limit.
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
    """Return the edges below a length, shortest first, (n, 2)."""
    directed, uses = edge_uses(faces)
    edges = np.sort(directed[uses.first], axis=1)
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    order = np.argsort(length)
    return edges[order[length[order] < limit_mm]]


class _Fans:
    """Faces by vertex, for the collapse of one edge at a time."""

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
        """Merge the edge's ends if allowed, and return the short edges that result."""
        shared = self._around(a) & self._around(b)
        # The link condition: only the two faces of the edge itself may join a's neighbours to b's.
        if len(shared) != 2 or len(self._neighbours(a) & self._neighbours(b)) != 2:
            return []
        best = min(((self._change(gone, target, shared), target, gone) for target, gone in ((a, b), (b, a))))
        if best[0] == np.inf:
            return []
        _, target, gone = best
        for number in shared:
            for vertex in self._faces[number].tolist():
                self._around(vertex).discard(number)
        self._there[list(shared)] = False
        for number in self._known[gone]:
            self._faces[number, self._faces[number] == gone] = target
        self._known[target] |= self._known[gone]
        self._known[gone] = set()
        at = self._vertices[target]
        return [
            (target, v) for v in self._neighbours(target) if np.linalg.norm(self._vertices[v] - at) < self._short_mm
        ]

    def _neighbours(self, vertex: int) -> set[int]:
        return set(self._faces[list(self._around(vertex))].ravel().tolist()) - {vertex}

    def _around(self, vertex: int) -> set[int]:
        """Return the faces at a vertex, collected on demand: few vertices of a scan have a short edge."""
        if vertex not in self._known:
            users = self._users[self._begins[vertex] : self._begins[vertex + 1]]
            self._known[vertex] = set(users[self._there[users]].tolist())
        return self._known[vertex]

    def _change(self, gone: int, target: int, shared: set[int]) -> float:
        """Return the volume swept by moving ``gone`` onto ``target``; infinite if a face of some size would flip."""
        rest = self._faces[list(self._around(gone) - shared)]
        before, after = self._vertices[rest], self._vertices[np.where(rest == gone, target, rest)]
        old, new = normals(before), normals(after)
        areas = [np.linalg.norm(normal, axis=1) for normal in (old, new)]
        turned = (old * new).sum(axis=1) < 0.5 * areas[0] * areas[1]
        # Needles thinner than the collapsed edge have no reliable direction.
        longest = np.linalg.norm(before - np.roll(before, 1, axis=1), axis=2).max(axis=1)
        if (turned & (areas[0] > self._short_mm * longest)).any():
            return np.inf
        step = self._vertices[target] - self._vertices[gone]
        return float(np.abs((old @ step) / 6).sum())
