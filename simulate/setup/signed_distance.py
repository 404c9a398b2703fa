"""Signed distances to the solid: exact distances from its mesh, and distances from a grid for use in each substep."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from sealtwin.core.errors import InputError
from sealtwin.core.records import Booleans, FaceLabel, Floats, Integers, Outline, Solid
from simulate.kernels import distance as device_code
from simulate.kernels import exact_distance

CM = 0.1  # Centimetres per millimetre, since kernels use centimetres
CLEARANCE = 0.86
"""Smallest distance of a particle's centre from walls, divided by the particle's radius. On calibrated walls, fluid
rests at this distance."""
MARGIN_MM = 12.0
"""Width of the face around the mouth that the grid covers, in mm. Beyond it, the plane z = 0 replaces the grid."""
RAISED_MM = 1e-3  # A vertex that is higher above the face is not due to rounding
ROUNDING_RATIO = 0.15  # Largest distance of walls from the plane that replaces them, divided by the radius
ROUNDED = 0.01  # Fraction of a depth by which rounding may change a distance
EVERYWHERE_MM = 1e7  # Search distance within which all triangles are
SLACK = 1.001  # Factor for search distances, which may have been rounded down
GROUP_BLOCKS = 4  # Number of blocks along the edge of a group of blocks
BLOCKS_AT_MOST = 4_000_000
"""Largest number of blocks of 64 cells. It is enough for 1.6 m of a crack like the paper's, at the paper's radius. The
grid takes at most 3 GB."""


@dataclass(frozen=True)
class SolidSurface:
    """The mesh of the solid on a device."""

    mesh: wp.Mesh
    clearance: float  # Smallest distance in cm of a particle's centre from walls

    def exact_mm(self, points_mm: Floats) -> Floats:
        """Return the signed distance in mm from the mesh, (n,). It is negative inside the solid."""
        return exact_distance_mm(self.mesh, points_mm)


@dataclass(frozen=True)
class Barrier(SolidSurface):
    """The solid as an obstacle for particles."""

    grid: Any  # A ``kernels.distance.Distance`` of spacing R/2. It does not resolve thinner walls.

    def sampled_mm(self, points_mm: Floats) -> Floats:
        """Return the signed distance in mm, interpolated in the grid, (n,).

        Far from the surface, the absolute value is only a lower bound.
        """
        count, device = len(points_mm), self.mesh.device
        points, distance = wp.array(points_mm * CM, wp.vec3, device=device), wp.empty(count, float, device)
        wp.launch(device_code.sample_distance, count, inputs=[self.grid, points, distance], device=device)
        return distance.numpy() / CM

    def is_inside(self, points_mm: Floats, depth_mm: float) -> Booleans:
        """Return the mask of points, (n,), that are at least ``depth_mm`` inside the solid.

        ``depth_mm`` must be larger than the diagonal of a cell. The sign then comes from the grid, without the rays of
        ``exact_mm``.
        """
        nothing = np.zeros(len(points_mm))
        near = _beside_mm(self.mesh, points_mm, nothing + SLACK * depth_mm, nothing) < depth_mm
        # In a block without nodes, rounding may make the grid's distance in the solid slightly larger than 0.
        return ~near & (self.sampled_mm(points_mm) < ROUNDED * depth_mm)


def surface_of(solid: Solid, radius_mm: float, device: str) -> SolidSurface:
    return SolidSurface(_mesh(solid, solid.faces, device), CLEARANCE * radius_mm * CM)


def build_barrier(solid: Solid, outline: Outline, radius_mm: float, device: str) -> Barrier:
    """Build the grid of distances in a box around the crack. Only blocks near the surface have nodes.

    Raises InputError if the radius is so small that the box has too many blocks.
    """
    surface = surface_of(solid, radius_mm, device)
    mesh = surface.mesh
    spacing_mm = radius_mm / 2
    block_mm = spacing_mm * device_code.BLOCK
    low, blocks = _blocks(solid, outline, radius_mm)
    if (count := int(np.prod(blocks, dtype=float))) > BLOCKS_AT_MOST:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: its distance grid would need {count} blocks, but at most "
            f"{BLOCKS_AT_MOST} are allowed. Give a larger radius, or simulate a shorter piece of the crack."
        )
    half_diagonal_mm = np.sqrt(3) / 2 * block_mm
    number = np.indices(tuple(blocks)).reshape(3, -1).T
    middle_mm = low + (number + 0.5) * block_mm
    centre_mm = _at_centres(mesh, low, number, middle_mm, half_diagonal_mm + radius_mm, block_mm)
    near = (centre_mm > -half_diagonal_mm) & (centre_mm < half_diagonal_mm + radius_mm)
    faced = near.copy()
    faced[near] = _at_the_face(solid, middle_mm[near], half_diagonal_mm, block_mm, mesh.device)
    noded = near & ~faced
    row = np.full(len(number), device_code.FAR)
    row[faced] = device_code.FACE
    row[noded] = np.arange(noded.sum())
    grid = device_code.Distance()
    grid.corner = wp.vec3(*(low * CM))
    grid.spacing = spacing_mm * CM
    grid.clearance = surface.clearance
    grid.blocks = wp.vec3i(*map(int, blocks))
    grid.row = wp.array(row, int, device=device)
    grid.centre = wp.array(centre_mm * CM, float, device=device)
    grid.face = wp.vec4(*(np.array(solid.block_mm) * CM))
    nodes_mm = _nodes_mm(mesh, grid, number[noded])
    grid.nodes = wp.array(nodes_mm.ravel() * CM, float, device=device)
    grid.rounded = wp.array(_off_plane(nodes_mm) > ROUNDING_RATIO * radius_mm, int, device=device)
    return Barrier(mesh, surface.clearance, grid)


def _at_centres(
    mesh: wp.Mesh, low: Floats, number: Integers, middle_mm: Floats, near_mm: float, block_mm: float
) -> Floats:
    """Return the distance at the centre of each block, (b,). It is only a lower bound if it is above ``near_mm``.

    Blocks are measured one by one only if their group, a cube of ``GROUP_BLOCKS`` per side, is near the surface.
    """
    groups = number.max(axis=0) // GROUP_BLOCKS + 1
    member = np.ravel_multi_index(tuple((number // GROUP_BLOCKS).T), tuple(groups))
    first = np.indices(tuple(groups)).reshape(3, -1).T * GROUP_BLOCKS
    group_mm = low + (first + 0.5) * block_mm + (GROUP_BLOCKS - 1) / 2 * block_mm
    around_mm = exact_distance_mm(mesh, group_mm)[member]
    away_mm = np.linalg.norm(middle_mm - group_mm[member], axis=1)
    for_sure_mm = np.abs(around_mm) - away_mm
    centre_mm = np.sign(around_mm) * for_sure_mm
    unsure = for_sure_mm <= near_mm
    centre_mm[unsure] = _beside_mm(mesh, middle_mm[unsure], around_mm[unsure], away_mm[unsure])
    return centre_mm


def _at_the_face(solid: Solid, middle_mm: Floats, half_diagonal_mm: float, block_mm: float, device: Any) -> Booleans:
    """Return the mask of blocks, (b,), in which the face is the nearest surface at every point."""
    top = solid.face_label == FaceLabel.TOP
    flat = np.abs(solid.vertices_mm[solid.faces[top]][:, :, 2]).max(initial=0.0) <= RAISED_MM
    if top.all() or not top.any() or not flat:
        return np.zeros(len(middle_mm), bool)
    others = _mesh(solid, solid.faces[~top], device)
    # If no other triangle is within this distance, the face is the nearest surface in the whole block and around it.
    reach_mm = half_diagonal_mm + np.abs(middle_mm[:, 2]) + block_mm / 2
    return np.isnan(_beside_mm(others, middle_mm, np.zeros(len(middle_mm)), reach_mm))


def _nodes_mm(mesh: wp.Mesh, grid: Any, noded: Integers) -> Floats:
    """Return the distances in mm at the nodes of the blocks ``noded``, (b, NODES). The grid needs no nodes yet."""
    blocks = exact_distance.Blocks()
    blocks.number = wp.array(noded, wp.vec3i, device=mesh.device)
    blocks.distance = wp.empty((len(noded), device_code.NODES), float, mesh.device)
    for shared in (False, True):
        inputs = [mesh.id, grid, shared, blocks]
        wp.launch(exact_distance.measure_nodes, len(noded), inputs=inputs, device=mesh.device)
    return blocks.distance.numpy() / CM


def _off_plane(nodes_mm: Floats) -> Floats:
    """Return the largest deviation, (b,), of each block's node distances, (b, NODES), from a fitted plane."""
    side = np.arange(device_code.BLOCK + 1) - device_code.BLOCK / 2
    away = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    away = away.astype(nodes_mm.dtype)
    slope = nodes_mm @ away / (away[:, 0] ** 2).sum()
    return np.abs(nodes_mm - nodes_mm.mean(axis=1, keepdims=True) - slope @ away.T).max(axis=1, initial=0.0)


def _mesh(solid: Solid, faces: Integers, device: Any) -> wp.Mesh:
    return wp.Mesh(
        wp.array(solid.vertices_mm * CM, wp.vec3, device=device), wp.array(faces.ravel(), int, device=device)
    )


def _blocks(solid: Solid, outline: Outline, radius_mm: float) -> tuple[Floats, Integers]:
    """Return the lowest corner of the grid, and the number of its blocks along each axis, (3,) each."""
    low_mm, high_mm = crack_box_mm(solid, outline, radius_mm)
    return low_mm, np.ceil((high_mm - low_mm) / (radius_mm / 2 * device_code.BLOCK)).astype(int)


def grid_fits(solid: Solid, outline: Outline, radius_mm: float) -> bool:
    """Return True if the distance grid around a crack that a radius requires is not too large."""
    return bool(np.prod(_blocks(solid, outline, radius_mm)[1], dtype=float) <= BLOCKS_AT_MOST)


def crack_box_mm(solid: Solid, outline: Outline, radius_mm: float) -> tuple[Floats, Floats]:
    """Return the corners, (3,) each, of the box that contains all that sealant in or near the crack can touch.

    The box also includes strongly leaning walls, and parts above the face, that extend beyond the margin.
    """
    inner = solid.faces[np.isin(solid.face_label, [FaceLabel.WALL, FaceLabel.FLOOR, FaceLabel.END])]
    raised = np.flatnonzero(solid.vertices_mm[:, 2] > RAISED_MM)
    walls_mm = solid.vertices_mm[np.concatenate([inner.ravel(), raised])][:, :2]
    low_mm = np.vstack([outline.outline_mm - MARGIN_MM, walls_mm - 2 * radius_mm]).min(axis=0)
    high_mm = np.vstack([outline.outline_mm + MARGIN_MM, walls_mm + 2 * radius_mm]).max(axis=0)
    top_mm = solid.vertices_mm[:, 2].max()
    return np.append(low_mm, -solid.depth_mm - 2 * radius_mm), np.append(high_mm, top_mm + 2 * radius_mm)


def exact_distance_mm(mesh: wp.Mesh, points_mm: Floats) -> Floats:
    """Return the exact signed distance of points in mm, (n,). It is NaN for a point that is NaN.

    Raises InputError if no triangle has an area.
    """
    nothing = np.zeros(len(points_mm))
    distance_mm = _beside_mm(mesh, points_mm, nothing, nothing + EVERYWHERE_MM)
    if np.isnan(distance_mm[np.isfinite(points_mm).all(axis=1)]).any():
        raise InputError("no triangle of the solid has an area. Check the mesh, or digitise again.")
    return distance_mm


def _beside_mm(mesh: wp.Mesh, points_mm: Floats, nearby_mm: Floats, away_mm: Floats) -> Floats:
    """Return the exact signed distance of points in mm, (n,). NaN if no triangle is close enough.

    Each point is at most ``away_mm`` from another point with the known signed distance ``nearby_mm``. Triangles are
    searched within the sum of both. If no such point is known, ``nearby_mm`` is 0.
    """
    places = exact_distance.Places()
    places.point = wp.array(points_mm * CM, wp.vec3, device=mesh.device)
    places.nearby = wp.array(nearby_mm * CM, float, device=mesh.device)
    places.away = wp.array(away_mm * CM * SLACK, float, device=mesh.device)
    places.distance = wp.empty(len(points_mm), float, mesh.device)
    wp.launch(exact_distance.measure_places, len(points_mm), inputs=[mesh.id, places], device=mesh.device)
    return places.distance.numpy() / CM
