"""Check that a mesh's triangles bound a solid: closed, facing outward, and crossing nowhere."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from sealtwin.core.records import Floats, Integers

CONTACT_MM = 1e-5  # Overlap that is rounding, not crossing: a float32 file moves a vertex at 100 mm by as much
MIN_EDGE_MM = 1e-3  # Shorter edges are lost when a file rounds its vertices
AT_ONCE = 100_000  # Pairs of boxes that are compared at a time, for little memory
STRIP = 4.0  # Width of a strip in mean widths of a face's box


def directed_edges(faces: Integers) -> Integers:
    """Return the three edges of each face, from start to end, (3f, 2)."""
    return faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def open_edges(faces: Integers) -> Integers:
    """Return the directed edges that belong to one face only, (n, 2)."""
    edges = directed_edges(faces)
    return edges[trimesh.grouping.group_rows(np.sort(edges, axis=1), require_count=1)]


def normals(corners: Floats) -> Floats:
    """Return the normal of each triangle (f, 3, 3), as long as twice its area, (f, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def mesh_volume_mm3(vertices_mm: Floats, faces: Integers) -> float:
    """Return the signed volume of a closed mesh, positive if its faces point outward."""
    # Coordinates are relative to a vertex; far from the origin the sum would lose digits.
    corners = vertices_mm[faces] - vertices_mm[faces[0, 0]]
    return float(np.linalg.det(corners).sum()) / 6


def intersecting_faces(vertices_mm: Floats, faces: Integers) -> Integers:
    """Return pairs of faces that cross along a segment, (n, 2). Coplanar overlap is not searched for."""
    corners = vertices_mm[faces]
    normal = normals(corners)
    area = np.linalg.norm(normal, axis=1)
    # A needle has no plane: its normal is NaN, and all comparisons are false.
    normal /= np.where(area < CONTACT_MM**2, np.nan, area)[:, None]
    crossing = [
        np.sort(pairs[_pierces(corners, normal, *pairs.T) | _pierces(corners, normal, *pairs.T[::-1])], axis=1)
        for pairs in _close_pairs(corners)
    ]
    return np.concatenate(crossing)


def _close_pairs(corners: Floats) -> Iterator[Integers]:
    """Yield pairs of faces whose boxes overlap, (n, 2), by a sweep along the longest side in each of many strips.

    Boxes that only touch are not yielded: their faces are on two sides of a plane, or both in it.
    """
    low, high = corners.min(axis=1).T, corners.max(axis=1).T
    least, across, along = np.ptp(low, axis=1).argsort()
    order = low[along].argsort()
    low, high = low[:, order], high[:, order]
    reach = np.searchsorted(low[along], high[along])
    width_mm = STRIP * (high - low)[across].mean() + CONTACT_MM
    first, last = (((edge - low.min(axis=1, keepdims=True))[across] // width_mm).astype(int) for edge in (low, high))
    face, number = _repeated(last - first + 1)
    # Faces in the order of strips, and within a strip in that of the sweep.
    key = np.sort((first[face] + number) * len(order) + face)
    strip, face = np.divmod(key, len(order))
    count = np.maximum(np.searchsorted(key, strip * len(order) + reach[face]) - np.arange(len(key)) - 1, 0)
    total = count.cumsum()
    for part in np.split(np.arange(len(key)), np.searchsorted(total, np.arange(AT_ONCE, total[-1], AT_ONCE))):
        entry, number = _repeated(count[part])
        one, other = face[part[entry]], face[part[entry] + 1 + number]
        near = strip[part[entry]] == np.maximum(first[one], first[other])
        for axis in (across, least):
            one, other = one[near], other[near]
            near = (low[axis, one] < high[axis, other]) & (low[axis, other] < high[axis, one])
        yield order[np.column_stack([one[near], other[near]])]


def _repeated(counts: Integers) -> tuple[Integers, Integers]:
    """Return each index as many times as its count, and a number from 0 for each time."""
    index = np.repeat(np.arange(len(counts)), counts)
    return index, np.arange(len(index)) - (counts.cumsum() - counts)[index]


def _pierces(corners: Floats, normal: Floats, one: Integers, other: Integers) -> NDArray[np.bool_]:
    """Return True for each pair in which an edge of ``one`` pierces ``other`` by more than a contact, (n,)."""
    height = np.einsum("nij,nj->ni", corners[one] - corners[other, :1], normal[other])
    end_height = height[:, [1, 2, 0]]
    # An edge that shares a vertex with the triangle has a height of 0 there.
    through = (np.minimum(height, end_height) < -CONTACT_MM) & (np.maximum(height, end_height) > CONTACT_MM)
    pair, edge = through.nonzero()
    share = height[pair, edge] / (height - end_height)[pair, edge]
    start, end, triangle = corners[one[pair], edge], corners[one[pair], (edge + 1) % 3], corners[other[pair]]
    point = start + share[:, None] * (end - start)
    side = np.roll(triangle, -1, axis=1) - triangle
    inward = np.cross(normal[other[pair], None], side)
    inside = ((point[:, None] - triangle) * inward).sum(axis=2) > CONTACT_MM * np.linalg.norm(side, axis=2)
    return np.isin(np.arange(len(one)), pair[inside.all(axis=1)])


@dataclass(frozen=True)
class MeshFigures:
    """Figures of a closed mesh, as in solid.json."""

    triangles: int
    euler: int  # Vertices less edges plus faces
    min_edge_mm: float
    self_intersections: int


def check_mesh(vertices_mm: Floats, faces: Integers, expected_euler: int | None = None) -> list[str]:
    """Return the faults of a mesh, an empty list for a solid. ``expected_euler`` is 2 for a ball, 0 for a ring."""
    return examine_mesh(vertices_mm, faces, expected_euler)[0]


def examine_mesh(
    vertices_mm: Floats, faces: Integers, expected_euler: int | None = None
) -> tuple[list[str], MeshFigures | None]:
    """Return the faults of a mesh, and its figures. The figures are None if the mesh is not closed."""
    if fault := edge_fault(vertices_mm, faces):
        return [fault], None
    edges, crossing = directed_edges(faces), intersecting_faces(vertices_mm, faces)
    used = np.unique(faces)
    figures = MeshFigures(
        triangles=len(faces),
        # A closed mesh has three edges for two faces.
        euler=len(used) - len(faces) // 2,
        min_edge_mm=float(np.linalg.norm(np.subtract(*vertices_mm[edges.T]), axis=1).min()),
        self_intersections=len(crossing),
    )
    faults = []
    if figures.min_edge_mm < MIN_EDGE_MM:
        faults.append(
            f"Mesh has an edge of {figures.min_edge_mm:.2g} mm; rounding in a file removes edges shorter than "
            f"{MIN_EDGE_MM} mm."
        )
    if together := len(used) - len(np.unique(vertices_mm[used].astype(np.float32), axis=0)):
        faults.append(f"Mesh has {together} vertices that coincide in a float32 file.")
    if expected_euler is not None and figures.euler != expected_euler:
        faults.append(
            f"Mesh has Euler number {figures.euler}, not {expected_euler}: it has a hole through it, or loose pieces."
        )
    if len(crossing):
        first = near(vertices_mm[faces[crossing[0, 0]]].mean(axis=0))
        faults.append(f"Mesh crosses itself in {len(crossing)} pairs of faces, first {first}.")
    return faults, figures


def edge_fault(vertices_mm: Floats, faces: Integers) -> str:
    """Return how a mesh is not closed, and where; an empty text if each edge belongs to one face in each direction."""
    edges = directed_edges(faces)
    _, group = trimesh.grouping.unique_rows(np.sort(edges, axis=1))
    faces_at, upward = np.bincount(group), np.bincount(group, edges[:, 0] < edges[:, 1])
    for wrong, fault in (
        (faces_at == 1, "Mesh is not watertight; open edges"),
        (faces_at > 2, "Mesh is more than one surface; edges with three or more faces"),
        (upward != 1, "Mesh has no inside; edges with two faces that point to opposite sides"),
    ):
        if count := int(wrong.sum()):
            place = near(vertices_mm[edges[wrong[group]][0]].mean(axis=0))
            return f"{fault}: {count}, the first {place}."
    return ""


def near(place_mm: Floats) -> str:
    """Return a place as text for a fault: "near (1.00, 2.00, 3.00) mm"."""
    return "near ({:.2f}, {:.2f}, {:.2f}) mm".format(*place_mm)
