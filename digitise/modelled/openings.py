"""Where a surface is open: small holes are filled, a missing underside is closed, a scanned sheet gets sides."""

from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, FillRule, triangulate

from digitise.geometry.edges import edge_uses, open_edges
from digitise.geometry.polyline import signed_area
from digitise.modelled.repair import Surface
from digitise.modelled.triangles import fill_ring
from sealtwin.errors import InputError
from sealtwin.records import Integers

MOST_OPEN = 0.01
"""Of all edges, that may be open to be closed unasked: more holes are a surface that was not seen."""
RIM_SPAN = 0.5
"""Of the mesh's extent along x and along y: an opening as wide as that is where a scan ends."""
FLAT = 1e-3
"""Of the mesh's height: an opening as flat and as near to the lowest point is a missing underside."""


@dataclass(frozen=True)
class Openings:
    """Rings of vertices round the holes of a surface; each runs so that the surface is on its left."""

    holes: tuple[Integers, ...]
    wide: Integers | None
    """As wide as the mesh itself: all that is below it is missing."""
    is_underside: bool
    """Whether that one lies flat at the bottom, so that nothing is missing but the underside."""


def find_openings(surface: Surface) -> Openings:
    """Rings of open edges, the longest that is as wide as the mesh apart."""
    rings = _rings(open_edges(surface.faces))
    place_mm = surface.vertices_mm
    used_mm = place_mm[np.unique(surface.faces)]
    extent_mm, lowest_mm = np.ptp(used_mm, axis=0), used_mm[:, 2].min()
    for number, ring in enumerate(rings):
        if (np.ptp(place_mm[ring], axis=0)[:2] > RIM_SPAN * extent_mm[:2]).all():
            at_bottom = bool(place_mm[ring, 2].max() <= lowest_mm + FLAT * extent_mm[2])
            return Openings(tuple(rings[:number] + rings[number + 1 :]), ring, at_bottom)
    return Openings(tuple(rings), None, False)


def close_holes(surface: Surface, openings: Openings) -> Surface:
    """Small holes filled, and a missing underside; a sheet stays open at its rim.

    Raises InputError where holes are more than small damage, or where edges are open that make no ring.
    """
    directed, uses = edge_uses(surface.faces)
    edges, unclosed = len(uses.begins), directed[uses.first[uses.count == 1]]
    small = len(unclosed) - (0 if openings.wide is None else len(openings.wide))
    if small > MOST_OPEN * edges or small != sum(map(len, openings.holes)):
        x, y, z = surface.vertices_mm[unclosed[0, 0]]
        raise InputError(
            f"Mesh is not watertight: {small} of {edges} edges are open, first near ({x:.2f}, {y:.2f}, {z:.2f}) "
            f"mm; up to {MOST_OPEN:.0%} in whole rings are closed. Close the holes in the program that made it."
        )
    filled = _filled(surface, openings.holes, f"holes closed, of {small} open edges")
    if openings.wide is None or not openings.is_underside:
        return filled
    return _filled(filled, (openings.wide,), "missing underside closed")


def _filled(surface: Surface, holes: tuple[Integers, ...], what: str) -> Surface:
    lids = [hole[::-1][fill_ring(surface.vertices_mm[hole[::-1]])] for hole in holes]
    return surface.mended(what, len(lids), np.concatenate([surface.faces, *lids]))


def with_base(surface: Surface, rim: Integers, base_mm: float) -> Surface:
    """A sheet as a body: upright sides from its rim to a flat underside at z = -``base_mm``.

    Raises InputError where the sheet reaches below the underside, or its rim crosses itself seen from above.
    """
    lowest_mm = float(surface.vertices_mm[np.unique(surface.faces), 2].min())
    if lowest_mm <= -base_mm:
        raise InputError(
            f"base_mm is {base_mm:g}, but the mesh reaches {-lowest_mm:.2f} mm below its face. Give more than that."
        )
    corners_mm = surface.vertices_mm[rim]
    seen = CrossSection([np.ascontiguousarray(corners_mm[:, :2])], FillRule.Positive)
    signed_mm2 = signed_area(corners_mm[:, :2])
    if abs(seen.area() - signed_mm2) > FLAT * abs(signed_mm2):
        raise InputError("The rim of the mesh overhangs itself seen from above. Crop the mesh to its upper side.")
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
    """Closed walks along the edges, longest first; edges that lead nowhere are left out."""
    onward: dict[int, list[int]] = {}
    for start, end in edges.tolist():
        onward.setdefault(start, []).append(end)
    rings = []
    while onward:
        walk = [next(iter(onward))]
        place = {walk[0]: 0}
        while walk:
            if not (ways := onward.get(walk[-1])):
                onward.pop(walk[-1], None)
                del place[walk.pop()]
                continue
            following = ways.pop()
            if following not in place:
                place[following] = len(walk)
                walk.append(following)
                continue
            # Where holes touch in a vertex, this is one of them, and the walk goes on round the other.
            ring = walk[place[following] :]
            rings.append(np.array(ring, dtype=np.int64))
            for vertex in ring[1:]:
                del place[vertex]
            del walk[place[following] + 1 :]
    return sorted(rings, key=len, reverse=True)
