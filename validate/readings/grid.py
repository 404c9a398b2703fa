"""The cells of a sheet with their marks, and what else is in its file."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple, Self

from sealtwin.core.doubts import Doubt, Location, ReadSheet
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
    is_formula: bool = False  # True if a formula gives the content
    is_struck: bool = False
    colours: str = ""  # Colours of fill and font; empty for black on white


BLANK = Cell("")
FORMULA = Cell("", "formula", is_formula=True)


class Comment(NamedTuple):
    row: int  # From 1
    column: int  # From 0
    text: str


@dataclass(frozen=True, eq=False)
class Grid:
    """The cells of a sheet, and what else is in its file."""

    path: Path
    written: tuple[str, ...] = ()  # Format of the file in words: ("CSV", "UTF-16", "semicolons")
    rows: dict[int, dict[int, Cell]] = field(default_factory=dict)
    """Cells that are not blank, by row number from 1, then by column from 0, both increasing."""
    separator: str | None = None  # Separator of a text file
    sheet: str | None = None  # Name of a workbook's sheet
    is_hidden: bool = False
    comments: list[Comment] = field(default_factory=list)
    hidden_rows: set[int] = field(default_factory=set)
    hidden_columns: set[int] = field(default_factory=set)
    elsewhere: list[tuple[str, str]] = field(default_factory=list)
    """Other texts of a workbook with their places: ("sheet 'Notes', row 1", "all in cm"), ("page header", "P01")."""

    doubts: tuple[Doubt, ...] = ()  # What is open about the file

    def require_size(self) -> Self:
        """Return the sheet. Raises SheetFaults if it exceeds the size limit of a sheet of readings."""
        if len(self.rows) > MOST_ROWS:
            finding = f"has more than {MOST_ROWS} rows, which is the limit."
            raise refused(self.location(), finding, "Use fewer stations.")
        for row, cells in self.rows.items():
            if max(cells) >= MOST_COLUMNS:
                finding = f"has more than {MOST_COLUMNS} columns, which is the limit."
                raise refused(self.location(row), finding, "Delete everything outside the table.")
        return self

    def cell(self, row: int, column: int) -> Cell:
        return self.rows.get(row, {}).get(column, BLANK)

    def texts(self, row: int) -> tuple[str, ...]:
        """Return the texts of a row from the first column on."""
        return tuple(self.cell(row, column).text for column in range(max(self.rows.get(row, {}), default=-1) + 1))

    def location(self, row: int | None = None) -> Location:
        """Return the sheet, or a row of it."""
        parts = [] if self.sheet is None else [f"sheet {quoted(self.sheet)}"]
        return Location(Path(as_text(self.path)), ", ".join(parts if row is None else [*parts, f"row {row}"]))

    def drop_zeros(self, *, never_calculated: bool = False) -> None:
        """Treat the results of formulas as never calculated if the program that wrote the file stored zeros for them.

        That is assumed if the file states it (``never_calculated``), or if there are several formulas and all results
        are 0.
        """
        cells = [(row, column, cell) for row in self.rows.values() for column, cell in row.items() if cell.is_formula]
        zeros = [(row, column) for row, column, cell in cells if cell.text in ("0", "-0")]
        if never_calculated or 1 < len(zeros) == len(cells):
            for row, column in zeros:
                row[column] = FORMULA

    def all_texts(self) -> Iterator[tuple[str, str]]:
        """Yield the texts of a worksheet with their places; those of a row are one."""
        sheet, texts = f"sheet {quoted(f'{self.sheet}')}", [*self.elsewhere]
        texts += [(f"comment in row {row}", text) for row, _, text in self.comments]
        for row, cells in self.rows.items():
            if words := [cell.text for cell in cells.values() if cell.kind == "text"]:
                texts.append((f"row {row}", " ".join(words)))
        yield from ((f"{sheet}, {part}", text) for part, text in texts)


class SheetFaults(InputError):  # noqa: N818  It is all that is open in a sheet, not one error.
    """All that is open in a sheet: one question with its parts, and the sheet as far as it was understood."""

    def __init__(self, doubts: Sequence[Doubt], understood: ReadSheet | None = None) -> None:
        self.doubts, self.understood = tuple(doubts), understood
        super().__init__("\n".join(map(str, self.doubts)))


def refused(where: Location | Path, finding: str, remedy: str) -> SheetFaults:
    """Return the error of a single fault that ends reading. ``where`` may be the path of the file."""
    where = Location(Path(as_text(where))) if isinstance(where, Path) else where
    return SheetFaults([Doubt("file", where, finding, remedy)])


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
