"""Read plain files of a limited size, and users' tables of numbers. All other modules read files through this one.

Devices and pipes are refused: reading a device may never end, and a pipe may wait forever.
"""

import csv
import io
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from sealtwin.core.errors import InputError, as_text, naming

LARGEST_BYTES = 200_000_000
"""Largest table, JSON file or frame that is read, in bytes: enough for two million particles.

A larger file would fill the memory."""
LARGEST_HASHED_BYTES = 10_000_000_000
"""Largest file that is hashed, in bytes. The limit is larger than any input, but excludes sparse files of enormous
size."""
LARGEST_TABLE_BYTES = 200_000  # Largest table of numbers from a user, in bytes
THOUSANDS = re.compile(r"[1-9]\d{0,2}(,\d{3})+")
Bounds = Mapping[str, tuple[float, float]]
"""Smallest and largest allowed value of each column, by column name."""


@contextmanager
def opened(path: Path, largest_bytes: int = LARGEST_BYTES) -> Iterator[io.BufferedReader]:
    """Open a file for reading.

    Raises InputError if the path, or the target of a link, is a folder, a device, a pipe or a file above
    ``largest_bytes``. Raises FileNotFoundError or another OSError, with the name of the file, if it cannot be opened.
    """
    with naming(path):
        status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise InputError(f"{as_text(path)}: is a folder; expected a file. Move the folder, and run the stage again.")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(
            f"{as_text(path)}: is a device or a pipe, or a link to one; expected a file. Replace it by a copy of the "
            "file, or delete it and run its stage again."
        )
    if status.st_size > largest_bytes:
        raise InputError(
            f"{as_text(path)}: the file has {status.st_size / 1e6:.1f} MB, larger than the limit of "
            f"{largest_bytes / 1e6:g} MB. Delete it and run its stage again."
        )
    with path.open("rb") as content:
        yield content


def read_bytes(path: Path, largest_bytes: int = LARGEST_BYTES) -> bytes:
    """Read a file. Raises the same errors as ``opened``."""
    with naming(path), opened(path, largest_bytes) as content:
        return content.read()


def read_text(path: Path, largest_bytes: int = LARGEST_BYTES) -> str:
    """Read a UTF-8 text, with or without a byte-order mark. All line ends become line feeds.

    Raises UnicodeDecodeError if the file is not UTF-8, and the same errors as ``opened``.
    """
    return io.TextIOWrapper(io.BytesIO(read_bytes(path, largest_bytes)), encoding="utf-8-sig").read()


def read_columns(
    path: Path, bounds: Bounds, needed: Sequence[str], rows: tuple[int, int], rising: Sequence[str] = ()
) -> dict[str, list[float]]:
    """Read a CSV of numbers. Its columns are named in ``bounds``, and may be in any order.

    ``needed`` names the columns that must be present, and ``rising`` those whose numbers become larger from row to row.
    ``rows`` is the smallest and the largest number of rows. Returns
    the numbers of each column by name, and under the key ``row`` the row numbers in the file. Raises InputError with
    file, row, column and value.
    """
    names = ", ".join(name if name in needed else f"{name} (optional)" for name in bounds)
    expected = f"expected a CSV in UTF-8 with columns {names}, separated by commas, or by semicolons or tabs"
    if not path.is_file():
        raise InputError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}; {expected}.")
    if path.stat().st_size > LARGEST_TABLE_BYTES:
        raise InputError(
            f"{path}: the file is larger than {LARGEST_TABLE_BYTES} bytes; a table may have up to {rows[1]} rows."
        )
    try:
        text = read_text(path, LARGEST_TABLE_BYTES)
        mark = next((mark for mark in "\t;" if mark in text), ",")
        content = csv.reader(io.StringIO(text), delimiter=mark)
        (_, header), *table = [(line, row) for line, row in enumerate(content, start=1) if any(row)] or [(1, [])]
    except (UnicodeDecodeError, csv.Error) as fault:
        raise InputError(f"{path}: not readable ({fault}); {expected}. Save it in UTF-8.") from None
    header = [name.strip() for name in header]
    if wrong := [name for name in header if name not in bounds or header.count(name) > 1]:
        raise InputError(f"{path}, row 1: column '{wrong[0]:.60}' is unknown or occurs twice; {expected}.")
    if missing := [name for name in needed if name not in header]:
        raise InputError(f"{path}, row 1: no column {missing[0]}; {expected}.")
    if not rows[0] <= len(table) <= rows[1]:
        raise InputError(f"{path}: there are {len(table)} rows below the header; {rows[0]} to {rows[1]} are allowed.")
    with_comma = [cell for _, row in table for cell in row if "," in cell]
    if with_comma and all(THOUSANDS.fullmatch(cell.strip()) for cell in with_comma):
        raise InputError(
            f"{path}: the comma in '{with_comma[0]:.60}' may be a decimal mark, or it may separate thousands. Write "
            "the numbers with decimal points."
        )
    columns = {name: list[float]() for name in (*header, "row")}
    for line, row in table:
        if len(row) != len(header):
            raise InputError(
                f"{path}, row {line}: the row has {len(row)} cells ({mark.join(row):.60}), but the header has "
                f"{len(header)} columns."
            )
        for name, cell in zip(header, row, strict=True):
            low, high = bounds[name]
            try:
                # Python's float() would read 1_5 as 15.
                value = float(cell.replace("_", "?").replace(",", "."))
            except ValueError:
                raise InputError(f"{path}, row {line}, column {name}: '{cell:.60}' is not a number.") from None
            if not low <= value <= high:
                raise InputError(f"{path}, row {line}, column {name}: {value:g} is not in {low:g} to {high:g}.")
            if name in rising and columns[name] and value <= columns[name][-1]:
                raise InputError(
                    f"{path}, row {line}, column {name}: {value:g} follows {columns[name][-1]:g}; values must become "
                    "larger from row to row."
                )
            columns[name].append(value)
        columns["row"].append(line)
    return columns
