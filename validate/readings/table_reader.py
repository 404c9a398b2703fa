"""The rows below a sheet's header as stations and readings, with a fault for each unreadable cell."""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby, pairwise

import numpy as np

from validate.readings.column_contents import likely_repeat
from validate.readings.header import Column, Header
from validate.readings.header_words import GRAMS, MM
from validate.readings.screens import ReadCells, cell_name
from validate.readings.sheet import FaultList, Place, SheetCell, SheetGrid, SheetRow, letters, quoted, shown
from validate.readings.stations import CrackLimits, Reading, Station, cells_of, level_mm
from validate.readings.text_table import (
    commas_may_separate,
    common_mark,
    decimals_of,
    is_ambiguous,
    is_grouped,
    is_missing,
    number,
    several,
    unread_word,
)
from validate.settings import Decimal, Declared
from validate.units import counted

FACTORS = MM | GRAMS
PLACE_IN_EVERY_ROW = "Write a place into every row, with the same words around it, if any."
CLOSEST_MM = 0.01
"""Smallest distance between two stations: the last digit of a caliper. Closer ones are one station, read twice."""
COMMAS = re.compile(r"[-+]?\d+(?:[.,]\d+)*,\d+(?:[.,]\d+)+")
"""Numbers with several commas, or with commas and points, that may be readings."""


@dataclass
class TableReader:
    """Reader of the cells below a header. It adds a fault for each unreadable cell."""

    grid: SheetGrid
    header: Header
    declared: Declared
    crack: CrackLimits | None
    faults: FaultList
    missing: int = 0  # Number of readings that are marked as missing; set by ``read``
    gathers: bool = False  # True if repeats are in rows of their own; set by ``read``

    def read(self) -> ReadCells:
        """Return the readable stations, sorted along s, and their repeats.

        A level is NaN if its reading is missing. Every row has at least one level.
        """
        header = self.header
        self._check_formulas()
        self._check_counts()
        _ = self.mark  # A fault if it is ambiguous
        merged = self._merged_stations()
        stations = [station for row in header.body if (station := self.station(row, merged)) is not None]
        self.gathers = header.repeat is not None or bool(merged) or self._are_repeats(stations)
        stations = self._at_places(self._gathered(stations) if self.gathers else stations)
        if "station" not in self.faults.open:
            self._check_neighbours(sorted(stations, key=lambda station: station.s_mm))
        self.missing = sum(math.isnan(one.value_mm) for station in stations for one in station.readings.values())
        return replace(
            cells_of(stations, header.quantity, self.declared),
            station_column=header.station.index,
            header_row=header.row.number,
            declared_unit_mm=FACTORS[header.station.unit or "mm"] if header.station.unit_declared else None,
        )

    def _are_repeats(self, stations: Sequence[Station]) -> bool:
        """Return whether rows of one place are its repeats: each place has as many, one below the other.

        Other columns may give the rows a different meaning, by words that change within a place or by small numbers.
        """
        if "repeats" in (self.declared.as_written or ()):
            return True
        runs = [list(run) for _, run in groupby(stations, key=lambda station: station.s_mm)]
        counts = {len(run) for run in runs}
        if len(counts) != 1 or counts == {1} or len({run[0].s_mm for run in runs}) < len(runs):
            return False
        texts = [
            {cell.text for station in run if not any(map(str.isdigit, (cell := station.row.cell(column.index)).text))}
            for run in runs
            for column in self.header.skipped
        ]
        return len(runs) > 1 and self._likely_repeat() is None and all(len(each) <= 1 for each in texts)

    def _at_places(self, stations: list[Station]) -> list[Station]:
        """Return numbered stations at the places that are declared for their numbers."""
        given = self._given_places
        numbers = sorted({station.s_mm for station in stations})
        if not given or len(numbers) < 2:
            return stations
        if len(given) not in (2, len(numbers)):
            finding = f"places has {len(given)} numbers, but {len(numbers)} places have readings."
            remedy = "Write the first and the last place, or all of them."
            self.faults.add(self.grid.place(self.header.row.number), finding, remedy)
            return stations
        own = numbers if len(given) == len(numbers) else [numbers[0], numbers[-1]]
        moved = [replace(station, s_mm=float(np.interp(station.s_mm, own, given))) for station in stations]
        for station in moved:
            if self.crack is not None:
                place = self._place(station.row, self.header.station)
                self.crack.check_station(place, f"{station.s_mm:g}", station.s_mm, self.faults)
        return moved

    @property
    def _given_places(self) -> tuple[float, ...]:
        """Places of the stations in mm, if their numbers are no distances."""
        given = None if self.declared.columns is None else self.declared.columns.places
        return given if isinstance(given, tuple) else ()

    def _merged_stations(self) -> dict[int, SheetCell]:
        """Return the station of each row whose station cell is merged over several rows. These rows are its repeats.

        Any other merged range of readings is a fault: its value may belong to all cells, or only to the first.
        """
        header, merged = self.header, dict[int, SheetCell]()
        # A merged header is no problem: its names apply to the line below, or to columns without a name.
        body = {row.number: row for row in header.body}
        used = {column.index for column in header.read}
        names = header.sample and header.sample.index
        for row, column, last_row, last_column in sorted(self.grid.merged):
            if column == last_column == names:
                continue  # Its name is that of all rows.
            rows = [number for number in body if row <= number <= last_row]
            if not rows or not any(column <= index <= last_column for index in used):
                continue
            if column == last_column == header.station.index:
                merged |= dict.fromkeys(rows, body[rows[0]].cell(column))
            elif row != last_row or column != last_column:
                ends = cell_name(row, column), cell_name(last_row, last_column)
                self.faults.add(
                    self.grid.place(row, column),
                    f"cells {' to '.join(ends)} are merged with one value.",
                    "Skip these rows with [readings.columns] skip, or unmerge the cells in a copy.",
                )
        return merged

    @property
    def _used(self) -> list[tuple[SheetRow, Column, SheetCell]]:
        """All cells of stations and of readings."""
        columns = (self.header.station, *self.header.readings)
        return [(row, column, row.cell(column.index)) for row in self.header.body for column in columns]

    def _check_formulas(self) -> None:
        """Add one fault for all formulas without a stored result."""
        cells = [cell_name(row.number, column.index) for row, column, cell in self._used if cell.kind == "formula"]
        if cells:
            span = cells[0] if len(cells) == 1 else f"{cells[0]} to {cells[-1]}"
            finding = f"{counted(len(cells), 'formula')} without a stored result, {span}."
            self.faults.add(self.grid.place(), finding, "Open the workbook in a spreadsheet program and save it.")

    @cached_property
    def mark(self) -> Decimal | None:
        """Decimal mark of the numbers; None if no number has one."""
        if self.declared.decimal is not None:
            return self.declared.decimal
        used = [(row, column, cell) for row, column, cell in self._used if cell.kind == "text" and cell.text]
        written = [(row, column, text) for row, column, cell in used for text in several(cell.text) or (cell.text,)]
        mark = common_mark((text for _, _, text in written), self.grid.separator)
        readings = [(row, column, cell) for row, column, cell in used if column != self.header.station]
        if self.grid.is_note and commas_may_separate(cell.text for _, _, cell in readings):
            self._ask_for_commas(*readings[0])
        doubtful = [each for each in written if is_ambiguous(each[2])]
        if mark is None and doubtful:
            row, column, text = doubtful[0]
            self.faults.open.add("decimal")
            self.faults.add(
                self._place(row, column),
                f"{text!r} is {text.replace(',', '.')}, or {text.replace(',', '').replace('.', '')} with a thousands "
                f"separator; {len(doubtful)} numbers are like this, and no other number decides it.",
                'Declare [readings] decimal = "comma" or "point".',
                text,
            )
        return mark

    def _ask_for_commas(self, row: SheetRow, column: Column, cell: SheetCell) -> None:
        self.faults.open.add("decimal")
        self.faults.add(
            self._place(row, column),
            f"{quoted(cell.text)} is one reading with a decimal comma, or two readings.",
            'Declare [readings] decimal = "comma", or "point" if the comma separates readings.',
            cell.text,
        )

    def _parts(self, cell: SheetCell) -> tuple[str, ...]:
        """Return the texts of the readings in a cell."""
        if cell.kind != "text" or self.header.repeat is not None:
            return (cell.text,)
        by_commas = self.grid.is_note and self.declared.decimal == "point"
        return several(cell.text, by_commas=by_commas) or (cell.text,)

    @cached_property
    def _counts(self) -> dict[int, Counter[int]]:
        """Number of cells with one reading, two, and so on, of each column of readings."""
        cells = [(column, row.cell(column.index)) for row in self.header.body for column in self.header.readings]
        counts = {column.index: Counter[int]() for column in self.header.readings}
        for column, cell in cells:
            if cell.text:
                counts[column.index][len(self._parts(cell))] += 1
        return counts

    def _check_counts(self) -> None:
        """Add a fault for each cell with more readings than most cells of its column."""
        for column in self.header.readings:
            counts = self._counts[column.index]
            usual = max(counts, key=lambda count: (counts[count], -count), default=1)
            for row in self.header.body:
                cell = row.cell(column.index)
                count, answer = len(self._parts(cell)), f"{row.number}"
                if cell.text and count > usual and answer not in (self.declared.as_written or ()):
                    finding = f"{quoted(cell.text)} has {counted(count, 'reading')}, most cells have {usual}."
                    remedy = f'Correct a blank within a number, or answer readings.as_written = ["{answer}"].'
                    self.faults.add(self._place(row, column), finding, remedy, cell.text)

    def station(self, row: SheetRow, merged: Mapping[int, SheetCell]) -> Station | None:
        """Return the station of a row; None if it has none, or if its station or its number of fields is a fault."""
        header, column = self.header, self.header.station
        if not self._fits(row):
            return None
        filled = {index for index, cell in enumerate(row.cells) if cell.text or cell.kind != "text"}
        if filled <= {column.index for column in header.skipped}:
            return None
        cell = merged.get(row.number, row.cell(column.index))
        s_mm = self._in_mm(row, column, cell, PLACE_IN_EVERY_ROW)
        if (
            s_mm is not None
            and self.crack is not None
            and column.unit is not None
            and not (self._stands_in or self._given_places)
        ):
            self.crack.check_station(self._place(row, column), cell.text, s_mm, self.faults)
        label = None if header.repeat is None else self._repeat(row, header.repeat)
        each = (reading for column in header.readings for reading in self._readings(row, column))
        readings = {label or f"{at}": reading for at, reading in enumerate(each)}
        return None if s_mm is None else Station(s_mm, row, readings)

    def _fits(self, row: SheetRow) -> bool:
        """Return whether a row has as many fields as columns. In a comma-separated file, decimal commas add fields."""
        width = self.header.row.width
        if self.grid.separator != "," or len(row.cells) >= width >= row.width:
            return True
        self.faults.add(
            self.grid.place(row.number),
            f"{counted(max(row.width, len(row.cells)), 'field')} under {counted(width, 'column')}.",
            "If these are decimal commas, save the sheet with semicolons between fields, or with decimal points.",
        )
        return False

    def _repeat(self, row: SheetRow, column: Column) -> str:
        text = row.cell(column.index).text
        if is_missing(text):
            finding = f"{text!r} is not the number of a repeat."
            self.faults.add(self._place(row, column), finding, "Number the readings of each station.", text)
        return text

    def _readings(self, row: SheetRow, column: Column) -> list[Reading]:
        """Return the readings of a cell, and missing ones if other cells of its column have more."""
        cell, most = row.cell(column.index), max(self._counts[column.index], default=1)
        readings = [self._reading(row, column, cell._replace(text=text)) for text in self._parts(cell)]
        missing = Reading(np.nan, row.number, column.index, readings[0].digit_mm)
        return [*readings, *[missing] * (most - len(readings))]

    @property
    def _stands_in(self) -> bool:
        """True if the columns, or the decimal mark, are stand-ins: readings outside the crack may be their mistake."""
        return bool(self.faults.open & {"columns", "decimal"})

    def _reading(self, row: SheetRow, column: Column, cell: SheetCell) -> Reading:
        unit_mm = MM[column.unit or "mm"]
        digit_mm = unit_mm * 10.0 ** -decimals_of(cell.text)
        reading_mm = None
        if cell.kind != "text" or not is_missing(cell.text):
            word = unread_word(row.cell(column.index).text)
            it = "it" if word == cell.text else quoted(word)
            remedy = f"If {it} marks a missing reading, add it to [readings.columns] missing."
            reading_mm = self._in_mm(row, column, cell, remedy)
        if reading_mm is None:
            return Reading(np.nan, row.number, column.index, digit_mm)
        is_level = column.unit is not None and self.header.quantity is not None and not self._stands_in
        if self.crack is not None and is_level:
            height_mm = level_mm(reading_mm, self.header.quantity, self.declared)
            self.crack.check_level(self._place(row, column), cell.text, height_mm, self.faults)
        return Reading(reading_mm, row.number, column.index, digit_mm)

    def _in_mm(self, row: SheetRow, column: Column, cell: SheetCell, remedy: str) -> float | None:
        """Return the number of a cell in millimetres, or None after adding a fault."""
        value = float(cell.text) if cell.kind == "number" else None
        if cell.kind == "text":
            # Of several readings in one cell, either mark is decimal.
            either = bool(self._parts(row.cell(column.index))[1:]) or self.grid.is_note
            value = number(cell.text, None if either and not is_ambiguous(cell.text) else self.mark)
        if value is None and cell.kind != "formula":
            self.faults.add(self._place(row, column), *self._complaint(column, cell, remedy), cell.text)
        return None if value is None else value * FACTORS[column.unit or "mm"]

    def _complaint(self, column: Column, cell: SheetCell, remedy: str) -> tuple[str, str]:
        text = quoted(cell.text)
        if cell.kind == "error":
            return f"{text} is an error of the spreadsheet.", "Correct the formula, or clear the cell."
        if cell.kind == "date":
            finding = f"{text} is a date; spreadsheets convert numbers such as 16.1 to dates."
            return finding, "Format the column as numbers, and enter the reading again."
        if "," in cell.text and COMMAS.fullmatch(cell.text):
            finding = f"{text}: each comma may be a decimal mark, or separate two readings."
            return finding, "Separate the readings by blanks or semicolons."
        if self.mark is not None and (is_grouped(cell.text) or number(cell.text, None) is not None):
            finding = f"{text} has another mark than the decimal {self.mark} of this sheet, or a thousands separator."
            return finding, "Write all numbers with the same mark, without thousands separators."
        example = "-4,25" if self.mark == "comma" else "-4.25"
        return f"{text} is not a number in {column.unit or 'its unit'}, such as {example}.", remedy

    def _gathered(self, rows: list[Station]) -> list[Station]:
        """Return one station for all rows with the same s.

        Its readings have the sheet's numbers, or are counted in order.
        """
        stations: dict[float, Station] = {}
        for row in rows:
            station = stations.setdefault(row.s_mm, Station(row.s_mm, row.row, {}))
            if self.header.repeat is None:
                station.readings |= {f"{len(station.readings) + 1}": one for one in row.readings.values()}
                continue
            for label in row.readings.keys() & station.readings:
                finding = f"repeat {quoted(label)} of {row.s_mm:.12g} mm occurs twice."
                remedy = "Number the readings of each station."
                self.faults.add(self._place(row.row, self.header.station), finding, remedy, label)
            station.readings |= row.readings
        return list(stations.values())

    def _likely_repeat(self) -> Column | None:
        header = self.header
        place = [column.index for column in (header.station, header.sample) if column is not None]
        by_index = {column.index: column for column in header.skipped}
        likely = likely_repeat(header.body, place, list(by_index)) if len(header.readings) == 1 else None
        return None if likely is None else by_index[likely]

    def _check_neighbours(self, stations: list[Station]) -> None:
        """Add a fault for each pair of neighbouring stations that are equal, or closer than a caliper resolves."""
        remedy = (
            'If rows of one place are its repeats, set readings.as_written = ["repeats"], or write them as columns of '
            "one row, or number them in a column 'repeat'; if not, correct the place."
        )
        if (column := self._likely_repeat()) is not None:
            letter = letters(column.index)
            remedy = (
                f"If column {letter} ({shown(column.name)}) numbers the repeats, set [readings.columns] repeat = "
                f'"{letter}", or in pairing.csv.'
            )
        for before, station in pairwise(stations):
            s_mm = f"{station.s_mm:.12g}"
            if station.s_mm - before.s_mm >= CLOSEST_MM * (1 - 1e-9):
                continue
            finding = (
                f"{s_mm} mm is less than {CLOSEST_MM:g} mm after {before.s_mm:.12g} mm in row {before.row.number}."
            )
            if station.s_mm == before.s_mm:
                finding = f"{s_mm} mm occurs twice, first in row {before.row.number}."
            self.faults.add(self._place(station.row, self.header.station), finding, remedy, s_mm)

    def _place(self, row: SheetRow, column: Column) -> Place:
        return self.grid.place(row.number, column.index, column.name)
