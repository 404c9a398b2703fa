"""The header of a sheet: up to three rows with the names of its columns."""

import re
import sys
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from validate.readings.grid import BLANK, MOST_COLUMNS, Cell, Grid, column_of
from validate.readings.names import Role, meaning, unit_of
from validate.readings.numbers import number

MOST_ROWS = 3  # Rows of a header
FIRST_ROWS = 60  # Rows among which it begins
SPAN = re.compile(r"([A-Z]*)([0-9]*):([A-Z]*)([0-9]*)")
QUANTITY = re.compile(r"(\S*[0-9][^\s\u00b5\u03bca-zA-Z\"%]*)\s*([^\W\d_]{1,12}|\"|%)")
"""A number and the unit behind it."""


class SheetPart(NamedTuple):
    """Part of a sheet: columns from 0, rows from 1, the last ones included."""

    left: int = 0
    top: int = 1
    right: int = MOST_COLUMNS
    bottom: int = sys.maxsize

    @classmethod
    def of(cls, text: str | None) -> "SheetPart":
        """Return the part that a range such as "A1:D8", "A:D" or "1:8" means; all without one."""
        if text is None:
            return cls()
        left, top, right, bottom = SPAN.findall(text)[0]
        return cls(
            column_of(left) if left else 0,
            int(top or 1),
            column_of(right) if right else MOST_COLUMNS,
            int(bottom or sys.maxsize),
        )


@dataclass(frozen=True)
class Header:
    rows: tuple[int, ...]  # Numbers of its rows; none if the sheet begins with readings
    names: Mapping[int, str]  # Names of the columns, by their number from 0
    first: int  # Number of the first row below it


@lru_cache(maxsize=50_000)
def numeric(cell: Cell) -> tuple[str, str] | None:
    """Return the number of a cell and the unit behind it, both as text; None for another cell."""
    if cell.kind == "number" or (cell.kind == "text" and number(cell.text) is not None):
        return cell.text, cell.unit
    match = QUANTITY.fullmatch(cell.text) if cell.kind == "text" else None
    if match is None or number(match[1]) is None or not (match[2] == "%" or unit_of(match[2])):
        return None
    return match[1], match[2]


def find_header(grid: Grid, span: SheetPart) -> Header:
    """Return the header of the table in a part of a sheet. Without names of columns it has no rows."""
    rows = [row for row in grid.rows if row <= span.bottom]
    inside = [row for row in rows if row >= span.top]
    # A part without a header has that of the rows above it.
    above = [row for row in reversed(rows) if row < span.top]
    for begin in (*inside[:FIRST_ROWS], *above):
        index, header = bisect_left(rows, begin), None
        for count in range(1, MOST_ROWS + 1):
            candidate = rows[index : index + count]
            # Rows with units and with the numbers of repeats belong to the header above them.
            if names := _names_if_header(grid, span, candidate):
                header = Header(tuple(candidate), names, max(candidate[-1] + 1, span.top))
        if header is not None:
            return header
    # Without known names, it is the rows of texts above the first row with numbers.
    first = next((row for row in inside if _has_numbers(grid, span, row)), inside[0] if inside else span.top)
    texts = [row for row in rows if first - MOST_ROWS <= row < first and len([*cells_in(grid, span, row)]) > 1]
    texts = tuple(row for row in texts if {*range(row, first)} <= {*texts} and not _has_numbers(grid, span, row))
    return Header(texts, names_of(grid, span, texts), first)


def names_of(grid: Grid, span: SheetPart, rows: Sequence[int]) -> dict[int, str]:
    """Return the names of the columns in the rows of a header.

    A name above others is that of the columns to its right without one: "Depth" above "1", "2" and "3" is in each.
    """
    names = dict[int, str]()
    for column in range(span.left, min(max((len(grid.rows[row]) for row in rows), default=0), span.right + 1)):
        parts = list[str]()
        for count, row in enumerate(rows, start=1):
            text = grid.cell(row, column).text
            if not text and any(grid.cell(lower, column).text for lower in rows[count:]):
                left = (grid.cell(row, other).text for other in range(column - 1, span.left - 1, -1))
                text = next(filter(None, left), "")
            parts += [text] if text and text not in parts else []
        if parts:
            names[column] = " ".join(parts)
    return names


def _names_if_header(grid: Grid, span: SheetPart, rows: Sequence[int]) -> dict[int, str] | None:
    """Return the names in rows if these are a header: with a column of places and one of readings, and no number."""
    if any(sum(bool(cell.text) for cell in grid.rows[row]) < 2 for row in rows):
        return None
    names = names_of(grid, span, rows)
    meanings = {column: what for column, name in names.items() if (what := meaning(name)) is not None}
    stations = [column for column, what in meanings.items() if what.role == "station"]
    if not stations or not any(what.role in ("reading", "repeat") for what in meanings.values()):
        return None
    return None if any(numeric(grid.cell(row, column)) for row in rows for column in stations) else names


def _has_numbers(grid: Grid, span: SheetPart, row: int) -> bool:
    are_numbers = [numeric(cell) is not None for _, cell in cells_in(grid, span, row)]
    return sum(are_numbers) > max(1, len(are_numbers) / 2)


def roles_in(names: Iterable[str]) -> set[Role]:
    """Return the roles of columns with these names, as far as they are known."""
    texts = (name for name in names if number(name) is None)
    return {what.role for what in map(meaning, texts) if what is not None}


def lettered(entry: str) -> range:
    """Return the columns that a letter or a span of letters means, such as "B" or "B:D"."""
    first, _, last = entry.partition(":")
    return range(column_of(first), column_of(last or first) + 1)


def cells_in(grid: Grid, span: SheetPart, row: int) -> Iterator[tuple[int, Cell]]:
    """Yield the columns and cells with content of a row within a part of a sheet."""
    for column, cell in enumerate(grid.rows.get(row, ())):
        if cell != BLANK and span.left <= column <= span.right:
            yield column, cell
