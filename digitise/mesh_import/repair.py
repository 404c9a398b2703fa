"""Repair of the mesh of a scan or of a CAD program into one surface; each repair is counted and reported."""

from dataclasses import dataclass, replace

import numpy as np
from manifold3d import Error, Manifold, Mesh64, OpType
from numpy.typing import NDArray

from digitise.geometry.mesh_topology import (
    MIN_EDGE_MM,
    check_mesh,
    connected,
    equal_rows,
    mesh_volume_mm3,
    near,
    neighbours,
    normals,
)
from digitise.solid.float_mesh import representatives
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers
from sealtwin.core.solid_figures import Repair

WELD_MM = MIN_EDGE_MM / 2  # Vertices within it are one, as the corners of a triangle soup; edges twice as long stay
SHEET = 0.5  # Share of its area from which on a surface's area vector, nil for a closed one, means a sheet
NEEDLE_MM = 1e-7  # Height below which a triangle is a line: a thousandth of float32's step at 160 mm
MOST_ROUNDS = 50  # Most rounds of merging needles, one for each needle in a stack
NEARLY_CLOSED = 0.01  # Share of open area up to which the enclosed volume is known, to about as much
LOOSE = 0.01  # Share of the largest body's volume below which a loose piece is no part of a sample


@dataclass(frozen=True)
class RepairedSurface:
    """Triangles in mm, and the repairs made so far."""

    vertices_mm: Floats
    faces: Integers
    repairs: tuple[Repair, ...] = ()

    @property
    def volume_mm3(self) -> float:
        """Enclosed volume; NaN unless the surface nearly closes, which makes its area vector nearly nil."""
        if not len(self.faces):
            return np.nan
        area = normals(self.vertices_mm[self.faces])
        if np.linalg.norm(area.sum(axis=0)) > NEARLY_CLOSED * np.linalg.norm(area, axis=1).sum():
            return np.nan
        return mesh_volume_mm3(self.vertices_mm, self.faces)

    def mended(self, what: str, count: int, faces: Integers, vertices_mm: Floats | None = None) -> "RepairedSurface":
        """Return the surface with other faces, and perhaps vertices; a count of 0 is not reported."""
        after = replace(self, faces=faces, vertices_mm=self.vertices_mm if vertices_mm is None else vertices_mm)
        if not count:
            return after
        before_mm3 = self.volume_mm3
        change = abs(after.volume_mm3 / before_mm3) - 1 if before_mm3 else np.nan
        return replace(after, repairs=(*self.repairs, Repair(what, count, None if np.isnan(change) else change)))

    def turned(self, what: str, turn: NDArray[np.bool_]) -> "RepairedSurface":
        """Return the surface with those faces turned over, which leaves the enclosed volume as it is."""
        faces = np.where(turn[:, None], self.faces[:, ::-1], self.faces)
        repair = (Repair(what, int(turn.sum()), None),) if turn.any() else ()
        return replace(self, faces=faces, repairs=(*self.repairs, *repair))


def one_surface(vertices_mm: Floats, faces: Integers) -> RepairedSurface:
    """Join vertices, drop degenerate faces, and turn all faces out of their body; holes stay open."""
    surface = _without_repeats(_joined(RepairedSurface(vertices_mm, faces)))
    if not len(surface.faces):
        raise InputError(f"Mesh has no face with corners more than {WELD_MM:g} mm apart. Check its units.")
    return _facing_out(_facing_alike(surface))


def without_needles(surface: RepairedSurface) -> RepairedSurface:
    """Merge each triangle without height with the neighbour along its longest edge, which its third corner then splits.

    Manifold (3.5.4) removes such triangles on reading and may move neighbours: a block of 127,039 mm³ lost 226 mm³.
    """
    faces = surface.faces.copy()
    vertex_count = len(surface.vertices_mm)
    for _ in range(MOST_ROUNDS):
        corners_mm = surface.vertices_mm[faces]
        edges_mm = np.linalg.norm(np.roll(corners_mm, -1, axis=1) - corners_mm, axis=2)
        double_area_mm2 = np.linalg.norm(normals(corners_mm), axis=1)
        needles = np.flatnonzero(double_area_mm2 <= NEEDLE_MM * edges_mm.max(axis=1))
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
        # One merger for each face in a round; the rest follow in the next.
        involved = np.column_stack([needles, neighbour])[found]
        _, first = np.unique(involved, return_index=True)
        alone = np.isin(np.arange(involved.size), first).reshape(-1, 2).all(axis=1)
        if not alone.any():
            break
        one, other = involved[alone].T
        p, q, b, d = (corner[found][alone] for corner in (p, q, b, d))
        faces[one], faces[other] = np.column_stack([b, p, d]), np.column_stack([d, q, b])
    return replace(surface, faces=faces)


def _joined(surface: RepairedSurface) -> RepairedSurface:
    # Most formats write a vertex once for each of its faces, and joining those is no repair.
    alike = equal_rows(surface.vertices_mm)
    places_mm = surface.vertices_mm[alike.first]
    surface = replace(surface, vertices_mm=places_mm, faces=alike.group[surface.faces])
    kept = representatives(places_mm, WELD_MM)
    joined = int((kept != np.arange(len(kept))).sum())
    return surface.mended(f"vertices joined to others within {WELD_MM:g} mm", joined, kept[surface.faces])


def _without_repeats(surface: RepairedSurface) -> RepairedSurface:
    corners = np.sort(surface.faces, axis=1)
    proper = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
    surface = surface.mended("faces without area dropped", int((~proper).sum()), surface.faces[proper])
    first = equal_rows(corners[proper]).first
    repeated = len(surface.faces) - len(first)
    return surface.mended("repeated faces dropped", repeated, surface.faces[np.sort(first)])


def _facing_alike(surface: RepairedSurface) -> RepairedSurface:
    """Turn each face to agree with its neighbours, by their majority."""
    one, other, alike = neighbours(surface.faces)
    count = len(surface.faces)
    # Each face has two nodes, as it is and turned over, and neighbours that disagree are linked crosswise: connected
    # nodes then agree.
    as_is, turned_over = np.where(alike, other, other + count), np.where(alike, other + count, other)
    _, side = connected(2 * count, np.append(one, one + count), np.append(as_is, turned_over))
    here, there = side[:count], side[count:]
    if (torn := here == there).any():
        first = near(surface.vertices_mm[surface.faces[np.argmax(torn)]].mean(axis=0))
        raise InputError(
            f"Mesh has no inside: {int(torn.sum())} of its faces cannot all point to one side, first {first}. Mend it "
            "in the program that made it."
        )
    faces_on = np.bincount(here, minlength=side.max() + 1)
    turn = (faces_on[here] < faces_on[there]) | ((faces_on[here] == faces_on[there]) & (here > there))
    return surface.turned("faces turned to agree with their neighbours", turn)


def _facing_out(surface: RepairedSurface) -> RepairedSurface:
    """Turn over bodies that are inside out and sheets that face down; hollows in the largest body stay."""
    one, other, _ = neighbours(surface.faces)
    bodies, body = connected(len(surface.faces), one, other)
    corners_mm = surface.vertices_mm[surface.faces]
    area = normals(corners_mm) / 2
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
    return surface.turned("faces turned to point outward", turn)


def _by_body(values: Floats, body: Integers, bodies: int) -> Floats:
    """Return the sums over the faces of each body, (bodies, 3)."""
    return np.column_stack([np.bincount(body, column, bodies) for column in values.T]).astype(float)


def bounded_body(surface: RepairedSurface) -> tuple[Manifold, tuple[Repair, ...]]:
    """Return the enclosed body and all repairs: overlapping bodies united, hollows filled, crumbs left out."""
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
    volume_mm3 = sum(piece.volume() for piece in pieces)
    changes = (
        ("hollows inside the sample filled", len(hollows), -sum(piece.volume() for piece in hollows)),
        ("loose crumbs left out", len(crumbs), -sum(piece.volume() for piece in crumbs)),
        (
            "overlapping bodies united",
            len(solid) if len(solid) > len(united.decompose()) else 0,
            united.volume() - sum(piece.volume() for piece in solid),
        ),
    )
    done = (Repair(what, count, change_mm3 / volume_mm3) for what, count, change_mm3 in changes if count)
    return united, (*surface.repairs, *done)
