"""Where a watertight mesh meets an upright plane, as closed rings."""

import numpy as np

from sealtwin.records import Floats, Integers

Edge = tuple[int, int]


def cut_rings(vertices_mm: Floats, faces: Integers, foot_mm: Floats, ahead: Floats) -> list[Floats]:
    """Rings of the cut through ``foot_mm`` across the unit vector ``ahead``: (n, 2), to its right and z, in mm."""
    right = np.array([ahead[1], -ahead[0]])
    beyond = (vertices_mm[:, :2] - foot_mm) @ ahead
    place = np.column_stack([(vertices_mm[:, :2] - foot_mm) @ right, vertices_mm[:, 2]])
    is_beyond = beyond > 0
    neighbours: dict[Edge, list[Edge]] = {}
    for face in faces[np.ptp(is_beyond[faces].astype(int), axis=1) > 0].tolist():
        pairs = ((face[0], face[1]), (face[1], face[2]), (face[2], face[0]))
        one, other = (_edge(a, b) for a, b in pairs if is_beyond[a] != is_beyond[b])
        neighbours.setdefault(one, []).append(other)
        neighbours.setdefault(other, []).append(one)
    rings = []
    while neighbours:
        ring = _walk(neighbours)
        a, b = np.array(ring).T
        share = (beyond[a] / (beyond[a] - beyond[b]))[:, None]
        rings.append(place[a] + share * (place[b] - place[a]))
    return rings


def _edge(a: int, b: int) -> Edge:
    return (a, b) if a < b else (b, a)


def _walk(neighbours: dict[Edge, list[Edge]]) -> list[Edge]:
    """Take one ring of edges out of the map."""
    here = next(iter(neighbours))
    ring = []
    while here in neighbours:
        ring.append(here)
        onward = [edge for edge in neighbours.pop(here) if edge in neighbours]
        if not onward:
            break
        here = onward[0]
    return ring
