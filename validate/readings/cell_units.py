"""Units outside a column's name: in a row below it, in its cells, and in a neighbouring column."""

from collections.abc import Iterator, Mapping, Sequence, Set
from typing import NamedTuple

from validate.readings.header_words import (
    OTHER_UNITS,
    PREPOSITIONS,
    ColumnUnit,
    holds_no_number,
    is_scaled_unit,
    names_unit,
    unit_of,
)
from validate.readings.sheet import SheetCell, SheetRow
from validate.readings.table_rows import is_a_number
from validate.readings.text_table import is_missing, plain_letters

LONGEST_UNIT = 8  # Letters of a word in a row of units, as [°C] or Uhrzeit
LETTERED = 2  # Fewest letters of units in a column that is not named as such: M and G are also initials


class UnitCell(NamedTuple):
    """A unit that a row gives for one of its readings."""

    row: SheetRow
    column: int  # Column of the reading
    at: int  # Column of the unit
    written: str
    unit: ColumnUnit | None  # None for an unsupported one, as mil or %


def units_row(row: SheetRow) -> tuple[dict[int, ColumnUnit], dict[int, str]]:
    """Return the length units of a row by column, and its other words. Both are empty if it is no row of units."""
    texts = {index: cell.text for index, cell in enumerate(row.cells) if not is_missing(cell.text)}
    units: dict[int, ColumnUnit] = {index: unit for index, text in texts.items() if (unit := unit_of(text)) is not None}
    others = {index: text for index, text in texts.items() if index not in units}
    short = all(
        (len(text) <= LONGEST_UNIT and holds_no_number(text)) or is_scaled_unit(text) for text in others.values()
    )
    return (units, others) if units and short and len(others) <= len(units) else ({}, {})


def units_between(rows: Sequence[SheetRow], names: Mapping[int, str]) -> dict[int, str]:
    """Return the text of each column in rows of units between the rows of a header.

    A unit goes on over blank cells, as the name of a group of repeats does.
    """
    units: dict[int, str] = {}
    for row in rows:
        last = ""
        for at in range(max(names, default=-1) + 1):
            last = row.cell(at).text or last
            if last and at in names:
                units[at] = last
    return units


def units_in_cells(body: Sequence[SheetRow]) -> tuple[list[SheetRow], dict[int, ColumnUnit]]:
    """Return the rows without units behind their numbers, and the unit of each column if all its numbers have it."""
    by_column: dict[int, set[ColumnUnit | None]] = {}
    for row in body:
        for at, cell in enumerate(row.cells):
            if is_a_number(cell) or (cell.kind == "text" and is_a_number(SheetCell(_without_unit(cell.text)))):
                by_column.setdefault(at, set()).add(unit_of(cell.text.rpartition(" ")[2]))
    units: dict[int, ColumnUnit] = {at: one for at, (one, *more) in by_column.items() if one is not None and not more}
    stripped = [
        SheetRow(
            row.number,
            tuple(
                SheetCell(_without_unit(cell.text)) if at in units and cell.kind == "text" else cell
                for at, cell in enumerate(row.cells)
            ),
        )
        for row in body
    ]
    return (stripped, units) if units else (list(body), {})


def _without_unit(text: str) -> str:
    head, _, last = text.rpartition(" ")
    return head.strip() if unit_of(last) is not None else text


def bare(cell: SheetCell) -> SheetCell:
    """Return a cell of text without a unit behind its number."""
    return SheetCell(_without_unit(cell.text)) if cell.kind == "text" else cell


def columns_of_units(names: Mapping[int, str], taken: Set[int], body: Sequence[SheetRow]) -> list[int]:
    """Return the columns outside ``taken`` that contain only units or are named as units."""
    others = [at for at in range(max((row.width for row in body), default=0)) if at not in taken]
    return [at for at in others if _holds_units(names.get(at, ""), [row.cell(at) for row in body])]


def _holds_units(name: str, cells: Sequence[SheetCell]) -> bool:
    texts = [cell.text for cell in cells if not is_missing(cell.text)]
    if names_unit(name):
        return bool(texts)
    if name and any(plain_letters(text) in PREPOSITIONS for text in texts):
        # Status = "In" means within its tolerance.
        return False
    units = [text for text in texts if unit_of(text) is not None or plain_letters(text) in OTHER_UNITS]
    return bool(texts) and len(units) == len(texts) and all(len(text.strip("[]()")) >= LETTERED for text in units)


def unit_cells(
    body: Sequence[SheetRow],
    columns: Sequence[int],
    stations: Set[int],
    readings: Sequence[int],
    without: Sequence[int],
) -> Iterator[UnitCell]:
    """Yield the unit that each row gives in ``columns`` for its reading, or for its station.

    A column of units belongs to the readings on its left, up to the previous one. If only stations are on its left, it
    belongs to them. If it is also the only column of units, it belongs to the readings on its right that are
    ``without`` a unit as well.
    """
    before = -1
    for at in columns:
        on_left = [column for column in sorted({*stations, *readings}) if before < column < at]
        of_readings = [column for column in on_left if column in readings]
        of = of_readings or [*on_left, *(column for column in without if column > at and len(columns) == 1)]
        before = at
        for row in body:
            written = row.cell(at).text
            if is_missing(written):
                continue
            for column in of:
                if not is_missing(row.cell(column).text):
                    yield UnitCell(row, column, at, written, unit_of(written))


def shown_cells(
    body: Sequence[SheetRow], shown: Mapping[tuple[int, int], str], columns: Sequence[int]
) -> Iterator[UnitCell]:
    """Yield the units, and percent signs, that number formats show behind numbers."""
    for row in body:
        for column in columns:
            written = shown.get((row.number, column))
            if written is None or row.cell(column).kind != "number":
                continue
            unit = unit_of(written)
            if unit is not None or written == "%" or plain_letters(written) in OTHER_UNITS:
                yield UnitCell(row, column, column, written, unit)
