"""Sheets of a lab besides readings: a weighed fill, and the cells of a table."""

from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from digitise.weighing.fill import WeighedFill
from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.settings import checked
from validate.readings.files import read_grid
from validate.readings.grid import SheetFaults
from validate.readings.read_readings import WAYS, is_unanswered
from validate.readings.rest import ask_about_rest
from validate.readings.rows import read_rows
from validate.readings.table import find_table
from validate.settings import Declared


def doubts_in(fault: InputError) -> tuple[Doubt, ...]:
    """Return the parts of an error: those of a sheet, or a sentence of any other one each."""
    if isinstance(fault, SheetFaults):
        return fault.doubts
    parts = (sentence.partition(": ") for sentence in str(fault).splitlines())
    return tuple(Doubt("input", where, finding) for where, _, finding in parts)


def table_of(path: Path) -> tuple[tuple[str, ...], list[tuple[int, list[tuple[str, str]]]]]:
    """Return the names in the first row of a table, and the number of each other row with the name and text of cells.

    Raises InputError if the file cannot be read.
    """
    texts = {row: tuple(cell.text for cell in cells) for row, cells in read_grid(path).rows.items()}
    (_, head), *rows = [*texts.items()] or [(1, ())]
    return head, [(row, [*zip_longest(head, texts, fillvalue="")]) for row, texts in rows]


def read_fill(path: Path, declared: Declared, unit: str = "") -> tuple[dict[str, Any], str]:
    """Read the sheet of a liquid weighed into a crack. It is read like readings, with masses in place of stations.

    Returns the columns of a trial's [crack.fill], and a sentence on how the sheet was read. ``unit`` is that of the
    masses if the sheet lacks it. Raises InputError with file, row, column, value and the remedy.
    """
    if unit not in ("", "g", "kg"):
        raise InputError(f"{path}: mass = {unit!r:.40} is no unit of the masses; write g or kg.")
    table = find_table(read_grid(path, declared.sheet, declared.separator), declared, "mass", unit or None)
    rows = read_rows(table)
    ask_about_rest(table, rows)
    if asked := [doubt for doubt in table.doubts if is_unanswered(doubt, declared)]:
        raise SheetFaults(asked)
    cells = rows.cells
    # Masses are cumulative, so a step without a level can be dropped.
    if not len(cells.s_mm):
        raise InputError(f"{path}: no step has both a mass and a level; write the level that belongs to each mass.")
    levels_mm = np.nanmean(cells.levels_mm, axis=1)
    content = {"mass_g": np.round(cells.s_mm, 6).tolist(), "level_mm": (np.round(levels_mm, 6) + 0.0).tolist()}
    checked(WeighedFill, path, content)
    last = f"{content['mass_g'][-1]:g} g at {content['level_mm'][-1]:g} mm"
    way = WAYS["depth" if cells.is_depth else "level"]
    return content, f"{path}: read as a fill of {len(levels_mm)} steps, up to {last}; {way}."
