"""Rows below a header: units of columns, and which rows are stations, remarks, or calculated from others."""

from collections.abc import Sequence
from dataclasses import replace

from validate.readings.header_words import ColumnUnit, holds_no_number, is_calculated, is_number, meaning, unit_of
from validate.readings.sheet import FaultList, Place, SheetCell, SheetRow
from validate.readings.table_rows import first_cell, is_a_number
from validate.readings.text_table import is_missing, number

LONGEST_UNIT = 8  # Letters of a word in a row of units, as [°C] or Uhrzeit


def sorted_rows(
    place: Place, body: Sequence[SheetRow], station: int, readings: Sequence[int], faults: FaultList
) -> tuple[list[SheetRow], list[SheetRow], list[SheetRow]]:
    """Divide the rows below a header into those of stations, remarks, and means of others.

    Words between readings that begin another table are a fault: which of the two is meant must be declared.
    """
    kept, remarks, passed = list[SheetRow](), list[SheetRow](), list[SheetRow]()
    words_between = None
    for row in body:
        first, station_cell = first_cell(row), row.cell(station)
        cells = [cell for column in readings if not is_missing((cell := row.cell(column)).text) or cell.kind != "text"]
        is_text = station_cell.kind == "text" and not is_a_number(station_cell)
        words = is_text and all(cell.kind == "text" and holds_no_number(cell.text) for cell in (station_cell, *cells))
        if first is not None and first.kind == "text" and is_calculated(first.text):
            passed.append(row)
        elif is_text and (again := meaning(station_cell.text)) is not None and again.role in ("station", "mass"):
            break
        elif (words and (cells or not is_missing(station_cell.text))) or (is_text and station_cell.text and not cells):
            remarks.append(row)
            words_between = row if kept else None
        else:
            s, s_before = (number(each.cell(station).text, None) for each in (row, (kept or [row])[-1]))
            if words_between is not None and s is not None and s_before is not None and s < s_before:
                break
            kept.append(row)
            words_between = None
    else:
        return kept, remarks, passed
    spans = f'"{place.row}:{row.number - 1}" or "{row.number}:{body[-1].number}"'
    found = f"another table begins in row {row.number}, below the first."
    faults.add(replace(place, row=row.number), found, f"Say which is meant: [readings.columns] range = {spans}.")
    return kept, remarks, passed


def units_row(row: SheetRow) -> tuple[dict[int, ColumnUnit], dict[int, str]]:
    """Return units by column, and the words of such a row that are none of length; both empty where it holds others."""
    texts = {index: cell.text for index, cell in enumerate(row.cells) if not is_missing(cell.text)}
    units: dict[int, ColumnUnit] = {index: unit for index, text in texts.items() if (unit := unit_of(text)) is not None}
    others = {index: text for index, text in texts.items() if index not in units}
    short = all(len(text) <= LONGEST_UNIT and holds_no_number(text) for text in others.values())
    return (units, others) if units and short and len(others) <= len(units) else ({}, {})


def units_in_cells(body: Sequence[SheetRow]) -> tuple[list[SheetRow], dict[int, ColumnUnit]]:
    """Return the rows without units behind their numbers, and these by column where all numbers of it have one."""
    found: dict[int, set[ColumnUnit | None]] = {}
    for row in body:
        for at, cell in enumerate(row.cells):
            if is_a_number(cell) or (cell.kind == "text" and is_number(_without_unit(cell.text))):
                found.setdefault(at, set()).add(unit_of(cell.text.rpartition(" ")[2]))
    units: dict[int, ColumnUnit] = {at: unit for at, (unit, *more) in found.items() if unit is not None and not more}
    stripped = [
        SheetRow(
            row.number,
            tuple(
                SheetCell(_without_unit(cell.text)) if at in units and cell.kind == "text" else cell
                for at, cell in enumerate(row.cells)
            ),
        )
        for row in body
    ]
    return (stripped, units) if units else (list(body), {})


def _without_unit(text: str) -> str:
    head, _, last = text.rpartition(" ")
    return head.strip() if unit_of(last) is not None else text
