"""What must hold for a mesh to be a solid, each fault as one sentence."""

from dataclasses import dataclass

import numpy as np

from digitise.geometry.edges import directed_edges, edge_uses
from digitise.geometry.equal_rows import equal_rows
from digitise.geometry.intersections import intersecting_faces
from sealtwin.records import Floats, Integers

MIN_EDGE_MM = 1e-3
"""Shorter edges are lost when a file rounds its vertices."""
SHEET_MM = 1e-6
"""A closed mesh with less volume than its area times this encloses nothing."""


@dataclass(frozen=True)
class MeshFigures:
    """What a closed mesh measures."""

    volume_mm3: float
    euler: int
    min_edge_mm: float
    self_intersections: int


def check_mesh(vertices_mm: Floats, faces: Integers, expected_euler: int | None = None) -> list[str]:
    """Faults of a mesh as sentences; none where it is one watertight solid with its faces outward.

    ``expected_euler`` is checked where it is given: 2 for each ball, 0 for each ring. Later checks rest on earlier
    ones, so a mesh that is not closed is not examined further.
    """
    return examine_mesh(vertices_mm, faces, expected_euler)[0]


def examine_mesh(
    vertices_mm: Floats, faces: Integers, expected_euler: int | None = None
) -> tuple[list[str], MeshFigures | None]:
    """``check_mesh``'s faults, and the figures they were judged by; None where the mesh is not closed."""
    faults = _list_faults(vertices_mm, faces) or _edge_faults(vertices_mm, faces)
    if faults:
        return faults, None
    crossing = intersecting_faces(vertices_mm, faces)
    figures = MeshFigures(
        volume_mm3=mesh_volume_mm3(vertices_mm, faces),
        euler=euler_number(faces),
        min_edge_mm=_min_edge_mm(vertices_mm, faces),
        self_intersections=len(crossing),
    )
    faults = [
        *_volume_faults(vertices_mm, faces, figures.volume_mm3),
        *_size_faults(vertices_mm, faces, figures.min_edge_mm),
    ]
    if expected_euler is not None and figures.euler != expected_euler:
        faults.append(
            f"Mesh has Euler number {figures.euler}, not {expected_euler}: a hole through it, or loose pieces."
        )
    if len(crossing):
        at = vertices_mm[faces[crossing[0, 0]]].mean(axis=0)
        faults.append(
            f"Mesh crosses itself in {len(crossing)} pairs of faces, "
            f"first near ({at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f}) mm. Unite overlapping bodies first."
        )
    return faults, figures


def _list_faults(vertices_mm: Floats, faces: Integers) -> list[str]:
    if not len(faces):
        return ["Mesh has no faces."]
    if not np.isfinite(vertices_mm).all():
        return [f"Mesh has {int((~np.isfinite(vertices_mm)).any(axis=1).sum())} vertices that are no finite numbers."]
    if faces.min() < 0 or faces.max() >= len(vertices_mm):
        return [f"Mesh names vertices {int(faces.min())} to {int(faces.max())}, but has {len(vertices_mm)}."]
    return []


def _volume_faults(vertices_mm: Floats, faces: Integers, volume_mm3: float) -> list[str]:
    area_mm2 = float(np.linalg.norm(_cross(vertices_mm[faces]), axis=1).sum()) / 2
    if abs(volume_mm3) < SHEET_MM * area_mm2:
        return ["Mesh encloses no volume; it is a sheet. Give a base depth to make it solid."]
    if volume_mm3 < 0:
        return [f"Mesh is inside out (volume {volume_mm3:.4g} mm³): faces point inward. Flip the normals."]
    return []


def mesh_volume_mm3(vertices_mm: Floats, faces: Integers) -> float:
    """Signed volume of a closed mesh: positive where faces look outward."""
    # From a point among the vertices: far from the origin the sum would lose digits.
    corners = vertices_mm[faces] - vertices_mm[faces[0, 0]]
    return float(np.linalg.det(corners).sum()) / 6


def euler_number(faces: Integers) -> int:
    """Vertices less edges plus faces."""
    return len(np.unique(faces)) - len(edge_uses(faces)[1].begins) + len(faces)


def _min_edge_mm(vertices_mm: Floats, faces: Integers) -> float:
    ends = vertices_mm[directed_edges(faces)]
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).min())


def _cross(corners: Floats) -> Floats:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _edge_faults(vertices_mm: Floats, faces: Integers) -> list[str]:
    directed, uses = edge_uses(faces)
    if (alone := uses.count == 1).any():
        at = vertices_mm[directed[uses.first[alone][0]].min()]
        return [
            f"Mesh is not watertight: {int(alone.sum())} open edges, "
            f"first near ({at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f}) mm. Import with repair=True."
        ]
    if (many := uses.count > 2).any():
        at = vertices_mm[directed[uses.first[many][0]].min()]
        return [
            f"Mesh has {int(many.sum())} edges where more than two faces meet, "
            f"first near ({at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f}) mm."
        ]
    # Of the two uses of each edge, one runs each way.
    one, other = uses.order.reshape(-1, 2).T
    twice = int((directed[one, 0] == directed[other, 0]).sum())
    if twice:
        return [f"Mesh has {twice} edges whose two faces look to opposite sides. Import with repair=True."]
    return []


def _size_faults(vertices_mm: Floats, faces: Integers, shortest_mm: float) -> list[str]:
    faults = []
    if shortest_mm < MIN_EDGE_MM:
        faults.append(f"Mesh has an edge of {shortest_mm:.2g} mm; below {MIN_EDGE_MM} mm a file's rounding loses it.")
    used = np.unique(faces)
    together = len(used) - len(equal_rows(vertices_mm[used].astype(np.float32)).begins)
    if together:
        faults.append(f"Mesh has {together} vertices that fall together in a float32 file.")
    return faults
