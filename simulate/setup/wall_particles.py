"""Wall particles: one layer in the solid, a radius deep. They complete the density at walls and drag the fluid."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from sealtwin.core.arrays import lengths, normals
from sealtwin.core.records import FaceLabel, Floats, Integers, Outline, Solid
from simulate.kernels.neighbours import NOWHERE_CM
from simulate.setup.signed_distance import CLEARANCE, CM, MARGIN_MM, Barrier, build_barrier
from simulate.vessel import whole_numbers

TURN = np.arctan((np.sqrt(5) - 1) / 2)
"""Angle by which the lattice of points is rotated. Its tangent is the golden ratio minus 1, which is far from any ratio
of small integers, so that rows of points are not parallel to edges."""
SHIFT = np.array([np.sqrt(2) - 1, np.sqrt(3) - 1])
"""Offset of the lattice from the origin, in steps, so that a corner of the sample at the origin is not a node."""
OFF_NODE = 1e-3
"""Scatter of points around their nodes, in steps, so that no two points are at exactly the same distance."""
LEVEL = 0.99  # A plane counts as horizontal if its normal's vertical component is larger. Its first axis is then x
CANDIDATES = 20  # Number of candidate points per chosen particle. More would not make the layer more even.
PARTS, MIN_PART = 12, 2000
"""Number of parts into which the candidates are divided, and smallest number of candidates in a part."""
NEAREST = 0.78
"""Smallest distance of two wall particles, divided by 2R. With it, a greedy choice leaves no hole wider than a
particle."""


@dataclass(frozen=True)
class WallParticles:
    """Arrays of the wall particles on the device."""

    position_and_share: Any
    """Position in cm, and weight: the area of the surface that the particle represents, divided by (2R)^2. The mean
    weight is 1."""


@dataclass(frozen=True)
class Enclosure:
    """Barrier and wall particles of a crack. Runs do not change them, so a study builds them only once."""

    barrier: Barrier
    walls: WallParticles


def enclose(solid: Solid, outline: Outline, radius_mm: float, device: str) -> Enclosure:
    """Build the distances to the solid and the wall particles. Raises InputError if the grid would be too large."""
    barrier = build_barrier(solid, outline, radius_mm, device)
    return Enclosure(barrier, place_walls(solid, outline, barrier, radius_mm))


def place_walls(solid: Solid, outline: Outline, barrier: Barrier, radius_mm: float) -> WallParticles:
    """Place wall particles evenly behind all surfaces that sealant can touch.

    The result depends only on the geometry, and not on a seed.
    """
    spacing_mm = 2 * radius_mm
    touched = solid.face_label != FaceLabel.OUTSIDE
    label, triangles_mm = solid.face_label[touched], solid.vertices_mm[solid.faces[touched]]
    points = spread_points(triangles_mm, spacing_mm / np.sqrt(CANDIDATES))
    # Wall particles cover the whole cavity, and the part of the face that sealant may reach.
    near = label[points.face] != FaceLabel.TOP
    crack = KDTree(np.concatenate([outline.left_wall_mm, outline.centreline_mm, outline.right_wall_mm]))
    away, _ = crack.query(points.position_mm[~near, :2], distance_upper_bound=MARGIN_MM)
    near[~near] = np.isfinite(away)
    deep = points.position_mm[near] - radius_mm * points.normal[near]
    # In a thin nose, a point one radius deep may be close to the opposite wall or outside the solid. It is dropped.
    inside = barrier.is_inside(deep, 0.9 * radius_mm)
    chosen = _spread(deep[inside], points.lot[near][inside], NEAREST * spacing_mm)
    _, nearest = KDTree(chosen).query(deep)
    share = np.bincount(nearest, minlength=len(chosen)) / CANDIDATES
    dummy = np.full((1, 4), NOWHERE_CM)
    padded = np.concatenate([np.column_stack([chosen * CM, share]), dummy])
    return WallParticles(wp.array(padded, wp.vec4, device=barrier.mesh.device)[: len(chosen)])


def calibrated_wall_mass(radius: float) -> float:
    """Return psi of calibrated walls, divided by the rest density, in the cube of the radius' unit.

    psi is the weight of a wall particle in the density, about 0.22 / W(0). With it, a flat layer with spacing 2R at a
    depth R adds as much density to a particle at the clearance as the part of the kernel behind the wall would. The
    paper's solver uses 1 / W(0), with which the fluid stays 1.45 R away from walls.
    """
    support = 4 * radius
    distance = CLEARANCE * radius
    z = np.linspace(distance, support, 2001)
    # The integral of poly6 over the plane at the distance z, integrated over z.
    cut_off = np.trapezoid(315 / (256 * support**9) * (support**2 - z**2) ** 4, z)
    ticks = 2 * radius * np.arange(-3, 4)
    shift = radius * np.linspace(-1, 1, 8, endpoint=False)
    x = (ticks[:, None] + shift)[:, None, :, None]
    y = (ticks[:, None] + shift)[None, :, None, :]
    squared = x**2 + y**2 + (distance + radius) ** 2
    weight = 315 / (64 * np.pi * support**9) * np.clip(support**2 - squared, 0, None) ** 3
    return float(cut_off / weight.sum(axis=(0, 1)).mean())


def source_wall_mass(radius: float) -> float:
    """Return psi, the weight of a wall particle in the paper's solver, divided by the rest density: 1 / W(0)."""
    return 64 * np.pi * (4 * radius) ** 3 / 315


def _spread(points: Floats, lot: NDArray[np.uint64], apart: float) -> Floats:
    """Choose points greedily in the order of ``lot``, each at least ``apart`` from all points chosen before.

    Points are chosen part by part. After each part, remaining points that are too close to a chosen point are dropped,
    so that fewer pairs must be listed.
    """
    # Nodes of two planes may have the same lot. They are then ordered by position.
    rest = points[np.lexsort((*points.T, lot))]
    part = max(MIN_PART, len(rest) // PARTS)
    parts = [rest[:0]]
    while len(rest):
        chosen = _chosen(rest[:part], apart)
        # Scipy's bound is exclusive, but a distance of exactly ``apart`` counts as too close.
        away, _ = KDTree(chosen).query(rest[part:], distance_upper_bound=np.nextafter(apart, np.inf))
        rest = rest[part:][np.isinf(away)]
        parts.append(chosen)
    return np.concatenate(parts)


def _chosen(points: Floats, apart: float) -> Floats:
    """Choose points greedily in their order, each at least ``apart`` from all points chosen before."""
    count = len(points)
    pairs = KDTree(points).query_pairs(apart, output_type="ndarray")
    earlier = csr_array((np.ones(len(pairs), np.int32), (pairs[:, 1], pairs[:, 0])), shape=(count, count))
    undecided = np.ones(count, np.int32)
    chosen = np.zeros(count, np.int32)
    while undecided.any():
        chosen[(undecided > 0) & (earlier @ undecided == 0)] = 1
        undecided[(chosen > 0) | (earlier @ chosen > 0)] = 0
    return points[chosen > 0]


@dataclass(frozen=True)
class SurfacePoints:
    position_mm: Floats  # (n, 3)
    face: Integers  # (n,): triangle of each point
    normal: Floats  # (n, 3): outward unit normal of that triangle
    lot: NDArray[np.uint64]  # (n,): random number that depends only on the node


def spread_points(triangles_mm: Floats, spacing_mm: float) -> SurfacePoints:
    """Return points on triangles, (f, 3, 3): one for each node of a square lattice in the triangles' planes.

    ``spacing_mm`` is the spacing of the lattice. Triangles without an area get no point.
    """
    normal = normals(triangles_mm)
    length = lengths(normal)
    face = np.flatnonzero(length > 0)
    unit = normal[face] / length[face, None]
    axes = _axes(unit)
    corner = np.einsum("fck,fak->fca", triangles_mm[face], axes) / spacing_mm - SHIFT
    across = corner[:, :, 0]
    first, last = np.ceil(across.min(axis=1)), np.floor(across.max(axis=1))
    which, row = whole_numbers(first.astype(np.int64), last.astype(np.int64))
    line, column = whole_numbers(*_crossed(corner[which], row))
    node, which = np.column_stack([row[line], column]), which[line]
    height = np.einsum("fk,fk->f", triangles_mm[face, 0], unit)
    lot = _lots(node)
    beside = np.column_stack([lot >> np.uint64(40), lot & np.uint64(0xFFFFFF)]) / 2**24 * OFF_NODE
    position_mm = np.einsum("na,nak->nk", (node + SHIFT + beside) * spacing_mm, axes[which])
    position_mm += (height[:, None] * normal[face] / length[face, None])[which]
    return SurfacePoints(position_mm, face[which], unit[which], lot)


def _lots(node: Integers) -> NDArray[np.uint64]:
    """Return a pseudo-random number for each node (a pair of whole numbers), (n,), by the mixer of splitmix64."""
    row, column = node.astype(np.uint64).T
    mixed = row * np.uint64(0x9E3779B97F4A7C15) + column * np.uint64(0xC2B2AE3D27D4EB4F)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    return mixed ^ (mixed >> np.uint64(31))


def _axes(normal: Floats) -> Floats:
    """Return two unit vectors in the plane of each triangle, (f, 2, 3). They depend only on the normal."""
    along = np.column_stack([-normal[:, 1], normal[:, 0], np.zeros(len(normal))])
    level = np.abs(normal[:, 2]) > LEVEL
    along[level] = np.array([1.0, 0.0, 0.0]) - normal[level, :1] * normal[level]
    along /= lengths(along)[:, None]
    across = np.cross(normal, along)
    cosine, sine = np.cos(TURN), np.sin(TURN)
    return np.stack([cosine * along + sine * across, cosine * across - sine * along], axis=1)


def _crossed(corner: Floats, row: Integers) -> tuple[Integers, Integers]:
    """Return the first and last column of nodes in each triangle, (n, 3, 2), on a line of nodes ``row``, (n,) each."""
    low, high = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        a, b = corner[:, start], corner[:, end]
        crosses = (a[:, 0] - row) * (b[:, 0] - row) < 0
        share = (row - a[:, 0]) / np.where(crosses, b[:, 0] - a[:, 0], 1.0)
        y = a[:, 1] + share * (b[:, 1] - a[:, 1])
        low, high = np.where(crosses, np.minimum(low, y), low), np.where(crosses, np.maximum(high, y), high)
    met = low <= high
    return np.ceil(np.where(met, low, 0.0)).astype(np.int64), np.floor(np.where(met, high, -1.0)).astype(np.int64)
