"""The signed distance to the solid: exact from its mesh, and from a grid that is fast enough to ask in every step."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from sealtwin.errors import InputError
from sealtwin.records import FaceLabel, Floats, Outline, Solid
from simulate import kernels_distance as device_code

CM = 0.1
"""In a millimetre: kernels work in centimetres."""
CLEARANCE = 0.86
"""Of a particle's centre from a wall over its radius: where fluid pressed on calibrated walls comes to rest."""
MARGIN_MM = 12.0
"""Face around the crack's mouth that the grid covers; beyond it sealant rests on the plane z = 0."""
RAISED_MM = 1e-3
"""Above this height a vertex is no longer rounding of the face."""
BLOCKS_AT_MOST = 4_000_000
"""Of 64 cells: 1.6 m of a paper-sized crack at its radius, and 3 GB at worst."""


@dataclass(frozen=True)
class Barrier:
    """What no particle may enter."""

    grid: Any
    """A kernels_distance.Distance. Spacing R/2; a wall thinner than that is not resolved by it."""
    mesh: wp.Mesh
    clearance: float
    """cm, that a particle's centre keeps from walls."""
    device: str

    def exact_mm(self, points_mm: Floats) -> Floats:
        """Signed distance from the mesh itself, (n,): negative inside the solid."""
        return exact_distance_mm(self.mesh, points_mm, self.device)

    def sampled_mm(self, points_mm: Floats) -> Floats:
        """Signed distance as kernels see it, (n,); a lower bound of its size away from the surface."""
        points = wp.array(points_mm * CM, dtype=wp.vec3, device=self.device)
        distance = wp.empty(len(points_mm), dtype=float, device=self.device)
        wp.launch(device_code.sample_distance, len(points_mm), inputs=[self.grid, points, distance], device=self.device)
        return distance.numpy() / CM


def build_barrier(solid: Solid, outline: Outline, radius_mm: float, device: str) -> Barrier:
    """Distances in a box around the crack, on blocks near the surface only.

    Raises InputError where the box is too large for the radius.
    """
    mesh = wp.Mesh(
        points=wp.array(solid.vertices_mm * CM, dtype=wp.vec3, device=device),
        indices=wp.array(solid.faces.ravel(), dtype=int, device=device),
    )
    spacing_mm = radius_mm / 2
    block_mm = spacing_mm * device_code.BLOCK
    low, high = crack_box_mm(solid, outline, radius_mm)
    blocks = np.ceil((high - low) / block_mm).astype(int)
    if (count := int(np.prod(blocks, dtype=float))) > BLOCKS_AT_MOST:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: its distance grid would need {count} blocks, {BLOCKS_AT_MOST} are "
            "allowed. Take a larger radius, or simulate a shorter piece of the crack."
        )
    corners = low + np.stack(np.meshgrid(*map(np.arange, blocks), indexing="ij"), axis=-1).reshape(-1, 3) * block_mm
    centre_mm = exact_distance_mm(mesh, corners + block_mm / 2, device)
    half_diagonal_mm = np.sqrt(3) / 2 * block_mm
    near = (centre_mm > -half_diagonal_mm) & (centre_mm < half_diagonal_mm + radius_mm)
    ticks = np.arange(device_code.BLOCK + 1) * spacing_mm
    offsets = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    points = (corners[near][:, None] + offsets).reshape(-1, 3)
    nodes = exact_distance_mm(mesh, points, device).reshape(-1, *[device_code.BLOCK + 1] * 3)
    row = np.full(len(near), -1)
    row[near] = np.arange(near.sum())
    grid = device_code.Distance()
    grid.corner = wp.vec3(*(low * CM))
    grid.spacing = spacing_mm * CM
    grid.blocks = wp.vec3i(*map(int, blocks))
    grid.row = wp.array(row.reshape(blocks), dtype=int, device=device)
    grid.centre = wp.array((centre_mm * CM).reshape(blocks), dtype=float, device=device)
    grid.nodes = wp.array(nodes * CM, dtype=float, device=device)
    grid.face = wp.vec4(*(np.array(solid.block_mm) * CM))
    return Barrier(grid, mesh, CLEARANCE * radius_mm * CM, device)


def crack_box_mm(solid: Solid, outline: Outline, radius_mm: float) -> tuple[Floats, Floats]:
    """Low and high corner, (3,) each: all that sealant in the crack or near its mouth can touch.

    Walls that lean far and what stands above the face belong to it, also where they leave the margin.
    """
    inner = solid.faces[np.isin(solid.face_label, [FaceLabel.WALL, FaceLabel.FLOOR, FaceLabel.END])]
    raised = np.flatnonzero(solid.vertices_mm[:, 2] > RAISED_MM)
    walls_mm = solid.vertices_mm[np.concatenate([inner.ravel(), raised])][:, :2]
    low_mm = np.vstack([outline.outline_mm - MARGIN_MM, walls_mm - 2 * radius_mm]).min(axis=0)
    high_mm = np.vstack([outline.outline_mm + MARGIN_MM, walls_mm + 2 * radius_mm]).max(axis=0)
    top_mm = solid.vertices_mm[:, 2].max()
    return np.append(low_mm, -solid.depth_mm - 2 * radius_mm), np.append(high_mm, top_mm + 2 * radius_mm)


def exact_distance_mm(mesh: wp.Mesh, points_mm: Floats, device: str) -> Floats:
    """NaN for a point that is no number. Raises InputError where any other sees no triangle at all."""
    points = wp.array(points_mm * CM, dtype=wp.vec3, device=device)
    distance = wp.empty(len(points_mm), dtype=float, device=device)
    wp.launch(device_code.measure_distance, len(points_mm), inputs=[mesh.id, points, distance], device=device)
    found = distance.numpy() / CM
    if np.isnan(found[np.isfinite(points_mm).all(axis=1)]).any():
        raise InputError("the solid has no triangle of any area: check the mesh, or digitise again.")
    return found
