"""Read the worksheets of an OpenDocument spreadsheet (ODS), as LibreOffice saves it.

Repeated rows and cells are expanded only up to the size limit of a sheet of readings, and defusedxml refuses entities.
"""

import math
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from xml.etree.ElementTree import Element

from defusedxml.ElementTree import fromstring

from validate.readings.grid import BLANK, MOST_COLUMNS, MOST_ROWS, Cell, Mark
from validate.readings.worksheets import FORMULA, Entry, Worksheet

MIMETYPE = b"application/vnd.oasis.opendocument.spreadsheet"
PARTS = ("styles.xml", "content.xml")
OFFICE, TABLE, TEXT, STYLE, LOOK = (
    f"{{urn:oasis:names:tc:opendocument:xmlns:{name}:1.0}}"
    for name in ("office", "table", "text", "style", "xsl-fo-compatible")
)
ERROR_TYPE = "{urn:org:documentfoundation:names:experimental:calc:xmlns:calcext:1.0}value-type"
NUMBERS = ("float", "percentage", "currency")
STYLE_NAME, USUAL_STYLE, FORMULA_KEY = (
    f"{TABLE}{name}" for name in ("style-name", "default-cell-style-name", "formula")
)
HIDDEN = ("collapse", "filter")
COLOURS = {"fill": f"{LOOK}background-color", "font": f"{LOOK}color"}
PLAIN = ("", "transparent", "#000000", "#ffffff")  # Colours
NO_SIZE = re.compile(r"0*(?:[.,]0*)?[a-z%]*")  # "0cm", of an invisible row or column
ERROR = re.compile(r"#.*[^\W\d_].*|(?:err|fehler|erreur|error)\s?:\s?[0-9]+", re.IGNORECASE)
"""Text of an error: #DIV/0!, #WERT!, Err:503. In contrast, ### is a number in a column that is too narrow."""
BEHIND = re.compile(r"[-+]?[0-9][0-9.,' \u00a0\u202f]*(\D+)")
"""A displayed number, and the text that its format adds behind it."""


def read_worksheets(archive: zipfile.ZipFile) -> Iterator[Worksheet]:
    """Yield all worksheets. A damaged file raises errors of any class."""
    roots = [fromstring(archive.read(part)) for part in PARTS if part in archive.namelist()]
    styles = {style.get(f"{STYLE}name"): style for root in roots for style in root.iter(f"{STYLE}style")}

    @cache
    def look(name: str | None) -> Mapping[str, str]:
        """Return the properties of a style, with those it inherits."""
        if (style := styles.get(name)) is None:
            return {}
        properties = [look(style.get(f"{STYLE}parent-style-name")), *(part.attrib for part in style)]
        return {key: value for each in properties for key, value in each.items()}

    for table in roots[-1].findall(f"{OFFICE}body/{OFFICE}spreadsheet/{TABLE}table"):
        yield _sheet(table, look)


def _sheet(table: Element, look: Callable[[str | None], Mapping[str, str]]) -> Worksheet:
    def is_hidden(element: Element, size: str) -> bool:
        shown_size = look(element.get(STYLE_NAME)).get(f"{STYLE}{size}", "1cm")
        return element.get(f"{TABLE}visibility") in HIDDEN or NO_SIZE.fullmatch(shown_size) is not None

    sheet = Worksheet(table.get(f"{TABLE}name", ""), look(table.get(STYLE_NAME)).get(f"{TABLE}display") == "false")
    usual: dict[int, str | None] = {}
    for each in _below(table, "table-column"):
        columns = range(len(usual), min(len(usual) + _count(each, "columns-repeated"), MOST_COLUMNS + 1))
        usual |= dict.fromkeys(columns, each.get(USUAL_STYLE))
        sheet.hidden_columns |= set(columns if is_hidden(each, "column-width") else ())
    number = 1
    for row in _below(table, "table-row"):
        entries, column = dict[int, Entry](), 0
        for cell in row.iterfind(f"{TABLE}*"):
            after = column + _count(cell, "columns-repeated")
            if (value := _value(cell)) != BLANK:
                looks = [look(cell.get(STYLE_NAME) or row.get(USUAL_STYLE) or usual.get(column))]
                looks += [look(span.get(f"{TEXT}style-name")) for span in cell.iter(f"{TEXT}span")]
                struck = any(each.get(f"{STYLE}text-line-through-style", "none") != "none" for each in looks)
                colours = {what: looks[0].get(key, "") for what, key in COLOURS.items()}
                named = ", ".join(f"{what} {colour}" for what, colour in colours.items() if colour.lower() not in PLAIN)
                entry = Entry(value, cell.get(FORMULA_KEY) is not None, struck, named)
                # One column too many is enough for a refusal.
                entries |= dict.fromkeys(range(column, min(after, MOST_COLUMNS + 1)), entry)
            if (note := cell.find(f"{OFFICE}annotation")) is not None:
                sheet.comments.append(Mark(number, column, "comment", _text(note)))
            below, beside = number + _count(cell, "rows-spanned"), column + _count(cell, "columns-spanned")
            if (below, beside) != (number + 1, column + 1):
                sheet.merged.append((number, column, below - 1, beside - 1))
            column = after
        times = _count(row, "rows-repeated")
        if entries:
            rows = range(number, number + min(times, MOST_ROWS + 1 - len(sheet.rows)))
            sheet.rows |= dict.fromkeys(rows, entries)
            sheet.hidden_rows |= set(rows if is_hidden(row, "row-height") else ())
        number += times
    sheet.drop_zeros()
    return sheet


def _below(element: Element, tag: str) -> Iterator[Element]:
    """Yield the rows or columns of a table, including grouped ones, but not those of tables within its cells."""
    for each in element:
        if each.tag == f"{TABLE}{tag}":
            yield each
        elif each.tag != f"{TABLE}table-row":
            yield from _below(each, tag)


def _count(element: Element, what: str) -> int:
    return max(1, int(element.get(f"{TABLE}number-{what}", "1")[:9]))


def _value(cell: Element) -> Cell:
    kind, text, formula = cell.get(f"{OFFICE}value-type"), _text(cell), cell.get(FORMULA_KEY)
    # Excel, and OpenOffice up to 3, save an error as the number 0 with its text.
    may_fail = kind in NUMBERS or formula is not None
    if cell.get(ERROR_TYPE) == "error" or text.startswith("Err:") or (may_fail and ERROR.fullmatch(text)):
        return Cell(text or "an error", "error")
    if kind in NUMBERS:
        value, behind = float(cell.get(f"{OFFICE}value", "nan")), BEHIND.fullmatch(text)
        unit = "%" if kind == "percentage" else "" if behind is None else behind[1].strip()
        return Cell(f"{value:.15g}", "number" if math.isfinite(value) else "error", unit)
    if kind in ("date", "time"):
        return Cell(text or cell.get(f"{OFFICE}date-value", ""), "date")
    if kind == "boolean":
        return Cell(cell.get(f"{OFFICE}boolean-value", "").upper(), "truth")
    if kind is None and formula is not None:
        return FORMULA
    return Cell(text or cell.get(f"{OFFICE}string-value", "").strip())


def _text(element: Element) -> str:
    return "\n".join("".join(line.itertext()) for line in element.findall(f"{TEXT}p")).strip()
