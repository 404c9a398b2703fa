"""Read the caliper readings of a trial from a sheet, or from the rows of an array."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core.doubts import CONFIRMS, ReadSheet
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Outline, Profile, Solid
from validate.readings.beside import remark_beside
from validate.readings.grid import BLANK, Cell, Grid, SheetFaults, letters, listed, read_grid
from validate.readings.reading_checks import SheetAndCrack, check_readings
from validate.readings.rows import ReadRows, check_in_crack, read_rows
from validate.readings.table import WAYS, Table, find_table, numeric
from validate.settings import Declared, Readings
from validate.units import LABELS, counted

MAX_ROWS_SHOWN = 8
SCANS = (".ply", ".stl", ".obj", ".glb", ".xyz", ".pts", ".png", ".tif", ".tiff")
WHOLE = ("sign", "unit")


def read_readings(
    path: Path,
    settings: Declared,
    length_mm: float | None = None,
    depth_mm: float | None = None,
    crack: tuple[Outline, Solid] | None = None,
    progress: Progress | None = None,
) -> Profile:
    """Read a sheet or a scan as levels from the sample's surface, sorted along s.

    A scan needs ``crack``, and is read by ``read_scan``. A CSV or XLSX gives mean and repeats of each station.

    A sheet has a header of up to three rows, and a row for each station, or a row for each reading with a column that
    counts repeats. Rows may have any order. A blank field is a missing reading, and a station without readings is left
    out. Facts that the sheet does not state must be declared in ``settings``.

    If the depth of the crack is given, stations outside the crack and impossible levels are faults too. The length may
    still be unknown. A possible but suspicious reading, or a text that may change readings, is listed in the profile's
    ``doubts``, unless ``settings.as_written`` confirms it. If the sheet measures s from the crack's second end, s is
    reversed once the length is given. ``crack``, the traced outline and its solid, also gives length and depth.

    Raises:
        SheetFaults: Something in the sheet is unclear. The error lists everything, with location, value and remedy.
        InputError: The file cannot be opened.
    """
    if isinstance(settings, Readings) and settings.scan is not None:
        from validate.readings.scan import read_scan

        if crack is None:
            raise InputError(f"{path}: a scan needs a crack and its solid.")
        return read_scan(path, settings, *crack, progress)
    if path.suffix.lower() in SCANS:
        raise InputError(f"{path}: is a scan: set readings.scan and readings.placement.")
    if crack is not None:
        length_mm, depth_mm = length_mm or crack[0].length_mm, depth_mm or crack[1].depth_mm
    return readings_of(read_grid(path, settings.sheet, settings.separator), settings, length_mm, depth_mm)


def readings_of(
    grid: Grid,
    settings: Declared,
    length_mm: float | None = None,
    depth_mm: float | None = None,
) -> Profile:
    """Read the cells of a sheet, with the same checks and warnings as ``read_readings``."""
    table = find_table(grid, settings)
    rows = read_rows(table)
    cells = rows.cells
    if length_mm is not None and table.chosen.s_from == "second":
        cells = cells.from_other_end(length_mm)
    if len(cells.s_mm) < 2 and not table.is_open():
        finding = f"{counted(len(cells.s_mm), 'station')} with a reading; at least two are needed."
        table.ask("stations", finding, "Add stations, or name another sheet or range.")
    # A question that only follows from an assumed answer to another question is not asked.
    is_sure = not (table.is_guessed or table.is_open("range"))
    has_places = is_sure and not table.is_open("unit", "decimal", "places")
    has_levels = has_places and not table.is_open("quantity")
    if depth_mm is not None and has_places:
        check_in_crack(table, cells, length_mm, depth_mm if has_levels else None)
    remark_beside(table, rows)
    if is_sure and len(cells.s_mm) > 1:
        has_levels = has_levels and not table.is_open("outside", "deep")
        sheet = SheetAndCrack(cells, depth_mm, length_mm)
        if not has_levels:
            sheet = SheetAndCrack(cells, None, length_mm if has_places else None)
        doubts = check_readings(sheet, grid.location())
        table.doubts += [doubt for doubt in doubts if doubt.kind not in WHOLE or has_levels]
    questions = tuple(
        doubt
        for doubt in table.doubts
        if not doubt.can_be_confirmed or not all(map(table.confirms, doubt.answers[CONFIRMS]))
    )
    understood = _understood(table, rows)
    if not all(doubt.is_remark for doubt in questions):
        raise SheetFaults(questions, understood)
    return Profile(
        cells.s_mm,
        np.nanmean(cells.levels_mm, axis=1),
        cells.levels_mm,
        settings.data if isinstance(settings, Readings) else "undeclared",
        grid.path.name,
        _dialect(table, rows),
        doubts=tuple(map(str, questions)),
        questions=questions,
        understood=understood,
        is_depth=cells.is_depth,
    )


def grid_of_rows(name: str, rows: Sequence[Sequence[Any]]) -> Grid:
    """Return rows of values as the cells of a sheet, in which "A1" is the first value.

    None and NaN become blank cells.
    """
    cells = {number: dict(enumerate(map(_cell, row))) for number, row in enumerate(rows, start=1)}
    cells = {number: {k: cell for k, cell in row.items() if cell != BLANK} for number, row in cells.items()}
    return Grid(Path(name), ("rows",), {number: row for number, row in cells.items() if row}).require_size()


def _cell(value: Any) -> Cell:
    if value is None or value != value:
        return BLANK
    if isinstance(value, int | float | np.number) and not isinstance(value, bool):
        if not np.isfinite(value):
            raise InputError(f"{value} is not a finite number. Use NaN for a missing reading.")
        return Cell(f"{value:.15g}", "number")
    return Cell(f"{value}".strip())


def _dialect(table: Table, rows: ReadRows) -> str:
    """Return a sentence that states how a sheet was interpreted, for a check by the person who measured."""
    units = list(dict.fromkeys(f"{column.unit}" for column in table.readings))
    counting = f"{WAYS[table.quantity]} in {' and '.join(units)} from {LABELS['datums'][table.declared.datum]}"
    if table.declared.datum != "sample_surface":
        counting += f", {table.declared.datum_level_mm or 0.0:+g} mm from the sample surface"
    if table.station is not None and units != [table.station.unit]:
        counting += f", places in {table.station.unit}"
    mark = () if rows.mark is None else (f"decimal {rows.mark}",)
    missing_mm = np.isnan(rows.cells.readings_mm)
    # A column of the template that stayed empty is no repeat.
    taken = ~missing_mm.all(axis=0)
    repeats, blank = counted(int(taken.sum()), "repeat"), int(missing_mm[:, taken].sum())
    missing = (f"{counted(blank, 'reading')} missing",) if blank else ()
    skipped = [entry if isinstance(entry, str) else f"row {entry}" for entry in table.chosen.skip]
    named = (f"skipped: {listed(skipped)}",) if skipped else ()
    numbers = {column for row in table.body for column, cell in table.part[row].items() if numeric(cell)}
    unused = sorted(numbers - {column.index for column in table.used})
    unread = (f"not read: {table.named(unused)}",) if unused else ()
    return "; ".join((", ".join((*table.grid.written, *mark)), repeats, counting, *missing, *named, *unread))


def _understood(table: Table, rows: ReadRows) -> ReadSheet:
    """Return the columns with their roles, the header, the first rows, and which of their cells are read."""
    roles = {column.index: column.in_words for column in table.used}
    header = table.header.rows
    first = [row for row in table.grid.rows if row in header or row >= table.header.first][:MAX_ROWS_SHOWN]
    texts = [(row, table.grid.texts(row)) for row in first]
    width = max((len(of_row) for _, of_row in texts), default=0)
    return ReadSheet(
        tuple((letters(column), roles.get(column, "not read")) for column in range(width)),
        tuple(texts),
        frozenset((row, column.index) for row in first if row in rows.read for column in table.used),
        frozenset(header),
    )
