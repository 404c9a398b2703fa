"""Write the report of a trial as a page, a PDF and a file for programs, from the same facts and figures."""

import base64
import hashlib
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from importlib.resources import files as resources
from pathlib import Path
from typing import Literal, Self

import matplotlib
import numpy as np
from fpdf import FPDF
from fpdf.enums import MethodReturnValue
from fpdf.fonts import FontFace, TTFFont
from markupsafe import Markup
from matplotlib.colors import to_hex
from numpy.typing import NDArray
from PIL import Image

from sealtwin.core.files import replacing, write_json, write_text
from validate.figures.drawing import DrawnFigure, as_picture, as_svg, draw_both
from validate.figures.figure_sheet import page_environment
from validate.figures.first_figure import NARROW, WIDE, FirstFigure
from validate.figures.solid_pictures import draw_still
from validate.figures.theme import AGES, GRID, INK, MUTED, SIMULATED, in_page, printable
from validate.report.chapters import (
    Chapter,
    CommandLines,
    Model,
    Paragraph,
    PhotoBlock,
    Picture,
    Plate,
    chapters,
    first_caption,
    first_figure,
    scale_words,
)
from validate.report.report_data import ReportData, report_data
from validate.report_input import Evidence
from validate.units import PageTable
from validate.wording.first_page import Tile, station_rows

DPI = 200  # Resolution of the pixels inside a figure of the page, and of a figure of the PDF
QUALITY = 85  # Quality of photos and stills, from 0 to 100
STOPS = 9  # Number of colours between which the page interpolates a colour scale; viridis is then exact to 1 %
OUTCOME_COLOUR = {"passed": "#00704f", "failed": "#b3261e", "undecided": "#7a5c00", "open": MUTED}
"""Colours of the verdict on the light page; the sentence has the same meaning without them."""
CAUTION = "#7a5c00"
REPORT = ("report.html", "report.pdf", "report.json")  # Files of a report

ALT = "The straightened photo, the level of the sealant and its error along the crack, and a section across"
StationRows = Sequence[tuple[str, Sequence[str]]]
FONT = "DejaVu Sans"
Weight = Literal["", "B"]


@dataclass(frozen=True)
class PdfLayout:
    """Sizes on an A4 page of the PDF, in inches and points. They were chosen by eye; larger ones make more pages.

    They change no text and no figure. A report has at most six pages before its appendix.
    """

    margin_in: float = 0.7
    text_pt: float = 8.5
    caption_pt: float = 8.0
    foot_pt: float = 7.5
    line_in: float = 0.165
    """Distance between two lines of text."""
    foot_in: float = 0.5
    """Distance of the page's number from the lower edge."""
    folio_in: float = 0.6
    """Width of the page's number."""
    label_in: float = 2.9
    """Width of a table's first column."""
    label_gap_in: float = 0.15
    """Space to the right of a label."""
    cell_gap_in: float = 0.0165
    """Space above and below the text of a cell."""
    lines_together: int = 10
    """Longest paragraph that is not split between pages, in lines."""
    lines_in_row: int = 50
    """Largest number of lines in a row of a table: fpdf2 refuses a row that is higher than a page."""
    gutter_in: float = 0.2
    """Space between two pictures side by side."""
    station_pt: float = 6.5
    station_in: float = 0.36
    """Width of a station in the table of the first page."""
    station_label_in: float = 0.95
    picture_share: float = 0.6
    """Largest height of a picture, as a share of the page's height."""


PDF = PdfLayout()


def write_report(folder: Path, evidence: Evidence) -> None:
    """Write report.html, which needs no other file and no network, report.pdf, and report.json.

    Raises InputError if the overlay cannot be read.
    """
    content, first = chapters(evidence), _first_of(evidence)
    drawings = {
        item: draw_both(item.draw(), f"{chapter.name}-{number}", DPI)
        for chapter in content
        for number, item in enumerate(chapter.items)
        if isinstance(item, Plate)
    }
    tables = tuple(item for chapter in content for item in chapter.items if isinstance(item, PageTable))
    data = report_data(evidence, tables)
    write_text(folder / "report.html", _page(evidence, data, first, content, drawings))
    with replacing(folder / "report.pdf") as temporary:
        _write_pdf(temporary, data, first, content, drawings)
    write_json(folder / "report.json", data.model_dump(mode="json"))


@dataclass(frozen=True)
class First:
    """The first page's figure for both widths of the page, and the stations that it shows."""

    shown: FirstFigure
    wide_scale: str
    narrow_scale: str
    caption: str
    table: StationRows

    @cached_property
    def drawing(self) -> DrawnFigure:
        """The figure of a wide page, which the PDF has too."""
        return draw_both(self.shown.draw(WIDE), "first-wide", DPI)

    @property
    def wide(self) -> Markup:
        return in_page(self.drawing.svg, ALT)

    @property
    def narrow(self) -> Markup:
        return in_page(as_svg(self.shown.draw(NARROW), "first-narrow", DPI), ALT)


def _first_of(evidence: Evidence) -> First:
    shown = first_figure(evidence)
    wide, narrow = scale_words(shown, WIDE), scale_words(shown, NARROW)
    return First(shown, wide, narrow, first_caption(evidence), station_rows(evidence))


def _page(
    evidence: Evidence,
    data: ReportData,
    first: First,
    content: Sequence[Chapter],
    drawings: Mapping[Plate, DrawnFigure],
) -> str:
    environment = page_environment()
    environment.filters["kind"] = lambda item: type(item).__name__
    environment.filters["photo"] = lambda item: _data_uri("jpeg", item.pixels)
    environment.filters["still"] = lambda item: _data_uri("webp", item.still)
    environment.filters["svg"] = lambda item: in_page(drawings[item].svg, item.caption)
    turns = any(isinstance(item, Model) for chapter in content for item in chapter.items)
    script = resources("validate").joinpath("templates", "turntable.js").read_text(encoding="utf-8") if turns else ""
    stops = map(to_hex, matplotlib.colormaps[AGES](np.linspace(0, 1, STOPS)))
    return environment.get_template("report.html.j2").render(
        data=data,
        first=first,
        chapters=content,
        # The colour scale of ages for CSS, from left to right.
        colours=f"linear-gradient(to right, {', '.join(stops)})",
        script=Markup(script),
        # The page's policy allows only this script, by its hash.
        digest=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
    )


def _encoded(kind: Literal["jpeg", "webp"], pixels: NDArray[np.uint8]) -> io.BytesIO:
    target = io.BytesIO()
    Image.fromarray(pixels).save(target, kind, quality=QUALITY)
    return target


def _data_uri(kind: Literal["jpeg", "webp"], pixels: NDArray[np.uint8]) -> str:
    return f"data:image/{kind};base64," + base64.b64encode(_encoded(kind, pixels).getvalue()).decode()


def _write_pdf(
    path: Path, data: ReportData, first: First, content: Sequence[Chapter], drawings: Mapping[Plate, DrawnFigure]
) -> None:
    """Write the content of the page as PDF. It has no date, so that the same evidence gives the same bytes."""
    with Typesetter(data.name) as paper:
        page = data.first_page
        paper.paragraph(f"{data.name} · {page.subject}", colour=MUTED)
        paper.paragraph(page.state, size_pt=10, weight="B", colour=OUTCOME_COLOUR[data.tone])
        paper.paragraph(page.verdict, size_pt=15, weight="B")
        paper.paragraph(" ".join(page.lead), size_pt=10)
        for word, text in page.labels:
            paper.paragraph(f"{word} {text}", colour=MUTED)
        paper.pictures([(first.drawing.pixels, f"Figure 1. {first.wide_scale} {first.caption}".rstrip())])
        paper.tiles(page.tiles)
        for word, text in page.notes:
            paper.paragraph(f"{word} {text}", colour=MUTED)
        if first.table:
            paper.stations(first.table)
        paper.add_page()
        for caution in data.faults[1:]:
            paper.paragraph(caution, size_pt=10, weight="B", colour=CAUTION)
        for before, chapter in zip([None, *content], content, strict=False):
            if before is not None and chapter.appendix and not before.appendix:
                paper.add_page()
                paper.chapter("Appendix", 0.0)
            _write_chapter(paper, chapter, drawings)
        paper.output(str(path))


def _write_chapter(paper: "Typesetter", chapter: Chapter, drawings: Mapping[Plate, DrawnFigure]) -> None:
    for number, row in enumerate(chapter.rows):
        pictures = [(_picture(item, drawings), item.caption) for item in row if isinstance(item, Picture)]
        first = row[0]
        if number == 0:
            paper.chapter(chapter.title, paper.pictures_in(pictures) if pictures else 6 * PDF.line_in)
        match first:
            case PageTable():
                paper.table_of(first.rows, first.title)
            case Paragraph():
                for sentence in first.sentences:
                    paper.paragraph(sentence)
            case CommandLines():
                paper.paragraph(f"{', then '.join(first.lines)}: {first.comment}")
            case _:
                paper.pictures(pictures)


def _picture(item: Picture, drawings: Mapping[Plate, DrawnFigure]) -> Image.Image | io.BytesIO:
    if isinstance(item, PhotoBlock):
        # The PDF includes the JPEG as it is.
        return _encoded("jpeg", item.pixels)
    if isinstance(item, Plate):
        return drawings[item].pixels
    return as_picture(draw_still(item.turntable.still, item.turntable.oldest_s), DPI)


class Typesetter(FPDF):
    """A4 pages, filled from top to bottom; fpdf2 breaks lines, tables and pages."""

    def __init__(self, title: str) -> None:
        """Begin the first page; ``title`` is printed at the foot of each page, before its number."""
        super().__init__(unit="in", format="A4")
        fonts = Path(matplotlib.get_data_path(), "fonts", "ttf")
        self.add_font(FONT, "", fonts / "DejaVuSans.ttf")
        self.add_font(FONT, "B", fonts / "DejaVuSans-Bold.ttf")
        self.set_margin(PDF.margin_in)
        self.set_auto_page_break(True, PDF.margin_in)
        self.set_line_width(0.5 / 72)
        self.set_draw_color(GRID)
        self.c_margin = 0.0
        self.str_alias_nb_pages = "{number of pages}"
        # A fixed date, so that the same report has the same bytes on every day.
        self.set_creation_date(datetime(1970, 1, 1, tzinfo=UTC))
        self._title = printable(title)
        self.set_title(self._title)
        self.set_creator("sealtwin")
        self._style(PDF.text_pt)
        self.add_page()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *fault: object) -> None:
        """Close the files of the fonts, which fpdf2 leaves open."""
        for font in self.fonts.values():
            if isinstance(font, TTFFont):
                font.ttfont.close()

    def footer(self) -> None:
        """Set the running title and the page's number; fpdf2 calls it at the end of each page."""
        self.set_y(-PDF.foot_in)
        self._style(PDF.foot_pt, colour=MUTED)
        width_in = self.epw - PDF.folio_in
        self.cell(width_in, PDF.line_in, self.lines(self._title, width_in - PDF.line_in)[0])
        self.cell(PDF.folio_in, PDF.line_in, f"{self.page_no()} of {self.str_alias_nb_pages}")

    def chapter(self, title: str, below_in: float) -> None:
        """Set a title on a page that has at least ``below_in`` inches of room below it."""
        self._keep(4 * PDF.line_in + below_in)
        self.ln(PDF.line_in)
        self._style(14, "B")
        self.cell(0, 2 * PDF.line_in, printable(title), new_x="LMARGIN", new_y="NEXT")

    def paragraph(self, text: str, size_pt: float = PDF.text_pt, weight: Weight = "", colour: str = INK) -> None:
        """Set a paragraph, on one page unless it is longer than ten lines."""
        self._style(size_pt, weight, colour)
        line_in = PDF.line_in * size_pt / PDF.text_pt
        self._keep(line_in * min(len(self.lines(text, self.epw)), PDF.lines_together))
        self._flow(text, self.epw, line_in)
        self.ln(0.5 * PDF.line_in)

    def table_of(self, rows: Sequence[tuple[str, str]], title: str = "") -> None:
        """Set a table of labels and values under a title that is repeated on each page."""
        self.ln(PDF.line_in if title else 0)
        self._style(PDF.text_pt)
        value_in, label_style = self.epw - PDF.label_in, FontFace(color=MUTED)
        with self.table(
            borders_layout="HORIZONTAL_LINES",
            col_widths=(PDF.label_in, value_in),
            first_row_as_headings=bool(title),
            headings_style=FontFace(emphasis="BOLD", color=SIMULATED, size_pt=11),
            line_height=PDF.line_in,
            padding=(PDF.cell_gap_in, 0.0),
            text_align="LEFT",
            v_align="TOP",
        ) as table:
            if title:
                table.row().cell(printable(title), colspan=2)
            for label, value in rows:
                lines = self.lines(value, value_in)
                for begin in range(0, max(len(lines), 1), PDF.lines_in_row):
                    row = table.row()
                    row.cell(
                        "" if begin else printable(label),
                        style=label_style,
                        padding=(PDF.cell_gap_in, PDF.label_gap_in, PDF.cell_gap_in, 0.0),
                    )
                    row.cell("\n".join(lines[begin : begin + PDF.lines_in_row]))

    def tiles(self, tiles: Sequence[Tile]) -> None:
        """Set figures side by side: title, figure, text, and the lines of its small chart as text."""
        top_in, low_in = self.y, self.y
        column_in = (self.epw - (len(tiles) - 1) * PDF.gutter_in) / len(tiles)
        self.line(self.l_margin, top_in, self.l_margin + self.epw, top_in)
        for number, tile in enumerate(tiles):
            left_in = self.l_margin + number * (column_in + PDF.gutter_in)
            self.set_xy(left_in, top_in + 0.3 * PDF.line_in)
            lines: list[tuple[str, float, Weight, str]] = [
                (tile.title, PDF.caption_pt, "B", MUTED),
                (tile.figure, 15.0, "B", INK),
                (tile.text, PDF.caption_pt, "", INK),
                *(
                    (f"{bar.error_mm:.2f} mm {bar.name}", PDF.caption_pt, "B" if bar.own else "", MUTED)
                    for bar in tile.bars
                ),
            ]
            for text, size_pt, weight, colour in lines:
                self._style(size_pt, weight, colour)
                self.set_x(left_in)
                line_in = PDF.line_in * max(size_pt / PDF.text_pt, 1.0)
                self.multi_cell(column_in, line_in, printable(text), align="L", new_x="LMARGIN", new_y="NEXT")
            low_in = max(low_in, self.y)
        self.set_y(low_in + 0.5 * PDF.line_in)

    def stations(self, rows: StationRows) -> None:
        """Set the stations side by side, a figure in each row; those that do not fit on the page are left out."""
        self._style(PDF.station_pt)
        label_in = PDF.station_label_in
        most = int((self.epw - label_in) / PDF.station_in)
        for begin in range(0, len(rows[0][1]), most):
            if self.will_page_break(PDF.line_in * (len(rows) + 1)):
                break
            for label, values in rows:
                self.cell(label_in, PDF.line_in, label)
                for value in values[begin : begin + most]:
                    self.cell(PDF.station_in, PDF.line_in, value, align="R")
                self.ln(PDF.line_in)
            self.ln(0.5 * PDF.line_in)

    def pictures(self, pictures: Sequence[tuple[Image.Image | io.BytesIO, str]]) -> None:
        """Set one picture with its caption across the page, or two side by side. A picture is an image or a JPEG."""
        self._keep(self.pictures_in(pictures))
        top_in, low_in = self.y, self.y
        column_in = self._column_in(pictures)
        for number, (content, caption) in enumerate(pictures):
            left_in = self.l_margin + number * (column_in + PDF.gutter_in)
            height_in = self._height_in(content, column_in)
            self.image(content, left_in, top_in, column_in, height_in, keep_aspect_ratio=True)
            self.set_xy(left_in, top_in + height_in + 0.3 * PDF.line_in)
            self._style(PDF.caption_pt, colour=MUTED)
            self._flow(caption, column_in, PDF.line_in)
            low_in = max(low_in, self.y)
        self.set_y(low_in + PDF.line_in)

    def pictures_in(self, pictures: Sequence[tuple[Image.Image | io.BytesIO, str]]) -> float:
        """Return the height in inches of pictures side by side with their captions."""
        self._style(PDF.caption_pt)
        column_in = self._column_in(pictures)
        return max(
            self._height_in(content, column_in) + PDF.line_in * (len(self.lines(caption, column_in)) + 0.3)
            for content, caption in pictures
        )

    def _column_in(self, pictures: Sequence[object]) -> float:
        return (self.epw - (len(pictures) - 1) * PDF.gutter_in) / len(pictures)

    def _height_in(self, content: Image.Image | io.BytesIO, column_in: float) -> float:
        """Return the height in inches of a picture in a column."""
        width_px, height_px = (content if isinstance(content, Image.Image) else Image.open(content)).size
        return min(column_in * height_px / width_px, PDF.picture_share * self.h)

    def _style(self, size_pt: float, weight: Weight = "", colour: str = INK) -> None:
        self.set_font(FONT, weight, size_pt)
        self.set_text_color(colour)

    def _keep(self, height_in: float) -> None:
        """Begin a new page if ``height_in`` does not fit."""
        if self.will_page_break(height_in):
            self.add_page()

    def _flow(self, text: str, width_in: float, line_in: float) -> None:
        self.multi_cell(width_in, line_in, printable(text), align="L", new_x="LMARGIN", new_y="NEXT")

    def lines(self, text: str, width_in: float) -> list[str]:
        """Return a text's lines in the current style, broken at blanks or inside words that are wider than a line."""
        text = printable(text)
        # Most texts are one line, and fpdf2 sums a line's width letter by letter.
        if text.isprintable() and self.get_string_width(text) <= width_in:
            return [text]
        lines = self.multi_cell(width_in, text=text, align="L", dry_run=True, output=MethodReturnValue.LINES)
        return list(map(str, lines)) if isinstance(lines, list) else []
