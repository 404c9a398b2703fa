"""The columns of a sheet: which are places, readings and numbers of repeats, in which unit, and up or down."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, get_args

from sealtwin.core.doubts import CONFIRMS, Doubt
from validate.readings.grid import Grid, letters, quoted
from validate.readings.header import Header, Span, cells_in, find_header, lettered, names_of, numeric
from validate.readings.names import (
    FACTORS,
    ColumnUnit,
    Meaning,
    Role,
    has_rest,
    is_calculated,
    is_no_length,
    meaning,
    unit_in,
    unit_of,
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
    columns = declared.columns or Columns()
    span = Span.of(columns.range)
    header = find_header(grid, span, columns, along)
    rows = [row for row in grid.rows if max(header.first, span.top) <= row <= span.bottom and row not in header.rows]
    body = [row for row in rows if any(True for _ in cells_in(grid, span, row))]
    body = _before_next_table(grid, span, header, body, questions, along)
    table = _Roles(grid, span, header, body, declared, questions, along).table()
    _ask_for_units(table, declared, questions, along)
    _ask_for_direction(table, declared, questions)
    return table


def _before_next_table(
    grid: Grid, span: Span, header: Header, body: list[int], questions: Questions, along: str
) -> list[int]:
    """Return the rows of the first of several tables one below the other, and ask for a range."""
    for number_of_row, row in enumerate(body):
        names = {column: what for column, name in names_of(grid, span, [row]).items() if (what := meaning(name))}
        roles = {what.role for what in names.values()}
        if along in roles and roles & {"reading", "repeat"} and number_of_row:
            first = min((*header.rows, *body))
            last = max((each for each in body[:number_of_row] if any(numeric(cell) for cell in grid.rows[each])), default=row)
            right = max(len(grid.rows[each]) for each in body[:number_of_row])
            _ask_for_range(grid, questions, f"another table begins in row {row}.", (0, first, right - 1, last))
            return body[:number_of_row]
    return body


def _ask_for_range(grid: Grid, questions: Questions, finding: str, part: tuple[int, int, int, int]) -> None:
    left, top, right, bottom = part
    span = f"{letters(left)}{top}:{letters(right)}{bottom}"
    remedy = "Name the cells of one table; for several samples in pairing.csv, in a row of the file for each."
    questions.ask("range", grid.place(), finding, remedy, {"columns.range": span})


@dataclass
class _Roles:
    """Decides the roles of the columns of one table."""

    grid: Grid
    span: Span
    header: Header
    body: list[int]
    declared: Declared
    questions: Questions
    along: Role

    def table(self) -> Table:
        names, chosen = self.header.names, self.declared.columns or Columns()
        numbers = self._numbers()
        meanings = {column: meaning(name) for column, name in names.items()}
        stations = self._chosen(chosen.s) if chosen.s is not None else self._with_role(meanings, self.along)
        repeats = self._chosen(chosen.repeat) if chosen.repeat is not None else self._with_role(meanings, "repeat")
        readings = self._with_role(meanings, "reading")
        if chosen.levels is not None:
            readings = [column for entry in chosen.levels for column in self._chosen(entry)]
            repeats = repeats if chosen.repeat is not None or (len(readings) == 1 and len(repeats) == 1) else []
        repeats = [column for column in repeats if column not in readings]
        if not readings or len(repeats) > 1:
            readings, repeats = sorted({*readings, *repeats}), []
        unknown = [
            column
            for column in numbers
            if meanings.get(column) is None and column not in (*stations, *readings, *repeats)
        ]
        if chosen.levels is not None and chosen.s is not None:
            unknown = []
        problems = list(self._problems(stations, readings, repeats, unknown, meanings))
        others = {
            column: Column(column, names[column], "other", what.unit)
            for column, what in meanings.items()
            if what is not None and what.role in ("other", "sample") and column not in (*stations, *readings, *repeats)
        }
        self._check_samples(meanings, others)
        if problems:
            stations, readings = self._stand_ins(stations, readings, unknown, numbers, problems)
        used = [self._column(column, self.along) for column in stations[:1]]
        levels = [self._column(column, "reading") for column in readings]
        counter = self._column(repeats[0], "repeat") if repeats and not problems else None
        if counter is None:
            others |= {column: self._column(column, "other") for column in repeats}
        for column in [*used, *levels]:
            self._check_name(column, problems)
        station = used[0] if used else None
        return Table(
            self.grid, self.span, self.header, station, levels, counter, others, self.body, stands_in=bool(problems)
        )

    def _numbers(self) -> list[int]:
        """Return the columns with numbers below the header, but for rows of means."""
        columns = set[int]()
        for row in self.body:
            cells = list(cells_in(self.grid, self.span, row))
            if not is_calculated(cells[0][1].text):
                columns |= {column for column, cell in cells if numeric(cell) or cell.kind == "formula"}
        return sorted(columns)

    def _with_role(self, meanings: Mapping[int, Meaning | None], role: Role) -> list[int]:
        return [column for column, what in meanings.items() if what is not None and what.role == role]

    def _chosen(self, entry: str) -> list[int]:
        """Return the columns that a setting names, by letter or by name; a question asks for one that is missing."""
        by_name = [k for k, name in self.header.names.items() if plain_letters(name) == plain_letters(entry)]
        by_letter = [column for column in lettered(entry) if column in {*self.header.names, *self._numbers()}]
        if by_name and by_letter and by_name != by_letter:
            finding = f"{quoted(entry)} is a letter and also a name of a column."
            self.questions.ask("columns", self.grid.place(), finding, f"Write {entry}:{entry} for the letter.")
        elif not by_name and not by_letter:
            names = ", ".join(f"{letters(k)} {quoted(name)}" for k, name in [*self.header.names.items()][:MOST_NAMED])
            finding = f"{quoted(entry)} is not a column; there are {names or 'no names'}."
            self.questions.ask("columns", self.grid.place(), finding, "Name another one, by its letter.")
        return by_letter or by_name

    def _problems(
        self,
        stations: Sequence[int],
        readings: Sequence[int],
        repeats: Sequence[int],
        unknown: Sequence[int],
        meanings: Mapping[int, Meaning | None],
    ) -> Iterator[str]:
        """Yield what is not clear about the columns, as parts of a sentence."""
        names = self.header.names
        along = "place along the crack" if self.along == "station" else "mass"
        if len(stations) != 1:
            yield f"{self._named(stations) or 'no column'} names the {along}"
        if not readings:
            yield "no column names readings"
        if unknown:
            yield f"{self._named(unknown)} has numbers under an unknown name"
        quantities = {what.quantity for column in readings if (what := meanings.get(column)) is not None}
        if (self.declared.columns or Columns()).levels is None:
            if len({plain_letters(names.get(column, "")) for column in readings}) < len(readings):
                yield f"{self._named(readings)} have the same name"
            if len(quantities - {None}) > 1:
                yield f"{self._named(readings)} count in both directions"
            if len({unit for k in readings if (unit := unit_in(names.get(k, "")))}) > 1 and self._is_one_name(readings):
                yield f"{self._named(readings)} have different units under the same name"
        if repeats and len(readings) > 1:
            yield f"{self._named(repeats)} numbers repeats, beside {self._named(readings)}"
        for column in repeats:
            values = {text for row in self.body if (text := self.grid.cell(row, column).text)}
            if readings and any((value := number(text)) is not None and value % 1 for text in values):
                yield f"{self._named([column])} numbers repeats by its name, but has other numbers"

    def _is_one_name(self, readings: Sequence[int]) -> bool:
        first = [self.grid.cell(self.header.rows[0], k).text for k in readings] if self.header.rows else []
        return "" in first

    def _named(self, columns: Sequence[int]) -> str:
        names = self.header.names
        texts = [f"{letters(k)} {quoted(names[k])}" if k in names else letters(k) for k in columns[:MOST_NAMED]]
        more = f" and {len(columns) - MOST_NAMED} more" if len(columns) > MOST_NAMED else ""
        return f"column {', '.join(texts)}{more}" if columns else ""

    def _stand_ins(
        self, stations: list[int], readings: list[int], unknown: list[int], numbers: list[int], problems: list[str]
    ) -> tuple[list[int], list[int]]:
        """Return the likeliest columns, and ask for them."""
        if len(stations) > 1 and len(readings) > 1:
            last = max((column for column in numbers if column < stations[1]), default=stations[0])
            part = stations[0], min((*self.header.rows, *self.body)), last, self.body[-1] if self.body else 1
            _ask_for_range(self.grid, self.questions, f"{', '.join(problems)}: tables side by side.", part)
            return stations[:1], [column for column in readings if column <= last]
        likely = [column for column in numbers if column in unknown or column in readings]
        if not stations:
            rising = [column for column in [*likely, *numbers] if self._rises(column)]
            stations = rising[:1]
        readings = [column for column in readings or likely if column not in stations]
        s, levels = (stations[0] if stations else 0), readings or [(stations or [0])[0] + 1]
        is_run = levels == list(range(levels[0], levels[-1] + 1)) and len(levels) > 1
        span = [f"{letters(levels[0])}:{letters(levels[-1])}"] if is_run else [letters(column) for column in levels]
        answers: dict[str, Any] = {"columns.s": letters(s), "columns.levels": span}
        finding = f"{'; '.join(problems)}."
        remedy = "Name the columns of places and of readings by their letters; others are not read then."
        self.questions.ask("columns", self.grid.place(), finding, remedy, answers)
        return stations[:1], readings

    def _rises(self, column: int) -> bool:
        texts = [numeric(self.grid.cell(row, column)) for row in self.body]
        values = [value for text in texts if text and (value := number(text[0])) is not None]
        steps = [after - before for before, after in zip(values, values[1:], strict=False)]
        return len(values) > 1 and (min(steps) > 0 or max(steps) < 0)

    def _column(self, column: int, role: Role) -> Column:
        name = self.header.names.get(column, "")
        what = meaning(name)
        return Column(column, name, role, unit_in(name), None if what is None else what.quantity)

    def _check_name(self, column: Column, problems: Sequence[str]) -> None:
        """Ask about marks of a name that may change what is read, whatever is declared."""
        place, answer = self.grid.place(max(self.header.rows, default=1), column.index), letters(column.index)
        if is_no_length(column.name):
            finding = f"{quoted(column.name)} is no length: a share, an angle or a ratio."
            self.questions.ask("no length", place, finding, "Name other columns, or give lengths in the sheet.")
        elif has_rest(column.name):
            finding = f"does {quoted(column.name)} change the readings?"
            remedy = "If it does, write the readings that are meant under a plain name."
            self.questions.ask("name", place, finding, remedy, {CONFIRMS: [answer]}, [answer])

    def _check_samples(self, meanings: Mapping[int, Meaning | None], others: Mapping[int, Column]) -> None:
        """Ask for a range if a column names several samples."""
        for column in self._with_role(meanings, "sample"):
            if column not in others:
                continue
            names = dict[str, list[int]]()
            for row in self.body:
                if text := self.grid.cell(row, column).text:
                    names.setdefault(text, []).append(row)
            if len(names) > 1:
                several = ", ".join(map(quoted, [*names][:MOST_NAMED]))
                rows = next(iter(names.values()))
                _ask_for_range(
                    self.grid,
                    self.questions,
                    f"column {letters(column)} names {len(names)} samples: {several}.",
                    (0, rows[0], max(len(self.grid.rows[row]) for row in rows) - 1, rows[-1]),
                )


def _ask_for_units(table: Table, declared: Declared, questions: Questions, along: str) -> None:
    """Set the unit of each column by its name, its cells or the settings, and ask for one that is open."""
    grid, columns = table.grid, declared.columns or Columns()
    places = columns.places
    lacking = list[str]()

    def with_unit(column: Column) -> Column:
        units = dict[str, str]()
        plain = 0
        for row in table.body:
            if value := numeric(grid.cell(row, column.index)):
                plain += not value[1]
                units |= {value[1]: f"{letters(column.index)}{row}"} if value[1] else {}
        known = {unit_of(text): cell for text, cell in units.items()}
        if wrong := [text for text in units if unit_of(text) not in FACTORS]:
            finding = f"{quoted(wrong[0])} is not a unit that is read."
            cells = [units[text] for text in wrong]
            questions.ask("unit", grid.place(), f"{cells[0]}: {finding}", "Give millimetres.", cells=cells)
            return replace(column, unit=column.unit or "mm")
        if len({*known, *([column.unit] if column.unit else [])}) > 1 or (known and plain and column.unit is None):
            finding = f"column {letters(column.index)} has more than one unit, or a unit in some cells only."
            questions.ask("unit", grid.place(), finding, "Write all numbers in one unit.", cells=[*known.values()])
        unit = column.unit or next(iter(known), None)
        given: ColumnUnit | None = declared.unit
        if column.role == "station":
            given = places if isinstance(places, str) else None if given in DIAL_UNITS else given
            given = "mm" if isinstance(places, tuple) else given
        if along == "mass" and column.role == "mass":
            given = None
        if unit is not None and given is not None and unit != given and not isinstance(places, str | tuple):
            finding = f"column {letters(column.index)} is in {unit}, but readings.unit is {given}."
            questions.ask("unit", grid.place(), finding, "Remove the setting, or correct the header.")
        if unit is None and given is None:
            lacking.append(letters(column.index))
        return replace(column, unit=unit or given, is_declared=unit is None)

    table.station = None if table.station is None else with_unit(table.station)
    table.readings = [with_unit(column) for column in table.readings]
    if lacking:
        finding = f"column {', '.join(lacking[:MOST_NAMED])} has no unit."
        questions.ask("unit", grid.place(), finding, f"Allowed: {', '.join(get_args(Unit))}.", {"unit": "mm"}, lacking)


def _ask_for_direction(table: Table, declared: Declared, questions: Questions) -> None:
    written = {column.quantity for column in table.readings} - {None}
    quantity = declared.quantity or next(iter(written), None)
    place = table.grid.place()
    if declared.quantity is not None and written - {declared.quantity}:
        finding = f"the header has {next(iter(written))}, but the settings have {declared.quantity}."
        questions.ask("quantity", place, finding, "Remove the setting, or correct the header.")
    elif quantity is None and table.readings:
        finding = "nothing says whether the readings count upward from the face (level) or downward (depth)."
        questions.ask("quantity", place, finding, "Depths count downward.", {"quantity": "depth"})
    table.readings = [replace(column, quantity=quantity) for column in table.readings]
