"""Doubts about a sheet in the order in which they are raised, without those that are answered."""

from collections.abc import Iterator

import numpy as np

from validate.readings.columns import Header, other_zeros
from validate.readings.copies import alike_columns, mean_rows
from validate.readings.screens import Doubt, ReadCells, doubtful_cells, scattered_stations
from validate.readings.sheet import Place, SheetGrid, letters, quoted
from validate.readings.whole_sheet import Filling, doubts_of_sheet
from validate.settings import Declared


def doubts_of(
    grid: SheetGrid,
    header: Header,
    cells: ReadCells,
    declared: Declared,
    depth_mm: float | None,
    filling: Filling | None,
) -> Iterator[str]:
    """Yield a sentence for each doubt: its cell, what was found, the remedy, and the answer that keeps it as it is."""
    answered = set(declared.as_written or ())
    names = {column.index: column.name for column in header.read}
    for doubt in (*_marked(grid, header), *_screened(cells, depth_mm, filling)):
        if answered.issuperset(doubt.answers) or (doubt.kind == "datum" and declared.datum != "sample_surface"):
            continue
        place = grid.place(doubt.row, doubt.column, names.get(doubt.column))
        answers = ", ".join(f'"{answer}"' for answer in doubt.answers)
        yield f"{_with_cell(place)}: {doubt.found} {doubt.remedy}, or answer readings.as_written = [{answers}]."


def _with_cell(place: Place) -> str:
    """Return the place with the name of its cell, which a text file has in every spreadsheet."""
    if place.sheet is not None or place.column is None:
        return str(place)
    return f"{place}, cell {letters(place.column)}{place.row}"


def _screened(cells: ReadCells, depth_mm: float | None, filling: Filling | None) -> Iterator[Doubt]:
    """Yield what the screens find; a reading in doubt, answered or not, is kept from those that follow."""
    odd = np.zeros(cells.readings_mm.shape, dtype=bool)
    for doubt in mean_rows(cells):
        yield doubt
        odd |= cells.rows == doubt.row
    for doubt, mask in doubtful_cells(cells.without(odd)):
        yield doubt
        odd |= mask
    rest = cells.without(odd)
    yield from scattered_stations(rest)
    yield from alike_columns(cells)
    yield from doubts_of_sheet(rest, depth_mm, filling)


def _marked(grid: SheetGrid, header: Header) -> Iterator[Doubt]:
    """Yield remarks on the zero of readings, and rows, columns and cells that are struck through or hidden."""
    for row, text in other_zeros(header):
        found = f"{quoted(text)} says what the readings count from, and not in words for the sample's face."
        remedy = "Declare [readings] datum and datum_level_mm if it is not the face"
        yield Doubt("datum", row.number, header.station.index, ("datum",), found, remedy)
    read = {column.index for column in (header.station, *header.readings)}
    at, rows = header.station.index, {row.number: row for row in header.body}
    if hidden := sorted(grid.hidden_rows & rows.keys()):
        found = f"{'this row is' if len(hidden) == 1 else f'{len(hidden)} rows are'} hidden, and read."
        yield Doubt("hidden", hidden[0], at, tuple(map(str, hidden)), found, "Delete what is not meant")
    for index in sorted(grid.hidden_columns & read):
        found = "this column is hidden, and read."
        yield Doubt("hidden", header.row.number, index, (letters(index),), found, "Delete it if it is not meant")
    for number, row in rows.items():
        filled = {index for index in read if row.cell(index).text}
        struck = {index for index in filled if (number, index) in grid.struck}
        marks = [(index, f"{letters(index)}{number}", row.cell(index).text) for index in sorted(struck)]
        if struck and struck == filled:
            marks = [(at, f"{number}", "this row")]
        for index, answer, what in marks:
            found = f"{what} is struck through, and read."
            yield Doubt("struck", number, index, (answer,), found, "Clear it if it is not meant")
