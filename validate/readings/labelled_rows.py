"""Rows of readings with a label each, below a row of places: the label may be the name of a sample."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from validate.readings.cell_units import bare
from validate.readings.header_words import is_calculated, meaning
from validate.readings.place_words import PLACE, is_place
from validate.readings.sheet import SheetCell, SheetRow
from validate.readings.text_table import number

LEAST = 2  # Places in a row


@dataclass(frozen=True)
class LabelledRow:
    cells: SheetRow
    first: str  # Its first label, or that above a blank
    labels: str  # All of its labels


@dataclass(frozen=True)
class LabelledRows:
    places: SheetRow
    corner: str  # Labels of the row of places
    label_columns: int  # Number of columns with labels
    are_certain: bool  # False if the places may be the numbers of repeats: 1, 2, 3 without a unit or a word
    rows: tuple[LabelledRow, ...]


def labelled_rows(rows: Sequence[SheetRow]) -> LabelledRows | None:
    """Return the first row of rising or falling numbers, with the labelled rows of numbers below it, or None.

    All rows of numbers below must have a label; calculated rows are left out.
    """
    for index, row in enumerate(rows):
        places = _places(row)
        if len(places) < LEAST or not _is_monotonic(list(places.values())) or min(places) == 0:
            continue
        below = [one for one in rows[index + 1 :] if any(_number(one.cell(at)) is not None for at in places)]
        labelled = list(_labelled(below, min(places)))
        if labelled and all(one.first for one in labelled):
            named = [what.role for cell in row.cells[: min(places)] if (what := meaning(cell.text)) is not None]
            counts = list(places.values()) == list(range(1, len(places) + 1))
            are_certain = not counts or "station" in named or all(_is_certain(row.cell(at)) for at in places)
            corner = " ".join(cell.text for cell in row.cells[: min(places)] if cell.text)
            columns = sum(any(one.cell(at).text for one in (row, *below)) for at in range(min(places)))
            return LabelledRows(row, corner, columns, are_certain, tuple(labelled))
    return None


def _labelled(rows: Sequence[SheetRow], width: int) -> Iterator[LabelledRow]:
    first = ""
    for row in rows:
        texts = [cell.text for cell in row.cells[:width]]
        if any(map(is_calculated, texts)):
            continue
        first = texts[0] or first  # A blank below a name goes on with it
        yield LabelledRow(row, first, " ".join(filter(None, [first, *texts[1:]])))


def _places(row: SheetRow) -> dict[int, float]:
    """Return the numbers of a row by column, from the first one behind which all cells with content are numbers."""
    numbers = {at: _number(cell) for at, cell in enumerate(row.cells) if cell.text}
    texts = [at for at, value in numbers.items() if value is None]
    return {at: value for at, value in numbers.items() if value is not None and at > max(texts, default=-1)}


def _number(cell: SheetCell) -> float | None:
    place = PLACE.fullmatch(cell.text) if is_place(cell) else None
    return number(bare(cell).text if place is None else place["number"], None)


def _is_certain(cell: SheetCell) -> bool:
    return is_place(cell) or bare(cell).text != cell.text


def _is_monotonic(values: Sequence[float]) -> bool:
    steps = [after - before for before, after in pairwise(values)]
    return min(steps) > 0 or max(steps) < 0
