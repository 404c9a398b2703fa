"""Read the worksheets of an OpenDocument spreadsheet (ODS), as LibreOffice saves it.

Repeated rows and cells are expanded only up to the size limit of a sheet of readings, and defusedxml refuses entities.
"""

import math
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from itertools import chain, islice, repeat
from pathlib import Path
from xml.etree.ElementTree import Element

from defusedxml.ElementTree import fromstring

from validate.readings.grid import BLANK, FORMULA, MOST_COLUMNS, MOST_ROWS, Cell, Comment, Grid, Kind, quoted

MIMETYPE = b"application/vnd.oasis.opendocument.spreadsheet"
PARTS = ("styles.xml", "content.xml")
OFFICE, TABLE, TEXT, STYLE, LOOK = (
    f"{{urn:oasis:names:tc:opendocument:xmlns:{name}:1.0}}"
    for name in ("office", "table", "text", "style", "xsl-fo-compatible")
)
STYLE_NAME, USUAL_STYLE, VISIBILITY, FORMULA_KEY = (
    f"{TABLE}{name}" for name in ("style-name", "default-cell-style-name", "visibility", "formula")
)
HIDDEN = ("collapse", "filter")
NUMBERS = ("float", "percentage", "currency")
OTHER_KINDS: dict[str | None, Kind] = {"date": "date", "time": "date", "boolean": "truth"}
COLOURS = (f"{LOOK}background-color", f"{LOOK}color")
PLAIN = ("", "transparent", "#000000", "#ffffff")  # Colours
ERROR = re.compile(r"#.*[^\W\d_].*|(?:err|fehler|erreur|error)\s?:\s?[0-9]+", re.IGNORECASE)
"""Text of an error: #DIV/0!, #WERT!, Err:503. In contrast, ### is a number in a column that is too narrow."""
BEHIND = re.compile(r"[-+]?[0-9][0-9.,' \u00a0\u202f]*(\D+)")
"""A displayed number, and the text that its format adds behind it."""
Look = Callable[[str | None], Mapping[str, str]]


def read_worksheets(path: Path, archive: zipfile.ZipFile) -> Iterator[Grid]:
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
        yield _sheet(path, table, look)


def _sheet(path: Path, table: Element, look: Look) -> Grid:
    name, is_hidden = table.get(f"{TABLE}name", ""), look(table.get(STYLE_NAME)).get(f"{TABLE}display") == "false"
    sheet = Grid(path, ("ODS", f"sheet {quoted(name)}"), sheet=name, is_hidden=is_hidden)
    repeated = (repeat(each, _count(each, "columns")) for each in _below(table, "table-column"))
    columns = [*islice(chain.from_iterable(repeated), MOST_COLUMNS + 1)]
    sheet.hidden_columns.update(number for number, each in enumerate(columns) if each.get(VISIBILITY) in HIDDEN)
    usual = dict(enumerate(each.get(USUAL_STYLE) for each in columns))
    number = 1
    for row in _below(table, "table-row"):
        cells, column = dict[int, Cell](), 0
        for cell in row.iterfind(f"{TABLE}*"):
            after = column + _count(cell, "columns")
            if (value := _value(cell)) != BLANK:
                style = cell.get(STYLE_NAME) or row.get(USUAL_STYLE) or usual.get(column)
                is_struck, colours = _marks(cell, style, look)
                is_formula = cell.get(FORMULA_KEY) is not None
                marked = value._replace(is_formula=is_formula, is_struck=is_struck, colours=colours)
                # One column too many is enough for a refusal.
                cells |= dict.fromkeys(range(column, min(after, MOST_COLUMNS + 1)), marked)
            if (note := cell.find(f"{OFFICE}annotation")) is not None:
                sheet.comments.append(Comment(number, column, _text(note)))
            column = after
        after = number + _count(row, "rows")
        if cells:
            rows = range(number, min(after, number + MOST_ROWS + 1 - len(sheet.rows)))
            sheet.rows.update(dict.fromkeys(rows, cells))
            sheet.hidden_rows.update(rows if row.get(VISIBILITY) in HIDDEN else ())
        number = after
    sheet.drop_zeros()
    return sheet


def _marks(cell: Element, style: str | None, look: Look) -> tuple[bool, str]:
    """Return whether the text of a cell is struck through, and its colours."""
    looks = [look(style), *(look(span.get(f"{TEXT}style-name")) for span in cell.iter(f"{TEXT}span"))]
    struck = any(each.get(f"{STYLE}text-line-through-style", "none") != "none" for each in looks)
    colours = " ".join(colour for key in COLOURS if (colour := looks[0].get(key, "").lower()) not in PLAIN)
    return struck, colours


def _below(element: Element, tag: str) -> Iterator[Element]:
    """Yield the rows or columns of a table, including grouped ones, but not those of tables within its cells."""
    for each in element:
        if each.tag == f"{TABLE}{tag}":
            yield each
        elif each.tag != f"{TABLE}table-row":
            yield from _below(each, tag)


def _count(element: Element, what: str) -> int:
    return max(1, int(element.get(f"{TABLE}number-{what}-repeated", "1")[:9]))


def _value(cell: Element) -> Cell:
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
