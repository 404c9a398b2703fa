"""Content of a report from its first chapter to its last, which the page and the PDF set each in its own way."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import count

import cv2
import numpy as np
from matplotlib.figure import FigureBase

from sealtwin.core.drawing.snapshots import FillScene, draw_fill
from sealtwin.core.errors import InputError
from sealtwin.core.records import Pixels
from validate.figures.levels import draw_error, draw_histogram, draw_profile, draw_uncertainty
from validate.figures.solid_pictures import draw_sections, draw_side_view, draw_solid, draw_top_view
from validate.figures.turntable import Turntable, build_turntable
from validate.report_input import Evidence
from validate.units import PageTable
from validate.wording import sample_and_run
from validate.wording.comparison import (
    agreement_table,
    balance_table,
    readings_table,
    uncertainty_sentences,
    uncertainty_tables,
    volume_table,
)


@dataclass(frozen=True)
class Plate:
    caption: str
    draw: Callable[[], FigureBase]


@dataclass(frozen=True)
class PhotoBlock:
    caption: str
    alt: str
    pixels: Pixels


@dataclass(frozen=True)
class Model:
    """A model that the page can turn and the PDF shows from one side."""

    caption: str
    alt: str
    turntable: Turntable


@dataclass(frozen=True)
class Paragraph:
    """Sentences, one below the other."""

    sentences: tuple[str, ...]


@dataclass(frozen=True)
class CommandLines:
    """Commands that can be copied as they are."""

    lines: tuple[str, ...]
    comment: str


Picture = PhotoBlock | Model | Plate
Item = Picture | PageTable | Paragraph | CommandLines


@dataclass(frozen=True)
class Chapter:
    title: str
    name: str  # Name in links within the page
    items: tuple[Item, ...]


def chapters(evidence: Evidence) -> list[Chapter]:
    """Collect the chapters of a trial's report, its figures numbered.

    Raises InputError where the overlay cannot be read.
    """
    number = count(1)

    def numbered(item: Item) -> Item:
        if isinstance(item, Plate):
            # Drawn once for the page and the PDF.
            item = replace(item, draw=cache(item.draw))
        return replace(item, caption=f"Figure {next(number)}. {item.caption}") if isinstance(item, Picture) else item

    return [Chapter(title, name, tuple(map(numbered, items))) for title, name, items in _chapters(evidence)]


def _chapters(evidence: Evidence) -> Iterator[tuple[str, str, list[Item]]]:
    comparison, readings = evidence.comparison, evidence.readings
    compared, held = [], []
    if comparison is not None and readings is not None:
        compared = [agreement_table(comparison), readings_table(readings, comparison, evidence.sheet)]
        held = [] if comparison.volumes is None else [volume_table(comparison.metrics, comparison.volumes)]
    again = Paragraph(("Written from Python: the script that called write_report makes it again, and no command.",))
    if evidence.commands:
        comment = "this report again, from the trial.toml beside it with the files that it names beside that."
        again = CommandLines(evidence.commands, comment)
    versions = PageTable("Versions and inputs", tuple(evidence.provenance.items()))
    yield evidence.outline.seen_in.capitalize(), "photo", [_photo(evidence)]
    yield "Fill", "fill", [_model(evidence), *fill_plates(evidence)]
    yield "Level", "level", [*_level_plates(evidence), *compared]
    yield "Uncertainty", "uncertainty", _uncertainty(evidence)
    yield "Mass balance", "mass-balance", [balance_table(evidence), *held]
    yield "Health of the run", "health", [sample_and_run.health_table(evidence)]
    yield "Assumptions", "assumptions", [Paragraph(tuple(sample_and_run.assumptions(evidence)))]
    yield "Left out", "left-out", [Paragraph(tuple(sample_and_run.left_out(evidence)))]
    solid_and_path = sample_and_run.geometry_table(evidence), sample_and_run.path_table(evidence)
    dams = ", with the dams at its open ends" if evidence.solid.figures.dams else ""
    solid = Plate(
        f"The solid that was simulated, as it is in crack.stl{dams}, and its cavity alone.",
        lambda: draw_solid(evidence.solid),
    )
    yield "Geometry", "geometry", [solid, *solid_and_path]
    yield "Provenance", "provenance", [again, versions, sample_and_run.settings_table(evidence)]


def _level_plates(evidence: Evidence) -> Iterator[Plate]:
    profile, readings, comparison = evidence.profile, evidence.readings, evidence.comparison
    against = "" if readings is None else ", with the caliper's means, their common 95 % band and single readings"
    yield Plate(
        f"Simulated level along the crack{against}.",
        lambda: draw_profile(profile, evidence.solid.sections, readings, comparison),
    )
    if readings is None or comparison is None:
        return
    yield Plate(
        "Signed error along the crack. A perfect model lies in the band at all stations in 95 of 100 sheets.",
        lambda: draw_error(profile, readings, comparison),
    )
    yield Plate(
        "Mean absolute error in each 10 mm of the crack's length, exact integrals, as in the paper's Fig. 9b.",
        lambda: draw_histogram(comparison),
    )


def fill_plates(evidence: Evidence) -> Iterator[Plate]:
    """Yield figures of the fill over time where the run left snapshots, and at rest."""
    outline, solid, run = evidence.outline, evidence.solid, evidence.run
    if evidence.frames:
        scene = FillScene(outline, solid, evidence.trajectory, run.radius_mm, run.settings["nozzle"]["diameter_mm"])
        yield Plate(
            "Sections along the crack as it is filled, particles coloured by speed on the left and by age on the "
            "right, as in the paper's Fig. 6. The particles nearest to the centreline lie on top.",
            lambda: draw_fill(evidence.frames, scene),
        )
    yield Plate(
        "Every particle at its place along the crack, coloured by age; the line is the profile read from them.",
        lambda: draw_side_view(run, outline, solid, evidence.profile),
    )
    yield Plate(
        "The sample from above, particles coloured by height.",
        lambda: draw_top_view(run, outline, solid, evidence.trajectory),
    )
    yield Plate(
        "Across the crack, seen along the nozzle's path: the solid, cut, and the particles of a slice one diameter "
        "thick, coloured by age.",
        lambda: draw_sections(run, outline, solid),
    )


def _uncertainty(evidence: Evidence) -> list[Item]:
    """Sentences, figure and tables of the uncertainty; one line where it was not assessed."""
    found = None if evidence.comparison is None else evidence.comparison.uncertainty
    if found is None:
        radius = f"{evidence.run.radius_mm:g} mm radius"
        return [Paragraph((f"Not examined: this is one run, with particles of {radius}, held against no interval.",))]
    known = "u_val is here what is known so far, without" if found.mean_level.resolved is None else "u_val holds"
    plate = Plate(
        "Simulated less measured level E at each station, with twice the standard uncertainty u_val. Filled where E "
        f"leaves the band that holds at all stations together. Below, its parts; {known} numerics and inputs.",
        lambda: draw_uncertainty(found.stations),
    )
    return [Paragraph(tuple(uncertainty_sentences(found))), plate, *uncertainty_tables(found)]


OVERLAY_PX = 1500  # Width of the overlay in the report, at most; the full one is beside it


def _photo(evidence: Evidence) -> PhotoBlock:
    path, outline, seen_in = evidence.overlay_path, evidence.outline, evidence.outline.seen_in
    content = np.frombuffer(path.read_bytes() if path.is_file() else b"", np.uint8)
    picture = cv2.imdecode(content, cv2.IMREAD_COLOR_RGB) if content.size else None
    if picture is None:
        raise InputError(f"{path}: no readable picture. Run 'sealtwin digitise' again, which draws the overlay.")
    scale = min(1.0, OVERLAY_PX / picture.shape[1])
    pixels = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    origin = "of undeclared origin" if evidence.photo_data == "undeclared" else evidence.photo_data
    return PhotoBlock(
        f"The walls and the centreline that were found, over the {seen_in}. {seen_in.capitalize()}: {origin}. "
        f"Scale: {outline.scale_source}.",
        f"The {seen_in} of the sample with the crack's walls and centreline that were found",
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
