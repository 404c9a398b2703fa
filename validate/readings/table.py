"""Find the table of a sheet: its header, and the columns of positions, readings and numbers of repeats.

The names in the header or the settings give the unit of each column and the direction of the readings.
"""

import re
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import chain, product, takewhile
from typing import Any, get_args

import numpy as np

from sealtwin.core.doubts import Doubt
from validate.readings.grid import BLANK, MAX_COLUMNS, Cell, Grid, column_of, letters, listed, quoted
from validate.readings.words import (
    MM,
    Meaning,
    Role,
    meaning,
    number,
    parsed,
    sample_key,
    stated,
    unit_of,
    unnumbered,
)
from validate.settings import Columns, Declared, Quantity, Unit

MAX_ROWS = 3  # Largest number of rows in a header
FIRST_ROWS = 60  # Number of first rows in which a header must begin
MAX_FILE_ROWS = 10**9  # A number above every row number in a file
LONGEST_LABEL = 12  # Largest number of characters of a repeat's label in a header's second row
SPAN = re.compile(r"([A-Z]*)([0-9]*):([A-Z]*)([0-9]*)")
QUANTITY = re.compile(r"(\S*[0-9][^\s\u00b5\u03bca-zA-Z\"%]*)\s*([^\W\d_]{1,12}|\"|%)")
"""A number followed by a unit."""
WAYS = {"level": "level upward", "depth": "depth downward", None: "reading"}


Rows = Mapping[int, Mapping[int, Cell]]
"""Cells with content, by row number from 1, then by column from 0."""


@dataclass(frozen=True)
class Header:
    rows: tuple[int, ...]  # Numbers of its rows. Empty if the sheet begins with readings.
    names: Mapping[int, str]  # Names of the columns, by their number from 0
    first: int  # Number of the first row below the header


@dataclass
class Column:
    index: int  # Number from 0
    role: Role
    unit: str | None = None
    quantity: Quantity | None = None

    @property
    def letters(self) -> str:
        return letters(self.index)

    @property
    def in_words(self) -> str:
        if self.role is Role.REPEAT:
            return self.role.value
        quantity = "s" if self.role is Role.STATION else WAYS[self.quantity]
        return f"{quantity}, {self.unit or 'no unit'}"


@dataclass
class Table:
    """The table of readings in a sheet. If a question asks for a column, the most likely column is used meanwhile."""

    grid: Grid
    declared: Declared
    span: tuple[range, range]  # Columns and rows of the part of the sheet that contains the table
    part: Rows  # Cells of these columns, down to the last of these rows
    header: Header
    body: list[int]  # Rows with cells below the header
    doubts: list[Doubt]  # Questions about the sheet so far, and possible mistakes
    meanings: dict[int, Meaning]  # Meanings of the columns by their names
    station: Column | None = None
    readings: list[Column] = field(default_factory=list[Column])
    repeat: Column | None = None
    others: dict[int, Column] = field(default_factory=dict[int, Column])  # Columns that are known to have another role
    unclear: list[int] = field(default_factory=list[int])  # Columns that may be the answer to a question
    likely: list[int] = field(default_factory=list[int])  # Used columns whose names are only understood in part
    is_guessed: bool = False  # True if columns were chosen although no name and no setting gives them

    @property
    def chosen(self) -> Columns:
        return self.declared.columns or Columns()

    @property
    def used(self) -> list[Column]:
        return [column for column in (self.station, self.repeat, *self.readings) if column is not None]

    @property
    def quantity(self) -> Quantity | None:
        return self.readings[0].quantity if self.readings else None

    def cell(self, row: int, column: Column) -> Cell:
        return self.grid.cell(row, column.index)

    def ask(
        self,
        kind: str,
        finding: str,
        remedy: str = "",
        answers: Mapping[str, Any] | None = None,
        cells: Sequence[str] = (),
    ) -> None:
        """Add a question about the sheet.

        If ``answers`` has the key ``as_written``, a user can confirm the text as it is.
        """
        self.doubts.append(Doubt(kind, self.grid.location(), finding, remedy, answers or {}, tuple(cells)))

    def remark(self, kind: str, finding: str, cells: Sequence[str] = ()) -> None:
        """Add a remark, which needs no answer. ``as_written`` with its cells removes it."""
        self.doubts.append(Doubt(kind, self.grid.location(), finding, cells=tuple(cells), is_remark=True))

    def confirms(self, entry: str) -> bool:
        """Return whether ``as_written`` confirms an entry: a cell, the cell's row or the cell's column."""
        parts = {entry, entry.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ"), entry.rstrip("0123456789")} - {""}
        return not parts.isdisjoint(self.declared.as_written or ())

    def is_open(self, *kinds: str) -> bool:
        """Return whether a question of one of these kinds must be answered. Without kinds, any question counts."""
        return any(not doubt.is_remark and (not kinds or doubt.kind in kinds) for doubt in self.doubts)

    def column(self, index: int, role: Role) -> Column:
        return Column(index, role, parsed(self.header.names.get(index, "")).unit, self.what(index).quantity)

    def what(self, column: int) -> Meaning:
        """Return the role, unit and direction that a column's name states."""
        return self.meanings.get(column, Meaning(Role.OTHER))

    def numbers(self, column: int) -> list[float]:
        """Return the numbers in a column, with any decimal mark."""
        cells = (self.grid.cell(row, column) for row in self.body)
        return [number(value[0]) or 0.0 for cell in cells if (value := numeric(cell))]

    def is_index(self, column: int) -> bool:
        """Return whether a column counts rows or stations from 0 or 1, as programs write it."""
        numbers = self.numbers(column)
        return len(numbers) > 2 and numbers[0] in (0, 1) and {*np.diff(numbers)} in ({1}, {0, 1})

    def is_ordered(self, column: int) -> bool:
        """Return whether a column has numbers that only rise or only fall."""
        steps = np.diff(self.numbers(column))
        return bool(steps.size and abs(steps.sum()) == abs(steps).sum())

    def named(self, columns: Sequence[int]) -> str:
        names = self.header.names
        return listed([f"column {letters(k)}{f' {quoted(names[k])}' if k in names else ''}" for k in columns])


def find_table(grid: Grid, declared: Declared) -> Table:
    """Return the table with the columns of positions and readings.

    Questions about the sheet are added to its doubts. If a column is unclear, the most likely one is used meanwhile, so
    that all other questions can be asked at the same time.
    """
    # Without a range, or without one of its ends, all columns and rows count
    left, top, right, bottom = SPAN.findall((declared.columns or Columns()).range or ":")[0]
    columns = range(max(0, column_of(left)), (column_of(right) if right else MAX_COLUMNS) + 1)
    rows = range(int(top or 1), int(bottom or MAX_FILE_ROWS) + 1)
    part = {
        row: {column: cell for column, cell in cells.items() if column in columns}
        for row, cells in grid.rows.items()
        if row < rows.stop
    }
    header = find_header(part, rows.start)
    body = [row for row in part if row >= header.first and part[row]]
    # CloudCompare writes the number of points below the header.
    if body and grid.texts(body[0]) == (f"{len(body) - 1}",):
        body = body[1:]
    table = Table(grid, declared, (columns, rows), part, header, body, [*grid.doubts], _meanings(header.names))
    _end_before_next_table(table)
    _set_columns(table)
    _ask_for_units(table)
    _ask_for_direction(table)
    return table


def find_header(part: Rows, top: int) -> Header:
    """Return the header of the table in a part of a sheet that begins at row ``top``. It may be above this row.

    Without names of columns, the header has no rows.
    """
    rows = [*part]
    start, end = bisect_left(rows, top), len(rows)
    # A part without a header uses the header of the rows above it.
    indices = [*range(start, min(start + FIRST_ROWS, end)), *range(start - 1, -1, -1)]
    # Rows with units and with the numbers of repeats belong to the header above them.
    for is_whole, index, count in product((True, False), indices, range(MAX_ROWS, 0, -1)):
        header = rows[index : index + count]
        if _is_header([part[row] for row in header], is_whole):
            header += [row for row in rows[index + count : index + count + 1] if _labels_repeats(part, row)]
            return Header(tuple(header), _names_of([part[row] for row in header]), max(header[-1] + 1, top))
    # Without known names, the header is the rows of texts above the first row with numbers.
    data = [row for row in rows[start:] if _has_numbers(part[row]) and not _labels_repeats(part, row)]
    first = next(iter(data), rows[start] if start < end else top)
    above = reversed(range(first - MAX_ROWS, first))
    texts = takewhile(lambda row: len(part.get(row, ())) > 1 and row not in data, above)
    header = tuple(texts)[::-1]
    return Header(header, _names_of([part[row] for row in header]), first)


def _names_of(rows: Sequence[Mapping[int, Cell]]) -> dict[int, str]:
    """Return the names of the columns in the rows of a header.

    A name in an upper row also names the columns to its right that have no name there: "Depth" above "1", "2" and "3"
    is part of all three names.
    """
    names, left = dict[int, str](), [""] * len(rows)
    for column in sorted({column for cells in rows for column in cells}):
        texts = [cells.get(column, BLANK).text for cells in rows]
        left = [text or beside for text, beside in zip(texts, left, strict=True)]
        while texts and not texts[-1]:
            texts.pop()
        if parts := [*filter(None, left[: len(texts)])]:
            names[column] = " ".join(dict.fromkeys(parts))
    return names


def _is_header(rows: Sequence[Mapping[int, Cell]], is_whole: bool) -> bool:
    """Return whether rows are a header: names of positions and of readings, and no number."""
    if any(sum(bool(cell.text) for cell in cells.values()) < 2 for cells in rows):
        return False
    meanings = _meanings(_names_of(rows))
    roles = {column: entry.role for column, entry in meanings.items() if entry.is_whole or not is_whole}
    stations = [column for column, role in roles.items() if role is Role.STATION]
    has_number = any(numeric(cells.get(column, BLANK)) for cells in rows for column in stations)
    return _are_of_a_header({*roles.values()}) and not has_number


def _meanings(names: Mapping[int, str]) -> dict[int, Meaning]:
    """Return the known meanings of names by column."""
    return {column: entry for column, name in names.items() if (entry := meaning(name)) is not None}


def _are_of_a_header(roles: set[Role]) -> bool:
    return Role.STATION in roles and not roles.isdisjoint({Role.READING, Role.REPEAT})


def _has_numbers(cells: Mapping[int, Cell]) -> bool:
    are_numbers = [numeric(cell) is not None for cell in cells.values()]
    return sum(are_numbers) > max(1, len(are_numbers) / 2)


def _labels_repeats(part: Rows, row: int) -> bool:
    """Return whether a row has 1, 2, 3 or other labels below names, and nothing in the first column."""
    above, texts = part.get(row - 1, {}), [cell.text for cell in part[row].values()]
    are_labels = len(texts) > 1 and all(number(text) is None and len(text) <= LONGEST_LABEL for text in texts)
    are_labels |= texts == [f"{1 + count}" for count in range(len(texts))]
    return bool(above) and min(above) < min(part[row]) and are_labels


@lru_cache(maxsize=50_000)
def numeric(cell: Cell) -> tuple[str, str] | None:
    """Return the number of a cell and the unit after it, both as text. Returns None for any other cell."""
    if cell.kind == "number" or (cell.kind == "text" and number(cell.text) is not None):
        return cell.text, cell.unit
    match = QUANTITY.fullmatch(cell.text) if cell.kind == "text" else None
    if match is None or number(match[1]) is None or not (match[2] == "%" or unit_of(match[2])):
        return None
    return match[1], match[2]


def roles_in(cells: Iterable[Cell]) -> set[Role]:
    """Return the known roles of columns that are named in these cells."""
    meanings = (meaning(cell.text) for cell in cells if number(cell.text) is None)
    return {entry.role for entry in meanings if entry is not None and entry.is_whole}


def _end_before_next_table(table: Table) -> None:
    """Use only the first of several tables one below the other, and ask for a range."""
    for count, row in enumerate(table.body):
        if count and _are_of_a_header(roles_in(table.part[row].values())):
            _ask_for_range(table, f"another table begins in row {row}.")
            table.body = table.body[:count]
            return


def _ask_for_range(table: Table, finding: str, rows: str | None = None) -> None:
    remedy = 'Name the cells of the table of this sample, such as "A2:D18", or sort rows of several samples in a copy.'
    table.ask("range", finding, remedy, {"columns.range": rows})


def _set_columns(table: Table) -> None:
    """Set the columns of a table from its names and the settings, or ask for them."""
    chosen, cells = table.chosen, chain.from_iterable(table.part[row].items() for row in table.body)
    numbers = sorted({column for column, cell in cells if numeric(cell) or cell.kind == "formula"})
    names = {column: table.header.names.get(column, "") for column in numbers}
    meanings = table.meanings = {
        column: entry for column, entry in table.meanings.items() if entry.is_whole or column in numbers
    }
    settings = {Role.STATION: chosen.s, Role.READING: chosen.levels, Role.REPEAT: chosen.repeat, Role.NEW: None}
    stations, readings, repeats, new = (
        [column for column, entry in meanings.items() if entry.role is role]
        if entries is None
        else _lettered(table, [entries] if isinstance(entries, str) else entries, numbers)
        for role, entries in settings.items()
    )
    if chosen.s is None:
        # Among several columns of positions, those out of order are other figures, and one may only count the rows.
        stations = [column for column in stations if column in numbers]
        for may_be in (table.is_ordered, lambda column: not table.is_index(column)):
            stations = [*filter(may_be, stations)] or stations
    if chosen.levels is not None:
        repeats = [column for column in repeats if column not in readings and len(readings) == 1]
    assigned = ({*meanings} - {*new}) | {*stations, *readings, *repeats}
    unknown = [column for column in numbers if column not in assigned and not table.is_index(column)]
    unknown = unknown if chosen.s is None or chosen.levels is None else []
    places = [column for column in new if column in unknown and meanings[column].unit and table.is_ordered(column)]
    if len(places) == 1 and all(map(table.is_index, stations)):
        stations, unknown = places, [column for column in unknown if column not in places]
    if not readings and {*unknown} <= {*new} and len({unnumbered(names[k])[0] for k in unknown}) == 1:
        # Columns that remain, with names that differ by the number of a repeat
        readings, unknown = unknown, []
    if not readings and not unknown:
        # A column named only "Messung" contains the readings, unless another column contains them. It then counts
        # repeats.
        readings, repeats = repeats, []
    for column, entry in meanings.items():
        if entry.role is Role.SAMPLE:
            _ask_about_samples(table, column)
    if problems := [*_problems(table, stations, readings, repeats, unknown)]:
        table.is_guessed = not (stations and readings)
        stations, readings = _guessed_columns(table, stations, readings, unknown, numbers, f"{'; '.join(problems)}.")
        repeats = []
        # Another column may be the answer: its name is asked about in the same round.
        table.unclear = sorted({*unknown} - {*stations, *readings})
    elif chosen.s is None and chosen.levels is None:
        table.likely = [column for column in (*stations, *readings) if not meanings[column].is_whole]
    table.station = next((table.column(k, Role.STATION) for k in stations), None)
    table.readings = [table.column(k, Role.READING) for k in readings]
    table.repeat = next((table.column(k, Role.REPEAT) for k in repeats), None)
    used = {column.index for column in table.used}
    table.others = {k: Column(k, entry.role, entry.unit) for k, entry in meanings.items() if k not in used}


def _lettered(table: Table, entries: Sequence[str], numbers: Sequence[int]) -> list[int]:
    """Return the columns given by letters or spans of letters, such as "B" and "C:D"."""
    columns, empty = dict[int, None](), list[str]()
    for entry in entries:
        first, _, last = entry.partition(":")
        of_entry = {*range(column_of(first), column_of(last or first) + 1)} & {*table.header.names, *numbers}
        columns |= dict.fromkeys(sorted(of_entry))
        empty += [] if of_entry else [entry]
    if empty:
        table.ask("columns", f"{listed(empty)} is not a column of the table.", "Name columns by their letters.")
    return [*columns]


def _problems(
    table: Table, stations: Sequence[int], readings: Sequence[int], repeats: Sequence[int], unknown: Sequence[int]
) -> Iterator[str]:
    """Yield what is unclear about the columns, as parts of a sentence."""
    meanings = [*map(table.what, readings)]
    if len(stations) != 1 or {*stations} & {*readings}:
        yield f"{table.named(stations) or 'no column'} gives the position along the crack"
    if not readings:
        yield "no column is named as a reading"
    if unknown:
        yield f"{table.named(unknown)} has numbers under an unknown name"
    if table.chosen.levels is None:
        if len({(entry.unit, entry.quantity) for entry in meanings}) > 1:
            yield f"{table.named(readings)} differ in unit or direction"
        names = {unnumbered(table.header.names.get(column, ""))[0] for column in readings}
        if len(names) > 1 and not all(entry.is_whole for entry in meanings):
            yield f"{table.named(readings)} differ by unknown words"
        numbers = [entry.number for entry in meanings]
        if len({*numbers}) not in (1, len(numbers)) or any(int(number or 0) > len(numbers) for number in numbers):
            yield f"{table.named(readings)} has a number that is not the number of a repeat"
    if len(repeats) > 1 or (repeats and len(readings) > 1):
        yield f"{table.named(repeats)} counts repeats by its name, as do other columns"


def _guessed_columns(
    table: Table,
    stations: list[int],
    readings: list[int],
    unknown: Sequence[int],
    numbers: Sequence[int],
    finding: str,
) -> tuple[list[int], list[int]]:
    """Return the most likely columns, and ask for the right ones."""
    likely = unknown or numbers
    beside = [column for column in readings if stations[1:] and column < stations[1]]
    if beside and beside != readings:
        _ask_for_range(table, f"{finding} Are there several tables?")
        return stations[:1], beside
    is_known = len(stations) == 1 and not table.is_index(stations[0])
    answers: dict[str, Any] = {"columns.s": letters(stations[0]) if is_known else None}
    stations = sorted(stations, key=lambda column: table.what(column).unit is None)
    stations = (stations or [column for column in likely if column not in readings])[:1]
    named = [column for column in readings if column not in stations]
    kinds = {column: (table.what(column).unit, table.what(column).quantity) for column in named}
    named = [column for column in named if kinds[column] == kinds[named[0]]]
    # With a column of numbers under an unknown name, any proposal may lose readings.
    answers["columns.levels"] = [*map(letters, named)] if named and not unknown else None
    remedy = "Name the columns of positions and readings by their letters. Transpose a table of rows in a copy."
    table.ask("columns", finding, remedy, answers)
    return stations, named or [column for column in likely if column not in stations]


def _ask_about_samples(table: Table, column: int) -> None:
    """If a column names several samples, use the rows of one sample and ask for a range."""
    names, name, sample = dict[str, list[int]](), "", table.declared.sample or table.grid.path.stem
    for row in table.body:
        name = table.grid.cell(row, column).text or name
        names.setdefault(name, []).append(row)
    if len(names) > 1:
        finding = f"column {letters(column)} names several samples: {listed([*map(quoted, names)])}."
        rows = names[min(names, key=lambda name: sample_key(name) != sample_key(sample))]
        is_block = table.body.index(rows[-1]) - table.body.index(rows[0]) == len(rows) - 1
        _ask_for_range(table, finding, f"{rows[0]}:{rows[-1]}" if is_block else None)
        table.body = rows


def _ask_for_units(table: Table) -> None:
    """Set the unit of each column from its name, its cells or the settings, and ask for missing units."""
    declared, places = table.declared.unit, table.chosen.places
    lacking, another, is_needed = list[Column](), list[int](), False
    in_texts, _ = _stated(table)
    for column in table.used:
        if column is table.repeat:
            continue
        values = [numeric(table.cell(row, column)) for row in table.body]
        texts = dict.fromkeys(value[1] for value in values if value is not None)
        units = {column.unit, *(unit_of(text) or text for text in texts)} - {None, ""}
        if units - MM.keys() or len(units) > 1 or (units and "" in texts and column.unit is None):
            finding = f"column {column.letters} has {' and '.join(filter(None, texts))} in its cells"
            table.ask("unit", f"{finding}, and its name has {column.unit or 'no unit'}.", "Write all in one unit.")
        setting = declared
        if column.role is Role.STATION and places is not None:
            setting = "mm" if isinstance(places, tuple) else places
        unit = next(filter(None, (column.unit, *map(unit_of, texts), None if setting else in_texts)), None)
        lacking += [column] if unit is None and setting is None else []
        another += [column.index] if unit and setting not in (None, unit) else []
        is_needed |= unit is None
        column.unit = unit or setting
    if another and places is None and not is_needed:
        finding = f"{table.named(another)} has another unit than the settings, {declared}."
        table.ask("unit", finding, "Remove the setting, or correct the header.")
    if lacking:
        remedy = f"Units are {', '.join(get_args(Unit))}."
        answers = {"columns.places" if column is table.station else "unit": None for column in lacking}
        finding = f"{table.named([column.index for column in lacking])} has no unit."
        table.ask("unit", finding, remedy, answers, [column.letters for column in lacking])


def _stated(table: Table) -> tuple[str | None, Quantity | None]:
    """Return the unit and the direction that texts outside the rows of readings, or in all of these rows, state."""
    units, quantities = set[str](), set[Quantity]()
    rows = [{cell.text for cell in table.part[row].values()} for row in table.body]
    always = set.intersection(*rows) if rows else ()
    for row in table.part.keys() - table.header.rows:
        cells = table.part[row].values()
        for text in (cell.text for cell in cells if cell.text in always or not any(map(numeric, cells))):
            of_text, quantity = stated(text)
            units, quantities = units | of_text, quantities | quantity
    return units.pop() if len(units) == 1 else None, quantities.pop() if len(quantities) == 1 else None


def _ask_for_direction(table: Table) -> None:
    written: set[Quantity] = {column.quantity for column in table.readings if column.quantity is not None}
    quantity = table.declared.quantity or next(iter(written), None) or _stated(table)[1]
    if written - {quantity}:
        finding = f"the header has {' and '.join(sorted(written))}, but only one of them is read."
        table.ask("quantity", finding, "Remove the setting, or choose other columns.")
    elif quantity is None and table.readings:
        finding = "nothing says whether the readings count upward from the face (level) or downward (depth)."
        table.ask("quantity", finding, answers={"quantity": None})
    for column in table.readings:
        column.quantity = quantity
