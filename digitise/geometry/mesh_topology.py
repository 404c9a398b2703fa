"""Check that a mesh's triangles bound a solid: the surface is closed, faces outward, and does not cross itself."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import trimesh

from sealtwin.core.arrays import Floats, Integers, lengths, normals

CONTACT_MM = 1e-5  # Smaller overlaps come from rounding: float32 moves a vertex at 100 mm by as much
MIN_EDGE_MM = 1e-3  # Shorter edges are lost when a file rounds the vertices
GROUP = 128  # Groups of at most this many faces are not halved. Faces are compared in such groups to save memory
WORTH = 0.75  # A group is halved if both halves together have less than this fraction of the group's pairs


def directed_edges(faces: Integers) -> Integers:
    """Return the three edges of each of f faces as indices of start and end vertex, (3f, 2)."""
    return faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def open_edges(faces: Integers) -> Integers:
    """Return the directed edges that belong to only one face, (n, 2)."""
    edges = directed_edges(faces)
    return edges[trimesh.grouping.group_rows(np.sort(edges, axis=1), require_count=1)]


def mesh_volume_mm3(vertices_mm: Floats, faces: Integers) -> float:
    """Return the signed volume of a closed mesh in mm³. It is positive if the faces point outward."""
    # Coordinates are taken relative to a vertex. Far from the origin, the sum would lose digits.
    corners = vertices_mm[faces] - vertices_mm[faces[0, 0]]
    return float(np.linalg.det(corners).sum()) / 6


def intersecting_faces(vertices_mm: Floats, faces: Integers) -> Integers:
    """Return the pairs of faces that cross along a segment, (n, 2). Coplanar overlaps are not found."""
    corners = vertices_mm[faces]
    normal = normals(corners)
    area = lengths(normal)
    # A needle has no plane: its normal is NaN, and all comparisons are false.
    normal /= np.where(area < CONTACT_MM**2, np.nan, area)[:, None]
    crossing = [
        pairs[_piercing(corners, normal, *pairs.T)]
        for close in _close_pairs(corners.min(axis=1), corners.max(axis=1), np.arange(len(faces)))
        for pairs in (close, close[:, ::-1])
    ]
    return np.unique(np.sort(np.concatenate(crossing), axis=1), axis=0)


def _close_pairs(low: Floats, high: Floats, some: Integers) -> Iterator[Integers]:
    """Yield pairs of faces whose bounding boxes overlap, (n, 2). A pair may occur twice.

    The faces are divided by planes as long as few faces are on both sides of a plane. Boxes that only touch are left
    out, because their faces cannot cross.
    """
    middle = (low[some] + high[some]).mean(axis=0) / 2
    below, above = low[some] <= middle, high[some] > middle
    work = below.sum(axis=0) ** 2 + above.sum(axis=0) ** 2
    if len(some) > GROUP and work.min() < WORTH * len(some) ** 2:
        for side in (below, above):
            yield from _close_pairs(low, high, some[side[:, work.argmin()]])
        return
    for rows in np.array_split(some, len(some) // GROUP + 1):
        near = rows[:, None] < some
        for lower, upper in zip(low.T, high.T, strict=True):
            near &= (lower[rows, None] < upper[some]) & (lower[some] < upper[rows, None])
        row, column = near.nonzero()
        yield np.column_stack([rows[row], some[column]])


def _piercing(corners: Floats, normal: Floats, face: Integers, other_face: Integers) -> Integers:
    """Return the indices of pairs in which an edge of ``face`` pierces ``other_face`` deeper than ``CONTACT_MM``."""
    height = np.einsum("nij,nj->ni", corners[face] - corners[other_face, :1], normal[other_face])
    end_height = np.roll(height, -1, axis=1)
    # An edge that shares a vertex with the triangle has a height of 0 there.
    through = (np.minimum(height, end_height) < -CONTACT_MM) & (np.maximum(height, end_height) > CONTACT_MM)
    pair, edge = through.nonzero()
    share = height[pair, edge] / (height - end_height)[pair, edge]
    start, end, triangle = corners[face[pair], edge], corners[face[pair], (edge + 1) % 3], corners[other_face[pair]]
    point = start + share[:, None] * (end - start)
    side = np.roll(triangle, -1, axis=1) - triangle
    inward = np.cross(normal[other_face[pair], None], side)
    inside = ((point[:, None] - triangle) * inward).sum(axis=2) > CONTACT_MM * np.linalg.norm(side, axis=2)
    return pair[inside.all(axis=1)]


@dataclass(frozen=True)
class MeshFigures:
    """Figures of a closed mesh, as stored in solid.json."""

    triangles: int
    euler: int  # Number of vertices, minus edges, plus faces
    min_edge_mm: float
    self_intersections: int


def examine_mesh(
    vertices_mm: Floats, faces: Integers, expected_euler: int | None = None
) -> tuple[list[str], MeshFigures | None]:
    """Return the faults of a mesh, and its figures. The figures are None if the mesh is not closed.

    ``expected_euler`` is the Euler number that the mesh must have: 2 for a ball, 0 for a ring.
    """
    if fault := edge_fault(vertices_mm, faces):
        return [fault], None
    edges, crossing = directed_edges(faces), intersecting_faces(vertices_mm, faces)
    used = np.unique(faces)
    figures = MeshFigures(
        triangles=len(faces),
        # A closed mesh has three edges for two faces.
        euler=len(used) - len(faces) // 2,
        min_edge_mm=float(lengths(np.subtract(*vertices_mm[edges.T])).min()),
        self_intersections=len(crossing),
    )
    faults = []
    if figures.min_edge_mm < MIN_EDGE_MM:
        faults.append(
            f"Mesh has an edge of {figures.min_edge_mm:.2g} mm. Rounding in a file removes edges shorter than "
            f"{MIN_EDGE_MM} mm."
        )
    if together := len(used) - len(np.unique(vertices_mm[used].astype(np.float32), axis=0)):
        faults.append(f"Mesh has {together} vertices that coincide after rounding to float32.")
    if expected_euler is not None and figures.euler != expected_euler:
        faults.append(
            f"Mesh has Euler number {figures.euler} instead of {expected_euler}: it has a hole through it, or "
            "loose pieces."
        )
    if len(crossing):
        first = near(vertices_mm[faces[crossing[0, 0]]].mean(axis=0))
        faults.append(f"Mesh crosses itself in {len(crossing)} pairs of faces, the first {first}.")
    return faults, figures


def edge_fault(vertices_mm: Floats, faces: Integers) -> str:
    """Return a text that says how and where a mesh is not closed.

    Returns an empty text if each edge belongs to one face in each direction.
    """
    edges = directed_edges(faces)
    _, group = trimesh.grouping.unique_rows(np.sort(edges, axis=1))
    faces_at, upward = np.bincount(group), np.bincount(group, edges[:, 0] < edges[:, 1])
    for wrong, fault in (
        (faces_at == 1, "Mesh is not watertight. Number of open edges"),
        (faces_at > 2, "Mesh is more than one surface. Number of edges with three or more faces"),
        (upward != 1, "Mesh has no inside. Number of edges whose two faces point to opposite sides"),
    ):
        if count := int(wrong.sum()):
            position = near(vertices_mm[edges[wrong[group]][0]].mean(axis=0))
            return f"{fault}: {count}, the first {position}."
    return ""


def near(place_mm: Floats) -> str:
    """Return a point as text, for example "near (1.00, 2.00, 3.00) mm"."""
    return "near ({:.2f}, {:.2f}, {:.2f}) mm".format(*place_mm)
