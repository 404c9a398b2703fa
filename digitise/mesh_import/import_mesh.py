"""Import of a modelled or scanned sample, with the same records as from a photo."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np
from manifold3d import Manifold

from digitise.geometry.mesh_topology import connected, examine_mesh, neighbours, normals
from digitise.geometry.polyline import Box, depth_inside
from digitise.geometry.region import box_region, prism
from digitise.mesh_import.block import SEARCH, Block, FacePlane, cut_block, find_face
from digitise.mesh_import.cavity import (
    Cavity,
    along,
    find_cavity,
    in_mouth,
    outline_of,
    photograph,
    read_path,
)
from digitise.mesh_import.cavity_sections import cavity_sections
from digitise.mesh_import.mouth_line import line_of_mouth
from digitise.mesh_import.repair import bounded_body, closed, one_surface
from digitise.photo import Photo
from digitise.settings import MeshInput, MeshUnit
from digitise.solid.dams import DAM_OVERLAP_MM, NEAR_MM, dam_box, label_sides, plate_over
from digitise.solid.float_mesh import corners_mm, tidy
from sealtwin.core.errors import InputError, ShapeError
from sealtwin.core.mesh_file import FileUnit, Triangles, read_mesh
from sealtwin.core.records import FaceLabel, Floats, Integers, Outline, Solid
from sealtwin.core.solid_figures import MeshOrigin, SolidFigures

MM: dict[FileUnit, float] = {"micron": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "foot": 304.8}
UPRIGHT = {  # Rotations, by rows, that turn the axis out of the face to z
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
    "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
}
LEAST_MM, MOST_MM = 10.0, 1000.0  # Limits of a sample's longest side; beyond them the unit is wrong
MOST_LISTED = 4  # Most bodies that a sentence lists
NOTED_STEP_MM = 0.01  # Step of a file's numbers that gives a note: a tenth of a fine photo's pixel
MOST_OF_WIDTH = 0.25  # Largest step of a file's numbers in widths of the crack: each wall is off by up to half of it
CLEAR_MM = 0.01  # Least distance of a dam's edge from the block's vertices: nearer, the mesh would fold


def upright(settings: MeshInput) -> Floats:
    """Return the transform (4, 4) from the file's numbers to mm with the face's normal upward."""
    placed = np.eye(4)
    placed[:3, :3] = MM[settings.units] * np.array(UPRIGHT[settings.up], dtype=float)
    return placed


def moved(points_mm: Floats, placed: Floats) -> Floats:
    """Map points (n, 3) through a (4, 4) transform. If it has no rotation, only the translation rounds the points."""
    turn, step = placed[:3, :3], placed[:3, 3]
    return (points_mm if np.array_equal(turn, np.eye(3)) else points_mm @ turn.T) + step


def upright_mm(read: Triangles, settings: MeshInput) -> Floats:
    """Return the vertices (v, 3) in mm. Raises InputError if their extent is implausible for a sample."""
    places_mm = moved(read.vertices, upright(settings))
    size_mm = np.ptp(places_mm, axis=0)
    if LEAST_MM <= size_mm.max() <= MOST_MM:
        return places_mm
    extent = float(size_mm.max()) / MM[settings.units]
    fitting = [unit for unit in get_args(MeshUnit) if LEAST_MM <= extent * MM[unit] <= MOST_MM]
    remedy = (
        f"The file is probably in {' or '.join(fitting)}: set units." if fitting else "Crop the mesh to the sample."
    )
    x, y, z = size_mm
    raise ShapeError(
        f"Bounding box {x:.4g} x {y:.4g} x {z:.4g} mm, with units = {settings.units}, is implausible for a sample "
        f"(expected {LEAST_MM:g} to {MOST_MM:g}).",
        remedy,
        "size",
    )


def notes_on_unit(read: Triangles, settings: MeshInput, path: Path) -> list[str]:
    """Return a note on an unusual unit. Raises InputError if the file states another unit."""
    if read.unit in (None, settings.units):
        return []
    if path.suffix.lower() == ".glb":
        # Many programs write millimetres anyway, so this proves nothing.
        return [f"{path.name}: glTF is in metres; its numbers are read in {settings.units}, because units is set to it"]
    raise InputError(f"{path}: its unit is {read.unit}, but units is {settings.units}. Set units to {read.unit}.")


@dataclass(frozen=True)
class ImportedSample:
    """The outline, solid and top view of a mesh."""

    outline: Outline
    solid: Solid
    photo: Photo  # Top view of the mesh
    notes: tuple[str, ...]  # Notes of the import, one sentence each


def import_sample(settings: MeshInput, folder: Path) -> ImportedSample:
    """Read, repair and level the mesh, find the crack in its face, and trace it in a top view.

    Coordinates are mm. z = 0 is the face, and the origin is its lower left corner. Raises InputError if the file cannot
    be read, encloses no block, or does not show exactly one crack.
    """
    path, facts = folder / settings.file, list[str]()
    try:
        return _imported(settings, folder, path, facts)
    except ShapeError as fault:
        raise ShapeError(" ".join([fault.wrong, *facts]), fault.remedy, fault.kind, path) from None
    except InputError as fault:
        files = [path, *([] if settings.path is None else [folder / settings.path])]
        named = "" if any(str(file) in str(fault) for file in files) else f"{path}: "
        raise InputError(" ".join([f"{named}{fault}", *facts])) from None


def _imported(settings: MeshInput, folder: Path, path: Path, facts: list[str]) -> ImportedSample:
    """Import a mesh; sentences that may explain a refusal are added to ``facts``."""
    block, plane, origin, step_mm, notes = _read_block(settings, path, facts)
    placed, line_mm = block.placed @ plane.to_level, None
    if settings.path is not None:
        given_mm = read_path(folder / settings.path)
        line_mm = moved(np.column_stack([given_mm, plane.height_mm(given_mm)]), placed)[:, :2]
    cavity = find_cavity(block, plane.below_mm, line_mm)
    photo = photograph(block, cavity, path, settings.units)
    between_mm = None if line_mm is None else in_mouth(photo, line_mm)[[0, -1]]
    line = line_of_mouth(cavity.mouth, block.face_mm, between_mm)
    outline = outline_of(line, cavity, photo)
    if step_mm > MOST_OF_WIDTH * outline.mean_width_mm:
        raise ShapeError(
            f"The crack is about {outline.mean_width_mm:.2g} mm wide: the steps of the file's numbers are too coarse "
            "for it."
        )
    if line_mm is not None:
        outline, note = along(outline, photo, line_mm)
        notes.append(note)
    notes += _notes_on_place(plane, block, placed)
    solid = _solid(block, cavity, outline, settings.dam_height_mm, origin)
    return ImportedSample(outline, solid, photo, tuple(notes))


def _read_block(
    settings: MeshInput, path: Path, facts: list[str]
) -> tuple[Block, FacePlane, MeshOrigin, float, list[str]]:
    """Return block, face, the block's origin, the step of the file's numbers in mm, and notes."""
    mesh = read_mesh(path)
    triangles, notes = len(mesh.faces), notes_on_unit(mesh, settings, path)
    step_mm = MM[settings.units] * _step_of(mesh.vertices)
    if step_mm > NOTED_STEP_MM:
        notes.append(f"{path.name} is in single precision: {_step_in_words(step_mm)}")
        facts.append(f"In single precision, {_step_in_words(step_mm)}.")
    surface = one_surface(upright_mm(mesh, settings), mesh.faces)
    # Each step takes hundreds of megabytes for two million triangles.
    del mesh
    plane = find_face(surface)
    surface = replace(surface, vertices_mm=moved(surface.vertices_mm, plane.to_level))
    body, repairs = bounded_body(closed(surface, settings.base_mm))
    del surface
    if len(bodies := body.decompose()) > 1:
        listed = _listed(bodies, np.linalg.inv(plane.to_level @ upright(settings)).astype(float))
        notes.append(f"{path.name}: {listed}")
        facts.append(f"The mesh has {listed}. If one of them is the sample, save only that body.")
    block = cut_block(body, plane.below_mm)
    origin = MeshOrigin(
        file=path.name,
        triangles_read=triangles,
        sample_from_file=tuple(map(tuple, (block.placed @ plane.to_level @ upright(settings)).tolist())),
        face_tilt_deg=plane.tilt_deg,
        face_roughness_mm=plane.roughness_mm,
        mouth_seen_below_face_mm=plane.below_mm,
        repairs=repairs,
    )
    return block, plane, origin, step_mm, notes


def _step_of(vertices: Floats) -> float:
    """Return the step between float32 numbers at the farthest vertex; 0 if the vertices have more digits."""
    single = vertices.astype(np.float32)
    if not np.array_equal(single, vertices):
        return 0.0
    step = float(np.spacing(np.abs(single).max()))
    # Whole numbers below its largest are exact in either precision.
    return 0.0 if step < 1 and np.array_equal(np.rint(vertices), vertices) else step


def _step_in_words(step_mm: float) -> str:
    """Describe the step of a mesh's numbers and its remedy."""
    return (
        f"its numbers have steps of {step_mm:.2g} mm, because the mesh is far from its origin. Move the mesh to the "
        "origin in the program that made it, and save the mesh again"
    )


def _listed(bodies: Sequence[Manifold], to_file: Floats) -> str:
    """List separate bodies in words, the largest first."""
    boxes = [np.reshape(body.bounding_box(), (2, 3)) for body in sorted(bodies, key=lambda body: -body.volume())]
    each = [
        "{:.4g} x {:.4g} x {:.4g} mm".format(*(high - low))
        + " around ({:.4g}, {:.4g}, {:.4g})".format(*(to_file @ np.append((low + high) / 2, 1.0))[:3])
        for low, high in boxes[:MOST_LISTED]
    ]
    more = f" and {len(boxes) - MOST_LISTED} more" if len(boxes) > MOST_LISTED else ""
    return f"{len(boxes)} separate bodies: {', '.join(each)}{more}, in coordinates of the file"


def _notes_on_place(plane: FacePlane, block: Block, placed: Floats) -> list[str]:
    notes = [
        f"the face is plane within {plane.roughness_mm:.3f} mm (RMS) and was tilted by {plane.tilt_deg:.2f} degrees",
        f"the block is {block.size_mm[0]:.2f} x {block.size_mm[1]:.2f} mm; it was moved by "
        f"({placed[0, 3]:.2f}, {placed[1, 3]:.2f}, {placed[2, 3]:.2f}) mm",
    ]
    if block.yaw_deg:
        notes.append(f"the block was turned by {-block.yaw_deg:.2f} degrees, so that its sides are along x and y")
    low_mm, high_mm = np.reshape(block.body.bounding_box(), (2, 3))
    longer_mm, height_mm = max(block.size_mm), high_mm[2] - low_mm[2]
    if height_mm > min(block.size_mm):
        notes.append(
            f"one side of the block, {longer_mm:.0f} x {height_mm:.0f} mm, is larger than its face: if the crack "
            "opens there, check mesh.up, the axis that points out of the cracked face"
        )
    if block.trimmed_mm > 0:
        notes.append(
            f"material up to {block.trimmed_mm:.2f} mm outside the block's sides, such as dams, edges or roughness, "
            "was cut off"
        )
    return notes


def label_imported(vertices_mm: Floats, faces: Integers, block_mm: Box, below_mm: float) -> Integers:
    """Return a ``FaceLabel`` for each face of the mesh, (f,), by the planes of the block's sides and of its face.

    The remaining faces form patches. The lowest patch is the underside, and patches within ``below_mm`` of the block's
    face are its grain.
    """
    corners = vertices_mm[faces]
    normal = normals(corners)
    flat = normal[:, 2] > np.cos(np.radians(SEARCH.steepest_deg)) * np.linalg.norm(normal, axis=1)
    label = np.where(flat, FaceLabel.FLOOR, FaceLabel.WALL).astype(np.int64)
    labelled = flat & (np.abs(corners[:, :, 2]) <= below_mm).all(axis=1)
    label[labelled] = FaceLabel.TOP
    labelled |= label_sides(label, corners, block_mm)
    beyond = depth_inside(corners.mean(axis=1)[:, :2], block_mm) < -NEAR_MM
    label[beyond] = FaceLabel.OUTSIDE
    labelled |= beyond
    one, other, _ = neighbours(faces)
    both = ~labelled[one] & ~labelled[other]
    _, patch = connected(len(faces), one[both], other[both])
    lowest_mm = np.full(patch.max() + 1, np.inf)
    np.minimum.at(lowest_mm, patch, corners[:, :, 2].min(axis=1))
    label[~labelled & (lowest_mm[patch] >= -below_mm)] = FaceLabel.TOP
    label[~labelled & (lowest_mm[patch] <= lowest_mm.min() + NEAR_MM)] = FaceLabel.OUTSIDE
    return label


def _solid(block: Block, cavity: Cavity, outline: Outline, dam_height_mm: float, origin: MeshOrigin) -> Solid:
    """Return the block with a dam where the crack opens through a side; dams end ``dam_height_mm`` above the face."""
    plates = _plates(block, cavity)
    bottom_mm = float(block.body.bounding_box()[2])
    body = block.body
    for plate in plates:
        body += prism(box_region(plate), bottom_mm, dam_height_mm)
    vertices_mm, faces = tidy(body)
    faults, figures = examine_mesh(vertices_mm, faces)
    if figures is None:
        raise InputError(f"{faults[0]} Simplify the mesh in the program that made it.")
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
            warnings=(*map(str, origin.repairs), *faults),
        ),
    )


def _plates(block: Block, cavity: Cavity) -> list[Box]:
    """Return the box of a dam over each opening of the cavity in one of the block's sides."""
    hollow_mm, body_mm = corners_mm(cavity.body), corners_mm(block.body)
    boxes = []
    for side in range(4):
        across, along = side % 2, 1 - side % 2
        level_mm = block.face_mm[side]
        in_side = (np.abs(hollow_mm[:, :, across] - level_mm) < NEAR_MM).all(axis=1)
        taken_mm = body_mm[np.abs(body_mm[:, :, across] - level_mm) < NEAR_MM][:, along]
        for low_mm, high_mm in _spans(hollow_mm[in_side, :, along]):
            ends_mm = np.zeros((2, 2))
            ends_mm[:, along] = _clear(low_mm, -DAM_OVERLAP_MM, taken_mm), _clear(high_mm, DAM_OVERLAP_MM, taken_mm)
            boxes.append(plate_over(ends_mm, side, block.face_mm))
    return boxes


def _clear(end_mm: float, overlap_mm: float, taken_mm: Floats) -> float:
    """Move the end of an opening outward until the dam over it does not end near a vertex of the side."""
    step_mm = 2 * CLEAR_MM * float(np.sign(overlap_mm))
    while np.abs(taken_mm - end_mm - overlap_mm).min() < CLEAR_MM:
        end_mm += step_mm
    return end_mm


def _spans(along_mm: Floats) -> list[tuple[float, float]]:
    """Return the spans that triangles cover along a side.

    ``along_mm`` is the position of each triangle's corners, (n, 3). Close spans are joined.
    """
    spans: list[tuple[float, float]] = []
    for begin, *_, end in sorted(np.sort(along_mm, axis=1).tolist()):
        if spans and begin <= spans[-1][1] + 2 * DAM_OVERLAP_MM:
            begin, end = spans[-1][0], max(spans.pop()[1], end)
        spans.append((begin, end))
    return spans
