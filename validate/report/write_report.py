"""The report of a trial: a page, a PDF and a file for programs, from the same facts and figures."""

import base64
import hashlib
from collections.abc import Sequence
from importlib.resources import files as resources
from pathlib import Path
from typing import Literal

import cv2
import jinja2
import matplotlib
import numpy as np
from markupsafe import Markup
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from sealtwin.core.drawing.theme import AGES, MUTED, as_png, as_svg, in_page
from sealtwin.core.files import replacing, write_json, write_text
from validate.figures.solid_pictures import draw_still
from validate.report.chapters import Chapter, CommandLines, Paragraph, PhotoBlock, Picture, Plate, chapters
from validate.report.report_data import ReportData, report_data
from validate.report.typeset import WIDTH_IN, Typesetter
from validate.report_input import Evidence
from validate.units import PageTable
from validate.wording.headline import key_figures

PIXELS_DPI = 150  # Resolution of the pixels inside a figure of the page
FIGURE_DPI = 200  # Resolution of a figure of the PDF
QUALITY = 85  # Quality of photos and stills, from 0 to 100
STOPS = 9  # Number of colours between which the page blends a scale: viridis to 1 %
OUTCOME_COLOUR = {"passed": "#00704f", "failed": "#b3261e", "undecided": "#7a5c00", "open": MUTED}
"""Colours of the verdict on the page in daylight; the sentence says the same without them."""
CAUTION = "#7a5c00"
REPORT = ("report.html", "report.pdf", "report.json")  # Files of a report

KeyFigures = Sequence[tuple[str, str]]


def write_report(folder: Path, evidence: Evidence) -> None:
    """Write report.html, which needs no other file and no network, report.pdf, and report.json.

    Raises InputError where the overlay cannot be read.
    """
    content, figures = chapters(evidence), key_figures(evidence)
    tables = tuple(item for chapter in content for item in chapter.items if isinstance(item, PageTable))
    data = report_data(evidence, tables)
    write_text(folder / "report.html", _page(data, figures, content))
    with replacing(folder / "report.pdf") as temporary:
        _write_pdf(temporary, data, figures, content)
    write_json(folder / "report.json", data.model_dump(mode="json"))


def _page(data: ReportData, figures: KeyFigures, content: Sequence[Chapter]) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("validate"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    environment.filters["kind"] = lambda item: type(item).__name__
    environment.filters["photo"] = lambda item: _data_uri("jpeg", _encoded(".jpg", item.pixels[:, :, ::-1]))
    environment.filters["still"] = lambda item: _data_uri("webp", _encoded(".webp", item.still[:, :, [2, 1, 0, 3]]))
    environment.filters["svg"] = lambda item, name: in_page(as_svg(item.draw(), name, PIXELS_DPI), item.caption)
    script = resources("validate").joinpath("templates", "turntable.js").read_text(encoding="utf-8")
    stops = map(to_hex, matplotlib.colormaps[AGES](np.linspace(0, 1, STOPS)))
    return environment.get_template("report.html.j2").render(
        data=data,
        key_figures=figures,
        chapters=content,
        # The colours of ages, as CSS blends them from left to right.
        colours=f"linear-gradient(to right, {', '.join(stops)})",
        # The page's policy allows this script alone, by its hash.
        script=Markup(script),
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
    )


def _encoded(suffix: Literal[".jpg", ".webp"], picture: NDArray[np.uint8]) -> bytes:
    """Encode a picture whose colours are in OpenCV's order."""
    flag = cv2.IMWRITE_JPEG_QUALITY if suffix == ".jpg" else cv2.IMWRITE_WEBP_QUALITY
    done, content = cv2.imencode(suffix, picture, [flag, QUALITY])
    if not done:
        raise RuntimeError(f"OpenCV could not encode a picture as {suffix}")
    return content.tobytes()


def _data_uri(kind: Literal["jpeg", "webp"], content: bytes) -> str:
    return f"data:image/{kind};base64," + base64.b64encode(content).decode()


def _write_pdf(path: Path, data: ReportData, figures: KeyFigures, content: Sequence[Chapter]) -> None:
    """Write what the page shows, in its order; the same evidence gives the same bytes, without a date."""
    with Typesetter(data.name) as paper:
        paper.paragraph(data.name, size_pt=20, weight="B")
        paper.paragraph(data.note, colour=MUTED)
        for caution in data.cautions:
            paper.paragraph(caution, size_pt=10, weight="B", colour=CAUTION)
        paper.paragraph(data.verdict.sentence, size_pt=11, weight="B", colour=OUTCOME_COLOUR[data.verdict.outcome])
        for finding in data.verdict.findings:
            paper.paragraph(finding)
        paper.rows(figures)
        for chapter in content:
            pictures = [_picture(item) if isinstance(item, Picture) else b"" for item in chapter.items]
            first, below_in = chapter.items[0], 0.5
            if isinstance(first, Picture):
                below_in += paper.size_in(pictures[0])[1]
            elif isinstance(first, PageTable):
                below_in = paper.kept_in(first.rows)
            paper.chapter(chapter.title, below_in)
            for item, picture in zip(chapter.items, pictures, strict=True):
                match item:
                    case PageTable():
                        paper.titled_table(item.title, item.rows)
                    case Paragraph():
                        for sentence in item.sentences:
                            paper.paragraph(sentence)
                    case CommandLines():
                        paper.paragraph(f"{', then '.join(item.lines)}: {item.comment}")
                    case _:
                        paper.picture(picture, item.caption)
        paper.output(str(path))


def _picture(item: Picture) -> bytes:
    if isinstance(item, PhotoBlock):
        return _encoded(".jpg", item.pixels[:, :, ::-1])
    figure = item.draw() if isinstance(item, Plate) else draw_still(item.turntable.still, item.turntable.oldest_s)
    return as_png(figure, WIDTH_IN, FIGURE_DPI)
