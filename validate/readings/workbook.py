"""Read the worksheets of an XLSX.

Only openpyxl's parser of a single worksheet is used, in one pass. A whole workbook of openpyxl fills merged ranges and
links with cells, loses which cells are formulas, and turns numbers with the format "Standard" into dates.
"""

import io
import math
import re
import zipfile
from collections.abc import Iterator
from datetime import date
from typing import Any

import openpyxl
from defusedxml.ElementTree import fromstring
from openpyxl.packaging.relationship import get_dependents, get_rels_path
from openpyxl.styles.numbers import BUILTIN_FORMATS, BUILTIN_FORMATS_MAX_SIZE
from openpyxl.utils.cell import coordinate_to_tuple
from openpyxl.utils.escape import unescape
from openpyxl.worksheet._reader import FORMULA_TAG, WorkSheetParser
from openpyxl.xml.constants import COMMENTS_NS

from validate.readings.grid import BLANK, MOST_COLUMNS, Cell, Mark
from validate.readings.worksheets import FORMULA, Entry, Worksheet

WORKBOOK = "xl/workbook.xml"  # Part of an XLSX about the workbook as a whole
CALCULATES_ON_LOAD = re.compile(rb"<(?:\w+:)?calcPr\b[^>]*\bfullCalcOnLoad\s*=\s*[\"'](?:1|true)")
"""Mark of a program that calculates nothing and leaves that to the program that opens the file. Excel removes the
mark."""
NO_DATE = re.compile(r"[^\W\d_dmyhsapegbjtcrw]", re.IGNORECASE)
"""A letter that no date format contains. Words for "General" in other languages, such as "Standard", contain one."""
TEXT_OR_COLOUR = re.compile(r'"[^"]*"|\[[^\]]*\]|\\.')
SHOWN_BEHIND = re.compile(r'[0#?]\s*((?:"[^"]*"|\\.|[\s_]|%|mm|cm)+)$')
"""Text, quoted or letter by letter, that a format shows behind a number."""
PLAIN = re.compile(r"rgb ..(?:000000|FFFFFF)|theme [01] 0\.0|indexed (?:0|1|8|9|6\d) |auto")
"""Colours that are black, white or automatic, with their tint."""
FIELD = re.compile(r'&(?:"[^"]*"|\d+ ?|K[0-9A-F]{6}|[A-Z])')  # Font, place or field of a page header, such as &P


class _CellParser(WorkSheetParser):
    """openpyxl's parser, which additionally marks formulas, and those without a stored result."""

    def parse_cell(self, element: Any) -> dict[str, Any]:
        cell = super().parse_cell(element)
        cell["formula"] = element.find(FORMULA_TAG) is not None
        # A formula whose result is an empty text has t="str".
        if cell["formula"] and cell["value"] is None and element.get("t") != "str":
            cell["data_type"] = "f"
        return cell


def read_worksheets(archive: zipfile.ZipFile, content: bytes) -> Iterator[Worksheet]:
    """Yield all worksheets. A damaged file raises errors of any class."""
    # The type stubs lack the attributes of a read-only workbook that its parser uses.
    book: Any = openpyxl.load_workbook(
        io.BytesIO(content), read_only=True, data_only=True, keep_links=False, rich_text=True
    )
    parts = archive.namelist()
    never_calculated = WORKBOOK in parts and CALCULATES_ON_LOAD.search(archive.read(WORKBOOK)) is not None
    codes = BUILTIN_FORMATS | dict(enumerate(book._number_formats, BUILTIN_FORMATS_MAX_SIZE))
    words, looks = set[int](), dict[int, tuple[str, bool, str]]()
    for number, style in enumerate(book._cell_styles):
        code = codes.get(style.numFmtId, "")
        if NO_DATE.search(TEXT_OR_COLOUR.sub("", code)):
            words.add(number)
        behind = SHOWN_BEHIND.search(code.partition(";")[0])
        unit = "" if behind is None else re.sub(r'["\\_]', "", behind[1]).strip()
        font = book._fonts[style.fontId]
        looks[number] = unit, bool(font.strike), _colours(font, book._fills[style.fillId])
    for source in book.worksheets:
        sheet = Worksheet(source.title, source.sheet_state != "visible")
        dates = set(book._date_formats) - words, set(book._timedelta_formats) - words
        with source._get_source() as part:
            _fill(sheet, _CellParser(part, source._shared_strings, True, book.epoch, *dates, True), looks)
        sheet.drop_zeros(never_calculated=never_calculated)
        links = get_rels_path(source._worksheet_path)
        for link in get_dependents(archive, links).find(COMMENTS_NS) if links in parts else ():
            sheet.comments += _comments(archive.read(link.target))
        yield sheet


def _colours(font: Any, fill: Any) -> str:
    """Return the colours of font and fill that are neither black, white nor automatic."""
    colours = {"fill": fill.fill_type and getattr(fill, "fgColor", None), "font": font.color}
    names = {what: f"{each.type} {each.value} {each.tint}" for what, each in colours.items() if each is not None}
    return ", ".join(f"{what} {name}" for what, name in names.items() if not PLAIN.match(name))


def _fill(sheet: Worksheet, parser: _CellParser, looks: dict[int, tuple[str, bool, str]]) -> None:
    for _, cells in parser.parse():
        for each in cells:
            value = each["value"]
            unit, struck, colours = looks.get(each["style_id"], ("", False, ""))
            cell = _cell(value, each["data_type"], unit)
            if cell != BLANK:
                if isinstance(value, list):  # Rich text
                    struck = struck or any(part.font.strike for part in value if not isinstance(part, str))
                # One column too many is enough for a refusal.
                column = min(each["column"] - 1, MOST_COLUMNS)
                sheet.rows.setdefault(each["row"], {})[column] = Entry(cell, each["formula"], struck, colours)
    for cells in parser.merged_cells.mergeCell if parser.merged_cells else ():
        sheet.merged.append((cells.min_row, cells.min_col - 1, cells.max_row, cells.max_col - 1))
    sheet.hidden_rows = {int(row) for row, each in parser.row_dimensions.items() if _is_hidden(each, "ht")}
    for each in parser.column_dimensions.values():
        if _is_hidden(each, "width"):
            sheet.hidden_columns |= set(range(int(each["min"]) - 1, min(int(each["max"]), MOST_COLUMNS)))
    page = getattr(parser, "HeaderFooter", None)
    for name in page.__elements__ if page else ():
        if text := FIELD.sub(" ", str(getattr(page, name))).strip():
            sheet.on_page.append(("page header" if "Header" in name else "page footer", text))


def _is_hidden(dimension: dict[str, Any], size: str) -> bool:
    return dimension.get("hidden") in ("1", "true") or float(dimension.get(size) or 1) == 0


def _cell(value: Any, data_type: str, unit: str) -> Cell:
    if data_type == "f":
        return FORMULA
    if value is None:
        return BLANK
    if data_type == "e":
        return Cell(value.strip(), "error")
    if isinstance(value, bool):
        return Cell(str(value).upper(), "truth")
    if isinstance(value, int | float):
        return Cell(f"{value:.15g}", "number" if math.isfinite(value) else "error", unit)
    if isinstance(value, date):
        return Cell(f"{value:%Y-%m-%d %H:%M}".removesuffix(" 00:00"), "date")
    return Cell(unescape(str(value)).strip(), "date" if data_type == "d" else "text")


def _comments(content: bytes) -> Iterator[Mark]:
    """Yield the comments of a sheet without the name of their author, with which Excel begins them."""
    root = fromstring(content)
    authors = [author.text for author in root.findall(".//{*}author")]
    for comment in root.findall(".//{*}comment"):
        row, column = coordinate_to_tuple(comment.get("ref", ""))
        text = "".join(comment.itertext()).strip().removeprefix(f"{authors[int(comment.get('authorId', 0))]}:")
        yield Mark(row, column - 1, "comment", text.strip())
