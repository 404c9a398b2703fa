"""Which part of the sample each triangle of a modelled block is."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from digitise.geometry.polyline import Box
from digitise.modelled.repair import neighbours
from sealtwin.records import FaceLabel, Floats, Integers

ON_SIDE_MM = 5e-3
"""A tidied vertex lies within one collapsed edge, 2e-3 mm, of its plane."""
STEEPEST_DEG = 45.0
"""From level: steeper is no face and no floor, but a wall."""


def label_modelled(vertices_mm: Floats, faces: Integers, block_mm: Box, below_mm: float) -> Integers:
    """A ``FaceLabel`` for each face, (f,).

    Sides and dams are told by their planes. What is left hangs together in patches between them and the face: the one
    at the bottom is the underside, those that stay within ``below_mm`` of the face are its grain, and the others are
    walls and floors, by how steep they are.
    """
    corners_mm = vertices_mm[faces]
    normal = np.cross(corners_mm[:, 1] - corners_mm[:, 0], corners_mm[:, 2] - corners_mm[:, 0])
    size = np.linalg.norm(normal, axis=1)
    flat = normal[:, 2] > np.cos(np.radians(STEEPEST_DEG)) * size
    label = np.full(len(faces), FaceLabel.WALL, dtype=np.int64)
    label[flat] = FaceLabel.FLOOR
    told = flat & (np.abs(corners_mm[:, :, 2]) <= below_mm).all(axis=1)
    label[told] = FaceLabel.TOP
    for side in range(4):
        in_plane = (np.abs(corners_mm[:, :, side % 2] - block_mm[side]) < ON_SIDE_MM).all(axis=1)
        outward = (normal[:, side % 2] < 0) == (side < 2)
        # A dam's inner side lies in the same plane and looks back at the crack.
        label[in_plane] = np.where(outward[in_plane], FaceLabel.OUTSIDE, FaceLabel.END)
        told |= in_plane
    beyond = _outside(corners_mm.mean(axis=1), block_mm)
    label[beyond] = FaceLabel.OUTSIDE
    told |= beyond
    patch = _patches(faces, ~told)
    lowest_mm = np.full(patch.max() + 1, np.inf)
    np.minimum.at(lowest_mm, patch, corners_mm[:, :, 2].min(axis=1))
    left = ~told
    label[left & (lowest_mm[patch] >= -below_mm)] = FaceLabel.TOP
    label[left & (lowest_mm[patch] <= vertices_mm[faces, 2].min() + ON_SIDE_MM)] = FaceLabel.OUTSIDE
    return label


def _outside(places_mm: Floats, box_mm: Box) -> NDArray[np.bool_]:
    low, high = np.array(box_mm[:2]) - ON_SIDE_MM, np.array(box_mm[2:]) + ON_SIDE_MM
    return np.any((places_mm[:, :2] < low) | (places_mm[:, :2] > high), axis=1)


def _patches(faces: Integers, chosen: NDArray[np.bool_]) -> Integers:
    """Number of the patch in which each chosen face hangs together with its neighbours, (f,)."""
    one, other, _ = neighbours(faces)
    both = chosen[one] & chosen[other]
    links = coo_array((np.ones(both.sum(), dtype=np.int8), (one[both], other[both])), shape=(len(faces),) * 2)
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)
