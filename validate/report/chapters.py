"""Content of a report, chapter by chapter. The page has all of it, the PDF its pictures."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count, groupby
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Pixels
from sealtwin.core.run_folder import versions
from validate.figures.first_figure import FirstFigure, FirstLayout
from validate.figures.levels import (
    draw_distribution,
    draw_histogram,
    draw_uncertainty,
    draw_weighed_fill,
)
from validate.figures.snapshots import FillScene, draw_fill
from validate.figures.solid_pictures import draw_sections, draw_side_view, draw_solid, draw_top_view
from validate.figures.turntable import Turntable, build_turntable
from validate.report_input import Evidence
from validate.units import PageTable
from validate.wording import sample_and_run
from validate.wording.comparison import (
    agreement_table,
    balance_table,
    readings_table,
    stretches_off,
    uncertainty_sentences,
    uncertainty_tables,
    volume_table,
)
from validate.wording.headline import mean_of_seeds
from validate.wording.of_runs import levels_in_words, mean_sentence
from validate.wording.prediction import prediction_table


@dataclass(frozen=True)
class Plate:
    caption: str
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class PhotoBlock:
    caption: str
    alt: str
    pixels: Pixels


@dataclass(frozen=True)
class Model:
    """A model in 3-D that the page can turn; the PDF shows it from one side."""

    caption: str
    alt: str
    turntable: Turntable


@dataclass(frozen=True)
class Paragraph:
    """Sentences that are printed one below the other."""

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
    appendix: bool = False

    @property
    def rows(self) -> Iterator[tuple[Item, ...]]:
        """Rows of items from top to bottom. A row has one item, or a pair of consecutive plates or photos."""
        for half, group in groupby(self.items, lambda item: isinstance(item, Plate | PhotoBlock)):
            items, size = tuple(group), 2 if half else 1
            yield from (items[first : first + size] for first in range(0, len(items), size))


def first_figure(evidence: Evidence) -> FirstFigure:
    """Return what the first page draws. Raises InputError if the picture along the crack cannot be read."""
    return FirstFigure(
        outline=evidence.outline,
        solid=evidence.solid,
        trajectory=evidence.trajectory,
        profile=evidence.profile,
        straight=_read_picture(evidence.straight_path),
        readings=evidence.readings,
        comparison=evidence.comparison,
        prediction=evidence.prediction,
        seeds=evidence.seeds,
    )


def scale_words(shown: FirstFigure, layout: FirstLayout) -> str:
    """Return a sentence on the scale of the first figure in a layout."""
    stretch = shown.stretch(layout)
    if stretch == 1.0:
        return "Heights, widths and lengths are drawn to one scale."
    return f"Heights and widths are drawn {stretch:.2g} times as large as lengths."


def first_caption(evidence: Evidence) -> str:
    """Return a text on the bands of the first figure, and on the places in them; empty without bands."""
    if evidence.prediction is not None:
        levels = levels_in_words(evidence.seeds, "simulated level")
        return f"Grey: 19 of 20 {levels} lie in this band along the whole crack. It is no tolerance."
    mean = "" if evidence.seeds is None else mean_sentence(evidence.seeds)
    comparison = evidence.comparison
    uncertainty = None if comparison is None else comparison.uncertainty
    if uncertainty is None or uncertainty.stations is None:
        return mean
    stations = uncertainty.stations
    inside = f"{int((~stations.off).sum())} of {len(stations.s_mm)}"
    return f"{mean} ".lstrip() + (
        "Grey: the error of the readings, no tolerance; a perfect model would be inside all along in 19 of 20 repeats. "
        f"This level is inside at {inside} readings. Bars: error of one reading."
    )


def chapters(evidence: Evidence) -> list[Chapter]:
    """Return the chapters of a trial's report, with numbered figures: result, explanation, appendix.

    Raises InputError if the overlay cannot be read.
    """
    number = count(2)

    def numbered(item: Item) -> Item:
        return replace(item, caption=f"Figure {next(number)}. {item.caption}") if isinstance(item, Picture) else item

    return [
        Chapter(title, name, tuple(map(numbered, items)), appendix)
        for part, appendix in ((_answer_and_why, False), (_appendix, True))
        for title, name, items in part(evidence)
    ]


def _answer_and_why(evidence: Evidence) -> Iterator[tuple[str, str, Sequence[Item]]]:
    """Yield title, name and items of each chapter before the appendix."""
    if errors := list(_error_items(evidence)):
        yield "Error", "error", errors
    if evidence.run.has_particles:
        yield "Fill", "fill", [_model(evidence), *fill_plates(evidence)]
    yield "Photo", "answer", [_photo(evidence)]
    yield "Uncertainty", "uncertainty", [Paragraph((*mean_of_seeds(evidence), *uncertainty_sentences(evidence)))]


def _appendix(evidence: Evidence) -> Iterator[tuple[str, str, Sequence[Item]]]:
    comparison, readings = evidence.comparison, evidence.readings
    assumed = (*sample_and_run.assumptions(evidence), *sample_and_run.left_out(evidence))
    yield "Assumed and left out", "assumptions", [Paragraph(assumed)]
    volumes: list[Item] = []
    if comparison is not None and readings is not None:
        agreement = [agreement_table(comparison), readings_table(readings, comparison, evidence.sheet)]
        yield "Agreement and readings", "agreement", agreement
        volumes = [] if comparison.volumes is None else [volume_table(comparison, comparison.volumes)]
        if comparison.uncertainty is not None:
            yield "Uncertainty in figures", "budget", uncertainty_tables(comparison.uncertainty)
    yield "Mass balance", "mass-balance", [balance_table(evidence), *volumes]
    if evidence.prediction is not None:
        yield "Uncertainty in figures", "budget", [prediction_table(evidence.prediction)]
    dams = ", with the dams at its open ends" if evidence.solid.figures.dams else ""
    solid = Plate(
        f"The simulated solid as in crack.stl{dams}, and its cavity alone.",
        lambda: draw_solid(evidence.solid),
    )
    sections = Plate(
        "Across the crack, seen along the nozzle's path: the solid, cut, and the particles of a slice one diameter "
        "thick, coloured by age.",
        lambda: draw_sections(evidence.run, evidence.outline, evidence.solid),
    )
    solid_and_path = sample_and_run.geometry_table(evidence), sample_and_run.path_table(evidence)
    shown = [solid, sections] if evidence.run.has_particles else [solid]
    yield "Geometry", "geometry", [*shown, *_weighed(evidence), *solid_and_path]
    yield "Health of the run", "health", [sample_and_run.health_table(evidence)]
    again = Paragraph(
        ("This report was written from Python; to make it again, run the script that called write_report.",)
    )
    if evidence.commands:
        comment = "makes this report again, from the trial.toml in its folder and the files that the trial names."
        again = CommandLines(evidence.commands, comment)
    packages = versions().keys() - {"sealtwin"}  # In report.json
    origin = tuple((name, text) for name, text in evidence.provenance.items() if name not in packages)
    yield (
        "Provenance",
        "provenance",
        [again, PageTable("Versions and inputs", origin), sample_and_run.settings_table(evidence)],
    )


def _weighed(evidence: Evidence) -> Iterator[Item]:
    if (weighed := evidence.solid.figures.weighed) is not None:
        yield Plate(
            "Cavity by weight: levels of a liquid poured into the crack in steps, and straight walls fitted to them.",
            lambda: draw_weighed_fill(weighed),
        )


def _error_items(evidence: Evidence) -> Iterator[Item]:
    profile, readings, comparison = evidence.profile, evidence.readings, evidence.comparison
    if readings is None or comparison is None:
        return
    yield Plate(
        "Mean absolute error in each 10 mm of the crack, as in the paper's Fig. 9b.",
        lambda: draw_histogram(comparison),
    )
    yield Plate(
        "Share of the crack's length with an error up to a limit.",
        lambda: draw_distribution(profile, readings, comparison),
    )
    if (uncertainty := comparison.uncertainty) is not None:
        missing = ", without numerics or inputs" if uncertainty.mean_level.resolved is None else ""
        if sentences := stretches_off(uncertainty.stations):
            yield Paragraph(sentences)
        yield Plate(
            "Error E (simulated minus measured level) at each station, ± 2 standard uncertainties; filled markers are "
            f"outside the band of all stations. Below: the parts of the uncertainty{missing}.",
            lambda: draw_uncertainty(uncertainty.stations),
        )


def fill_plates(evidence: Evidence) -> Iterator[Plate]:
    """Yield figures of the fill: over time if the run has snapshots, and at rest."""
    outline, solid, run = evidence.outline, evidence.solid, evidence.run
    if frames := evidence.frames:
        scene = FillScene(outline, solid, evidence.trajectory, run.radius_mm, run.settings["nozzle"]["diameter_mm"])
        yield Plate(
            "Sections along the crack during the fill, coloured by speed, as in the paper's Fig. 6.",
            lambda: draw_fill(frames, scene, by=("speed",)),
        )
    yield Plate(
        f"All particles from the side{_of_first(evidence)}, coloured by age; the line is the level read from "
        f"{'them' if evidence.seeds is None else 'all runs'}.",
        lambda: draw_side_view(run, outline, solid, evidence.profile),
    )
    yield Plate(
        "The sample from above, particles coloured by height.",
        lambda: draw_top_view(run, outline, solid, evidence.trajectory),
    )


def _of_first(evidence: Evidence) -> str:
    return "" if evidence.seeds is None else f" in the run of seed {evidence.seeds.seeds[0]}"


OVERLAY_PX = 1500  # Largest width of the overlay in the report; the run folder has it in full size


def _photo(evidence: Evidence) -> PhotoBlock:
    outline, seen_in = evidence.outline, evidence.outline.seen_in
    picture = _around_crack(_read_picture(evidence.overlay_path), outline)
    scale = min(1.0, OVERLAY_PX / picture.shape[1])
    pixels = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    origin = "of undeclared origin" if evidence.photo_data == "undeclared" else evidence.photo_data
    return PhotoBlock(
        f"Traced walls and centreline over the {seen_in} ({origin}); scale: {outline.scale_source}.",
        f"The {seen_in} of the sample with the traced walls and centreline of the crack",
        np.asarray(pixels, dtype=np.uint8),
    )


def _read_picture(path: Path) -> Pixels:
    content = np.frombuffer(files.read_bytes(path) if path.is_file() else b"", np.uint8)
    picture = cv2.imdecode(content, cv2.IMREAD_COLOR_RGB) if content.size else None
    if picture is None:
        raise InputError(f"{path}: is not a readable picture. Draw it again with 'sealtwin digitise'.")
    return np.asarray(picture, dtype=np.uint8)


def _around_crack(overlay: Pixels, outline: Outline) -> Pixels:
    """Return the part of the overlay around the crack, or all of it if the photo's size was not recorded."""
    if outline.photo_size_px is None:
        return overlay
    scale = overlay.shape[1] / outline.photo_size_px[0]
    (left, top), (right, bottom) = np.maximum(outline.shown_px * scale, 0).astype(int)
    rows, columns = slice(top, bottom + 1), slice(left, right + 1)
    return overlay[rows, columns]


def _model(evidence: Evidence) -> Model:
    return Model(
        "The sealant at the end, coloured by age, without the near wall; the line is the crack's mouth.",
        "The sealant in the crack, seen from one side and from above, coloured by age",
        build_turntable(evidence.run, evidence.solid),
    )
