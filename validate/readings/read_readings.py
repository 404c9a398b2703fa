"""Caliper readings of a trial, read from a lab's sheet."""

from pathlib import Path

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile
from validate.readings.columns import read_header
from validate.readings.samples import read_cells, rows_of_sample
from validate.readings.sheet import FaultList, Place, shown
from validate.readings.table import CrackLimits, TableReader, level_mm
from validate.settings import Declared, Readings
from validate.units import LABELS, counted


def read_readings(
    path: Path, settings: Declared, length_mm: float | None = None, depth_mm: float | None = None
) -> Profile:
    """Read a CSV or XLSX as levels from the sample's surface, the mean of each station and its repeats, sorted along s.

    What the sheet leaves open must be declared in ``settings``. Rows may have any order, a blank field is a missing
    reading, and a station without any is left out. Where the depth of the crack is given, a station outside the crack
    and a level that no filling of it can have are faults, too; the length may still be unknown.

    Raises:
        SheetFaults: The sheet has faults; the error lists each with its place, value and remedy.
        InputError: The file cannot be opened.
    """
    grid, faults = read_cells(path, settings), FaultList()
    header = rows_of_sample(grid, read_header(grid, settings, faults), settings, faults)
    crack = None if depth_mm is None else CrackLimits(length_mm, depth_mm)
    table = TableReader(grid, header, settings, crack, faults)
    s_mm, levels_mm = table.read()
    if len(s_mm) < 2 and not faults.count:
        found = f"{counted(len(s_mm), 'station')} with a reading; a level along the crack needs two or more."
        faults.add(grid.place(), found, "Add the others.")
    faults.raise_if_any()
    data = settings.data if isinstance(settings, Readings) else "undeclared"
    return Profile(s_mm, np.nanmean(levels_mm, axis=1), levels_mm, data, path.name, _dialect(table, levels_mm.shape[1]))


def _dialect(table: TableReader, repeats: int) -> str:
    grid, header, declared = table.grid, table.header, table.declared
    sample = () if declared.sample is None else (f"rows of {shown(declared.sample)}",)
    decimal = () if table.mark is None else (f"decimal {table.mark}",)
    units = list(dict.fromkeys(str(column.unit) for column in header.readings))
    upward = "upward" if header.quantity == "level" else "downward"
    counting = f"{header.quantity} {upward} in {' and '.join(units)} from {LABELS['datums'][declared.datum]}"
    if declared.datum != "sample_surface":
        counting += f", {declared.datum_level_mm or 0.0:+g} mm from the sample surface"
    if units != [header.station.unit]:
        counting += f", places in {header.station.unit}"
    layout = "wide" if header.repeat is None else "long"
    parts = [", ".join((*grid.written, *sample, *decimal)), f"{layout}, {counted(repeats, 'repeat')}", counting]
    if table.missing:
        parts.append(f"{counted(table.missing, 'reading')} missing")
    if header.above:
        parts.append(f"{counted(header.above, 'line')} above the header")
    if header.skipped:
        parts.append("not readings: " + ", ".join(shown(column.name) for column in header.skipped[:8]))
    return "; ".join((*parts, *grid.remarks))


def take_readings(
    table: Floats, settings: Readings, length_mm: float | None = None, depth_mm: float | None = None
) -> Profile:
    """Return readings that are in memory as ``read_readings`` does, judged alike.

    ``table`` is (n, 1 + r): s in mm, then r repeats as levels upward from the sample's surface, or as depths where
    ``settings.quantity`` says so; NaN where a reading is missing. Raises InputError, naming a row by its number from 0.
    """
    name = str(settings.file)
    table = np.asarray(table, dtype=float)
    if table.ndim != 2 or table.shape[1] < 2:
        raise InputError(f"{name}: an array of shape {table.shape}; give (n, 1 + r): s_mm, then r readings.")
    faults, crack = FaultList(), None if depth_mm is None else CrackLimits(length_mm, depth_mm)
    levels_mm = level_mm(table[:, 1:], settings.quantity or "level", settings)
    for row, (s_mm, repeats_mm) in enumerate(zip(table[:, 0], levels_mm, strict=True)):
        place = Place(Path(f"{name}, row {row}"))
        if not np.isfinite(s_mm) or np.isinf(repeats_mm).any():
            faults.add(place, "a place or a reading that is not a finite number.", "A missing reading is NaN.")
        elif crack is not None:
            crack.check_station(place, f"{s_mm:g}", float(s_mm), faults)
            for one_mm in repeats_mm[np.isfinite(repeats_mm)]:
                crack.check_level(place, f"{one_mm:g} mm", float(one_mm), faults)
    faults.raise_if_any()
    kept = np.isfinite(levels_mm).any(axis=1)
    order = np.argsort(table[kept, 0], kind="stable")
    s_mm, levels_mm = table[kept, 0][order], levels_mm[kept][order]
    if len(s_mm) < 2 or (np.diff(s_mm) <= 0).any():
        raise InputError(f"{name}: {len(s_mm)} stations with a reading; give two or more, each place once.")
    return Profile(s_mm, np.nanmean(levels_mm, axis=1), levels_mm, settings.data, name)
