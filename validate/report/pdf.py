"""The report as a PDF: the facts of the first page, and all pictures with their captions."""

import io
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

import matplotlib
from fpdf import FPDF
from fpdf.fonts import TTFFont
from PIL import Image

from validate.figures.theme import INK, MUTED, printable
from validate.result import ReportData

FONT = "DejaVu Sans"
MARGIN_IN, LINE_IN = 0.7, 0.165  # Margin of an A4 page, and distance between two lines of text, in inches
TEXT_PT, LEAD_PT, LARGE_PT, SMALL_PT = 8.5, 10.0, 15.0, 8.0
LONGEST_FOOT = 90  # Largest number of characters in a footer
HIGHEST = 0.4  # Largest height of a picture, as a fraction of the page
OUTCOME_COLOUR = {"passed": "#00704f", "failed": "#b3261e", "undecided": "#7a5c00", "open": MUTED}
"""Colours of the verdict. Its sentence has the same meaning without them. Cautions have the colour of "undecided"."""

Weight = Literal["", "B"]
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
    paper.picture(*first)
    for tile in page.tiles:
        bars = [f"{bar.error_mm:.2f} mm {bar.name}" for bar in tile.bars]
        paper.paragraph(f"{tile.title} · {tile.figure}", LEAD_PT, "B")
        paper.paragraph(" · ".join([tile.text, *bars]), colour=MUTED)
    for caution in data.faults[1:]:
        paper.paragraph(caution.text, LEAD_PT, "B", OUTCOME_COLOUR["undecided"])
    for word, text in page.notes:
        paper.paragraph(f"{word} {text}", colour=MUTED)
    for picture, caption in others:
        paper.picture(picture, caption)
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
        self.set_creator("sealtwin")
        self.add_page()

    def footer(self) -> None:
        """Print the page's number and the title. fpdf2 calls this at the end of each page."""
        self.set_y(-0.5)
        self._style(SMALL_PT, "", MUTED)
        self.cell(0, LINE_IN, f"{self.page_no()} · {self.title}"[:LONGEST_FOOT])

    def paragraph(self, text: str, size_pt: float = TEXT_PT, weight: Weight = "", colour: str = INK) -> None:
        self._style(size_pt, weight, colour)
        self.multi_cell(0, LINE_IN * size_pt / TEXT_PT, printable(text), align="L", new_x="LMARGIN", new_y="NEXT")
        self.ln(0.5 * LINE_IN)

    def picture(self, picture: Image.Image | io.BytesIO, caption: str) -> None:
        """Print a picture with its caption on one page."""
        with self.unbreakable() as page:
            page.image(picture, w=self.epw, h=HIGHEST * self.eph, keep_aspect_ratio=True)
            page.paragraph(caption, SMALL_PT, colour=MUTED)

    def _style(self, size_pt: float, weight: Weight, colour: str) -> None:
        self.set_font(FONT, weight, size_pt)
        self.set_text_color(colour)
