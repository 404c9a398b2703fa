"""Depths of the crack in a sheet of readings: a table of its own, or a column beside the readings."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.settings import checked
from sealtwin.lab.notes import COLUMNS, DEPTH, NoteEntry
from sealtwin.lab.pairing import PAIRING
from sealtwin.lab.sample_outcome import LONGEST_QUESTION, SampleOutcome
from sealtwin.trial.quick_trial import toml_value
from validate.readings.columns import read_header
from validate.readings.header import Header, names_factor, remarks_where
from validate.readings.header_words import UNIT, crack_depth, meaning, sample_key
from validate.readings.sample_rows import rows_of_sample
from validate.readings.samples import read_cells, sheets_of, tables_of_readings
from validate.readings.screens import ReadCells
from validate.readings.sheet import FaultList, SheetFaults, SheetGrid, clipped, letters
from validate.readings.table_reader import TableReader
from validate.readings.table_rows import columns_named, is_a_number, within
from validate.readings.tables import Table, common_lines, tables_of
from validate.readings.text_table import plain_letters
from validate.settings import Declared

RANGE, LEVELS, S_FROM = (f"{COLUMNS}.{key}" for key in ("range", "levels", "s_from"))
SEVERAL = 2
GIVES_LENGTH = re.compile(rf"\d\s?{UNIT}")
MOST_CELLS = 3  # Cells of a row that may be a title: word, value and unit
NUMBER = re.compile(r"\d+(?:[.,]\d+)?")
ROUNDING = 6  # Digits behind the point: less than any caliper shows


@dataclass(frozen=True)
class SheetDepths:
    """Depths of a crack as a sheet has them."""

    place: str  # Sheet and range
    words: str  # Name of the column, or title of the table
    depth_mm: tuple[tuple[float, float], ...]  # Rows of s and depth; empty if they cannot be read
    doubt: str  # Reason why they may not be the depth of this sample's crack; "" if there is none


def take_depths(folder: Path, outcome: SampleOutcome) -> None:
    """Take the depth of the crack from the sheet of readings, or add a question about it.

    Depths are taken only if the words are unmistakable and no note gives a depth. The range of the readings is set if
    the depths are a table of their own beside or below them.
    """
    sample, chosen = outcome.sample, outcome.note.entries.get("readings.sheet")
    file = sample.files.get("readings")
    if file is None or (folder / file).is_symlink():
        return
    sheets = sheets_of(folder / file)
    if not any(crack_depth(cell.text) for grid in sheets for row in grid.rows for cell in row.cells if cell.text):
        return
    of_readings = [grid for grid in sheets if any(header for _, header in tables_of_readings(grid))]
    sheet = sample.part.sheet if sample.part is not None and sample.part.sheet else chosen and chosen.value
    own = [grid for grid in of_readings if sheet in (None, grid.sheet)]
    if len(own) > 1:
        return  # Reading them asks which one is meant.
    others = [grid for grid in sheets if grid not in of_readings] if sample.part is None else []
    for grid in (*own, *others):
        for depths in _depths_in(grid, outcome):
            _decide(depths, f"{file}, {depths.place}", outcome)
    if own:
        _leave_out_depths(own[0], f"{file}", outcome)


def other_depths(path: Path, declared: Declared, outcome: SampleOutcome) -> list[str]:
    """Return a fault for each title or remark of a sheet with a depth of the crack that is not the trial's.

    There is no fault for a depth from the pairing file.
    """
    entry, faults = outcome.note.entries.get(DEPTH), list[str]()
    if entry is not None and entry.origin.startswith(PAIRING):
        return faults
    try:
        grid = read_cells(path, declared)
        span = declared.columns and declared.columns.range
        rows = [*within(grid.rows, span), *common_lines(grid, span)]
    except InputError:
        return faults  # Reported as a fault of the readings.
    for row in rows:
        line = " ".join(cell.text for cell in row.cells if cell.text)
        if len([cell for cell in row.cells if cell.text]) > MOST_CELLS or len(line) > LONGEST_QUESTION:
            continue
        has_value = GIVES_LENGTH.search(line) is not None or any(map(is_a_number, row.cells))
        values = [float(number.replace(",", ".")) for number in NUMBER.findall(line)]
        if crack_depth(line) is not None and has_value and (entry is None or entry.value not in values):
            other = "no note gives it" if entry is None else f"{entry.origin} has {toml_value(entry.value)}"
            faults.append(
                f"{path}, row {row.number}: {line!r} may be the depth of the crack, but {other}. Write the right value "
                f"into the column settings of {PAIRING}, such as {DEPTH} = 9.0."
            )
    return faults


def _decide(depths: SheetDepths, place: str, outcome: SampleOutcome) -> None:
    """Take depths as a setting, or ask: if their words leave a doubt, or if a note gives another depth."""
    note, value = outcome.note, depths.depth_mm
    entry = note.entries.get(DEPTH)
    if entry is not None and (entry.origin.startswith(PAIRING) or _is_same(entry.value, value)):
        return
    if entry is None and not depths.doubt:
        note.entries[DEPTH] = NoteEntry([list(row) for row in value], place)
        note.remarks.append(f"{place}: depth of the crack from {depths.words!r}, {len(value)} stations.")
        return
    reason = depths.doubt or "this is the depth of the crack"
    if entry is not None:
        reason += f", but {entry.origin} has {toml_value(entry.value)}"
    answer = f"{DEPTH} = {json.dumps(value)}" if value else f"{DEPTH} = [[s, depth], ...]"
    note.meant.add(DEPTH)
    note.faults.append(
        f"{place}: {clipped(depths.words)!r}: {reason}. Write the crack's depth into the column settings of {PAIRING}: "
        f"{answer}."
    )


def _is_same(given: Any, depth_mm: Sequence[tuple[float, float]]) -> bool:
    """Return True if a note gives the depths of a sheet, as a table or as the one depth of all stations."""
    rows = [list(row) for row in depth_mm]
    return bool(rows) and (given == rows or all(depth == given for _, depth in rows))


def _leave_out_depths(grid: SheetGrid, file: str, outcome: SampleOutcome) -> None:
    """Set the range of the readings if the other tables of their sheet are depths of the crack."""
    readings = [table for table, header in tables_of_readings(grid) if header is not None]
    others = [table for table in tables_of(grid) if table not in readings]
    is_whole = outcome.sample.part is None or outcome.sample.part.cells is None
    is_chosen = RANGE in outcome.note.entries or LEVELS in outcome.note.entries
    if len(readings) == 1 and any(map(_columns_of_depth, others)) and is_whole and not is_chosen:
        cells = readings[0].cells
        outcome.note.entries[RANGE] = NoteEntry(cells, f"{file}, {cells}")
        outcome.note.remarks.append(f"{file}: readings from range {cells}; the depths of the crack are beside them.")


def _depths_in(grid: SheetGrid, outcome: SampleOutcome) -> Iterator[SheetDepths]:
    entries, part = outcome.note.entries, outcome.sample.part
    levels = entries[LEVELS].value if LEVELS in entries else ()
    span = entries[RANGE].value if RANGE in entries else None
    span = part.cells if part is not None and part.cells is not None else span
    for table in tables_of(grid):
        # Letters of the readings' columns are columns of other tables too.
        is_own = any(row.cell(at).text for row in within(table.body, span) for at in table.columns)
        read = {at for one in levels if is_own for at in columns_named(table.names, str(one))}
        columns = [at for at in _columns_of_depth(table) if at not in read]
        lines = [" ".join(cell.text for cell in row.cells if cell.text) for row in table.title]
        title = " ".join(lines)
        words, doubt = ", ".join(table.names[at] for at in columns), ""
        if not columns and not read and _may_be_depths(table, lines, grid, outcome):
            columns = [at for at, name in table.names.items() if (what := meaning(name)) and what.quantity == "depth"]
            words, doubt = title, "a table under this title may be the depth of the crack"
        if not columns or (owner := _owner(table, title, grid, outcome)) == "another":
            continue
        if crack_depth(words) != "sure":
            doubt = doubt or "this may be the depth of the crack, or of the sealant in it"
        if owner == "open":
            doubt = "this is the depth of a crack, but the sheet does not say of which sample"
        depth_mm, fault = _read(grid, table, columns, outcome)
        sheet = f"sheet {grid.sheet!r}, " if grid.sheet is not None else ""
        yield SheetDepths(f"{sheet}range {table.cells}", words, depth_mm, doubt or fault)


def _may_be_depths(table: Table, title: Sequence[str], grid: SheetGrid, outcome: SampleOutcome) -> bool:
    """Return True if the title of a table beside the readings names the crack's depth without giving it."""
    part = outcome.sample.part
    is_beside = len(tables_of_readings(grid)) > 1 and (part is None or part.cells != table.cells)
    return is_beside and any(crack_depth(line) is not None and not GIVES_LENGTH.search(line) for line in title)


def _columns_of_depth(table: Table) -> list[int]:
    return [at for at, name in table.names.items() if crack_depth(name) is not None]


def _owner(table: Table, title: str, grid: SheetGrid, outcome: SampleOutcome) -> Literal["this", "another", "open"]:
    """Return whether the crack of a table is that of this sample."""
    sample, part = outcome.sample, outcome.sample.part
    if named := [name for name in (sample.name, *sample.others) if _names(title, name)]:
        return "this" if named == [sample.name] else "open" if sample.name in named else "another"
    if part is not None and part.rows_of is not None:
        return "this" if "sample" in _roles(table) else "open"
    if part is not None and part.cells is not None:
        is_of_readings = "reading" in _roles(table) and crack_depth(title) is None
        beside = [one.cells for one, _ in tables_of_readings(grid) if one.cells != table.cells and one.is_beside(table)]
        is_of_another = is_of_readings or (len(beside) == 1 and part.cells not in beside)
        return "this" if part.cells == table.cells else "another" if is_of_another else "open"
    return "this" if len(tables_of_readings(grid)) < SEVERAL else "open"


def _names(title: str, sample: str) -> bool:
    """Return whether a title names a sample. A name without a digit is ignored, since it may be an ordinary word."""
    name = r"[\W_]?".join(map(re.escape, plain_letters(sample_key(sample).replace("-", ""))))
    return re.search(r"\d", sample) is not None and re.search(rf"\b{name}\b", plain_letters(title)) is not None


def _roles(table: Table) -> set[str]:
    return {what.role for name in table.names.values() if (what := meaning(name)) is not None}


def _read(
    grid: SheetGrid, table: Table, columns: Sequence[int], outcome: SampleOutcome
) -> tuple[tuple[tuple[float, float], ...], str]:
    """Return the rows of s and depth of a table, and a doubt about them; no rows if they cannot be read."""
    entries, part = outcome.note.entries, outcome.sample.part
    along = [at for at, name in table.names.items() if (what := meaning(name)) is not None and what.role == "station"]
    if len(along) != 1:
        return (), "the depth of the crack, but its column of places along the crack is unknown"
    spans = {"s": _span(along[0]), "levels": [_span(at) for at in columns]}
    declared = {"columns": {"range": table.cells, **spans}, "quantity": "depth"}
    if part is not None and part.rows_of is not None and "sample" in _roles(table):
        declared["sample"] = part.rows_of
    try:
        header, cells = _cells(grid, declared)
    except SheetFaults as fault:
        # Only the unit of the readings can be missing here.
        if "readings.unit" not in entries:
            return (), f"the depth of the crack cannot be read: {fault.faults[0].finding}"
        try:
            header, cells = _cells(grid, declared | {"unit": entries["readings.unit"].value})
        except InputError:
            return (), f"the depth of the crack cannot be read: {fault.faults[0].finding}"
    depth_mm = np.nanmean(cells.readings_mm, axis=1)
    rows = tuple(
        (round(float(s), ROUNDING), round(float(depth), ROUNDING))
        for s, depth in zip(cells.s_mm, depth_mm, strict=True)
    )
    if not rows or rows[0][0] < 0 or min(depth for _, depth in rows) <= 0:
        return (), "the depth of the crack, but places and depths must be positive"
    doubts = {
        f"the means of {len(columns)} columns": len(columns) > 1,
        "the sheet counts s from the crack's second end": S_FROM in entries and entries[S_FROM].value == "second",
        "a remark gives a factor": bool(remarks_where(header, names_factor)),
    }
    return rows, next((doubt for doubt, applies in doubts.items() if applies), "")


def _cells(grid: SheetGrid, content: Mapping[str, Any]) -> tuple[Header, ReadCells]:
    """Read the cells of a table. Raises SheetFaults."""
    declared, faults = checked(Declared, grid.path, content), FaultList()
    header = rows_of_sample(grid, read_header(grid, declared, faults), declared, faults)
    cells = TableReader(grid, header, declared, None, faults).read()
    faults.raise_if_any()
    return header, cells


def _span(column: int) -> str:
    return f"{letters(column)}:{letters(column)}"
