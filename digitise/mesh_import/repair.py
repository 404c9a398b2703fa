"""Repair of the mesh of a scan or of a CAD program into one closed surface; each repair is counted and reported."""

from dataclasses import dataclass, replace

import numpy as np
from manifold3d import CrossSection, Error, FillRule, Manifold, Mesh64, OpType, triangulate
from numpy.typing import NDArray

from digitise.geometry import mesh_topology
from digitise.geometry.polyline import signed_area
from digitise.solid.float_mesh import representatives
from sealtwin.core.errors import InputError
from sealtwin.core.mesh_file import UnreadableError, fill_ring
from sealtwin.core.records import Floats, Integers
from sealtwin.core.solid_figures import Repair

WELD_MM = mesh_topology.MIN_EDGE_MM / 2  # Vertices within are one, as corners of a triangle soup; longer edges stay
SHEET = 0.5  # Area vector over area that means a sheet; that of a closed surface is zero
NEEDLE_MM = 1e-7  # Height below which a triangle is a line: a thousandth of float32's step at 160 mm
MOST_ROUNDS = 50  # Most rounds of merging needles, one for each needle in a stack
NEARLY_CLOSED = 0.01  # Largest share of open area for which a volume is computed, with about that error
LOOSE = 0.01  # Share of the largest body's volume below which a loose piece is dropped
MOST_OPEN = 0.01  # Largest share of open edges that are small damage; more means that the scan missed some surface
RIM_SPAN = 0.5  # Share of the mesh's extent along x and along y from which on an opening is the rim of a scan
FLAT = 1e-3  # Share of the mesh's height within which an opening is flat and at the bottom, as of a missing underside


@dataclass(frozen=True)
class RepairedSurface:
    """Triangles in mm, and the repairs made so far."""

    vertices_mm: Floats
    faces: Integers
    repairs: tuple[Repair, ...] = ()

    @property
    def volume_mm3(self) -> float:
        """Enclosed volume. It is NaN unless the surface nearly closes, so that its area vector is nearly zero."""
        if not len(self.faces):
            return np.nan
        area = mesh_topology.normals(self.vertices_mm[self.faces])
        if np.linalg.norm(area.sum(axis=0)) > NEARLY_CLOSED * np.linalg.norm(area, axis=1).sum():
            return np.nan
        return mesh_topology.mesh_volume_mm3(self.vertices_mm, self.faces)

    def mended(self, what: str, count: int, faces: Integers, vertices_mm: Floats | None = None) -> "RepairedSurface":
        """Return the surface with other faces, and vertices if given. The repair is listed unless ``count`` is 0."""
        after = replace(self, faces=faces, vertices_mm=self.vertices_mm if vertices_mm is None else vertices_mm)
        if not count:
            return after
        before_mm3 = self.volume_mm3
        change = abs(after.volume_mm3 / before_mm3) - 1 if before_mm3 else np.nan
        return replace(after, repairs=(*self.repairs, Repair(what, count, None if np.isnan(change) else change)))

    def turned(self, what: str, turn: NDArray[np.bool_]) -> "RepairedSurface":
        """Return the surface with some faces turned over; the enclosed volume does not change."""
        faces = np.where(turn[:, None], self.faces[:, ::-1], self.faces)
        repair = (Repair(what, int(turn.sum()), None),) if turn.any() else ()
        return replace(self, faces=faces, repairs=(*self.repairs, *repair))


def one_surface(vertices_mm: Floats, faces: Integers) -> RepairedSurface:
    """Join vertices, drop degenerate faces, and turn all faces outward; holes stay open."""
    surface = _without_repeats(_joined(RepairedSurface(vertices_mm, faces)))
    if not len(surface.faces):
        raise InputError(f"Mesh has no face with corners more than {WELD_MM:g} mm apart. Check its units.")
    return _facing_out(_facing_alike(surface))


def without_needles(surface: RepairedSurface) -> RepairedSurface:
    """Merge each triangle without height with the neighbour at its longest edge, which its third corner then splits.

    Manifold (3.5.4) removes such triangles on reading and may move neighbours: a block of 127,039 mm³ lost 226 mm³.
    """
    faces = surface.faces.copy()
    vertex_count = len(surface.vertices_mm)
    for _ in range(MOST_ROUNDS):
        corners_mm = surface.vertices_mm[faces]
        edges_mm = np.linalg.norm(np.roll(corners_mm, -1, axis=1) - corners_mm, axis=2)
        double_area_mm2 = np.linalg.norm(mesh_topology.normals(corners_mm), axis=1)
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
        mergeable = (key[order[at]] == q * vertex_count + p) & (b != d)
        mergeable &= ~np.isin(b * vertex_count + d, key) & ~np.isin(d * vertex_count + b, key)
        # Each face is merged once in a round; the rest follow in the next.
        involved = np.column_stack([needles, neighbour])[mergeable]
        _, first = np.unique(involved, return_index=True)
        alone = np.isin(np.arange(involved.size), first).reshape(-1, 2).all(axis=1)
        if not alone.any():
            break
        one, other = involved[alone].T
        p, q, b, d = (corner[mergeable][alone] for corner in (p, q, b, d))
        faces[one], faces[other] = np.column_stack([b, p, d]), np.column_stack([d, q, b])
    return replace(surface, faces=faces)


def _joined(surface: RepairedSurface) -> RepairedSurface:
    # Most formats write a vertex once for each of its faces; joining these is not a repair.
    alike = mesh_topology.equal_rows(surface.vertices_mm)
    places_mm = surface.vertices_mm[alike.first]
    surface = replace(surface, vertices_mm=places_mm, faces=alike.group[surface.faces])
    representative = representatives(places_mm, WELD_MM)
    joined = int((representative != np.arange(len(representative))).sum())
    return surface.mended(f"vertices joined to others within {WELD_MM:g} mm", joined, representative[surface.faces])


def _without_repeats(surface: RepairedSurface) -> RepairedSurface:
    corners = np.sort(surface.faces, axis=1)
    proper = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
    surface = surface.mended("faces without area dropped", int((~proper).sum()), surface.faces[proper])
    first = mesh_topology.equal_rows(corners[proper]).first
    repeated = len(surface.faces) - len(first)
    return surface.mended("repeated faces dropped", repeated, surface.faces[np.sort(first)])


def _facing_alike(surface: RepairedSurface) -> RepairedSurface:
    """Turn faces over so that all neighbours agree. In each connected body, the majority of faces stays."""
    one, other, alike = mesh_topology.neighbours(surface.faces)
    count = len(surface.faces)
    # Each face has two nodes, as it is and turned over, and neighbours that disagree are linked crosswise: connected
    # nodes then agree.
    as_is, turned_over = np.where(alike, other, other + count), np.where(alike, other + count, other)
    _, side = mesh_topology.connected(2 * count, np.append(one, one + count), np.append(as_is, turned_over))
    here, there = side[:count], side[count:]
    if (torn := here == there).any():
        first = mesh_topology.near(surface.vertices_mm[surface.faces[np.argmax(torn)]].mean(axis=0))
        raise InputError(
            f"Mesh has no inside: {int(torn.sum())} of its faces cannot be turned to agree with their neighbours; the "
            f"first is {first}. Repair it in the program that made it."
        )
    faces_on = np.bincount(here, minlength=side.max() + 1)
    turn = (faces_on[here] < faces_on[there]) | ((faces_on[here] == faces_on[there]) & (here > there))
    return surface.turned("faces turned to agree with their neighbours", turn)


def _facing_out(surface: RepairedSurface) -> RepairedSurface:
    """Turn over bodies that are inside out and sheets that face down; hollows in the largest body stay."""
    one, other, _ = mesh_topology.neighbours(surface.faces)
    bodies, body = mesh_topology.connected(len(surface.faces), one, other)
    corners_mm = surface.vertices_mm[surface.faces]
    area = mesh_topology.normals(corners_mm) / 2
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
    """Return the enclosed body and all repairs. Overlapping bodies are united, hollows filled, and crumbs removed."""
    sound = without_needles(surface)
    body = Manifold(Mesh64(sound.vertices_mm, sound.faces.astype(np.uint64)))
    if body.status() != Error.NoError:
        faults = mesh_topology.check_mesh(surface.vertices_mm, surface.faces)
        raise InputError(f"{faults[0]} Repair it in the program that made it.")
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
        ("loose fragments left out", len(crumbs), -sum(piece.volume() for piece in crumbs)),
        (
            "overlapping bodies united",
            len(solid) if len(solid) > len(united.decompose()) else 0,
            united.volume() - sum(piece.volume() for piece in solid),
        ),
    )
    done = (Repair(what, count, change_mm3 / volume_mm3) for what, count, change_mm3 in changes if count)
    return united, (*surface.repairs, *done)


@dataclass(frozen=True)
class Openings:
    """Rings of vertices around the holes of a surface, each with the surface on its left."""

    holes: tuple[Integers, ...]
    rim: Integers | None = None  # Ring as wide as the mesh itself, below which everything is missing
    underside: tuple[Integers, ...] = ()  # The same if flat at the bottom, so that only the underside is missing


def find_openings(surface: RepairedSurface) -> Openings:
    """Return the rings of open edges; the longest ring that is as wide as the mesh is kept separate."""
    rings = _rings(mesh_topology.open_edges(surface.faces))
    place_mm = surface.vertices_mm
    used_mm = place_mm[np.unique(surface.faces)]
    extent_mm, lowest_mm = np.ptp(used_mm, axis=0), used_mm[:, 2].min()
    for number, ring in enumerate(rings):
        if (np.ptp(place_mm[ring], axis=0)[:2] > RIM_SPAN * extent_mm[:2]).all():
            holes = tuple(rings[:number] + rings[number + 1 :])
            at_bottom = place_mm[ring, 2].max() <= lowest_mm + FLAT * extent_mm[2]
            return Openings(holes, underside=(ring,)) if at_bottom else Openings(holes, rim=ring)
    return Openings(tuple(rings))


def close_holes(surface: RepairedSurface, openings: Openings) -> RepairedSurface:
    """Fill small holes and a missing underside; a sheet stays open at its rim."""
    directed, uses = mesh_topology.edge_uses(surface.faces)
    edges, unclosed = len(uses.begins), directed[uses.first[uses.count == 1]]
    wide = sum(map(len, openings.underside)) + (0 if openings.rim is None else len(openings.rim))
    small = len(unclosed) - wide
    if small > MOST_OPEN * edges or small != sum(map(len, openings.holes)):
        place = mesh_topology.near(surface.vertices_mm[unclosed[0, 0]])
        raise InputError(
            f"Mesh is not watertight: {small} of {edges} edges are open, the first {place}; only open edges that form "
            f"whole rings, up to {MOST_OPEN:.0%} of all, are closed automatically. Close the holes in the program "
            "that made it."
        )
    filled = _filled(surface, openings.holes, f"holes closed, of {small} open edges")
    return _filled(filled, openings.underside, "missing underside closed")


def _filled(surface: RepairedSurface, holes: tuple[Integers, ...], what: str) -> RepairedSurface:
    lids = []
    for ring in (hole[::-1] for hole in holes):
        try:
            lids.append(ring[fill_ring(surface.vertices_mm[ring])])
        except UnreadableError as fault:
            place = mesh_topology.near(surface.vertices_mm[ring[0]])
            raise InputError(
                f"Mesh is not watertight: the hole of {len(ring)} edges {place} has no area to close. Close it in the "
                "program that made the mesh."
            ) from fault
    return surface.mended(what, len(lids), np.concatenate([surface.faces, *lids]))


def with_base(surface: RepairedSurface, rim: Integers, base_mm: float) -> RepairedSurface:
    """Return a sheet as a body: upright sides from its rim to a flat underside at z = -``base_mm``."""
    lowest_mm = float(surface.vertices_mm[np.unique(surface.faces), 2].min())
    if lowest_mm <= -base_mm:
        raise InputError(
            f"base_mm is {base_mm:g}, but the mesh reaches {-lowest_mm:.2f} mm below its face. Give a larger base_mm."
        )
    corners_mm = surface.vertices_mm[rim]
    plan = CrossSection([np.ascontiguousarray(corners_mm[:, :2])], FillRule.Positive)
    signed_mm2 = signed_area(corners_mm[:, :2])
    if abs(plan.area() - signed_mm2) > FLAT * abs(signed_mm2):
        raise InputError("Seen from above, the rim of the mesh overlaps itself. Crop the mesh to its upper surface.")
    foot = len(surface.vertices_mm) + np.arange(len(rim))
    next_rim, next_foot = np.roll(rim, -1), np.roll(foot, -1)
    sides = np.concatenate([np.column_stack([next_rim, rim, foot]), np.column_stack([next_rim, foot, next_foot])])
    underside = foot[np.asarray(triangulate([np.ascontiguousarray(corners_mm[:, :2])]), dtype=np.int64)][:, ::-1]
    feet_mm = np.column_stack([corners_mm[:, :2], np.full(len(rim), -base_mm)])
    return surface.mended(
        f"sheet given sides and an underside {base_mm:g} mm below the face",
        1,
        np.concatenate([surface.faces, sides, underside]),
        np.concatenate([surface.vertices_mm, feet_mm]),
    )


def closed(surface: RepairedSurface, base_mm: float | None) -> RepairedSurface:
    """Close holes and give a sheet its base. Raises InputError for a sheet without base_mm or a body with it."""
    openings = find_openings(surface)
    surface = close_holes(surface, openings)
    if openings.rim is not None and base_mm is not None:
        return with_base(surface, openings.rim, base_mm)
    if openings.rim is not None:
        raise InputError(
            "Mesh encloses no volume; it is a sheet. Give base_mm, the depth of a flat underside below the face, to "
            "make it solid."
        )
    if base_mm is not None:
        sides = "has sides down to a flat underside, which is closed" if openings.underside else "is closed below"
        raise InputError(f"base_mm is {base_mm:g}, but the mesh {sides}. Remove base_mm.")
    return surface


def _rings(edges: Integers) -> list[Integers]:
    """Return closed walks along the edges, longest first; dead ends are omitted."""
    onward: dict[int, list[int]] = {}
    for start, end in edges.tolist():
        onward.setdefault(start, []).append(end)
    rings = []
    while onward:
        walk = [next(iter(onward))]
        place = {walk[0]: 0}
        while walk:
            if not (next_vertices := onward.get(walk[-1])):
                onward.pop(walk[-1], None)
                del place[walk.pop()]
                continue
            following = next_vertices.pop()
            if following not in place:
                place[following] = len(walk)
                walk.append(following)
                continue
            # If holes touch in a vertex, this is one of them, and the walk continues around the other.
            ring = walk[place[following] :]
            rings.append(np.array(ring, dtype=np.int64))
            for vertex in ring[1:]:
                del place[vertex]
            del walk[place[following] + 1 :]
    return sorted(rings, key=len, reverse=True)
