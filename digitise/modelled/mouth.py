"""A traced outline on the mouth that it was traced from."""

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from digitise.geometry.polyline import Box, depth_inside, signed_area
from digitise.modelled.cavity import Cavity
from digitise.modelled.nearest import nearest_on_ring
from digitise.photo import Photo
from sealtwin.records import Floats, Outline

ON_EDGE_MM = 1e-3
"""A wall point this close to the edge of the face has met it."""


def with_mouth(traced: Outline, cavity: Cavity, photo: Photo) -> Outline:
    """The middle as traced, and walls that lie on the mouth itself: no doubt of a photo is left."""
    ring, *islands = sorted((np.asarray(ring) for ring in cavity.mouth.to_polygons()), key=signed_area, reverse=True)
    left_mm, right_mm = (_on_mouth(wall, ring, photo.face_mm) for wall in (traced.left_wall_mm, traced.right_wall_mm))
    return replace(
        traced,
        left_wall_mm=left_mm,
        right_wall_mm=right_mm,
        left_wall_px=photo.to_px(left_mm),
        right_wall_px=photo.to_px(right_mm),
        outline_mm=ring,
        outline_px=photo.to_px(ring),
        islands_mm=tuple(islands),
        branches_kept=len(traced.branches_mm) > 0,
        warnings=cavity.warnings,
    )


def _on_mouth(wall_mm: Floats, ring_mm: Floats, face_mm: Box | None) -> Floats:
    """The wall's points on the mouth's rim; where they stand on the edge of the face, on the mouth's corner there."""
    place_mm = nearest_on_ring(wall_mm, ring_mm)
    if face_mm is not None:
        stands = depth_inside(wall_mm, face_mm) < ON_EDGE_MM
        corners_mm = ring_mm[depth_inside(ring_mm, face_mm) < ON_EDGE_MM]
        if stands.any() and len(corners_mm):
            place_mm[stands] = corners_mm[KDTree(corners_mm).query(wall_mm[stands])[1]]
    return place_mm
