"""Import a modelled or scanned sample. The result has the same records as a sample from a photo."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.ndimage import minimum
from scipy.spatial.transform import Rotation

from digitise.geometry.mesh_topology import examine_mesh
from digitise.geometry.polyline import Box, depth_inside
from digitise.geometry.region import box_region, prism
from digitise.mesh_import.block import MEND, STEEPEST, Block, FacePlane, closed_body, cut_block, find_face, one_surface
from digitise.mesh_import.cavity import Cavity, cavity_sections, find_cavity, photograph
from digitise.mesh_import.mouth_line import line_of_mouth, outline_of
from digitise.photo import Photo
from digitise.settings import MeshInput
from digitise.solid.dams import NEAR_MM, dam_box, label_sides, plate_over
from digitise.solid.float_mesh import arrays_of, tidy
from sealtwin.core.arrays import lengths, normals
from sealtwin.core.errors import ShapeError
from sealtwin.core.facts import Fact, Facts, doubt
from sealtwin.core.mesh_file import Triangles, read_mesh
from sealtwin.core.records import FaceLabel, Floats, Integers, Outline, Solid
from sealtwin.core.solid_figures import MeshOrigin, SolidFigures
from sealtwin.scan.settings import MM, UPRIGHT_DEG

MIN_MM, MAX_MM = 10.0, 1000.0  # Limits of a sample's longest side; beyond them the unit must be wrong
MIN_TURN_DEG = 0.005  # A smaller rotation of the block is not mentioned
MAX_STEP_MM = 0.01  # Largest rounding step of a file's coordinates: a tenth of a fine photo's pixel


@dataclass(frozen=True)
class ImportedSample:
    """Outline, solid and top view of a sample from a mesh."""

    outline: Outline
    solid: Solid
    photo: Photo  # Top view of the mesh
    notes: Facts  # Notes on how the mesh was placed and cut


def import_sample(settings: MeshInput, folder: Path) -> ImportedSample:
    """Read and level the mesh, find the crack in its face, and trace it in a top view.

    Coordinates are in mm. z = 0 is the face, and the origin is the face's lower left corner. Raises InputError if the
    file cannot be read, is not a solid block, or does not show exactly one crack.
    """
    path = folder / settings.file
    try:
        return _imported(settings, path)
    except ShapeError as fault:
        raise ShapeError(fault.wrong, fault.remedy, path) from None


def _imported(settings: MeshInput, path: Path) -> ImportedSample:
    mesh = read_mesh(path)
    triangles = len(mesh.faces)
    vertices_mm, faces, repairs = one_surface(upright_mm(mesh, settings), mesh.faces)
    # Each step takes hundreds of megabytes for two million triangles.
    del mesh
    body, left_out = closed_body(vertices_mm, faces)
    plane = find_face(vertices_mm, faces)
    block = cut_block(body.transform(plane.to_level[:3]), plane.below_mm)
    placed = block.placed @ plane.to_level
    cavity = find_cavity(block, plane.below_mm)
    photo = photograph(block, cavity, path, settings.units)
    outline = outline_of(line_of_mouth(cavity.mouth, block.face_mm), cavity.mouth, photo, "mesh")
    origin = MeshOrigin(
        file=path.name,
        triangles_read=triangles,
        sample_from_file=tuple(map(tuple, (placed @ upright(settings)).tolist())),
        face_tilt_deg=plane.tilt_deg,
        face_roughness_mm=plane.roughness_mm,
        mouth_seen_below_face_mm=plane.below_mm,
    )
    solid = _solid(block, cavity, outline, settings.dam_height_mm, origin, (*repairs, *left_out))
    return ImportedSample(outline, solid, photo, _notes_on_place(plane, block, placed))


def upright(settings: MeshInput) -> Floats:
    """Return the transform, (4, 4), from the file's numbers to mm with the face upward."""
    placed = np.eye(4)
    turn = Rotation.from_euler("xy", UPRIGHT_DEG[settings.up], degrees=True).as_matrix()
    placed[:3, :3] = MM[settings.units] * np.rint(turn)
    return placed


def upright_mm(read: Triangles, settings: MeshInput) -> Floats:
    """Return the vertices in mm with the face upward, (v, 3).

    Raises ShapeError if the size is implausible for a sample, or if the coordinates are stored too coarsely.
    """
    mm, single = MM[settings.units], read.vertices.astype(np.float32)
    places_mm = trimesh.transform_points(read.vertices, upright(settings))
    size_mm = np.ptp(places_mm, axis=0)
    if not MIN_MM <= size_mm.max() <= MAX_MM:
        fitting = [unit for unit in MM if MIN_MM <= size_mm.max() / mm * MM[unit] <= MAX_MM]
        x, y, z = size_mm
        raise ShapeError(
            f"Bounding box {x:.4g} x {y:.4g} x {z:.4g} mm, with units = {settings.units}, is implausible for a sample "
            f"(the longest side should be {MIN_MM:g} to {MAX_MM:g} mm).",
            f"The unit of the file is probably {' or '.join(fitting)}: set units."
            if fitting
            else "Crop the mesh to the sample.",
        )
    step_mm = mm * float(np.spacing(np.abs(single).max()))
    if step_mm > MAX_STEP_MM and np.array_equal(single, read.vertices):
        raise ShapeError(
            f"Its numbers have steps of {step_mm:.2g} mm, because the mesh is far from its origin.",
            "Move the mesh to the origin in the program that made it, and save it again.",
        )
    return places_mm


def _notes_on_place(plane: FacePlane, block: Block, placed: Floats) -> Facts:
    x, y, z = placed[:3, 3]
    turned = "" if abs(block.yaw_deg) < MIN_TURN_DEG else f"turned by {-block.yaw_deg:.2f} degrees and "
    plane_text = (
        f"the face is plane within {plane.roughness_mm:.3f} mm (RMS) and was tilted by {plane.tilt_deg:.2f} degrees"
    )
    block_text = (
        f"the block is {block.size_mm[0]:.2f} x {block.size_mm[1]:.2f} mm. It was {turned}moved by ({x:.2f}, {y:.2f}, "
        f"{z:.2f}) mm"
    )
    notes = [Fact("mesh.face", plane_text, plane.roughness_mm, "mm"), Fact("mesh.moved", block_text)]
    _, _, bottom_mm, _, _, top_mm = block.body.bounding_box()
    height_mm = top_mm - bottom_mm
    if height_mm > min(block.size_mm):
        text = (
            f"one side of the block, {max(block.size_mm):.0f} x {height_mm:.0f} mm, is larger than its face. If the "
            "crack opens on that side, check mesh.up, the axis that points out of the cracked face"
        )
        notes.append(doubt("mesh.larger-side", text, height_mm, "mm"))
    if block.trimmed_mm > 0:
        text = (
            f"material up to {block.trimmed_mm:.2f} mm outside the block's sides, such as dams, edges or roughness, "
            "was cut off"
        )
        notes.append(doubt("mesh.trimmed", text, block.trimmed_mm, "mm"))
    return tuple(notes)


def _solid(
    block: Block, cavity: Cavity, outline: Outline, dam_height_mm: float, origin: MeshOrigin, repairs: Facts
) -> Solid:
    """Return the solid: the block, with a dam wherever the crack opens through a side.

    Dams end ``dam_height_mm`` above the face. Raises ShapeError if the solid is not closed or crosses itself.
    """
    plates, body = _plates(block, cavity), block.body
    bottom_mm = float(body.bounding_box()[2])
    for plate in plates:
        body += prism(box_region(plate), bottom_mm, dam_height_mm)
    vertices_mm, faces = tidy(body)
    faults, figures = examine_mesh(vertices_mm, faces)
    if figures is None or figures.self_intersections:
        raise ShapeError(f"{faults[-1]} Positions are in mm from the face's lower left corner.", MEND)
    return Solid(
        vertices_mm=vertices_mm,
        faces=faces,
        face_label=label_imported(vertices_mm, faces, block.face_mm, cavity.below_mm),
        block_mm=block.face_mm,
        depth_mm=cavity.depth_mm,
        tilt="modelled",
        wall_angles_deg=(0.0, 0.0),
        cavity_volume_mm3=cavity.volume_mm3,
        sections=cavity_sections(cavity.body, outline),
        figures=SolidFigures(
            mesh=origin,
            mouth_width_mm=outline.mean_width_mm,
            watertight=True,
            **vars(figures),
            dams=tuple(dam_box(plate, bottom_mm, dam_height_mm) for plate in plates),
            warnings=(*repairs, *(doubt("mesh.fault", fault) for fault in faults)),
        ),
    )


def label_imported(vertices_mm: Floats, faces: Integers, block_mm: Box, below_mm: float) -> Integers:
    """Return a ``FaceLabel`` for each face of the mesh, (f,).

    Faces of the mesh in the block's sides or its face get the labels of these. The other faces form connected patches.
    The lowest patch is the underside. Patches within ``below_mm`` of the block's face are roughness of that face.
    """
    corners = vertices_mm[faces]
    normal = normals(corners)
    flat = normal[:, 2] > STEEPEST * lengths(normal)
    label = np.where(flat, FaceLabel.FLOOR, FaceLabel.WALL).astype(np.int64)
    top = flat & (np.abs(corners[:, :, 2]) <= below_mm).all(axis=1)
    outside = depth_inside(corners.mean(axis=1)[:, :2], block_mm) < -NEAR_MM
    rest = ~(top | outside | label_sides(label, corners, block_mm))
    beside = trimesh.graph.face_adjacency(faces)
    patch = trimesh.graph.connected_component_labels(beside[rest[beside].all(axis=1)], len(faces))
    lowest_mm = np.asarray(minimum(corners[:, :, 2].min(axis=1), patch, patch))
    label[top | rest & (lowest_mm >= -below_mm)] = FaceLabel.TOP
    label[outside | rest & (lowest_mm <= vertices_mm[:, 2].min() + NEAR_MM)] = FaceLabel.OUTSIDE
    return label


def _plates(block: Block, cavity: Cavity) -> list[Box]:
    """Return the box of a dam for each side of the block at which the cavity is open."""
    vertices_mm, faces = arrays_of(cavity.body)
    corners_mm, boxes = vertices_mm[faces][:, :, :2], []
    for side, level_mm in enumerate(block.face_mm):
        in_side = (np.abs(corners_mm[:, :, side % 2] - level_mm) < NEAR_MM).all(axis=1)
        if in_side.any():
            boxes.append(plate_over(corners_mm[in_side].reshape(-1, 2), side, block.face_mm))
    return boxes
