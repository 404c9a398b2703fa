"""From a block and its crack, as a mesh has them, to the solid that is simulated."""

from typing import Any

import numpy as np
from manifold3d import Manifold

from digitise.body.dams import DAM_OVERLAP_MM, plate_over
from digitise.body.tidy import tidy
from digitise.geometry.polyline import Box
from digitise.geometry.region import rectangle
from digitise.mesh import examine_mesh
from digitise.modelled.block import Block
from digitise.modelled.cavity import Cavity
from digitise.modelled.labels import ON_SIDE_MM, label_modelled
from digitise.modelled.sections import cavity_sections
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline, Solid

TILT = "modelled"
"""In place of a reading of the tilt: the walls stand as they do in the mesh."""
CLEAR_MM = 0.01
"""Between a dam's edge and the block's own vertices: where dams have stood in the mesh already, theirs are left, and at
1e-7 mm from the new ones they would make folds.
"""


def modelled_solid(
    block: Block, cavity: Cavity, outline: Outline, dam_height_mm: float, report: dict[str, Any]
) -> Solid:
    """The block with a dam, ``dam_height_mm`` above the face, wherever its crack leaves it.

    Raises InputError where the outcome is not closed.
    """
    plates = _plates(block, cavity)
    bottom_mm = float(block.body.bounding_box()[2])
    body = block.body
    for plate in plates:
        body += rectangle(plate).extrude(dam_height_mm - bottom_mm).translate((0.0, 0.0, bottom_mm))
    vertices_mm, faces = tidy(body)
    faults, figures = examine_mesh(vertices_mm, faces)
    if figures is None:
        raise InputError(f"{faults[0]} Simplify the mesh in the program that made it.")
    return Solid(
        vertices_mm=vertices_mm,
        faces=faces,
        face_label=label_modelled(vertices_mm, faces, block.face_mm, cavity.below_mm),
        block_mm=block.face_mm,
        depth_mm=cavity.depth_mm,
        tilt=TILT,
        wall_angles_deg=(0.0, 0.0),
        cavity_volume_mm3=cavity.volume_mm3,
        sections=cavity_sections(cavity.body, outline),
        report={
            **report,
            "mouth_width_mm": outline.mean_width_mm,
            "watertight": True,
            "triangles": len(faces),
            "euler": figures.euler,
            "min_edge_mm": figures.min_edge_mm,
            "self_intersections": figures.self_intersections,
            "dams": [
                {"box_mm": [plate[0], plate[1], bottom_mm, plate[2], plate[3], dam_height_mm]} for plate in plates
            ],
            "warnings": [*report["warnings"], *faults],
        },
    )


def _plates(block: Block, cavity: Cavity) -> list[Box]:
    """Boxes of a dam over each place where the cavity lies open in one of the block's sides."""
    hollow_mm, body_mm = (_corners_mm(body) for body in (cavity.body, block.body))
    boxes = []
    for side in range(4):
        across, along = side % 2, 1 - side % 2
        level_mm = block.face_mm[side]
        in_side = (np.abs(hollow_mm[:, :, across] - level_mm) < ON_SIDE_MM).all(axis=1)
        taken_mm = body_mm[np.abs(body_mm[:, :, across] - level_mm) < ON_SIDE_MM][:, along]
        for low_mm, high_mm in _spans(hollow_mm[in_side, :, along]):
            ends_mm = np.zeros((2, 2))
            ends_mm[:, along] = _clear(low_mm, -DAM_OVERLAP_MM, taken_mm), _clear(high_mm, DAM_OVERLAP_MM, taken_mm)
            boxes.append(plate_over(ends_mm, side, block.face_mm))
    return boxes


def _corners_mm(body: Manifold) -> Floats:
    """Of each triangle, (f, 3, 3)."""
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties[:, :3])[np.array(mesh.tri_verts, dtype=np.int64)]


def _clear(end_mm: float, overlap_mm: float, taken_mm: Floats) -> float:
    """A little beyond the end of an opening, so that a dam which overlaps it ends near no vertex of the side."""
    step_mm = 2 * CLEAR_MM * float(np.sign(overlap_mm))
    while np.abs(taken_mm - end_mm - overlap_mm).min() < CLEAR_MM:
        end_mm += step_mm
    return end_mm


def _spans(along_mm: Floats) -> list[tuple[float, float]]:
    """What triangles, (n, 3) of their corners' places along a side, cover of it; near spans, for one dam, joined."""
    if not len(along_mm):
        return []
    spans = []
    for begin, end in sorted(zip(along_mm.min(axis=1).tolist(), along_mm.max(axis=1).tolist(), strict=True)):
        if spans and begin <= spans[-1][1] + 2 * DAM_OVERLAP_MM:
            spans[-1] = spans[-1][0], max(spans[-1][1], end)
        else:
            spans.append((begin, end))
    return spans
