"""Find edges, neighbours and crossings of a mesh's triangles, and check that they bound a solid."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from sealtwin.core.records import Floats, Integers

CONTACT_MM = 1e-5  # Overlap that is rounding, not crossing: a float32 file moves a vertex at 100 mm by as much
LEAF_FACES = 4  # Faces in a leaf of the tree of boxes
MIN_EDGE_MM = 1e-3  # Shorter edges are lost when a file rounds its vertices
SHEET_MM = 1e-6  # A closed mesh with less volume than its area times this encloses nothing
AT_ONCE = 50_000  # Pairs of boxes expanded at a time; each may become sixteen pairs of faces


@dataclass(frozen=True)
class EqualRows:
    """Groups of equal rows, sorted by the first column, then by the second, and so on."""

    order: Integers  # Row numbers (n,), group by group, ascending within a group
    begins: Integers  # Position in ``order`` at which each group begins

    @property
    def first(self) -> Integers:
        """Index of the first row of each group."""
        return self.order[self.begins]

    @property
    def count(self) -> Integers:
        """Number of rows in each group."""
        return np.diff(np.append(self.begins, len(self.order)))

    @property
    def group(self) -> Integers:
        """Number of the group of each row, (n,)."""
        group = np.empty_like(self.order)
        group[self.order] = np.repeat(np.arange(len(self.begins)), self.count)
        return group


def equal_rows(rows: NDArray[np.floating] | NDArray[np.integer]) -> EqualRows:
    """Group the equal rows of an array (n, k), k at least 1, ten times as fast as np.unique does."""
    order = np.lexsort(rows.T[::-1])
    ordered, new = rows[order], np.ones(len(order), dtype=bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    return EqualRows(order, np.flatnonzero(new))


def directed_edges(faces: Integers) -> Integers:
    """Return the three edges of each face in turn, from start to end, (3f, 2)."""
    return faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def edge_uses(faces: Integers) -> tuple[Integers, EqualRows]:
    """Return the directed edges, and groups of those that join the same two vertices in either direction."""
    directed = directed_edges(faces)
    low, high = np.minimum(*directed.T), np.maximum(*directed.T)
    # Sorting is three times as fast with both ends in one number.
    return directed, equal_rows((low * (high.max(initial=0) + 1) + high)[:, None])


def open_edges(faces: Integers) -> Integers:
    """Return the directed edges that belong to one face only, (n, 2)."""
    directed, uses = edge_uses(faces)
    return directed[uses.first[uses.count == 1]]


def neighbours(faces: Integers) -> tuple[Integers, Integers, NDArray[np.bool_]]:
    """Return pairs of faces that share an edge with no third face, and True if both are oriented alike, (n,) each."""
    directed, uses = edge_uses(faces)
    pairs = uses.begins[uses.count == 2]
    one, other = uses.order[pairs], uses.order[pairs + 1]
    return one // 3, other // 3, directed[one, 0] != directed[other, 0]


def connected(count: int, one: Integers, other: Integers) -> tuple[int, Integers]:
    """Return the number of groups that ``count`` linked items form, and the group of each item, (count,)."""
    links = coo_array((np.ones(len(one), dtype=np.int8), (one, other)), shape=(count, count))
    groups, group = connected_components(links, directed=False)
    return int(groups), np.asarray(group, dtype=np.int64)


def normals(corners: Floats) -> Floats:
    """Return the normal of each triangle (f, 3, 3), as long as twice its area, (f, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def intersecting_faces(vertices_mm: Floats, faces: Integers) -> Integers:
    """Return pairs of faces that cross along a segment, (n, 2). Coplanar overlap is not searched for."""
    triangles = vertices_mm[faces]
    planes = _planes(triangles)
    crossing = [
        # Most neighbours are on one side of each other. That test costs far less than the piercing of edges.
        _crossing(vertices_mm, faces, planes, _across(triangles, planes, _across(triangles, planes, pairs)[:, ::-1]))
        for pairs in _close_pairs(triangles)
    ]
    return np.concatenate([np.empty((0, 2), dtype=np.int64), *crossing])


def _crossing(vertices_mm: Floats, faces: Integers, planes: Floats, pairs: Integers) -> Integers:
    crossing = np.zeros(len(pairs), dtype=bool)
    for one, other in ((0, 1), (1, 0)):
        piercing = faces[pairs[:, one]]
        pierced = faces[pairs[:, other]]
        for corner in range(3):
            edge = np.stack([piercing[:, corner], piercing[:, (corner + 1) % 3]], axis=1)
            # An edge that shares a vertex with the triangle only touches it there.
            apart = ~(edge[:, :, None] == pierced[:, None, :]).any(axis=(1, 2))
            apart &= ~crossing
            normal = planes[pairs[apart, other], :3]
            crossing[apart] |= _pierces(vertices_mm[edge[apart]], vertices_mm[pierced[apart]], normal)
    return pairs[crossing]


def _planes(triangles: Floats) -> Floats:
    """Return the unit normal and the offset of each triangle's plane, (f, 4); NaN for a needle."""
    normal = normals(triangles)
    area = np.linalg.norm(normal, axis=1)
    normal /= np.where(area < CONTACT_MM**2, np.nan, area)[:, None]
    return np.column_stack([normal, (triangles[:, 0] * normal).sum(axis=1)])


def _across(triangles: Floats, planes: Floats, pairs: Integers) -> Integers:
    """Return the pairs whose first triangle crosses the plane of the second by more than a contact."""
    plane = planes[pairs[:, 1]]
    height = np.einsum("nij,nj->ni", triangles[pairs[:, 0]], plane[:, :3]) - plane[:, 3:]
    to_one_side = (height.max(axis=1) <= CONTACT_MM) | (height.min(axis=1) >= -CONTACT_MM)
    return pairs[~to_one_side]


def _pierces(edge: Floats, triangle: Floats, normal: Floats) -> NDArray[np.bool_]:
    """Return True for each edge (n, 2, 3) that pierces its triangle (n, 3, 3) by more than a contact."""
    a, b, c = triangle.transpose(1, 0, 2)
    above = np.einsum("ij,ij->i", edge[:, 0] - a, normal)
    below = np.einsum("ij,ij->i", edge[:, 1] - a, normal)
    # For a needle, with a normal of NaN, all comparisons are false.
    through = (above * below < 0) & (np.minimum(np.abs(above), np.abs(below)) > CONTACT_MM)
    share = above / np.where(through, above - below, 1.0)
    point = edge[:, 0] + share[:, None] * (edge[:, 1] - edge[:, 0])
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        length = np.linalg.norm(side, axis=1)
        inside = np.einsum("ij,ij->i", np.cross(side, point - start), normal) / np.where(length > 0, length, 1.0)
        through &= inside > CONTACT_MM
    return through


def _close_pairs(triangles: Floats) -> Iterator[Integers]:
    """Yield pairs of faces whose boxes overlap, (n, 2), the smaller index first. Each part needs little memory."""
    # Neighbours in the order of a tree's leaves are neighbours in space.
    order = KDTree(triangles.mean(axis=1), leafsize=LEAF_FACES).indices
    levels = int(np.ceil(np.log2(max(1.0, len(order) / LEAF_FACES))))
    slots = np.full(LEAF_FACES * 2**levels, -1, dtype=np.int64)
    slots[: len(order)] = order
    # Axis by axis, since most boxes that do not overlap are apart along the first.
    low, high = np.full((3, len(slots)), np.inf), np.full((3, len(slots)), -np.inf)
    low[:, : len(order)], high[:, : len(order)] = triangles[order].min(axis=1).T, triangles[order].max(axis=1).T
    boxes = [(low, high)]
    for children in (LEAF_FACES, *[2] * levels):
        low, high = boxes[-1]
        boxes.append((low.reshape(3, -1, children).min(axis=2), high.reshape(3, -1, children).max(axis=2)))
    waiting = [(0, np.zeros((2, 1), dtype=np.int64))]
    while waiting:
        level, pairs = waiting.pop()
        if pairs.shape[1] > AT_ONCE:
            waiting += [(level, half) for half in np.array_split(pairs, 2, axis=1)]
            continue
        children = LEAF_FACES if level == levels else 2
        steps = np.stack(np.meshgrid(np.arange(children), np.arange(children), indexing="ij")).reshape(2, 1, -1)
        first, second = (pairs[:, :, None] * children + steps).reshape(2, -1)
        ordered = first < second if level == levels else first <= second
        first, second = first[ordered], second[ordered]
        for low, high in zip(*boxes[levels - level], strict=True):
            near = (low[first] <= high[second]) & (low[second] <= high[first])
            first, second = first[near], second[near]
        if level < levels:
            waiting.append((level + 1, np.stack([first, second])))
        else:
            yield slots[np.column_stack([first, second])]


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
    if fault := _list_fault(vertices_mm, faces) or _edge_fault(vertices_mm, faces):
        return [fault], None
    crossing, used = intersecting_faces(vertices_mm, faces), np.unique(faces)
    ends_mm = vertices_mm[directed_edges(faces)]
    figures = MeshFigures(
        triangles=len(faces),
        # A closed mesh has three edges for two faces.
        euler=len(used) - len(faces) // 2,
        min_edge_mm=float(np.linalg.norm(ends_mm[:, 0] - ends_mm[:, 1], axis=1).min()),
        self_intersections=len(crossing),
    )
    volume_mm3 = mesh_volume_mm3(vertices_mm, faces)
    area_mm2 = float(np.linalg.norm(normals(vertices_mm[faces]), axis=1).sum()) / 2
    faults = []
    if abs(volume_mm3) < SHEET_MM * area_mm2:
        faults.append("Mesh encloses no volume; it is a sheet. Give a base depth to make it solid.")
    elif volume_mm3 < 0:
        faults.append(f"Mesh is inside out (volume {volume_mm3:.4g} mm³): faces point inward. Flip the normals.")
    if figures.min_edge_mm < MIN_EDGE_MM:
        faults.append(
            f"Mesh has an edge of {figures.min_edge_mm:.2g} mm; rounding in a file removes edges shorter than "
            f"{MIN_EDGE_MM} mm."
        )
    if together := len(used) - len(equal_rows(vertices_mm[used].astype(np.float32)).begins):
        faults.append(f"Mesh has {together} vertices that coincide in a float32 file.")
    if expected_euler is not None and figures.euler != expected_euler:
        faults.append(
            f"Mesh has Euler number {figures.euler}, not {expected_euler}: it has a hole through it, or loose pieces."
        )
    if len(crossing):
        first = near(vertices_mm[faces[crossing[0, 0]]].mean(axis=0))
        faults.append(
            f"Mesh crosses itself in {len(crossing)} pairs of faces, first {first}. Unite overlapping bodies first."
        )
    return faults, figures


def mesh_volume_mm3(vertices_mm: Floats, faces: Integers) -> float:
    """Return the signed volume of a closed mesh, positive if its faces point outward."""
    # Coordinates are relative to a vertex; far from the origin the sum would lose digits.
    corners = vertices_mm[faces] - vertices_mm[faces[0, 0]]
    return float(np.linalg.det(corners).sum()) / 6


def _list_fault(vertices_mm: Floats, faces: Integers) -> str:
    if not len(faces):
        return "Mesh has no faces."
    if not np.isfinite(vertices_mm).all():
        return f"Mesh has {int((~np.isfinite(vertices_mm)).any(axis=1).sum())} vertices that are not finite numbers."
    if faces.min() < 0 or faces.max() >= len(vertices_mm):
        return f"Mesh refers to vertices {int(faces.min())} to {int(faces.max())}, but has only {len(vertices_mm)}."
    return ""


def _edge_fault(vertices_mm: Floats, faces: Integers) -> str:
    directed, uses = edge_uses(faces)
    for wrong, fault, what in (
        (uses.count == 1, "is not watertight", "open {}"),
        (uses.count > 2, "is more than one surface", "{} at which three or more faces meet"),
    ):
        if count := int(wrong.sum()):
            place = near(vertices_mm[directed[uses.first[wrong][0]].min()])
            where = f"{what.format('edge' if count == 1 else 'edges')}, {'' if count == 1 else 'the first '}{place}"
            return f"Mesh {fault}: {count} {where}."
    # The two uses of an edge have opposite directions.
    one, other = uses.order.reshape(-1, 2).T
    if twice := int((directed[one, 0] == directed[other, 0]).sum()):
        return f"Mesh has {twice} {'edge' if twice == 1 else 'edges'} with two faces that point to opposite sides."
    return ""


def near(place_mm: Floats) -> str:
    """Return a place as text for a fault: "near (1.00, 2.00, 3.00) mm"."""
    return "near ({:.2f}, {:.2f}, {:.2f}) mm".format(*place_mm)
