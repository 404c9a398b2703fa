"""Readers and writers of a run folder's files, CSV tables among them; a file appears whole or not at all."""

import csv
import hashlib
import io
import json
import math
import os
import re
import secrets
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import from_json

from sealtwin.core import plain_files
from sealtwin.core.errors import InputError, naming
from sealtwin.core.plain_files import LARGEST_HASHED_BYTES
from sealtwin.core.records import Floats, Pixels

NUMBERS = re.compile(r"\[\s+[-+\d.eE]+(?:,\s+[-+\d.eE]+)*\s+\]")
TEMPORARY_MARK = "sealtwin-tmp"  # Part of the name of every unfinished file, which no name of a user's has by accident
TEMPORARY = re.compile(rf"\.{TEMPORARY_MARK}-\d+-[0-9a-f]{{8}}(\..+)?", re.DOTALL)
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""First letters of a cell that a spreadsheet runs; some treat the last four, full-width ones, alike."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary name beside ``path`` that takes its place when the block ends without an error.

    The suffix is kept, since writers choose their format by it; the stem is not, which may be as long as a name can be.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{TEMPORARY_MARK}-{os.getpid()}-{secrets.token_hex(4)}{path.suffix}")
    with naming(path):
        try:
            yield temporary
            with temporary.open("rb+") as written:
                os.fsync(written.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


def is_temporary(path: Path) -> bool:
    """Return True for a name that only ``replacing`` gives, of a file that a killed process leaves."""
    return TEMPORARY.fullmatch(path.name) is not None


def write_text(path: Path, text: str) -> None:
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def write_if_new(path: Path, content: bytes) -> None:
    if not path.is_file() or read_bytes(path) != content:
        write_bytes(path, content)


def write_unless_other(contents: Mapping[Path, bytes]) -> None:
    """Write files. Raises InputError, before the first one, if one holds anything else now, which would be lost."""
    for path, content in contents.items():
        if path.exists() and read_bytes(path) != content:
            raise InputError(f"{path}: is there already and is not overwritten; give another name, or move it away.")
    for path, content in contents.items():
        write_if_new(path, content)


def write_png(path: Path, picture: Pixels) -> None:
    import cv2

    encoded, png = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    if not encoded:
        raise RuntimeError("OpenCV could not encode a picture")
    write_bytes(path, png.tobytes())


def write_json(path: Path, content: Any) -> None:
    write_text(path, as_json(content))


def as_json(content: Any) -> str:
    """Return JSON that any reader accepts: NaN and infinity become null.

    It is indented, but a list of numbers stays on one line.
    """
    text = json.dumps(_plain(content), indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    return NUMBERS.sub(lambda found: " ".join(found.group().split()).replace("[ ", "[").replace(" ]", "]"), text)


def read_json(path: Path) -> Any:
    """Read a JSON file. Raises InputError, naming the file, if it is missing or no JSON."""
    try:
        return parse_json(read_text(path))
    except ValueError as fault:
        raise InputError(f"{path}: no readable JSON ({fault}). Delete it and run its stage again.") from fault


def parse_json(text: str) -> Any:
    """Return the content of a JSON. Raises ValueError; also for what json reads and no stage can write.

    That is NaN, a number too large for a float, half of a character that takes two, and lists in more than 200 others.
    """
    content = from_json(text, allow_inf_nan=False)
    if not _is_finite(content):
        raise ValueError("a number is too large")
    return content


def _is_finite(content: Any) -> bool:
    """Return False if a number is infinite, as 1e999 is once it is read."""
    if isinstance(content, float):
        return math.isfinite(content)
    parts = content.values() if isinstance(content, dict) else content if isinstance(content, list) else ()
    return all(map(_is_finite, parts))


@contextmanager
def understood(path: Path) -> Iterator[None]:
    """Turn errors of reading an edited file into an InputError that names the file and the remedy."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as fault:
        reason = f"{type(fault).__name__}: {fault}"
        raise InputError(f"{path}: not as its stage wrote it ({reason}). Run that stage again.") from fault


def sha256(path: Path) -> str:
    """Return the hash of a file. Raises InputError for a device, a pipe or an endless file."""
    with naming(path), plain_files.opened(path, LARGEST_HASHED_BYTES) as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def read_text(path: Path) -> str:
    """Read a text that a stage wrote. Raises InputError as ``read_bytes``, and if it is no text."""
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as fault:
        raise InputError(f"{path}: no UTF-8 text. Run its stage again.") from fault


def read_bytes(path: Path) -> bytes:
    """Read a file that a stage wrote. Raises InputError if it is missing, too large, a device or a pipe."""
    try:
        return plain_files.read_bytes(path)
    except FileNotFoundError:
        raise InputError(f"{path}: not found. Run the stage that writes it, or 'sealtwin run' for all.") from None


def write_table(path: Path, columns: Sequence[str], rows: Floats, decimals: int = 6) -> None:
    """Write a CSV of numbers with one header line, units in the names; NaN becomes an empty field."""
    # One format for a whole row: a call for each number takes six times as long.
    line = ",".join([f"%.{decimals}f"] * len(columns)) + "\n"
    body = "".join(line % tuple(row.tolist()) for row in rows)
    write_text(path, _csv_text(columns, ()) + body.replace("nan", ""))


def write_sheet(path: Path, columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> None:
    write_text(path, sheet_text(columns, rows))


def sheet_text(columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> str:
    """Return a CSV of text and numbers for spreadsheets, without formulas; None becomes an empty field."""
    return _csv_text(columns, ([_cell(value) for value in row] for row in rows))


def _csv_text(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
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


def _plain(value: Any) -> Any:
    """Convert arrays to lists, numpy scalars to Python's, NaN and infinity to None."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    if isinstance(value, Path):
        return value.name
    return value
