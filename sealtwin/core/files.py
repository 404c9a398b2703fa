"""Readers and writers of the files of a run folder. A file is either written completely or not at all."""

import csv
import hashlib
import io
import math
import os
import re
import secrets
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic_core import from_json, to_json

from sealtwin.core import plain_files
from sealtwin.core.arrays import Floats, Pixels
from sealtwin.core.errors import InputError, naming
from sealtwin.core.plain_files import LARGEST_HASHED_BYTES

if TYPE_CHECKING:
    from PIL.Image import Image

NUMBERS = re.compile(r"\[\s+[-+\d.eE]+(?:,\s+[-+\d.eE]+)*\s+\]")
MISSING = re.compile(r"(?<=,)(?=,|\r?$)|^(?=,)", re.MULTILINE)  # Pattern of an empty field in a CSV
JPEG_QUALITY = 85  # Quality of JPEGs of photos
TEMPORARY_MARK = "sealtwin-tmp"  # Part of the name of every unfinished file. Users' files are unlikely to contain it
TEMPORARY = re.compile(rf"\.{TEMPORARY_MARK}-\d+-[0-9a-f]{{8}}(\..+)?", re.DOTALL)
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""First characters of cells that a spreadsheet runs as a formula. Some also accept the last four (full-width)."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder, and move it to ``path`` if the block ends without an error.

    The temporary path has the suffix of ``path``, because writers choose the format by the suffix. The temporary name
    does not repeat the stem of ``path``, which may already have the greatest allowed length.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{TEMPORARY_MARK}-{os.getpid()}-{secrets.token_hex(4)}{path.suffix}")
    with naming(path):
        try:
            yield temporary
            with temporary.open("rb+") as file:
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


def is_temporary(path: Path) -> bool:
    """Return True if ``path`` is a temporary file of ``replacing``, which a killed process has left behind."""
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
    """Write files. Raises InputError, before it writes any file, if one of them exists with different content."""
    for path, content in contents.items():
        if path.exists() and read_bytes(path) != content:
            raise InputError(f"{path}: already exists and is not overwritten. Give another name, or move the file.")
    for path, content in contents.items():
        write_if_new(path, content)


def write_png(path: Path, picture: Pixels) -> None:
    import cv2

    encoded, png = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    if not encoded:
        raise RuntimeError("OpenCV could not encode a picture")
    write_bytes(path, png.tobytes())


def read_picture(path: Path, largest_px: int = 100_000) -> "Image":
    """Return a picture in RGB whose longer side is at most ``largest_px``. Raises InputError for an unusable file."""
    from PIL import Image

    try:
        picture = Image.open(io.BytesIO(read_bytes(path)))
        picture.thumbnail((largest_px, largest_px))
        return picture.convert("RGB")
    except OSError:
        raise InputError(f"{path}: the picture cannot be read. Draw it again with 'sealtwin digitise'.") from None


def as_jpeg(picture: "Image") -> bytes:
    content = io.BytesIO()
    picture.save(content, "jpeg", quality=JPEG_QUALITY)
    return content.getvalue()


def as_uri(jpeg: bytes) -> str:
    """Return a JPEG as a data URI for a page."""
    return f"data:image/jpeg;base64,{b64encode(jpeg).decode()}"


def write_json(path: Path, content: Any) -> None:
    write_text(path, as_json(content))


def as_json(content: Any) -> str:
    """Return ``content`` as indented JSON, with each list of numbers on one line.

    NaN and infinity become null, because many readers accept only standard JSON.
    """
    text = to_json(content, indent=2, inf_nan_mode="null", fallback=_plain).decode() + "\n"
    return NUMBERS.sub(lambda match: " ".join(match.group().split()).replace("[ ", "[").replace(" ]", "]"), text)


def _plain(value: Any) -> Any:
    return value.as_posix() if isinstance(value, PurePath) else value.tolist()


def read_json(path: Path) -> Any:
    """Read a JSON file. Raises InputError with the name of the file if it is missing or not valid JSON."""
    try:
        return parse_json(read_text(path))
    except ValueError as fault:
        raise InputError(f"{path}: not readable JSON ({fault}). Delete it and run its stage again.") from fault


def parse_json(text: str) -> Any:
    """Return the content of a JSON text.

    Raises ValueError if the text is not JSON. Also raises ValueError for content that Python's ``json`` accepts but no
    stage writes: NaN, a number too large for a float, half of a surrogate pair, or more than 200 nested lists.
    """
    content = from_json(text, allow_inf_nan=False)
    if not _is_finite(content):
        raise ValueError("a number is too large")
    return content


def _is_finite(content: Any) -> bool:
    """Return False if a number in ``content`` is infinite. A number such as 1e999 is read as infinity."""
    if isinstance(content, float):
        return math.isfinite(content)
    parts = content.values() if isinstance(content, dict) else content if isinstance(content, list) else ()
    return all(map(_is_finite, parts))


@contextmanager
def reading_stage_file(path: Path) -> Iterator[None]:
    """Convert an error caused by the content of a file into an InputError that states the file and the remedy."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as fault:
        reason = f"{type(fault).__name__}: {fault}"
        raise InputError(f"{path}: the content is not what its stage wrote ({reason}). Run the stage again.") from fault


def sha256(path: Path) -> str:
    """Return the SHA-256 hash of a file. Raises InputError for a device, a pipe or a file that is too large."""
    with naming(path), plain_files.opened(path, LARGEST_HASHED_BYTES) as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def hashes(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the hash of each named file in a folder."""
    return {name: sha256(folder / name) for name in names}


def read_text(path: Path) -> str:
    """Read a text file that a stage wrote. Raises InputError if it is not UTF-8, or if ``read_bytes`` raises it."""
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as fault:
        raise InputError(f"{path}: is not UTF-8 text. Run its stage again.") from fault


def read_bytes(path: Path) -> bytes:
    """Read a file that a stage wrote. Raises InputError if it is missing, too large, a device or a pipe."""
    try:
        return plain_files.read_bytes(path)
    except FileNotFoundError:
        raise InputError(
            f"{path}: not found. Run the stage that writes it, or 'sealtwin run' for all stages."
        ) from None


def write_table(path: Path, columns: Sequence[str], rows: Floats, decimals: int = 6) -> None:
    """Write a CSV with one header line, ``columns``, and rows of numbers. NaN becomes an empty field."""
    body = io.StringIO()
    np.savetxt(body, rows, f"%.{decimals}f", ",")
    write_text(path, ",".join(columns) + "\n" + body.getvalue().replace("nan", ""))


def write_sheet(path: Path, columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> None:
    write_text(path, sheet_text(columns, rows))


def sheet_text(columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> str:
    """Return a CSV of texts and numbers for spreadsheets, without formulas. None becomes an empty field."""
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return table.getvalue()


def as_text_cell(text: str) -> str:
    """Return ``text`` in a form that a spreadsheet shows as text and does not run as a formula."""
    return f"'{text}" if text.startswith(FORMULA) else text


def read_table(path: Path, columns: Sequence[str], *, finite: bool = False) -> Floats:
    """Read ``columns`` of a CSV that ``write_table`` wrote, (n, len(columns)).

    Raises InputError with file and line if the content is not valid. With ``finite``, empty fields are not valid.
    """
    header, _, body = read_text(path).partition("\n")
    names = header.strip().split(",")
    if missing := {*columns} - {*names}:
        raise InputError(
            f"{path}, line 1: no column {', '.join(sorted(missing))}; expected columns are {','.join(columns)}."
        )
    rows, wanted = np.empty((0, len(columns))), [names.index(name) for name in columns]
    try:
        if body.strip():
            numbers = io.StringIO(MISSING.sub("nan", body))
            rows = np.loadtxt(numbers, delimiter=",", usecols=wanted, comments=None, ndmin=2)
    except ValueError as fault:
        raise InputError(f"{path}: the content is not what its stage wrote (row 0 is line 2): {fault!s:.200}") from None
    if finite and len(wrong := np.argwhere(~np.isfinite(rows))):
        row, column = wrong[0]
        cell = f"{columns[column]} = {rows[row, column]:g}"
        raise InputError(f"{path}, line {row + 2}: {cell}; expected a number. Run its stage again.")
    return rows


def _cell(value: str | float | None) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        # Python's writer does not quote a single carriage return, but readers begin a new row there.
        return as_text_cell(value.replace("\r\n", "\n").replace("\r", "\n"))
    return f"{value:.12g}"
