"""Rows below a header: which are stations, remarks, or calculated from others."""

from collections.abc import Sequence
from dataclasses import replace

from validate.readings.header_words import holds_no_number, is_calculated, meaning
from validate.readings.sheet import FaultList, Place, SheetRow
from validate.readings.table_rows import first_cell, is_a_number
from validate.readings.text_table import is_missing, number


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
