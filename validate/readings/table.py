"""The columns of a sheet: which are places, readings and numbers of repeats, in which unit, and up or down."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, get_args

from sealtwin.core.doubts import CONFIRMS, Doubt
from validate.readings.beside import changes
from validate.readings.grid import Grid, letters, listed, quoted
from validate.readings.header import Header, SheetPart, cells_in, find_header, lettered, numeric, roles_in
from validate.readings.names import (
    MM,
    ColumnUnit,
    Role,
    has_rest,
    is_no_length,
    meaning,
    sample_key,
    unit_of,
    without_unit,
)
from validate.settings import Columns, Declared, DialUnit, Quantity, Unit


@dataclass(frozen=True)
class Column:
    index: int  # From 0
    role: Role
    unit: ColumnUnit | None = None
    quantity: Quantity | None = None


@dataclass
class Table:
    """The table of readings in a sheet. Its columns may be stand-ins while a question asks for them."""

    grid: Grid
    declared: Declared
    span: SheetPart
    header: Header
    body: list[int]  # Rows with cells below the header
    doubts: list[Doubt]  # All that is open in the sheet so far, and what may be a mistake
    station: Column | None = None
    readings: list[Column] = field(default_factory=list[Column])
    repeat: Column | None = None
    others: dict[int, Role] = field(default_factory=dict[int, Role])  # Columns that are known to be something else
    stands_in: bool = False  # True if columns that no name and no setting names stand in

    @property
    def chosen(self) -> Columns:
        return self.declared.columns or Columns()

    @property
    def used(self) -> list[Column]:
        return [column for column in (self.station, self.repeat, *self.readings) if column is not None]

    @property
    def quantity(self) -> Quantity | None:
        return self.readings[0].quantity if self.readings else None

    def ask(
        self,
        kind: str,
        finding: str,
        remedy: str = "",
        answers: Mapping[str, Any] | None = None,
        cells: Sequence[str] = (),
        row: int | None = None,
        *,
        stops: bool = False,
    ) -> None:
        """Add a question about the sheet or one of its rows; with an answer ``as_written`` it is a doubt."""
        self.doubts.append(Doubt(kind, self.grid.place(row), finding, remedy, answers or {}, tuple(cells), stops))

    def confirms(self, entry: str) -> bool:
        """Return whether ``as_written`` confirms an entry: a cell by itself, by its row or by its column."""
        parts = {entry, entry.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ"), entry.rstrip("0123456789")} - {""}
        return not parts.isdisjoint(self.declared.as_written or ())

    def is_open(self, *kinds: str) -> bool:
        """Return whether a question of these kinds, or any without kinds, must be answered."""
        return any(doubt.is_open and (not kinds or doubt.kind in kinds) for doubt in self.doubts)


def find_table(grid: Grid, declared: Declared) -> Table:
    """Return the table with the columns of places and of readings.

    What the sheet leaves open is added to its doubts, and the likeliest columns stand in for it, so that everything
    else about the sheet can be asked at the same time.
    """
    span = SheetPart.of((declared.columns or Columns()).range)
    header = find_header(grid, span)
    body = [row for row in grid.rows if header.first <= row <= span.bottom and any(cells_in(grid, span, row))]
    table = Table(grid, declared, span, header, body, [*grid.doubts])
    _end_before_next_table(table)
    _set_roles(table)
    _ask_for_units(table)
    _ask_for_direction(table)
    return table


def _end_before_next_table(table: Table) -> None:
    """Take the first of several tables one below the other, and ask for a range."""
    for count, row in enumerate(table.body):
        roles = roles_in(cell.text for _, cell in cells_in(table.grid, table.span, row))
        if count and "station" in roles and roles & {"reading", "repeat"}:
            _ask_for_range(table, f"another table begins in row {row}.")
            table.body = table.body[:count]
            return


def _ask_for_range(table: Table, finding: str, rows: str | None = None) -> None:
    remedy = 'Name the cells of the table of this sample, such as "A2:D18"; sort mixed rows in a copy. As_written with '
    remedy += '"range" confirms all texts outside.'
    table.ask("range", finding, remedy, {"columns.range": rows})


def _set_roles(table: Table) -> None:
    """Set the columns of a table by its names and the settings, or ask for them."""
    chosen, cells = table.chosen, [each for row in table.body for each in cells_in(table.grid, table.span, row)]
    numbers = sorted({column for column, cell in cells if numeric(cell) or cell.kind == "formula"})
    meanings = {column: what for column, name in table.header.names.items() if (what := meaning(name)) is not None}
    by_role = {role: [k for k, what in meanings.items() if what.role == role] for role in get_args(Role)}
    stations = _chosen(table, chosen.s and (chosen.s,), numbers, by_role["station"])
    readings = _chosen(table, chosen.levels, numbers, by_role["reading"])
    repeats = _chosen(table, chosen.repeat and (chosen.repeat,), numbers, by_role["repeat"])
    if chosen.levels is not None:
        repeats = [column for column in repeats if column not in readings and len(readings) == 1]
    unknown = [column for column in numbers if column not in {*meanings, *stations, *readings, *repeats}]
    unknown = unknown if chosen.s is None or chosen.levels is None else []
    if not readings and not unknown:
        # A bare "Messung" has the readings, unless another column has them: then it counts repeats.
        readings, repeats = repeats, []
    for column in by_role["sample"]:
        _ask_about_samples(table, column)
    if problems := [*_problems(table, stations, readings, repeats, unknown)]:
        table.stands_in = not (stations and readings)
        stations, readings = _stand_ins(table, stations, readings, unknown or numbers, f"{'; '.join(problems)}.")
        repeats = []
        # Another column may be the answer: its name is asked about in the same round.
        for column in sorted({*unknown} - {*stations, *readings}):
            _column(table, column, "repeat")
    table.station = next((_column(table, column, "station") for column in stations), None)
    table.readings = [_column(table, column, "reading") for column in readings]
    table.repeat = next((_column(table, column, "repeat") for column in repeats), None)
    used = {column.index for column in table.used}
    table.others = {column: what.role for column, what in meanings.items() if column not in used}


def _chosen(table: Table, entries: Sequence[str] | None, numbers: Sequence[int], by_name: list[int]) -> list[int]:
    """Return the columns whose letters a setting has; without it, those by their names."""
    if entries is None:
        return by_name
    columns = {entry: [k for k in lettered(entry) if k in {*table.header.names, *numbers}] for entry in entries}
    if empty := [entry for entry, of_entry in columns.items() if not of_entry]:
        table.ask("columns", f"{listed(empty)} is no column of the table.", "Name columns by their letters.")
    return [*dict.fromkeys(column for of_entry in columns.values() for column in of_entry)]


def _problems(
    table: Table, stations: Sequence[int], readings: Sequence[int], repeats: Sequence[int], unknown: Sequence[int]
) -> Iterator[str]:
    """Yield what is not clear about the columns, as parts of a sentence."""
    names = [table.header.names.get(column, "") for column in readings]
    meanings = [what for what in map(meaning, names) if what is not None]
    kinds = {_kind(table, column) for column in readings}
    if len(stations) != 1 or {*stations} & {*readings}:
        yield f"{_named(table, stations) or 'no column'} is the place along the crack"
    if not readings:
        yield "no column is named as a reading"
    if unknown:
        yield f"{_named(table, unknown)} has numbers under an unknown name"
    if table.chosen.levels is None:
        if len(kinds) > 1:
            yield f"{_named(table, readings)} differ in unit or direction"
        if any(int(what.number or 0) > len(readings) for what in meanings):
            yield f"{_named(table, readings)} has a number that counts no repeats"
    if len(repeats) > 1 or (repeats and len(readings) > 1):
        yield f"{_named(table, repeats)} counts repeats by its name, beside other columns"


def _kind(table: Table, column: int) -> tuple[ColumnUnit | None, Quantity | None]:
    """Return unit and direction in the name of a column."""
    what = meaning(table.header.names.get(column, ""))
    return (None, None) if what is None else (what.unit, what.quantity)


def _named(table: Table, columns: Sequence[int]) -> str:
    names = table.header.names
    return listed([f"column {letters(k)}{f' {quoted(names[k])}' if k in names else ''}" for k in columns])


def _stand_ins(
    table: Table, stations: list[int], readings: list[int], likely: Sequence[int], finding: str
) -> tuple[list[int], list[int]]:
    """Return the likeliest columns, and ask for them."""
    beside = [column for column in readings if stations[1:] and column < stations[1]]
    if beside and beside != readings:
        _ask_for_range(table, f"{finding} Are there several tables?")
        return stations[:1], beside
    answers: dict[str, Any] = {"columns.s": letters(stations[0]) if len(stations) == 1 else None}
    stations = sorted(stations, key=lambda column: _kind(table, column)[0] is None)
    stations = (stations or [column for column in likely if column not in readings])[:1]
    named = [column for column in readings if column not in stations]
    named = [column for column in named if _kind(table, column) == _kind(table, named[0])]
    answers["columns.levels"] = [*map(letters, named)] or None
    remedy = "Name the columns of places and readings by their letters; transpose a table of rows in a copy."
    table.ask("columns", finding, remedy, answers)
    return stations, named or [column for column in likely if column not in stations]


def _column(table: Table, column: int, role: Role) -> Column:
    """Return a column; ask about marks of its name that may change what is read, whatever is declared."""
    name = table.header.names.get(column, "")
    rest, unit, _ = without_unit(name)
    row, answer = max(table.header.rows, default=1), [letters(column)]
    if role != "repeat" and (is_no_length(name) or unit in ("g", "kg")):
        finding = f"{quoted(name)} is no length, but a share, an angle, a ratio or a mass."
        table.ask("no length", finding, "Name other columns, or write lengths into the sheet.", row=row)
    elif has_rest(name) or (meaning(name) is None and changes(rest)):
        remedy = "If it does, write what it says into other answers (unit, datum, end of s); then confirm it."
        table.ask("name", f"does {quoted(name)} change the readings?", remedy, {CONFIRMS: answer}, answer, row)
    return Column(column, role, unit, _kind(table, column)[1])


def _ask_about_samples(table: Table, column: int) -> None:
    """Take the rows of one sample, and ask for a range, if a column names several."""
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
    """Set the unit of each column by its name, its cells or the settings, and ask for one that is open."""
    declared, places = table.declared.unit, table.chosen.places
    lacking, another, is_needed = list[Column](), list[int](), False

    def with_unit(column: Column) -> Column:
        nonlocal is_needed
        values = [numeric(table.grid.cell(row, column.index)) for row in table.body]
        texts = dict.fromkeys(value[1] for value in values if value is not None)
        units = {column.unit, *(unit_of(text) or text for text in texts)} - {None, ""}
        if units - {*MM} - {column.unit} or len(units) > 1 or (units and "" in texts and column.unit is None):
            finding = f"column {letters(column.index)} has {' and '.join(filter(None, texts))} in its cells"
            table.ask("unit", f"{finding}, and its name has {column.unit or 'no unit'}.", "Write all in one unit.")
        setting: ColumnUnit | None = declared
        if column.role == "station" and (places is not None or declared in get_args(DialUnit)):
            setting = "mm" if isinstance(places, tuple) else places
        unit = next((unit for unit in (column.unit, *map(unit_of, texts)) if unit is not None), None)
        lacking.extend([column] if unit is None and setting is None else [])
        another.extend([column.index] if unit in MM and setting not in (None, unit) else [])
        is_needed = is_needed or unit is None
        return replace(column, unit=unit or setting)

    table.station = None if table.station is None else with_unit(table.station)
    table.readings = [*map(with_unit, table.readings)]
    if another and places is None and not is_needed:
        finding = f"{_named(table, another)} has another unit than the settings, {declared}."
        table.ask("unit", finding, "Remove the setting, or correct the header.")
    if lacking:
        roles, remedy = {column.role for column in lacking}, f"Units are {', '.join(get_args(Unit))}."
        answers = {key: None for key, role in (("columns.places", "station"), ("unit", "reading")) if role in roles}
        cells = [column.index for column in lacking]
        table.ask("unit", f"{_named(table, cells)} has no unit.", remedy, answers, [*map(letters, cells)])


def _ask_for_direction(table: Table) -> None:
    written = {column.quantity for column in table.readings if column.quantity is not None}
    quantity = table.declared.quantity or next(iter(written), None)
    if written - {quantity}:
        finding = f"the header has {' and '.join(sorted(written))}, of which one is read."
        table.ask("quantity", finding, "Remove the setting, or choose other columns.")
    elif quantity is None and table.readings:
        finding = "nothing says whether the readings count upward from the face (level) or downward (depth)."
        table.ask("quantity", finding, answers={"quantity": None})
    table.readings = [replace(column, quantity=quantity) for column in table.readings]
