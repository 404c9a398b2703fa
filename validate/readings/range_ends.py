"""Rows of a table that its declared range leaves out, though its places go on there."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from validate.readings.header_words import is_calculated
from validate.readings.place_words import only_number
from validate.readings.sheet import SheetRow
from validate.readings.table_rows import first_cell, is_a_number


def has_readings(row: SheetRow, station: int, readings: Sequence[int]) -> bool:
    """Return whether a row has a place and a reading."""
    return any(map(str.isdigit, row.cell(station).text)) and any(is_a_number(row.cell(at)) for at in readings)


def rows_beyond(
    rows: Sequence[SheetRow], inside: Sequence[SheetRow], span: str | None, columns: Sequence[int], *, has_header: bool
) -> list[int]:
    """Return the numbers of the rows outside a range, with places and readings, at which the places of the range go on.

    They end where places begin again, as those of another sample do, or at a line of text. ``columns`` are those of the
    stations and of the readings. Above a header is another table.
    """
    numbers = {row.number for row in inside}
    if span is None or not numbers:
        return []
    below = [row for row in rows if row.number > max(numbers)]
    above = [] if has_header else [row for row in rows[::-1] if row.number < min(numbers)]
    beyond = [*_going_on(inside, below, columns), *_going_on(inside[::-1], above, columns)]
    return sorted(row.number for row in beyond if has_readings(row, columns[0], columns[1:]))


def _going_on(inside: Iterable[SheetRow], beyond: Iterable[SheetRow], columns: Sequence[int]) -> Iterator[SheetRow]:
    """Yield the rows of ``beyond`` whose places go on in the direction of the last places of ``inside``."""
    places = [place for row in inside if (place := only_number(row.cell(columns[0]))) is not None]
    if not places:
        return
    steps = [after - before for before, after in pairwise(places) if after != before]
    last, direction = places[-1], steps[-1] if steps else 0.0
    for row in beyond:
        place, first = only_number(row.cell(columns[0])), first_cell(row)
        if first is not None and first.kind == "text" and is_calculated(first.text):
            continue
        if place is None or (place - last) * direction < 0:
            return
        direction = place - last or direction
        last = place
        yield row
