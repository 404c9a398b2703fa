"""What the mesh of a scan or of a CAD program needs before it is one surface: each repair is counted and told."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from digitise.geometry.edges import edge_uses
from digitise.geometry.equal_rows import equal_rows
from digitise.mesh import MIN_EDGE_MM, mesh_volume_mm3
from sealtwin.errors import InputError
from sealtwin.records import Floats, Integers

WELD_MM = MIN_EDGE_MM / 2
"""Vertices as near as this are one. With 1e-5 mm of noise on the corners of a triangle soup each triangle would else
pass for a body of its own, without volume; edges twice as long must stay.
"""
SHEET = 0.5
"""Of a surface's area, which as a vector is nil where it closes: above, it is a sheet, and has no inside to tell by."""

NEEDLE_MM = 1e-7
"""A triangle lower than this is a line: a thousandth of what float32 tells apart at 160 mm."""
MOST_ROUNDS = 50
"""Of merging needles: one for each that lies on the next."""

NEARLY_CLOSED = 0.01
"""Of a surface's area: with no more open, the volume inside is known to about as much."""

ROUNDING = 1e-9
"""Of a volume: less is no change."""


@dataclass(frozen=True)
class Repair:
    """One thing that was mended."""

    what: str
    """In words, as "faces turned to look as their neighbours do"."""
    count: int
    volume_change: float
    """Over the volume before; NaN where that was not known."""

    def __str__(self) -> str:
        if np.isnan(self.volume_change):
            return f"{self.count} {self.what}"
        change = "unchanged" if abs(self.volume_change) < ROUNDING else f"changed by {100 * self.volume_change:.2g} %"
        return f"{self.count} {self.what}; volume {change}"


@dataclass(frozen=True)
class Surface:
    """Triangles in mm, and what was done to them so far."""

    vertices_mm: Floats
    faces: Integers
    repairs: tuple[Repair, ...] = ()

    @property
    def volume_mm3(self) -> float:
        """NaN where the surface does not nearly close: its area as a vector is then not nil."""
        if not len(self.faces):
            return np.nan
        corners_mm = self.vertices_mm[self.faces]
        area = np.cross(corners_mm[:, 1] - corners_mm[:, 0], corners_mm[:, 2] - corners_mm[:, 0])
        if np.linalg.norm(area.sum(axis=0)) > NEARLY_CLOSED * np.linalg.norm(area, axis=1).sum():
            return np.nan
        return mesh_volume_mm3(self.vertices_mm, self.faces)

    def mended(self, what: str, count: int, faces: Integers, vertices_mm: Floats | None = None) -> "Surface":
        """With other faces, and perhaps vertices; told unless it was nothing."""
        after = replace(self, faces=faces, vertices_mm=self.vertices_mm if vertices_mm is None else vertices_mm)
        if not count:
            return after
        before_mm3 = self.volume_mm3
        change = abs(after.volume_mm3 / before_mm3) - 1 if before_mm3 else np.nan
        return replace(after, repairs=(*self.repairs, Repair(what, count, change)))

    def turned(self, what: str, turn: NDArray[np.bool_]) -> "Surface":
        """With those faces turned over; told unless it was none. What they enclose stays where it is."""
        faces = np.where(turn[:, None], self.faces[:, ::-1], self.faces)
        told = (Repair(what, int(turn.sum()), np.nan),) if turn.any() else ()
        return replace(self, faces=faces, repairs=(*self.repairs, *told))


def one_surface(vertices_mm: Floats, faces: Integers) -> Surface:
    """Vertices joined, faces without corners of their own dropped, and all faces looking out of their body.

    Holes stay open. Raises InputError where no face is left, or where faces cannot all look to one side, as on a
    Moebius strip.
    """
    surface = _without_repeats(_joined(Surface(vertices_mm, faces)))
    if not len(surface.faces):
        raise InputError(f"Mesh has no face with corners more than {WELD_MM:g} mm apart. Check its units.")
    return _facing_out(_facing_alike(surface))


def without_needles(surface: Surface) -> Surface:
    """The same surface with no triangle whose corners lie on a line.

    Each is merged with the neighbour along its longest edge, which its third corner then splits: nothing moves.
    Manifold (3.5.4) removes such triangles as it reads a mesh, and may take neighbours out of their plane with them:
    of a block of 127,039 mm³ that held one, 226 mm³ were gone.
    """
    faces = surface.faces.copy()
    vertex_count = len(surface.vertices_mm)
    for _ in range(MOST_ROUNDS):
        corners_mm = surface.vertices_mm[faces]
        edges_mm = np.linalg.norm(np.roll(corners_mm, -1, axis=1) - corners_mm, axis=2)
        across = np.cross(corners_mm[:, 1] - corners_mm[:, 0], corners_mm[:, 2] - corners_mm[:, 0])
        needles = np.flatnonzero(np.linalg.norm(across, axis=1) <= NEEDLE_MM * edges_mm.max(axis=1))
        if not len(needles):
            break
        longest = edges_mm[needles].argmax(axis=1)
        p, q, b = (faces[needles, (longest + k) % 3] for k in range(3))
        key = (faces * vertex_count + np.roll(faces, -1, axis=1)).reshape(-1)
        order = np.argsort(key)
        at = np.minimum(np.searchsorted(key, q * vertex_count + p, sorter=order), len(key) - 1)
        neighbour, place = np.divmod(order[at], 3)
        d = faces[neighbour, (place + 2) % 3]
        found = (key[order[at]] == q * vertex_count + p) & (b != d)
        found &= ~np.isin(b * vertex_count + d, key) & ~np.isin(d * vertex_count + b, key)
        # One merger for each face in a round: the rest wait for the next.
        involved = np.column_stack([needles, neighbour])[found]
        _, first = np.unique(involved, return_index=True)
        alone = np.isin(np.arange(involved.size), first).reshape(-1, 2).all(axis=1)
        if not alone.any():
            break
        one, other = involved[alone].T
        p, q, b, d = (corner[found][alone] for corner in (p, q, b, d))
        faces[one], faces[other] = np.column_stack([b, p, d]), np.column_stack([d, q, b])
    return replace(surface, faces=faces)


def _joined(surface: Surface) -> Surface:
    # Most formats write a vertex once for each of its faces: to join those is no repair.
    alike = equal_rows(surface.vertices_mm)
    places_mm = surface.vertices_mm[alike.first]
    surface = replace(surface, vertices_mm=places_mm, faces=alike.group[surface.faces])
    near = KDTree(places_mm).query_pairs(WELD_MM, output_type="ndarray")
    groups, group = _connected(len(places_mm), near[:, 0], near[:, 1])
    _, representative = np.unique(group, return_index=True)
    joined = representative[group[surface.faces]]
    return surface.mended(f"vertices joined to others within {WELD_MM:g} mm", len(places_mm) - groups, joined)


def _without_repeats(surface: Surface) -> Surface:
    corners = np.sort(surface.faces, axis=1)
    proper = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
    surface = surface.mended("faces without area dropped", int((~proper).sum()), surface.faces[proper])
    first = equal_rows(corners[proper]).first
    repeated = len(surface.faces) - len(first)
    return surface.mended("repeated faces dropped", repeated, surface.faces[np.sort(first)])


def _facing_alike(surface: Surface) -> Surface:
    """Every face looks to the same side as its neighbours: to that of most."""
    one, other, alike = neighbours(surface.faces)
    count = len(surface.faces)
    # Each face is there twice, as it is and turned over, and neighbours that disagree are linked crosswise: what then
    # hangs together agrees.
    as_is, turned_over = np.where(alike, other, other + count), np.where(alike, other + count, other)
    _, side = _connected(2 * count, np.append(one, one + count), np.append(as_is, turned_over))
    here, there = side[:count], side[count:]
    if (torn := here == there).any():
        x, y, z = surface.vertices_mm[surface.faces[np.argmax(torn)]].mean(axis=0)
        raise InputError(
            f"Mesh has no inside: {int(torn.sum())} of its faces cannot all look to one side, first near "
            f"({x:.2f}, {y:.2f}, {z:.2f}) mm. Mend it in the program that made it."
        )
    faces_on = np.bincount(here, minlength=side.max() + 1)
    turn = (faces_on[here] < faces_on[there]) | ((faces_on[here] == faces_on[there]) & (here > there))
    return surface.turned("faces turned to look as their neighbours do", turn)


def _facing_out(surface: Surface) -> Surface:
    """Bodies that are inside out and sheets that look down are turned over; hollows in the largest body are kept."""
    one, other, _ = neighbours(surface.faces)
    bodies, body = _connected(len(surface.faces), one, other)
    corners_mm = surface.vertices_mm[surface.faces]
    area = np.cross(corners_mm[:, 1] - corners_mm[:, 0], corners_mm[:, 2] - corners_mm[:, 0]) / 2
    size = np.bincount(body, minlength=bodies)
    middle_mm = _by_body(corners_mm.mean(axis=1), body, bodies) / size[:, None]
    volume_mm3 = np.bincount(body, np.linalg.det(corners_mm - middle_mm[body, None]) / 6, bodies)
    vector = _by_body(area, body, bodies)
    sheet = np.linalg.norm(vector, axis=1) > SHEET * np.bincount(body, np.linalg.norm(area, axis=1), bodies)
    inward = np.where(sheet, vector[:, 2], volume_mm3) < 0
    low, high = np.full((bodies, 3), np.inf), np.full((bodies, 3), -np.inf)
    np.minimum.at(low, body, corners_mm.min(axis=1))
    np.maximum.at(high, body, corners_mm.max(axis=1))
    largest = int(np.argmax(np.prod(high - low, axis=1)))
    inside = ((low >= low[largest]) & (high <= high[largest])).all(axis=1)
    turn = np.where(inside, inward[largest], inward)[body]
    return surface.turned("faces turned to look outward", turn)


def neighbours(faces: Integers) -> tuple[Integers, Integers, NDArray[np.bool_]]:
    """Pairs of faces that alone share an edge, and whether they look to the same side of it, (n,) each."""
    directed, uses = edge_uses(faces)
    pairs = uses.begins[uses.count == 2]
    one, other = uses.order[pairs], uses.order[pairs + 1]
    return one // 3, other // 3, directed[one, 0] != directed[other, 0]


def _connected(count: int, one: Integers, other: Integers) -> tuple[int, Integers]:
    """How many groups linked things fall into, and the group of each, (count,)."""
    links = coo_array((np.ones(len(one), dtype=np.int8), (one, other)), shape=(count, count))
    groups, group = connected_components(links, directed=False)
    return int(groups), np.asarray(group, dtype=np.int64)


def _by_body(values: Floats, body: Integers, bodies: int) -> Floats:
    """Sums over the faces of each body, (bodies, 3)."""
    return np.column_stack([np.bincount(body, column, bodies) for column in values.T]).astype(float)
