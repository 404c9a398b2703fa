"""Caliper readings of a trial: a sheet, or rows of an array."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core.doubts import CONFIRMS, Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile
from validate.readings.files import read_grid
from validate.readings.grid import BLANK, Cell, Grid, ReadSheet, SheetFaults, letters
from validate.readings.header import numeric
from validate.readings.numbers import number
from validate.readings.rest import ask_about_rest
from validate.readings.rows import ReadRows, check_in_crack, read_rows
from validate.readings.screens import Filling, screens
from validate.readings.table import Table, find_table
from validate.settings import Columns, Declared, Readings
from validate.units import LABELS, counted

WAYS = {"level": "level upward", "depth": "depth downward", None: "reading"}
MOST_ROWS_SHOWN = 8
WHOLE = ("sign", "unit", "datum", "direction")


def read_readings(
    path: Path,
    settings: Declared,
    length_mm: float | None = None,
    depth_mm: float | None = None,
    filling: Filling | None = None,
) -> Profile:
    """Read a CSV, XLSX or ODS as levels from the sample's surface: mean and repeats of each station, sorted along s.

    A sheet has a header of up to three rows, and a row for each station, or for each reading with a column that counts
    repeats. Rows may have any order, a blank field is a missing reading, and a station without readings is omitted.
    Facts that the sheet leaves open must be declared in ``settings``. If the depth of the crack is given, stations
    outside the crack and impossible levels are faults too; its length may still be unknown. A possible but suspicious
    reading, or a text that may change readings, becomes a doubt of the profile, unless ``settings.as_written`` confirms
    it; ``filling`` gives further data for these checks. If the sheet counts s from the crack's second end, s is
    reversed once the length is given.

    Raises:
        SheetFaults: The sheet leaves something open; the error has all of it, each with its place, value and remedy.
        InputError: The file cannot be opened.
    """
    return readings_of(read_grid(path, settings.sheet, settings.separator), settings, length_mm, depth_mm, filling)


def readings_of(
    grid: Grid,
    settings: Declared,
    length_mm: float | None = None,
    depth_mm: float | None = None,
    filling: Filling | None = None,
) -> Profile:
    """Read the cells of a sheet, with the checks and doubts of ``read_readings``."""
    table = find_table(grid, settings)
    rows = read_rows(table)
    cells = rows.cells
    _ask_beyond_range(table)
    if length_mm is not None and table.chosen.s_from == "second":
        cells = cells.from_other_end(length_mm)
    if len(cells.s_mm) < 2 and not table.is_open():
        finding = f"{counted(len(cells.s_mm), 'station')} with a reading; at least two are needed."
        table.ask("stations", finding, "Add stations, or name another sheet or range.")
    # What only follows from a stand-in for another answer is not asked.
    has_places = not table.is_open("columns", "unit", "no length", "decimal", "range", "places")
    has_levels = has_places and not table.is_open("quantity")
    if depth_mm is not None and has_places:
        check_in_crack(table, cells, length_mm, depth_mm if has_levels else None)
    ask_about_rest(table, rows)
    if isinstance(settings, Readings) and filling is not None:
        filling = replace(filling, volume_mm3=filling.volume_mm3 * (1 - (settings.shrinkage_percent or 0.0) / 100))
    if not table.stands_in and len(cells.s_mm) > 1:
        has_levels = has_levels and not table.is_open("outside", "deep")
        crack = (depth_mm, length_mm, filling) if has_levels else (None, length_mm if has_places else None, None)
        doubts = screens(cells, *crack, grid.place())
        table.doubts += [doubt for doubt in doubts if doubt.kind not in WHOLE or has_levels]
    asked = [doubt for doubt in table.doubts if is_unanswered(doubt, settings)]
    understood = _understood(table, rows)
    if any(doubt.is_open for doubt in asked):
        raise SheetFaults(asked, understood)
    return Profile(
        cells.s_mm,
        np.nanmean(cells.levels_mm, axis=1),
        cells.levels_mm,
        settings.data if isinstance(settings, Readings) else "undeclared",
        grid.path.name,
        _dialect(table, rows),
        doubts=tuple(map(str, asked)),
        questions=tuple(asked),
        understood=understood,
        is_depth=cells.is_depth,
    )


def take_readings(
    table: Floats, settings: Readings, length_mm: float | None = None, depth_mm: float | None = None
) -> Profile:
    """Return readings of an array, with the checks and doubts of ``read_readings``.

    ``table`` is (n, 1 + r): s in mm, then r repeats as levels upward from the sample's surface, or as depths if
    ``settings.quantity`` is "depth". NaN marks a missing reading. Doubts name cells as a spreadsheet without a header
    would: B4 is the reading [3, 1]. Raises InputError.
    """
    if table.ndim != 2 or table.shape[1] < 2:
        raise InputError(f"{settings.file}: an array of shape {table.shape}; give (n, 1 + r): s_mm, then r readings.")
    columns = Columns(s="A:A", levels=(f"B:{letters(table.shape[1] - 1)}",))
    named = {"columns": columns, "unit": "mm", "quantity": settings.quantity or "level"}
    grid = grid_of_rows(f"{settings.file}", table.tolist())
    return readings_of(grid, settings.model_copy(update=named), length_mm, depth_mm)


def grid_of_rows(name: str, rows: Sequence[Sequence[Any]]) -> Grid:
    """Return rows of values as the cells of a sheet, in which "A1" is the first one; None and NaN are blank."""
    return Grid(Path(name), {number: tuple(map(_cell, row)) for number, row in enumerate(rows, start=1)}, ("rows",))


def _cell(value: Any) -> Cell:
    if value is None or value != value:
        return BLANK
    if isinstance(value, int | float | np.number) and not isinstance(value, bool):
        if not np.isfinite(value):
            raise InputError(f"{value} is not a finite number; use NaN for a missing reading.")
        return Cell(f"{value:.15g}", "number")
    return Cell(f"{value}".strip())


def is_unanswered(doubt: Doubt, settings: Declared) -> bool:
    """Return whether ``as_written`` leaves an entry of a doubt open: the cell, its row or its column confirms it."""
    answered = set(settings.as_written or ())
    if doubt.kind == "datum" and settings.datum != "sample_surface":
        return False
    return CONFIRMS not in doubt.answers or not all(
        answered & ({entry, entry.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ"), entry.rstrip("0123456789")} - {""})
        for entry in doubt.answers[CONFIRMS]
    )


def _ask_beyond_range(table: Table) -> None:
    """Ask about a place of the same sample that goes on beyond those that are read, in the next row."""
    grid, below, station = table.grid, max(table.header.rows, default=0), table.station
    samples, body = [column for column, role in table.others.items() if role == "sample"], {*table.body}
    for pair in pairwise(row for row in grid.rows if row > below):
        texts = [numeric(grid.cell(row, station.index)) if station is not None else None for row in pair]
        before, after = (number(text[0]) if text is not None else None for text in texts)
        is_one = len({grid.cell(row, column).text for row in pair for column in samples} - {""}) < 2
        beyond = {*pair} - body
        if len(beyond) == 1 and before is not None and after is not None and before < after and is_one:
            finding, row = "this place goes on beyond those of the range.", beyond.pop()
            table.ask("range", finding, "Extend the range.", {CONFIRMS: ["range"]}, [f"{row}"], row)


def _dialect(table: Table, rows: ReadRows) -> str:
    """Return the interpretation of a sheet in a sentence, so that whoever measured can check it."""
    units = list(dict.fromkeys(f"{column.unit}" for column in table.readings))
    counting = f"{WAYS[table.quantity]} in {' and '.join(units)} from {LABELS['datums'][table.declared.datum]}"
    if table.declared.datum != "sample_surface":
        counting += f", {table.declared.datum_level_mm or 0.0:+g} mm from the sample surface"
    if table.station is not None and units != [table.station.unit]:
        counting += f", places in {table.station.unit}"
    mark = () if rows.mark is None else (f"decimal {rows.mark}",)
    layout = f"{'long' if rows.is_long else 'wide'}, {counted(rows.cells.levels_mm.shape[1], 'repeat')}"
    blank = int(np.isnan(rows.cells.readings_mm).sum())
    missing = (f"{counted(blank, 'reading')} missing",) if blank else ()
    return "; ".join((", ".join((*table.grid.written, *mark)), layout, counting, *missing))


def _understood(table: Table, rows: ReadRows) -> ReadSheet:
    """Return the columns with their roles and the first rows, with the cells that are read."""
    roles, several = dict[int, str](), table.repeat is None and len(table.readings) > 1
    for count, column in enumerate(table.readings, start=1):
        roles[column.index] = f"{WAYS[column.quantity]}{f' {count}' if several else ''}, {column.unit or 'no unit'}"
    if table.station is not None:
        roles[table.station.index] = f"s, {table.station.unit or 'no unit'}"
    if table.repeat is not None:
        roles[table.repeat.index] = "repeat"
    shown_rows = [*table.grid.rows][:MOST_ROWS_SHOWN]
    if table.body and table.body[0] not in shown_rows:
        shown_rows = [*shown_rows[:2], *table.header.rows, *table.body[: MOST_ROWS_SHOWN // 2]]
    width = max((len(table.grid.rows[row]) for row in shown_rows), default=0)
    read = {(row, column.index) for row in shown_rows if row in rows.read for column in table.used}
    return ReadSheet(
        tuple((letters(column), roles.get(column, "not read")) for column in range(width)),
        tuple((row, tuple(cell.text for cell in table.grid.rows[row])) for row in dict.fromkeys(shown_rows)),
        frozenset(read),
        frozenset(table.header.rows),
    )
