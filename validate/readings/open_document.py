"""Worksheets of an OpenDocument spreadsheet (ODS), as LibreOffice saves it.

Its one part with cells is read in one pass: repeated rows and cells are counted, never unrolled beyond what a sheet of
readings holds, and entities are refused by defusedxml.
"""

import io
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import iterparse

from validate.readings.sheet import BLANK, MOST_COLUMNS, MOST_ROWS, SAVE_AGAIN, Place, SheetCell, refuse

CONTENT = "content.xml"
LARGEST_CONTENT_BYTES = 32_000_000  # 10,000 rows of 32 numbers take 30 million bytes
MIMETYPE = b"application/vnd.oasis.opendocument.spreadsheet"
OFFICE, TABLE, TEXT, STYLE = (
    f"{{urn:oasis:names:tc:opendocument:xmlns:{name}:1.0}}" for name in ("office", "table", "text", "style")
)
NUMBERS = ("float", "percentage", "currency")


@dataclass
class Worksheet:
    """One sheet of a workbook: its cells, and what is known of them."""

    name: str
    hidden: bool
    rows: dict[int, dict[int, SheetCell]] = field(default_factory=dict)
    """Rows by number from 1, their cells by column from 0; blank cells are left out."""
    merged: tuple[tuple[int, int, int, int], ...] = ()  # Merged ranges as in ``SheetGrid``
    struck: frozenset[tuple[int, int]] = frozenset()
    hidden_rows: frozenset[int] = frozenset()
    hidden_columns: frozenset[int] = frozenset()


def is_open_document(content: bytes) -> bool:
    """Return whether a zip is an OpenDocument spreadsheet: such a file begins with its type, stored as it is."""
    return MIMETYPE in content[:128]


def read_worksheets(path: Path, content: bytes) -> list[Worksheet]:
    """Return all worksheets. Raises SheetFaults for a damaged file, or one of more than a sheet of readings holds."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size_bytes = archive.getinfo(CONTENT).file_size
            if size_bytes > LARGEST_CONTENT_BYTES:
                found = f"unpacks to {size_bytes:,} bytes; at most {LARGEST_CONTENT_BYTES:,} are read."
                raise refuse(Place(path), found, "Take other tables out of it, or save it as CSV.")
            with archive.open(CONTENT) as part:
                return list(_sheets(iterparse(part, events=("start", "end"))))
    except (
        zipfile.BadZipFile, KeyError, ParseError, DefusedXmlException, zlib.error, EOFError, ValueError,
        NotImplementedError, RuntimeError,
    ) as fault:  # fmt: skip
        found = f"damaged, or no ODS ({type(fault).__name__}: {str(fault)[:100]!r})."
        raise refuse(Place(path), found, SAVE_AGAIN) from fault


def _sheets(events: Iterator[tuple[str, Element]]) -> Iterator[Worksheet]:
    """Yield the sheets; each row is dropped from memory once it is read."""
    hidden_styles, struck_styles = set[str](), set[str]()
    sheet: Worksheet | None = None
    row_number = column_number = depth = 0
    merged, struck, hidden_rows, hidden_columns = (
        list[tuple[int, int, int, int]](),
        set[tuple[int, int]](),
        set[int](),
        set[int](),
    )
    for event, element in events:
        if event == "start" and element.tag == f"{TABLE}table":
            # A table within a cell is part of that cell.
            depth += 1
            if depth == 1:
                name, style = element.get(f"{TABLE}name", ""), element.get(f"{TABLE}style-name")
                sheet, row_number, column_number = Worksheet(name, style in hidden_styles), 0, 0
                merged, struck, hidden_rows, hidden_columns = [], set(), set(), set()
        if event == "start" or depth > 1:
            depth -= event == "end" and element.tag == f"{TABLE}table"
            continue
        match element.tag.removeprefix(TABLE):
            case "table" if sheet is not None:
                depth -= 1
                sheet.merged, sheet.struck = tuple(merged), frozenset(struck)
                sheet.hidden_rows, sheet.hidden_columns = frozenset(hidden_rows), frozenset(hidden_columns)
                yield sheet
                sheet = None
                element.clear()
            case "table-column" if sheet is not None:
                times = min(_count(element, "number-columns-repeated"), MOST_COLUMNS)
                if element.get(f"{TABLE}visibility") in ("collapse", "filter"):
                    hidden_columns |= set(range(column_number, column_number + times))
                column_number += times
            case "table-row" if sheet is not None:
                times, cells = _count(element, "number-rows-repeated"), dict[int, SheetCell]()
                for column, cell in _cells(element):
                    value = _value(cell)
                    if value != BLANK:
                        cells[column] = value
                        if cell.get(f"{TABLE}style-name") in struck_styles:
                            struck.add((row_number + 1, column))
                    down, across = (_count(cell, f"number-{what}-spanned") for what in ("rows", "columns"))
                    if (down, across) != (1, 1):
                        merged.append((row_number + 1, column, row_number + down, column + across - 1))
                if element.get(f"{TABLE}visibility") in ("collapse", "filter") and cells:
                    hidden_rows.add(row_number + 1)
                # One row too many is enough for a refusal.
                for number in range(row_number + 1, row_number + 1 + min(times, MOST_ROWS + 1 - len(sheet.rows))):
                    if cells:
                        sheet.rows[number] = cells
                row_number += times
                element.clear()
            case _:
                if element.tag == f"{STYLE}style":
                    name = element.get(f"{STYLE}name", "")
                    for properties in element:
                        if properties.get(f"{TABLE}display") == "false":
                            hidden_styles.add(name)
                        if properties.get(f"{STYLE}text-line-through-style", "none") != "none":
                            struck_styles.add(name)


def _count(element: Element, name: str) -> int:
    return max(1, int(element.get(f"{TABLE}{name}", "1")[:9]))


def _cells(row: Element) -> Iterator[tuple[int, Element]]:
    """Yield the cells of a row with their columns, repeated ones too, and one beyond the most that are read."""
    column = 0
    for cell in row:
        if cell.tag not in (f"{TABLE}table-cell", f"{TABLE}covered-table-cell"):
            continue
        times = _count(cell, "number-columns-repeated")
        for at in range(column, min(column + times, MOST_COLUMNS + 1)):
            yield at, cell
        column += times


def _value(cell: Element) -> SheetCell:
    kind, value = cell.get(f"{OFFICE}value-type"), cell.get(f"{OFFICE}value")
    text = "\n".join("".join(line.itertext()) for line in cell.findall(f"{TEXT}p")).strip()
    if kind in NUMBERS and value is not None:
        return SheetCell(f"{float(value):.15g}", "number")
    if kind in ("date", "time"):
        return SheetCell(text or cell.get(f"{OFFICE}date-value", ""), "date")
    if kind == "boolean":
        return SheetCell(cell.get(f"{OFFICE}boolean-value", "").upper(), "truth")
    if kind is None and cell.get(f"{TABLE}formula") is not None:
        return SheetCell("", "formula")
    if (text.startswith("#") and cell.get(f"{TABLE}formula") is not None) or text.startswith("Err:"):
        return SheetCell(text, "error")
    return SheetCell(text)
