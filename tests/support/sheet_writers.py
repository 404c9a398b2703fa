"""Write readings as labs write them, without the code that reads them."""

import csv
import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import openpyxl
from numpy.typing import ArrayLike

from sealtwin.core.records import Floats

Language = Literal["canonical", "english", "german", "french", "spanish"]
MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
HEADERS = {
    "canonical": ("s", "level", "depth", "repeat"),
    "english": ("Position along crack", "Height", "Depth below surface", "Repeat"),
    "german": ("Abstand vom Rissanfang", "Höhe über Oberfläche", "Tiefe", "Messung Nr."),
    "french": ("Position le long de la fissure", "Niveau", "Profondeur sous la surface", "Mesure n°"),
    "spanish": ("Distancia desde el inicio", "Altura", "Profundidad", "Medición Nº"),
}
NAMES = {
    (language, column): name
    for language, names in HEADERS.items()
    for column, name in zip(("station", "level", "depth", "repeat"), names, strict=True)
}


@dataclass(frozen=True)
class Hand:
    """Format in which a sheet is written."""

    workbook: bool = False
    encoding: str = "utf-8"
    """A codec's name; "utf-16-le" and "utf-16-be" write no byte order mark."""
    mark: bool = False
    """A byte order mark before the text, for codecs that write none."""
    separator: str = ","
    decimal: str = "."
    newline: str = "\n"
    sep_line: bool = False
    language: Language = "canonical"
    quantity: Literal["level", "depth"] = "level"
    long: bool = False
    station_unit: str = "mm"
    unit: str = "mm"
    units: Literal["name", "brackets", "parentheses", "slash", "in", "row"] = "name"
    missing: str = ""
    title: Sequence[str] = ()
    gap: bool = False
    """Empty rows about the header and an empty column before the table."""
    note: bool = False
    """A last column of remarks that hold separators."""
    order: Sequence[int] | None = None
    """Order of the rows."""


def write_sheet(path: Path, hand: Hand, s_mm: Sequence[float], levels_mm: ArrayLike) -> Path:
    """``levels_mm``: (n, r), upward from the sample's surface; NaN where one is missing."""
    table = [[""] * hand.gap + [*row] for row in _table(hand, s_mm, np.asarray(levels_mm, dtype=float))]
    above = [[line] for line in hand.title] + [[]] * hand.gap
    rows: list[Sequence[str | float]] = [*above, *table[:1], *([[]] * hand.gap), *table[1:]]
    if hand.workbook:
        book = openpyxl.Workbook()
        sheet = book.worksheets[0]
        for row in rows:
            sheet.append([None if cell == "" else cell for cell in row])
        book.save(path)
        return path
    text = io.StringIO("\ufeff" * hand.mark, newline="")
    text.seek(0, io.SEEK_END)
    if hand.sep_line:
        text.write(f"sep={hand.separator}{hand.newline}")
    writer = csv.writer(text, delimiter=hand.separator, lineterminator=hand.newline)
    width = len(table[0])
    for row in rows:
        cells = [cell if isinstance(cell, str) else _number(cell, hand) for cell in row]
        # A line of one empty field is quoted, which no program writes.
        writer.writerow([*cells, *[""] * (width - len(cells))] if cells else [])
    path.write_bytes(text.getvalue().encode(hand.encoding))
    return path


def rewritten(path: Path, *, sheet: str, prolog: str = "", on_load: bool = True) -> Path:
    """Write a workbook whose worksheet has these rows of XML, as other programs write them, in place of its own.

    Formulas are left to the program that opens it, as openpyxl says of its workbooks, where ``on_load`` is true.
    """
    openpyxl.Workbook().save(path)
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    parts["xl/worksheets/sheet1.xml"] = (
        f'{prolog}<worksheet xmlns="{MAIN}"><sheetData>{sheet}</sheetData></worksheet>'.encode()
    )
    if not on_load:
        whole = parts["xl/workbook.xml"]
        assert b' fullCalcOnLoad="1"' in whole
        parts["xl/workbook.xml"] = whole.replace(b' fullCalcOnLoad="1"', b"")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in parts.items():
            archive.writestr(name, text)
    return path


def _table(hand: Hand, s_mm: Sequence[float], levels_mm: Floats) -> list[Sequence[str | float]]:
    sign = 1 if hand.quantity == "level" else -1
    names, units, rows = [_named(hand, "station", "")], [hand.station_unit], []
    numbers = range(1, levels_mm.shape[1] + 1)
    if hand.long:
        names += [NAMES[hand.language, "repeat"], _named(hand, hand.quantity, "")]
        units += ["", hand.unit]
    else:
        names += [_named(hand, hand.quantity, f"{number}") for number in numbers]
        units += [hand.unit] * len(numbers)
    for s, levels in zip(s_mm, levels_mm, strict=True):
        place = s / MM[hand.station_unit]
        readings = [hand.missing if np.isnan(level) else sign * level / MM[hand.unit] for level in levels]
        if hand.long:
            rows += [[place, f"{number}", reading] for number, reading in zip(numbers, readings, strict=True)]
        else:
            rows.append([place, *readings])
    if hand.order is not None:
        rows = [rows[index] for index in hand.order]
    if hand.note:
        names, units = [*names, "Bemerkung"], [*units, ""]
        rows = [[*row, "ok; Foto 1, Blatt 2"] for row in rows]
    return [names, *([units] if hand.units == "row" else []), *rows]


def _named(hand: Hand, what: Literal["station", "level", "depth"], number: str) -> str:
    unit = hand.station_unit if what == "station" else hand.unit
    if hand.language == "canonical" and hand.units == "name":
        return "_".join(part for part in (NAMES["canonical", what], number, unit) if part)
    name = " ".join(part for part in (NAMES[hand.language, what], number) if part)
    ways = {"name": " ({})", "brackets": " [{}]", "parentheses": " ({})", "slash": "/{}", "in": " in {}", "row": ""}
    return name + ways[hand.units].format(unit)


def _number(value: float, hand: Hand) -> str:
    """Hundredths of a millimetre in any unit, with digits enough that no mark can be taken for a thousands'."""
    return f"{value:.{2 if hand.unit == hand.station_unit == 'mm' else 8}f}".replace(".", hand.decimal)
