"""The columns of a sheet: which are places, readings and numbers of repeats, in which unit, and up or down."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, get_args

from sealtwin.core.doubts import CONFIRMS, Doubt
from validate.readings.beside import changes
from validate.readings.grid import Grid, letters, quoted
from validate.readings.header import Header, Span, cells_in, find_header, lettered, names_of, numeric
from validate.readings.names import (
    FACTORS,
    MM,
    ColumnUnit,
    Role,
    has_rest,
    is_calculated,
    is_no_length,
    meaning,
    sample_key,
    unit_in,
    unit_of,
    without_unit,
)
from validate.readings.numbers import number, plain_letters
from validate.settings import Columns, Declared, DialUnit, Quantity, Unit

MOST_NAMED = 8  # Columns or rows that a sentence names
DIAL_UNITS = get_args(DialUnit)


@dataclass(frozen=True)
class Column:
    index: int  # From 0
    name: str
    role: Role
    unit: ColumnUnit | None = None
    quantity: Quantity | None = None
    is_declared: bool = False  # True if only the settings give the unit


@dataclass
class Questions:
    """All that is open in a sheet so far, and what may be a mistake."""

    doubts: list[Doubt] = field(default_factory=list[Doubt])

    def ask(
        self,
        kind: str,
        place: str,
        finding: str,
        remedy: str = "",
        answers: Mapping[str, Any] | None = None,
        cells: Sequence[str] = (),
    ) -> None:
        """Add a question; with an answer ``as_written`` it is a doubt."""
        self.doubts.append(Doubt(kind, place, finding, remedy, answers or {}, tuple(cells)))

    def kinds(self) -> set[str]:
        return {doubt.kind for doubt in self.doubts if doubt.is_open}


@dataclass
class Table:
    """The table of readings in a sheet. Its columns may be stand-ins while a question asks for them."""

    grid: Grid
    span: Span
    header: Header
    station: Column | None
    readings: list[Column]
    repeat: Column | None
    others: dict[int, Column]  # Columns that are known to be something else
    body: list[int]  # Rows with cells below the header
    stands_in: bool  # True if a question asks for the columns

    @property
    def used(self) -> list[Column]:
        return [column for column in (self.station, self.repeat, *self.readings) if column is not None]

    @property
    def quantity(self) -> Quantity | None:
        return self.readings[0].quantity if self.readings else None


def find_table(grid: Grid, declared: Declared, questions: Questions, along: Role = "station") -> Table:
    """Return the table with the columns of places (or of masses, ``along``) and of readings.

    What the sheet leaves open is added to ``questions``, and the likeliest columns stand in for it, so that everything
    else about the sheet can be asked at the same time.
    """
    chosen = declared.columns or Columns()
    span = Span.of(chosen.range)
    header = find_header(grid, span, chosen, along)
    body = [row for row in grid.rows if header.first <= row <= span.bottom and any(cells_in(grid, span, row))]
    body = _before_next_table(grid, span, body, questions, along)
    table = Table(grid, span, header, None, [], None, {}, body, stands_in=False)
    _set_roles(table, declared, questions, along)
    _ask_for_units(table, declared, questions)
    _ask_for_direction(table, declared, questions)
    return table


def _before_next_table(grid: Grid, span: Span, body: list[int], questions: Questions, along: str) -> list[int]:
    """Return the rows of the first of several tables one below the other, and ask for a range."""
    for count, row in enumerate(body):
        roles = {what.role for name in names_of(grid, span, [row]).values() if (what := meaning(name))}
        if count and along in roles and roles & {"reading", "repeat"}:
            last = max((each for each in body[:count] if any(map(numeric, grid.rows[each]))), default=row)
            right = max(len(grid.rows[each]) for each in body[:count])
            _ask_for_range(grid, questions, f"another table begins in row {row}.", (0, body[0], right - 1, last))
            return body[:count]
    return body


def _ask_for_range(grid: Grid, questions: Questions, finding: str, part: tuple[int, int, int, int]) -> None:
    left, top, right, bottom = part
    answer = {"columns.range": f"{letters(left)}{top}:{letters(right)}{bottom}"}
    questions.ask("range", grid.place(), finding, "Name the cells of the table of this sample.", answer)


def _set_roles(table: Table, declared: Declared, questions: Questions, along: Role) -> None:
    """Set the columns of a table by its names and the settings, or ask for them."""
    chosen, names, numbers = declared.columns or Columns(), table.header.names, _columns_of_numbers(table)
    meanings = {column: what for column, name in names.items() if (what := meaning(name)) is not None}
    by_role: dict[Role, list[int]] = {role: [] for role in get_args(Role)}
    for column, what in meanings.items():
        by_role[what.role].append(column)
    stations, readings, repeats = by_role[along], by_role["reading"], by_role["repeat"]
    stations = stations if chosen.s is None else _chosen(table, chosen.s, numbers, questions)
    repeats = repeats if chosen.repeat is None else _chosen(table, chosen.repeat, numbers, questions)
    if chosen.levels is not None:
        columns = (column for entry in chosen.levels for column in _chosen(table, entry, numbers, questions))
        readings = [*dict.fromkeys(columns)]
        repeats = [column for column in repeats if column not in readings]
        repeats = [] if chosen.repeat is None and (len(readings) > 1 or not _counts(table, repeats)) else repeats
    if not readings:
        # A bare "Messung" has the readings, unless another column has them: then it counts repeats.
        readings, repeats = repeats, []
    used = {*stations, *readings, *repeats}
    unknown = [column for column in numbers if column not in meanings and column not in used]
    unknown = unknown if chosen.s is None or chosen.levels is None else []
    problems = list(_problems(table, stations, readings, repeats, unknown, is_chosen=chosen.levels is not None))
    for column in by_role["sample"]:
        _ask_about_samples(table, column, declared.sample or table.grid.path.stem, questions)
    if problems:
        table.stands_in = True
        stations, readings = _stand_ins(table, stations, readings, unknown, numbers, problems, questions)
        repeats = []
    table.station = next((_column(table, column, along, questions) for column in stations), None)
    table.readings = [_column(table, column, "reading", questions) for column in readings]
    table.repeat = next((_column(table, column, "repeat", questions) for column in repeats), None)
    used = {column.index for column in table.used}
    table.others = {
        column: Column(column, names[column], role)
        for role in ("other", "repeat", "sample")
        for column in by_role[role]
        if column not in used
    }


def _columns_of_numbers(table: Table) -> list[int]:
    """Return the columns with numbers below the header, except in rows of means."""
    columns = set[int]()
    for row in table.body:
        cells = list(cells_in(table.grid, table.span, row))
        if not is_calculated(cells[0][1].text):
            columns |= {column for column, cell in cells if numeric(cell) or cell.kind == "formula"}
    return sorted(columns)


def _chosen(table: Table, entry: str, numbers: Sequence[int], questions: Questions) -> list[int]:
    """Return the columns that a setting names, by letter or by name; a question asks for one that is missing."""
    names = table.header.names
    by_name = [column for column, name in names.items() if plain_letters(name) == plain_letters(entry)]
    by_letter = [column for column in lettered(entry) if column in {*names, *numbers}]
    if not by_name + by_letter or (by_name and by_letter and by_name != by_letter[:1]):
        what = "is a letter and also a name" if by_name else "is not a column"
        finding = f"{quoted(entry)} {what}; the columns are {_named(table, [*names])}."
        questions.ask("columns", table.grid.place(), finding, 'Name it by its letter, such as "B:B".')
    return by_letter or by_name


def _problems(
    table: Table,
    stations: Sequence[int],
    readings: Sequence[int],
    repeats: Sequence[int],
    unknown: Sequence[int],
    *,
    is_chosen: bool,
) -> Iterator[str]:
    """Yield what is not clear about the columns, as parts of a sentence."""
    names = [table.header.names.get(column, "") for column in readings]
    if len(stations) != 1 or {*stations} & {*readings}:
        yield f"{_named(table, stations) or 'no column'} is the place along the crack"
    if not readings:
        yield "no column is named as a reading"
    if unknown:
        yield f"{_named(table, unknown)} has numbers under an unknown name"
    if not is_chosen:
        if len(set(map(plain_letters, names))) < len(names):
            yield f"{_named(table, readings)} have the same name"
        known = [what for what in map(meaning, names) if what is not None]
        if any(int(what.number or 0) > len(readings) for what in known):
            yield f"{_named(table, readings)} has a number that counts no repeats"
        if any(
            len({*each} - {None}) > 1 for each in ([what.unit for what in known], [what.quantity for what in known])
        ):
            yield f"{_named(table, readings)} differ in unit or direction"
    if len(repeats) > 1 or (repeats and len(readings) > 1) or not _counts(table, repeats):
        yield f"{_named(table, repeats)} counts repeats by its name, but not by its cells or beside other columns"


def _counts(table: Table, columns: Sequence[int]) -> bool:
    """Return whether the numbers of columns are whole."""
    texts = {table.grid.cell(row, column).text for row in table.body for column in columns}
    return not any((number(text) or 0) % 1 for text in texts)


def _named(table: Table, columns: Sequence[int]) -> str:
    names = table.header.names
    texts = [f"{letters(k)} {quoted(names[k])}" if k in names else letters(k) for k in columns[:MOST_NAMED]]
    more = f" and {len(columns) - MOST_NAMED} more" if len(columns) > MOST_NAMED else ""
    return f"column {', '.join(texts)}{more}" if columns else ""


def _stand_ins(
    table: Table,
    stations: list[int],
    readings: list[int],
    unknown: Sequence[int],
    numbers: Sequence[int],
    problems: Sequence[str],
    questions: Questions,
) -> tuple[list[int], list[int]]:
    """Return the likeliest columns, and ask for them."""
    finding = f"{'; '.join(problems)}."
    if len(stations) > 1 and len(readings) > 1:
        last = stations[1] - 1
        while last > stations[0] and not any(numeric(table.grid.cell(row, last)) for row in table.body):
            last -= 1
        part = stations[0], min((*table.header.rows, *table.body)), last, table.body[-1]
        _ask_for_range(table.grid, questions, f"{finding} Are there several tables?", part)
        return stations[:1], [column for column in readings if column <= last]
    names, cells = table.header.names, [table.grid.cell(row, table.span.left).text for row in table.body]
    if {what.role for what in map(meaning, cells) if what is not None} & {"station", "reading"} == {
        "station",
        "reading",
    }:
        remedy = "Transpose the table in a copy: one row for each place."
        questions.ask("transposed", table.grid.place(), "has its places side by side.", remedy)
        return [], []
    likely = unknown or [column for column in numbers if column not in stations]
    stations = stations or [column for column in likely if column not in readings and _is_monotonic(table, column)]
    readings = [column for column in readings or likely if column not in stations[:1]]
    alike = [
        (unit_in(name), what and what.quantity)
        for column in readings
        for name in [names.get(column, "")]
        for what in [meaning(name)]
    ]
    readings = [column for column, each in zip(readings, alike, strict=True) if each == alike[0]]
    levels = [letters(column) for column in readings] or ["B"]
    is_run = len(readings) > 1 and readings[-1] - readings[0] == len(readings) - 1
    answers = {
        "columns.s": letters(stations[0]) if stations else "A",
        "columns.levels": [f"{levels[0]}:{levels[-1]}"] if is_run else levels,
    }
    remedy = "Name the columns of places and of readings by their letters; others are not read then."
    questions.ask("columns", table.grid.place(), finding, remedy, answers if readings else {})
    return stations[:1], readings


def _is_monotonic(table: Table, column: int) -> bool:
    texts = [numeric(table.grid.cell(row, column)) for row in table.body]
    values = [value for text in texts if text and (value := number(text[0])) is not None]
    steps = [after - before for before, after in pairwise(values)]
    return bool(steps) and (min(steps) > 0 or max(steps) < 0)


def _column(table: Table, column: int, role: Role, questions: Questions) -> Column:
    """Return a column; ask about marks of its name that may change what is read, whatever is declared."""
    name = table.header.names.get(column, "")
    place, answer = table.grid.place(max(table.header.rows, default=1), column), letters(column)
    if role not in ("repeat", "mass") and (is_no_length(name) or unit_in(name) in ("g", "kg")):
        finding = f"{quoted(name)} is no length, but a share, an angle, a ratio or a mass."
        questions.ask("no length", place, finding, "Name other columns, or write lengths into the sheet.")
    elif has_rest(name) or (meaning(name) is None and changes(without_unit(name)[0])):
        remedy = "If it does, write the readings that are meant under a plain name."
        questions.ask(
            "name", place, f"does {quoted(name)} change the readings?", remedy, {CONFIRMS: [answer]}, [answer]
        )
    what = meaning(name)
    return Column(column, name, role, unit_in(name), None if what is None else what.quantity)


def _ask_about_samples(table: Table, column: int, sample: str, questions: Questions) -> None:
    """Ask for a range if a column names several samples."""
    names, name = dict[str, list[int]](), ""
    for row in table.body:
        name = table.grid.cell(row, column).text or name
        names.setdefault(name, []).append(row)
    if len(names) > 1:
        several = ", ".join(map(quoted, [*names][:MOST_NAMED]))
        table.body = rows = names[min(names, key=lambda name: sample_key(name) != sample_key(sample))]
        part = 0, rows[0], max(len(table.grid.rows[row]) for row in rows) - 1, rows[-1]
        finding = f"column {letters(column)} names {len(names)} samples: {several}."
        _ask_for_range(table.grid, questions, finding, part)


def _ask_for_units(table: Table, declared: Declared, questions: Questions) -> None:
    """Set the unit of each column by its name, its cells or the settings, and ask for one that is open."""
    grid, places = table.grid, (declared.columns or Columns()).places
    lacking, other = list[str](), list[Column]()

    def with_unit(column: Column) -> Column:
        values = [value for row in table.body if (value := numeric(grid.cell(row, column.index)))]
        texts = {unit for _, unit in values}
        units: set[ColumnUnit | None] = {unit_of(text) for text in texts if text}
        allowed = {*FACTORS} if column.role == "mass" else {*MM}
        is_mixed = len({*units, column.unit} - {None}) > 1 or (units and "" in texts and column.unit is None)
        if units - allowed or is_mixed:
            finding = f"column {letters(column.index)} has {', '.join(sorted(filter(None, texts)))} in its cells"
            finding += "." if column.unit is None else f", and {column.unit} in its name."
            questions.ask("unit", grid.place(), finding, "Write all its numbers in one unit of length.")
        setting: ColumnUnit | None = declared.unit
        if column.role == "station" and places is not None:
            setting = places if isinstance(places, str) else "mm"
        elif column.role == "mass" or (column.role == "station" and setting in DIAL_UNITS):
            setting = None
        unit = column.unit or next(iter(units - {None}), None)
        other.extend([column] if unit is not None and setting not in (None, unit) else [])
        lacking.extend([letters(column.index)] if unit is None and setting is None else [])
        return replace(column, unit=unit or setting, is_declared=unit is None)

    table.station = None if table.station is None else with_unit(table.station)
    table.readings = [with_unit(column) for column in table.readings]
    if other and places is None and not any(column.is_declared for column in table.used):
        finding = (
            f"{_named(table, [column.index for column in other])} has a unit, but readings.unit is {declared.unit}."
        )
        questions.ask("unit", grid.place(), finding, "Remove the setting, or correct the header.")
    if lacking:
        finding, remedy = f"column {', '.join(lacking)} has no unit.", f"Units are {', '.join(get_args(Unit))}."
        answer = {"unit" if declared.unit is None else "columns.places": "mm"}
        questions.ask("unit", grid.place(), finding, remedy, answer, lacking)


def _ask_for_direction(table: Table, declared: Declared, questions: Questions) -> None:
    written = {column.quantity for column in table.readings} - {None}
    quantity = declared.quantity or next(iter(written), None)
    place = table.grid.place()
    if written - {quantity}:
        finding = f"the header has {' and '.join(sorted(written))}, of which one is read."
        questions.ask("quantity", place, finding, "Remove the setting, or choose other columns.")
    elif quantity is None and table.readings:
        finding = "nothing says whether the readings count upward from the face (level) or downward (depth)."
        questions.ask("quantity", place, finding, answers={"quantity": "depth"})
    table.readings = [replace(column, quantity=quantity) for column in table.readings]
