"""A sheet in a text file: its encoding, its separator, its fields."""

import csv
import io
import re
from collections import Counter
from pathlib import Path

from validate.settings import Separator
from validate.sheets.faults import Place, refuse
from validate.sheets.grid import BLANK, MOST_COLUMNS, MOST_ROWS, Cell, Grid, Row

MOST_BYTES = 1_000_000
SEPARATORS: dict[Separator, str] = {"tab": "\t", "semicolon": ";", "comma": ","}
"""In the order of preference where two divide as many rows alike: text holds commas, and rarely tabs."""
NAMES = {"\t": "tabs", ";": "semicolons", ",": "commas"}
MARKS = (
    (b"\xff\xfe\x00\x00", "utf-32-le", "UTF-32"),
    (b"\xef\xbb\xbf", "utf-8", "UTF-8"),
    (b"\xff\xfe", "utf-16-le", "UTF-16"),
    (b"\xfe\xff", "utf-16-be", "UTF-16"),
)
ANNOUNCED = re.compile(r'"?sep=([;,\t])"?[ \t;,]*(?:\r\n|\r|\n|$)', re.IGNORECASE)
ZEROS = 0.5
"""Of the high bytes of UTF-16 text in the scripts of Europe nearly all are zero, of its low bytes nearly none."""


def read_delimited(path: Path, content: bytes, sha256: str, separator: Separator | None) -> Grid:
    """Raises SheetFaults where it is no such file."""
    if len(content) > MOST_BYTES:
        raise refuse(
            Place(path),
            f"larger than {MOST_BYTES:,} bytes.",
            "A sheet of readings is some kilobytes: give less of it at a time.",
        )
    text, encoding = _decoded(path, content)
    announced, text = _announced(text)
    mark = SEPARATORS[separator] if separator is not None else announced or _likeliest(text)
    try:
        lines = _fields(text, mark)
    except csv.Error as fault:
        raise refuse(Place(path), f"no CSV ({fault}).", "Save the sheet as 'CSV UTF-8'.") from fault
    if len(lines) > MOST_ROWS:
        raise refuse(Place(path), f"{len(lines)} lines; at most {MOST_ROWS} are read.", "Thin the stations out.")
    first = 1 if announced is None else 2
    rows = [Row(first - 1 + number, tuple(Cell(field) if field else BLANK for field in row)) for number, row in lines]
    if wide := next((row for row in rows if row.width > MOST_COLUMNS), None):
        raise refuse(
            Place(path, row=wide.number),
            f"{wide.width:,} fields; at most {MOST_COLUMNS} are read.",
            "Give one trial's readings, a row for each station.",
        )
    return Grid(path, sha256, tuple(rows), ("CSV", encoding, NAMES[mark]), separator=mark)


def _decoded(path: Path, content: bytes) -> tuple[str, str]:
    """Text, and the name of its encoding."""
    for mark, codec, name in MARKS:
        if content.startswith(mark):
            return _strictly(path, content[len(mark) :], codec, name), name
    high, low = (content[start::2].count(0) / max(1, len(content) // 2) for start in (1, 0))
    if high > ZEROS > 2 * low:
        return _strictly(path, content, "utf-16-le", "UTF-16"), "UTF-16 without a mark"
    if low > ZEROS > 2 * high:
        return _strictly(path, content, "utf-16-be", "UTF-16"), "UTF-16 without a mark"
    try:
        return content.decode("utf-8"), "UTF-8"
    except UnicodeDecodeError:
        # Latin-1 is this one, less what is no letter.
        return _strictly(path, content, "cp1252", "UTF-8, UTF-16, Latin-1 or Windows-1252"), "Windows-1252"


def _strictly(path: Path, content: bytes, codec: str, name: str) -> str:
    try:
        return content.decode(codec)
    except UnicodeDecodeError as fault:
        raise refuse(
            Place(path), f"no text in {name} (byte {fault.start + 1:,}).", "Save the sheet as 'CSV UTF-8' or XLSX."
        ) from fault


def _announced(text: str) -> tuple[str | None, str]:
    """The separator of a first line such as "sep=;", by which Excel is told, and the text after that line."""
    found = ANNOUNCED.match(text)
    return (None, text) if found is None else (found[1], text[found.end() :])


def _likeliest(text: str) -> str:
    """What divides the most rows into one number of fields."""
    alike = {}
    for mark in SEPARATORS.values():
        try:
            widths = Counter(len(row) for _, row in _fields(text, mark))
        except csv.Error:
            # Quotes that close in the wrong place speak against this one.
            continue
        alike[mark] = max((count for width, count in widths.items() if width > 1), default=0)
    return max(alike, key=alike.__getitem__) if any(alike.values()) else ","


def _fields(text: str, mark: str) -> list[tuple[int, list[str]]]:
    """Numbers and fields of the lines that hold anything. Raises csv.Error."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=mark, strict=True)
    return [(reader.line_num, [field.strip() for field in row]) for row in reader if any(map(str.strip, row))]
