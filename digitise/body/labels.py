"""Which part of the sample each triangle is."""

import numpy as np
from numpy.typing import NDArray

from digitise.body.footprint import Footprint
from digitise.geometry.region import nearest_side
from sealtwin.records import FaceLabel, Floats, Integers

NEAR_MM = 5e-3
"""A tidied vertex lies within one collapsed edge, 2e-3 mm, of its plane."""


def label_faces(
    vertices_mm: Floats, faces: Integers, footprint: Footprint, depth_mm: float, bottom_mm: float
) -> Integers:
    """A ``FaceLabel`` for each face, by the planes it lies in; what lies in none of them is WALL, (f,)."""
    corners = vertices_mm[faces]
    centre = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    box = footprint.block_mm
    label = np.full(len(faces), FaceLabel.WALL, dtype=np.int64)
    for end in footprint.ends:
        if end.kind == "cut":
            facing = np.array([end.across[1], -end.across[0]])
            label[_within((corners[:, :, :2] - end.centre_mm) @ facing, 0.0)] = FaceLabel.END
    dammed = {nearest_side(end.centre_mm, box) for end in footprint.ends if end.kind == "open"}
    for side in range(4):
        in_plane = _within(corners[:, :, side % 2], box[side])
        label[in_plane] = FaceLabel.OUTSIDE
        if side in dammed:
            # A dam's inner side lies in the same plane and looks back at the crack.
            inward = (normal[:, side % 2] > 0) == (side < 2)
            label[in_plane & inward] = FaceLabel.END
    label[_within(corners[:, :, 2], 0.0)] = FaceLabel.TOP
    label[_on_floor(vertices_mm, faces, footprint, depth_mm)] = FaceLabel.FLOOR
    label[_within(corners[:, :, 2], bottom_mm)] = FaceLabel.OUTSIDE
    beyond = (centre[:, 0] < box[0] - NEAR_MM) | (centre[:, 0] > box[2] + NEAR_MM)
    beyond |= (centre[:, 1] < box[1] - NEAR_MM) | (centre[:, 1] > box[3] + NEAR_MM)
    label[beyond] = FaceLabel.OUTSIDE
    return label


def _on_floor(vertices_mm: Floats, faces: Integers, footprint: Footprint, depth_mm: float) -> NDArray[np.bool_]:
    if footprint.floor is None:
        return _within(vertices_mm[faces][:, :, 2], -depth_mm)
    above_mm = vertices_mm[:, 2] + footprint.floor.depth_at_mm(vertices_mm[:, :2])
    middle_mm = vertices_mm[faces].mean(axis=1)
    # A wall between two places of a floor that rises between them has its corners in the floor, but not its middle.
    arched_mm = middle_mm[:, 2] + footprint.floor.depth_at_mm(middle_mm[:, :2])
    return _within(above_mm[faces], 0.0) & (np.abs(arched_mm) < NEAR_MM)


def _within(coordinate: Floats, level: float) -> NDArray[np.bool_]:
    """Whether all corners (f, 3) of a face lie in the plane."""
    return np.all(np.abs(coordinate - level) < NEAR_MM, axis=1)
