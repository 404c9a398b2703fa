"""Interpretation of a sheet: a sentence, a table of its columns, and the doubts about it."""

from collections.abc import Iterable, Iterator, Set
from itertools import pairwise

import numpy as np

from sealtwin.core.records import ReadColumn
from validate.readings.column_doubts import column_doubts
from validate.readings.header import Header, names_factor, names_other_zero, remarks_where
from validate.readings.screens import Doubt, ReadCells, alike_columns, doubtful_cells, mean_rows, scattered_stations
from validate.readings.sheet import Fact, Place, SheetGrid, letters, quoted, shown
from validate.readings.table_rows import is_a_number
from validate.readings.text_table import number
from validate.readings.whole_sheet import Filling, counted_stations, doubts_of_sheet
from validate.settings import Decimal, Declared
from validate.units import LABELS, counted

WAYS = {"level": "level upward", "depth": "depth downward", None: "reading"}
OR_ANSWER = "or confirm it: readings.as_written"  # End of a doubt about a readable sheet
NO_SUCH = "skip: no such row"
DIAL_UNITS = ("1/10 mm", "1/100 mm")
FINEST_MM = 0.0075  # Between the last digit of a caliper, 0.01 mm, and that of a dial with thousandths
MOST_ROWS_SHOWN = 8  # Limit on the listed rows that are not read, apart from those with readings and those to skip


def dialect_of(
    grid: SheetGrid,
    header: Header,
    declared: Declared,
    mark: Decimal | None,
    repeats: int,
    missing: int,
    *,
    is_long: bool,
) -> str:
    """Return the interpretation of a sheet in a sentence, so that whoever measured can check it."""
    units = list(dict.fromkeys(str(column.unit) for column in header.readings))
    counting = f"{WAYS[header.quantity]} in {' and '.join(units)} from {LABELS['datums'][declared.datum]}"
    if declared.datum != "sample_surface":
        counting += f", {declared.datum_level_mm or 0.0:+g} mm from the sample surface"
    if units != [header.station.unit]:
        counting += f", places in {header.station.unit}"
    sample = () if declared.sample is None else (f"rows of {shown(declared.sample)}",)
    written = ", ".join((*grid.written, *sample, *(() if mark is None else (f"decimal {mark}",))))
    layout = f"{'long' if is_long else 'wide'}, {counted(repeats, 'repeat')}"
    skipped = ", ".join(shown(column.name) for column in header.skipped[:8])
    more = {
        f"{counted(missing, 'reading')} missing": missing,
        f"{counted(header.above, 'line')} above the header": header.above,
        f"not readings: {skipped}": skipped,
    }
    return "; ".join((written, layout, counting, *(text for text, applies in more.items() if applies), *grid.remarks))


def understood(header: Header, along: str = "s") -> tuple[ReadColumn, ...]:
    """Return the columns of a table with their roles, then the rows that are not read."""
    way = WAYS[header.quantity]
    several = header.repeat is None and len(header.readings) > 1
    roles = {one.index: f"{way}, {at}" if several else way for at, one in enumerate(header.readings, start=1)}
    others = ((header.station, along), (header.repeat, "repeat"), (header.sample, "sample"))
    roles |= {one.index: what for one, what in others if one is not None} | dict.fromkeys(header.of_units, "unit")
    columns = [
        ReadColumn(
            letters(column.index),
            shown(column.name),
            roles.get(column.index, "not read"),
            column.unit or "",
            shown(next((text for row in header.body if (text := row.cell(column.index).text)), "")),
        )
        for column in sorted([*header.read, *header.skipped], key=lambda column: column.index)
    ]
    others = 0
    for row in (*header.remarks, *header.passed):
        has_readings = any(is_a_number(row.cell(column.index)) for column in header.readings)
        if row.number not in header.left_out and not has_readings:
            others += 1
            if others > MOST_ROWS_SHOWN:
                continue
        text = next(cell.text for cell in row.cells if cell.text)
        columns.append(ReadColumn(f"{row.number}", shown(text), "row, not read", "", ""))
    return (*columns, *(ReadColumn("-", shown(text), NO_SUCH, "", "") for text in header.unmet))


def doubts_of(
    grid: SheetGrid,
    header: Header,
    cells: ReadCells,
    declared: Declared,
    length_mm: float | None,
    depth_mm: float | None,
    filling: Filling | None,
) -> Iterator[str]:
    """Yield a sentence for each open doubt: cell, finding, remedy, and the entry that confirms the value."""
    names = {column.index: column.name for column in header.read}
    of_header = (*_of_header(grid, header, cells, declared), *counted_stations(cells, length_mm))
    for doubt in unanswered((*of_header, *screened(cells, depth_mm, filling)), declared):
        place = grid.place(doubt.row, doubt.column, names.get(doubt.column))
        # A text file has cells when it is opened in a spreadsheet.
        cell = f", cell {letters(place.column)}{place.row}" if place.sheet is None and place.column is not None else ""
        yield in_words(doubt, f"{place}{cell}")


def doubts_beside(
    grid: SheetGrid,
    header: Header,
    cells: ReadCells,
    declared: Declared,
    length_mm: float | None,
    open_facts: Set[Fact],
) -> Iterator[tuple[Place, Doubt]]:
    """Yield the open doubts of a sheet with faults, each with its place, if no answer to a fault can settle them.

    The crack's depth and the volume in it count only for a sheet without faults.
    """
    if open_facts & {"station", "readings"}:
        return
    doubts = [*_of_header(grid, header, cells, declared)]
    if "decimal" not in open_facts and len(cells.s_mm) > 1:
        # Without a unit, readings are in mm here, the smallest one: in others they are further apart.
        own, rest = _of_cells(cells)
        doubts += [*counted_stations(cells, length_mm), *own]
        if not open_facts:
            doubts += doubts_of_sheet(rest, None, None)
    for doubt in unanswered(doubts, declared):
        yield grid.place(doubt.row, doubt.column), doubt


def _of_header(grid: SheetGrid, header: Header, cells: ReadCells, declared: Declared) -> tuple[Doubt, ...]:
    missing = () if declared.columns is None else declared.columns.missing
    return (*_marked(grid, header), *column_doubts(grid, header, cells, missing), *_too_fine(header, cells))


def unanswered(doubts: Iterable[Doubt], declared: Declared) -> Iterator[Doubt]:
    """Yield the doubts whose readings ``readings.as_written`` does not confirm."""
    answered = set(declared.as_written or ())
    for doubt in doubts:
        if not answered.issuperset(doubt.answers) and (doubt.kind != "datum" or declared.datum == "sample_surface"):
            yield doubt


def in_words(doubt: Doubt, place: str) -> str:
    """Return the sentence on a doubt: place, finding, remedy, and the entry that confirms the value."""
    return f"{place}: {doubt.finding} {doubt.remedy}, {answer_to(doubt)}"


def answer_to(doubt: Doubt) -> str:
    """Return the end of a doubt's sentence: the entry that confirms the value."""
    answers = ", ".join(f'"{answer}"' for answer in doubt.answers)
    return f"{OR_ANSWER} = [{answers}]."


def screened(cells: ReadCells, depth_mm: float | None, filling: Filling | None) -> Iterator[Doubt]:
    """Yield all doubts. A doubtful reading, whether confirmed or not, is masked in the checks that follow."""
    doubts, rest = _of_cells(cells)
    yield from doubts
    yield from doubts_of_sheet(rest, depth_mm, filling)


def _of_cells(cells: ReadCells) -> tuple[list[Doubt], ReadCells]:
    """Return the doubts about single cells, rows and columns, and the readings without the doubtful ones."""
    odd = np.zeros(cells.readings_mm.shape, dtype=bool)
    doubts = list(mean_rows(cells))
    for doubt in doubts:
        odd |= cells.rows == doubt.row
    for doubt, mask in doubtful_cells(cells.without(odd)):
        doubts.append(doubt)
        odd |= mask
    rest = cells.without(odd)
    return [*doubts, *scattered_stations(rest), *alike_columns(cells)], rest


def _too_fine(header: Header, cells: ReadCells) -> Iterator[Doubt]:
    """Yield a doubt if readings in a dial's unit such as 1/10 mm have too many digits: it may be a resolution in mm."""
    for column in header.readings:
        digits_mm = cells.digits_mm[:, cells.columns == column.index]
        if column.unit in DIAL_UNITS and digits_mm.size and float(np.median(digits_mm)) < FINEST_MM:
            finding = (
                f"readings in {column.unit} have digits of {float(digits_mm.min()):.2g} mm, which no caliper shows."
            )
            remedy = "Correct the header if they are millimetres"
            yield Doubt("unit", header.row.number, column.index, ("unit",), finding, remedy)
            return


def _marked(grid: SheetGrid, header: Header) -> Iterator[Doubt]:
    """Yield doubts about remarks on zero points and factors, rows of zeros, and hidden or struck-out cells."""
    for row, text in remarks_where(header, names_other_zero):
        finding = f"{quoted(text)} mentions a zero point, which may not be the sample's face."
        remedy = "Declare [readings] datum and datum_level_mm if it is not the face"
        yield Doubt("datum", row.number, header.station.index, ("datum",), finding, remedy)
    columns = [column.index for column in (header.station, *header.readings)]
    for before, row in pairwise(header.body):
        values = [number(row.cell(column).text, None) for column in columns]
        if not any(values) and None not in values[:2] and (number(before.cell(columns[0]).text, None) or 0) > 0:
            finding = "position and readings are 0 below another position; a formula may refer to empty cells."
            yield Doubt("zero", row.number, columns[0], (f"{row.number}",), finding, "Clear the row")
    for row, text in remarks_where(header, names_factor):
        finding = f"{quoted(text)} mentions a factor, but the readings are not multiplied by it."
        yield Doubt("unit", row.number, header.station.index, ("unit",), finding, "Write the multiplied readings")
    read = {column.index for column in (header.station, *header.readings)}
    at, rows = header.station.index, {row.number: row for row in header.body}
    if hidden := sorted(grid.hidden_rows & rows.keys()):
        finding = f"{'this row is' if len(hidden) == 1 else f'{len(hidden)} rows are'} hidden but read."
        remedy = "Delete hidden rows that do not belong to the table"
        yield Doubt("hidden", hidden[0], at, tuple(map(str, hidden)), finding, remedy)
    for index in sorted(grid.hidden_columns & read):
        finding = "this column is hidden but read."
        yield Doubt(
            "hidden",
            header.row.number,
            index,
            (letters(index),),
            finding,
            "Delete it if it does not belong to the table",
        )
    for row_number, row in rows.items():
        filled = {index for index in read if row.cell(index).text}
        struck = {index for index in filled if (row_number, index) in grid.struck}
        marks = [(index, f"{letters(index)}{row_number}", row.cell(index).text) for index in sorted(struck)]
        if struck and struck == filled:
            marks = [(at, f"{row_number}", "this row")]
        for index, answer, what in marks:
            finding = f"{what} is struck through but read."
            yield Doubt("struck", row_number, index, (answer,), finding, "Clear it if it is invalid")
