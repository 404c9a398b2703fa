"""The header of a sheet: its rows, and its columns with direction and unit, which are read or declared."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, get_args

from validate.readings.cell_units import (
    UnitCell,
    columns_of_units,
    shown_cells,
    unit_cells,
    units_between,
    units_in_cells,
    units_row,
)
from validate.readings.header_words import (
    GRAMS,
    MM,
    ColumnMeaning,
    ColumnUnit,
    Role,
    factor_in,
    is_number,
    meaning,
    name_in_titles,
    names_sample,
    quantity_in,
    ten_at_unit,
    unit_in,
    unit_of,
    units_named,
)
from validate.readings.sheet import (
    BLANK,
    FaultList,
    SheetCell,
    SheetFaults,
    SheetGrid,
    SheetRow,
    clipped,
    letters,
    quoted,
    refuse,
)
from validate.readings.stand_ins import likely_columns
from validate.readings.table_rows import (
    blocks,
    columns_named,
    find_header,
    header_of_note,
    is_a_number,
    sorted_rows,
    table_rows,
)
from validate.readings.tables import common_lines
from validate.settings import Columns, Declared, Quantity

ASSIGN = (
    "Assign the columns by letters: s (of a fill: mass) and levels in pairing.csv; or [readings.columns] "
    's = "A", levels = ["B", "C"] in lab.toml or the trial.'
)
SET_UNIT = 'Set it: [readings] unit = "mm", or in pairing.csv.'
SET_FILL_UNIT = 'Set it in pairing.csv: unit = mm for levels, mass = "A g" for masses.'
CORRECT = "Correct the wrong one."
Mass = Literal["", "g", "kg"]
MOST_SHOWN = 12


@dataclass(frozen=True, kw_only=True)
class Column(ColumnMeaning):
    index: int  # Number of the column, from 0
    name: str
    unit_declared: bool = False  # True if only readings.unit gives the unit


@dataclass(frozen=True)
class Header:
    row: SheetRow
    above: int  # Number of lines with content above the header
    body: tuple[SheetRow, ...]
    station: Column
    readings: tuple[Column, ...]
    repeat: Column | None
    """Column that numbers the repeats of a long sheet, which has one reading in a row; None in a wide sheet."""
    sample: Column | None  # Column that names the sample of each row; None in a sheet of one sample
    skipped: tuple[Column, ...]
    quantity: Quantity | None
    """Direction of the readings. None if it is missing, which is a fault, as is a missing unit of a column."""
    remarks: tuple[SheetRow, ...] = ()
    """Rows of text about the sheet: above the header, comments, rows between readings."""
    passed: tuple[SheetRow, ...] = ()  # Rows with numbers that are not read: means, and declared ones
    unmet: tuple[str, ...] = ()  # Declared rows to skip that do not exist
    of_units: tuple[int, ...] = ()  # Columns, from 0, that contain the units of rows

    @property
    def read(self) -> list[Column]:
        """Columns whose cells are read."""
        return [one for one in (self.station, self.repeat, self.sample, *self.readings) if one is not None]


def read_header(
    grid: SheetGrid, declared: Declared, faults: FaultList, mass: Mass | None = None, *, stand_in: bool = False
) -> Header:
    """Return the header of the table of readings. Faults after which reading can go on are added to ``faults``.

    If ``mass`` is given the table is a fill: its "stations" are masses, in that unit unless the sheet names one. Raises
    SheetFaults if there is no column of stations or none of readings; with ``stand_in`` that is a fault too, and the
    likeliest columns are read, so that further faults of the sheet are reported with it.
    """
    return _HeaderReader(grid, declared, faults, mass, stand_in=stand_in).read()


class _HeaderReader:
    """Reader of the header of one sheet."""

    def __init__(
        self, grid: SheetGrid, declared: Declared, faults: FaultList, mass: Mass | None, *, stand_in: bool
    ) -> None:
        self.grid, self.declared, self.faults, self.stand_in = grid, declared, faults, stand_in
        self.mass: Mass | None = mass
        self.unknown: list[Column] = []  # Columns of numbers under unknown names
        self.given = declared.columns or Columns()
        self.rows, self.skipped, self.unmet = table_rows(grid, self.given)
        if len(self.rows) < 2:
            remedy = "If it is the wrong sheet or range, set [readings] sheet or [readings.columns] range."
            raise refuse(grid.place(), "no rows of readings.", remedy)
        of_note = header_of_note(self.rows) if grid.is_note else None
        header = of_note or find_header(self.rows, grid.merged, self.given)
        self.first, self.names = header.first, dict(header.names)
        self.number = self.rows[self.first].number
        if isinstance(self.given.header_rows, str) and not header.count:
            remedy = "Correct [readings.columns] header_rows; rows are counted from 1, as in a spreadsheet."
            raise self._refused(f"no rows {self.given.header_rows} with content.", remedy, self.given.header_rows)
        if grid.is_note:
            titles = (row.cell(0).text for row in (*self.rows[: self.first], *self.skipped))
            self.names |= {1: name} if (name := name_in_titles(titles)) else {}
        body = self.rows[self.first + header.count :]
        below, self.other_units = units_row(body[0]) if body else ({}, {})
        self.body, in_cells = units_in_cells(body[1:] if below else body)
        between = units_between(header.units, self.names)
        self.other_units |= {at: text for at, text in between.items() if unit_of(text) is None}
        self.units = (
            in_cells | below | {at: unit for at, text in between.items() if (unit := unit_of(text)) is not None}
        )

    def _add_fault(self, finding: str, remedy: str, value: str | None = None, column: Column | None = None) -> None:
        """Add a fault of the header, or of one of its columns."""
        at, name = (None, None) if column is None else (column.index, column.name)
        self.faults.add(self.grid.place(self.number, at, name), finding, remedy, value)

    def _refused(self, finding: str, remedy: str, value: str | None = None) -> SheetFaults:
        return refuse(self.grid.place(self.number), finding, remedy, value)

    def read(self) -> Header:
        columns = self._one_table(self._columns())
        by_role = {role: [column for column in columns if column.role == role] for role in get_args(Role)}
        stations, readings, counters = by_role["station"], by_role["reading"], by_role["repeat"]
        # A bare "Messung" numbers the repeats if another column contains the readings; else it contains them itself.
        repeat = counters[0] if readings and len(counters) == 1 else None
        if repeat is None:
            readings += [replace(column, role="reading") for column in counters]
        if not stations or not readings:
            stations, readings = self._stand_ins(stations, readings)
        else:
            self._check_unknown(columns)
        for twice, what in ((stations, "station"), (by_role["sample"], "sample")):
            if len(twice) > 1:
                self._add_fault(f"{_names(twice)} both name the {what}.", ASSIGN)
        if repeat is not None and len(readings) > 1:
            finding = f"column {_names([repeat])} numbers repeats, but there are several columns: {_names(readings)}."
            self._add_fault(finding, "List the columns of readings: [readings.columns] levels, or correct repeat.")
        used = [stations[0], *readings]
        if "readings" not in self.faults.open:
            self._check_numbers(readings)
        self._check_factors(used)
        for column in used:
            if (word := self.other_units.get(column.index)) is not None:
                finding = f"{quoted(word)}, below {quoted(column.name)}, is not a supported unit of length."
                self._add_fault(finding, "List the columns of readings: [readings.columns] levels.", word)
        read = {column.index for column in used}
        skipped = [column for column in by_role["skipped"] if column.index not in read]
        taken = {column.index for column in columns} - {column.index for column in skipped}
        of_units = columns_of_units(self.names, taken, self.body)
        beside = self._units_beside(of_units, used)
        used = self._with_units(used, beside)
        self._check_units_beside(used, beside)
        place, at = self.grid.place(self.number), [column.index for column in used]
        body, between, passed = sorted_rows(place, self.body, at[0], at[1:], self.faults)
        remarks = [*self.rows[: self.first], *self.skipped, *between, *common_lines(self.grid, self.given.range)]
        self._check_units_of_remarks(remarks, used)
        cells = tuple(SheetCell(self.names.get(at, "")) for at in range(max(self.names, default=-1) + 1))
        return Header(
            row=SheetRow(self.number, cells),
            above=self.first,
            body=tuple(body),
            station=used[0],
            readings=tuple(used[1:]),
            repeat=repeat,
            sample=next(iter(by_role["sample"]), None),
            skipped=tuple(skipped),
            quantity=self._quantity(used[1:]),
            remarks=tuple(remarks),
            passed=tuple(passed),
            unmet=tuple(self.unmet),
            of_units=tuple(of_units),
        )

    def _stand_ins(self, stations: list[Column], readings: list[Column]) -> tuple[list[Column], list[Column]]:
        """Return the likeliest stations and readings of a table that names no such columns, and add a fault.

        Raises the fault if no columns come into question, or if no stand-in is wanted.
        """
        fault = self._without(stations)
        at = [column.index for column in self.unknown if column.index not in self.other_units]
        likely = likely_columns(self.body, at, with_station=not stations)
        by_index = {column.index: replace(column, **vars(_by_parts(column.name))) for column in self.unknown}
        if likely.station is not None:
            stations = [replace(by_index[likely.station], role="station", quantity=None)]
            self.faults.open |= set() if likely.is_sure else {"station"}
        if not readings:
            readings = [by_index[index] for index in likely.others]
            self.faults.open.add("readings")
        by_blanks = _line_by_blanks(self.rows, self.grid.separator) is not None
        if not (self.stand_in and stations and readings) or by_blanks:
            raise fault
        # A declared column that does not exist is reported already.
        if "columns" not in self.faults.open:
            self.faults.faults += fault.faults
        self.faults.open.add("columns")
        return stations, readings

    def _without(self, stations: Sequence[Column]) -> SheetFaults:
        """Return the error on a header without a column of stations or of readings."""
        along = "places along the crack (s)" if self.mass is None else "masses"
        which = f"no column of {along}" if not stations else "no column of readings"
        beside = f" besides {_names(stations)}" if stations else ""
        if (line := _line_by_blanks(self.rows, self.grid.separator)) is not None:
            finding = f"{which}{beside}: its columns are separated by blanks only, as in {quoted(line)}."
            return self._refused(finding, "Save it with semicolons or tabs between the columns, or as XLSX.")
        filled = {at for row in self.body[:3] for at, cell in enumerate(row.cells) if cell != BLANK}
        shown = []
        for at in sorted({*self.names, *filled})[:MOST_SHOWN]:
            value = next((row.cell(at).text for row in self.body if row.cell(at).text), "")
            name = f" {quoted(self.names[at])}" if self.names.get(at) else ""
            shown.append(f"{letters(at)}{name} ({clipped(value)})")
        return self._refused(f"{which}{beside} in {', '.join(shown)}; read as {', '.join(self.grid.written)}.", ASSIGN)

    def _declared_roles(self) -> dict[int, ColumnMeaning]:
        """Return the roles of the declared columns. Raises SheetFaults for a declared column that does not exist."""
        given, names = self.given, self.names
        references: list[tuple[Role, str | None]] = [("station", given.s), ("repeat", given.repeat)]
        references.extend(("reading", level) for level in given.levels or ())
        roles: dict[int, ColumnMeaning] = {}
        width = max((row.width for row in self.rows), default=0)
        for role, reference in references:
            if reference is None:
                continue
            columns = columns_named(names, reference)
            if not columns or columns[0] >= width:
                all_names = ", ".join(quoted(name) for name in list(names.values())[:MOST_SHOWN])
                finding = f"{reference!r:.80} is not a column, or is a letter and also a name; names: {all_names}."
                remedy = 'If a letter is also the name of a column, write it as "B:B".'
                if not self.stand_in:
                    raise self._refused(finding, remedy, reference)
                self._add_fault(finding, remedy, reference)
                self.faults.open.add("columns")
                continue
            for at in columns:
                name = names.get(at, "")
                number = f"{1 + sum(other.role == role for other in roles.values())}" if role == "reading" else None
                roles[at] = replace(meaning(name) or _by_parts(name), role=role, number=number)
        return roles

    def _columns(self) -> list[Column]:
        """Return the columns with their roles, which are declared or known from names.

        Adds faults for unknown columns.
        """
        roles, fill = self._declared_roles(), self.mass is not None
        declared = {one.role for one in roles.values()}
        columns, unknown = list[Column](), list[Column]()
        cells = [(at, cell) for row in self.body for at, cell in enumerate(row.cells)]
        numeric = {at for at, cell in cells if is_a_number(cell) or cell.kind == "formula"}
        others = declared | ({"repeat"} if "reading" in declared and self.given.repeat is None else set())
        taken_as: dict[Role, Role] = {"mass": "station", "station": "skipped"} if fill else {"mass": "skipped"}
        for at in sorted({*self.names, *roles, *numeric}):
            name = self.names.get(at, "")
            what = roles.get(at) or meaning(name)
            if what is not None and at not in roles:
                what = replace(what, role=taken_as.get(what.role, what.role))
                what = ColumnMeaning("skipped", what.unit) if what.role in others else what
            if what is None and ("reading" in declared or at not in numeric):
                # A column of words has no readings, and if readings are declared, no other column has.
                what = ColumnMeaning("skipped")
            column = Column(**vars(what or ColumnMeaning("skipped")), index=at, name=name or letters(at))
            (unknown if what is None else columns).append(column)
        if fill and len(unknown) == 1 and not any(column.role in ("reading", "repeat") for column in columns):
            # The only unknown column next to masses contains the levels.
            column = unknown.pop()
            columns.append(replace(column, **vars(_by_parts(column.name))))
        self.unknown = unknown
        return sorted([*columns, *unknown], key=lambda column: column.index)

    def _check_unknown(self, columns: Sequence[Column]) -> None:
        """Add a fault for each unknown column. One with a name may be in a table of its own, after a blank column."""
        own_block = {column.index for column in columns if column.role in ("station", "reading", "repeat")}
        head = SheetRow(0, tuple(SheetCell(self.names.get(at, "")) for at in range(max(self.names, default=0) + 1)))
        spans = list(blocks([head, *self.body]))
        for column in self.unknown:
            span, lettered = next(span for span in spans if column.index in span), column.name == letters(column.index)
            if lettered or not own_block or own_block & set(span):
                finding = f"column {quoted(column.name)} has an unknown name and contains numbers."
                finding = f"column {column.name} contains numbers and has no name." if lettered else finding
                self._add_fault(finding, ASSIGN, column.name)

    def _one_table(self, columns: list[Column]) -> list[Column]:
        """Return the first of several tables side by side, each with stations and readings, and add a fault."""
        starts = [at for at, column in enumerate(columns) if column.role == "station"]
        tables = [columns[start:end] for start, end in pairwise([*starts, len(columns)])]
        if len(tables) < 2 or not all(any(one.role in ("reading", "repeat") for one in table) for table in tables):
            return columns
        spans = [f"{letters(table[0].index)}:{letters(table[-1].index)}" for table in tables]
        remedy = f'Select one: [readings.columns] range = "{spans[0]}", or in pairing.csv (one row for each sample).'
        self._add_fault(f"{len(tables)} tables side by side, in columns {' and '.join(spans)}.", remedy)
        return tables[0]

    def _check_numbers(self, readings: Sequence[Column]) -> None:
        """Add a fault for columns of readings without a number (one may be the mean), or with the same number."""
        if len(readings) > 1 and self.given.levels is None and all(names_sample(column.name) for column in readings):
            finding = f"{_names(readings)}: columns of several samples, or repeats of one?"
            self._add_fault(finding, f"List the columns of this sample. {ASSIGN}", readings[0].name)
        for label in dict.fromkeys(column.number for column in readings):
            columns = [column for column in readings if column.number == label]
            if label is None and len(readings) > 1:
                finding = f"{_names(columns)}: no repeat number, but there are {len(readings)} columns of readings."
                remedy = f"One of them may be a mean: list only the repeats as levels. {ASSIGN}"
                self._add_fault(finding, remedy, columns[0].name)
            elif len(columns) > 1:
                self._add_fault(f"repeat {label} occurs twice: {_names(columns)}.", ASSIGN, columns[1].name)

    def _check_factors(self, columns: Sequence[Column]) -> None:
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

    def _quantity(self, readings: Sequence[Column]) -> Quantity | None:
        declared = self.declared.quantity
        named: dict[Quantity, None] = dict.fromkeys(each.quantity for each in readings if each.quantity is not None)
        quantity: Quantity | None = next(iter(named)) if named else declared
        nameless = [column for column in readings if column.quantity is None]
        if "readings" in self.faults.open and (len(named) > 1 or 0 < len(nameless) < len(readings)):
            # Only some of the stand-ins may be readings: what they differ in is asked when the columns are given.
            self.faults.open.add("quantity")
        elif len(named) > 1:
            self._add_fault(
                "level and depth columns in one sheet.", "List the columns to read in [readings.columns] levels."
            )
        elif declared not in (None, quantity):
            self._add_fault(f'the header names {quantity}, but [readings] quantity = "{declared}".', CORRECT)
        elif nameless and declared is None:
            self.faults.open.add("quantity")
            self._add_fault(
                f"{_names(nameless)}: nothing states whether readings count upward or downward.",
                'Set [readings] quantity = "level" (upward) or "depth" (downward), or sign in pairing.csv: up or down.',
            )
        return quantity

    def _units_beside(self, of_units: Sequence[int], used: Sequence[Column]) -> list[UnitCell]:
        """Return the units of single cells: in the columns ``of_units``, and in number formats."""
        station, *readings = (column.index for column in used)
        without = [column.index for column in used[1:] if column.unit is None and column.index not in self.units]
        beside = unit_cells(self.body, of_units, {station}, readings, without)
        return [*beside, *shown_cells(self.body, self.grid.shown_units, [station, *readings])]

    def _with_units(self, used: Sequence[Column], beside: Sequence[UnitCell]) -> list[Column]:
        """Return stations and readings with their units: from names, unit rows and cells, else the declared unit."""
        declared = self.declared.unit
        if declared is None:
            nameless = {column.index for column in used if column.unit is None}
            self.units = {at: one for at, one in self._common(beside).items() if at in nameless} | self.units
        if self.mass is None:
            used = self._in_unit(used, declared)
        else:
            used = [*self._in_unit(used[:1], self.mass or None), *self._in_unit(used[1:], declared)]
        factors = [GRAMS if self.mass is not None else MM, *(MM for _ in used[1:])]
        nameless = [column for column, units in zip(used, factors, strict=True) if column.unit not in units]
        if nameless:
            self.faults.open.add("unit")
        nameless = [column for column in nameless if column.index not in self.other_units]
        # Stand-ins that differ may not all be the columns that are meant.
        if "readings" in self.faults.open and set(used[1:]) - set(nameless):
            nameless = [column for column in nameless if column == used[0]]
        if "station" in self.faults.open and set(used[1:]) - set(nameless):
            nameless = [column for column in nameless if column != used[0]]
        if nameless:
            self._add_fault(f"{_names(nameless)}: no unit.", SET_UNIT if self.mass is None else SET_FILL_UNIT)
        return used

    def _in_unit(self, columns: Sequence[Column], declared: ColumnUnit | None) -> list[Column]:
        whole = all(column.unit or column.index in self.units for column in columns)
        with_units = []
        for column in columns:
            own = [unit for unit in (column.unit, self.units.get(column.index)) if unit is not None]
            units = [*own, declared] if declared is not None and (whole or not own) else own
            if len(set(units)) > 1:
                finding = f"{' and '.join(units)}: the header, units below it and readings.unit differ."
                self._add_fault(finding, CORRECT, column=column)
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

    def _check_units_beside(self, used: Sequence[Column], beside: Sequence[UnitCell]) -> None:
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
                at = f"column {letters(one.at)}" if self.grid.turned is None else self.grid.name_of(one.at)
                by = "the format of the number" if one.at == one.column else at
                other = f"and the others are in {column.unit}" if column.unit else "and no other unit is given"
                if one.unit is None:
                    other = "which is not a supported unit of length"
                finding = f"{quoted(value)} is in {quoted(one.written)} according to {by}, {other}."
            self.faults.add(self.grid.place(one.row.number, one.column, column.name), finding, remedy, value)

    def _check_units_of_remarks(self, remarks: Sequence[SheetRow], used: Sequence[Column]) -> None:
        """Add a fault for a line above or below the table that names another unit than the columns have."""
        of_columns = {column.unit for column in used}
        for row in remarks:
            text = " ".join(cell.text for cell in row.cells if cell.text)
            named = units_named(text)
            if named and not named & (of_columns - {None}) and any(of_columns):
                finding = f"{quoted(text)}, but the columns are in {' and '.join(sorted(filter(None, of_columns)))}."
                self.faults.add(self.grid.place(row.number), finding, "Correct this line, a header or readings.unit.")


def _names(columns: Sequence[Column]) -> str:
    return ", ".join(quoted(column.name) for column in columns[:MOST_SHOWN])


def _by_parts(name: str) -> ColumnMeaning:
    """Return unit, direction and factor from the recognised words in the name of a column of readings."""
    return ColumnMeaning("reading", unit_in(name), quantity_in(name), factor=factor_in(name))


def _line_by_blanks(rows: Sequence[SheetRow], separator: str | None) -> str | None:
    """Return a sample line of a text if most lines are numbers separated only by blanks; else None."""
    lines = [(separator or "").join(cell.text for cell in row.cells[: row.width]) for row in rows]
    divided = [line for line in lines if len(line.split()) > 1 and all(map(is_number, line.split()))]
    return divided[0] if separator is not None and 1 < len(divided) > len(lines) / 2 else None


def remarks_where(header: Header, condition: Callable[[str], bool]) -> list[tuple[SheetRow, str]]:
    """Return the rows and texts of the remarks that satisfy a condition."""
    texts = ((row, cell.text) for row in header.remarks for cell in row.cells if cell.kind == "text" and cell.text)
    return [(row, text) for row, text in texts if condition(text)]
