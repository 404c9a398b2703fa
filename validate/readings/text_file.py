"""Read a sheet in a text file: encoding, separator and fields."""

import csv
import io
import re
from collections import Counter
from pathlib import Path

from sealtwin.core.errors import as_text
from validate.readings.grid import Cell, Grid, refused
from validate.readings.numbers import number
from validate.settings import Separator

SEPARATORS: dict[Separator | None, str] = {"tab": "\t", "semicolon": ";", "comma": ","}
"""Separators in order of preference if two fit equally well: text contains commas, but rarely tabs."""
NAMES = {"\t": "tabs", ";": "semicolons", ",": "commas"}
BYTE_ORDER_MARKS = {b"\xff\xfe\x00\x00": "UTF-32", b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}
SEPARATOR_LINE = re.compile(r'"?sep=([;,\t])"?[ \t;,]*(?:\r\n|\r|\n|$)', re.IGNORECASE)
"""First line such as "sep=;", which states the separator for Excel."""
LOST_LINE = re.compile(r"^\0+\s*$", re.MULTILINE)
ZEROS = 0.5
"""Share of zero bytes above which they are the high bytes of UTF-16. In European scripts nearly all of these are
zero."""


def read_text(path: Path, content: bytes, separator: Separator | None) -> Grid:
    """Return the rows of a CSV. The number of a row is that of its line. Raises SheetFaults if it is not a table."""
    text, encoding = _decoded(path, content)
    if (lost := LOST_LINE.search(text)) is not None:
        line = 1 + text.count("\n", 0, lost.start())
        finding = "NUL bytes, which a logger writes when it loses power."
        raise refused(f"{as_text(path)}, line {line}", finding, "Delete them, and check for lost readings.")
    if (stated := SEPARATOR_LINE.match(text)) is not None:
        text = "\n" + text[stated.end() :]
    mark = SEPARATORS.get(separator) or (stated and stated[1]) or _likeliest(text)
    try:
        lines = _fields(text, mark)
    except csv.Error as fault:
        raise refused(as_text(path), f"not a CSV ({fault}).", "Save the sheet as 'CSV UTF-8'.") from fault
    rows = {}
    for line, fields in lines.items():
        if any(_contains_rows(field, mark) for field in fields):
            place = f"{as_text(path)}, line {line}"
            finding = "a quotation mark of an earlier line closes here, and the quoted text contains rows of numbers."
            raise refused(place, finding, "Delete both marks, or the line breaks between them.")
        # Lines may end with a million separators of empty columns.
        width = next(count for count in range(len(fields), 0, -1) if fields[count - 1])
        rows[line] = tuple(map(Cell, fields[:width]))
    return Grid(path, rows, ("CSV", encoding, NAMES[mark]), separator=mark)


def _decoded(path: Path, content: bytes) -> tuple[str, str]:
    """Return the text and the name of its encoding."""
    high, low = (content[start::2].count(0) for start in (1, 0))
    # Latin-1 is Windows-1252 with control characters in place of some letters.
    possible = {"UTF-8": "utf-8-sig", "Windows-1252": "cp1252"}
    if marked := next((name for mark, name in BYTE_ORDER_MARKS.items() if content.startswith(mark)), None):
        possible = {marked: marked}
    elif max(high, low) > ZEROS * len(content) / 2 > 2 * min(high, low):
        possible = {"UTF-16 without a mark": "utf-16-le" if high > low else "utf-16-be"}
    for name, codec in possible.items():
        try:
            return content.decode(codec), name
        except UnicodeDecodeError:
            continue
    finding = f"not a text in {' or '.join(possible)}."
    raise refused(as_text(path), finding, "Save the sheet as 'CSV UTF-8' or XLSX.")


def _likeliest(text: str) -> str:
    """Return the separator that splits the most rows into the same number of fields."""
    alike = {}
    for mark in SEPARATORS.values():
        try:
            widths = Counter(map(len, _fields(text, mark).values()))
        except csv.Error:
            # Wrongly closed quotes exclude this separator.
            continue
        alike[mark] = max((count for width, count in widths.items() if width > 1), default=0)
    return max(alike, key=alike.__getitem__) if any(alike.values()) else ","


def _fields(text: str, mark: str) -> dict[int, list[str]]:
    """Return the fields of lines with content by line number. Raises csv.Error with the line where a row begins."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=mark, strict=True)
    lines, begins = {}, 1
    try:
        for row in reader:
            if any(map(str.strip, row)):
                lines[reader.line_num] = [field.strip() for field in row]
            begins = reader.line_num + 1
    except csv.Error as fault:
        raise csv.Error(f"{fault}: is a quotation mark of line {begins} not closed?") from fault
    return lines


def _contains_rows(field: str, mark: str) -> bool:
    """Return whether a quoted field has, after its first line, a line with two or more numbers."""
    lines = field.splitlines()[1:]
    return any(sum(number(part.strip()) is not None for part in line.split(mark)) > 1 for line in lines)
