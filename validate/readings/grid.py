"""The cells of a sheet with their marks, and what else is in its file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

from sealtwin.core.doubts import Doubt, ReadSheet
from sealtwin.core.errors import InputError, as_text

Kind = Literal["text", "number", "date", "truth", "error", "formula"]
"""Kind of a cell. Cells of a text file are all "text". A "formula" is one without a stored result."""
MOST_ROWS = 10_100  # 10,000 stations below a header and titles
MOST_COLUMNS = 256  # Limit on the columns with content; a sheet of readings has fewer
MOST_NAMED = 8  # Cells or columns that a sentence names
LONGEST_SHOWN = 60  # Limit on the letters of a cell that are quoted
SAVE_AGAIN = "Open it in a spreadsheet program and save it as XLSX, or as CSV."


class Cell(NamedTuple):
    text: str  # Content without surrounding blanks; numbers of a workbook have a decimal point and up to 15 digits
    kind: Kind = "text"
    unit: str = ""  # Text that a number's format shows behind it, such as "cm" or "%"


BLANK = Cell("")


class Mark(NamedTuple):
    """Mark that a spreadsheet shows beside the content of a cell."""

    row: int  # From 1
    column: int  # From 0
    kind: Literal["comment", "struck", "hidden", "coloured"]
    text: str = ""  # Text of a comment; colours of fill and font


@dataclass(frozen=True)
class Grid:
    """The rows with content of a sheet.

    Raises SheetFaults if they exceed the size limit of a sheet of readings.
    """

    path: Path
    rows: Mapping[int, tuple[Cell, ...]]  # By row number from 1, increasing; cells from the first column on
    written: tuple[str, ...] = ()  # Format of the file in words: ("CSV", "UTF-16", "semicolons")
    separator: str | None = None  # Separator of a text file
    sheet: str | None = None  # Name of a workbook's sheet
    marks: tuple[Mark, ...] = ()  # Of cells with content, and comments
    elsewhere: tuple[tuple[str, str], ...] = ()
    """Other texts of a workbook with their places: ("sheet 'Notes', row 1", "all in cm"), ("page header", "P01")."""

    doubts: tuple[Doubt, ...] = ()  # What is open about the file

    def __post_init__(self) -> None:
        if len(self.rows) > MOST_ROWS:
            raise refused(self.place(), f"has more than {MOST_ROWS} rows, which is the limit.", "Use fewer stations.")
        for row, cells in self.rows.items():
            if any(cell != BLANK for cell in cells[MOST_COLUMNS:]):
                finding = f"has more than {MOST_COLUMNS} columns, which is the limit."
                raise refused(self.place(row), finding, "Delete everything outside the table.")

    def cell(self, row: int, column: int) -> Cell:
        cells = self.rows.get(row, ())
        return cells[column] if column < len(cells) else BLANK

    def place(self, row: int | None = None, column: int | None = None) -> str:
        """Return the name of the sheet, of a row or of a cell in messages."""
        sheet = None if self.sheet is None else f"sheet {quoted(self.sheet)}"
        what = None if row is None else f"row {row}" if column is None else f"cell {letters(column)}{row}"
        return ", ".join(filter(None, (as_text(self.path), sheet, what)))


class SheetFaults(InputError):  # noqa: N818  It is all that is open in a sheet, not one error.
    """All that is open in a sheet: one question with its parts, and the sheet as far as it was understood."""

    def __init__(self, doubts: Sequence[Doubt], understood: ReadSheet | None = None) -> None:
        self.doubts, self.understood = tuple(doubts), understood
        super().__init__("\n".join(map(str, self.doubts)))


def refused(place: Path | str, finding: str, remedy: str) -> SheetFaults:
    """Return the error of a single fault that ends reading. ``place`` may be the path alone."""
    return SheetFaults([Doubt("file", as_text(Path(place)), finding, remedy)])


def letters(column: int) -> str:
    """Return a spreadsheet's name of a column: 0 is A, 26 is AA."""
    above, last = divmod(column, 26)
    return (letters(above - 1) if above else "") + chr(ord("A") + last)


def column_of(name: str) -> int:
    """Return the number of a column from its letters: A is 0."""
    column = 0
    for letter in name:
        column = 26 * column + ord(letter) - ord("A") + 1
    return column - 1


def clipped(text: str, longest: int = LONGEST_SHOWN) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"


def quoted(text: str, longest: int = LONGEST_SHOWN) -> str:
    """Return the text clipped, in quotation marks and with escapes."""
    return repr(clipped(text, longest))


def listed(texts: Sequence[str], most: int = MOST_NAMED) -> str:
    """Return the first texts in a sentence, and the number of the others."""
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return ", ".join(texts[:most]) + more


def shown(text: str) -> str:
    """Return the text clipped and on one line, with escapes for what cannot be printed."""
    text = clipped(text)
    return text if text.isprintable() else repr(text)
