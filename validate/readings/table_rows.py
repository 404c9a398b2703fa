"""The part of a sheet with its table: limited to its range, with header rows and rows below."""

import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from validate.readings.header_words import (
    CODE,
    holds_no_number,
    is_calculated,
    is_comment,
    is_number,
    meaning,
)
from validate.readings.place_words import only_number
from validate.readings.sheet import (
    BLANK,
    MOST_COLUMNS,
    FaultList,
    SheetCell,
    SheetGrid,
    SheetRow,
    column_of,
    letters,
)
from validate.readings.text_table import (
    is_missing,
    number,
    several,
    without_missing,
)
from validate.settings import Columns

LETTERS = re.compile(r"([A-Z]{1,3})(?::([A-Z]{1,3}))?")
SKIPPED_ROW = re.compile(r"(?:row\s+)?([1-9][0-9]*)", re.IGNORECASE)
MOST_TEXTS = 3  # Texts in a row that may be a title or a remark
SPAN = re.compile(r"([A-Z]*)([0-9]*):([A-Z]*)([0-9]*)")


class TableRows(NamedTuple):
    rows: list[SheetRow]
    skipped: list[SheetRow]  # Comments, and declared rows to skip
    declared: frozenset[int]  # Numbers of the declared ones
    unmet: list[str]  # Declared rows to skip that do not exist


def table_rows(grid: SheetGrid, given: Columns) -> TableRows:
    """Return the rows of a sheet within the declared range.

    Raises SheetFaults for a number to skip that may be that of a row, or the first cell of another row.
    """
    rows, skipped, declared = list[SheetRow](), list[SheetRow](), set[int]()
    inside = [row for row in within(grid.rows, given.range) if first_cell(row) is not None]
    meant = {f"{one}": _skipped_by(one, inside) for one in given.skip}
    _refuse_ambiguous(grid, meant, inside)
    for row in inside:
        first = first_cell(row) or BLANK
        if given.missing:
            cells = (cell._replace(text=without_missing(cell.text, given.missing)) for cell in row.cells)
            row = SheetRow(row.number, tuple(cell if cell.text else BLANK for cell in cells))
        named = any(row.number in numbers for numbers in meant.values())
        declared |= {row.number} if named else set()
        # "#5" before numbers may be the name of a row, or a commented-out row: it stays, so that it is a fault.
        comment = first.kind == "text" and is_comment(first.text) and sum(map(is_a_number, row.cells)) < 2
        comment = comment and not _counts_repeats(row)
        (skipped if named or comment else rows).append(row)
    return TableRows(rows, skipped, frozenset(declared), [one for one, numbers in meant.items() if not numbers])


def _skipped_by(entry: str | int, rows: Sequence[SheetRow]) -> set[int]:
    """Return the numbers of the rows that an entry of ``skip`` means: 9, "row 9", "cell 9", or a first cell's text."""
    match = SKIPPED_ROW.fullmatch(f"{entry}".strip())
    if match is not None:
        return {row.number for row in rows if f"{row.number}" == match[1]}
    name = plain_name(f"{entry}")
    return _beginning_with(name, rows) or _beginning_with(name.removeprefix("cell "), rows)


def _beginning_with(name: str, rows: Sequence[SheetRow]) -> set[int]:
    return {row.number for row in rows if (first := first_cell(row)) is not None and plain_name(first.text) == name}


def _refuse_ambiguous(grid: SheetGrid, meant: Mapping[str, set[int]], rows: Sequence[SheetRow]) -> None:
    """Raise SheetFaults, with every fault, if numbers to skip are also the first cells of other rows."""
    faults = FaultList()
    for entry, numbers in meant.items():
        if (others := _beginning_with(entry.strip(), rows) - numbers) and entry.strip().isdecimal():
            finding = f"skip has {entry}, which may be row {entry}, or the first cell of row {min(others)}."
            remedy = f'Write "row {entry}" or "cell {entry}" into skip.'
            faults.add(grid.place(min(others)), finding, remedy, entry)
    faults.raise_if_any()


def _counts_repeats(row: SheetRow) -> bool:
    """Return whether a row consists of the names #1, #2 and so on."""
    texts = [cell.text for cell in row.cells if cell != BLANK]
    return len(texts) > 1 and texts == [f"#{number}" for number in range(1, len(texts) + 1)]


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


def common_lines(rows: Sequence[SheetRow], span: str | None) -> list[SheetRow]:
    """Return lines of text outside a range, which may be about the whole sheet; names of columns are none."""
    inside = {row.number: row for row in within(rows, span)}
    lines = list[SheetRow]()
    for row in rows:
        own = inside.get(row.number, SheetRow(row.number, ()))
        cells = tuple(BLANK if own.cell(at) != BLANK else cell for at, cell in enumerate(row.cells))
        texts = [cell for cell in cells if cell != BLANK]
        is_header = len(texts) > 1 and any(meaning(cell.text) for cell in texts)
        if 0 < len(texts) <= MOST_TEXTS and not is_header and not any(map(is_a_number, texts)):
            lines.append(SheetRow(row.number, cells))
    return lines


def span_of_numbers(rows: Sequence[SheetRow]) -> str:
    """Return the range of the cells with numbers, such as B2:D9; "" if there are none."""
    cells = [(row.number, at) for row in rows for at, cell in enumerate(row.cells) if is_a_number(cell)]
    if not cells:
        return ""
    numbers, columns = zip(*cells, strict=True)
    return f"{letters(min(columns))}{min(numbers)}:{letters(max(columns))}{max(numbers)}"


def plain_name(name: str) -> str:
    return " ".join(name.casefold().split())


def is_a_number(cell: SheetCell) -> bool:
    """Return whether a cell contains a number, or several."""
    return cell.kind == "number" or (cell.kind == "text" and (is_number(cell.text) or bool(several(cell.text))))


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


def which_table(first: str, second: str) -> str:
    """Return the remedy if a sheet has several tables."""
    return (
        "Write into the column range of its row in pairing.csv (in a trial: [readings.columns] range) the cells of "
        f'this sample\'s table, "{first}" or "{second}". Add a row of this file for the other, with its sample or '
        "the role ignore."
    )


def sorted_rows(
    grid: SheetGrid,
    begin: int,
    names: Mapping[int, str],
    body: Sequence[SheetRow],
    station: int,
    readings: Sequence[int],
    faults: FaultList,
) -> tuple[list[SheetRow], list[SheetRow], list[SheetRow]]:
    """Divide the rows below a header into stations, remarks, and calculated rows such as means.

    ``begin`` is the number of the header's row, ``names`` are those of its columns. A second table below the first is a
    fault: the user must declare which one is meant.
    """
    stations, remarks, passed = list[SheetRow](), list[SheetRow](), list[SheetRow]()
    words_between = None
    for row in body:
        first, station_cell = first_cell(row), row.cell(station)
        cells = [cell for column in readings if not is_missing((cell := row.cell(column)).text) or cell.kind != "text"]
        is_text = station_cell.kind == "text" and not is_a_number(station_cell)
        named = {at: row.cell(at) for at in (station, *readings)}
        words = is_text and all(cell.kind == "text" and holds_no_number(cell.text) for cell in (station_cell, *cells))
        if first is not None and first.kind == "text" and is_calculated(first.text):
            passed.append(row)
        elif (is_text and (again := meaning(station_cell.text)) is not None and again.role in ("station", "mass")) or (
            is_text and all(cell.text and cell.text in names.get(at, "") for at, cell in named.items())
        ):
            break
        elif (words and (cells or not is_missing(station_cell.text))) or (is_text and station_cell.text and not cells):
            remarks.append(row)
            words_between = row if stations else None
        else:
            s, s_before = (number(each.cell(station).text, None) for each in (row, (stations or [row])[-1]))
            goes_back = s is not None and s_before is not None and s < s_before
            if words_between is not None and (goes_back or CODE.fullmatch((first_cell(words_between) or BLANK).text)):
                break
            stations.append(row)
            words_between = None
    else:
        return stations, remarks, passed
    remedy = which_table(f"{begin}:{row.number - 1}", f"{row.number}:{body[-1].number}")
    faults.add(grid.place(row.number), f"a second table begins in row {row.number}, below the first.", remedy)
    return stations, remarks, passed


def has_readings(row: SheetRow, station: int, readings: Sequence[int]) -> bool:
    """Return whether a row has a place and a reading."""
    return any(map(str.isdigit, row.cell(station).text)) and any(is_a_number(row.cell(at)) for at in readings)


def rows_beyond(
    rows: Sequence[SheetRow], inside: Sequence[SheetRow], span: str | None, columns: Sequence[int], *, has_header: bool
) -> list[int]:
    """Return the numbers of the rows outside a range, with places and readings, at which the places of the range go on.

    They end where places begin again, as those of another sample do, or at a line of text. ``columns`` are those of the
    stations and of the readings. Above a header is another table.
    """
    numbers = {row.number for row in inside}
    if span is None or not numbers:
        return []
    below = [row for row in rows if row.number > max(numbers)]
    above = [] if has_header else [row for row in rows[::-1] if row.number < min(numbers)]
    beyond = [*_going_on(inside, below, columns), *_going_on(inside[::-1], above, columns)]
    return sorted(row.number for row in beyond if has_readings(row, columns[0], columns[1:]))


def _going_on(inside: Iterable[SheetRow], beyond: Iterable[SheetRow], columns: Sequence[int]) -> Iterator[SheetRow]:
    """Yield the rows of ``beyond`` whose places go on in the direction of the last places of ``inside``."""
    places = [place for row in inside if (place := only_number(row.cell(columns[0]))) is not None]
    if not places:
        return
    steps = [after - before for before, after in pairwise(places) if after != before]
    last, direction = places[-1], steps[-1] if steps else 0.0
    for row in beyond:
        place, first = only_number(row.cell(columns[0])), first_cell(row)
        if first is not None and first.kind == "text" and is_calculated(first.text):
            continue
        if place is None or (place - last) * direction < 0:
            return
        direction = place - last or direction
        last = place
        yield row
