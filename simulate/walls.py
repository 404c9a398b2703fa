"""Wall particles: one layer, a radius deep in the solid, that complete the density and drag the fluid."""

from dataclasses import dataclass

import numpy as np
import warp as wp
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from sealtwin.records import FaceLabel, Floats, Integers, Outline, Solid
from simulate.distance import CLEARANCE, CM, MARGIN_MM, Barrier

CANDIDATES = 20
"""Per particle kept: more do not make the layer more even."""
NEAREST = 0.78
"""Least distance of two wall particles over 2R: with it a greedy choice leaves no hole wider than one particle."""


@dataclass(frozen=True)
class Walls:
    """Wall particles on the device."""

    point: wp.array
    """cm."""
    share: wp.array
    """Surface that a particle stands for over (2R)^2: 1 on average, whatever the triangles."""


def place_walls(solid: Solid, outline: Outline, barrier: Barrier, radius_mm: float) -> Walls:
    """Even cover of all that sealant can touch. No seed: the layer is part of the geometry, not of a run."""
    spacing_mm = 2 * radius_mm
    surface, normal, label, area_mm2 = _sample_surface(solid, CANDIDATES / spacing_mm**2)
    # All of the cavity, however far its walls lean, and of the face what sealant may run over.
    near = (label != FaceLabel.TOP) | _near_crack(surface, outline)
    deep = (surface - radius_mm * normal)[near]
    # Across a thin nose the far wall is nearer than the near one: such a point would stand out of the solid there.
    held = deep[barrier.exact_mm(deep) <= -0.9 * radius_mm] if near.any() else deep
    kept = held[_spread(held, NEAREST * spacing_mm)]
    _, nearest = KDTree(kept).query(deep)
    share = np.bincount(nearest, minlength=len(kept)) * area_mm2 / spacing_mm**2
    return Walls(
        wp.array(kept * CM, dtype=wp.vec3, device=barrier.device),
        wp.array(share, dtype=float, device=barrier.device),
    )


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


def _sample_surface(solid: Solid, per_mm2: float) -> tuple[Floats, Floats, Integers, float]:
    """Points on all but the outside, their outward normals and labels, and the surface each stands for (mm2)."""
    touched = solid.face_label != FaceLabel.OUTSIDE
    triangles = solid.vertices_mm[solid.faces[touched]]
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    twice_area = np.linalg.norm(across, axis=1)
    total = twice_area.sum() / 2
    count = int(np.ceil(total * per_mm2))
    # Even steps through the summed area: a triangle gets its share of points to within one, however small it is.
    order = np.arange(count)
    at = (order + 0.5) / count
    chosen = np.searchsorted(np.cumsum(twice_area), at * twice_area.sum())
    chosen = np.minimum(chosen, len(triangles) - 1)
    # The R2 sequence (Roberts 2018) fills a triangle evenly, where random points cover it with 1 / sqrt(n) of noise.
    u, v = (np.outer(order, [0.7548776662466927, 0.5698402909980532]) % 1.0).T[:, :, None]
    fold = u + v > 1
    u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
    a, b, c = triangles[chosen].transpose(1, 0, 2)
    normal = across[chosen] / twice_area[chosen, None]
    return a + u * (b - a) + v * (c - a), normal, solid.face_label[touched][chosen], total / count


def _near_crack(points_mm: Floats, outline: Outline) -> np.ndarray:
    """Within the margin of the crack, seen from above, (n,) bool."""
    rows = np.concatenate([outline.left_wall_mm, outline.centreline_mm, outline.right_wall_mm])
    away, _ = KDTree(rows).query(points_mm[:, :2])
    return away <= MARGIN_MM


def _spread(points: Floats, apart: float) -> Integers:
    """The greedy choice, first come first served, of points no two of which are nearer than ``apart``."""
    count = len(points)
    rank = np.random.default_rng(0).permutation(count)
    pairs = np.sort(rank[KDTree(points).query_pairs(apart, output_type="ndarray")], axis=1)
    earlier = csr_array((np.ones(len(pairs), dtype=np.int32), (pairs[:, 1], pairs[:, 0])), shape=(count, count))
    undecided = np.ones(count, dtype=np.int32)
    kept = np.zeros(count, dtype=np.int32)
    while undecided.any():
        kept[(undecided > 0) & (earlier @ undecided == 0)] = 1
        undecided[(kept > 0) | (earlier @ kept > 0)] = 0
    return np.flatnonzero(kept[rank])
