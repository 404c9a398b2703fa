"""The header of a sheet: where it stands, what its columns are, which way they count and in what unit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from validate.settings import Declared, Quantity, Unit
from validate.sheets.decimals import is_missing
from validate.sheets.faults import FaultList, clipped, refuse
from validate.sheets.grid import Cell, Grid, Row
from validate.sheets.words import Meaning, meaning, unit_of

MOST_REPEATS = 32
MOST_LINES_ABOVE = 100
"""Title and notes of a lab's form; a header further down is another table's."""
EXPECTED = (
    "s_mm,level_1_mm,level_2_mm,level_3_mm (level upward from the face) or s_mm,depth_1_mm,... (depth downward), "
    "or names such as 'Position [cm]', 'Tiefe 1 (mm)'"
)


@dataclass(frozen=True)
class Column:
    index: int
    """From 0."""
    name: str
    meaning: Meaning

    @property
    def unit(self) -> Unit | None:
        return self.meaning.unit


@dataclass(frozen=True)
class Header:
    row: Row
    above: int
    """Lines that hold anything above it."""
    body: tuple[Row, ...]
    station: Column
    readings: tuple[Column, ...]
    repeat: Column | None
    """Of a long sheet, in which each row holds one reading."""
    sample: Column | None
    """Of a sheet that says of each row which sample it is of."""
    skipped: tuple[Column, ...]
    quantity: Quantity | None
    """None where it is a fault that nothing says it; so with the columns' units."""

    @property
    def width(self) -> int:
        return self.row.width


def read_header(grid: Grid, declared: Declared, faults: FaultList) -> Header:
    """The row that names most columns. What can still be read in spite of it is added to ``faults``.

    Raises SheetFaults where it names no place or no reading.
    """
    if len(grid.rows) < 2:
        raise refuse(grid.place(), "no rows of readings.", f"Write a header {EXPECTED} and a row for each station.")
    index = max(range(min(len(grid.rows), MOST_LINES_ABOVE)), key=lambda i: (*_likeness(grid.rows[i]), -i))
    row, body = grid.rows[index], grid.rows[index + 1 :]
    if body and (joined := _joined(row, body[0])) is not None:
        row, body = joined, body[1:]
    place = grid.place(row.number)
    columns, unknown = _columns(row)
    stations = [column for column in columns if column.meaning.role == "station"]
    samples = [column for column in columns if column.meaning.role == "sample"]
    skipped = tuple(column for column in columns if column.meaning.role == "skipped")
    readings, repeat = _readings(columns)
    if not stations:
        names = [clipped(cell.text) for cell in row.cells[:12] if cell.text]
        raise refuse(
            place,
            f"no column s_mm in {names}; expected {EXPECTED}.",
            f"It was read as {', '.join(grid.written)}; if that is wrong, declare [readings] separator or sheet.",
        )
    if not readings and not unknown:
        passed_over = f" {shown_names(skipped)} hold none." if skipped else ""
        found = f"no column of readings beside {shown_names(stations)}.{passed_over}"
        means = [column for column in skipped if column.unit is not None]
        remedy = f"If {shown_names(means)} is all you have, call it a reading: level_mm or depth_mm." if means else ""
        raise refuse(place, found, remedy or f"Expected {EXPECTED}.")
    for name in unknown:
        faults.add(
            place,
            f"column {clipped(name)!r} is unknown.",
            "Name its sign and unit, such as 'depth 1 [mm]'; if it holds no readings, call it a note, or delete it.",
            name,
        )
    if len(stations) > 1:
        faults.add(
            place, f"{shown_names(stations)} both name the place.", "Keep the one along the crack, delete the other."
        )
    if len(samples) > 1:
        faults.add(place, f"{shown_names(samples)} both name the sample.", "Keep one, and call the other a note.")
    if len(readings) > MOST_REPEATS:
        raise refuse(place, f"{len(readings)} repeats; at most {MOST_REPEATS} are read.", "Give one trial's readings.")
    if repeat is not None and len(readings) > 1:
        faults.add(
            place,
            f"column {shown_names([repeat])} numbers the repeats of one column, and there are {shown_names(readings)}.",
            "Write all repeats of a station either as columns of one row, or as rows.",
        )
    _check_numbers(grid, row, readings, faults)
    quantity = _quantity(grid, row, readings, declared, faults)
    units = _units_row(body[0]) if body else {}
    if units:
        body = body[1:]
    fitted = {
        column.index: _fitted(grid, row, column, units.get(column.index), declared, faults)
        for column in (*stations[:1], *readings)
    }
    _ask_for_unit(grid, row, list(fitted.values()), faults)
    return Header(
        row=row,
        above=index,
        body=tuple(body),
        station=fitted[stations[0].index],
        readings=tuple(fitted[column.index] for column in readings),
        repeat=repeat,
        sample=samples[0] if samples else None,
        skipped=skipped,
        quantity=quantity,
    )


def shown_names(columns: Sequence[Column]) -> str:
    return ", ".join(repr(clipped(column.name)) for column in columns[:12])


def _likeness(row: Row) -> tuple[bool, int, int, int]:
    """How much of a row is names of columns; those of notes stand in a form's lines above the header, too."""
    roles = [found.role for cell in row.cells if cell.text and (found := meaning(cell.text)) is not None]
    named = sum(1 for cell in row.cells if cell.text)
    table = "station" in roles and ("reading" in roles or "repeat" in roles)
    return table, sum(role != "skipped" for role in roles), len(roles), min(named, 2)


def _joined(row: Row, below: Row) -> Row | None:
    """The header with the names of a second line, where one name stands for several columns.

    "Tiefe [mm]" over "Messung 1", "Messung 2" is "Tiefe [mm] Messung 1" and "Tiefe [mm] Messung 2". None where the
    second line holds anything else than which reading a column is.
    """
    lower = {index: cell.text for index, cell in enumerate(below.cells) if cell.text}
    meanings = [meaning(text) for text in lower.values()]
    if not lower or any(it is None or it.role not in ("reading", "repeat") or it.quantity for it in meanings):
        return None
    cells, over = [], ""
    for index in range(max(row.width, below.width)):
        over = row.cell(index).text or over
        cells.append(Cell(f"{over} {lower[index]}".strip()) if index in lower else row.cell(index))
    return Row(row.number, tuple(cells))


def _columns(row: Row) -> tuple[list[Column], list[str]]:
    """Those with a meaning, and the names without one."""
    columns, unknown = [], []
    for index, cell in enumerate(row.cells):
        if not cell.text:
            continue
        found = meaning(cell.text)
        if found is None:
            unknown.append(cell.text)
        else:
            columns.append(Column(index, cell.text, found))
    return columns, unknown


def _readings(columns: list[Column]) -> tuple[tuple[Column, ...], Column | None]:
    """Columns of readings, and the one that says which repeat a row is.

    A bare "Messung" says which where another column holds the readings, and holds them itself where none does.
    """
    readings = tuple(column for column in columns if column.meaning.role == "reading")
    counters = tuple(column for column in columns if column.meaning.role == "repeat")
    if not readings:
        return counters, None
    if len(counters) == 1:
        return readings, counters[0]
    return (*readings, *counters), None


def _check_numbers(grid: Grid, row: Row, readings: Sequence[Column], faults: FaultList) -> None:
    """Columns that are repeats of each other say so: one beside them without a number may be their mean."""
    numbered: dict[str | None, list[Column]] = {}
    for column in readings:
        numbered.setdefault(column.meaning.number, []).append(column)
    for number, columns in numbered.items():
        place = grid.place(row.number)
        if number is None and len(readings) > 1:
            faults.add(
                place,
                f"{shown_names(columns)}: no number, and there are {len(readings)} columns of readings.",
                "Number the repeats; call a mean a mean.",
                columns[0].name,
            )
        elif len(columns) > 1:
            faults.add(
                place, f"repeat {number} stands twice: {shown_names(columns)}.", "Number the repeats.", columns[1].name
            )


def _quantity(
    grid: Grid, row: Row, readings: Sequence[Column], declared: Declared, faults: FaultList
) -> Quantity | None:
    place = grid.place(row.number)
    named: set[Quantity] = {column.meaning.quantity for column in readings if column.meaning.quantity is not None}
    if len(named) > 1:
        faults.add(place, "level and depth columns in one sheet.", "Write all readings one way.")
        return None
    said = next(iter(named), None)
    if said is not None and declared.quantity not in (None, said):
        faults.add(
            place,
            f'the header says {said}, and [readings] quantity = "{declared.quantity}".',
            "Correct the one that is wrong.",
        )
        return None
    nameless = [column for column in readings if column.meaning.quantity is None]
    if nameless and declared.quantity is None:
        faults.add(
            place,
            f"{shown_names(nameless)}: nothing says whether readings count upward or downward.",
            'Declare [readings] quantity = "level" (upward) or "depth" (downward), or name it in the header.',
        )
    return said or declared.quantity


def _units_row(row: Row) -> dict[int, Unit]:
    """Units by column, where a row holds nothing else."""
    units: dict[int, Unit] = {}
    for index, cell in enumerate(row.cells):
        unit = unit_of(cell.text)
        if unit is not None:
            units[index] = unit
        elif not is_missing(cell.text):
            return {}
    return units


def _fitted(grid: Grid, row: Row, column: Column, below: Unit | None, declared: Declared, faults: FaultList) -> Column:
    """With the unit that its name, the row below or the trial gives it."""
    said = [unit for unit in (column.unit, below, declared.unit) if unit is not None]
    if len(set(said)) > 1:
        faults.add(
            grid.place(row.number, column.index, column.name),
            f"{' and '.join(said)}: the header, the row of units or [readings] unit say different things.",
            "Correct the one that is wrong.",
        )
    return replace(column, meaning=replace(column.meaning, unit=said[0] if said else None))


def _ask_for_unit(grid: Grid, row: Row, columns: Sequence[Column], faults: FaultList) -> None:
    if nameless := [column for column in columns if column.unit is None]:
        faults.add(
            grid.place(row.number),
            f"{shown_names(nameless)}: no unit.",
            f"Write '{clipped(nameless[0].name)} [mm]' in the header, or declare [readings] unit = \"mm\".",
        )
