"""The readers of sheets, as a lab uses them: readings, a fill, and the cells of a table."""

import re
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from digitise.weighing.fill import WeighedFill
from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile, ReadColumn
from sealtwin.core.settings import checked
from validate.readings import sheet as old
from validate.readings.columns import Mass, read_header
from validate.readings.grid import ReadSheet, SheetFaults, column_of
from validate.readings.numbers import number
from validate.readings.read_readings import read_readings
from validate.readings.samples import read_cells
from validate.readings.table_reader import TableReader
from validate.readings.understood import WAYS
from validate.settings import Columns, Declared

FIRST_ROWS = 8  # Rows that are shown
CONFIRMED = re.compile(r"as_written = (\[[^]]*\])")


def look_at(
    path: Path, declared: Declared, depth_mm: float | None = None
) -> tuple[Profile | None, tuple[Doubt, ...], ReadSheet | None]:
    """Read a sheet as a run does, without the crack's length.

    Returns the readings, or None if they cannot be read; what is open or in doubt; and the sheet as it was understood,
    or None if it cannot be opened.
    """
    try:
        profile = read_readings(path, declared, None, depth_mm)
    except InputError as fault:
        columns = fault.columns if isinstance(fault, old.SheetFaults) else ()
        return None, doubts_in(fault), _understood(path, declared, columns)
    return profile, questions_of(profile), _understood(path, declared, profile.columns)


def questions_of(profile: Profile) -> tuple[Doubt, ...]:
    """Return the doubts about readings."""
    return tuple(map(_doubt, profile.doubts))


def doubts_in(fault: InputError) -> tuple[Doubt, ...]:
    """Return the parts of an error: those of a sheet, or a sentence of any other one each."""
    return fault.doubts if isinstance(fault, SheetFaults) else tuple(map(_doubt, str(fault).splitlines()))


def _doubt(sentence: str) -> Doubt:
    where, _, finding = sentence.partition(": ")
    answers: dict[str, Any] = {
        name: "..." for name in Columns.model_fields if re.search(rf"\b(?:columns\.|in ){name}\b", finding)
    }
    answers |= {"unit": "mm"} if "no unit" in finding else {}
    if (confirmed := CONFIRMED.search(finding)) is not None:
        answers["as_written"] = re.findall('"([^"]+)"', confirmed[1])
    return Doubt("old", where, finding, answers=answers)


def _understood(path: Path, declared: Declared, columns: tuple[ReadColumn, ...]) -> ReadSheet | None:
    try:
        rows = texts_of(path, declared)
    except InputError:
        return None
    roles = tuple((one.place, f"{one.role} {one.unit}".strip()) for one in columns if one.place.isalpha())
    used = {column_of(letter) for letter, role in roles if "not" not in role}
    first = list(rows.items())[:FIRST_ROWS]
    read = {(row, at) for row, texts in first for at, text in enumerate(texts) if at in used and number(text)}
    return ReadSheet(roles, tuple(first), frozenset(read))


def texts_of(path: Path, declared: Declared | None = None) -> dict[int, tuple[str, ...]]:
    """Return the texts of the cells of a table by row number from 1. Raises InputError if it cannot be read."""
    grid = read_cells(path, declared or Declared())
    return {row.number: tuple(cell.text for cell in row.cells) for row in grid.rows}


def table_of(path: Path) -> tuple[tuple[str, ...], list[tuple[int, list[tuple[str, str]]]]]:
    """Return the names in the first row of a table, and the number of each other row with the name and text of cells.

    Raises InputError if the file cannot be read.
    """
    (_, head), *rows = [*texts_of(path).items()] or [(1, ())]
    return head, [(row, [*zip_longest(head, texts, fillvalue="")]) for row, texts in rows]


def read_fill(path: Path, declared: Declared, unit: str = "") -> tuple[dict[str, Any], str]:
    """Read the sheet of a liquid weighed into a crack. It is read like readings, with masses in place of stations.

    Returns the columns of a trial's [crack.fill], and a sentence on how the sheet was read. ``unit`` is that of the
    masses if the sheet lacks it. Raises InputError with file, row, column, value and the remedy.
    """
    units: dict[str, Mass] = {"": "", "g": "g", "kg": "kg"}
    if unit not in units:
        raise InputError(f"{path}: mass = {unit!r:.40} is no unit of the masses; write g or kg.")
    faults = old.FaultList()
    grid = read_cells(path, declared)
    header = read_header(grid, declared, faults, units[unit])
    table = TableReader(grid, header, declared, None, faults)
    steps = [step for row in header.body if (step := table.station(row, {})) is not None]
    faults.raise_if_any()
    read = [(step.s_mm, [one.value_mm for one in step.readings.values()]) for step in steps]
    # Masses are cumulative, so a step without a level can be dropped.
    levels = [(grams, float(np.nanmean(each))) for grams, each in read if not np.isnan(each).all()]
    way = -1.0 if header.quantity == "depth" else 1.0
    if not levels:
        raise InputError(f"{path}: no step has both a mass and a level; write the level that belongs to each mass.")
    content = {
        "mass_g": [round(grams, 6) for grams, _ in levels],
        "level_mm": [round(way * each_mm, 6) + 0.0 for _, each_mm in levels],
    }
    checked(WeighedFill, path, content)
    last = f"{content['mass_g'][-1]:g} g at {content['level_mm'][-1]:g} mm"
    return content, f"{path}: read as a fill of {len(levels)} steps, up to {last}; {WAYS[header.quantity]}."
