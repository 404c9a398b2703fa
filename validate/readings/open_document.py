"""Worksheets of an OpenDocument spreadsheet (ODS), as LibreOffice saves it.

Repeated rows and cells are expanded only up to the size limit of a sheet of readings, and defusedxml refuses entities.
"""

import io
import math
import re
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from validate.readings.sheet import BLANK, MOST_COLUMNS, MOST_ROWS, SAVE_AGAIN, Place, SheetCell, Worksheet, refuse

CONTENT = "content.xml"
LARGEST_CONTENT_BYTES = 32_000_000  # 10,000 rows of 32 numbers take 30 million bytes
MIMETYPE = b"application/vnd.oasis.opendocument.spreadsheet"
OFFICE, TABLE, TEXT, STYLE = (
    f"{{urn:oasis:names:tc:opendocument:xmlns:{name}:1.0}}" for name in ("office", "table", "text", "style")
)
ERROR_TYPE = "{urn:org:documentfoundation:names:experimental:calc:xmlns:calcext:1.0}value-type"
NUMBERS = ("float", "percentage", "currency")
HIDDEN = ("collapse", "filter")
SIZES = ("row-height", "column-width")
NO_SIZE = re.compile(r"0*(?:[.,]0*)?[a-z%]*")  # "0cm", of an invisible row or column
ERROR = re.compile(r"#.*[^\W\d_].*|(?:err|fehler|erreur|error)\s?:\s?[0-9]+", re.IGNORECASE)
"""Text of an error: #DIV/0!, #WERT!, Err:503. In contrast, ### is a number in a column that is too narrow."""
BEHIND = re.compile(r"[-+]?[0-9][0-9.,' \u00a0\u202f]*(\D+)")
"""A displayed number, and the text that its format adds behind it."""


def is_open_document(content: bytes) -> bool:
    """Return whether a zip is an OpenDocument spreadsheet: its first entry is the file type, uncompressed."""
    return MIMETYPE in content[:128]


def read_worksheets(path: Path, content: bytes) -> list[Worksheet]:
    """Return all worksheets. Raises SheetFaults for a file that is damaged, or larger than a sheet of readings."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size_bytes = archive.getinfo(CONTENT).file_size
            if size_bytes > LARGEST_CONTENT_BYTES:
                limit = f"the limit is {LARGEST_CONTENT_BYTES / 1e6:.0f} MB."
                finding = f"the workbook has {size_bytes / 1e6:.0f} MB when it is unpacked; {limit}"
                raise refuse(Place(path), finding, "Remove other tables from it, or save it as CSV.")
            root = fromstring(archive.read(CONTENT))
        hidden, struck, flat = set[str](), set[str](), set[str]()
        for style in root.iter(f"{STYLE}style"):
            name = style.get(f"{STYLE}name", "")
            hidden |= {name for each in style if each.get(f"{TABLE}display") == "false"}
            sizes = [each.get(f"{STYLE}{size}") for each in style for size in SIZES]
            flat |= {name for size in sizes if size is not None and NO_SIZE.fullmatch(size)}
            struck |= {name for each in style if each.get(f"{STYLE}text-line-through-style", "none") != "none"}
        tables = root.findall(f"{OFFICE}body/{OFFICE}spreadsheet/{TABLE}table")
        return [_sheet(table, table.get(f"{TABLE}style-name") in hidden, struck, flat) for table in tables]
    except (
        zipfile.BadZipFile, KeyError, ParseError, DefusedXmlException, zlib.error, EOFError, ValueError,
        NotImplementedError, RuntimeError,
    ) as fault:  # fmt: skip
        finding = f"damaged, or not an ODS ({type(fault).__name__}: {str(fault)[:100]!r})."
        raise refuse(Place(path), finding, SAVE_AGAIN) from fault


def _sheet(table: Element, hidden: bool, struck: set[str], flat: set[str]) -> Worksheet:
    sheet = Worksheet(table.get(f"{TABLE}name", ""), hidden)
    number = column = 0
    for each in _below(table, "table-column"):
        times = min(_count(each, "number-columns-repeated"), MOST_COLUMNS)
        if _is_hidden(each, flat):
            sheet.hidden_columns |= set(range(column, column + times))
        column += times
    for row in _below(table, "table-row"):
        times = _count(row, "number-rows-repeated")
        for column, cell in _cells(row):
            if (value := _value(cell)) != BLANK:
                is_struck, formula = cell.get(f"{TABLE}style-name") in struck, cell.get(f"{TABLE}formula") is not None
                sheet.put(number + 1, column, value, is_struck, _shown_unit(cell), formula)
            down, across = (_count(cell, f"number-{what}-spanned") for what in ("rows", "columns"))
            if (down, across) != (1, 1):
                sheet.merged.append((number + 1, column, number + down, column + across - 1))
        if cells := sheet.rows.get(number + 1):
            if _is_hidden(row, flat):
                sheet.hidden_rows.add(number + 1)
            # One row too many is enough for a refusal.
            last = number + min(times, MOST_ROWS + 2 - len(sheet.rows))
            sheet.rows |= dict.fromkeys(range(number + 1, last + 1), cells)
        number += times
    sheet.drop_zeros(never_calculated=False)
    return sheet


def _is_hidden(element: Element, flat: set[str]) -> bool:
    return element.get(f"{TABLE}visibility") in HIDDEN or element.get(f"{TABLE}style-name") in flat


def _below(element: Element, tag: str) -> Iterator[Element]:
    """Yield the rows or columns of a table, including grouped ones, but not those of tables within its cells."""
    for each in element:
        if each.tag == f"{TABLE}{tag}":
            yield each
        elif each.tag != f"{TABLE}table-row":
            yield from _below(each, tag)


def _count(element: Element, name: str) -> int:
    return max(1, int(element.get(f"{TABLE}{name}", "1")[:9]))


def _cells(row: Element) -> Iterator[tuple[int, Element]]:
    """Yield the cells of a row with their columns, including repeated cells, up to one beyond the column limit."""
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
    text = "\n".join(_lines(cell)).strip()
    # Excel, and OpenOffice up to 3, save an error as the number 0 with its text.
    if cell.get(ERROR_TYPE) == "error" or (kind in NUMBERS and ERROR.fullmatch(text)):
        return SheetCell(text or "an error", "error")
    if kind in NUMBERS and value is not None:
        finite = math.isfinite(number := float(value))
        return SheetCell(f"{number:.15g}", "number") if finite else SheetCell(value, "error")
    if kind in ("date", "time"):
        return SheetCell(text or cell.get(f"{OFFICE}date-value", ""), "date")
    if kind == "boolean":
        return SheetCell(cell.get(f"{OFFICE}boolean-value", "").upper(), "truth")
    if kind is None and cell.get(f"{TABLE}formula") is not None:
        return SheetCell("", "formula")
    if (text.startswith("#") and cell.get(f"{TABLE}formula") is not None) or text.startswith("Err:"):
        return SheetCell(text, "error")
    return SheetCell(text or cell.get(f"{OFFICE}string-value", "").strip())


def _shown_unit(cell: Element) -> str:
    """Return the text that a number's format shows behind it, such as "cm" or "%", or "" if there is none."""
    if cell.get(f"{OFFICE}value-type") == "percentage":
        return "%"
    shown = BEHIND.fullmatch("".join(_lines(cell)).strip())
    return "" if shown is None else shown[1].strip()


def _lines(cell: Element) -> Iterator[str]:
    return ("".join(line.itertext()) for line in cell.findall(f"{TEXT}p"))
