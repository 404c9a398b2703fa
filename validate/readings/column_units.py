"""Units of the columns of readings: in names, rows, cells, formats and remarks, or declared."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import get_args

from validate.readings.cell_units import (
    UnitCell,
    shown_cells,
    unit_cells,
    units_between,
    units_in_cells,
    units_row,
)
from validate.readings.header import Column, Mass, quoted_names
from validate.readings.header_words import (
    GRAMS,
    MM,
    ColumnUnit,
    meaning,
    names_other_unit,
    ten_at_unit,
    unit_of,
    units_named,
    unknown_unit,
)
from validate.readings.sheet import FaultList, SheetCell, SheetGrid, SheetRow, letters, quoted
from validate.readings.table_rows import is_a_number
from validate.settings import Declared, DialUnit, Unit

SET_UNIT = 'Set it: [readings] unit = "mm", or in pairing.csv.'
SET_FILL_UNIT = 'Set it in pairing.csv: unit = mm for levels, mass = "A g" for masses.'
CORRECT = "Correct the wrong one."
GIVE_UNIT = "give it in mm, cm, m, µm or inch."


class ColumnUnits:
    """Units of a table. ``body`` are its rows without a row of units, and without units behind their numbers."""

    def __init__(
        self,
        grid: SheetGrid,
        declared: Declared,
        faults: FaultList,
        mass: Mass | None,
        number: int,
        names: Mapping[int, str],
        between: Sequence[SheetRow],
        body: Sequence[SheetRow],
        place_words: Mapping[int, str],
    ) -> None:
        """``number`` is that of the header's first row, and ``between`` are rows of units between its names.

        ``place_words`` are words before the numbers of stations: without a unit, these may only number the places.
        """
        self.place_words = place_words
        self.places: Unit | tuple[float, ...] | None = None if declared.columns is None else declared.columns.places
        self.grid, self.declared, self.faults, self.number, self.names = grid, declared, faults, number, names
        self.mass: Mass | None = mass
        below, self.others = units_row(body[0]) if body else ({}, {})
        self.body, in_cells = units_in_cells(body[1:] if below else body)
        above = units_between(between, names)
        self.others |= {at: text for at, text in above.items() if unit_of(text) is None}
        self.units = in_cells | below | {at: unit for at, text in above.items() if (unit := unit_of(text)) is not None}

    def check_factors(self, columns: Sequence[Column]) -> None:
        """Add a fault for each number next to a unit that may be a factor, or the resolution of the readings."""
        if "unit" in (self.declared.as_written or ()):
            return
        numbers = {ten_at_unit(name) for name in self.names.values()}
        labels = {what.number for name in self.names.values() if (what := meaning(name)) is not None}
        for column in columns:
            # 10 is the number of a repeat if there is a ninth, and 1/10 if there is 2/10.
            ten = ten_at_unit(column.name)
            alone = ten is not None and ten - 1 not in numbers and f"{ten - 1}" not in labels
            of_many = column.number is not None and f"2-{column.number.partition('-')[2]}" in labels
            factor = column.factor if not of_many else None
            if factor is None and alone and column.role == "reading":
                factor = f"{ten}"
            if factor is not None:
                finding = f"{quoted(column.name)}: {quoted(factor)} may be a factor of the unit, or the resolution."
                remedy = (
                    "Write [1/10 mm] or [1/100 mm] for readings in tenths or hundredths, and a unit without a number "
                    'for readings in that unit; if the number is no factor, set readings.as_written = ["unit"].'
                )
                place = self.grid.place(self.number, column.index)
                self.faults.add(place, finding, remedy, factor)

    def check_supported(self, columns: Sequence[Column]) -> None:
        """Add a fault for each column below whose name is a word that is no unit of length."""
        for column in columns:
            if (word := self.others.get(column.index)) is not None:
                finding = f"{quoted(word)}, below {quoted(column.name)}, is not a supported unit of length;"
                self._add_fault(finding, f"{GIVE_UNIT} Or list only the columns of readings as levels.", word)

    def _add_fault(self, finding: str, remedy: str, value: str | None = None) -> None:
        self.faults.add(self.grid.place(self.number), finding, remedy, value)

    def _units_beside(self, of_units: Sequence[int], used: Sequence[Column]) -> list[UnitCell]:
        """Return the units of single cells: in the columns ``of_units``, and in number formats."""
        station, *readings = (column.index for column in used)
        without = [column.index for column in used[1:] if column.unit is None and column.index not in self.units]
        beside = unit_cells(self.body, of_units, {station}, readings, without)
        return [*beside, *shown_cells(self.body, self.grid.shown_units, [station, *readings])]

    def with_units(self, used: Sequence[Column], of_units: Sequence[int]) -> list[Column]:
        """Return stations and readings with their units: from names, unit rows and cells, else the declared unit."""
        declared, beside = self.declared.unit, self._units_beside(of_units, used)
        if declared is None:
            nameless = {column.index for column in used if column.unit is None}
            self.units = {at: one for at, one in self._common(beside).items() if at in nameless} | self.units
        is_dial = declared in get_args(DialUnit)
        if self.mass is None and (self.places is not None or is_dial or used[0].index in self.place_words):
            along: ColumnUnit | None = "mm" if isinstance(self.places, tuple) else self.places
            used = [*self._in_unit(used[:1], along), *self._in_unit(used[1:], declared)]
        elif self.mass is None:
            used = self._in_unit(used, declared)
        else:
            used = [*self._in_unit(used[:1], self.mass or None), *self._in_unit(used[1:], declared)]
        factors = [GRAMS if self.mass is not None else MM, *(MM for _ in used[1:])]
        nameless = [
            column
            for column, units in zip(used, factors, strict=True)
            if column.unit not in units or (column.unit_declared and names_other_unit(column.name))
        ]
        if nameless:
            self.faults.open.add("unit")
        nameless = [column for column in nameless if column.index not in self.others]
        if used[0] in nameless and used[0].index in self.place_words:
            self._ask_for_places(used[0])
            nameless.remove(used[0])
        elif used[0] in nameless and is_dial:
            remedy = "Write their unit, such as cm, into the column places of pairing.csv, or into the header."
            self._add_fault(f"{quoted(used[0].name)}: no unit of the places.", remedy)
            nameless.remove(used[0])
        # Stand-ins that differ may not all be the columns that are meant.
        if "readings" in self.faults.open and set(used[1:]) - set(nameless):
            nameless = [column for column in nameless if column == used[0]]
        if "station" in self.faults.open and set(used[1:]) - set(nameless):
            nameless = [column for column in nameless if column != used[0]]
        for text in dict.fromkeys(unknown_unit(column.name) for column in nameless):
            names = quoted_names([column for column in nameless if unknown_unit(column.name) == text])
            if text is None:
                self._add_fault(f"{names}: no unit.", SET_UNIT if self.mass is None else SET_FILL_UNIT)
            else:
                self._add_fault(f"{names}: unit {quoted(text)} is unknown;", GIVE_UNIT, text)
        self._check_beside(used, beside)
        return used

    def _ask_for_places(self, station: Column) -> None:
        word = self.place_words[station.index]
        texts = [text for row in self.body if is_a_number(SheetCell(text := row.cell(station.index).text))]
        finding = (
            f"{quoted(f'{word} {texts[0]}')} to {quoted(f'{word} {texts[-1]}')}: these numbers are distances along the "
            "crack, or they only number the places."
        )
        remedy = (
            "Write into the column places of pairing.csv: for distances their unit, such as mm; for numbers the places "
            'of the lowest and the highest in mm, such as "0 75", if they are evenly spaced, otherwise all places.'
        )
        self.faults.add(self.grid.place(self.number, station.index, station.name), finding, remedy)

    def _in_unit(self, columns: Sequence[Column], declared: ColumnUnit | None) -> list[Column]:
        whole = all(column.unit or column.index in self.units for column in columns)
        with_units = []
        for column in columns:
            own = [unit for unit in (column.unit, self.units.get(column.index)) if unit is not None]
            units = [*own, declared] if declared is not None and (whole or not own) else own
            if len(set(units)) > 1:
                finding = f"{' and '.join(units)}: the header, units below it and readings.unit differ."
                self.faults.add(self.grid.place(self.number, column.index, column.name), finding, CORRECT)
            with_units.append(replace(column, unit=units[0] if units else None, unit_declared=bool(units) and not own))
        return with_units

    def _common(self, beside: Sequence[UnitCell]) -> dict[int, ColumnUnit]:
        """Return the unit of each column whose numbers all have the same unit next to them."""
        common: dict[int, ColumnUnit] = {}
        for at in {one.column for one in beside}:
            units: list[ColumnUnit | None] = [one.unit for one in beside if one.column == at]
            numbers = sum(is_a_number(row.cell(at)) for row in self.body)
            if units[0] is not None and len(set(units)) == 1 and len(units) >= numbers:
                common[at] = units[0]
        return common

    def _check_beside(self, used: Sequence[Column], beside: Sequence[UnitCell]) -> None:
        """Add a fault for each row whose unit differs from that of its column."""
        by_index = {column.index: column for column in used}
        for one in beside:
            column = by_index[one.column]
            if one.unit == column.unit and one.unit is not None:
                continue
            value = one.row.cell(one.column).text
            remedy = "Write the whole column in one unit, that of its header and of readings.unit."
            if one.written == "%":
                finding = (
                    f"{quoted(value)} has the format of percentages, and is displayed as {float(value) * 100:.12g} %."
                )
                remedy = "Format the column as numbers, and check the readings."
            else:
                by = "the format of the number" if one.at == one.column else f"column {letters(one.at)}"
                other = f"and the others are in {column.unit}" if column.unit else "and no other unit is given"
                if one.unit is None:
                    other = "which is not a supported unit of length"
                finding = f"{quoted(value)} is in {quoted(one.written)} according to {by}, {other}."
            self.faults.add(self.grid.place(one.row.number, one.column, column.name), finding, remedy, value)

    def check_remarks(self, remarks: Sequence[SheetRow], used: Sequence[Column]) -> None:
        """Add a fault for a line above or below the table that names another unit than the columns have."""
        of_columns = {column.unit for column in used}
        for row in remarks:
            text = " ".join(cell.text for cell in row.cells if cell.text)
            named = units_named(text)
            if named and not named & (of_columns - {None}) and any(of_columns):
                finding = f"{quoted(text)}, but the columns are in {' and '.join(sorted(filter(None, of_columns)))}."
                self.faults.add(self.grid.place(row.number), finding, "Correct this line, a header or readings.unit.")
