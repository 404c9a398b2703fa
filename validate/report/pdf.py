"""The report as a PDF of at most four pages: the facts of the first page, and all pictures with their captions.

There are two pages of text and two pages of pictures with six pictures each. A report has at most ten pictures.
Pages say if text was left out.
"""

import io
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

import matplotlib
from fpdf import FPDF
from fpdf.enums import MethodReturnValue
from fpdf.fonts import FontFace, TTFFont
from PIL import Image

from validate.figures.theme import INK, MUTED, printable
from validate.result import ReportData, Tile

FONT = "DejaVu Sans"
MARGIN_IN, LINE_IN, GUTTER_IN = 0.7, 0.165, 0.2
"""Margin of an A4 page, distance between two lines of text, and space between two pictures side by side, in inches."""
TEXT_PT, LEAD_PT, LARGE_PT, SMALL_PT = 8.5, 10.0, 15.0, 8.0
TEXT_PAGES, ROWS = 2, 3  # Largest number of pages of text, and of rows of two pictures on a page
LONGEST, CAPTION_LINES, SHORT = 20, 5, 60
"""Largest number of lines in a paragraph (a trial's note has up to 2,000 characters), of lines in a caption, and of
characters in a footer."""
MORE = "This page has no room for all sentences about this trial: read report.html."
OUTCOME_COLOUR = {"passed": "#00704f", "failed": "#b3261e", "undecided": "#7a5c00", "open": MUTED}
"""Colours of the verdict. Its sentence has the same meaning without them. Cautions have the colour of "undecided"."""

Captioned = tuple[Image.Image | io.BytesIO, str]
"""A picture, as pixels or as a JPEG, and its caption."""


def write_pdf(path: Path, data: ReportData, first: Captioned, others: Sequence[Captioned]) -> None:
    """Write the PDF. It contains no date, so that the same report gives the same bytes."""
    paper, page = _Paper(data.name), data.first_page
    paper.paragraph(f"{data.name} · {page.subject}", colour=MUTED)
    paper.paragraph(page.state, LEAD_PT, "B", OUTCOME_COLOUR[data.tone])
    paper.paragraph(page.verdict, LARGE_PT, "B")
    paper.paragraph(" ".join(page.lead), LEAD_PT)
    for word, text in page.labels:
        paper.paragraph(f"{word} {text}", colour=MUTED)
    picture, caption = first
    paper.image(picture, w=paper.epw)
    paper.paragraph(caption, SMALL_PT, colour=MUTED)
    paper.tiles(page.tiles)
    for caution in data.faults[1:]:
        paper.paragraph(caution.text, LEAD_PT, "B", OUTCOME_COLOUR["undecided"])
    for word, text in page.notes:
        paper.paragraph(f"{word} {text}", colour=MUTED)
    paper.pictures(others)
    paper.output(str(path))
    # fpdf2 leaves the files of its fonts open.
    for font in paper.fonts.values():
        if isinstance(font, TTFFont):
            font.ttfont.close()


class _Paper(FPDF):
    """A4 pages that are filled from top to bottom."""

    def __init__(self, title: str) -> None:
        super().__init__(unit="in", format="A4")
        fonts = Path(matplotlib.get_data_path(), "fonts", "ttf")
        self.add_font(FONT, "", fonts / "DejaVuSans.ttf")
        self.add_font(FONT, "B", fonts / "DejaVuSans-Bold.ttf")
        self.set_margin(MARGIN_IN)
        self.set_auto_page_break(True, MARGIN_IN)
        self.c_margin = 0.0
        # Otherwise {nb} in a text would become the number of pages.
        self.str_alias_nb_pages = ""
        self.set_creation_date(datetime(1970, 1, 1, tzinfo=UTC))
        self.set_title(printable(title))
        self._foot = printable(title)[:SHORT]
        self.set_creator("sealtwin")
        self.add_page()

    def footer(self) -> None:
        """Print the page's number, and the title or MORE. fpdf2 calls this at the end of each page."""
        self.set_y(-0.5)
        self._style(SMALL_PT, "", MUTED)
        self.cell(0, LINE_IN, f"{self.page_no()} · {self._foot}")

    def paragraph(
        self,
        text: str,
        size_pt: float = TEXT_PT,
        weight: Literal["", "B"] = "",
        colour: str = INK,
        width_in: float = 0.0,
        most: int = LONGEST,
    ) -> None:
        """Print up to ``most`` lines on one page. Prints nothing if the pages of text are full."""
        self._style(size_pt, weight, colour)
        line_in = LINE_IN * size_pt / TEXT_PT
        split = self.multi_cell(width_in, text=printable(text), align="L", dry_run=True, output=MethodReturnValue.LINES)
        lines = list(map(str, split)) if isinstance(split, list) else []
        if len(lines) > most:
            lines[most - 1 :] = ["…"]
        if self.will_page_break(line_in * len(lines)):
            if self.page_no() == TEXT_PAGES:
                self._foot = MORE
                return
            self.add_page()
        self.multi_cell(width_in, line_in, "\n".join(lines), align="L", new_x="LMARGIN", new_y="NEXT")
        self.ln(0.5 * LINE_IN)

    def tiles(self, tiles: Sequence[Tile]) -> None:
        """Print figures side by side: title, figure, text, and the lines of the small chart as text."""
        texts = [[tile.text, *(f"{bar.error_mm:.2f} mm {bar.name}" for bar in tile.bars)] for tile in tiles]
        rows = (
            (FontFace(emphasis="BOLD", color=MUTED, size_pt=SMALL_PT), LINE_IN, [tile.title for tile in tiles]),
            (FontFace(emphasis="BOLD", size_pt=LARGE_PT), 1.7 * LINE_IN, [tile.figure for tile in tiles]),
            (FontFace(size_pt=SMALL_PT), LINE_IN, ["\n".join(lines) for lines in texts]),
        )
        self._style(TEXT_PT, "", INK)
        with self.table(
            borders_layout="NONE",
            first_row_as_headings=False,
            gutter_width=GUTTER_IN,
            line_height=LINE_IN,
            padding=(0.25 * LINE_IN, 0.0, 0.0, 0.0),
            text_align="LEFT",
            v_align="TOP",
        ) as table:
            for style, height_in, cells in rows:
                row = table.row(style=style, min_height=height_in)
                for cell in cells:
                    row.cell(printable(cell))
        self.ln(0.5 * LINE_IN)

    def pictures(self, pictures: Sequence[Captioned]) -> None:
        """Print pictures in two columns on new pages, each with its caption."""
        column_in, row_in = (self.epw - GUTTER_IN) / 2, self.eph / ROWS
        height_in = row_in - (CAPTION_LINES + 1) * LINE_IN
        for number, (picture, caption) in enumerate(pictures):
            row, column = divmod(number % (2 * ROWS), 2)
            if row == column == 0:
                self.add_page()
            left_in, top_in = self.l_margin + column * (column_in + GUTTER_IN), self.t_margin + row * row_in
            self.image(picture, left_in, top_in, column_in, height_in, keep_aspect_ratio=True)
            self.set_xy(left_in, top_in + height_in + 0.3 * LINE_IN)
            self.paragraph(caption, SMALL_PT, colour=MUTED, width_in=column_in, most=CAPTION_LINES)

    def _style(self, size_pt: float, weight: Literal["", "B"], colour: str) -> None:
        self.set_font(FONT, weight, size_pt)
        self.set_text_color(colour)
