"""Columns that number the repeats of a sheet with one reading in a row, known by their content."""

from collections import Counter
from collections.abc import Sequence

from validate.readings.sheet import SheetRow
from validate.readings.text_table import number

MOST_REPEATS = 20  # Higher numbers count rows, or are readings


def numbers_repeats(body: Sequence[SheetRow], place: Sequence[int], column: int) -> bool:
    """Return whether a column has small whole numbers, each once at each place, and a place has several of them.

    ``place`` are the columns that name a place: the stations, and the sample if there is such a column.
    """
    labels = _labels(body, place, column)
    return len(set(labels)) == len(labels) > len({at for at, _ in labels})


def may_be_readings(body: Sequence[SheetRow], column: int) -> bool:
    """Return whether a column has a number that counts nothing: a decimal, or one below 0 or far above all counts."""
    values = [value for row in body if (value := number(row.cell(column).text, None)) is not None]
    return any(value != int(value) or not 0 <= value <= len(body) + MOST_REPEATS for value in values)


def likely_repeat(body: Sequence[SheetRow], place: Sequence[int], columns: Sequence[int]) -> int | None:
    """Return the only one of ``columns`` that numbers the repeats, from one to the most of a place; else None."""
    likely = []
    for column in columns:
        labels = _labels(body, place, column)
        most = max(Counter(at for at, _ in labels).values(), default=0)
        if numbers_repeats(body, place, column) and len({label for _, label in labels}) == most:
            likely.append(column)
    return likely[0] if len(likely) == 1 else None


def _labels(body: Sequence[SheetRow], place: Sequence[int], column: int) -> list[tuple[tuple[object, ...], float]]:
    """Return the place and the number of each row; an empty list if a row with a station has no such number."""
    labels = list[tuple[tuple[object, ...], float]]()
    for row in body:
        values = [number(row.cell(at).text, None) for at in place]
        label = number(row.cell(column).text, None)
        if values[0] is None:
            continue
        if label is None or label != int(label) or not 0 <= label <= MOST_REPEATS:
            return []
        cells = zip(place, values, strict=True)
        labels.append((tuple(row.cell(at).text if value is None else value for at, value in cells), label))
    return labels
