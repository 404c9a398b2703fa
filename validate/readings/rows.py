"""Read the rows of a table as stations with their readings, in millimetres."""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from sealtwin.core.doubts import CONFIRMS
from validate.readings.grid import BLANK, Cell, letters, listed, quoted
from validate.readings.reading_checks import ReadCells
from validate.readings.table import Column, Table, numeric
from validate.readings.words import (
    MM,
    Role,
    common_mark,
    is_ambiguous,
    is_calculated,
    is_missing,
    number,
)
from validate.settings import Decimal

CLOSEST = 2
"""Number of decimals of s in mm that distinguish stations, the resolution of a caliper. Readings with equal rounded s
are repeats at one station."""
SLACK_MM = 2.0
LONGEST_MM = 10_000.0  # Largest s for a crack of unknown length. A longer sample does not fit into a lab.
COMPLAINTS = {
    "formula": ("a formula without a stored result", "Open the workbook in a spreadsheet program and save it."),
    "error": ("an error of the spreadsheet", "Correct the formula, or clear the cell."),
    "date": ("a date; spreadsheets convert numbers such as 16.1 to dates", "Enter the number again."),
    "mark": ("a decimal mark that differs from the other cells", "Write all numbers with the same mark."),
    "word": ("a word instead of a number", "If it marks a missing reading, skip it."),
    "number": ("not a number in the unit of its column", "Skip it if it is not a reading."),
}
"""Findings and remedies for cells that cannot be read, by the kind of the cell or of its text."""


class Reading(NamedTuple):
    value_mm: float  # NaN if the reading is missing
    row: int
    column: int
    digit_mm: float = 1.0  # Place value of the last digit that is not 0


@dataclass(frozen=True)
class ReadRows:
    """Readings of a table, and the rows without readings."""

    cells: ReadCells
    mark: Decimal | None
    read: frozenset[int]  # Rows with a position and a reading
    passed: frozenset[int]  # Rows to skip, and rows of means or other calculated figures


def read_rows(table: Table) -> ReadRows:
    """Return the readings of a table, sorted along s. Cells that cannot be read are added to the table's doubts."""
    numbers = _Numbers(table)
    _ask_about_fields(table)
    passed = frozenset(_passed(table))
    stations = dict(_station_cells(table, passed))
    cells = _read_cells(table, _readings(table, numbers, stations))
    return ReadRows(cells, numbers.mark, frozenset(stations), passed)


def _station_cells(table: Table, passed: frozenset[int]) -> Iterator[tuple[int, Cell]]:
    """Yield each row that has readings, with the cell that gives its position."""
    above = BLANK
    for row in table.body if table.station else ():
        # The position in a skipped row applies to the repeats below it.
        cell = table.cell(row, table.used[0])
        above = cell if cell.text else above
        if row not in passed and _has_readings(table, row):
            yield row, above


def skipping(table: Table, cells: Sequence[str]) -> dict[str, list[str | int]]:
    """Return the answer that skips some readings, or the rows of some positions.

    Returns {} if these are half of all rows or more.
    """
    station = table.station.letters if table.station else ""
    entries = [int(row) if (row := cell.removeprefix(station)).isdigit() else cell for cell in cells]
    rows = {cell.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ") for cell in cells}
    return {"columns.skip": entries} if 2 * len(rows) < len(table.body) else {}


class _Numbers:
    """Numbers of cells in millimetres, and the cells that have no number."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self.mark: Decimal | None = _decimal_mark(table)
        self.unread = defaultdict[str, dict[str, str]](dict)  # Texts by fault, then by cell

    def reading(self, row: int, column: Column, cell: Cell) -> Reading:
        """Return the number in a cell as a reading of a row. Returns NaN if the number is missing or cannot be read.

        The fault of a cell that cannot be read is noted.
        """
        name, is_reading = f"{column.letters}{row}", column.role is Role.READING
        if name in self.table.chosen.skip or (is_reading and cell.kind == "text" and is_missing(cell.text)):
            return Reading(math.nan, row, column.index)
        (text, _), factor = numeric(cell) or ("", ""), MM[column.unit or "mm"]
        # The numbers of a workbook have a point.
        if (value := number(text, "point" if cell.kind == "number" else self.mark)) is not None:
            decimals = len(text.replace(",", ".").rstrip("0").partition(".")[2])
            return Reading(value * factor, row, column.index, factor * 10.0**-decimals)
        has_digits = any(map(str.isdigit, cell.text)) or not is_reading
        text_kind = "mark" if number(cell.text) is not None else "number" if has_digits else "word"
        self.unread[cell.kind if cell.kind in COMPLAINTS else text_kind][name] = cell.text
        return Reading(math.nan, row, column.index)

    def report(self) -> None:
        """Ask about cells that are not numbers, with one question for each kind of mistake."""
        for kind, cells in self.unread.items():
            finding, remedy = COMPLAINTS[kind]
            self.table.ask("cell", f"{_listed(cells)}: {finding}.", remedy, skipping(self.table, [*cells]), [*cells])


def _listed(cells: Mapping[str, str]) -> str:
    """Return cells with their texts, as words."""
    return listed([f"{name} {quoted(text)}" for name, text in cells.items()])


def _decimal_mark(table: Table) -> Decimal | None:
    cells = [(table.cell(row, k), k) for row in table.body for k in table.used if k is not table.repeat]
    texts = [(value[0], k) for cell, k in cells if cell.kind == "text" and (value := numeric(cell)) is not None]
    mark = table.declared.decimal or common_mark((text for text, _ in texts), table.grid.separator)
    ambiguous = [(text, k) for text, k in texts if is_ambiguous(text)]
    # No crack is 1,000 mm deep.
    if mark is None and any(k.role is Role.READING and k.unit not in (None, "\u00b5m") for _, k in ambiguous):
        return "comma" if "," in ambiguous[0][0] else "point"
    if mark is None and ambiguous:
        finding = f"the mark in {quoted(ambiguous[0][0])} may be a decimal mark, or it may separate thousands."
        table.ask("decimal", finding, "The decimal mark is comma or point.", {"decimal": None})
    return mark


def _ask_about_fields(table: Table) -> None:
    """Ask about rows with numbers beyond the header. If commas separate fields, these may be decimals."""
    last, cells = max(table.header.names, default=table.span[0].stop - 1), table.grid.rows
    rows = [f"{row}" for row in table.body if any(numeric(cell) for k, cell in cells[row].items() if k > last)]
    if rows and table.grid.separator == ",":
        finding = f"row {listed(rows)} has more fields than the header."
        remedy = "If these are decimal commas, save the sheet with semicolons between fields."
        table.ask("fields", finding, remedy, cells=rows)


def _passed(table: Table) -> Iterator[int]:
    """Yield the rows to skip, and the rows of means and other calculated figures."""
    entries, columns = {*map(str, table.chosen.skip)}, ["", *(column.letters for column in table.used)]
    if absent := entries - {f"{column}{row}" for row in table.body for column in columns}:
        finding = f"skip lists {listed(sorted(absent))}, which is neither a row nor a reading of the table."
        table.ask("skip", finding, "Correct skip. Rows are counted from 1.")
    for row in table.body:
        first = next(iter(table.part[row].values())).text
        # A word in front of a position is a remark: SD may be an operator.
        first = "" if table.station and numeric(table.cell(row, table.station)) else first
        labels = first, "" if table.repeat is None else table.cell(row, table.repeat).text
        if f"{row}" in entries or any(map(is_calculated, labels)):
            yield row


def _ask_about_order(table: Table, by_s: Mapping[float, Mapping[str, Reading]]) -> None:
    """Ask about positions out of order, since a digit may be wrong, or a second table may begin."""
    if table.station is None or table.repeat is not None or table.is_guessed:
        return
    signs = np.sign(np.diff([*by_s]))
    turns = [next(iter(readings.values())).row for readings in [*by_s.values()][1:-1]]
    cells = [f"{table.station.letters}{row}" for row, turn in zip(turns, signs[1:] != signs[:-1], strict=True) if turn]
    if cells := [cell for cell in cells if not table.confirms(cell)]:
        finding = f"the positions are out of order at {listed(cells)}."
        remedy = "Correct them, or confirm them, if the stations were read in this order."
        table.ask("order", finding, remedy, {CONFIRMS: cells}, cells)


def _has_readings(table: Table, row: int) -> bool:
    """Return whether a row has a position or a number. Rows with texts only are remarks."""
    station, *others = used = [table.cell(row, column) for column in table.used]
    # A date may be a number that a spreadsheet has converted.
    is_place = station.kind == "date" or station.text[:1].isdigit()
    is_place = is_place and any(cell.text for cell in others)
    return is_place or any(cell.kind not in ("text", "date") or numeric(cell) for cell in used)


def _readings(table: Table, numbers: _Numbers, stations: dict[int, Cell]) -> dict[float, dict[str, Reading]]:
    """Return the readings at each s, by the number of the repeat. Ask about rows without a position of their own.

    ``stations`` contains the cell that gives the position of each row.
    """
    column, repeat = table.station or Column(0, Role.STATION), table.repeat
    by_s, nearest = dict[float, dict[str, Reading]](), dict[float, float]()
    twice, blank = list[str](), list[str]()
    for row, cell in stations.items():
        name = f"{column.letters}{row}"
        is_blank = not table.cell(row, column).text
        s_mm = numbers.reading(row, column, cell).value_mm
        readings = [numbers.reading(row, column, table.cell(row, column)) for column in table.readings]
        if is_blank:
            blank.append(name)
        if math.isnan(s_mm):
            continue
        s_mm = nearest.setdefault(round(s_mm, CLOSEST), s_mm)
        of_station = by_s.setdefault(s_mm, {})
        is_twice = bool(of_station) and repeat is None and not table.confirms("repeats")
        for reading in () if is_twice else readings:
            label = f"{len(of_station) + 1}" if repeat is None else table.cell(row, repeat).text
            is_twice = is_twice or label in of_station or is_missing(label)
            of_station[label] = reading
        if is_twice and not is_blank:
            twice.append(name)
    numbers.report()
    _ask_about_order(table, by_s)
    if blank:
        remedy = "If these are repeats of the position above, confirm it. Otherwise write a position into every row."
        answers = {CONFIRMS: ["repeats"], **skipping(table, blank)}
        table.ask("place", f"{listed(blank)}: the readings have no position.", remedy, answers, blank)
    if twice:
        finding = f"the positions in {listed(twice)} occur twice, or with the same number of a repeat."
        remedy = "Correct them, or name the column that numbers the repeats (repeat)."
        answers = {CONFIRMS: ["repeats"]} if repeat is None else skipping(table, twice)
        table.ask("twice", finding, remedy, answers, twice)
    return {
        s_mm: readings
        for s_mm, readings in sorted(by_s.items(), key=itemgetter(0))
        if not all(math.isnan(reading.value_mm) for reading in readings.values())
    }


def _read_cells(table: Table, by_s: dict[float, dict[str, Reading]]) -> ReadCells:
    # Numbers by their size
    labels = sorted({*chain.from_iterable(by_s.values())}, key=lambda label: (len(label), label))
    rows = list[list[Reading]]()
    for readings in by_s.values():
        lacking = Reading(math.nan, next(iter(readings.values())).row, -1)
        rows.append([readings.get(label, lacking) for label in labels])
    parts = np.array(rows, float).reshape(len(by_s), len(labels), len(Reading._fields))
    readings_mm, cell_rows, columns, digits_mm = np.moveaxis(parts, -1, 0)
    return ReadCells(
        s_mm=np.array(_declared_places(table, [*by_s])),
        readings_mm=readings_mm,
        rows=cell_rows.astype(np.int64),
        columns=columns.max(axis=0, initial=-1).astype(np.int64),
        digits_mm=digits_mm,
        is_depth=table.quantity == "depth",
        datum_level_mm=table.declared.datum_level_mm or 0.0,
        station_column=table.station.index if table.station else 0,
    )


def _declared_places(table: Table, numbers: list[float]) -> list[float]:
    """Return the positions that the settings give for the station numbers, or the numbers if there are none."""
    places, count = table.chosen.places, len(numbers)
    if not isinstance(places, tuple) or count < 2:
        return numbers
    if len(places) not in (2, count):
        finding = f"places has {len(places)} numbers, but {count} positions have readings."
        table.ask("places", finding, "Give the first and the last position, or all.")
        return numbers
    return np.interp(numbers, numbers if len(places) == count else [numbers[0], numbers[-1]], places).tolist()


def check_in_crack(table: Table, cells: ReadCells, length_mm: float | None, depth_mm: float | None) -> None:
    """Ask about positions outside the crack, (n,), and about impossible levels, (n, r)."""
    # The length is uncertain by about a millimetre, or by a fraction of it due to the scale, and the last station may
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
