"""The header of a sheet: its rows, and the columns with their sign and unit, as it names them or as declared."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

from validate.readings.cell_units import (
    UnitCell,
    columns_of_units,
    shown_cells,
    unit_cells,
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
    names_factor,
    names_other_zero,
    quantity_in,
    ten_at_unit,
    unit_in,
    units_named,
)
from validate.readings.sheet import (
    BLANK,
    FaultList,
    Place,
    SheetCell,
    SheetGrid,
    SheetRow,
    clipped,
    letters,
    quoted,
    refuse,
)
from validate.readings.table_rows import blocks, columns_named, find_header, is_a_number, sorted_rows, table_rows
from validate.settings import Columns, Declared, Quantity

SAY = (
    "Say which is which, by letters: s (of a fill: mass) and levels in pairing.csv; or as [readings.columns] "
    's = "A", levels = ["B", "C"] in lab.toml or the trial.'
)
SAY_UNIT = 'Say it: [readings] unit = "mm", or in pairing.csv.'
SAY_FILL_UNIT = 'Say it in pairing.csv: unit = mm of levels, mass = "A g" of masses.'
Mass = Literal["", "g", "kg"]
MOST_SHOWN = 12


@dataclass(frozen=True, kw_only=True)
class Column(ColumnMeaning):
    index: int  # Number of the column, from 0
    name: str
    unit_declared: bool = False  # True where only readings.unit gives the unit


@dataclass(frozen=True)
class Header:
    row: SheetRow
    above: int  # Number of lines above the header that hold anything
    body: tuple[SheetRow, ...]
    station: Column
    readings: tuple[Column, ...]
    repeat: Column | None
    """Column that numbers the repeats of a long sheet, which has one reading in a row; None in a wide one."""
    sample: Column | None  # Column that names the sample of each row; None in a sheet of one sample
    skipped: tuple[Column, ...]
    quantity: Quantity | None
    """Direction in which readings count; None, like a column's unit, where it is missing, which is a fault."""
    remarks: tuple[
        SheetRow, ...
    ] = ()  # Rows of words about the sheet: above the header, comments, rows between readings
    passed: tuple[SheetRow, ...] = ()  # Rows with numbers that are not read: means, and those that are declared
    unmet: tuple[str, ...] = ()  # What is declared to be skipped, and is nowhere
    of_units: tuple[int, ...] = ()  # Columns, from 0, that hold the units of rows

    @property
    def read(self) -> list[Column]:
        """Columns whose cells are read."""
        return [one for one in (self.station, self.repeat, self.sample, *self.readings) if one is not None]


def read_header(grid: SheetGrid, declared: Declared, faults: FaultList, mass: Mass | None = None) -> Header:
    """Return the header of the one table of readings; faults that leave the rest readable are added to ``faults``.

    Where ``mass`` is given the table is a fill, and its "stations" are masses, in that unit where the sheet names none.
    Raises SheetFaults where no column of stations or none of readings is known.
    """
    given = declared.columns or Columns()
    rows, left_out, unmet = table_rows(grid, given)
    if len(rows) < 2:
        raise refuse(
            grid.place(), "no rows of readings.", "Is it this sheet? Name another: [readings] sheet, or range."
        )
    found = find_header(rows, grid.merged, given)
    first = rows[found.first]
    place = grid.place(first.number)
    body = rows[found.first + found.count :]
    units, other_units = units_row(body[0]) if body else ({}, {})
    body, in_cells = units_in_cells(body[1:] if units else body)
    units = in_cells | units
    columns = _meanings(place, found.names, body, given, faults, fill=mass is not None)
    columns = _one_table(place, columns, faults)
    stations, readings, counters, samples, skipped = (
        [column for column in columns if column.role == role]
        for role in ("station", "reading", "repeat", "sample", "skipped")
    )
    # A bare "Messung" numbers the repeats where another column holds the readings, and holds them itself otherwise.
    repeat = counters[0] if readings and len(counters) == 1 else None
    if repeat is None:
        readings += [replace(column, role="reading") for column in counters]
    if not stations or not readings:
        along = "places along the crack (s)" if mass is None else "masses"
        which = f"no column of {along}" if not stations else "no column of readings"
        beside = f" beside {_names(stations)}" if stations else ""
        seen = _seen(found.names, body)
        if (line := _line_by_blanks(rows, grid.separator)) is not None:
            what = f"{which}{beside}: its columns are divided by blanks only, as in {quoted(line)}."
            raise refuse(place, what, "Save it with semicolons or tabs between the columns, or as XLSX.")
        raise refuse(place, f"{which}{beside} in {seen}; read as {', '.join(grid.written)}.", SAY)
    for twice, what in ((stations, "station"), (samples, "sample")):
        if len(twice) > 1:
            faults.add(place, f"{_names(twice)} both name the {what}.", SAY)
    if repeat is not None and len(readings) > 1:
        found_ = f"column {_names([repeat])} numbers the repeats of one column, and there are {_names(readings)}."
        faults.add(place, found_, "Name those that are readings of one station: [readings.columns] levels, or repeat.")
    _check_numbers(place, readings, faults)
    _check_factors(place, [stations[0], *readings], found.names.values(), declared, faults)
    for column in (stations[0], *readings):
        if (word := other_units.get(column.index)) is not None:
            what = f"{quoted(word)}, below {quoted(column.name)}, is no unit of length that is known."
            faults.add(place, what, "Name the columns that are read: [readings.columns] levels.", word)
    taken = {column.index for column in columns} - {column.index for column in skipped}
    of_units = columns_of_units(found.names, taken, body)
    used = stations[0].index, [column.index for column in readings]
    without = [column.index for column in readings if column.unit is None and column.index not in units]
    beside = [
        *unit_cells(body, of_units, {used[0]}, used[1], without),
        *shown_cells(body, grid.shown_units, [used[0], *used[1]]),
    ]
    if declared.unit is None:
        nameless = {column.index for column in (stations[0], *readings) if column.unit is None}
        units.update({at: unit for at, unit in _common(beside, body).items() if at in nameless and at not in units})
    if mass is None:
        station, *readings = _with_units(place, [stations[0], *readings], units, declared.unit, faults)
    else:
        (station,) = _with_units(place, stations[:1], units, mass or None, faults)
        readings = _with_units(place, readings, units, declared.unit, faults)
    of_kind = [(station, MM if mass is None else GRAMS), *((column, MM) for column in readings)]
    if nameless := [column for column, known in of_kind if column.unit not in known]:
        faults.add(place, f"{_names(nameless)}: no unit.", SAY_UNIT if mass is None else SAY_FILL_UNIT)
    _check_units_beside(grid, [station, *readings], beside, faults)
    body, remarks, passed = sorted_rows(place, body, *used, faults)
    remarks = [*rows[: found.first], *left_out, *remarks]
    _check_units_of_remarks(grid, remarks, [station, *readings], faults)
    cells = tuple(SheetCell(found.names.get(at, "")) for at in range(max(found.names, default=-1) + 1))
    return Header(
        row=SheetRow(first.number, cells),
        above=found.first,
        body=tuple(body),
        station=station,
        readings=tuple(readings),
        repeat=repeat,
        sample=samples[0] if samples else None,
        skipped=tuple(skipped),
        quantity=_quantity(place, readings, declared, faults),
        remarks=tuple(remarks),
        passed=tuple(passed),
        unmet=tuple(unmet),
        of_units=tuple(of_units),
    )


def _line_by_blanks(rows: Sequence[SheetRow], separator: str | None) -> str | None:
    """Return a line of a text in which most lines are numbers with nothing but blanks between; else None."""
    lines = [(separator or "").join(cell.text for cell in row.cells[: row.width]) for row in rows]
    divided = [line for line in lines if len(line.split()) > 1 and all(map(is_number, line.split()))]
    return divided[0] if separator is not None and 1 < len(divided) > len(lines) / 2 else None


def _names(columns: Sequence[Column]) -> str:
    return ", ".join(quoted(column.name) for column in columns[:MOST_SHOWN])


def _seen(names: Mapping[int, str], body: Sequence[SheetRow]) -> str:
    """Return the columns by letter and name, each with its first value."""
    filled = sorted({*names, *(at for row in body[:3] for at, cell in enumerate(row.cells) if cell != BLANK)})
    told = []
    for at in filled[:MOST_SHOWN]:
        value = next((row.cell(at).text for row in body if row.cell(at).text), "")
        told.append(f"{letters(at)} {quoted(names.get(at, ''))} ({clipped(value)})")
    return ", ".join(told)


def _declared_roles(place: Place, names: Mapping[int, str], given: Columns) -> dict[int, ColumnMeaning]:
    """Return what the declared columns are. Raises SheetFaults for one that is not there."""
    roles: dict[int, ColumnMeaning] = {}
    said: tuple[tuple[Role, tuple[str | None, ...]], ...] = (
        ("station", (given.s,)),
        ("repeat", (given.repeat,)),
        ("reading", given.levels or ()),
    )
    each: list[tuple[Role, str]] = [(role, one) for role, references in said for one in references if one is not None]
    for role, reference in each:
        if not (found := columns_named(names, reference)):
            known = ", ".join(quoted(name) for name in list(names.values())[:MOST_SHOWN])
            what = f"{reference!r:.80} is no column, or both a letter and another's name, among {known}."
            raise refuse(place, what, 'Write a letter as "B:B" where a column has it for a name.', reference)
        for at in found:
            name = names.get(at, "")
            by_name = meaning(name) or ColumnMeaning(role, unit_in(name), quantity_in(name), factor=factor_in(name))
            number = f"{1 + sum(other.role == role for other in roles.values())}" if role == "reading" else None
            roles[at] = replace(by_name, role=role, number=number)
    return roles


def _meanings(
    place: Place, names: Mapping[int, str], body: Sequence[SheetRow], given: Columns, faults: FaultList, *, fill: bool
) -> list[Column]:
    """Return what each column is, by declaration or by its name; one of numbers that is unknown is a fault."""
    roles = _declared_roles(place, names, given)
    declared = {one.role for one in roles.values()}
    columns, unknown = list[Column](), list[Column]()
    numeric = {at for row in body for at, cell in enumerate(row.cells) if is_a_number(cell) or cell.kind == "formula"}
    others = declared | ({"repeat"} if "reading" in declared and given.repeat is None else set())
    taken_as: dict[Role, Role] = {"mass": "station", "station": "skipped"} if fill else {"mass": "skipped"}
    for at in sorted({*names, *roles, *numeric}):
        name = names.get(at, "")
        found = roles.get(at) or meaning(name)
        if found is not None and at not in roles:
            found = replace(found, role=taken_as.get(found.role, found.role))
            found = ColumnMeaning("skipped", found.unit) if found.role in others else found
        if found is None and ("reading" in declared or at not in numeric):
            # Words are no readings, and where these are declared all else is none.
            found = ColumnMeaning("skipped")
        if found is None:
            unknown.append(Column("skipped", index=at, name=name or letters(at)))
        else:
            columns.append(Column(**vars(found), index=at, name=name or letters(at)))
    if fill and len(unknown) == 1 and not any(column.role in ("reading", "repeat") for column in columns):
        # What else stands beside masses?
        name = unknown[0].name
        by_name = ColumnMeaning("reading", unit_in(name), quantity_in(name), factor=factor_in(name))
        columns.append(replace(unknown.pop(), **vars(by_name)))
    # A table of other things beside the readings, a blank column between, is none of theirs.
    own_block = {column.index for column in columns if column.role in ("station", "reading", "repeat")}
    head = SheetRow(0, tuple(SheetCell(names.get(at, "")) for at in range(max(names, default=0) + 1)))
    spans = list(blocks([head, *body]))
    for column in unknown:
        span, lettered = next(span for span in spans if column.index in span), column.name == letters(column.index)
        if lettered or not own_block or own_block & set(span):
            what = f"column {quoted(column.name)} is unknown, and holds numbers."
            what = f"column {column.name} holds numbers and has no name." if lettered else what
            faults.add(place, what, SAY, column.name)
    return sorted([*columns, *unknown], key=lambda column: column.index)


def _one_table(place: Place, columns: list[Column], faults: FaultList) -> list[Column]:
    """Return the first of several tables side by side, each with its stations and readings: which is meant is asked."""
    starts = [at for at, column in enumerate(columns) if column.role == "station"]
    tables = [columns[start:end] for start, end in pairwise([*starts, len(columns)])]
    if len(tables) < 2 or not all(any(one.role in ("reading", "repeat") for one in table) for table in tables):
        return columns
    spans = [f"{letters(table[0].index)}:{letters(table[-1].index)}" for table in tables]
    found = f"{len(tables)} tables side by side, in columns {' and '.join(spans)}."
    faults.add(place, found, f'Say which is meant: [readings.columns] range = "{spans[0]}", or in pairing.csv.')
    return tables[0]


def _check_numbers(place: Place, readings: Sequence[Column], faults: FaultList) -> None:
    """Add a fault for columns of readings without a number, one of which may be the mean, or with the same one."""
    for label in dict.fromkeys(column.number for column in readings):
        columns = [column for column in readings if column.number == label]
        if label is None and len(readings) > 1:
            found = f"{_names(columns)}: no number, and there are {len(readings)} columns of readings."
            faults.add(place, found, f"Is one of them a mean? {SAY}", columns[0].name)
        elif len(columns) > 1:
            faults.add(place, f"repeat {label} occurs twice: {_names(columns)}.", SAY, columns[1].name)


def _check_factors(
    place: Place, columns: Sequence[Column], names: Collection[str], declared: Declared, faults: FaultList
) -> None:
    """Add a fault for each number that stands beside a unit, and may multiply it or say how finely was read."""
    if "unit" in (declared.as_written or ()):
        return
    numbers = {ten_at_unit(name) for name in names}
    labels = {found.number for name in names if (found := meaning(name)) is not None}
    for column in columns:
        # 10 is the number of a repeat where there is a ninth, and 1/10 where there is 2/10.
        ten = ten_at_unit(column.name)
        alone = ten is not None and ten - 1 not in numbers and f"{ten - 1}" not in labels
        of_many = column.number is not None and f"2-{column.number.partition('-')[2]}" in labels
        factor = column.factor if not of_many else None
        if factor is None and alone and column.role == "reading":
            factor = f"{ten}"
        if factor is not None:
            found = f"{quoted(column.name)}: {quoted(factor)} may be their unit, or how finely they were read."
            remedy = (
                "Write [1/10 mm] or [1/100 mm] for tenths or hundredths, and a unit without a number for whole ones; "
                'or answer readings.as_written = ["unit"] if the number is none of the unit.'
            )
            faults.add(replace(place, column=column.index), found, remedy, factor)


def _quantity(place: Place, readings: Sequence[Column], declared: Declared, faults: FaultList) -> Quantity | None:
    named: dict[Quantity, None] = dict.fromkeys(each.quantity for each in readings if each.quantity is not None)
    quantity: Quantity | None = declared.quantity if not named else next(iter(named))
    nameless = [column for column in readings if column.quantity is None]
    if len(named) > 1:
        remedy = "Name those that are read: [readings.columns] levels."
        faults.add(place, "level and depth columns in one sheet.", remedy)
    elif declared.quantity not in (None, quantity):
        found = f'the header names {quantity}, and [readings] quantity = "{declared.quantity}".'
        faults.add(place, found, "Correct the one that is wrong.")
    elif nameless and declared.quantity is None:
        faults.add(
            place,
            f"{_names(nameless)}: neither header nor trial file states whether readings count upward or downward.",
            'Say it: [readings] quantity = "level" (upward) or "depth" (downward), or sign in pairing.csv: up or down.',
        )
    return quantity


def _with_units(
    place: Place,
    columns: Sequence[Column],
    below: Mapping[int, ColumnUnit],
    said: ColumnUnit | None,
    faults: FaultList,
) -> list[Column]:
    """Return the columns with the units of their names, the row of units or their cells, else with the declared one."""
    whole = all(column.unit or column.index in below for column in columns)
    found = []
    for column in columns:
        own = [unit for unit in (column.unit, below.get(column.index)) if unit is not None]
        units = [*own, said] if said is not None and (whole or not own) else own
        if len(set(units)) > 1:
            what = f"{' and '.join(units)}: the header, units below it and readings.unit differ."
            in_column = replace(place, column=column.index, name=column.name)
            faults.add(in_column, what, "Correct the one that is wrong.")
        found.append(replace(column, unit=units[0] if units else None, unit_declared=bool(units) and not own))
    return found


def _common(beside: Sequence[UnitCell], body: Sequence[SheetRow]) -> dict[int, ColumnUnit]:
    """Return the units of columns of which each number has one beside it, and all the same."""
    found: dict[int, list[ColumnUnit | None]] = {}
    for one in beside:
        found.setdefault(one.column, []).append(one.unit)
    numbers = {at: sum(is_a_number(row.cell(at)) for row in body) for at in found}
    return {
        at: units[0]
        for at, units in found.items()
        if units[0] is not None and len(set(units)) == 1 and len(units) >= numbers[at]
    }


def _check_units_beside(
    grid: SheetGrid, columns: Sequence[Column], beside: Sequence[UnitCell], faults: FaultList
) -> None:
    """Add a fault for each row whose own unit is not that of its column."""
    by_index = {column.index: column for column in columns}
    for one in beside:
        column = by_index[one.column]
        if one.unit == column.unit and one.unit is not None:
            continue
        value, written = one.row.cell(one.column).text, quoted(one.written)
        place = grid.place(one.row.number, one.column, column.name)
        if one.written == "%":
            found = f"{quoted(value)} has the format of percentages, and shows {float(value) * 100:.12g} %."
            faults.add(place, found, "Give the column the format of numbers, and check the readings.", value)
            continue
        at = f"column {letters(one.at)}" if grid.turned is None else f"row {grid.turned[one.at]}"
        where = "the format of the number" if one.at == one.column else at
        other = f"and the others are in {column.unit}" if column.unit else "and no other unit is given"
        if one.unit is None:
            other = "which is no unit of length that is known"
        found = f"{quoted(value)} is in {written} by {where}, {other}."
        faults.add(place, found, "Write all of the column in one unit, that of its header and of readings.unit.", value)


def _check_units_of_remarks(
    grid: SheetGrid, remarks: Sequence[SheetRow], columns: Sequence[Column], faults: FaultList
) -> None:
    """Add a fault for a line above or below the table that gives another unit than any of the columns has."""
    known = {column.unit for column in columns}
    for row in remarks:
        text = " ".join(cell.text for cell in row.cells if cell.text)
        named = units_named(text)
        if named and not named & (known - {None}) and any(known):
            found = f"{quoted(text)}, and the columns are in {' and '.join(sorted(filter(None, known)))}."
            faults.add(grid.place(row.number), found, "Correct this line, a header or readings.unit.")


def other_zeros(header: Header) -> list[tuple[SheetRow, str]]:
    """Return remarks that say what the readings count from, and not in words for the sample's face."""
    return [(row, text) for row, text in _texts(header) if names_other_zero(text)]


def factors(header: Header) -> list[tuple[SheetRow, str]]:
    """Return remarks that give a factor of the readings."""
    return [(row, text) for row, text in _texts(header) if names_factor(text)]


def _texts(header: Header) -> list[tuple[SheetRow, str]]:
    return [(row, cell.text) for row in header.remarks for cell in row.cells if cell.kind == "text" and cell.text]
