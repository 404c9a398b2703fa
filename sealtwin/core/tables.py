"""CSV tables: numbers for programs, and sheets for spreadsheets, in which no cell can run as a formula."""

import csv
import io
from array import array
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.files import read_text, write_text
from sealtwin.core.records import Floats

FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""First letters of a cell that a spreadsheet runs; some treat the last four, full-width ones, alike."""


def write_table(path: Path, columns: Sequence[str], rows: Floats, decimals: int = 6) -> None:
    """Write a CSV of numbers with one header line, units in the names; NaN becomes an empty field."""
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow(["" if np.isnan(value) else f"{value:.{decimals}f}" for value in row])
    write_text(path, table.getvalue())


def write_sheet(path: Path, columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> None:
    write_text(path, sheet_text(columns, rows))


def sheet_text(columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> str:
    """Return a CSV of text and numbers for spreadsheets, without formulas; None becomes an empty field."""
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return table.getvalue()


def as_text_cell(text: str) -> str:
    """Return a cell that a spreadsheet shows as ``text`` and does not run."""
    return f"'{text}" if text.startswith(FORMULA) else text


def read_table(path: Path, columns: Sequence[str], *, finite: bool = False) -> Floats:
    """Read a CSV that ``write_table`` wrote, (n, len(columns)); with ``finite`` none of its numbers may be missing.

    Raises InputError, naming file and line.
    """
    reader = csv.DictReader(io.StringIO(read_text(path)))
    # Eight bytes a number; lists of lists take ten times that.
    numbers, line = array("d"), 1
    try:
        if missing := set(columns) - set(reader.fieldnames or ()):
            raise InputError(f"{path}, line 1: no column {', '.join(sorted(missing))}; expected {','.join(columns)}.")
        for line, row in enumerate(reader, start=2):
            try:
                numbers.extend([np.nan if row[name] == "" else float(row[name]) for name in columns])
            except (TypeError, ValueError):
                found = str([row[name] for name in columns])
                raise InputError(f"{path}, line {line}: expected {len(columns)} numbers, found {found:.80}.") from None
    except csv.Error as fault:
        raise InputError(f"{path}, after line {line}: no readable CSV ({fault}).") from None
    rows = np.array(numbers, dtype=float).reshape(-1, len(columns))
    if finite and len(wrong := np.argwhere(~np.isfinite(rows))):
        row, column = wrong[0]
        found = f"{columns[column]} = {rows[row, column]:g}"
        raise InputError(f"{path}, line {row + 2}: {found}; expected a number. Run its stage again.")
    return rows


def _cell(value: str | float | None) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        # Python's writer leaves a lone carriage return without quotes, and readers begin a row there.
        return as_text_cell(value.replace("\r\n", "\n").replace("\r", "\n"))
    return f"{value:.12g}"
