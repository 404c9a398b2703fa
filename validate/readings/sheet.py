"""The cells of a sheet, and its faults. All faults are reported at once, each with its place and remedy."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, NamedTuple

from sealtwin.core.errors import InputError, as_text
from sealtwin.core.records import ReadColumn

Fact = Literal["columns", "station", "readings", "unit", "quantity", "decimal", "crack"]
"""Fact that a sheet leaves open: "columns" if any is not named, "station" or "readings" if the stand-in may be wrong;
"crack" if readings are outside of it."""
MOST_KEPT = 1_000
MOST_SHOWN = 20  # Limit on the sentences of a message; more faults have a common cause
FIGURES = re.compile(r"[-+]?\d[\d.,]*(?:e[-+]?\d+)?")  # Numbers within a sentence
MOST_ROWS_NAMED = 8  # Limit on the rows that are listed for one mistake
LONGEST_SHOWN = 60  # Limit on the letters of a cell that are quoted
SAVE_AGAIN = "Open it in a spreadsheet program and save it as XLSX, or as CSV."


@dataclass(frozen=True)
class Place:
    """A place in a sheet: the file, one of its sheets, a row, or a cell."""

    path: Path
    sheet: str | None = None  # Name of a workbook's sheet; None in a text file
    row: int | None = None  # Row number from 1, as in editors and spreadsheets
    column: int | None = None  # Column number from 0
    name: str | None = None  # Name of the column in the header

    def __str__(self) -> str:
        name = self.name and shown(self.name)
        if self.sheet is None:
            parts = [self.row and f"line {self.row}", name and f"column {name}"]
        elif self.column is not None and self.row is not None:
            cell = f"cell {letters(self.column)}{self.row}"
            parts = [f"sheet {quoted(self.sheet)}", f"{cell} ({name})" if name else cell]
        else:
            parts = [f"sheet {quoted(self.sheet)}", self.row and f"row {self.row}"]
        return ", ".join(part for part in (as_text(self.path), *parts) if part)


@dataclass(frozen=True)
class SheetFault:
    place: Place
    finding: str  # The value and what is allowed: a sentence, or the end of one
    remedy: str
    value: str | None = None  # Text of the cell

    def __str__(self) -> str:
        return f"{self.place}: {self.finding} {self.remedy}"

    @property
    def kind(self) -> object:
        """Key that is equal for the same mistake in several cells of a column.

        A fault without a cell has a unique key.
        """
        if self.place.column is None or not self.value:
            return self.place, self.finding, self.remedy
        finding = self.finding.replace(quoted(self.value), "")
        return replace(self.place, row=None, column=None), FIGURES.sub("", finding), self.remedy


class SheetFaults(InputError):  # noqa: N818  It is all of a sheet's faults, not one error.
    """All faults of one sheet. The text shows the first twenty. ``columns`` are the recognised columns."""

    def __init__(self, faults: Sequence[SheetFault], columns: tuple[ReadColumn, ...] = ()) -> None:
        self.faults, self.columns = tuple(faults), columns
        alike: dict[object, list[SheetFault]] = {}
        for fault in faults:
            alike.setdefault(fault.kind, []).append(fault)
        groups = list(alike.values())[:MOST_SHOWN]
        lines = [_joined(group) for group in groups]
        if more := len(faults) - sum(map(len, groups)):
            lines.append(f"{as_text(faults[0].place.path)}: has {more:,} more faults like these.")
        super().__init__("\n".join(lines))


@dataclass
class FaultList:
    """Faults found in a sheet so far. At a thousand, reading stops."""

    faults: list[SheetFault] = field(default_factory=list)
    columns: tuple[ReadColumn, ...] = ()  # Recognised columns; set after the header is read
    open: set[Fact] = field(default_factory=set)
    """Facts that a fault asks for. Reading goes on with a stand-in, of which nothing else is asked that may be its
    own mistake."""

    def add(self, place: Place, finding: str, remedy: str, value: str | None = None) -> None:
        self.faults.append(SheetFault(place, finding, remedy, value))
        if len(self.faults) == MOST_KEPT:
            self.raise_if_any()

    def raise_if_any(self) -> None:
        """Raise SheetFaults if there is a fault."""
        if self.faults:
            raise SheetFaults(self.faults, self.columns)


def _joined(alike: list[SheetFault]) -> str:
    """Return the first fault in words, followed by the rows of the others."""
    rows = sorted({row for fault in alike if (row := fault.place.row) is not None} - {alike[0].place.row})
    if not rows:
        return str(alike[0])
    places = ", ".join(map(str, rows[:MOST_ROWS_NAMED])) + (" and others" if len(rows) > MOST_ROWS_NAMED else "")
    if len(rows) > 1 and rows[-1] - rows[0] == len(rows) - 1:
        places = f"{rows[0]} to {rows[-1]}"
    return f"{alike[0]} The same fault is in {len(rows):,} more row{'s' if len(rows) > 1 else ''}: {places}."


def refuse(place: Place, finding: str, remedy: str, value: str | None = None) -> SheetFaults:
    """Return the error of a single fault that ends reading."""
    return SheetFaults([SheetFault(place, finding, remedy, value)])


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


def clipped(text: str) -> str:
    return text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 1] + "…"


def quoted(text: str) -> str:
    """Return the text clipped, in quotation marks and with escapes."""
    return repr(clipped(text))


def shown(text: str) -> str:
    """Return the text clipped and on one line, with escapes for what cannot be printed."""
    text = clipped(text)
    return text if text.isprintable() else repr(text)


Kind = Literal["text", "number", "date", "truth", "error", "formula"]
"""Kind of a cell. Cells of a text file are all "text". A "formula" is a formula without a stored result."""

MOST_ROWS = 10_000
MOST_COLUMNS = 256  # Limit on the columns with content; a sheet of readings has fewer


class SheetCell(NamedTuple):
    text: str  # Content without surrounding blanks; numbers of a workbook have a decimal point and up to 15 digits
    kind: Kind = "text"


BLANK = SheetCell("")


@dataclass(frozen=True)
class SheetRow:
    number: int  # Row number from 1, as in editors and spreadsheets
    cells: tuple[SheetCell, ...]  # Cells from the first column on

    @property
    def width(self) -> int:
        """Number of cells up to the last one with content."""
        return max((column + 1 for column, cell in enumerate(self.cells) if cell != BLANK), default=0)

    def cell(self, column: int) -> SheetCell:
        return self.cells[column] if column < len(self.cells) else BLANK


@dataclass(frozen=True)
class SheetGrid:
    """The rows with content of a sheet. Raises SheetFaults if they exceed the size limit of a sheet of readings."""

    path: Path
    rows: tuple[SheetRow, ...]
    written: tuple[str, ...]  # Format of the file in words: ("CSV", "UTF-16", "semicolons")
    separator: str | None = None  # Separator of a text file
    sheet: str | None = None  # Name of a workbook's sheet
    merged: tuple[tuple[int, int, int, int], ...] = ()
    """Merged ranges: first row, first column, last row, last column; rows from 1, columns from 0."""
    remarks: tuple[str, ...] = ()  # Remarks for the report: hidden rows that are read, hidden sheets that are not
    struck: frozenset[tuple[int, int]] = frozenset()  # Cells that are struck through: row from 1, column from 0
    hidden_rows: frozenset[int] = frozenset()
    hidden_columns: frozenset[int] = frozenset()
    shown_units: Mapping[tuple[int, int], str] = field(default_factory=dict[tuple[int, int], str])
    """Text that a number's format shows behind it, such as "cm" or "%", by row from 1 and column from 0."""
    is_note: bool = False  # True for a text with a place and its readings in each line
    minus: Mapping[int, str] = field(default_factory=dict[int, str])
    """Readings of a note's rows with a dash behind the place, by row number, as they are if the dash is a minus."""

    def __post_init__(self) -> None:
        if len(self.rows) > MOST_ROWS:
            raise refuse(self.place(), f"has more than {MOST_ROWS} rows, which is the limit.", "Use fewer stations.")
        if wide := next((row for row in self.rows if row.width > MOST_COLUMNS), None):
            finding = f"has more than {MOST_COLUMNS} columns, which is the limit."
            raise refuse(self.place(wide.number), finding, "Delete everything outside the table.")

    def place(self, row: int | None = None, column: int | None = None, name: str | None = None) -> Place:
        return Place(self.path, self.sheet, row, column, name)


@dataclass
class Worksheet:
    """One sheet of a workbook while it is read. ``SheetGrid`` explains the marks."""

    name: str
    hidden: bool
    rows: dict[int, dict[int, SheetCell]] = field(default_factory=dict)
    """Cells that are not blank, by row number from 1, then by column from 0."""
    merged: list[tuple[int, int, int, int]] = field(default_factory=list)
    struck: set[tuple[int, int]] = field(default_factory=set)
    hidden_rows: set[int] = field(default_factory=set)
    hidden_columns: set[int] = field(default_factory=set)
    shown_units: dict[tuple[int, int], str] = field(default_factory=dict)
    zeros: set[tuple[int, int]] = field(default_factory=set)  # Formulas whose stored result is 0
    results: int = 0  # Number of formulas with another result

    def put(self, row: int, column: int, cell: SheetCell, struck: bool, unit: str, formula: bool) -> None:
        """Add a cell that is not blank; ``unit`` is the text that its format shows behind a number."""
        self.rows.setdefault(row, {})[column] = cell
        if struck:
            self.struck.add((row, column))
        if unit:
            self.shown_units[row, column] = unit
        if formula and cell.kind == "number":
            is_zero = float(cell.text) == 0
            self.zeros |= {(row, column)} if is_zero else set()
            self.results += not is_zero

    def drop_zeros(self, *, never_calculated: bool) -> None:
        """Treat the results of formulas as never calculated if the program that wrote the file stored zeros for them.

        That is assumed if the file states it (``never_calculated``), or if there are several formulas and all results
        are 0.
        """
        if never_calculated or (len(self.zeros) > 1 and not self.results):
            for row, column in self.zeros:
                self.rows[row] = self.rows[row] | {column: SheetCell("", "formula")}

    def grid(self, path: Path, program: str, remarks: Sequence[str]) -> SheetGrid:
        return SheetGrid(
            path,
            rows=tuple(
                SheetRow(number, tuple(cells.get(column, BLANK) for column in range(max(cells) + 1)))
                for number, cells in sorted(self.rows.items())
            ),
            written=(program, f"sheet {quoted(self.name)}"),
            sheet=self.name,
            merged=tuple(self.merged),
            remarks=tuple(remarks),
            struck=frozenset(self.struck),
            hidden_rows=frozenset(self.hidden_rows),
            hidden_columns=frozenset(self.hidden_columns),
            shown_units=self.shown_units,
        )
