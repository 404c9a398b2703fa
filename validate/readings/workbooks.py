"""Read the worksheets of an XLSX, or of an OpenDocument spreadsheet (ODS) as LibreOffice saves it.

From openpyxl, only the parser of a single worksheet is used, in one pass. Opening a whole workbook with openpyxl would
fill merged ranges and links with cells, lose which cells are formulas, and turn numbers with the format "Standard" into
dates. In an ODS, repeated rows and cells are expanded only up to the size limit of a sheet of readings, and defusedxml
refuses entities.
"""

import io
import math
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import date
from functools import cache
from itertools import chain, islice, repeat
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import openpyxl
from defusedxml.ElementTree import fromstring
from openpyxl.comments.comment_sheet import CommentSheet
from openpyxl.packaging.relationship import get_dependents, get_rels_path
from openpyxl.styles.numbers import BUILTIN_FORMATS, BUILTIN_FORMATS_MAX_SIZE
from openpyxl.utils.cell import coordinate_to_tuple
from openpyxl.utils.escape import unescape
from openpyxl.worksheet._reader import FORMULA_TAG, WorkSheetParser
from openpyxl.xml.constants import COMMENTS_NS

from validate.readings.grid import BLANK, FORMULA, MAX_COLUMNS, MAX_ROWS, Cell, Grid, Kind, quoted

LEFT_TO_OTHERS = b'fullCalcOnLoad="1"'  # Mark of a program that does not calculate formulas. Excel removes it.
HIDDEN_XLSX = {("hidden", "1"), ("hidden", "true"), ("ht", "0"), ("width", "0")}  # Attributes of hidden cells
NO_DATE = re.compile(r"[^\W\d_dmyhsapegbjtcrw]", re.IGNORECASE)
"""A letter that no date format contains. Words for "General" in other languages contain one, for example "Standard"."""
TEXT_OR_COLOUR = re.compile(r'"[^"]*"|\[[^\]]*\]|\\.')
SHOWN_BEHIND = re.compile(r'[0#?]\s*((?:"[^"]*"|\\.|[\s_]|%|mm|cm)+)$')
"""Text that a format adds after a number, either quoted or letter by letter."""
PLAIN_XLSX = re.compile(r"rgb ..(?:000000|FFFFFF)|theme [01] 0\.0|indexed (?:0|1|8|9|6\d) |auto")
"""Colours that are black, white or automatic, with their tint."""
FIELD = re.compile(r'&(?:"[^"]*"|\d+ ?|K[0-9A-F]{6}|[A-Z])')  # Font, position or field of a page header, such as &P
MIMETYPE = b"application/vnd.oasis.opendocument.spreadsheet"
PARTS = ("styles.xml", "content.xml")
OFFICE, TABLE, TEXT, STYLE, LOOK = (
    f"{{urn:oasis:names:tc:opendocument:xmlns:{name}:1.0}}"
    for name in ("office", "table", "text", "style", "xsl-fo-compatible")
)
STYLE_NAME, USUAL_STYLE, VISIBILITY, FORMULA_KEY = (
    f"{TABLE}{name}" for name in ("style-name", "default-cell-style-name", "visibility", "formula")
)
HIDDEN_ODS = ("collapse", "filter")
NUMBERS = ("float", "percentage", "currency")
OTHER_KINDS: dict[str | None, Kind] = {"date": "date", "time": "date", "boolean": "truth"}
COLOURS = (f"{LOOK}background-color", f"{LOOK}color")
PLAIN_ODS = ("", "transparent", "#000000", "#ffffff")  # Colours that are not a mark
ERROR = re.compile(r"#.*[^\W\d_].*|(?:err|fehler|erreur|error)\s?:\s?[0-9]+", re.IGNORECASE)
"""Text of an error, such as #DIV/0!, #WERT! or Err:503. The text ### is different: a number in a too narrow column."""
BEHIND = re.compile(r"[-+]?[0-9][0-9.,' \u00a0\u202f]*(\D+)")
"""A displayed number, and the text that its format adds behind it."""
Look = Callable[[str | None], Mapping[str, str]]


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
    behind = SHOWN_BEHIND.search(code.partition(";")[0])
    unit = "" if behind is None else re.sub(r'["\\_]', "", behind[1]).strip()
    colours = font.color, fill.fill_type and getattr(fill, "fgColor", None)
    names = [f"{each.type} {each.value} {each.tint}" for each in colours if each is not None]
    colours = " ".join(name for name in names if not PLAIN_XLSX.match(name))
    return Cell("", unit=unit, is_struck=bool(font.strike), colours=colours)


def _fill(sheet: Grid, parser: _CellParser, looks: Sequence[Cell]) -> None:
    for each in chain.from_iterable(cells for _, cells in parser.parse()):
        value, look = each["value"], looks[each["style_id"]]
        text, kind = _content(value, each["data_type"])
        if text or kind == "formula":
            blocks = [part for part in value if not isinstance(part, str)] if isinstance(value, list) else []
            # One column too many is enough for a refusal.
            sheet.rows.setdefault(each["row"], {})[min(each["column"] - 1, MAX_COLUMNS)] = look._replace(
                text=text,
                kind=kind,
                unit=look.unit if kind == "number" else "",
                is_formula=each["formula"],
                is_struck=look.is_struck or any(block.font.strike for block in blocks),
            )
    sheet.hidden_rows.update(int(row) for row, each in parser.row_dimensions.items() if HIDDEN_XLSX & each.items())
    for each in parser.column_dimensions.values():
        if HIDDEN_XLSX & each.items():
            sheet.hidden_columns.update(range(int(each["min"]) - 1, min(int(each["max"]), MAX_COLUMNS)))
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


def read_ods(path: Path, archive: zipfile.ZipFile) -> Iterator[Grid]:
    """Yield all worksheets of an ODS. A damaged file raises errors of any class."""
    roots = [fromstring(archive.read(part)) for part in PARTS if part in archive.namelist()]
    styles = {style.get(f"{STYLE}name"): style for root in roots for style in root.iter(f"{STYLE}style")}

    @cache
    def look(name: str | None) -> Mapping[str, str]:
        """Return the properties of a style, including inherited ones."""
        if (style := styles.get(name)) is None:
            return {}
        properties = [look(style.get(f"{STYLE}parent-style-name")), *(part.attrib for part in style)]
        return {key: value for each in properties for key, value in each.items()}

    for table in roots[-1].findall(f"{OFFICE}body/{OFFICE}spreadsheet/{TABLE}table"):
        yield _ods_sheet(path, table, look)


def _ods_sheet(path: Path, table: Element, look: Look) -> Grid:
    name, is_hidden = table.get(f"{TABLE}name", ""), look(table.get(STYLE_NAME)).get(f"{TABLE}display") == "false"
    sheet = Grid(path, ("ODS", f"sheet {quoted(name)}"), sheet=name, is_hidden=is_hidden)
    repeated = (repeat(each, _count(each, "columns")) for each in _below(table, "table-column"))
    columns = [*islice(chain.from_iterable(repeated), MAX_COLUMNS + 1)]
    sheet.hidden_columns.update(number for number, each in enumerate(columns) if each.get(VISIBILITY) in HIDDEN_ODS)
    usual = dict(enumerate(each.get(USUAL_STYLE) for each in columns))
    number = 1
    for row in _below(table, "table-row"):
        cells, column = dict[int, Cell](), 0
        for cell in row.iterfind(f"{TABLE}*"):
            after = column + _count(cell, "columns")
            if (value := _ods_value(cell)) != BLANK:
                marked = _marked(value, cell, look, cell.get(STYLE_NAME) or row.get(USUAL_STYLE) or usual.get(column))
                # One column too many is enough for a refusal.
                cells |= dict.fromkeys(range(column, min(after, MAX_COLUMNS + 1)), marked)
            if (note := cell.find(f"{OFFICE}annotation")) is not None:
                sheet.comments.append((number, column, _text(note)))
            column = after
        after = number + _count(row, "rows")
        if cells:
            rows = range(number, min(after, number + MAX_ROWS + 1 - len(sheet.rows)))
            sheet.rows.update(dict.fromkeys(rows, cells))
            sheet.hidden_rows.update(rows if row.get(VISIBILITY) in HIDDEN_ODS else ())
        number = after
    sheet.drop_zeros()
    return sheet


def _marked(value: Cell, cell: Element, look: Look, style: str | None) -> Cell:
    """Return a cell with the marks of its styles."""
    looks = [look(style), *(look(span.get(f"{TEXT}style-name")) for span in cell.iter(f"{TEXT}span"))]
    return value._replace(
        is_formula=cell.get(FORMULA_KEY) is not None,
        is_struck=any(each.get(f"{STYLE}text-line-through-style", "none") != "none" for each in looks),
        colours=" ".join(colour for key in COLOURS if (colour := looks[0].get(key, "").lower()) not in PLAIN_ODS),
    )


def _below(element: Element, tag: str) -> Iterator[Element]:
    """Yield the rows or columns of a table, including grouped ones. Tables within its cells are left out."""
    for each in element:
        if each.tag == f"{TABLE}{tag}":
            yield each
        elif each.tag != f"{TABLE}table-row":
            yield from _below(each, tag)


def _count(element: Element, what: str) -> int:
    return max(1, int(element.get(f"{TABLE}number-{what}-repeated", "1")[:9]))


def _ods_value(cell: Element) -> Cell:
    kind, text, is_formula = cell.get(f"{OFFICE}value-type"), _text(cell), cell.get(FORMULA_KEY) is not None
    # Excel, and OpenOffice up to 3, save an error as the number 0 with its text.
    if (kind in NUMBERS or is_formula) and ERROR.fullmatch(text):
        return Cell(text, "error")
    if kind in NUMBERS:
        value, behind = float(cell.get(f"{OFFICE}value", "nan")), BEHIND.fullmatch(text)
        unit = "%" if kind == "percentage" else "" if behind is None else behind[1].strip()
        return Cell(f"{value:.15g}", "number" if math.isfinite(value) else "error", unit)
    if kind in OTHER_KINDS:
        return Cell(text or f"{kind}", OTHER_KINDS[kind])
    if kind is None and is_formula:
        return FORMULA
    return Cell(text or cell.get(f"{OFFICE}string-value", "").strip())


def _text(element: Element) -> str:
    return "\n".join("".join(line.itertext()) for line in element.findall(f"{TEXT}p")).strip()
