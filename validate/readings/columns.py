"""The header of a sheet: its row, and the columns with their sign convention and unit."""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.resources import files as resources
from typing import Literal

from validate.readings.sheet import FaultList, Place, SheetCell, SheetGrid, SheetRow, clipped, quoted, refuse
from validate.readings.text_table import is_missing, plain_letters
from validate.settings import Declared, Quantity, Unit

Role = Literal["station", "reading", "repeat", "sample", "skipped"]
"""Role of a column. "repeat" numbers the readings of a station, "sample" names the sample of a row, and "skipped" holds
notes, or figures that were calculated from readings.
"""

WORDS = tomllib.loads(resources("validate").joinpath("readings", "words.toml").read_text(encoding="utf-8"))
"""Words of labs in all languages: of units, columns, names of files, and notes."""
UNITS: dict[str, Unit] = {name: unit for unit, names in WORDS["units"].items() for name in names.split()}
INCH = re.compile(r"[\[(/_]\s*in\s*[\])]?\s*$")
"""The unit "in" in brackets or at the end; elsewhere it is a preposition."""
LONGEST_NAME = 200  # Limit on the letters of a name; a longer one is a text, in which a search for a unit takes long
WORD = re.compile(r"[^\W\d_]+|[0-9]+")
COLUMNS = {role: frozenset(words.split()) for role, words in WORDS["columns"].items()}
STATION, REPEAT, VALUE, COUNTER = (COLUMNS[role] for role in ("station", "repeat", "value", "counter"))
DOWNWARD, HEIGHT, SAMPLE, SKIPPED = (COLUMNS[role] for role in ("downward", "height", "sample", "skipped"))
DEPTH, LEVEL = DOWNWARD | COLUMNS["depth"], HEIGHT | COLUMNS["level"]
OF_SAMPLE = COUNTER | COLUMNS["beside_sample"]
OF_STATION, OF_READING = (COLUMNS["beside_any"] | COLUMNS[key] for key in ("beside_station", "beside_reading"))
TOWARD = re.compile(r"(?<![^\W_])(?:{toward})[\W_]+(?:(?P<up>{up})|{down})(?![^\W_])".format(**WORDS["directions"]))
"""Direction in several words."""
MOST_LINES_ABOVE = 100
"""Limit on the lines of title and notes above a header; one further down belongs to another table."""
EXPECTED = (
    "s_mm,level_1_mm,level_2_mm,level_3_mm (level upward from the face) or s_mm,depth_1_mm,... (depth downward), "
    "or names such as 'Position [cm]', 'Tiefe 1 (mm)'"
)


@dataclass(frozen=True)
class ColumnMeaning:
    role: Role
    unit: Unit | None = None
    quantity: Quantity | None = None  # Direction in which a reading counts; None where the name leaves it open
    number: str | None = None  # Number of a repeat; None where the name holds none


def meaning(name: str) -> ColumnMeaning | None:
    """Return the meaning of a column's name; None, and nothing guessed, where any word of it is unknown."""
    if len(name) > LONGEST_NAME:
        return None
    plain = TOWARD.sub(lambda toward: "upward" if toward["up"] else "downward", plain_letters(name))
    found = WORD.findall(plain)
    numbers = [word for word in found if word.isdigit()]
    units: set[Unit] = {UNITS[word] for word in found if word in UNITS}
    words = {word for word in found if not word.isdigit() and word not in UNITS}
    if INCH.search(plain):
        units.add("inch")
    if len(units) > 1:
        return None
    unit = next(iter(units), None)
    if words & SAMPLE and words <= SAMPLE | OF_SAMPLE and not (unit or numbers):
        return ColumnMeaning("sample")
    if words & SKIPPED or (words and words <= COUNTER) or (words & STATION and words & COUNTER):
        return ColumnMeaning("skipped", unit)
    if words & STATION:
        return ColumnMeaning("station", unit) if words <= STATION | OF_STATION and not numbers else None
    if (
        not words & (DEPTH | LEVEL | REPEAT | VALUE)
        or not words <= DEPTH | LEVEL | REPEAT | VALUE | COUNTER | OF_READING
    ):
        return None
    ways = words & (DEPTH | LEVEL)
    # A height that counts downward is a depth; a level below something may count either way.
    if words & DEPTH and words & LEVEL and not ways <= HEIGHT | DOWNWARD:
        return None
    quantity: Quantity | None = "depth" if words & DEPTH else "level" if words & LEVEL else None
    bare = quantity is None and unit is None and not numbers
    counts = bare and (words & COUNTER or not words & VALUE)
    return ColumnMeaning("repeat" if counts else "reading", unit, quantity, "-".join(numbers) or None)


def unit_of(text: str) -> Unit | None:
    """Return the unit of a cell that holds nothing else, such as "[mm]"; else None."""
    word = plain_letters(text).strip("[]() ")
    return "inch" if word == "in" else UNITS.get(word)


@dataclass(frozen=True, kw_only=True)
class Column(ColumnMeaning):
    index: int  # Number of the column, from 0
    name: str


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

    @property
    def read(self) -> list[Column]:
        """Columns whose cells are read."""
        return [one for one in (self.station, self.repeat, self.sample, *self.readings) if one is not None]


def read_header(grid: SheetGrid, declared: Declared, faults: FaultList) -> Header:
    """Return the row that names most columns; faults that leave the rest readable are added to ``faults``.

    Raises SheetFaults where no column of stations or none of readings is named.
    """
    if len(grid.rows) < 2:
        raise refuse(grid.place(), "no rows of readings.", f"Write a header {EXPECTED} and a row for each station.")
    index = max(range(min(len(grid.rows), MOST_LINES_ABOVE)), key=lambda i: (*_likeness(grid.rows[i]), -i))
    row, body = grid.rows[index], grid.rows[index + 1 :]
    if body and (joined := _joined(row, body[0])) is not None:
        row, body = joined, body[1:]
    place = grid.place(row.number)
    meanings = [(column, cell.text, meaning(cell.text)) for column, cell in enumerate(row.cells) if cell.text]
    columns = [Column(index=column, name=name, **vars(found)) for column, name, found in meanings if found is not None]
    unknown = [name for _, name, found in meanings if found is None]
    stations, readings, counters, samples, skipped = (
        [column for column in columns if column.role == role]
        for role in ("station", "reading", "repeat", "sample", "skipped")
    )
    # A bare "Messung" numbers the repeats where another column holds the readings, and holds them itself otherwise.
    repeat = counters[0] if readings and len(counters) == 1 else None
    if repeat is None:
        readings += counters
    if not stations:
        names = [clipped(cell.text) for cell in row.cells[:12] if cell.text]
        remedy = f"It was read as {', '.join(grid.written)}; if that is wrong, declare [readings] separator or sheet."
        raise refuse(place, f"no column s_mm in {names}; expected {EXPECTED}.", remedy)
    if not readings and not unknown:
        others, remedy = f" {_names(skipped)} hold none." if skipped else "", f"Expected {EXPECTED}."
        if means := [column for column in skipped if column.unit is not None]:
            remedy = f"If {_names(means)} is all you have, call it a reading: level_mm or depth_mm."
        raise refuse(place, f"no column of readings beside {_names(stations)}.{others}", remedy)
    for name in unknown:
        remedy = "Name its sign and unit, such as 'depth 1 [mm]'; or, if it holds no readings, call it a note."
        faults.add(place, f"column {quoted(name)} is unknown.", remedy, name)
    for twice, what in ((stations, "station"), (samples, "sample")):
        if len(twice) > 1:
            faults.add(place, f"{_names(twice)} both name the {what}.", "Keep one, and call the other a note.")
    if repeat is not None and len(readings) > 1:
        found = f"column {_names([repeat])} numbers the repeats of one column, and there are {_names(readings)}."
        faults.add(place, found, "Write all repeats of a station either as columns of one row, or as rows.")
    _check_numbers(place, readings, faults)
    units = _units_row(body[0]) if body else {}
    station, *readings = (
        _with_unit(place, column, units.get(column.index), declared, faults) for column in (stations[0], *readings)
    )
    if nameless := [column for column in (station, *readings) if column.unit is None]:
        remedy = f"Write '{clipped(nameless[0].name)} [mm]' in the header, or declare [readings] unit = \"mm\"."
        faults.add(place, f"{_names(nameless)}: no unit.", remedy)
    return Header(
        row=row,
        above=index,
        body=tuple(body[1:] if units else body),
        station=station,
        readings=tuple(readings),
        repeat=repeat,
        sample=samples[0] if samples else None,
        skipped=tuple(skipped),
        quantity=_quantity(place, readings, declared, faults),
    )


def _names(columns: Sequence[Column]) -> str:
    return ", ".join(quoted(column.name) for column in columns[:12])


def _likeness(row: SheetRow) -> tuple[bool, int, int, int]:
    """Return a key that is larger the more of a row's cells name columns; notes above a header may name some, too."""
    roles = [found.role for cell in row.cells if cell.text and (found := meaning(cell.text)) is not None]
    named = sum(1 for cell in row.cells if cell.text)
    table = "station" in roles and ("reading" in roles or "repeat" in roles)
    return table, sum(role != "skipped" for role in roles), len(roles), min(named, 2)


def _joined(row: SheetRow, below: SheetRow) -> SheetRow | None:
    """Join a header with the second line below it where one name spans several columns; None where it does not.

    "Tiefe [mm]" over "Messung 1", "Messung 2" becomes "Tiefe [mm] Messung 1" and "Tiefe [mm] Messung 2". A second line
    that holds anything but numbers of readings is no part of the header.
    """
    lower = {index: cell.text for index, cell in enumerate(below.cells) if cell.text}
    meanings = map(meaning, lower.values())
    if not lower or any(it is None or it.role not in ("reading", "repeat") or it.quantity for it in meanings):
        return None
    cells, over = [], ""
    for index in range(max(row.width, below.width)):
        over = row.cell(index).text or over
        cells.append(SheetCell(f"{over} {lower[index]}".strip()) if index in lower else row.cell(index))
    return SheetRow(row.number, tuple(cells))


def _check_numbers(place: Place, readings: Sequence[Column], faults: FaultList) -> None:
    """Add a fault for columns of readings without a number, one of which may be the mean, or with the same one."""
    numbered: dict[str | None, list[Column]] = {}
    for column in readings:
        numbered.setdefault(column.number, []).append(column)
    for number, columns in numbered.items():
        if number is None and len(readings) > 1:
            found = f"{_names(columns)}: no number, and there are {len(readings)} columns of readings."
            faults.add(place, found, "Number the repeats; call a mean a mean.", columns[0].name)
        elif len(columns) > 1:
            found = f"repeat {number} occurs twice: {_names(columns)}."
            faults.add(place, found, "Number the repeats.", columns[1].name)


def _quantity(place: Place, readings: Sequence[Column], declared: Declared, faults: FaultList) -> Quantity | None:
    named: set[Quantity] = {column.quantity for column in readings if column.quantity is not None}
    if len(named) > 1:
        faults.add(place, "level and depth columns in one sheet.", "Write all readings one way.")
        return None
    quantity = next(iter(named), None)
    if quantity is not None and declared.quantity not in (None, quantity):
        found = f'the header names {quantity}, and [readings] quantity = "{declared.quantity}".'
        faults.add(place, found, "Correct the one that is wrong.")
        return None
    nameless = [column for column in readings if column.quantity is None]
    if nameless and declared.quantity is None:
        faults.add(
            place,
            f"{_names(nameless)}: neither header nor trial file states whether readings count upward or downward.",
            'Declare [readings] quantity = "level" (upward) or "depth" (downward), or name it in the header.',
        )
    return quantity or declared.quantity


def _units_row(row: SheetRow) -> dict[int, Unit]:
    """Return units by column, empty where a row holds anything else."""
    texts = {index: cell.text for index, cell in enumerate(row.cells) if not is_missing(cell.text)}
    units: dict[int, Unit] = {index: unit for index, text in texts.items() if (unit := unit_of(text)) is not None}
    return units if len(units) == len(texts) else {}


def _with_unit(place: Place, column: Column, below: Unit | None, declared: Declared, faults: FaultList) -> Column:
    """Return the column with the unit from its name, the row of units or the trial file."""
    units = [unit for unit in (column.unit, below, declared.unit) if unit is not None]
    if len(set(units)) > 1:
        faults.add(
            replace(place, column=column.index, name=column.name),
            f"{' and '.join(units)}: the header, the row of units and [readings] unit differ.",
            "Correct the one that is wrong.",
        )
    return replace(column, unit=units[0] if units else None)
