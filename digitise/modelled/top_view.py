"""A block and its crack as an ideal photo from above: what traces photos then traces meshes, by the same rules."""

from pathlib import Path

import cv2
import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from digitise.geometry.polyline import signed_area
from digitise.modelled.block import Block
from digitise.modelled.cavity import Cavity
from digitise.photo import Photo
from digitise.scaling.view import View
from digitise.settings import MeshUnit
from digitise.specimens.rendering import coverage
from sealtwin.errors import InputError
from sealtwin.records import arc_length

ACROSS_PX = 40
"""Pixels over the crack's width: half a hundredth of it for what interpolation leaves of a wall's place."""
LARGEST_PX = 12_000_000
"""Of the picture: as a phone's photo."""
LEAST_ACROSS_PX = 10
"""Below, walls drawn in pixels would round off what the mesh knows of them."""
ROUND_MM = 15.0
"""Of the face round the crack that is shown: room for the overlay's legend."""
BORDER_MM = 8.0
"""Beside the face: room for what the overlay writes at the ends of a crack that leaves it."""
FACET_MM, FACETS = 1.0, 50_000
"""Long facets are drawn in pieces of this size, as each has one shade; but in no more than so many."""
SPECK_MM2 = 1e-6
"""Facets of less are what rounding leaves at a cut, and would be drawn as lines."""
FACE_GREY, DEEPEST_GREY, BESIDE_GREY = 205.0, 40.0, 245
LIGHT = np.array([-0.4, 0.45, 0.8])
"""From the upper left."""


def photograph(block: Block, cavity: Cavity, file: Path, units: MeshUnit) -> Photo:
    """The crack's mouth dark on a bright face, each pixel by the share that it covers; and a shaded picture to look at.

    Lengths are mm; ``units`` are those that the file's numbers had. Raises InputError where the crack is too narrow for
    its length.
    """
    low, high = np.reshape(cavity.mouth.bounds(), (2, 2))
    face_low, face_high = np.zeros(2), np.array(block.size_mm)
    low, high = np.maximum(low - ROUND_MM, face_low - BORDER_MM), np.minimum(high + ROUND_MM, face_high + BORDER_MM)
    rings = [np.asarray(ring, dtype=float) for ring in cavity.mouth.to_polygons()]
    # A long strip has half its rim on either side.
    width_mm = 2 * cavity.mouth.area() / sum(arc_length(ring[[*range(len(ring)), 0]])[-1] for ring in rings)
    mm_per_px = max(width_mm / ACROSS_PX, float(np.sqrt(np.prod(high - low) / LARGEST_PX)))
    if width_mm < LEAST_ACROSS_PX * mm_per_px:
        raise InputError(
            f"{file}: the crack is {width_mm:.3f} mm wide and spreads over {high[0] - low[0]:.0f} x "
            f"{high[1] - low[1]:.0f} mm: too narrow to be followed; crop the mesh to a shorter piece."
        )
    mm_from_px = np.array([[mm_per_px, 0.0, low[0]], [0.0, -mm_per_px, high[1]], [0.0, 0.0, 1.0]])
    view = View(mm_from_px)
    width_px, height_px = (int(count) for count in np.ceil((high - low) / mm_per_px) + 1)
    covered = np.zeros((height_px, width_px), dtype=np.float32)
    for ring in rings:
        # Rings run clockwise round what is no crack.
        covered += np.sign(signed_area(ring)) * coverage(view.to_px(ring), (width_px, height_px))
    return Photo(
        file=file,
        image=_shaded(block.body, view, (height_px, width_px), cavity.depth_mm),
        brightness=1.0 - np.clip(covered, 0, 1),
        view=view,
        face_mm=block.face_mm,
        mm_per_px=mm_per_px,
        scale_source=f"mesh in {units}: {file.name}",
        scale_residual_mm=None,
        drawn=covered > 0.5,
        warnings=cavity.warnings,
    )


def _shaded(body: Manifold, view: View, shape: tuple[int, int], depth_mm: float) -> NDArray[np.uint8]:
    """All that looks up, from the lowest to the highest, the darker the deeper, (height, width, 3)."""
    mesh = body.refine_to_length(max(FACET_MM, float(np.sqrt(body.surface_area() / FACETS)))).to_mesh64()
    corners_mm = np.array(mesh.vert_properties[:, :3])[np.array(mesh.tri_verts, dtype=np.int64)]
    across = np.cross(corners_mm[:, 1] - corners_mm[:, 0], corners_mm[:, 2] - corners_mm[:, 0])
    up = across[:, 2] > SPECK_MM2
    corners_mm, across = corners_mm[up], across[up]
    height_mm = corners_mm[:, :, 2].mean(axis=1)
    order = np.argsort(height_mm)
    depth = np.clip(-height_mm / depth_mm, 0, 1)
    lit = np.clip(across @ LIGHT / np.linalg.norm(across, axis=1) / LIGHT[2], 0.3, 1.1)
    grey = np.clip((FACE_GREY + depth * (DEEPEST_GREY - FACE_GREY)) * lit, 0, 255).round().astype(int).tolist()
    fixed = np.rint(view.to_px(corners_mm[:, :, :2].reshape(-1, 2)) * 16).astype(np.int32).reshape(-1, 3, 2)
    picture = np.full(shape, BESIDE_GREY, dtype=np.uint8)
    for number in order.tolist():
        cv2.fillConvexPoly(picture, fixed[number], (grey[number],), cv2.LINE_8, 4)
    return np.repeat(picture[:, :, None], 3, axis=2)
