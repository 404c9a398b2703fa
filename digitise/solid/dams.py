"""Make dams at open ends, like the paper's tape. Check that the cavity leaves the block only there. Label faces."""

from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, JoinType, OpType

from digitise.geometry.polyline import Box, depth_inside, nearest_side
from digitise.geometry.region import box_region, pieces
from digitise.solid.footprint import Footprint
from sealtwin.core.arrays import normals
from sealtwin.core.errors import InputError
from sealtwin.core.records import Booleans, FaceLabel, Floats, Integers
from sealtwin.core.solid_figures import DamBox

NEAR_MM = 5e-3  # Points this close to a plane are in it. Cleaning moves a vertex by about one collapsed edge, 2e-3 mm
CLEARANCE_MM = 0.5  # Minimum thickness of the sample between the crack and the block's side
DAM_THICKNESS_MM = 4.0
DAM_OVERLAP_MM = 4.0  # Width of the block's side that a dam covers on each side of the opening, as tape does


def label_faces(
    vertices_mm: Floats, faces: Integers, footprint: Footprint, depth_mm: float, bottom_mm: float
) -> Integers:
    """Return a ``FaceLabel`` for each face, (f,), from the plane that contains the face. Faces in no plane are WALL."""
    corners, box = vertices_mm[faces], footprint.block_mm
    label = np.full(len(faces), FaceLabel.WALL, np.int64)
    for end in footprint.ends:
        if end.kind == "cut":
            label[_within((corners[:, :, :2] - end.centre_mm) @ end.facing, 0.0)] = FaceLabel.END
    label_sides(label, corners, box)
    label[_within(corners[:, :, 2], 0.0)] = FaceLabel.TOP
    label[_on_floor(vertices_mm, faces, footprint, depth_mm)] = FaceLabel.FLOOR
    label[_within(corners[:, :, 2], bottom_mm)] = FaceLabel.OUTSIDE
    label[depth_inside(corners.mean(axis=1)[:, :2], box) < -NEAR_MM] = FaceLabel.OUTSIDE
    return label


def label_sides(label: Integers, corners_mm: Floats, box_mm: Box) -> Booleans:
    """Label the faces in the planes of the block's sides. Return a mask that is True for these faces, (f,)."""
    normal, labelled = normals(corners_mm), np.zeros(len(label), bool)
    for side in range(4):
        in_plane = _within(corners_mm[:, :, side % 2], box_mm[side])
        outward = (normal[:, side % 2] < 0) == (side < 2)
        # The inner side of a dam is in the same plane, but faces the crack.
        label[in_plane] = np.where(outward[in_plane], FaceLabel.OUTSIDE, FaceLabel.END)
        labelled |= in_plane
    return labelled


def _on_floor(vertices_mm: Floats, faces: Integers, footprint: Footprint, depth_mm: float) -> Booleans:
    # A wall at a step of the floor may have all corners in the floor, but not its middle.
    corners_mm = np.concatenate([vertices_mm[faces], vertices_mm[faces].mean(axis=1, keepdims=True)], axis=1)
    floor = footprint.floor
    below_mm = depth_mm if floor is None else floor.depth_at_mm(corners_mm[..., :2])
    return _within(corners_mm[..., 2] + below_mm, 0.0)


def _within(coordinate: Floats, level: float) -> Booleans:
    """Return True for the faces whose points are all at ``level``, (f,). ``coordinate`` is (f, n)."""
    return np.all(np.abs(coordinate - level) < NEAR_MM, axis=1)


@dataclass(frozen=True)
class Dam:
    """A plate outside the block's side that closes one open end."""

    end: int
    box_mm: Box


def dam_box(plate_mm: Box, bottom_mm: float, top_mm: float, end: int | None = None) -> DamBox:
    """Return the box of a plate that reaches from ``bottom_mm`` up to ``top_mm``."""
    return DamBox((*plate_mm[:2], bottom_mm, *plate_mm[2:], top_mm), end)


def dams(footprint: Footprint, sections: list[CrossSection], spread_mm: float = 0.0) -> tuple[Dam, ...]:
    """Return a plate over the opening at each open end.

    Raises InputError if an open end does not reach the block's side, or if ``sections``, the horizontal sections of the
    cavity, come close to the block's side elsewhere.
    """
    points = np.vstack([polygon for section in sections for polygon in section.to_polygons()])
    plates = []
    for end in footprint.ends:
        if end.kind == "open":
            side = nearest_side(end.centre_mm, footprint.block_mm)
            at_side = points[np.abs(points[:, side % 2] - footprint.block_mm[side]) < 1e-6]
            if not len(at_side):
                raise InputError(
                    f"End {end.number + 1} is open, but the crack does not reach the block's side there. Move the end "
                    "to the edge of the face, or make it closed or cut."
                )
            plates.append(Dam(end.number, plate_over(at_side, side, footprint.block_mm)))
    x_min, y_min, x_max, y_max = footprint.block_mm
    upright = box_region((x_min + CLEARANCE_MM, y_min, x_max - CLEARANCE_MM, y_max))
    lying = box_region((x_min, y_min + CLEARANCE_MM, x_max, y_max - CLEARANCE_MM))
    covered = CrossSection.batch_boolean([box_region(plate.box_mm) for plate in plates], OpType.Add)
    # A dam covers one side only, so the corners of the block are never behind a dam.
    safe = (upright ^ lying) + (covered.offset(CLEARANCE_MM, JoinType.Miter) ^ (upright + lying))
    if not any(pieces(section - safe) for section in sections):
        return tuple(plates)
    if not pieces(((footprint.crack ^ footprint.block) - footprint.stoppers) - safe):
        raise tilted_out(spread_mm)
    raise InputError(
        f"The crack's mouth or floor comes within {CLEARANCE_MM} mm of the block's side, or crosses it, at a point "
        "without an open end. Mark an open end there, or give a larger face_mm or margin_mm."
    )


def plate_over(at_side: Floats, side: int, block_mm: Box) -> Box:
    """Return the box of a plate outside the block's side. It covers an opening and an overlap, up to the corners."""
    along, across = 1 - side % 2, side % 2
    box_mm, opening_mm = np.array(block_mm, float), at_side[:, along]
    reach_mm = np.array([opening_mm.min() - DAM_OVERLAP_MM, opening_mm.max() + DAM_OVERLAP_MM])
    box_mm[[along, along + 2]] = np.clip(reach_mm, block_mm[along], block_mm[along + 2])
    box_mm[[across, across + 2]] = block_mm[side] + DAM_THICKNESS_MM * np.array([-1, 0] if side < 2 else [0, 1])
    x_min, y_min, x_max, y_max = box_mm.tolist()
    return x_min, y_min, x_max, y_max


REDUCE_ANGLE = "Reduce wall_angle_deg"


def tilted_out(spread_mm: float) -> InputError:
    """Return the error for walls that leave the sample because of their tilt."""
    return InputError(
        f"The tilt moves the walls {spread_mm:.1f} mm sideways over the depth, so that the crack comes within "
        f"{CLEARANCE_MM} mm of the block's side, or crosses it, at a point without an open end. {REDUCE_ANGLE}, check "
        'depth_mm, or choose tilt = "vertical".'
    )
