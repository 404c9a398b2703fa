"""Caliper readings of a trial: a sheet, or an array."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile
from validate.readings.columns import read_header
from validate.readings.sample_rows import rows_of_sample
from validate.readings.samples import read_cells
from validate.readings.screens import cell_name
from validate.readings.sheet import FaultList, Place, SheetCell, SheetGrid, SheetRow, quoted
from validate.readings.stations import CrackLimits, Reading, Station, cells_of, level_mm
from validate.readings.table_reader import TableReader
from validate.readings.text_table import (
    NOTE_HEAD,
    decimals_of,
)
from validate.readings.understood import (
    answer_to,
    dialect_of,
    doubts_beside,
    doubts_of,
    in_words,
    screened,
    unanswered,
    understood,
)
from validate.readings.whole_sheet import Filling
from validate.settings import Declared, Readings
from validate.units import counted


def read_readings(
    path: Path,
    settings: Declared,
    length_mm: float | None = None,
    depth_mm: float | None = None,
    filling: Filling | None = None,
) -> Profile:
    """Read a CSV, XLSX or ODS as levels from the sample's surface: mean and repeats of each station, sorted along s.

    Facts that the sheet leaves open must be declared in ``settings``. Rows may have any order, a blank field is a
    missing reading, and a station without readings is omitted. If the depth of the crack is given, stations outside the
    crack and impossible levels are faults too; its length may still be unknown. A possible but suspicious reading
    becomes a doubt of the profile, unless ``settings.as_written`` confirms it; ``filling`` gives further data for these
    checks. If the sheet counts s from the crack's second end, s is reversed once the length is given.

    Raises:
        SheetFaults: The sheet has faults; the error lists each with its place, value and remedy.
        InputError: The file cannot be opened.
    """
    faults = FaultList()
    grid = _with_dashes(read_cells(path, settings), settings, faults)
    header = rows_of_sample(grid, read_header(grid, settings, faults, stand_in=True), settings, faults)
    faults.columns = understood(header)
    crack = None if depth_mm is None else CrackLimits(length_mm, depth_mm)
    table = TableReader(grid, header, settings, crack, faults)
    cells = table.read()
    if length_mm is not None and settings.columns is not None and settings.columns.s_from == "second":
        cells = cells.from_other_end(length_mm)
    s_mm, levels_mm = cells.s_mm, cells.levels_mm
    if len(s_mm) < 2 and not faults.faults:
        finding = f"{counted(len(s_mm), 'station')} with a reading; at least two are needed."
        faults.add(grid.place(), finding, "Add further stations.")
    if faults.faults:
        rows = {fault.place.row for fault in faults.faults if fault.value}
        for place, doubt in doubts_beside(grid, header, cells, settings, length_mm, faults.open):
            if place.row not in rows:
                faults.add(place, doubt.finding, f"{doubt.remedy}, {answer_to(doubt)}")
    faults.raise_if_any()
    data = "undeclared"
    if isinstance(settings, Readings):
        data = settings.data
        if filling is not None:
            filling = replace(filling, volume_mm3=filling.volume_mm3 * (1 - (settings.shrinkage_percent or 0.0) / 100))
    return Profile(
        s_mm,
        np.nanmean(levels_mm, axis=1),
        levels_mm,
        data,
        path.name,
        dialect_of(grid, header, settings, table.mark, levels_mm.shape[1], table.missing, is_long=table.gathers),
        doubts=tuple(doubts_of(grid, header, cells, settings, length_mm, depth_mm, filling)),
        columns=faults.columns,
        is_depth=cells.is_depth,
    )


def _with_dashes(grid: SheetGrid, settings: Declared, faults: FaultList) -> SheetGrid:
    """Return a note in which dashes behind places have the declared meaning; a fault asks for it."""
    answers = settings.as_written or ()
    if not grid.minus or "dash" in answers:
        return grid
    if "minus" not in answers:
        faults.open.add("decimal")
        row = min(grid.minus)
        finding = f"the dash before {quoted(grid.minus[row].lstrip('-'))} separates the place, or is a minus."
        faults.add(grid.place(row), finding, 'Answer readings.as_written = ["dash"], or ["minus"].')
    rows = (
        replace(row, cells=(row.cell(0), SheetCell(grid.minus[row.number])))
        if row.number in grid.minus and row.cells != NOTE_HEAD
        else row
        for row in grid.rows
    )
    return replace(grid, rows=tuple(rows)) if "minus" in answers else grid


def take_readings(
    table: Floats, settings: Readings, length_mm: float | None = None, depth_mm: float | None = None
) -> Profile:
    """Return readings of an array, with the checks and doubts of ``read_readings``.

    ``table`` is (n, 1 + r): s in mm, then r repeats as levels upward from the sample's surface, or as depths if
    ``settings.quantity`` is "depth". NaN marks a missing reading. Doubts name cells as a spreadsheet without a header
    would: B4 is the reading [3, 1]. Raises InputError, which names a row by its number from 0.
    """
    name = str(settings.file)
    table = np.asarray(table, dtype=float)
    if table.ndim != 2 or table.shape[1] < 2:
        raise InputError(f"{name}: an array of shape {table.shape}; give (n, 1 + r): s_mm, then r readings.")
    faults, crack = FaultList(), None if depth_mm is None else CrackLimits(length_mm, depth_mm)
    quantity, stations = settings.quantity or "level", list[Station]()
    for row, (s_mm, *readings_mm) in enumerate(table.tolist()):
        place, levels_mm = Place(Path(f"{name}, row {row}")), level_mm(np.array(readings_mm), quantity, settings)
        if not np.isfinite(s_mm) or np.isinf(levels_mm).any():
            faults.add(place, "a position or a reading is not a finite number.", "Use NaN for a missing reading.")
        elif crack is not None:
            crack.check_station(place, f"{s_mm:g}", s_mm, faults)
            for one_mm in levels_mm[np.isfinite(levels_mm)]:
                crack.check_level(place, f"{one_mm:g} mm", float(one_mm), faults)
        digits_mm = [10.0 ** -decimals_of(f"{value:.12g}") for value in readings_mm]
        written = enumerate(zip(readings_mm, digits_mm, strict=True), start=1)
        readings = {f"{at}": Reading(value, row + 1, at, digit_mm) for at, (value, digit_mm) in written}
        stations.append(Station(s_mm, SheetRow(row + 1, ()), readings))
    faults.raise_if_any()
    cells = cells_of(stations, quantity, settings)
    if len(cells.s_mm) < 2 or (np.diff(cells.s_mm) <= 0).any():
        raise InputError(f"{name}: {len(cells.s_mm)} stations with a reading; give two or more, none of them twice.")
    doubts = (
        in_words(doubt, f"{name}, cell {cell_name(doubt.row, doubt.column)}")
        for doubt in unanswered(screened(cells, depth_mm, None), settings)
    )
    levels_mm = cells.levels_mm
    mean_mm, is_depth = np.nanmean(levels_mm, axis=1), cells.is_depth
    return Profile(cells.s_mm, mean_mm, levels_mm, settings.data, name, doubts=tuple(doubts), is_depth=is_depth)
