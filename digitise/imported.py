"""A sample from a mesh that somebody has modelled or scanned: the same records as from a photo."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from digitise.modelled.block import Block, cut_block
from digitise.modelled.bodies import bounded_body
from digitise.modelled.cavity import find_cavity
from digitise.modelled.face_plane import FacePlane, find_face
from digitise.modelled.given_line import along, middle_path
from digitise.modelled.mesh_file import read_mesh
from digitise.modelled.mesh_frame import moved, notes_on_unit, upright, upright_mm
from digitise.modelled.mesh_path import read_path
from digitise.modelled.mouth import with_mouth
from digitise.modelled.openings import close_holes, find_openings, with_base
from digitise.modelled.repair import Repair, Surface, one_surface
from digitise.modelled.solid import modelled_solid
from digitise.modelled.top_view import photograph
from digitise.outline import trace_outline
from digitise.photo import Photo
from digitise.settings import MeshInput
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline, Solid

BELOW_MM = 0.05
"""Under the face, where the mouth is seen: walls at 11 degrees have moved by a hundredth of a millimetre."""
BELOW_ROUGHNESS = 4.0
"""The same in RMS of a rough face: all but 60 in a million of its points lie higher."""


@dataclass(frozen=True)
class ImportedSample:
    """What the digitise stage knows of a mesh before it plans the nozzle's path."""

    outline: Outline
    solid: Solid
    photo: Photo
    """Of the mesh, as seen from above."""
    notes: tuple[str, ...]
    """What was found out on the way, in whole sentences."""


def import_sample(settings: MeshInput, folder: Path) -> ImportedSample:
    """Read, mend and level the mesh, find the crack in its face, and trace it as a photo from above would show it.

    Coordinates are those of any sample: mm, z = 0 on the face, its lower left corner the origin.

    Raises InputError where the file cannot be read, bounds no block, or shows no one crack.
    """
    path = folder / settings.file
    read = _read_block(settings, path)
    block, plane, below_mm, notes = read.block, read.plane, read.below_mm, [*read.notes]
    placed = block.placed @ plane.to_level
    line_mm = None if settings.path is None else _given_line_mm(folder / settings.path, plane, placed)
    cavity = find_cavity(block, below_mm, line_mm)
    photo = photograph(block, cavity, path, settings.units)
    outline = with_mouth(trace_outline(replace(photo, drawn=None), middle_path(photo, line_mm)), cavity, photo)
    if line_mm is not None:
        outline, note = along(outline, photo, line_mm)
        notes.append(note)
    notes += _notes_on_place(plane, block, placed)
    report = {
        "mesh": {
            "file": path.name,
            "triangles_read": read.triangles,
            "sample_from_file": placed @ upright(settings),
            "face_tilt_deg": plane.tilt_deg,
            "face_roughness_mm": plane.roughness_mm,
            "mouth_seen_below_face_mm": below_mm,
            "repairs": [asdict(repair) for repair in read.repairs],
        },
        "warnings": [str(repair) for repair in read.repairs],
    }
    solid = modelled_solid(block, cavity, outline, settings.dam_height_mm, report)
    return ImportedSample(outline, solid, photo, tuple(notes))


@dataclass(frozen=True)
class _Read:
    """What is kept of a file: of two million triangles each step before the block takes hundreds of megabytes."""

    block: Block
    plane: FacePlane
    below_mm: float
    triangles: int
    repairs: tuple[Repair, ...]
    notes: list[str]


def _read_block(settings: MeshInput, path: Path) -> _Read:
    mesh = read_mesh(path)
    notes = notes_on_unit(mesh, settings, path)
    triangles = len(mesh.faces)
    surface = one_surface(upright_mm(mesh, settings), mesh.faces)
    del mesh
    plane = find_face(surface)
    level = replace(surface, vertices_mm=moved(surface.vertices_mm, plane.to_level))
    body, repairs = bounded_body(_closed(level, settings.base_mm))
    del surface, level
    below_mm = max(BELOW_MM, BELOW_ROUGHNESS * plane.roughness_mm)
    return _Read(cut_block(body, below_mm), plane, below_mm, triangles, repairs, notes)


def _closed(surface: Surface, base_mm: float | None) -> Surface:
    """Raises InputError where a sheet has no base to stand on, or a body is given one."""
    openings = find_openings(surface)
    surface = close_holes(surface, openings)
    is_sheet = openings.wide is not None and not openings.is_underside
    if not is_sheet and base_mm is not None:
        sides = "is closed below" if openings.wide is None else "has sides down to a flat underside, which is closed"
        raise InputError(f"base_mm is {base_mm:g}, but the mesh {sides}. Leave base_mm out.")
    if openings.wide is None or not is_sheet:
        return surface
    if base_mm is None:
        raise InputError(
            "Mesh encloses no volume; it is a sheet. Give base_mm, the depth of a flat underside below the face, to "
            "make it solid."
        )
    return with_base(surface, openings.wide, base_mm)


def _given_line_mm(path: Path, plane: FacePlane, placed: Floats) -> Floats:
    """In the sample's frame, (n, 2)."""
    line_mm = read_path(path)
    return moved(np.column_stack([line_mm, plane.height_mm(line_mm)]), placed)[:, :2]


def _notes_on_place(plane: FacePlane, block: Block, placed: Floats) -> list[str]:
    notes = [
        f"the face is plane within {plane.roughness_mm:.3f} mm (RMS) and was tilted by {plane.tilt_deg:.2f} degrees",
        f"the block is {block.size_mm[0]:.2f} x {block.size_mm[1]:.2f} mm; the mesh was moved by "
        f"({placed[0, 3]:.2f}, {placed[1, 3]:.2f}, {placed[2, 3]:.2f}) mm",
    ]
    if block.yaw_deg:
        notes.append(f"the block was turned by {-block.yaw_deg:.2f} degrees, so that its sides lie along x and y")
    low_mm, high_mm = np.reshape(block.body.bounding_box(), (2, 3))
    longer_mm, height_mm = max(block.size_mm), high_mm[2] - low_mm[2]
    if height_mm > min(block.size_mm):
        notes.append(
            f"the block has a larger side than its face, one of {longer_mm:.0f} x {height_mm:.0f} mm: if the crack "
            "opens there, check up, the axis that points out of the cracked face"
        )
    if block.trimmed_mm > 0:
        notes.append(f"up to {block.trimmed_mm:.2f} mm beside the block's sides were cut off: dams, edges, roughness")
    return notes
