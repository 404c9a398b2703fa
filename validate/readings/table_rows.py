"""The part of a sheet with its table: turned upright, limited to its range, with header rows and rows below."""

import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from validate.readings.header_words import holds_no_number, is_calculated, is_comment, is_number, meaning, unit_of
from validate.readings.sheet import BLANK, MOST_COLUMNS, FaultList, Place, SheetCell, SheetGrid, SheetRow, column_of
from validate.readings.text_table import is_missing, number
from validate.settings import Columns, Declared

MOST_LINES_ABOVE = 100
"""Limit on the lines of title and notes above a header; a header further down belongs to another table."""
MOST_HEADER_ROWS = 3
MOST_TURNED = 100
"""Limit on the rows of a sheet that is turned without a declaration: such sheets have few rows."""
Merged = Sequence[tuple[int, int, int, int]]  # Ranges of cells, as in ``SheetGrid``
DATE = re.compile(r"(?<!\d)(\d{1,2}\s?[./-]\s?\d{1,2}\s?[./-]\s?\d{2,4}|\d{4}-\d{2}-\d{2})(?!\d)")
LETTERS = re.compile(r"([A-Z]{1,3})(?::([A-Z]{1,3}))?")
SPAN = re.compile(r"([A-Z]*)([0-9]*):([A-Z]*)([0-9]*)")


@dataclass(frozen=True)
class HeaderRows:
    """Rows that contain the column names."""

    first: int  # Index of the first header row
    count: int
    names: Mapping[int, str]  # Name of each column from 0, joined from its cells


class TableRows(NamedTuple):
    rows: list[SheetRow]
    skipped: list[SheetRow]  # Comments, and declared rows to skip
    unmet: list[str]  # Declared rows to skip that do not exist


def upright(grid: SheetGrid, declared: Declared) -> SheetGrid:
    """Return a sheet with rows and columns swapped if that is declared, or if a table's names are in a column."""
    given = declared.columns or Columns()
    if given.transposed is None:
        rows = table_rows(grid, given).rows
        if not 1 < len(rows) < MOST_TURNED or _is_table(find_header(rows, grid.merged, given).names):
            return grid
        turned = _turned(grid)
        return turned if _is_table(find_header(turned.rows, (), given).names) else grid
    return _turned(grid) if given.transposed else grid


def _is_table(names: Mapping[int, str]) -> bool:
    roles = {named.role for name in names.values() if (named := meaning(name)) is not None}
    return {"station", "reading"} <= roles


def _turned(grid: SheetGrid) -> SheetGrid:
    numbers = {row.number: place for place, row in enumerate(grid.rows)}
    width = max((row.width for row in grid.rows), default=0)
    rows = [SheetRow(column + 1, tuple(row.cell(column) for row in grid.rows)) for column in range(width)]
    return replace(
        grid,
        rows=tuple(row for row in rows if row.width),
        written=(*grid.written, "stations in a row"),
        # Numbers of fields are checked in the file's rows, which are columns here.
        separator=";" if grid.separator == "," else grid.separator,
        merged=(),
        struck=frozenset((column + 1, numbers[row]) for row, column in grid.struck),
        shown_units={
            (column + 1, numbers[row]): unit for (row, column), unit in grid.shown_units.items() if row in numbers
        },
        hidden_rows=frozenset(column + 1 for column in grid.hidden_columns),
        hidden_columns=frozenset(numbers[row] for row in grid.hidden_rows if row in numbers),
        turned=tuple(row.number for row in grid.rows),
    )


def table_rows(grid: SheetGrid, given: Columns) -> TableRows:
    """Return the rows of a sheet within the declared range."""
    rows, skipped = [], []
    skip = {str(one) if isinstance(one, int) else plain_name(one): str(one) for one in given.skip}
    unmet = dict(skip)
    for row in within(grid.rows, given.range):
        first = first_cell(row)
        if first is None:
            continue
        if given.missing:
            row = SheetRow(row.number, tuple(BLANK if cell.text in given.missing else cell for cell in row.cells))
        named = {str(row.number), plain_name(first.text)} & skip.keys()
        unmet = {key: one for key, one in unmet.items() if key not in named}
        # "#5" before numbers may be the name of a row, or a commented-out row: it stays, so that it is a fault.
        comment = first.kind == "text" and is_comment(first.text) and sum(map(is_a_number, row.cells)) < 2
        (skipped if named or comment else rows).append(row)
    return TableRows(rows, skipped, list(unmet.values()))


def first_cell(row: SheetRow) -> SheetCell | None:
    return next((cell for cell in row.cells if cell != BLANK), None)


def within(rows: Sequence[SheetRow], span: str | None) -> Iterator[SheetRow]:
    """Yield the rows of a range. Cells outside the range are blank."""
    if span is None:
        yield from rows
        return
    first, top, last, bottom = SPAN.findall(span)[0]
    columns = range(column_of(first) if first else 0, column_of(last) + 1 if last else MOST_COLUMNS)
    numbers = range(int(top or 0), int(bottom or sys.maxsize - 1) + 1)
    for row in rows:
        if row.number in numbers:
            yield SheetRow(row.number, tuple(cell if at in columns else BLANK for at, cell in enumerate(row.cells)))


def find_header(rows: Sequence[SheetRow], merged: Merged, given: Columns) -> HeaderRows:
    """Return the rows that name the most columns. These are several if a name spans columns and continues below."""
    wanted = {plain_name(name) for name in (given.s, given.repeat, *(given.levels or ())) if name is not None}

    def key(candidate: tuple[int, Sequence[SheetRow]]) -> tuple[float, ...]:
        first, header = candidate
        names = _joined(header, merged)
        written = {at: name for at, name in names.items() if any(row.cell(at).text for row in header)}
        hits = len(wanted & set(map(plain_name, written.values())))
        # Of equals, prefer names of repeats below, then fewer rows, then the first; units are in a row of their own.
        return hits, *_likeness(written), len(header) > 1 and _names_repeats(header[-1]), -len(header), -first

    best = max(_candidates(rows, merged, given), key=key, default=(0, ()))
    hits, *likeness = key(best) if best[1] else (0, 0)
    if not hits and given.header_rows is not None:
        best = 0, rows[: given.header_rows]
    elif not hits and not any(likeness[:3]) and len(lettered := columns_named({}, given.s or "")) == 1:
        # All columns are given by letters: readings begin at the first number in the column of stations.
        first = next((at for at, row in enumerate(rows) if is_a_number(row.cell(lettered[0]))), 0)
        best = max(0, first - 1), rows[max(0, first - 1) : first]
    return HeaderRows(best[0], len(best[1]), _joined(best[1], merged))


def _candidates(rows: Sequence[SheetRow], merged: Merged, given: Columns) -> Iterator[tuple[int, Sequence[SheetRow]]]:
    """Yield the candidates for the header, each with the index of its first row."""
    for first in range(min(len(rows), MOST_LINES_ABOVE)):
        for count in range(1, MOST_HEADER_ROWS + 1) if given.header_rows is None else (given.header_rows,):
            header = rows[first : first + count]
            goes_on = count < 2 or given.header_rows is not None or _continues(_joined(header[:-1], merged), header[-1])
            if len(header) < count or not goes_on:
                break
            if header and not _is_dated(header[0]) and not _is_cut(header, merged):
                yield first, header


def plain_name(name: str) -> str:
    return " ".join(name.casefold().split())


def is_a_number(cell: SheetCell) -> bool:
    return cell.kind == "number" or (cell.kind == "text" and is_number(cell.text))


def columns_named(names: Mapping[int, str], reference: str) -> list[int]:
    """Return the columns for a reference: a name in the header, a letter, or a span of letters such as "B:D".

    The list is empty if a letter is also the name of another column, which would be ambiguous.
    """
    # "Ort" is a name, not letters.
    span = LETTERS.fullmatch(reference.upper() if reference.islower() else reference)
    columns = range(column_of(span[1]), column_of(span[2] or span[1]) + 1) if span else range(0)
    lettered = [column for column in columns if column < MOST_COLUMNS]
    # A capital means a letter of a column, unless a name has exactly that spelling.
    same = str.strip if lettered and reference.isupper() else plain_name
    matches = [column for column, name in names.items() if same(name) == same(reference)]
    return [] if matches and matches != lettered and names.keys() & set(lettered) else matches or lettered


def blocks(rows: Sequence[SheetRow]) -> Iterator[range]:
    """Yield spans of neighbouring columns with content; blank columns separate tables side by side."""
    filled = sorted({at for row in rows for at, cell in enumerate(row.cells) if cell != BLANK})
    begin = 0
    for at in range(len(filled)):
        if at + 1 == len(filled) or filled[at + 1] > filled[at] + 1:
            yield range(filled[begin], filled[at] + 1)
            begin = at + 1


def _is_dated(row: SheetRow) -> bool:
    """Return whether a row contains a date and little else, unlike any header."""
    cells = [cell for cell in row.cells if cell != BLANK]
    return len(cells) < 3 and any(cell.kind == "date" or DATE.search(cell.text) for cell in cells)


def _continues(names: Mapping[int, str], below: SheetRow) -> bool:
    """Return whether a row continues a header: words, or repeat numbers 1, 2, 3 in a header with a station column."""
    cells = [cell for cell in below.cells if cell != BLANK]
    numbers = [cell.text for cell in cells if cell.kind != "text" or is_number(cell.text)]
    if numbers:
        stations = [at for at, name in names.items() if (named := meaning(name)) and named.role == "station"]
        counted = numbers == [str(number) for number in range(1, len(numbers) + 1)]
        return counted and bool(stations) and all(unit_of(below.cell(at).text or "mm") for at in stations)
    return not all(unit_of(cell.text) or is_missing(cell.text) for cell in cells)


def _names_repeats(row: SheetRow) -> bool:
    """Return whether a row contains only names of readings, such as "Messung 1", or their numbers."""
    texts = [cell.text for cell in row.cells if cell.text]
    roles = {named.role for text in texts if not is_number(text) and (named := meaning(text)) is not None}
    return roles <= {"reading", "repeat"} and all(is_number(text) or meaning(text) is not None for text in texts)


def _is_cut(header: Sequence[SheetRow], merged: Merged) -> bool:
    """Return whether a name is merged with cells above or below the header."""
    first, last = header[0].number, header[-1].number
    return any(
        top < first <= bottom or first <= top <= last < bottom < top + MOST_HEADER_ROWS for top, _, bottom, _ in merged
    )


def _joined(rows: Sequence[SheetRow], merged: Merged) -> dict[int, str]:
    """Join the names of each column: "Tiefe [mm]" above "Messung 1" and "Messung 2" is part of both.

    A name spans the cells that it is merged with, or blank cells up to the next name. A merged name without names below
    it is the name of repeats, which are then numbered.
    """
    spans = {(row, column): min(last, MOST_COLUMNS) for row, column, last_row, last in merged if last_row == row}
    width = max((row.width for row in rows), default=0)
    names, own = dict[int, str](), set[int]()
    for place, row in enumerate(rows):
        below = {at for other in rows[place + 1 :] for at, cell in enumerate(other.cells) if cell.text}
        starts = [at for at, cell in enumerate(row.cells) if cell.text]
        is_merged = any((row.number, at) in spans for at in starts)
        for start, following in zip(starts, [*starts[1:], None], strict=True):
            last = spans.get((row.number, start), start)
            beyond = last + 1 if is_merged or not below else following or 1 + max(start, *below)
            for at in range(start, beyond):
                if at == start or at in below:
                    names[at] = _either(names.get(at, ""), row.cell(start).text, whole=at in own)
                elif not below:
                    names[at] = f"{row.cell(start).text} {at - start + 1}"
            if last > start and not below and len(rows) == 1:
                names[start] += " 1"
            # A name that is merged over some columns is part of their names; over all columns it is a title.
            own |= set(range(start, last + 1)) if last > start and last - start + 1 < width else set()
    return dict(sorted(names.items()))


def _either(upper: str, lower: str, *, whole: bool) -> str:
    """Join two names. If only one has a meaning, such as the one below a title, return that one, unless ``whole``."""
    joined = f"{upper} {lower}".strip()
    if whole or not upper or not lower or meaning(joined) is not None:
        return joined
    return next((name for name in (lower, upper) if meaning(name) is not None), joined)


def _likeness(names: Mapping[int, str]) -> tuple[bool, bool, int, int, int]:
    """Return a sort key that grows with the number of names that have a meaning. Notes above may have some, too."""
    roles = [named.role for name in names.values() if (named := meaning(name)) is not None]
    along = "station" in roles or "mass" in roles
    table = along and ("reading" in roles or "repeat" in roles)
    return table, along, sum(role != "skipped" for role in roles), len(roles), min(len(names), 2)


def sorted_rows(
    place: Place, body: Sequence[SheetRow], station: int, readings: Sequence[int], faults: FaultList
) -> tuple[list[SheetRow], list[SheetRow], list[SheetRow]]:
    """Divide the rows below a header into stations, remarks, and calculated rows such as means.

    A second table below the first is a fault: the user must declare which one is meant.
    """
    stations, remarks, passed = list[SheetRow](), list[SheetRow](), list[SheetRow]()
    words_between = None
    for row in body:
        first, station_cell = first_cell(row), row.cell(station)
        cells = [cell for column in readings if not is_missing((cell := row.cell(column)).text) or cell.kind != "text"]
        is_text = station_cell.kind == "text" and not is_a_number(station_cell)
        words = is_text and all(cell.kind == "text" and holds_no_number(cell.text) for cell in (station_cell, *cells))
        if first is not None and first.kind == "text" and is_calculated(first.text):
            passed.append(row)
        elif is_text and (again := meaning(station_cell.text)) is not None and again.role in ("station", "mass"):
            break
        elif (words and (cells or not is_missing(station_cell.text))) or (is_text and station_cell.text and not cells):
            remarks.append(row)
            words_between = row if stations else None
        else:
            s, s_before = (number(each.cell(station).text, None) for each in (row, (stations or [row])[-1]))
            if words_between is not None and s is not None and s_before is not None and s < s_before:
                break
            stations.append(row)
            words_between = None
    else:
        return stations, remarks, passed
    spans = f'"{place.row}:{row.number - 1}" or "{row.number}:{body[-1].number}"'
    finding = f"a second table begins in row {row.number}, below the first."
    faults.add(replace(place, row=row.number), finding, f"Select one: [readings.columns] range = {spans}.")
    return stations, remarks, passed
