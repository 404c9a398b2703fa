"""What must hold for a mesh to be a solid, each fault as one sentence."""

import numpy as np

from digitise.intersections import intersecting_faces
from sealtwin.records import Floats, Integers

MIN_EDGE_MM = 1e-3
"""Shorter edges are lost when a file rounds its vertices."""
SHEET_MM = 1e-6
"""A closed mesh with less volume than its area times this encloses nothing."""


def check_mesh(vertices_mm: Floats, faces: Integers, expected_euler: int | None = None) -> list[str]:
    """Faults of a mesh as sentences; none where it is one watertight solid with its faces outward.

    ``expected_euler`` is checked where it is given: 2 for each ball, 0 for each ring. Later checks rest on earlier
    ones, so a mesh that is not closed is not examined further.
    """
    if not len(faces):
        return ["Mesh has no faces."]
    if not np.isfinite(vertices_mm).all():
        return [f"Mesh has {int((~np.isfinite(vertices_mm)).any(axis=1).sum())} vertices that are no finite numbers."]
    if faces.min() < 0 or faces.max() >= len(vertices_mm):
        return [f"Mesh names vertex {int(faces.max())} of only {len(vertices_mm)}."]
    faults = _edge_faults(vertices_mm, faces)
    if faults:
        return faults
    volume_mm3 = mesh_volume_mm3(vertices_mm, faces)
    area_mm2 = float(np.linalg.norm(_cross(vertices_mm[faces]), axis=1).sum()) / 2
    if abs(volume_mm3) < SHEET_MM * area_mm2:
        return ["Mesh encloses no volume; it is a sheet. Give a base depth to make it solid."]
    if volume_mm3 < 0:
        faults.append(f"Mesh is inside out (volume {volume_mm3:.4g} mm³): faces point inward. Flip the normals.")
    if expected_euler is not None and (euler := euler_number(faces)) != expected_euler:
        faults.append(f"Mesh has Euler number {euler}, not {expected_euler}: a hole through it, or loose pieces.")
    return [*faults, *_size_faults(vertices_mm, faces), *_crossing_faults(vertices_mm, faces)]


def mesh_volume_mm3(vertices_mm: Floats, faces: Integers) -> float:
    """Signed volume of a closed mesh: positive where faces look outward."""
    # From a point among the vertices: far from the origin the sum would lose digits.
    corners = vertices_mm[faces] - vertices_mm[faces[0, 0]]
    return float(np.linalg.det(corners).sum()) / 6


def euler_number(faces: Integers) -> int:
    """Vertices less edges plus faces."""
    edges = np.unique(np.sort(_edges(faces), axis=1), axis=0)
    return len(np.unique(faces)) - len(edges) + len(faces)


def min_edge_mm(vertices_mm: Floats, faces: Integers) -> float:
    ends = vertices_mm[_edges(faces)]
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).min())


def _edges(faces: Integers) -> Integers:
    return faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def _cross(corners: Floats) -> Floats:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _edge_faults(vertices_mm: Floats, faces: Integers) -> list[str]:
    directed = _edges(faces)
    edges, uses = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    if (uses == 1).any():
        at = vertices_mm[edges[uses == 1][0, 0]]
        return [
            f"Mesh is not watertight: {int((uses == 1).sum())} open edges, "
            f"first near ({at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f}) mm. Import with repair=True."
        ]
    if (uses > 2).any():
        at = vertices_mm[edges[uses > 2][0, 0]]
        return [
            f"Mesh has {int((uses > 2).sum())} edges where more than two faces meet, "
            f"first near ({at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f}) mm."
        ]
    twice = len(directed) - len(np.unique(directed, axis=0))
    if twice:
        return [f"Mesh has {twice} edges whose two faces look to opposite sides. Import with repair=True."]
    return []


def _size_faults(vertices_mm: Floats, faces: Integers) -> list[str]:
    faults = []
    shortest_mm = min_edge_mm(vertices_mm, faces)
    if shortest_mm < MIN_EDGE_MM:
        faults.append(f"Mesh has an edge of {shortest_mm:.2g} mm; below {MIN_EDGE_MM} mm a file's rounding loses it.")
    used = np.unique(faces)
    rounded = np.unique(vertices_mm[used].astype(np.float32), axis=0)
    if len(rounded) < len(used):
        faults.append(f"Mesh has {len(used) - len(rounded)} vertices that fall together in a float32 file.")
    return faults


def _crossing_faults(vertices_mm: Floats, faces: Integers) -> list[str]:
    pairs = intersecting_faces(vertices_mm, faces)
    if not len(pairs):
        return []
    at = vertices_mm[faces[pairs[0, 0]]].mean(axis=0)
    return [
        f"Mesh crosses itself in {len(pairs)} pairs of faces, "
        f"first near ({at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f}) mm. Unite overlapping bodies first."
    ]
