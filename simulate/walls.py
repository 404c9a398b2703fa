"""Wall particles: one layer, a radius deep in the solid, that complete the density and drag the fluid."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from sealtwin.records import FaceLabel, Floats, Outline, Solid
from simulate.distance import CLEARANCE, CM, MARGIN_MM, Barrier
from simulate.neighbours import NOWHERE_CM
from simulate.surface import spread_points

CANDIDATES = 20
"""Per particle kept: more do not make the layer more even."""
NEAREST = 0.78
"""Least distance of two wall particles over 2R: with it a greedy choice leaves no hole wider than one particle."""


@dataclass(frozen=True)
class Walls:
    """Wall particles on the device."""

    place: Any
    """Position in cm, and share: the surface that a particle stands for over (2R)^2, 1 on average whatever the
    triangles.
    """


def place_walls(solid: Solid, outline: Outline, barrier: Barrier, radius_mm: float) -> Walls:
    """Even cover of all that sealant can touch. No seed: the layer is part of the geometry, not of a run."""
    spacing_mm = 2 * radius_mm
    touched = solid.face_label != FaceLabel.OUTSIDE
    label, triangles_mm = solid.face_label[touched], solid.vertices_mm[solid.faces[touched]]
    points = spread_points(triangles_mm, spacing_mm / np.sqrt(CANDIDATES))
    # All of the cavity, however far its walls lean, and of the face what sealant may run over.
    near = (label[points.face] != FaceLabel.TOP) | _near_crack(points.place_mm, outline)
    deep = points.place_mm[near] - radius_mm * _normals(triangles_mm)[points.face[near]]
    # Across a thin nose the far wall is nearer than the near one: such a point would stand out of the solid there.
    held = barrier.exact_mm(deep) <= -0.9 * radius_mm if len(deep) else np.zeros(0, dtype=bool)
    kept = _spread(deep[held], points.lot[near][held], NEAREST * spacing_mm)
    _, nearest = KDTree(kept).query(deep)
    share = np.bincount(nearest, minlength=len(kept)) / CANDIDATES
    nobody = np.full((1, 4), NOWHERE_CM)
    place = np.concatenate([np.column_stack([kept * CM, share]), nobody])
    return Walls(wp.array(place, dtype=wp.vec4, device=barrier.device)[: len(kept)])


def calibrated_wall_mass(radius: float) -> float:
    """Psi over the rest density, in the cube of the radius' unit.

    A flat layer of spacing 2R, R deep, then adds as much as the half of the kernel that a wall cuts off, for a
    particle at the clearance: about 0.22 / W(0) where the source takes 1 / W(0), which keeps the fluid 1.45 R off.
    """
    support = 4 * radius
    distance = CLEARANCE * radius
    z = np.linspace(distance, support, 2001)
    # Integral of poly6 over the plane at distance z.
    cut_off = np.trapezoid(315 / (256 * support**9) * (support**2 - z**2) ** 4, z)
    ticks = 2 * radius * np.arange(-3, 4)
    shift = radius * np.linspace(-1, 1, 8, endpoint=False)
    x = (ticks[:, None] + shift)[:, None, :, None]
    y = (ticks[:, None] + shift)[None, :, None, :]
    squared = x**2 + y**2 + (distance + radius) ** 2
    weight = 315 / (64 * np.pi * support**9) * np.clip(support**2 - squared, 0, None) ** 3
    return float(cut_off / weight.sum(axis=(0, 1)).mean())


def source_wall_mass(radius: float) -> float:
    """Psi over the rest density in the solver that the paper built on: 1 / W(0)."""
    return 64 * np.pi * (4 * radius) ** 3 / 315


def _normals(triangles_mm: Floats) -> Floats:
    """Outward, (f, 3); of length 0 where a triangle is a needle."""
    across = np.cross(triangles_mm[:, 1] - triangles_mm[:, 0], triangles_mm[:, 2] - triangles_mm[:, 0])
    length = np.linalg.norm(across, axis=1)
    return across / np.where(length > 0, length, 1.0)[:, None]


def _near_crack(points_mm: Floats, outline: Outline) -> np.ndarray:
    """Within the margin of the crack, seen from above, (n,) bool."""
    rows = np.concatenate([outline.left_wall_mm, outline.centreline_mm, outline.right_wall_mm])
    away, _ = KDTree(rows).query(points_mm[:, :2])
    return away <= MARGIN_MM


def _spread(points: Floats, lot: NDArray[np.uint64], apart: float) -> Floats:
    """The greedy choice, by lot, of points no two of which are nearer than ``apart``."""
    # Planes that meet may each have a node of the same lot; those differ in place.
    points = points[np.lexsort((*points.T, lot))]
    count = len(points)
    pairs = KDTree(points).query_pairs(apart, output_type="ndarray")
    earlier = csr_array((np.ones(len(pairs), dtype=np.int32), (pairs[:, 1], pairs[:, 0])), shape=(count, count))
    undecided = np.ones(count, dtype=np.int32)
    kept = np.zeros(count, dtype=np.int32)
    while undecided.any():
        kept[(undecided > 0) & (earlier @ undecided == 0)] = 1
        undecided[(kept > 0) | (earlier @ kept > 0)] = 0
    return points[kept > 0]
