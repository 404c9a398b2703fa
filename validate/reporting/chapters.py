"""A report from its first chapter to its last: what the page and the PDF set down, each in its own way."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import Pixels
from validate.drawing.error_sources import CAPTION as UNCERTAINTY_CAPTION
from validate.drawing.error_sources import HEIGHT_IN as UNCERTAINTY_IN
from validate.drawing.error_sources import draw_uncertainty
from validate.drawing.turntable import Turntable, build_turntable
from validate.evidence import Evidence
from validate.reporting.plates import Plate, fill_plates, level_plates, solid_plate
from validate.statements.agreement import agreement_table, readings_table
from validate.statements.assumptions import assumptions, left_out
from validate.statements.health import health_table
from validate.statements.nozzle_path import path_table
from validate.statements.origin import photo_caption, provenance_table, settings_table
from validate.statements.sample import geometry_table
from validate.statements.sealant import balance_table
from validate.statements.table import Table
from validate.statements.uncertainty import uncertainty_sentences, uncertainty_tables, volume_rows

OVERLAY_PX = 1500
"""Widest overlay in the report; the full one lies beside it."""


@dataclass(frozen=True)
class Photo:
    """A picture as the camera has it."""

    caption: str
    alt: str
    pixels: Pixels


@dataclass(frozen=True)
class Model:
    """What a page can turn, and paper shows from one side."""

    caption: str
    alt: str
    turntable: Turntable


@dataclass(frozen=True)
class Words:
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Command:
    """To be typed again as they stand, one after the other."""

    lines: tuple[str, ...]
    comment: str


Item = Photo | Model | Plate | Table | Words | Command


@dataclass(frozen=True)
class Chapter:
    title: str
    name: str
    """In links within the page."""
    items: tuple[Item, ...]


def chapters(evidence: Evidence) -> list[Chapter]:
    """What the trial has; what it has not is left out, or said in one line.

    Raises InputError where the overlay cannot be read.
    """
    number = 0
    numbered = []
    for chapter in _chapters(evidence):
        items: list[Item] = []
        for item in chapter.items:
            if isinstance(item, Photo | Model | Plate):
                number += 1
                item = replace(item, caption=f"Figure {number}. {item.caption}")
            items.append(item)
        numbered.append(replace(chapter, items=tuple(items)))
    return numbered


def _chapters(evidence: Evidence) -> Iterator[Chapter]:
    seen_in = evidence.outline.seen_in
    yield _chapter(seen_in.capitalize(), "photo", [_photo(evidence)])
    yield _chapter("Fill", "fill", [_model(evidence), *fill_plates(evidence)])
    compared = [] if evidence.comparison is None else [agreement_table(evidence), readings_table(evidence)]
    yield _chapter("Level", "level", [*level_plates(evidence), *compared])
    yield _chapter("Uncertainty", "uncertainty", _uncertainty(evidence))
    against = [] if evidence.comparison is None else volume_rows(evidence.comparison.metrics)
    held = [Table("As volumes of settled sealant, beside the readings", tuple(against))] if against else []
    yield _chapter("Mass balance", "mass-balance", [balance_table(evidence), *held])
    yield _chapter("Health of the run", "health", [health_table(evidence)])
    yield _chapter("Assumptions", "assumptions", [Words(tuple(assumptions(evidence)))])
    yield _chapter("Left out", "left-out", [Words(tuple(left_out(evidence)))])
    geometry = [solid_plate(evidence), geometry_table(evidence), path_table(evidence)]
    yield _chapter("Geometry", "geometry", geometry)
    again = Command(
        evidence.commands,
        "this report again, from the trial.toml beside it with the files that it names beside that.",
    )
    yield _chapter("Provenance", "provenance", [again, provenance_table(evidence), settings_table(evidence)])


def _chapter(title: str, name: str, items: Iterable[Item]) -> Chapter:
    return Chapter(title, name, tuple(items))


def _uncertainty(evidence: Evidence) -> Iterator[Item]:
    """What the comparison allows one to say; where nothing was assessed, that in one line."""
    comparison = evidence.comparison
    if comparison is None or not (sentences := uncertainty_sentences(comparison.metrics)):
        yield Words(
            (
                "Not examined: this is one run, with particles of "
                f"{evidence.run.radius_mm:g} mm radius, held against no interval.",
            )
        )
        return
    yield Words(tuple(sentences))
    yield Plate(UNCERTAINTY_CAPTION, UNCERTAINTY_IN, lambda on: draw_uncertainty(comparison, on))
    yield from uncertainty_tables(comparison.metrics)


def _photo(evidence: Evidence) -> Photo:
    path = evidence.overlay_path
    content = np.frombuffer(path.read_bytes() if path.is_file() else b"", np.uint8)
    picture = cv2.imdecode(content, cv2.IMREAD_COLOR_RGB) if content.size else None
    if picture is None:
        raise InputError(f"{path}: no readable picture. Run 'sealtwin digitise' again, which draws the overlay.")
    scale = min(1.0, OVERLAY_PX / picture.shape[1])
    pixels = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return Photo(
        photo_caption(evidence),
        f"The {evidence.outline.seen_in} of the sample with the crack's walls and centreline that were found",
        np.asarray(pixels, dtype=np.uint8),
    )


def _model(evidence: Evidence) -> Model:
    return Model(
        "The sealant at rest between the walls of the crack, coloured by its age; the line is the crack's mouth. The "
        "surface lies where half of the space is sealant; single particles, and the wall nearest to you, are not "
        "drawn.",
        "The sealant in the crack, seen from one side and from above, coloured by age",
        build_turntable(evidence.run, evidence.solid),
    )
