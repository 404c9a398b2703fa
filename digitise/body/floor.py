"""The floor of a crack whose depth changes along it: a surface over the plane of the face, level from wall to wall."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from manifold3d import CrossSection, Manifold, Mesh64
from scipy.spatial import Delaunay

from digitise.geometry.edges import open_edges
from digitise.geometry.polyline import at_arc_length, smoothed
from digitise.geometry.region import Box
from digitise.settings import CrackShape
from sealtwin.records import Floats, arc_length, arc_length_at

STATION_MM = 1.0
"""Between corners of the floor, along and across the crack: a third of the paper's width."""
SMOOTHED_STATIONS = 1.0
"""Standard deviation of a Gaussian over the centreline: the floor's lines are to stand square to the crack, not to the
waver of its trace."""
ROOM_MM = 10.0
"""Around the block: a dam is 4 mm thick."""


@dataclass(frozen=True)
class Floor:
    """Triangles over the plane of the face, with the depth of each corner."""

    corners_mm: Floats  # (n, 2)
    depth_mm: Floats  # (n,)
    bottom_mm: float
    """z down to which the ground below reaches."""

    def depth_at_mm(self, place_mm: Floats) -> Floats:
        """Depth of the floor below places on the face, (n,)."""
        triangle = self._triangles.find_simplex(place_mm)
        to_weights = self._triangles.transform[triangle]
        weights = np.einsum("nij,nj->ni", to_weights[:, :2], place_mm - to_weights[:, 2])
        weights = np.column_stack([weights, 1 - weights.sum(axis=1)])
        return (weights * self.depth_mm[self._triangles.simplices[triangle]]).sum(axis=1)

    def above(self, depth_mm: float) -> CrossSection:
        """Where the floor lies higher than a depth."""
        return self.ground.slice(-depth_mm)

    @cached_property
    def ground(self) -> Manifold:
        """All below the floor."""
        count = len(self.corners_mm)
        top = self._triangles.simplices.astype(np.int64)
        a, b = open_edges(top).T
        sides = np.vstack([np.column_stack([b, a, a + count]), np.column_stack([b, a + count, b + count])])
        levels_mm = (-self.depth_mm, np.full(count, self.bottom_mm))
        vertices = np.vstack([np.column_stack([self.corners_mm, z_mm]) for z_mm in levels_mm])
        faces = np.vstack([top, top[:, ::-1] + count, sides])
        return Manifold(Mesh64(vertices, faces.astype(np.uint64)))

    @cached_property
    def _triangles(self) -> Delaunay:
        return Delaunay(self.corners_mm)


def lay_floor(centreline_mm: Floats, shape: CrackShape, reach_mm: float, box_mm: Box) -> Floor | None:
    """None where the depth is the same all along: then the floor is a plane.

    A place of the floor is as deep as the table says for the nearest place of the centreline. Lines across the crack
    carry the depth of their station; on the inside of a bend each ends where it would meet its neighbours, at places as
    near to another station. ``reach_mm`` is how far from the centreline the cavity may lie, inside ``box_mm``.
    """
    s_mm, line_mm = _stations(centreline_mm, shape)
    if np.ptp(shape.depth_at_mm(s_mm)) == 0:
        return None
    own_mm = arc_length(line_mm)
    across_mm = np.arange(-np.ceil(reach_mm / STATION_MM), np.ceil(reach_mm / STATION_MM) + 1) * STATION_MM
    places_mm = (line_mm[:, None] + across_mm[:, None] * _to_left(line_mm, own_mm)[:, None]).reshape(-1, 2)
    straying_mm = np.abs(arc_length_at(places_mm, line_mm) - np.repeat(own_mm, len(across_mm)))
    corners_mm = np.vstack([places_mm[straying_mm < STATION_MM / 4], _around(places_mm, box_mm)])
    nearest_s_mm = np.interp(arc_length_at(corners_mm, line_mm), own_mm, s_mm)
    return Floor(corners_mm, shape.depth_at_mm(nearest_s_mm), -shape.deepest_mm - shape.floor_thickness_mm)


def _stations(centreline_mm: Floats, shape: CrackShape) -> tuple[Floats, Floats]:
    """Arc lengths, those of the table among them, and where the smoothed centreline is there, (n,) and (n, 2)."""
    s_mm = arc_length(centreline_mm)
    even_mm = np.linspace(0.0, s_mm[-1], max(2, 1 + round(s_mm[-1] / STATION_MM)))
    smooth_mm = smoothed(at_arc_length(centreline_mm, s_mm, even_mm), SMOOTHED_STATIONS)
    table_mm = shape.depth_stations_mm
    table_mm = table_mm[(table_mm > 0) & (table_mm < s_mm[-1])]
    # The table's own stations in place of those that would stand next to them.
    clear = (np.abs(even_mm[:, None] - table_mm) > STATION_MM / 4).all(axis=1)
    clear[[0, -1]] = True
    stations_mm = np.union1d(even_mm[clear], table_mm)
    return stations_mm, at_arc_length(smooth_mm, even_mm, stations_mm)


def _to_left(line_mm: Floats, own_mm: Floats) -> Floats:
    """Unit vectors square to the line, (n, 2); its ends bend like what is next to them."""
    x, y = np.gradient(line_mm, own_mm, axis=0, edge_order=2 if len(line_mm) > 2 else 1).T
    return np.column_stack([-y, x]) / np.hypot(x, y)[:, None]


def _around(places_mm: Floats, box_mm: Box) -> Floats:
    """Four corners that hold the places, and the box with its dams: a depth is asked of their corners too."""
    low = np.minimum(places_mm.min(axis=0), box_mm[:2]) - ROOM_MM
    high = np.maximum(places_mm.max(axis=0), box_mm[2:]) + ROOM_MM
    return np.array([low, (high[0], low[1]), high, (low[0], high[1])])
