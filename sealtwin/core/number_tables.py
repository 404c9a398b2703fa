"""Tables of numbers from users: CSV with expected columns. Messages have file, row, column and value."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_text

LARGEST_BYTES = 200_000
Bounds = Mapping[str, tuple[float, float]]
"""Smallest and largest value of each column, by name."""


def read_columns(path: Path, bounds: Bounds, needed: Sequence[str], rows: tuple[int, int]) -> dict[str, list[float]]:
    """Read a CSV with columns of ``bounds`` in any order, including all of ``needed``.

    ``rows`` is the smallest and largest number of rows. Returns the numbers by column; the key ``row`` has the number
    of each row in the file. Raises InputError.
    """
    others = [name for name in bounds if name not in needed]
    names = [", ".join(needed)] if needed else []
    names += [f"{'optionally' if needed else 'any of'} {', '.join(others)}"] if others else []
    expected = f"a CSV in UTF-8 with columns {', and '.join(names)}, separated by commas"
    if path.is_dir():
        raise InputError(f"{path}: is a folder; expected {expected}.")
    if not path.is_file():
        raise InputError(f"{path}: no such file; expected {expected}.")
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_BYTES} bytes; a table may have up to {rows[1]} rows.")
    try:
        text = read_text(path, LARGEST_BYTES)
        lines = [(line, row) for line, row in enumerate(csv.reader(io.StringIO(text)), start=1) if any(row)]
    except UnicodeDecodeError as fault:
        raise InputError(
            f"{path}, byte {fault.start + 1}: not in UTF-8; expected {expected}. Save it in UTF-8."
        ) from None
    except csv.Error as fault:
        raise InputError(f"{path}: not readable CSV ({fault}); expected {expected}.") from None
    if not lines:
        raise InputError(f"{path}: empty; expected {expected}.")
    header = [name.strip() for name in lines[0][1]]
    if len(header) == 1 and (marks := [mark for mark in (";", "\t") if mark in header[0]]):
        raise InputError(
            f"{path}, row 1: columns are separated by {marks[0]!r}; expected {expected}, with decimal points."
        )
    if wrong := [name for name in header if name not in bounds or header.count(name) > 1]:
        raise InputError(f"{path}, row 1: column '{wrong[0]:.60}' is unknown or named twice; expected {expected}.")
    if not rows[0] <= len(lines) - 1 <= rows[1]:
        raise InputError(f"{path}: {len(lines) - 1} rows below the header; {rows[0]} to {rows[1]} are allowed.")
    columns: dict[str, list[float]] = {name: [] for name in header}
    for line, row in lines[1:]:
        if len(row) != len(header):
            raise InputError(
                f"{path}, row {line}: {len(row)} cells, but the header has {len(header)} columns ({','.join(row):.60})."
            )
        for name, cell in zip(header, row, strict=True):
            try:
                # Python would read 1_5 as 15.
                value = float(cell.replace("_", "?"))
            except ValueError:
                raise InputError(f"{path}, row {line}, column {name}: '{cell:.60}' is not a number.") from None
            low, high = bounds[name]
            if not low <= value <= high:
                raise InputError(f"{path}, row {line}, column {name}: {value:g}; {low:g} to {high:g} is allowed.")
            columns[name].append(value)
    if missing := [name for name in needed if name not in columns]:
        raise InputError(f"{path}, row 1: no column {missing[0]}; expected {expected}.")
    return {**columns, "row": [float(line) for line, _ in lines[1:]]}
