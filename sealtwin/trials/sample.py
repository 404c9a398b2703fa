"""The sample of a trial: its crack, its solid and a picture to check them by, from a photo or from a mesh."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sealtwin.errors import InputError
from sealtwin.records import Outline, Pixels, Solid
from sealtwin.store import files
from sealtwin.trials.job import Job
from sealtwin.trials.result import shown

if TYPE_CHECKING:
    from digitise.photo import Photo

REFUSED = "refused.png"
"""What was found in a photo until it was refused; gone as soon as another attempt begins."""


@dataclass(frozen=True)
class Sample:
    """What the digitise stage knows before it plans the nozzle's path."""

    outline: Outline
    solid: Solid
    photo: "Photo"
    """What the crack was found in, to draw on."""


def digitise_sample(job: Job) -> Sample:
    """Raises InputError where photo or mesh do not show a crack that can be measured."""
    return _from_photo(job) if job.trial.mesh is None else _from_mesh(job)


def _from_photo(job: Job) -> Sample:
    from digitise.outline import trace_outline
    from digitise.path import find_path
    from digitise.photo import load_photo
    from digitise.solid import build_solid
    from digitise.walls.overlay import draw_overlay, draw_way

    settings, crack = job.trial.photo, job.trial.crack
    assert settings is not None, "a trial has a photo or a mesh"
    assert crack is not None, "a trial with a photo has a crack's shape"
    photo = load_photo(settings, job.source)
    job.progress.advance(1, "finding the crack")
    path = find_path(photo, settings.ends_px, settings.via_px, settings.roi_px)
    job.progress.advance(2, "tracing its walls")
    with _seen(job, lambda: draw_way(photo, path)):
        outline = trace_outline(photo, path, settings.edge_fraction, keep_branches=settings.branches == "keep")
    job.progress.advance(3, "building the solid")
    with _seen(job, lambda: draw_overlay(photo, outline)):
        return Sample(outline, build_solid(outline, crack), photo)


def _from_mesh(job: Job) -> Sample:
    from digitise.imported import import_sample

    assert job.trial.mesh is not None, "a trial has a photo or a mesh"
    imported = import_sample(job.trial.mesh, job.source)
    for note in imported.notes:
        job.progress.note(f"note: {note}")
    return Sample(imported.outline, imported.solid, imported.photo)


@contextmanager
def _seen(job: Job, draw: Callable[[], Pixels]) -> Iterator[None]:
    """Let a refusal show what it is about: a sentence in px and mm says little to whoever has the photo in front."""
    try:
        yield
    except InputError as fault:
        picture = job.path / REFUSED
        files.write_png(picture, draw())
        raise InputError(f"{fault} Look at {shown(picture)}.") from None
