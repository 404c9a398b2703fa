"""Write the report of a trial as a page, a file for programs and, if wanted, a PDF, from the same facts and figures."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from sealtwin.core.files import as_uri, replacing, write_json, write_text
from validate.figures.first_figure import NARROW, WIDE
from validate.figures.page import page_environment
from validate.figures.theme import as_picture, as_svg, in_page
from validate.report.chapters import (
    Chapter,
    PhotoBlock,
    Picture,
    Plate,
    chapters,
    first_figure,
)
from validate.report.first_page import first_caption, first_page, station_rows
from validate.report.report_facts import (
    assumptions,
    cautions,
    headline,
    health_facts,
    uncertainty_facts,
    volumes,
)
from validate.result import Evidence, ReadingsFile, ReportData
from validate.sentences import sentence
from validate.settings import PDF
from validate.units import PageTable

REPORT = ("report.html", "report.json")  # Files of a report

ALT = "The straightened photo, the level of the sealant and its error along the crack, and a section across"


def write_report(folder: Path, evidence: Evidence, *, pdf: bool = False) -> list[str]:
    """Write report.html and report.json, and report.pdf if ``pdf`` is True.

    The page needs no other file and no network.

    Returns the names of the files. Raises InputError if the overlay cannot be read.
    """
    content, shown, caption = chapters(evidence), first_figure(evidence), first_caption(evidence)
    names = {
        item: f"{chapter.name}-{number}"
        for chapter in content
        for number, item in enumerate(chapter.items)
        if isinstance(item, Plate)
    }
    figures, wide = {item: item.draw() for item in names}, shown.draw(WIDE)
    drawings = {item: as_svg(figure, names[item]) for item, figure in figures.items()}
    wide_scale, narrow_scale = (sentence("first_scale", stretch=shown.stretch(layout)) for layout in (WIDE, NARROW))
    first = {
        "wide": in_page(as_svg(wide, "first-wide"), ALT),
        "narrow": in_page(as_svg(shown.draw(NARROW), "first-narrow"), ALT),
        "wide_scale": wide_scale,
        "narrow_scale": narrow_scale,
        "caption": caption,
        "table": station_rows(evidence),
    }
    items = [item for chapter in content for item in chapter.items]
    data = report_data(evidence, tuple(item for item in items if isinstance(item, PageTable)))
    write_text(folder / "report.html", _page(data, first, content, drawings))
    write_json(folder / "report.json", data.model_dump(mode="json"))
    if not pdf:
        return [*REPORT]
    from validate.report.pdf import write_pdf

    pictures = [(_picture(item, figures), item.caption) for item in items if isinstance(item, Picture)]
    with replacing(folder / PDF) as temporary:
        write_pdf(temporary, data, (as_picture(wide), f"Figure 1. {wide_scale} {caption}".rstrip()), pictures)
    return [*REPORT, PDF]


def report_data(evidence: Evidence, tables: tuple[PageTable, ...] = ()) -> ReportData:
    """Return the content of report.json. ``tables`` are the tables of the page."""
    readings, sheet = evidence.readings, evidence.sheet
    verdict, outcome = headline(evidence)
    return ReportData(
        name=evidence.name,
        note=evidence.note,
        first_page=first_page(evidence),
        headline=verdict,
        outcome=outcome,
        edited=evidence.edited,
        cautions=cautions(evidence),
        photo_data=evidence.photo_data,
        readings=sheet and readings and ReadingsFile(**dict(sheet), dialect=readings.dialect, data=readings.data),
        comparison=evidence.comparison,
        prediction=evidence.prediction,
        seeds=evidence.seeds,
        uncertainty=uncertainty_facts(evidence),
        assumptions=assumptions(evidence),
        figures=(*volumes(evidence), *health_facts(evidence)),
        provenance=evidence.provenance,
        commands=evidence.commands,
        tables=tables,
    )


def _page(
    data: ReportData, first: Mapping[str, object], content: Sequence[Chapter], drawings: Mapping[Plate, str]
) -> str:
    environment = page_environment()
    environment.filters["kind"] = lambda item: type(item).__name__
    environment.filters["photo"] = lambda item: as_uri(item.jpeg)
    environment.filters["svg"] = lambda item: in_page(drawings[item], item.caption)
    return environment.get_template("report.html.j2").render(
        data=data,
        first=first,
        chapters=content,
    )


def _picture(item: Picture, figures: Mapping[Plate, Figure]) -> Image.Image | io.BytesIO:
    # The PDF includes the JPEG as it is.
    return io.BytesIO(item.jpeg) if isinstance(item, PhotoBlock) else as_picture(figures[item])
