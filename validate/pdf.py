"""The report as A4 pages, by matplotlib alone: no browser, no fonts of the system."""

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from validate import facts
from validate.evidence import Evidence
from validate.plates import Plate
from validate.theme import GRID, INK, MEASURED, MUTED, SIMULATED, THIRD, printable, themed

WIDTH_IN, HEIGHT_IN = 8.27, 11.69
MARGIN_IN = 0.7
TEXT_PT = 8.5
LINE_IN = 0.165
"""From one line of text to the next."""
LABEL_IN = 2.9
LABEL_LETTERS, VALUE_LETTERS, LINE_LETTERS = 44, 60, 100
"""That fit side by side, and alone."""
CAPTION_LETTERS = 115
OUTCOME_COLOUR = {"passed": THIRD, "failed": MEASURED, "open": MUTED}
DPI = 150
"""Of what is drawn as pixels."""


def write_pdf(path: Path, evidence: Evidence, overlay: NDArray[np.uint8], plates: Sequence[Plate]) -> None:
    """Summary, figures, then every table. The same evidence gives the same bytes: no date is written."""
    metadata = {"Title": printable(evidence.name), "Creator": "sealtwin", "CreationDate": None, "ModDate": None}
    verdict, outcome = facts.headline(evidence)
    with themed(), PdfPages(path, metadata=metadata) as pages:
        front = _Typesetter(pages)
        front.text(evidence.name, size_pt=20, weight="bold")
        front.text(evidence.note, colour=MUTED)
        front.text(facts.warning(evidence), size_pt=10, weight="bold", colour=MEASURED)
        front.text(verdict, size_pt=11, weight="bold", colour=OUTCOME_COLOUR[outcome])
        front.rows(facts.key_figures(evidence))
        front.picture(overlay)
        front.text("The walls and the centreline that were found, over the photo.", colour=MUTED)
        front.end()
        for together in _by_page(plates):
            pages.savefig(_figure_page(together), dpi=DPI)
        back = _Typesetter(pages)
        back.heading("Assumptions")
        for sentence in facts.assumptions(evidence):
            back.text(sentence)
        for table in facts.tables(evidence):
            back.heading(table.title)
            back.rows(table.rows)
        back.end()


def _by_page(plates: Sequence[Plate]) -> Iterator[list[Plate]]:
    """As many figures on a page as their heights allow."""
    page: list[Plate] = []
    left_in = HEIGHT_IN - 2 * MARGIN_IN
    for plate in plates:
        if page and plate.height_in > left_in:
            yield page
            page, left_in = [], HEIGHT_IN - 2 * MARGIN_IN
        page.append(plate)
        left_in -= plate.height_in
    if page:
        yield page


def _figure_page(plates: Sequence[Plate]) -> Figure:
    across, up = MARGIN_IN / WIDTH_IN, MARGIN_IN / HEIGHT_IN
    page = Figure(
        figsize=(WIDTH_IN, HEIGHT_IN),
        layout=ConstrainedLayoutEngine(rect=(across, up, 1 - 2 * across, 1 - 2 * up), hspace=0.03),
    )
    heights_in = [plate.height_in for plate in plates]
    free_in = max(HEIGHT_IN - 2 * MARGIN_IN - sum(heights_in), 0.01)
    parts = page.subfigures(len(plates) + 1, 1, height_ratios=[*heights_in, free_in], squeeze=False)[:, 0]
    for plate, part in zip(plates, parts[:-1], strict=True):
        plate.draw(part)
        caption = "\n".join(textwrap.wrap(plate.caption, CAPTION_LETTERS))
        part.supxlabel(caption, fontsize=8, color=MUTED, x=0.02, ha="left")
    return page


class _Typesetter:
    """Sets text down a page, and starts a new page where the next line does not fit."""

    def __init__(self, pages: PdfPages) -> None:
        self._pages = pages
        self._begin()

    def heading(self, text: str) -> None:
        self._need(4 * LINE_IN)
        self._down_in += LINE_IN
        self._write(text, MARGIN_IN, size_pt=11, weight="bold", colour=SIMULATED)
        self._down_in += 1.5 * LINE_IN

    def text(
        self, text: str, size_pt: float = TEXT_PT, weight: Literal["normal", "bold"] = "normal", colour: str = INK
    ) -> None:
        letters = int(LINE_LETTERS * TEXT_PT / size_pt * (0.88 if weight == "bold" else 1.0))
        for line in _wrapped(text, letters):
            self._need(LINE_IN * size_pt / TEXT_PT)
            self._write(line, MARGIN_IN, size_pt, weight, colour)
            self._down_in += LINE_IN * size_pt / TEXT_PT
        self._down_in += 0.5 * LINE_IN

    def rows(self, rows: Sequence[tuple[str, str]]) -> None:
        for label, value in rows:
            labels, values = _wrapped(label, LABEL_LETTERS), _wrapped(value, VALUE_LETTERS)
            for line in range(max(len(labels), len(values))):
                self._need(LINE_IN)
                self._write(labels[line] if line < len(labels) else "", MARGIN_IN, colour=MUTED)
                self._write(values[line] if line < len(values) else "", MARGIN_IN + LABEL_IN)
                self._down_in += LINE_IN
            self._rule()

    def picture(self, picture: NDArray[np.uint8]) -> None:
        """Across the page, in its own proportions."""
        width_in = WIDTH_IN - 2 * MARGIN_IN
        height_in = min(width_in * picture.shape[0] / picture.shape[1], 0.6 * HEIGHT_IN)
        self._need(height_in + LINE_IN)
        self._down_in += 0.5 * LINE_IN
        bottom = 1 - (self._down_in + height_in) / HEIGHT_IN
        axes = self._page.add_axes((MARGIN_IN / WIDTH_IN, bottom, width_in / WIDTH_IN, height_in / HEIGHT_IN))
        axes.imshow(picture)
        axes.set_axis_off()
        self._down_in += height_in + 1.5 * LINE_IN

    def end(self) -> None:
        self._pages.savefig(self._page, dpi=DPI)

    def _begin(self) -> None:
        self._page = Figure(figsize=(WIDTH_IN, HEIGHT_IN))
        self._down_in = MARGIN_IN

    def _need(self, height_in: float) -> None:
        if self._down_in + height_in > HEIGHT_IN - MARGIN_IN:
            self.end()
            self._begin()

    def _write(
        self,
        line: str,
        x_in: float,
        size_pt: float = TEXT_PT,
        weight: Literal["normal", "bold"] = "normal",
        colour: str = INK,
    ) -> None:
        y = 1 - self._down_in / HEIGHT_IN
        self._page.text(x_in / WIDTH_IN, y, line, fontsize=size_pt, fontweight=weight, color=colour, va="top")

    def _rule(self) -> None:
        y = 1 - (self._down_in - 0.1 * LINE_IN) / HEIGHT_IN
        across = MARGIN_IN / WIDTH_IN
        self._page.add_artist(Line2D((across, 1 - across), (y, y), color=GRID, linewidth=0.5))
        self._down_in += 0.2 * LINE_IN


def _wrapped(text: str, letters: int) -> list[str]:
    return [line for part in printable(text).split("\n") for line in textwrap.wrap(part, letters)]
