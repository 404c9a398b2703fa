"""The rows of a table as stations with their readings, in millimetres."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sealtwin.core.doubts import CONFIRMS
from validate.readings.grid import BLANK, Cell, letters, listed, quoted
from validate.readings.header import cells_in, numeric
from validate.readings.names import FACTORS, is_calculated
from validate.readings.numbers import common_mark, decimals_of, is_ambiguous, is_missing, number
from validate.readings.screens import ReadCells
from validate.readings.table import Column, Table
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


class _Reader:
    def __init__(self, table: Table) -> None:
        self.table, self.grid, self.chosen = table, table.grid, table.chosen
        self.mark: Decimal | None = self._decimal_mark()
        self.unread = defaultdict[str, dict[str, str]](dict)  # Texts by cell, by what is wrong

    def read(self) -> ReadRows:
        self._refuse_fields()
        passed = set(self._passed())
        repeat, station = self.table.repeat, self.table.station
        is_long = repeat is not None or "repeats" in (self.table.declared.as_written or ())
        stations = dict[float, dict[str, Reading]]()
        read, twice, blank, places, place = set[int](), list[str](), list[str](), dict[float, float](), BLANK
        for row in self.table.body:
            written = BLANK if station is None else self.grid.cell(row, station.index)
            # A row that is skipped has the place of the repeats below it.
            place = written if written.text else place
            if station is None or row in passed or not self._has_readings(row):
                continue
            cell = f"{letters(station.index)}{row}"
            blank += [] if written.text else [cell]
            s_mm = self._in_mm(row, station, place)
            readings = [self._reading(row, column) for column in self.table.readings]
            read.add(row)
            if s_mm is None:
                continue
            s_mm = places.setdefault(round(s_mm / CLOSEST_MM) if abs(s_mm) < HUGE_MM else s_mm, s_mm)
            of_station = stations.setdefault(s_mm, {})
            is_twice = bool(of_station) and not is_long
            for reading in () if is_twice else readings:
                label = self.grid.cell(row, repeat.index).text if repeat is not None else f"{len(of_station) + 1}"
                is_twice = is_twice or label in of_station or is_missing(label)
                of_station[label] = reading
            twice += [cell] if is_twice and cell not in blank else []
        self._report()
        if blank:
            remedy = "If these are repeats of the place above, confirm it; else write a place into every row."
            finding = f"{listed(blank)}: no place beside the readings."
            answers = {CONFIRMS: ["repeats"], **skipping(self.table, blank)}
            self.table.ask("place", finding, remedy, answers, blank, stops=True)
        if twice:
            finding = f"the places in {listed(twice)} occur twice, or with the same number of a repeat."
            remedy = "Correct them, or name the column that numbers the repeats (repeat)."
            answers = {CONFIRMS: ["repeats"]} if repeat is None else skipping(self.table, twice)
            self.table.ask("twice", finding, remedy, answers, twice, stops=True)
        kept = [each for each in sorted(stations.items()) if any(mm == mm for mm, *_ in each[1].values())]
        return ReadRows(self._arrays(dict(kept)), self.mark, frozenset(read), frozenset(passed))

    def _refuse_fields(self) -> None:
        """Ask about rows with numbers beyond the header: in a file with commas between fields, they may be decimals."""
        last = max(self.table.header.names, default=self.table.span.right)
        rows = [f"{row}" for row in self.table.body if any(map(numeric, self.grid.rows[row][last + 1 :]))]
        if rows and self.grid.separator == ",":
            finding = f"row {listed(rows)} has more fields than the header."
            remedy = "If these are decimal commas, save the sheet with semicolons between fields."
            self.table.ask("fields", finding, remedy, cells=rows)

    def _passed(self) -> Iterator[int]:
        """Yield the rows to skip, and the rows of means and other calculated figures."""
        entries, columns = {f"{entry}" for entry in self.chosen.skip}, [letters(each.index) for each in self.table.used]
        if absent := entries - {f"{column}{row}" for row in self.table.body for column in ("", *columns)}:
            finding = f"skip has {listed(sorted(absent))}, which is no row and no reading of the table."
            self.table.ask("skip", finding, "Correct skip; rows are counted from 1.")
        for row in self.table.body:
            first = next((cell.text for _, cell in cells_in(self.grid, self.table.span, row)), "")
            label = "" if self.table.repeat is None else self.grid.cell(row, self.table.repeat.index).text
            if f"{row}" in entries or is_calculated(first) or is_calculated(label):
                yield row

    def _has_readings(self, row: int) -> bool:
        """Return whether a row has a place or a number: rows of texts alone are remarks."""
        used = [self.grid.cell(row, column.index) for column in self.table.used]
        # A date may be a number that a spreadsheet has converted.
        is_place = used[0].kind == "date" or used[0].text[:1].isdigit()
        is_place = is_place and any(cell.text for cell in used[1:])
        return is_place or any(cell.kind not in ("text", "date") or numeric(cell) for cell in used)

    def _decimal_mark(self) -> Decimal | None:
        columns = [column for column in self.table.used if column is not self.table.repeat]
        cells = [self.grid.cell(row, column.index) for row in self.table.body for column in columns]
        texts = [value[0] for cell in cells if cell.kind == "text" and (value := numeric(cell)) is not None]
        mark = self.table.declared.decimal or common_mark(texts, self.grid.separator)
        if mark is None and (doubtful := [text for text in texts if is_ambiguous(text)]):
            finding = f"the mark in {quoted(doubtful[0])} is a decimal mark, or separates thousands."
            self.table.ask("decimal", finding, "The decimal mark is comma or point.", {"decimal": None})
        return mark

    def _reading(self, row: int, column: Column) -> Reading:
        cell = self.grid.cell(row, column.index)
        is_skipped = f"{letters(column.index)}{row}" in self.chosen.skip
        if is_skipped or (cell.kind == "text" and is_missing(cell.text)):
            return Reading(math.nan, row, column.index)
        value_mm = self._in_mm(row, column, cell)
        text = (numeric(cell) or ("", ""))[0]
        digit_mm = FACTORS[column.unit or "mm"] * 10.0 ** -decimals_of(text)
        return Reading(math.nan if value_mm is None else value_mm, row, column.index, digit_mm)

    def _in_mm(self, row: int, column: Column, cell: Cell) -> float | None:
        """Return the number of a cell in millimetres or None after noting what is wrong."""
        text = numeric(cell)
        value = None
        if cell.kind == "number":
            value = float(cell.text)
        elif text is not None:
            value = number(text[0], self.mark)
        if value is not None:
            return value * FACTORS[column.unit or "mm"]
        has_digits = any(map(str.isdigit, cell.text)) or column.role != "reading"
        text_kind = "mark" if number(cell.text) is not None else "number" if has_digits else "word"
        kind = cell.kind if cell.kind in COMPLAINTS else text_kind
        self.unread[kind][f"{letters(column.index)}{row}"] = cell.text
        return None

    def _report(self) -> None:
        """Ask about cells that are no numbers, with one question for each kind of mistake."""
        for kind, cells in self.unread.items():
            finding, remedy = COMPLAINTS[kind]
            texts = listed([f"{name} {quoted(text)}" for name, text in cells.items()])
            self.table.ask("cell", f"{texts}: {finding}.", remedy, skipping(self.table, [*cells]), [*cells])

    def _at_places(self, numbers: list[float]) -> list[float]:
        """Return the places that the settings give for the numbers of stations; without these, the numbers."""
        places, count = self.chosen.places, len(numbers)
        if not isinstance(places, tuple) or count < 2:
            return numbers
        if len(places) not in (2, count):
            finding = f"places has {len(places)} numbers, but {count} places have readings."
            self.table.ask("places", finding, "Give the first and the last place, or all.")
            return numbers
        return np.interp(numbers, numbers if len(places) == count else [numbers[0], numbers[-1]], places).tolist()

    def _arrays(self, stations: dict[float, dict[str, Reading]]) -> ReadCells:
        # Numbers by their size
        labels = sorted({label for own in stations.values() for label in own}, key=lambda label: (len(label), label))
        table = [
            [own.get(label) or Reading(math.nan, next(iter(own.values())).row, -1) for label in labels]
            for own in stations.values()
        ]
        parts = np.array(table, dtype=float).reshape(len(stations), len(labels), len(Reading._fields))
        readings_mm, columns = parts[..., 0], parts[..., 2]
        station = self.table.station
        return ReadCells(
            s_mm=np.array(self._at_places([*stations])),
            readings_mm=readings_mm,
            rows=parts[..., 1].astype(np.int64),
            columns=columns.max(axis=0, initial=-1).astype(np.int64),
            digits_mm=parts[..., 3],
            is_depth=self.table.quantity == "depth",
            datum_level_mm=self.table.declared.datum_level_mm or 0.0,
            station_column=0 if station is None else station.index,
        )


def read_rows(table: Table) -> ReadRows:
    """Return the readings of a table, sorted along s; what cannot be read is added to its doubts."""
    return _Reader(table).read()


def skipping(table: Table, cells: Sequence[str]) -> dict[str, list[str | int]]:
    """Return the answer that skips some readings, and the rows of some places; none for half of all rows."""
    place = "" if table.station is None else letters(table.station.index)
    entries = [int(row) if (row := cell.removeprefix(place)).isdigit() else cell for cell in cells]
    rows = {cell.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ") for cell in cells}
    return {"columns.skip": entries} if 2 * len(rows) < len(table.body) else {}


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
