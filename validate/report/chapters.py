"""Content of a report, chapter by chapter: figures, tables and text.

The page shows all chapters, the PDF only their pictures. The words are in templates/report_words.j2. A figure is a
``Plate`` with a caption in that file.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count, groupby
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sealtwin.core import files
from sealtwin.core.arc_length import arc_length
from sealtwin.core.facts import texts
from sealtwin.core.run_figures import RunHealth
from sealtwin.core.run_folder import versions
from validate.figures.first_figure import FirstFigure
from validate.figures.levels import draw_histogram, draw_uncertainty, draw_weighed_fill
from validate.figures.snapshots import FillScene, draw_fill
from validate.figures.solid_pictures import draw_sections, draw_side_view, draw_top_view
from validate.intervals import ErrorUncertainty
from validate.report.report_facts import (
    HEALTH_LABELS,
    assumptions,
    stretches_off,
    tilt_words,
    uncertainty_facts,
    volumes,
)
from validate.result import Evidence
from validate.sentences import sentence, table
from validate.uncertainty.budget import UNDECLARED_MM
from validate.units import PageTable, setting_words, words


@dataclass(frozen=True)
class Plate:
    caption: str
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class PhotoBlock:
    caption: str
    alt: str
    jpeg: bytes


@dataclass(frozen=True)
class Paragraph:
    """Sentences that are printed one below the other."""

    sentences: tuple[str, ...]


@dataclass(frozen=True)
class CommandLines:
    """Commands that can be copied unchanged."""

    lines: tuple[str, ...]
    comment: str


Picture = PhotoBlock | Plate
Item = Picture | PageTable | Paragraph | CommandLines


@dataclass(frozen=True)
class Chapter:
    title: str
    name: str  # Name in links within the page
    items: tuple[Item, ...]
    appendix: bool

    @property
    def rows(self) -> Iterator[tuple[Item, ...]]:
        """Rows of items, from top to bottom. A row has one item, or two consecutive plates or photos."""
        for half, group in groupby(self.items, lambda item: isinstance(item, Plate | PhotoBlock)):
            items, size = tuple(group), 2 if half else 1
            yield from (items[first : first + size] for first in range(0, len(items), size))


def first_figure(evidence: Evidence) -> FirstFigure:
    """Return the content of the figure on the first page.

    Raises InputError if the picture along the crack cannot be read.
    """
    return FirstFigure(
        outline=evidence.outline,
        solid=evidence.solid,
        trajectory=evidence.trajectory,
        profile=evidence.profile,
        straight=np.asarray(files.read_picture(evidence.straight_path)),
        readings=evidence.readings,
        comparison=evidence.comparison,
        prediction=evidence.prediction,
        seeds=evidence.seeds,
    )


def chapters(evidence: Evidence) -> list[Chapter]:
    """Return the chapters of a trial's report, with numbered figures: result, explanation and appendix.

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
        yield "Fill", "fill", [*fill_plates(evidence)]
    yield "Photo", "answer", [_photo(evidence)]
    yield "Uncertainty", "uncertainty", [Paragraph(texts(uncertainty_facts(evidence)))]


def _appendix(evidence: Evidence) -> Iterator[tuple[str, str, Sequence[Item]]]:
    comparison, prediction = evidence.comparison, evidence.prediction
    yield "Assumed and left out", "assumptions", [Paragraph(texts(assumptions(evidence)))]
    if comparison is not None:
        yield "Agreement and readings", "agreement", list(comparison_tables(evidence))
        if comparison.uncertainty is not None:
            yield "Uncertainty in figures", "budget", uncertainty_tables(comparison.uncertainty)
    balance = [table("table_places", e=evidence, places=volumes(evidence))]
    if comparison is not None and comparison.volumes is not None:
        balance.append(table("table_volumes", m=comparison))
    yield "Mass balance", "mass-balance", balance
    if prediction is not None:
        yield "Uncertainty in figures", "budget", [table("table_prediction", p=prediction)]
    shown: list[Item] = []
    if evidence.run.has_particles:
        parts = evidence.run, evidence.outline, evidence.solid
        shown.append(Plate(sentence("figure_sections"), lambda: draw_sections(*parts)))
    if (weighed := evidence.solid.figures.weighed) is not None:
        shown.append(Plate(sentence("figure_weighed"), lambda: draw_weighed_fill(weighed)))
    geometry = table("table_geometry", e=evidence, tilt=tilt_words(evidence))
    yield "Geometry", "geometry", [*shown, geometry, path_table(evidence)]
    yield "Health of the run", "health", [health_table(evidence.run.health)]
    again = Paragraph((sentence("again_by_script"),))
    if evidence.commands:
        again = CommandLines(evidence.commands, sentence("again_by_command"))
    packages = versions().keys() - {"sealtwin"}  # In report.json
    origin = {name: text for name, text in evidence.provenance.items() if name not in packages}
    of_settings = settings_table(evidence.run.settings)
    yield "Provenance", "provenance", [again, table("table_origin", origin=origin), of_settings]


def _error_items(evidence: Evidence) -> Iterator[Item]:
    comparison = evidence.comparison
    if comparison is None:
        return
    yield Plate(sentence("figure_histogram"), lambda: draw_histogram(comparison))
    if (uncertainty := comparison.uncertainty) is not None:
        yield Plate(sentence("figure_stations", m=comparison), lambda: draw_uncertainty(uncertainty.stations))
        if text := stretches_off(uncertainty.stations):
            yield Paragraph((text,))


def fill_plates(evidence: Evidence) -> Iterator[Plate]:
    """Yield two figures of the fill: along the crack and from above.

    The one along the crack shows the fill over time if the run has snapshots, and the sealant at rest otherwise.
    """
    outline, solid, run = evidence.outline, evidence.solid, evidence.run
    if evidence.frames:
        yield Plate(sentence("figure_fill"), lambda: draw_fill(evidence.frames, scene_of(evidence)))
    else:
        yield Plate(sentence("figure_side", e=evidence), lambda: draw_side_view(run, outline, solid, evidence.profile))
    yield Plate(sentence("figure_above"), lambda: draw_top_view(run, outline, solid, evidence.trajectory))


def scene_of(evidence: Evidence) -> FillScene:
    run, parts = evidence.run, (evidence.outline, evidence.solid, evidence.trajectory)
    return FillScene(*parts, run.radius_mm, run.settings["nozzle"]["diameter_mm"])


OVERLAY_PX = 1500  # Largest side of the overlay in the report. The run folder has it in full size.


def _photo(evidence: Evidence) -> PhotoBlock:
    return PhotoBlock(
        sentence("figure_photo", e=evidence),
        f"The {evidence.outline.seen_in} of the sample with the traced walls and centreline of the crack",
        files.as_jpeg(files.read_picture(evidence.overlay_path, OVERLAY_PX)),
    )


SHOWN_HEALTH = (
    *("density_error_p95", "density_error_max", "moving_most", "viscosity_iterations_mean", "finer"),
    *("particles_across", "viscosity_m2_s", "viscosity_pa_s", "viscosity_added_m2_s", "reynolds", "bond", "bingham"),
    *("flat_mm", "to_rest_mm", "setup_s", "frames_s"),
)
"""Figures of a run's health that the page shows. report.json contains all of them."""


def comparison_tables(evidence: Evidence) -> Iterator[PageTable]:
    """Yield two tables: the measures of the error, and the readings with their file, format and scatter."""
    parts = {"m": evidence.comparison, "readings": evidence.readings, "sheet": evidence.sheet}
    yield table("table_agreement", **parts)
    yield table("table_readings", **parts)


def uncertainty_tables(uncertainty: ErrorUncertainty) -> list[PageTable]:
    """Return the tables of the intervals, the error budget, the alignment, the particle size and the inputs."""
    names = "intervals", "budget", "missing", "alignment", "sizes", "inputs"
    tables = (table(f"table_{name}", u=uncertainty, undeclared_mm=UNDECLARED_MM) for name in names)
    return [table for table in tables if table.rows]


def path_table(evidence: Evidence) -> PageTable:
    trajectory = evidence.trajectory
    giving = trajectory.giving
    begins_mm, ends_mm = trajectory.s_mm[giving][[0, -1]]
    leads = trajectory.position_mm[: giving.start + 1], trajectory.position_mm[giving.stop - 1 :]
    before_mm, after_mm = (arc_length(points)[-1] for points in leads)
    return table(
        "table_path",
        e=evidence,
        begins_mm=begins_mm,
        ends_mm=ends_mm,
        before_mm=before_mm,
        after_mm=after_mm,
        speed_mm_s=trajectory.speed_mm_s[:-1],
        flow_mm3_s=trajectory.flow_mm3_s[giving.start : giving.stop - 1],
        height_mm=trajectory.position_mm[:, 2].mean(),
    )


def health_table(health: RunHealth) -> PageTable:
    """Return the table of the health figures that the page shows and the run recorded, in the run's order."""
    figures = []
    for key, value in health.recorded().items():
        if key in SHOWN_HEALTH and value is not None:
            label, factor, shape = HEALTH_LABELS[key]
            figures.append((label, shape.format(factor * value)))
    return table("table_health", health=health, figures=figures)


def settings_table(settings: dict[str, Any]) -> PageTable:
    """Return the table of settings in effect, with a row for each group. The seed is in the table of versions."""
    groups = {
        group: [
            f"{words(key)} {setting_words(value)}" for key, value in content.items() if value not in (None, {}, [], ())
        ]
        for group, content in settings.items()
        if isinstance(content, dict)
    }
    return table("table_settings", groups=groups)
