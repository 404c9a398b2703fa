"""Recognise the kinds of a lab's tables and texts, and read the masses and levels of a fill."""

from pathlib import Path
from typing import Any, Literal

import numpy as np

from digitise.weighing.fill import WeighedFill
from sealtwin.core.errors import InputError
from sealtwin.core.records import ReadColumn
from sealtwin.core.settings import checked
from validate.readings.columns import Mass, read_header
from validate.readings.header_rows import find_header
from validate.readings.header_words import meaning, unit_of
from validate.readings.samples import read_cells
from validate.readings.sheet import FaultList, SheetGrid
from validate.readings.table_reader import TableReader
from validate.readings.table_rows import is_a_number
from validate.readings.understood import WAYS, understood
from validate.settings import Columns, Declared

LEAST_STEPS = 2


def kind_of_text(path: Path) -> Literal["readings", "fill", "text"]:
    """Return the kind of a file: a table of readings or of a fill, or another text."""
    try:
        grid = read_cells(path, Declared())
    except InputError:
        return "text"
    if _is_fill(grid):
        return "fill"
    numbers = sum(sum(map(is_a_number, row.cells)) > 1 for row in grid.rows)
    if grid.is_note:
        # "- 0 mm: 11.1 / 11.0" has its unit behind the place; "3 beads: 12" has no place.
        places = [row.cell(0).text.split(" ") for row in grid.rows if row.width > 1]
        numbers = sum(unit_of(unit) is not None for _, *units in places for unit in units) + numbers
    return "readings" if numbers > 1 and path.suffix.lower() != ".md" else "text"


def _is_fill(grid: SheetGrid) -> bool:
    """Return True if a sheet is a fill.

    A fill has a column of masses, at most one other column of numbers, and no column of stations.
    """
    header = find_header(grid.rows, grid.merged, Columns())
    roles = {at: column.role for at, name in header.names.items() if (column := meaning(name)) is not None}
    body = grid.rows[header.first + header.count :]
    masses = [sum(is_a_number(row.cell(at)) for row in body) for at, role in roles.items() if role == "mass"]
    numeric = {at for row in body for at, cell in enumerate(row.cells) if is_a_number(cell)}
    others = [at for at in numeric if roles.get(at) not in ("mass", "skipped")]
    return max(masses, default=0) >= LEAST_STEPS and len(others) <= 1 and "station" not in roles.values()


def read_fill(path: Path, declared: Declared, mass: Mass = "") -> tuple[dict[str, Any], str, tuple[ReadColumn, ...]]:
    """Read the sheet of a liquid weighed into a crack. It is read like readings, with masses in place of stations.

    Returns the columns of a trial's [crack.fill], a sentence on how the sheet was read, and the sheet's columns.
    ``mass`` is the unit of the masses if the sheet lacks it. Raises InputError with file, row, column, value and the
    remedy.
    """
    faults = FaultList()
    grid = read_cells(path, declared)
    header = read_header(grid, declared, faults, mass)
    faults.columns = understood(header, "mass")
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
    return (
        content,
        f"{path}: read as a fill of {len(levels)} steps, up to {last}; {WAYS[header.quantity]}.",
        faults.columns,
    )
