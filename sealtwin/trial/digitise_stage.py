"""First stage: make walls, a solid and a nozzle path from a photo or a mesh."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from digitise.drawing.given import DrawingInput
from digitise.settings import LARGEST_FILE_BYTES, CrackShape
from sealtwin.core import files, record_files
from sealtwin.core.arrays import Pixels
from sealtwin.core.errors import InputError, ShapeError, present
from sealtwin.core.facts import doubt
from sealtwin.core.records import Outline, Solid
from sealtwin.core.run_folder import stage_key
from sealtwin.core.settings import doubts_of
from sealtwin.trial.job import (
    DIGITISED,
    OF_A_PATH,
    OVERLAY,
    STRAIGHT,
    Job,
    begin_writing,
    display_path,
    sample_files,
    stage_settings,
)
from sealtwin.trial.trial_file import Trial

if TYPE_CHECKING:
    from digitise.photo import Photo

NO_SEALANT = doubt(
    "nozzle.no-sealant",
    "volume_ml is not given, and a path without walls has no cavity volume, so the path has no flow and no robot "
    "program can be written",
)
REFUSED = "refused.png"  # Picture of what was found in a photo that was refused. The next attempt deletes it


def bring_up_to_date(job: Job) -> bool:
    """Run the stage unless its files are up to date. Returns True if it ran.

    Raises the same errors as ``_digitise``.
    """
    (job.path / REFUSED).unlink(missing_ok=True)
    inputs = _hashes_of_sample(job.trial, job.source)
    settings = stage_settings(job.trial, "digitise")
    numbers = job.numbers("digitise")
    key = stage_key(inputs, settings, numbers)
    # A file that is missing or too large has no hash. Such a file is refused when it is read.
    if len(inputs) == len(sample_files(job.trial)) and job.folder.is_current("digitise", key):
        return False
    crack = stage_key(inputs, {**settings, "path": None}, numbers)
    began = time.monotonic()

    from digitise.trajectory import plan_trajectory, with_path
    from digitise.walls.overlay import draw_overlay, straight_view

    if crack not in job.traced:
        job.progress.start("Digitising", 4)
        job.traced.clear()
        job.traced[crack] = _digitise(job)
        job.progress.advance(4)
    outline, solid, photo = job.traced[crack]
    if solid is None:
        trajectory = plan_trajectory(outline, job.trial.path)
        doubts = (*doubts_of(job.trial.path), *([] if trajectory.dispensed_mm3 else [NO_SEALANT]))
        outline = replace(outline, warnings=(*outline.warnings, *doubts))
    else:
        trajectory = plan_trajectory(outline, job.trial.path, solid.cavity_volume_mm3, solid.sections)
        solid = with_path(solid, trajectory, outline, job.trial.path)
    begin_writing(job, "digitise")
    files.write_png(job.path / OVERLAY, draw_overlay(photo, outline, trajectory))
    record_files.write_outline(job.path, outline)
    record_files.write_trajectory(job.path, trajectory)
    outputs, warnings = [OVERLAY, "trajectory.txt", *OF_A_PATH], outline.warnings
    if solid is not None:
        record_files.write_solid(job.path, solid)
        files.write_png(job.path / STRAIGHT, straight_view(photo, outline))
        outputs += [STRAIGHT, "crack.stl", "crack.glb", *(name for name in DIGITISED if name not in OF_A_PATH)]
        warnings = (*warnings, *solid.figures.warnings)
    for warning in warnings:
        job.progress.warn(warning)
    wall_time_s = time.monotonic() - began
    facts = {"from_user": list(inputs), "path_source": outline.path_source}
    job.folder.record("digitise", key, settings, inputs, outputs, wall_time_s, numbers=numbers, **facts)
    return True


def _digitise(job: Job) -> "tuple[Outline, Solid | None, Photo]":
    """Digitise the trial's photo, mesh or drawing. The solid is None for a path without walls.

    Raises InputError if no crack can be measured.
    """
    trial = job.trial
    if trial.mesh is not None:
        from digitise.mesh_import.import_mesh import import_sample

        imported = import_sample(trial.mesh, job.source)
        for note in imported.notes:
            if note.kind == "doubt":
                job.progress.warn(note)
            else:
                job.progress.note(f"{note}.")
        return imported.outline, imported.solid, imported.photo
    if trial.drawing is not None:
        return _drawn(job, trial.drawing, present(trial.crack, "crack"))
    settings, crack = present(trial.photo, "photo"), trial.crack
    from digitise.crack_path.find_path import RivalCracksError, find_path
    from digitise.outline import trace_outline
    from digitise.photo import load_photo
    from digitise.walls.overlay import draw_cracks, draw_overlay, draw_way

    photo = load_photo(settings, job.source)
    job.progress.advance(1, "finding the crack")
    try:
        path = find_path(photo, *settings.hints)
    except RivalCracksError as rivals:
        cracks, refused_px = rivals.cracks, rivals.refused_px
        with _with_picture(job, lambda: draw_cracks(photo, cracks, refused_px)):
            raise
    job.progress.advance(2, "tracing the walls")
    with _with_picture(job, lambda: draw_way(photo, path)):
        outline = trace_outline(photo, path, settings)
    if crack is None or outline.width_source == "none":
        return outline, None, photo
    job.progress.advance(3, "building the solid")
    with _with_picture(job, lambda: draw_overlay(photo, outline)):
        return _built(job, outline, crack, photo)


def _drawn(job: Job, drawing: DrawingInput, crack: CrackShape) -> "tuple[Outline, Solid, Photo]":
    """Build the solid of a drawn crack."""
    from digitise.drawing.read_dxf import drawn_crack, open_drawing

    drawn = open_drawing(job.source / drawing.file, drawing.units)
    try:
        outline, photo = drawn_crack(drawn, drawing)
        return _built(job, replace(outline, warnings=(*outline.warnings, *drawn.notes)), crack, photo)
    except ShapeError as fault:
        raise InputError(f"{drawn.file}: {fault.wrong} Correct the lines there, or check drawing.units.") from None


def _built(job: Job, outline: Outline, crack: CrackShape, photo: "Photo") -> "tuple[Outline, Solid, Photo]":
    """Build the solid of an outline, with a scanned or weighed cavity if the trial has one."""
    from digitise.solid.build_solid import build_solid, with_weighed

    if crack.scan is not None:
        from digitise.solid.scanned_shape import scanned_shape

        crack, facts = scanned_shape(outline, crack, job.source)
        outline = replace(outline, warnings=(*outline.warnings, *facts))
    if crack.fill is None:
        return outline, build_solid(outline, crack), photo
    from digitise.weighing.fit_cavity import weigh

    errors = job.trial.uncertainty
    moved, shape, weighed = weigh(outline, crack, crack.fill, errors.width_mm, errors.depth_mm)
    return moved, with_weighed(build_solid(moved, shape), weighed), photo


@contextmanager
def _with_picture(job: Job, draw: Callable[[], Pixels]) -> Iterator[None]:
    """If the block raises InputError, write a picture of what was found, and add its path to the message."""
    try:
        yield
    except InputError as fault:
        picture = job.path / REFUSED
        files.write_png(picture, draw())
        fault.args = (f"{fault} Look at {display_path(picture)}.",)
        raise


def _hashes_of_sample(trial: Trial, source: Path) -> dict[str, str]:
    """Return the hash of each file that shows the crack, by role and name. Missing and too large files are left out."""
    return {
        file.name if role == "file" else f"{role} {file.name}": files.sha256(source / file)
        for role, file in sample_files(trial).items()
        if (source / file).is_file() and (source / file).stat().st_size <= LARGEST_FILE_BYTES
    }
