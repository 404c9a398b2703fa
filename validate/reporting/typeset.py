"""Text, tables and figures set down A4 pages, text as wide as its letters are."""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Literal

import numpy as np
from matplotlib import font_manager
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure, FigureBase, SubFigure
from matplotlib.ft2font import LoadFlags
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from validate.drawing.theme import GRID, INK, MUTED, SIMULATED, printable

WIDTH_IN, HEIGHT_IN = 8.27, 11.69
MARGIN_IN = 0.7
TEXT_PT = 8.5
CAPTION_PT = 8.0
LINE_IN = 0.165
"""From one line of text to the next."""
FOOT_PT = 7.5
FOOT_IN = 0.4
"""From the lower edge of a page to its number."""
FOLIO_IN = 1.0
"""Kept free for that number."""
LABEL_IN = 2.9
LONGEST_ROW = 10
"""Lines that are kept together."""
LAST_ROWS = 3
"""Of a table, that come over to a new page together."""
KEPT_IN = 0.35 * HEIGHT_IN
"""A table lower than this is not broken: more would leave pages half empty."""
DPI = 150
"""Of what is drawn as pixels."""
LONGEST = 500
"""Letters of a word that are looked at: none is so narrow that more of them fit on a line."""
Weight = Literal["normal", "bold"]


class Typesetter:
    """Sets text down a page, and starts a new page where the next line does not fit."""

    def __init__(self, pages: PdfPages, running_title: str) -> None:
        """``running_title`` stands at the foot of each page, beside its number."""
        self._pages, self._running_title = pages, running_title
        self._done: list[Figure] = []
        self._begin()

    def chapter(self, title: str, below_in: float) -> None:
        """Its title, on a page that has room for ``below_in`` more."""
        self._need(4 * LINE_IN + below_in)
        self._down_in += LINE_IN
        self._write(title, MARGIN_IN, size_pt=14, weight="bold")
        self._down_in += 1.8 * LINE_IN

    def heading(self, text: str) -> None:
        self._need(4 * LINE_IN)
        self._down_in += LINE_IN
        self._write(text, MARGIN_IN, size_pt=11, weight="bold", colour=SIMULATED)
        self._down_in += 1.5 * LINE_IN

    def text(self, text: str, size_pt: float = TEXT_PT, weight: Weight = "normal", colour: str = INK) -> None:
        lines, line_in = wrapped(text, WIDTH_IN - 2 * MARGIN_IN, size_pt, weight), LINE_IN * size_pt / TEXT_PT
        # A paragraph stays whole, unless somebody wrote a page into it.
        self._need(line_in * min(len(lines), LONGEST_ROW))
        for line in lines:
            self._need(line_in)
            self._write(line, MARGIN_IN, size_pt, weight, colour)
            self._down_in += line_in
        self._down_in += 0.5 * LINE_IN

    def table(self, title: str, rows: Sequence[tuple[str, str]]) -> None:
        """Under its title, whole where it is short; else the title is said again on the next page."""
        height_in = 4 * LINE_IN + sum(_height_in(row) for row in rows)
        if height_in < KEPT_IN:
            self._need(height_in)
        self.heading(title)
        self.rows(rows, title)

    def rows(self, rows: Sequence[tuple[str, str]], title: str = "") -> None:
        heights_in = [_height_in(row) for row in rows]
        for number, row in enumerate(rows):
            labels, values = _cells(row)
            lines = max(len(labels), len(values))
            # A row stays whole, and the last ones stay together: one alone on a page looks lost.
            left_in = heights_in[number:] if len(rows) - number == LAST_ROWS else heights_in[number : number + 1]
            if self._need(sum(left_in)) and title:
                self.heading(f"{title}, continued")
            for line in range(lines):
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

    def figure(self, height_in: float, draw: Callable[[FigureBase], object], caption: str) -> None:
        """Across the page, its caption below on the same page."""
        captions = wrapped(caption, WIDTH_IN - 2 * MARGIN_IN, CAPTION_PT)
        self._need(height_in + LINE_IN * (len(captions) + 1))
        below_in = HEIGHT_IN - self._down_in - height_in
        grid = self._page.add_gridspec(
            3,
            3,
            width_ratios=(MARGIN_IN, WIDTH_IN - 2 * MARGIN_IN, MARGIN_IN),
            height_ratios=(self._down_in, height_in, below_in),
        )
        # Before anything is drawn: colour bars are made to suit it.
        self._page.set_layout_engine(ConstrainedLayoutEngine(hspace=0.0, wspace=0.0))
        part = self._page.add_subfigure(grid[1, 1])
        self._figures.append(part)
        draw(part)
        self._down_in += height_in + 0.3 * LINE_IN
        self.text(caption, CAPTION_PT, colour=MUTED)
        self._down_in += 0.5 * LINE_IN

    def end(self) -> None:
        """Write all pages: only now is it known how many there are."""
        self._finish_page()
        titles = wrapped(self._running_title, WIDTH_IN - 2 * MARGIN_IN - FOLIO_IN, FOOT_PT)[:1]
        for number, page in enumerate(self._done, start=1):
            foot = FOOT_IN / HEIGHT_IN
            for title in titles:
                page.text(MARGIN_IN / WIDTH_IN, foot, title, fontsize=FOOT_PT, color=MUTED)
            folio = f"{number} of {len(self._done)}"
            page.text(1 - MARGIN_IN / WIDTH_IN, foot, folio, fontsize=FOOT_PT, color=MUTED, ha="right")
            self._pages.savefig(page, dpi=DPI)

    def _finish_page(self) -> None:
        if self._figures:
            self._lay_out()
        self._done.append(self._page)

    def _begin(self) -> None:
        self._page = Figure(figsize=(WIDTH_IN, HEIGHT_IN))
        self._figures: list[SubFigure] = []
        self._down_in = MARGIN_IN

    def _lay_out(self) -> None:
        """Room for every label, to the same last digit in every run.

        The layout's solver orders its terms by their place in memory; what it leaves in the 12th digit would make two
        reports of one run differ.
        """
        place = [np.array(part.bbox_relative.extents) for part in self._figures]
        engine = self._page.get_layout_engine()
        assert engine is not None
        for _ in range(2):
            # Axes that keep a scale get their size in the first pass, and their neighbours theirs in the second.
            engine.execute(self._page)
        self._page.set_layout_engine("none")
        for part, (left, bottom, right, top) in zip(self._figures, place, strict=True):
            part.bbox_relative.p0, part.bbox_relative.p1 = (left, bottom), (right, top)
            for axes in part.axes:
                axes.set_position(np.round(axes.get_position(original=True).bounds, 6).tolist())

    def _need(self, height_in: float) -> bool:
        """Whether a new page was begun for it."""
        if self._down_in + height_in <= HEIGHT_IN - MARGIN_IN:
            return False
        self._finish_page()
        self._begin()
        return True

    def _write(
        self,
        line: str,
        x_in: float,
        size_pt: float = TEXT_PT,
        weight: Weight = "normal",
        colour: str = INK,
    ) -> None:
        y = 1 - self._down_in / HEIGHT_IN
        self._page.text(x_in / WIDTH_IN, y, line, fontsize=size_pt, fontweight=weight, color=colour, va="top")

    def _rule(self) -> None:
        y = 1 - (self._down_in - 0.1 * LINE_IN) / HEIGHT_IN
        across = MARGIN_IN / WIDTH_IN
        self._page.add_artist(Line2D((across, 1 - across), (y, y), color=GRID, linewidth=0.5))
        self._down_in += 0.2 * LINE_IN


def _cells(row: tuple[str, str]) -> tuple[list[str], list[str]]:
    """Lines of a label and of its value."""
    label, value = row
    return (
        wrapped(label, LABEL_IN - 0.15, TEXT_PT),
        wrapped(value, WIDTH_IN - 2 * MARGIN_IN - LABEL_IN, TEXT_PT),
    )


def _height_in(row: tuple[str, str]) -> float:
    """Of a row that is kept whole, its rule included; of a longer one, of what is kept together of it."""
    return LINE_IN * (min(max(len(cell) for cell in _cells(row)), LONGEST_ROW) + 0.2)


def wrapped(text: str, width_in: float, size_pt: float, weight: Weight = "normal") -> list[str]:
    """Lines no wider than ``width_in``, broken at blanks, or inside a word that is wider than a line."""
    return [line for part in printable(text).split("\n") for line in _lines(part, width_in * 72 / size_pt, weight)]


def _lines(text: str, width_em: float, weight: Weight) -> Iterator[str]:
    line = ""
    for word in text.split():
        longer = f"{line} {word}" if line else word
        if _width_em(longer, weight) <= width_em:
            line = longer
            continue
        if line:
            yield line
        while _width_em(word[:LONGEST], weight) > width_em:
            room = np.cumsum([_advance_em(letter, weight) for letter in word[:LONGEST]]) <= width_em
            fits = max(1, int(room.sum()))
            yield word[:fits]
            word = word[fits:]
        line = word
    if line:
        yield line


def _width_em(text: str, weight: Weight) -> float:
    return sum(_advance_em(letter, weight) for letter in text)


@cache
def _advance_em(letter: str, weight: Weight) -> float:
    font = font_manager.get_font(
        font_manager.findfont(font_manager.FontProperties(family="DejaVu Sans", weight=weight))
    )
    font.set_size(100, 72)
    return font.load_char(ord(letter), flags=LoadFlags.NO_HINTING).linearHoriAdvance / 65536 / 100
