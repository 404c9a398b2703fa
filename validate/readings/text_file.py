"""Read a sheet in a text file: encoding, separator and fields."""

import csv
import io
import re
from collections import Counter
from pathlib import Path

from validate.readings.grid import Cell, Grid, refused
from validate.settings import Separator

SEPARATORS: dict[Separator | None, str] = {"tab": "\t", "semicolon": ";", "comma": ","}
"""Separators in order of preference if two fit equally well: text contains commas, but rarely tabs."""
NAMES = {"\t": "tabs", ";": "semicolons", ",": "commas"}
UTF_16_MARKS = b"\xff\xfe", b"\xfe\xff"
SEPARATOR_LINE = re.compile(r'"?sep=([;,\t])"?[ \t;,]*(?:\r\n|\r|\n|$)', re.IGNORECASE)
"""First line such as "sep=;", which states the separator for Excel."""


def read_text(path: Path, content: bytes, separator: Separator | None) -> Grid:
    """Return the rows of a CSV. The number of a row is that of its line. Raises SheetFaults if it is not a table."""
    text, encoding = _decoded(path, content)
    if "\0" in text:
        finding = "NUL bytes, of a logger that lost power or of UTF-16 without its mark."
        raise refused(path, finding, "Save it as 'CSV UTF-8', and check for lost readings.")
    if (stated := SEPARATOR_LINE.match(text)) is not None:
        text = "\n" + text[stated.end() :]
    mark = SEPARATORS.get(separator) or (stated and stated[1]) or _likeliest(text)
    try:
        lines = _fields(text, mark)
    except csv.Error as fault:
        raise refused(path, f"not a CSV ({fault}).", "Save the sheet as 'CSV UTF-8'.") from fault
    rows = {}
    for line, fields in lines.items():
        within = [each for field in fields for each in field.splitlines()[1:]]
        if any(re.search(rf"[0-9]\s?{mark}\s?[-+.,0-9]", each) for each in within):
            finding = "a quotation mark of an earlier line closes here, and the quoted text contains rows of numbers."
            raise refused(f"{path}, line {line}", finding, "Delete both marks, or the line breaks between them.")
        # Lines may end with a million separators of empty columns.
        width = next(count for count in range(len(fields), 0, -1) if fields[count - 1])
        rows[line] = tuple(map(Cell, fields[:width]))
    return Grid(path, rows, ("CSV", encoding, NAMES[mark]), separator=mark)


def _decoded(path: Path, content: bytes) -> tuple[str, str]:
    """Return the text and the name of its encoding."""
    # Latin-1 is Windows-1252 with control characters in place of some letters.
    possible = {"UTF-8": "utf-8-sig", "Windows-1252": "cp1252"}
    if content.startswith(UTF_16_MARKS):
        possible = {"UTF-16": "utf-16"}
    for name, codec in possible.items():
        try:
            return content.decode(codec), name
        except UnicodeDecodeError:
            continue
    finding = f"not a text in {' or '.join(possible)}."
    raise refused(path, finding, "Save the sheet as 'CSV UTF-8' or XLSX.")


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
