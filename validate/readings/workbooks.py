"""Read the worksheets of an XLSX.

From openpyxl, only the parser of a single worksheet is used, in one pass. Opening a whole workbook with openpyxl would
fill merged ranges and links with cells, lose which cells are formulas, and turn numbers with the format "Standard" into
dates. defusedxml refuses entities.
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
from openpyxl.utils.cell import coordinate_to_tuple, range_boundaries
from openpyxl.utils.escape import unescape
from openpyxl.worksheet._reader import FORMULA_TAG, WorkSheetParser
from openpyxl.xml.constants import COMMENTS_NS

from validate.readings.grid import MAX_COLUMNS, Cell, Grid, Kind, quoted

LEFT_TO_OTHERS = b'fullCalcOnLoad="1"'  # Mark of a program that does not calculate formulas. Excel removes it.
HIDDEN = {("hidden", "1"), ("hidden", "true"), ("ht", "0"), ("width", "0")}  # Attributes of hidden cells
NO_DATE = re.compile(r"[^\W\d_dmyhsapegbjtcrw]", re.IGNORECASE)
"""A letter that no date format contains. Words for "General" in other languages contain one, for example "Standard"."""
TEXT_OR_COLOUR = re.compile(r'"[^"]*"|\[[^\]]*\]|\\.')
SHOWN_TEXT = re.compile(r'(?:[0#?]\s*|^)((?:"[^"]*"|\\.|[\s_]|%|mm|cm)+)(?=$|[0#?])')
"""Text that a format shows in front of a number or behind it, either quoted or letter by letter."""
PLAIN = re.compile(
    r"\w+ (?:rgb ..000000|theme 1 0\.0|indexed (?:[08]|6\d) |auto)|fill (?:rgb ..FFFFFF|theme 0 0\.0|indexed [19] )"
)
"""Usual colours with their tint: black, automatic, and white for a fill. White as a font's colour hides a number."""
FIELD = re.compile(r'&(?:"[^"]*"|\d+ ?|K[0-9A-F]{6}|[A-Z])')  # Font, position or field of a page header, such as &P


class _CellParser(WorkSheetParser):
    """The parser of openpyxl, extended to mark formulas, and formulas without a stored result."""

    def parse_cell(self, element: Any) -> dict[str, Any]:
        cell = super().parse_cell(element)
        cell["formula"] = element.find(FORMULA_TAG) is not None
        # A formula whose result is an empty text has t="str".
        if cell["formula"] and cell["value"] is None and element.get("t") != "str":
            cell["data_type"] = "f"
        return cell


def read_xlsx(path: Path, archive: zipfile.ZipFile, content: bytes) -> Iterator[Grid]:
    """Yield all worksheets of an XLSX. A damaged file raises errors of any class."""
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
                sheet.comments.append((row, column - 1, text))
        yield sheet


def _look(style: Any, code: str, book: Any) -> Cell:
    """Return an empty cell with the marks of a style, and with the unit that the style's format shows."""
    font, fill = book._fonts[style.fontId], book._fills[style.fillId]
    unit = re.sub(r'["\\_]', "", "".join(SHOWN_TEXT.findall(code.partition(";")[0]))).strip()
    colours = {"font": font.color, "fill": fill.fill_type and getattr(fill, "fgColor", None)}
    names = [f"{part} {colour.type} {colour.value} {colour.tint}" for part, colour in colours.items() if colour]
    colours = " ".join(name for name in names if not PLAIN.match(name))
    # The format ";;;" shows nothing.
    return Cell("", unit=unit, is_struck=bool(font.strike) or code.startswith(";"), colours=colours)


def _fill(sheet: Grid, parser: _CellParser, looks: Sequence[Cell]) -> None:
    for cell in chain.from_iterable(cells for _, cells in parser.parse()):
        value, look = cell["value"], looks[cell["style_id"]]
        text, kind = _content(value, cell["data_type"])
        if text or kind == "formula":
            blocks = [part for part in value if not isinstance(part, str)] if isinstance(value, list) else []
            # One column too many is enough for a refusal.
            sheet.rows.setdefault(cell["row"], {})[min(cell["column"] - 1, MAX_COLUMNS)] = look._replace(
                text=text,
                kind=kind,
                unit=look.unit if kind == "number" else "",
                is_formula=cell["formula"],
                is_struck=look.is_struck or any(block.font.strike for block in blocks),
            )
    merged: Any = getattr(parser, "merged_cells", None)
    for cells in merged.mergeCell if merged else ():
        bounds: Any = range_boundaries(cells.ref)
        left, top, *_ = bounds
        sheet.merged.add((top, left - 1))
    sheet.hidden_rows.update(int(row) for row, dimension in parser.row_dimensions.items() if HIDDEN & dimension.items())
    for dimension in parser.column_dimensions.values():
        if HIDDEN & dimension.items():
            sheet.hidden_columns.update(range(int(dimension["min"]) - 1, min(int(dimension["max"]), MAX_COLUMNS)))
    page = getattr(parser, "HeaderFooter", None)
    for name in page.__elements__ if page else ():
        if text := FIELD.sub(" ", str(getattr(page, name))).strip():
            sheet.elsewhere.append(("page header" if "Header" in name else "page footer", text))


def _content(value: Any, data_type: str) -> tuple[str, Kind]:
    """Return the text and the kind of a cell's value."""
    if data_type == "f" or value is None:
        return "", "formula" if data_type == "f" else "text"
    if data_type == "e":
        return value.strip(), "error"
    if isinstance(value, bool):
        return f"{value}".upper(), "truth"
    if isinstance(value, int | float):
        return f"{value:.15g}", "number" if math.isfinite(value) else "error"
    if isinstance(value, date):
        return f"{value:%Y-%m-%d %H:%M}".removesuffix(" 00:00"), "date"
    return unescape(f"{value}").strip(), "date" if data_type == "d" else "text"
