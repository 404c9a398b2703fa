"""A sheet as it lies in its file: rows of cells with addresses, and how the file wrote them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

from validate.sheets.faults import Place

Kind = Literal["text", "number", "date", "truth", "error", "formula"]
"""Cells of a text file are all text. "formula": one whose result was never stored."""

MOST_ROWS = 10_000
MOST_COLUMNS = 256
"""That hold anything. A crack has tens of stations; more is another table, given by mistake."""


class Cell(NamedTuple):
    text: str
    """Without blanks around it. Of a number in a workbook: with a decimal point, 15 digits at most."""
    kind: Kind = "text"


BLANK = Cell("")


@dataclass(frozen=True)
class Row:
    number: int
    """From 1, as editors and spreadsheets count."""
    cells: tuple[Cell, ...]
    """From the first column on."""

    @property
    def width(self) -> int:
        """Cells up to the last that holds anything."""
        return max((column + 1 for column, cell in enumerate(self.cells) if cell != BLANK), default=0)

    def cell(self, column: int) -> Cell:
        return self.cells[column] if column < len(self.cells) else BLANK


@dataclass(frozen=True)
class Grid:
    """The rows that hold anything."""

    path: Path
    sha256: str
    """Of the bytes that these rows were read from."""
    rows: tuple[Row, ...]
    written: tuple[str, ...]
    """How the file is written, in words: ("CSV", "UTF-16", "semicolons")."""
    separator: str | None = None
    """Of a text file."""
    sheet: str | None = None
    """Of a workbook."""
    merged: tuple[tuple[int, int, int, int], ...] = ()
    """Cells that were made one: first row, first column, last row, last column; rows from 1, columns from 0."""
    remarks: tuple[str, ...] = ()
    """What a reader may not expect, in words: hidden rows that are read, hidden sheets that are not."""

    def place(self, row: int | None = None, column: int | None = None, name: str | None = None) -> Place:
        return Place(self.path, self.sheet, row, column, name)
