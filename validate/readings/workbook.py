"""Read the worksheets of an XLSX.

Only openpyxl's parser of a single worksheet is used, in one pass. A whole workbook of openpyxl fills merged ranges and
links with cells, loses which cells are formulas, and turns numbers with the format "Standard" into dates.
"""

import io
import math
import re
import zipfile
from collections.abc import Iterator, Sequence
from datetime import date
from itertools import chain
from pathlib import Path
from typing import Any

import openpyxl
from defusedxml.ElementTree import fromstring
from openpyxl.comments.comment_sheet import CommentSheet
from openpyxl.packaging.relationship import get_dependents, get_rels_path
from openpyxl.styles.numbers import BUILTIN_FORMATS, BUILTIN_FORMATS_MAX_SIZE
from openpyxl.utils.cell import coordinate_to_tuple
from openpyxl.utils.escape import unescape
from openpyxl.worksheet._reader import FORMULA_TAG, WorkSheetParser
from openpyxl.xml.constants import COMMENTS_NS

from validate.readings.grid import BLANK, FORMULA, MOST_COLUMNS, Cell, Comment, Grid, quoted

LEFT_TO_OTHERS = b'fullCalcOnLoad="1"'  # Mark of a program that calculates nothing. Excel removes it
HIDDEN = {("hidden", "1"), ("hidden", "true"), ("ht", "0"), ("width", "0")}  # Attributes of rows and columns
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


def read_worksheets(path: Path, archive: zipfile.ZipFile, content: bytes) -> Iterator[Grid]:
    """Yield all worksheets. A damaged file raises errors of any class."""
    # The type stubs lack the attributes of a read-only workbook that its parser uses.
    book: Any = openpyxl.load_workbook(
        io.BytesIO(content), read_only=True, data_only=True, keep_links=False, rich_text=True
    )
    codes = BUILTIN_FORMATS | dict(enumerate(book._number_formats, BUILTIN_FORMATS_MAX_SIZE))
    formats = [codes.get(style.numFmtId, "") for style in book._cell_styles]
    words = {number for number, code in enumerate(formats) if NO_DATE.search(TEXT_OR_COLOUR.sub("", code))}
    dates = book._date_formats - words, book._timedelta_formats - words
    looks = [_look(style, code, book) for style, code in zip(book._cell_styles, formats, strict=True)]
    for source in book.worksheets:
        name, is_hidden = source.title, source.sheet_state != "visible"
        sheet = Grid(path, ("XLSX", f"sheet {quoted(name)}"), sheet=name, is_hidden=is_hidden)
        with source._get_source() as part:
            _fill(sheet, _CellParser(part, source._shared_strings, True, book.epoch, *dates, True), looks)
        sheet.drop_zeros(never_calculated=LEFT_TO_OTHERS in archive.read("xl/workbook.xml"))
        links = get_rels_path(source._worksheet_path)
        for link in get_dependents(archive, links).find(COMMENTS_NS) if links in archive.namelist() else ():
            root: Any = fromstring(archive.read(link.target))
            comments: Any = CommentSheet.from_tree(root)
            for cell, comment in comments.comments:
                row, column = coordinate_to_tuple(cell)
                # Excel begins a comment with its author.
                text = comment.text.strip().removeprefix(f"{comment.author}:").strip()
                sheet.comments.append(Comment(row, column - 1, text))
        yield sheet


def _look(style: Any, code: str, book: Any) -> tuple[str, bool, str]:
    """Return the unit that the format of a style shows, whether the style is struck through, and its colours."""
    font, fill = book._fonts[style.fontId], book._fills[style.fillId]
    behind = SHOWN_BEHIND.search(code.partition(";")[0])
    unit = "" if behind is None else re.sub(r'["\\_]', "", behind[1]).strip()
    colours = font.color, fill.fill_type and getattr(fill, "fgColor", None)
    names = [f"{each.type} {each.value} {each.tint}" for each in colours if each is not None]
    return unit, bool(font.strike), " ".join(name for name in names if not PLAIN.match(name))


def _fill(sheet: Grid, parser: _CellParser, looks: Sequence[tuple[str, bool, str]]) -> None:
    for each in chain.from_iterable(cells for _, cells in parser.parse()):
        value, (unit, is_struck, colours) = each["value"], looks[each["style_id"]]
        cell = _cell(value, each["data_type"], unit)
        if cell != BLANK:
            rich_text = value if isinstance(value, list) else ()
            is_struck = is_struck or any(part.font.strike for part in rich_text if not isinstance(part, str))
            # One column too many is enough for a refusal.
            column = min(each["column"] - 1, MOST_COLUMNS)
            marked = cell._replace(is_formula=each["formula"], is_struck=is_struck, colours=colours)
            sheet.rows.setdefault(each["row"], {})[column] = marked
    sheet.hidden_rows.update(int(row) for row, each in parser.row_dimensions.items() if HIDDEN & each.items())
    for each in parser.column_dimensions.values():
        if HIDDEN & each.items():
            sheet.hidden_columns.update(range(int(each["min"]) - 1, min(int(each["max"]), MOST_COLUMNS)))
    page = getattr(parser, "HeaderFooter", None)
    for name in page.__elements__ if page else ():
        if text := FIELD.sub(" ", str(getattr(page, name))).strip():
            sheet.elsewhere.append(("page header" if "Header" in name else "page footer", text))


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
