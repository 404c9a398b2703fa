"""The header of a sheet: its rows, and its columns with direction and unit, which are read or declared."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import get_args

from validate.readings.cell_units import columns_of_units
from validate.readings.column_contents import likely_columns, may_be_readings, numbers_repeats
from validate.readings.column_units import CORRECT, ColumnUnits
from validate.readings.header import MOST_SHOWN, Column, Header, Mass, quoted_names
from validate.readings.header_rows import find_header, header_of_note
from validate.readings.header_words import (
    CODE,
    ColumnMeaning,
    Role,
    factor_in,
    is_number,
    meaning,
    name_in_titles,
    names_sample,
    quantity_in,
    unit_in,
)
from validate.readings.place_words import columns_of_places, is_place_word, only_number, without_words
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
from validate.readings.table_rows import (
    columns_named,
    common_lines,
    is_a_number,
    rows_beyond,
    sorted_rows,
    span_of_numbers,
    table_rows,
    which_table,
)
from validate.settings import Columns, Declared, Quantity
from validate.units import counted

ASSIGN = (
    'Assign the columns by letters: s (of a fill: mass) and levels in pairing.csv, or [readings.columns] s = "A", '
    'levels = ["B", "C"] in lab.toml or the trial. If each place has a column, transpose the table in a copy.'
)


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
        self.rows, self.skipped, self.left_out, self.unmet = table_rows(grid, self.given)
        self.common = common_lines(grid.rows, self.given.range)
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
        self.header_rows = header.count
        above = self.rows[: self.first]
        self.titled = None if grid.is_note else name_in_titles(cell.text for row in above for cell in row.cells)
        body = self.rows[self.first + header.count :]
        self._set_body(header.units, body, self._place_words(columns_of_places(body)))

    def _set_body(self, units: Sequence[SheetRow], body: Sequence[SheetRow], place_words: Mapping[int, str]) -> None:
        """Set the rows below the header, without words around places, and their units."""
        self.below_header, self.place_words = (units, body), place_words
        body = without_words(body, [*place_words])
        number, names = self.number, self.names
        self.units = ColumnUnits(
            self.grid, self.declared, self.faults, self.mass, number, names, units, body, place_words
        )
        self.body = self.units.body

    def _place_words(self, words: Mapping[int, str]) -> dict[int, str]:
        """Return the column of stations with the word before its numbers, if it has one; else no column."""
        if self.given.s is not None:
            along = columns_named(self.names, self.given.s)
        else:
            along = [at for at, name in self.names.items() if (what := meaning(name)) and what.role == "station"]
            along = along or [at for at, word in words.items() if is_place_word(word)]
        return {at: words[at] for at in along if at in words and len(along) == 1}

    def _add_fault(self, finding: str, remedy: str, value: str | None = None) -> None:
        self.faults.add(self.grid.place(self.number), finding, remedy, value)

    def _refused(self, finding: str, remedy: str, value: str | None = None) -> SheetFaults:
        return refuse(self.grid.place(self.number), finding, remedy, value)

    def read(self) -> Header:
        columns = self._one_table(self._columns())
        by_role = {role: [column for column in columns if column.role == role] for role in get_args(Role)}
        stations, readings, counters = by_role["station"], by_role["reading"], by_role["repeat"]
        if self.given.levels is not None and self.given.repeat is None:
            # Beside declared readings, a name alone makes no repeats.
            counters, unused = self._numbering(stations, readings, by_role["sample"], counters)
            by_role["skipped"] += [replace(column, role="skipped") for column in unused]
        # A bare "Messung" numbers the repeats if another column contains the readings; else it contains them itself.
        repeat = counters[0] if readings and len(counters) == 1 else None
        if repeat is None:
            readings += [replace(column, role="reading") for column in counters]
        elif may_be_readings(self.body, repeat.index):
            finding = f"column {quoted(repeat.name)} numbers repeats by its name, but contains other numbers."
            self._add_fault(finding, f"List the columns of readings. {ASSIGN}", repeat.name)
        if not stations or not readings:
            stations, readings = self._stand_ins(stations, readings)
        else:
            self._check_unknown()
        for twice, what in ((stations, "station"), (by_role["sample"], "sample")):
            if len(twice) > 1:
                self._add_fault(f"{quoted_names(twice)} both name the {what}.", ASSIGN)
        if repeat is not None and len(readings) > 1:
            several = quoted_names(readings)
            finding = f"column {quoted_names([repeat])} numbers repeats, but there are several columns: {several}."
            self._add_fault(finding, "List the columns of readings: [readings.columns] levels, or correct repeat.")
        used = [stations[0], *readings]
        if "readings" not in self.faults.open:
            self._check_numbers(readings)
        self.units.check_factors(used)
        self.units.check_supported(used)
        read = {column.index for column in used}
        skipped = [column for column in by_role["skipped"] if column.index not in read]
        taken = {column.index for column in columns} - {column.index for column in skipped}
        of_units = columns_of_units(self.names, taken, self.body)
        used = self.units.with_units([used[0], *map(self._as_titled, used[1:])], of_units)
        self._check_spanned(used[1:])
        self._check_labels(used)
        at = [column.index for column in used]
        body, between, passed = sorted_rows(self.grid, self.number, self.names, self.body, at[0], at[1:], self.faults)
        remarks = [*self.rows[: self.first], *self.skipped, *between, *self.common]
        self.units.check_remarks(remarks, used)
        self._check_range(at)
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
            left_out=self.left_out,
            unmet=tuple(self.unmet),
            of_units=tuple(of_units),
        )

    def _as_titled(self, reading: Column) -> Column:
        """Return a column with the unit and the direction of the table's title, if nothing gives its own."""
        what = None if self.titled is None else meaning(self.titled)
        if what is None or what.unit is None or what.quantity is None or reading.unit or reading.quantity:
            return reading
        return (
            reading if reading.index in self.units.units else replace(reading, unit=what.unit, quantity=what.quantity)
        )

    def _check_spanned(self, readings: Sequence[Column]) -> None:
        """Add a fault if one name spans columns in different units: they may have the same readings."""
        header = self.rows[self.first : self.first + self.header_rows]
        spanned = [column for column in readings if all(row.cell(column.index) == BLANK for row in header)]
        if spanned and self.given.levels is None and len({column.unit for column in readings} - {None}) > 1:
            finding = (
                f"{quoted_names(readings)}: one name of columns in different units, which may be the same readings."
            )
            self._add_fault(finding, f"List one column for each repeat. {ASSIGN}", spanned[0].name)

    def _check_labels(self, used: Sequence[Column]) -> None:
        """Add a fault for labels above the names of readings, which may be samples."""
        for row in self.rows[: self.first] if self.given.levels is None else ():
            along, *others = (row.cell(column.index).text for column in used)
            labels = [text for text in dict.fromkeys(others) if text and meaning(text) is None]
            codes = [text for text in labels if any(map(CODE.fullmatch, text.split()))]
            if len(labels) > 1 and (not along or len(codes) > 1):
                finding = f"row {row.number} has {', '.join(map(quoted, labels))}: columns of several samples?"
                self._add_fault(finding, f"List the columns of this sample. {ASSIGN}", labels[0])

    def _check_range(self, columns: Sequence[int]) -> None:
        """Add a fault if the range cuts off places of this table that have readings."""
        cut = rows_beyond(self.grid.rows, self.rows, self.given.range, columns, has_header=bool(self.header_rows))
        if cut and "range" not in (self.declared.as_written or ()):
            span = f"row {cut[0]}" if cut[0] == cut[-1] else f"{cut[0]}:{cut[-1]}"
            finding = f"{counted(len(cut), 'place')} with readings, in {span}, outside of the range."
            remedy = 'Extend the range, or confirm that they are not of this sample: readings.as_written = ["range"].'
            self.faults.add(self.grid.place(cut[0]), finding, remedy)

    def _numbering(
        self, stations: list[Column], readings: list[Column], samples: list[Column], counters: list[Column]
    ) -> tuple[list[Column], list[Column]]:
        """Return the columns that number the repeats of the only column of readings, and the other ``counters``."""
        place = [column.index for column in (*stations[:1], *samples)]
        is_long = len(readings) == 1 and stations
        good = [one for one in counters if is_long and numbers_repeats(self.body, place, one.index)]
        return good, [one for one in counters if one not in good]

    def _stand_ins(self, stations: list[Column], readings: list[Column]) -> tuple[list[Column], list[Column]]:
        """Return the likeliest stations and readings of a table that names no such columns, and add a fault.

        Raises the fault if no columns come into question, or if no stand-in is wanted.
        """
        fault = self._without(stations)
        at = [column.index for column in self.unknown if column.index not in self.units.others]
        likely = likely_columns(self.body, at, with_station=not stations)
        by_index = {column.index: replace(column, **vars(_by_parts(column.name))) for column in self.unknown}
        if not stations and likely.station is None:
            stations = self._places_in_texts([*by_index, *(column.index for column in readings)])
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

    def _places_in_texts(self, taken: Sequence[int]) -> list[Column]:
        """Return the only column outside ``taken`` whose texts have a place each: "PNT(5)", or "5 mm" in a remark."""
        units, body = self.below_header
        words = columns_of_places(body)
        with_unit = [at for at in self.units.units if any(is_a_number(row.cell(at)) for row in self.body)]
        likely = [
            at
            for at in dict.fromkeys([*words, *with_unit])
            if at not in taken and len({only_number(row.cell(at)) for row in body}) > 1
        ]
        if len(likely) != 1:
            return []
        self._set_body(units, body, {at: words[at] for at in likely if at in words})
        return [Column(role="station", index=at, name=self.names.get(at) or letters(at)) for at in likely]

    def _without(self, stations: Sequence[Column]) -> SheetFaults:
        """Return the error on a header without a column of stations or of readings."""
        along = "places along the crack (s)" if self.mass is None else "masses"
        which = f"no column of {along}" if not stations else "no column of readings"
        beside = f" besides {quoted_names(stations)}" if stations else ""
        if (line := _line_by_blanks(self.rows, self.grid.separator)) is not None:
            finding = f"{which}{beside}: its columns are separated by blanks only, as in {quoted(line)}."
            return self._refused(finding, "Save it with semicolons or tabs between the columns, or as XLSX.")
        filled = {at for row in self.body[:3] for at, cell in enumerate(row.cells) if cell != BLANK}
        shown = []
        for at in sorted({*self.names, *filled})[:MOST_SHOWN]:
            value = next((row.cell(at).text for row in self.body if row.cell(at).text), "")
            name = f" {quoted(self.names[at])}" if self.names.get(at) else ""
            shown.append(f"{letters(at)}{name} ({clipped(value)})")
        numbers = f"numbers in {span_of_numbers(self.rows)}; " if span_of_numbers(self.rows) else ""
        written = ", ".join(self.grid.written)
        return self._refused(f"{which}{beside} in {', '.join(shown)}; {numbers}read as {written}.", ASSIGN)

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
        taken_as: dict[Role, Role] = {"mass": "station", "station": "skipped"} if fill else {"mass": "skipped"}
        for at in sorted({*self.names, *roles, *numeric}):
            name = self.names.get(at, "")
            what = roles.get(at) or meaning(name)
            if at in self.place_words and at not in roles:
                what = ColumnMeaning("station", unit_in(name))
            if what is not None and at not in roles:
                what = replace(what, role=taken_as.get(what.role, what.role))
                what = ColumnMeaning("skipped", what.unit) if what.role in declared else what
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

    def _check_unknown(self) -> None:
        """Add a fault for each unknown column."""
        for column in self.unknown:
            finding = f"column {quoted(column.name)} has an unknown name and contains numbers."
            if column.name == letters(column.index):
                finding = f"column {column.name} contains numbers and has no name."
            self._add_fault(finding, ASSIGN, column.name)

    def _one_table(self, columns: list[Column]) -> list[Column]:
        """Return the first of several tables side by side, each with stations and readings, and add a fault."""
        starts = [at for at, column in enumerate(columns) if column.role == "station"]
        tables = [columns[start:end] for start, end in pairwise([*starts, len(columns)])]
        if len(tables) < 2 or not all(any(one.role in ("reading", "repeat") for one in table) for table in tables):
            return columns
        spans = [f"{letters(table[0].index)}:{letters(table[-1].index)}" for table in tables]
        finding = f"{len(tables)} tables side by side, in columns {' and '.join(spans)}."
        self._add_fault(finding, which_table(spans[0], spans[-1]))
        return tables[0]

    def _check_numbers(self, readings: Sequence[Column]) -> None:
        """Add a fault for columns of readings without a number (one may be the mean), or with the same number."""
        if len(readings) > 1 and self.given.levels is None and all(names_sample(column.name) for column in readings):
            finding = f"{quoted_names(readings)}: columns of several samples, or repeats of one?"
            self._add_fault(finding, f"List the columns of this sample. {ASSIGN}", readings[0].name)
        for label in dict.fromkeys(column.number for column in readings):
            columns = [column for column in readings if column.number == label]
            if label is None and len(readings) > 1:
                finding = (
                    f"{quoted_names(columns)}: no repeat number, but there are {len(readings)} columns of readings."
                )
                remedy = f"One of them may be a mean: list only the repeats as levels. {ASSIGN}"
                self._add_fault(finding, remedy, columns[0].name)
            elif len(columns) > 1:
                self._add_fault(f"repeat {label} occurs twice: {quoted_names(columns)}.", ASSIGN, columns[1].name)

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
                f"{quoted_names(nameless)}: nothing states whether readings count upward or downward.",
                'Set [readings] quantity = "level" (upward) or "depth" (downward), or sign in pairing.csv: up or down.',
            )
        return quantity


def _by_parts(name: str) -> ColumnMeaning:
    """Return unit, direction and factor from the recognised words in the name of a column of readings."""
    return ColumnMeaning("reading", unit_in(name), quantity_in(name), factor=factor_in(name))


def _line_by_blanks(rows: Sequence[SheetRow], separator: str | None) -> str | None:
    """Return a sample line of a text if most lines are numbers separated only by blanks; else None."""
    # A tab separates columns, though it is a blank.
    mark = ";" if separator == "\t" else separator or ""
    lines = [mark.join(cell.text for cell in row.cells[: row.width]) for row in rows]
    divided = [line for line in lines if len(line.split()) > 1 and all(map(is_number, line.split()))]
    return divided[0] if separator is not None and 1 < len(divided) > len(lines) / 2 else None
