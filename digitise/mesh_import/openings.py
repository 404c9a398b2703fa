"""Closing of open surfaces: small holes are filled, a missing underside is closed, a scanned sheet gets sides."""

from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, FillRule, triangulate

from digitise.geometry.mesh_topology import edge_uses, near, open_edges
from digitise.geometry.polyline import signed_area
from digitise.mesh_import.repair import RepairedSurface
from sealtwin.core.errors import InputError
from sealtwin.core.mesh_file import UnreadableError, fill_ring
from sealtwin.core.records import Integers

MOST_OPEN = 0.01  # Largest share of open edges that are small damage; more means that the scan missed some surface
RIM_SPAN = 0.5  # Share of the mesh's extent along x and along y from which on an opening is the rim of a scan
FLAT = 1e-3  # Share of the mesh's height within which an opening is flat and at the bottom, as a missing underside is


@dataclass(frozen=True)
class Openings:
    """Rings of vertices around the holes of a surface, each with the surface on its left."""

    holes: tuple[Integers, ...]
    rim: Integers | None = None  # Ring as wide as the mesh itself, below which everything is missing
    underside: tuple[Integers, ...] = ()  # The same if flat at the bottom, so that only the underside is missing


def find_openings(surface: RepairedSurface) -> Openings:
    """Return the rings of open edges, with the longest ring as wide as the mesh apart."""
    rings = _rings(open_edges(surface.faces))
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
    directed, uses = edge_uses(surface.faces)
    edges, unclosed = len(uses.begins), directed[uses.first[uses.count == 1]]
    wide = sum(map(len, openings.underside)) + (0 if openings.rim is None else len(openings.rim))
    small = len(unclosed) - wide
    if small > MOST_OPEN * edges or small != sum(map(len, openings.holes)):
        raise InputError(
            f"Mesh is not watertight: {small} of {edges} edges are open, first "
            f"{near(surface.vertices_mm[unclosed[0, 0]])}; up to {MOST_OPEN:.0%} in whole rings are closed. Close the "
            "holes in the program that made it."
        )
    filled = _filled(surface, openings.holes, f"holes closed, of {small} open edges")
    return _filled(filled, openings.underside, "missing underside closed")


def _filled(surface: RepairedSurface, holes: tuple[Integers, ...], what: str) -> RepairedSurface:
    lids = []
    for ring in (hole[::-1] for hole in holes):
        try:
            lids.append(ring[fill_ring(surface.vertices_mm[ring])])
        except UnreadableError as fault:
            raise InputError(
                f"Mesh is not watertight: the hole of {len(ring)} edges {near(surface.vertices_mm[ring[0]])} has no "
                "area to close. Close it in the program that made the mesh."
            ) from fault
    return surface.mended(what, len(lids), np.concatenate([surface.faces, *lids]))


def with_base(surface: RepairedSurface, rim: Integers, base_mm: float) -> RepairedSurface:
    """Return a sheet as a body: upright sides from its rim to a flat underside at z = -``base_mm``."""
    lowest_mm = float(surface.vertices_mm[np.unique(surface.faces), 2].min())
    if lowest_mm <= -base_mm:
        raise InputError(
            f"base_mm is {base_mm:g}, but the mesh reaches {-lowest_mm:.2f} mm below its face. Give more than that."
        )
    corners_mm = surface.vertices_mm[rim]
    plan = CrossSection([np.ascontiguousarray(corners_mm[:, :2])], FillRule.Positive)
    signed_mm2 = signed_area(corners_mm[:, :2])
    if abs(plan.area() - signed_mm2) > FLAT * abs(signed_mm2):
        raise InputError("The rim of the mesh overhangs itself in plan view. Crop the mesh to its upper side.")
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


def _rings(edges: Integers) -> list[Integers]:
    """Return closed walks along the edges, longest first; dead ends are left out."""
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
