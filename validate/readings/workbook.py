"""Read the named worksheet of a workbook (XLSX or ODS), or the only worksheet with content.

Only openpyxl's parser of a single worksheet is used, in one pass: loading a whole workbook would include pictures and
fill merged ranges with cells, and a read-only workbook reports neither merged cells nor hidden rows.
"""

import io
import math
import re
import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import openpyxl
from openpyxl.styles.numbers import BUILTIN_FORMATS, BUILTIN_FORMATS_MAX_SIZE
from openpyxl.utils.escape import unescape
from openpyxl.worksheet._reader import FORMULA_TAG, WorkSheetParser

from validate.readings.header_words import is_number
from validate.readings.open_document import is_open_document, read_worksheets
from validate.readings.sheet import (
    BLANK,
    MOST_COLUMNS,
    MOST_ROWS,
    SAVE_AGAIN,
    Place,
    SheetCell,
    SheetGrid,
    Worksheet,
    quoted,
    refuse,
    shown,
)
from validate.units import counted

LARGEST_UNPACKED_BYTES = 32_000_000  # Limit on all parts together: 10,000 rows of 32 numbers take 13 million bytes
WORKBOOK = "xl/workbook.xml"  # Part of an XLSX about the workbook as a whole
HIDDEN = ("1", "true")
CALCULATES_ON_LOAD = re.compile(rb"<(?:\w+:)?calcPr\b[^>]*\bfullCalcOnLoad\s*=\s*[\"'](?:1|true)")
"""Mark of a program that calculates nothing and leaves that to the program that opens the file. Excel removes the
mark."""
NO_DATE = re.compile(r"[^\W\d_dmyhsapegbjtcrw]", re.IGNORECASE)
"""A letter that no date format contains. Words for "General" in other languages, such as "Standard", contain one."""
TEXT_OR_COLOUR = re.compile(r'"[^"]*"|\[[^\]]*\]|\\.')
SHOWN_BEHIND = re.compile(r'[0#?]\s*((?:"[^"]*"|\\.|[\s_]|%|mm|cm)+)$')
"""Text, quoted or letter by letter, that a format shows behind a number."""


class _CellParser(WorkSheetParser):
    """openpyxl's parser, which additionally marks formulas without a stored result."""

    def parse_cell(self, element: Element) -> dict[str, Any]:
        cell = super().parse_cell(element)
        # A formula whose result is an empty text has t="str".
        if cell["value"] is None and element.get("t") != "str" and element.find(FORMULA_TAG) is not None:
            cell["data_type"] = "f"
        cell["formula"] = element.find(FORMULA_TAG) is not None
        return cell


def read_sheet(path: Path, content: bytes, wanted: str | None) -> SheetGrid:
    """Return the sheet ``wanted``, or the only visible one with content. Raises SheetFaults."""
    sheets, program = _worksheets(path, content, wanted)
    filled = [sheet for sheet in sheets if sheet.rows]
    visible = [sheet for sheet in filled if not sheet.hidden]
    chosen = visible if wanted is None else [sheet for sheet in sheets if sheet.name == wanted]
    if len(chosen) > 1 and len(tables := [sheet for sheet in chosen if _has_table(sheet)]) == 1:
        # Ignore sheets without a table: a cover, or texts of a diagram.
        chosen = tables
    if len(chosen) == 1:
        return chosen[0].grid(path, program, _remarks(chosen[0], sheets))
    if wanted is not None:
        finding, named = f"has no sheet {quoted(wanted)}, only", sheets
    elif visible:
        finding, named = f"{len(visible)} sheets have content:", visible
    elif filled:
        finding, named = "all sheets with content are hidden:", filled
    else:
        finding = "has no rows of readings: all its sheets are empty, or saved as Strict Open XML."
        raise refuse(Place(path), finding, "Save it with its cells as an ordinary XLSX.")
    names = ", ".join(quoted(sheet.name) for sheet in named[:12]) + (", …" if len(named) > 12 else "")
    remedy = "Name the sheet with the readings in [readings] sheet, or in pairing.csv."
    raise refuse(Place(path), f"{finding} {names}.", remedy, wanted)


def read_sheets(path: Path, content: bytes) -> tuple[SheetGrid, ...]:
    """Return all visible sheets with content. Raises SheetFaults."""
    sheets, program = _worksheets(path, content, None)
    return tuple(
        sheet.grid(path, program, _remarks(sheet, sheets)) for sheet in sheets if sheet.rows and not sheet.hidden
    )


def _worksheets(path: Path, content: bytes, wanted: str | None) -> tuple[list[Worksheet], str]:
    """Return all worksheets and the file's format. Of an XLSX, only the ``wanted`` sheet is read if one is given."""
    if is_open_document(content):
        return read_worksheets(path, content), "ODS"
    with _refused(path):
        archive = zipfile.ZipFile(io.BytesIO(content))
    unpacked_bytes = sum(entry.file_size for entry in archive.infolist())
    if unpacked_bytes > LARGEST_UNPACKED_BYTES:
        limit = f"the limit is {LARGEST_UNPACKED_BYTES / 1e6:.0f} MB."
        finding = f"the workbook has {unpacked_bytes / 1e6:.0f} MB when it is unpacked; {limit}"
        raise refuse(Place(path), finding, "Remove pictures and other tables from it, or save it as CSV.")
    if "[Content_Types].xml" not in archive.namelist():
        raise refuse(Place(path), "a zip file, but not an XLSX.", SAVE_AGAIN)
    with _refused(path):
        # The type stubs lack the attributes of a read-only workbook that its parser uses.
        book: Any = openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True, keep_links=False)
        fonts = [book._fonts[style.fontId] for style in book._cell_styles]
        formats = [_format(style.numFmtId, book._number_formats) for style in book._cell_styles]
        part = archive.read(WORKBOOK) if WORKBOOK in archive.namelist() else b""
        never_calculated = CALCULATES_ON_LOAD.search(part) is not None
    words = {number for number, code in enumerate(formats) if NO_DATE.search(TEXT_OR_COLOUR.sub("", code))}
    units = {number: unit for number, code in enumerate(formats) if (unit := _unit_behind(code))}
    struck = {number for number, font in enumerate(fonts) if getattr(font, "strike", False)}
    sheets = [Worksheet(source.title, source.sheet_state != "visible") for source in book.worksheets]
    for sheet, source in zip(sheets, book.worksheets, strict=True):
        if wanted in (None, sheet.name):
            with _refused(path), source._get_source() as part:
                dates, durations = set(book._date_formats) - words, set(book._timedelta_formats) - words
                parser = _CellParser(part, source._shared_strings, True, book.epoch, dates, durations)
                _fill(sheet, parser, struck, units)
                sheet.drop_zeros(never_calculated=never_calculated)
    return sheets, "XLSX"


def _format(number: int, own: Sequence[str]) -> str:
    """Return the code of a number format."""
    beyond = number - BUILTIN_FORMATS_MAX_SIZE
    return BUILTIN_FORMATS.get(number, "") if beyond < 0 else own[beyond] if beyond < len(own) else ""


def _unit_behind(code: str) -> str:
    """Return the text that a format shows behind a number, such as "cm" or "%", or "" if there is none."""
    behind = SHOWN_BEHIND.search(code.partition(";")[0])
    return "" if behind is None else re.sub(r'["\\_]', "", behind[1]).strip()


def _fill(sheet: Worksheet, parser: _CellParser, struck: set[int], units: Mapping[int, str]) -> None:
    for _, cells in parser.parse():
        for each in cells:
            cell = _cell(each["value"], each["data_type"])
            if cell != BLANK:
                # One column too many is enough for a refusal.
                column = min(each["column"] - 1, MOST_COLUMNS)
                style = int(each["style_id"])
                sheet.put(each["row"], column, cell, style in struck, units.get(style, ""), each["formula"])
        if len(sheet.rows) > MOST_ROWS:
            break
    for cells in parser.merged_cells.mergeCell if parser.merged_cells else ():
        sheet.merged.append((cells.min_row, cells.min_col - 1, cells.max_row, cells.max_col - 1))
    sheet.hidden_rows = {int(row) for row, one in parser.row_dimensions.items() if _is_hidden(one, "ht")}
    for one in parser.column_dimensions.values():
        if _is_hidden(one, "width"):
            sheet.hidden_columns |= set(range(int(one["min"]) - 1, min(int(one["max"]), MOST_COLUMNS)))


def _is_hidden(dimension: Mapping[str, Any], size: str) -> bool:
    return dimension.get("hidden") in HIDDEN or float(dimension.get(size) or 1) == 0


@contextmanager
def _refused(path: Path) -> Iterator[None]:
    """Refuse a file that openpyxl or zipfile cannot read; damaged files raise errors of any class."""
    try:
        with warnings.catch_warnings():
            # openpyxl warns about skipped styles and extensions, which contain no readings.
            warnings.simplefilter("ignore")
            yield
    except Exception as fault:
        cause = fault.__cause__ or fault
        finding = f"damaged, or not an XLSX ({type(cause).__name__}: {shown(str(cause))})."
        raise refuse(Place(path), finding, SAVE_AGAIN) from fault


def _cell(value: Any, data_type: str) -> SheetCell:
    if data_type == "f":
        return SheetCell("", "formula")
    if value is None:
        return BLANK
    if data_type == "e":
        return SheetCell(value.strip(), "error")
    if isinstance(value, bool):
        return SheetCell(str(value).upper(), "truth")
    if isinstance(value, int | float):
        return SheetCell(f"{value:.15g}", "number" if math.isfinite(value) else "error")
    if isinstance(value, date):
        return SheetCell(f"{value:%Y-%m-%d %H:%M}".removesuffix(" 00:00"), "date")
    return SheetCell(unescape(str(value)).strip(), "date" if data_type == "d" else "text")


def _has_table(sheet: Worksheet) -> bool:
    rows = (
        sum(cell.kind in ("number", "formula") or is_number(cell.text) for cell in row.values())
        for row in sheet.rows.values()
    )
    return sum(numbers > 1 for numbers in rows) > 1


def _remarks(chosen: Worksheet, sheets: Sequence[Worksheet]) -> list[str]:
    remarks = ["this sheet is hidden"] if chosen.hidden else []
    if chosen.hidden_rows or chosen.hidden_columns:
        hidden = counted(len(chosen.hidden_rows), "hidden row"), counted(len(chosen.hidden_columns), "hidden column")
        remarks.append(f"{' and '.join(hidden)} are read too")
    if unread := [sheet for sheet in sheets if sheet.hidden and sheet.rows and sheet is not chosen]:
        remarks.append(f"{counted(len(unread), 'hidden sheet')} ignored")
    return remarks
