"""The rows of a table as stations with their readings, in millimetres."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sealtwin.core.doubts import CONFIRMS, Mean
from validate.readings.grid import BLANK, Cell, letters, listed, quoted
from validate.readings.screens import ReadCells
from validate.readings.table import Column, Table, numeric
from validate.readings.words import (
    FACTORS,
    Role,
    common_mark,
    decimals_of,
    is_ambiguous,
    is_calculated,
    is_missing,
    number,
)
from validate.settings import Decimal

CLOSEST_MM = 0.01
"""Smallest distance between two stations: the last digit of a caliper. Closer ones are one station, read twice."""
SLACK_MM = 2.0
HUGE_MM = 1e9  # Numbers above are no places, and too large to be divided
LONGEST_MM = 10_000.0  # Limit on s for a crack of unknown length: a longer sample does not fit into a lab
COMPLAINTS = {
    "formula": ("a formula without a stored result", "Open the workbook in a spreadsheet program and save it."),
    "error": ("an error of the spreadsheet", "Correct the formula, or clear the cell."),
    "date": ("a date; spreadsheets convert numbers such as 16.1 to dates", "Enter the number again."),
    "mark": ("another decimal mark than in the other cells", "Write all numbers with one mark."),
    "word": ("no number, but a word", "If it marks a missing reading, skip it."),
    "number": ("no number in the unit of its column", "Skip it if it is no reading."),
}
"""Findings about cells that cannot be read, and remedies, by the kind of the cell or of its text."""


class Reading(NamedTuple):
    value_mm: float  # NaN if it is missing
    row: int
    column: int
    digit_mm: float = 1.0  # Place value of its last digit that is not 0


@dataclass(frozen=True)
class ReadRows:
    """Readings of a table, and the rows that have none."""

    cells: ReadCells
    mark: Decimal | None
    read: frozenset[int]  # Rows with a place and a reading
    passed: frozenset[int]  # Rows to skip, rows of means, and rows that are asked about
    means: tuple[Mean, ...]  # Of the other quantities


def read_rows(table: Table) -> ReadRows:
    """Return the readings of a table, sorted along s; what cannot be read is added to its doubts."""
    numbers = _Numbers(table)
    _ask_about_fields(table)
    passed, places, above = frozenset(_passed(table)), dict[int, Cell](), BLANK
    for row in () if table.station is None else table.body:
        # A row that is skipped has the place of the repeats below it.
        cell = table.grid.cell(row, table.used[0].index)
        above = cell if cell.text else above
        if row not in passed and _has_readings(table, row):
            places[row] = above
    cells = _read_cells(table, _stations(table, numbers, places))
    means = tuple(_means(table, numbers, places))
    return ReadRows(cells, numbers.mark, frozenset(places), passed, means)


def skipping(table: Table, cells: Sequence[str]) -> dict[str, list[str | int]]:
    """Return the answer that skips some readings, and the rows of some places; none for half of all rows."""
    place = "" if table.station is None else letters(table.station.index)
    entries = [int(row) if (row := cell.removeprefix(place)).isdigit() else cell for cell in cells]
    rows = {cell.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ") for cell in cells}
    return {"columns.skip": entries} if 2 * len(rows) < len(table.body) else {}


class _Numbers:
    """The numbers of cells in millimetres, and the cells that have none."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self.mark: Decimal | None = _decimal_mark(table)
        self.unread = defaultdict[str, dict[str, str]](dict)  # Texts by cell, by what is wrong

    def reading(self, row: int, column: Column) -> Reading:
        cell = self.table.grid.cell(row, column.index)
        is_skipped = f"{letters(column.index)}{row}" in self.table.chosen.skip
        if is_skipped or (cell.kind == "text" and is_missing(cell.text)):
            return Reading(math.nan, row, column.index)
        value_mm, text = self.in_mm(row, column, cell), (numeric(cell) or ("", ""))[0]
        digit_mm = FACTORS[column.unit or "mm"] * 10.0 ** -decimals_of(text)
        return Reading(math.nan if value_mm is None else value_mm, row, column.index, digit_mm)

    def in_mm(self, row: int, column: Column, cell: Cell) -> float | None:
        """Return the number of a cell in millimetres, or None after noting what is wrong."""
        if (value := value_of(cell, self.mark)) is not None:
            return value * FACTORS[column.unit or "mm"]
        has_digits = any(map(str.isdigit, cell.text)) or column.role is not Role.READING
        text_kind = "mark" if number(cell.text) is not None else "number" if has_digits else "word"
        kind = cell.kind if cell.kind in COMPLAINTS else text_kind
        self.unread[kind][f"{letters(column.index)}{row}"] = cell.text
        return None

    def report(self) -> None:
        """Ask about cells that are no numbers, with one question for each kind of mistake."""
        for kind, cells in self.unread.items():
            finding, remedy = COMPLAINTS[kind]
            texts = listed([f"{name} {quoted(text)}" for name, text in cells.items()])
            self.table.ask("cell", f"{texts}: {finding}.", remedy, skipping(self.table, [*cells]), [*cells])


def value_of(cell: Cell, mark: Decimal | None) -> float | None:
    """Return the number of a cell in its own unit; None for another cell, or another decimal mark."""
    if (text := numeric(cell)) is None:
        return None
    return float(text[0]) if cell.kind == "number" else number(text[0], mark)


def _decimal_mark(table: Table) -> Decimal | None:
    columns = [column for column in table.used if column is not table.repeat]
    cells = [table.grid.cell(row, column.index) for row in table.body for column in columns]
    texts = [value[0] for cell in cells if cell.kind == "text" and (value := numeric(cell)) is not None]
    mark = table.declared.decimal or common_mark(texts, table.grid.separator)
    if mark is None and (doubtful := [text for text in texts if is_ambiguous(text)]):
        finding = f"the mark in {quoted(doubtful[0])} is a decimal mark, or separates thousands."
        table.ask("decimal", finding, "The decimal mark is comma or point.", {"decimal": None})
    return mark


def _ask_about_fields(table: Table) -> None:
    """Ask about rows with numbers beyond the header: in a file with commas between fields, they may be decimals."""
    last = max(table.header.names, default=table.span.right)
    cells = {row: table.grid.rows[row] for row in table.body}
    rows = [f"{row}" for row in cells if any(numeric(cell) for k, cell in cells[row].items() if k > last)]
    if rows and table.grid.separator == ",":
        finding = f"row {listed(rows)} has more fields than the header."
        remedy = "If these are decimal commas, save the sheet with semicolons between fields."
        table.ask("fields", finding, remedy, cells=rows)


def _passed(table: Table) -> Iterator[int]:
    """Yield the rows to skip, and the rows of means and other calculated figures."""
    entries, columns = {f"{entry}" for entry in table.chosen.skip}, [letters(each.index) for each in table.used]
    if absent := entries - {f"{column}{row}" for row in table.body for column in ("", *columns)}:
        finding = f"skip has {listed(sorted(absent))}, which is no row and no reading of the table."
        table.ask("skip", finding, "Correct skip; rows are counted from 1.")
    for row in table.body:
        first = next((cell.text for cell in table.part[row].values()), "")
        label = "" if table.repeat is None else table.grid.cell(row, table.repeat.index).text
        if f"{row}" in entries or is_calculated(first) or is_calculated(label):
            yield row


def _has_readings(table: Table, row: int) -> bool:
    """Return whether a row has a place or a number: rows of texts alone are remarks."""
    used = [table.grid.cell(row, column.index) for column in table.used]
    # A date may be a number that a spreadsheet has converted.
    is_place = used[0].kind == "date" or used[0].text[:1].isdigit()
    is_place = is_place and any(cell.text for cell in used[1:])
    return is_place or any(cell.kind not in ("text", "date") or numeric(cell) for cell in used)


def _stations(table: Table, numbers: _Numbers, places: dict[int, Cell]) -> dict[float, dict[str, Reading]]:
    """Return the readings of each place by the number of the repeat; ask about rows without a place of their own."""
    repeat = table.repeat
    is_long = repeat is not None or "repeats" in (table.declared.as_written or ())
    stations, rounded = dict[float, dict[str, Reading]](), dict[float, float]()
    twice, blank = list[str](), list[str]()
    for row, place in places.items():
        column = table.used[0]
        name, has_place = f"{letters(column.index)}{row}", bool(table.grid.cell(row, column.index).text)
        blank += [] if has_place else [name]
        s_mm = numbers.in_mm(row, column, place)
        readings = [numbers.reading(row, column) for column in table.readings]
        if s_mm is None:
            continue
        s_mm = rounded.setdefault(round(s_mm / CLOSEST_MM) if abs(s_mm) < HUGE_MM else s_mm, s_mm)
        of_station = stations.setdefault(s_mm, {})
        is_twice = bool(of_station) and not is_long
        for reading in () if is_twice else readings:
            label = f"{len(of_station) + 1}" if repeat is None else table.grid.cell(row, repeat.index).text
            is_twice = is_twice or label in of_station or is_missing(label)
            of_station[label] = reading
        twice += [name] if is_twice and has_place else []
    numbers.report()
    if blank:
        remedy = "If these are repeats of the place above, confirm it; else write a place into every row."
        answers = {CONFIRMS: ["repeats"], **skipping(table, blank)}
        table.ask("place", f"{listed(blank)}: no place beside the readings.", remedy, answers, blank, stops=True)
    if twice:
        finding = f"the places in {listed(twice)} occur twice, or with the same number of a repeat."
        remedy = "Correct them, or name the column that numbers the repeats (repeat)."
        answers = {CONFIRMS: ["repeats"]} if repeat is None else skipping(table, twice)
        table.ask("twice", finding, remedy, answers, twice, stops=True)
    read = {s_mm for s_mm, readings in stations.items() if not all(math.isnan(mm) for mm, *_ in readings.values())}
    return {s_mm: stations[s_mm] for s_mm in sorted(read)}


def _read_cells(table: Table, stations: dict[float, dict[str, Reading]]) -> ReadCells:
    # Numbers by their size
    labels = sorted({label for own in stations.values() for label in own}, key=lambda label: (len(label), label))
    lacking = [Reading(math.nan, next(iter(own.values())).row, -1) for own in stations.values()]
    readings = [[own.get(label, no) for label in labels] for own, no in zip(stations.values(), lacking, strict=True)]
    parts = np.array(readings, dtype=float).reshape(len(stations), len(labels), len(Reading._fields))
    return ReadCells(
        s_mm=np.array(_declared_places(table, [*stations])),
        readings_mm=parts[..., 0],
        rows=parts[..., 1].astype(np.int64),
        columns=parts[..., 2].max(axis=0, initial=-1).astype(np.int64),
        digits_mm=parts[..., 3],
        is_depth=table.quantity == "depth",
        datum_level_mm=table.declared.datum_level_mm or 0.0,
        station_column=0 if table.station is None else table.station.index,
    )


def _declared_places(table: Table, numbers: list[float]) -> list[float]:
    """Return the places that the settings give for the numbers of stations; without these, the numbers."""
    places, count = table.chosen.places, len(numbers)
    if not isinstance(places, tuple) or count < 2:
        return numbers
    if len(places) not in (2, count):
        finding = f"places has {len(places)} numbers, but {count} places have readings."
        table.ask("places", finding, "Give the first and the last place, or all.")
        return numbers
    return np.interp(numbers, numbers if len(places) == count else [numbers[0], numbers[-1]], places).tolist()


def _means(table: Table, numbers: _Numbers, places: dict[int, Cell]) -> Iterator[Mean]:
    """Yield the mean of each column of another quantity, over the rows with readings."""
    for column, what in table.others.items():
        values = [value_of(table.grid.cell(row, column), numbers.mark) for row in places]
        if what.role.is_quantity and (known := [value for value in values if value is not None]):
            yield Mean(what.role.value, float(np.mean(known)), what.unit or "", len(known))


def check_in_crack(table: Table, cells: ReadCells, length_mm: float | None, depth_mm: float | None) -> None:
    """Ask about places outside the crack, (n,), and about impossible levels, (n, r)."""
    # The length is uncertain by about a millimetre, or by a share of it through the scale, and the last station may
    # be at the crack's end. At the beginning the scale has no effect.
    end_mm = LONGEST_MM if length_mm is None else length_mm
    outside = np.flatnonzero((cells.s_mm < -SLACK_MM) | (cells.s_mm > end_mm + max(SLACK_MM, 0.03 * end_mm)))
    if outside.size:
        names = [f"{letters(cells.station_column)}{cells.rows[i].min()}" for i in outside]
        finding = f"{cells.s_mm[outside[0]]:.12g} mm in {listed(names)} is outside the crack, 0 to {end_mm:.1f} mm."
        remedy = "Check the unit, the end at which s is 0, and that the whole crack was traced."
        table.ask("outside", finding, remedy, {"columns.skip": None}, names)
    if depth_mm is None:
        return
    # Hand-made floors are uneven by up to a quarter of the depth, and beads of paste are a few millimetres high.
    lowest_mm, highest_mm = -1.25 * depth_mm - 1.0, max(5.0, depth_mm / 2)
    wrong = np.argwhere((cells.levels_mm < lowest_mm) | (cells.levels_mm > highest_mm))
    if len(wrong):
        names = [f"{letters(int(cells.columns[j]))}{cells.rows[i, j]}" for i, j in wrong]
        i, j = wrong[0]
        finding = (
            f"{cells.readings_mm[i, j]:g} mm in {listed(names)} is a level of {cells.levels_mm[i, j]:g} mm from the "
            f"face; in a crack {depth_mm:g} mm deep, {lowest_mm:g} to {highest_mm:g} mm is possible."
        )
        remedy = "Level counts upward, depth downward: check the column's name, its unit and the zero."
        table.ask("deep", finding, remedy, skipping(table, names), names)
