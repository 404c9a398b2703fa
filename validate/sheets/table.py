"""The rows under a header: places and readings, or what is wrong with each cell."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sealtwin.records import Floats
from validate.settings import Decimal, Declared, Unit
from validate.sheets.columns import Column, Header
from validate.sheets.decimals import common_mark, is_either, is_grouped, is_missing, number
from validate.sheets.faults import FaultList, Place, clipped, letters
from validate.sheets.grid import Cell, Grid, Row
from validate.sheets.possible import Crack, level_mm
from validate.wording import counted

MM: dict[Unit, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
CLOSEST_MM = 0.01
"""Between stations: the last digit of a caliper. Closer ones are one place, read twice."""
AS_COLUMNS = "Write repeated readings of a station as columns of one row, or number them in a column 'repeat'."


@dataclass(frozen=True)
class Table:
    s_mm: Floats  # (n,), increasing
    repeats_mm: Floats  # (n, r), as they count in the sheet; NaN where one is missing, and never a whole row
    missing: int
    """Readings that the sheet says are missing."""
    mark: Decimal | None
    """Of the decimals, where any number had one."""


@dataclass
class _Station:
    s_mm: float
    row: int
    values_mm: dict[str, float]
    """By repeat."""


def read_table(grid: Grid, header: Header, declared: Declared, crack: Crack | None, faults: FaultList) -> Table:
    """All cells are looked at; where there are ``faults`` in the end, the table holds what was readable."""
    _check_merged(grid, header, faults)
    mark = _decimal_mark(grid, header, declared, faults)
    reader = _Reader(grid, header, mark, declared, crack, faults)
    stations = [station for row in header.body if (station := reader.station(row)) is not None]
    if header.repeat is not None:
        stations = _gathered(grid, header, stations, faults)
    stations.sort(key=lambda station: station.s_mm)
    _check_neighbours(grid, header, stations, faults)
    labels = sorted({label for station in stations for label in station.values_mm}, key=_natural)
    readings_mm = np.array([[station.values_mm.get(label, np.nan) for label in labels] for station in stations])
    readings_mm = readings_mm.reshape(len(stations), len(labels))
    read = ~np.isnan(readings_mm).all(axis=1)
    return Table(
        s_mm=np.array([station.s_mm for station in stations])[read],
        repeats_mm=readings_mm[read],
        missing=sum(1 for station in stations for value in station.values_mm.values() if np.isnan(value)),
        mark=mark,
    )


def _check_merged(grid: Grid, header: Header, faults: FaultList) -> None:
    """A merged cell says its value once, and means it for all or for the first: nobody can tell."""
    # A header may span: what it then names is told by the line below it, or is a column without a name.
    first_row = header.body[0].number if header.body else header.row.number
    used = {
        column.index
        for column in (header.station, header.repeat, header.sample, *header.readings)
        if column is not None
    }
    for row, column, last_row, last_column in grid.merged:
        if last_row >= first_row and used & set(range(column, min(last_column, max(used)) + 1)):
            faults.add(
                grid.place(row, column),
                f"cells {letters(column)}{row} to {letters(last_column)}{last_row} are merged, and hold one value.",
                "Unmerge them and write each cell's own value into it.",
            )


def _decimal_mark(grid: Grid, header: Header, declared: Declared, faults: FaultList) -> Decimal | None:
    if declared.decimal is not None:
        return declared.decimal
    columns = (header.station, *header.readings)
    written = [
        (row, column, cell.text)
        for row in header.body
        for column in columns
        if (cell := row.cell(column.index)).kind == "text" and cell.text
    ]
    mark = common_mark((text for _, _, text in written), grid.separator)
    doubtful = [each for each in written if is_either(each[2])]
    if mark is None and doubtful:
        row, column, text = doubtful[0]
        faults.add(
            grid.place(row.number, column.index, column.name),
            f"{text!r} is {text.replace(',', '.')}, or {text.replace(',', '').replace('.', '')} with its thousands "
            f"set apart; {len(doubtful)} such here, and no other number tells.",
            'Declare [readings] decimal = "comma" or "point".',
            text,
        )
    return mark


class _Reader:
    """Rows into stations, each cell's fault noted on the way."""

    def __init__(
        self,
        grid: Grid,
        header: Header,
        mark: Decimal | None,
        declared: Declared,
        crack: Crack | None,
        faults: FaultList,
    ) -> None:
        self._grid, self._header = grid, header
        self._mark: Decimal | None = mark
        self._declared, self._crack, self._faults = declared, crack, faults
        columns = (header.station, header.repeat, header.sample, *header.readings, *header.skipped)
        self._named = {column.index for column in columns if column is not None}
        self._unknown = {index for index, cell in enumerate(header.row.cells) if cell.text} - self._named

    def station(self, row: Row) -> _Station | None:
        """None where the row holds no table cell, or its place or shape is a fault."""
        header = self._header
        if not self._fits(row):
            return None
        filled = {index for index, cell in enumerate(row.cells) if cell.text or cell.kind != "text"}
        if filled <= {column.index for column in header.skipped}:
            return None
        s_mm = self._place(row)
        if header.repeat is None:
            labels = [f"{index}" for index in range(len(header.readings))]
        else:
            labels = [self._repeat(row, header.repeat)] * len(header.readings)
        values_mm = {label: self._reading(row, column) for label, column in zip(labels, header.readings, strict=True)}
        return None if s_mm is None else _Station(s_mm, row.number, values_mm)

    def _fits(self, row: Row) -> bool:
        width = self._header.width
        if self._grid.separator is not None and (len(row.cells) < width or row.width > width):
            self._faults.add(
                self._grid.place(row.number),
                f"{counted(max(row.width, len(row.cells)), 'field')} under {counted(width, 'column')}.",
                "Write one field for each column; leave a missing reading blank, and write decimals with a "
                + ("point." if self._grid.separator == "," else "comma or a point, without thousands set apart."),
            )
            return False
        known = self._named | self._unknown
        for index, cell in enumerate(row.cells):
            if cell.text and index not in known:
                self._faults.add(
                    self._grid.place(row.number, index),
                    f"{clipped(cell.text)!r} stands in a column without a name, the {index + 1}. from the left.",
                    "Name the column, such as 'note', or delete it.",
                    cell.text,
                )
        return True

    def _place(self, row: Row) -> float | None:
        column = self._header.station
        cell, place = row.cell(column.index), self._address(row, column)
        value = self._number(place, column, cell, "Give every row its station.")
        if value is None:
            return None
        s_mm = value * MM[column.unit or "mm"]
        if self._crack is not None and column.unit is not None:
            self._crack.check_station(place, cell.text, s_mm, self._faults)
        return s_mm

    def _repeat(self, row: Row, column: Column) -> str:
        text = row.cell(column.index).text
        if is_missing(text):
            self._faults.add(
                self._address(row, column),
                f"{text!r}: which reading of the station this is, is not said.",
                "Number the readings of each station.",
                text,
            )
        return text

    def _reading(self, row: Row, column: Column) -> float:
        cell, place = row.cell(column.index), self._address(row, column)
        if cell.kind == "text" and is_missing(cell.text):
            return np.nan
        value = self._number(place, column, cell, "Leave the field blank if the reading is missing.")
        if value is None:
            return np.nan
        reading_mm = value * MM[column.unit or "mm"]
        quantity = self._header.quantity
        if self._crack is not None and column.unit is not None and quantity is not None:
            height_mm = level_mm(reading_mm, quantity, self._declared)
            self._crack.check_level(place, cell.text, height_mm, self._faults)
        return reading_mm

    def _number(self, place: Place, column: Column, cell: Cell, remedy: str) -> float | None:
        """None, and a fault, where it is none."""
        if cell.kind == "number":
            return float(cell.text)
        value = number(cell.text, self._mark) if cell.kind == "text" else None
        if value is None:
            found, remedy = self._complaint(column, cell, remedy)
            self._faults.add(place, found, remedy, cell.text)
        return value

    def _complaint(self, column: Column, cell: Cell, remedy: str) -> tuple[str, str]:
        text = repr(clipped(cell.text))
        if cell.kind == "formula":
            return "a formula whose result is not stored.", "Open the workbook in a spreadsheet program and save it."
        if cell.kind == "error":
            return f"{text} is an error of the spreadsheet.", "Mend the formula, or clear the cell."
        if cell.kind == "date":
            return (
                f"{text} is a date; a spreadsheet makes one of a number such as 16.1.",
                "Give the column the format of numbers, and write the reading again.",
            )
        if self._mark is not None and (is_grouped(cell.text) or number(cell.text, None) is not None):
            return (
                f"{text} has another mark than the decimal {self._mark} of this sheet, or its thousands set apart.",
                "Write all numbers one way, without thousands set apart.",
            )
        example = "-4,25" if self._mark == "comma" else "-4.25"
        return f"{text} is no number in {column.unit or 'its unit'}, such as {example}.", remedy

    def _address(self, row: Row, column: Column) -> Place:
        return self._grid.place(row.number, column.index, column.name)


def _gathered(grid: Grid, header: Header, rows: list[_Station], faults: FaultList) -> list[_Station]:
    """The rows of a long sheet, one station each."""
    stations: dict[float, _Station] = {}
    for row in rows:
        station = stations.setdefault(row.s_mm, _Station(row.s_mm, row.row, {}))
        for label, value_mm in row.values_mm.items():
            if label in station.values_mm:
                faults.add(
                    grid.place(row.row, header.station.index, header.station.name),
                    f"repeat {clipped(label)!r} of {row.s_mm:.12g} mm stands twice.",
                    "Number the readings of each station.",
                    label,
                )
            station.values_mm[label] = value_mm
    return list(stations.values())


def _check_neighbours(grid: Grid, header: Header, stations: list[_Station], faults: FaultList) -> None:
    """``stations`` in the order of s."""
    for before, station in pairwise(stations):
        place = grid.place(station.row, header.station.index, header.station.name)
        s_mm = f"{station.s_mm:.12g}"
        if station.s_mm == before.s_mm:
            faults.add(place, f"{s_mm} mm stands twice, first in row {before.row}.", AS_COLUMNS, s_mm)
        elif station.s_mm - before.s_mm < CLOSEST_MM * (1 - 1e-9):
            faults.add(
                place,
                f"{s_mm} mm is less than {CLOSEST_MM:g} mm after {before.s_mm:.12g} mm in row {before.row}.",
                AS_COLUMNS,
                s_mm,
            )


def _natural(label: str) -> tuple[bool, float, str]:
    """Numbers by their size, before words."""
    value = number(label, "point")
    return value is None, value or 0.0, label
