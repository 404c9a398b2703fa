"""A sheet of a liquid weighed into a crack, as labs write it: read as readings are, with masses in place of places."""

from pathlib import Path
from typing import Any

import numpy as np

from digitise.weighing.fill import WeighedFill
from sealtwin.core.errors import InputError
from sealtwin.core.records import ReadColumn
from sealtwin.core.settings import checked
from validate.readings.columns import Mass, read_header
from validate.readings.header_words import meaning
from validate.readings.read_readings import TableReader
from validate.readings.samples import read_cells
from validate.readings.sheet import FaultList, SheetGrid
from validate.readings.table_rows import find_header, is_a_number, upright
from validate.readings.understood import WAYS, understood
from validate.settings import Columns, Declared

LEAST_STEPS = 2


def is_fill(grid: SheetGrid) -> bool:
    """Return whether a sheet can only be a fill: a mass over numbers, at most one other column, and no place."""
    header = find_header(grid.rows, grid.merged, Columns())
    roles = {at: found.role for at, name in header.names.items() if (found := meaning(name)) is not None}
    body = grid.rows[header.first + header.count :]
    masses = [sum(is_a_number(row.cell(at)) for row in body) for at, role in roles.items() if role == "mass"]
    numeric = {at for row in body for at, cell in enumerate(row.cells) if is_a_number(cell)}
    others = [at for at in numeric if roles.get(at) not in ("mass", "skipped")]
    return max(masses, default=0) >= LEAST_STEPS and len(others) <= 1 and "station" not in roles.values()


def read_fill(path: Path, declared: Declared, mass: Mass = "") -> tuple[dict[str, Any], str, tuple[ReadColumn, ...]]:
    """Return the columns of [crack.fill] of a trial, and in a sentence and as columns how the sheet was understood.

    ``mass`` is the unit of the masses where the sheet names none. Raises InputError: file, row, column and value, and
    what to answer.
    """
    grid, faults = upright(read_cells(path, declared), declared), FaultList()
    header = read_header(grid, declared, faults, mass)
    faults.columns = understood(grid, header, "mass")
    table = TableReader(grid, header, declared, None, faults)
    steps = [step for row in header.body if (step := table.station(row, {})) is not None]
    faults.raise_if_any()
    read = [(step.s_mm, [one.value_mm for one in step.readings.values()]) for step in steps]
    # A step without a level is left out: masses are those of all steps so far.
    kept = [(grams, float(np.nanmean(each))) for grams, each in read if not np.isnan(each).all()]
    way = -1.0 if header.quantity == "depth" else 1.0
    if not kept:
        raise InputError(f"{path}: no step with a mass and a level.")
    content = {
        "mass_g": [round(grams, 6) for grams, _ in kept],
        "level_mm": [round(way * each_mm, 6) + 0.0 for _, each_mm in kept],
    }
    checked(WeighedFill, path, content)
    last = f"{content['mass_g'][-1]:g} g at {content['level_mm'][-1]:g} mm"
    return content, f"{path}: a fill of {len(kept)} steps, up to {last}; {WAYS[header.quantity]}.", faults.columns
