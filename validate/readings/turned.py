"""Sheets with a column for each station: what is declared of them counts the file's own rows and columns."""

import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import TypeVar

from validate.readings.header_rows import find_header
from validate.readings.header_words import meaning
from validate.readings.sheet import SheetGrid, SheetRow, letters, refuse
from validate.readings.table_rows import LETTERS, is_a_number, plain_name, table_rows, within
from validate.readings.tables import common_lines
from validate.settings import Columns, Declared

MOST_TURNED = 100
"""Limit on the rows of a sheet that is turned without a declaration: such sheets have few rows."""
OF_ROWS = re.compile(r"([1-9][0-9]{0,3})(?::([1-9][0-9]{0,3}))?")
ASSIGN_ROWS = (
    "Assign the rows by numbers: s and levels in pairing.csv, such as 3 and 4:6; or [readings.columns] "
    's = "3", levels = ["4:6"] in lab.toml or the trial.'
)
Sheet = TypeVar("Sheet", bound=Declared)


def upright(grid: SheetGrid, declared: Sheet) -> tuple[SheetGrid, Sheet]:
    """Return a sheet with rows and columns swapped, and its declarations with them, if each station has a column.

    That is declared, or ``s`` is the number of a row, or a table's names are in a column. Raises SheetFaults for a
    declaration that a turned sheet cannot have.
    """
    given = declared.columns or Columns()
    if given.transposed or (given.transposed is None and _names_rows(given)):
        return _turned(grid, declared, given)
    if given.transposed is not None:
        return grid, declared
    rows = table_rows(grid, given).rows
    is_small = len(rows) > 1 and rows[-1].number < MOST_TURNED
    of_rows = isinstance(given.header_rows, str) or _lettered(grid, given)
    if not is_small or of_rows or _is_table(find_header(rows, grid.merged, given).names):
        return grid, declared
    turned = _turned(grid, declared, given)
    return turned if _is_table(find_header(turned[0].rows, (), given).names) else (grid, declared)


def _names_rows(given: Columns) -> bool:
    """Return whether references are row numbers. A single number in ``levels`` may be the name of a column."""
    spans = [each for each in given.levels or () if ":" in each]
    return any(OF_ROWS.fullmatch(each) for each in (given.s or "", *spans))


def _lettered(grid: SheetGrid, given: Columns) -> list[str]:
    """Return the references that are letters of columns, and no names in the sheet."""
    references = [each for each in (given.s, given.repeat, *(given.levels or ())) if each is not None]
    texts = {plain_name(cell.text) for row in grid.rows for cell in row.cells} if references else set[str]()
    return [
        each
        for each in references
        if LETTERS.fullmatch(each.upper() if each.islower() else each) and plain_name(each) not in texts
    ]


def _is_table(names: Mapping[int, str]) -> bool:
    roles = {named.role for name in names.values() if (named := meaning(name)) is not None}
    return {"station", "reading"} <= roles


def _turned(grid: SheetGrid, declared: Sheet, given: Columns) -> tuple[SheetGrid, Sheet]:
    if lettered := _lettered(grid, given):
        finding = f'"{lettered[0]}" is a column, but here each station has a column, and s, levels and repeat are rows.'
        raise refuse(grid.place(), finding, ASSIGN_ROWS, lettered[0])
    if isinstance(given.header_rows, str):
        finding = f'header_rows = "{given.header_rows}" are rows, but here names are in columns.'
        raise refuse(grid.place(), finding, "Give the number of these columns, such as 1, or remove it.")
    rows, skipped, _, unmet = table_rows(grid, given)
    titles = list(takewhile(_is_title, rows))
    rows = rows[len(titles) :]
    if given.s is not None and (match := OF_ROWS.fullmatch(given.s)) is not None:
        # Samples below each other share the row of places, which the range of one leaves out.
        columns = re.sub("[0-9]", "", given.range or "")
        shared = within(
            [row for row in grid.rows if f"{row.number}" == match[1]], columns if columns.strip(":") else None
        )
        rows = sorted({row.number: row for row in (*shared, *rows)}.values(), key=lambda row: row.number)
    inside = {row.number: row for row in within(grid.rows, given.range)}
    cut = {
        at
        for row in grid.rows
        for at, cell in enumerate(row.cells)
        if row.number in inside and cell != inside[row.number].cell(at)
    }
    values = [one for one in grid.merged if any(row.number == one[0] and is_a_number(row.cell(one[1])) for row in rows)]
    turned = replace(
        grid,
        rows=_swapped(rows),
        written=(*grid.written, "stations in a row"),
        # Numbers of fields are checked in the file's rows, which are columns here.
        separator=";" if grid.separator == "," else grid.separator,
        # A merged name is that of one row here, or a title; a merged value may belong to all cells.
        merged=tuple((first + 1, top - 1, last + 1, bottom - 1) for top, first, bottom, last in values),
        struck=frozenset((column + 1, row - 1) for row, column in grid.struck),
        shown_units={(column + 1, row - 1): unit for (row, column), unit in grid.shown_units.items()},
        hidden_rows=frozenset(column + 1 for column in grid.hidden_columns),
        hidden_columns=frozenset(row - 1 for row in grid.hidden_rows),
        turned=True,
        outside=_swapped([*titles, *skipped, *common_lines(grid, given.range)]),
        cut=tuple(row for row in _swapped(grid.rows) if row.number - 1 in cut),
        unmet=tuple(unmet),
    )
    use = _References(grid, [row.number for row in rows], {row.number for row in skipped}, given.range)
    in_turned = {
        "s": given.s and use.lettered(given.s)[0],
        "repeat": given.repeat and use.lettered(given.repeat)[0],
        "levels": given.levels and tuple(one for level in given.levels for one in use.lettered(level)),
        **{"range": None, "skip": (), "missing": ()},
    }
    return turned, declared.model_copy(update={"columns": given.model_copy(update=in_turned)})


@dataclass(frozen=True)
class _References:
    """References to rows, and which rows are read."""

    grid: SheetGrid
    read: Sequence[int]
    skipped: Set[int]
    span: str | None  # The declared range

    def lettered(self, reference: str) -> list[str]:
        """Return a reference to rows as letters of columns of the turned sheet; a name as it is.

        A span leaves out blank and skipped rows. Raises SheetFaults for rows that are not read.
        """
        match = OF_ROWS.fullmatch(reference)
        if match is None:
            return [reference]
        first, last = int(match[1]), int(match[2] or match[1])
        rows = [number for number in self.read if first <= number <= last]
        filled = [row.number for row in self.grid.rows if first <= row.number <= last]
        lost = sorted({*filled, first, last} - {*rows, *self.skipped}) if match[2] else [first][: not rows]
        if lost or not rows:
            number = [*lost, first][0]
            why = f'outside of the range "{self.span}"' if number in filled and self.span else "skipped or blank"
            finding = f'row {number}, which "{reference}" includes, is {why}.'
            raise refuse(
                self.grid.place(number), finding, "Correct the rows in s and levels, or range and skip.", reference
            )
        return [f"{letters(number - 1)}:{letters(number - 1)}" for number in rows]


def _is_title(row: SheetRow) -> bool:
    return sum(bool(cell.text) for cell in row.cells) == 1 and not any(map(is_a_number, row.cells))


def _swapped(rows: Sequence[SheetRow]) -> tuple[SheetRow, ...]:
    """Return the columns of rows as rows. A cell keeps its place: blank rows become blank columns."""
    by_number = {row.number: row for row in rows}
    last, width = max(by_number, default=0), max((row.width for row in rows), default=0)
    blank = SheetRow(0, ())
    columns = (
        SheetRow(at + 1, tuple(by_number.get(number, blank).cell(at) for number in range(1, last + 1)))
        for at in range(width)
    )
    return tuple(row for row in columns if row.width)
