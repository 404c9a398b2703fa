"""Columns known by their content: the likeliest ones of a table with unknown names, and those that number repeats."""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from validate.readings.sheet import SheetRow
from validate.readings.table_rows import is_a_number
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


class LikelyColumns(NamedTuple):
    station: int | None  # Column of the stations, if one is wanted and there is one
    is_sure: bool  # False if another column may be that of the stations
    others: tuple[int, ...]  # Other columns of numbers, which may be readings


def likely_columns(body: Sequence[SheetRow], columns: Sequence[int], *, with_station: bool) -> LikelyColumns:
    """Return the likeliest columns out of ``columns``: stations rise or fall from row to row, readings are numbers."""
    numeric = [at for at in columns if _is_numeric(body, at)]
    monotonic = [at for at in numeric if with_station and _steps_alike(_numbers(body, at))]
    if not monotonic:
        return LikelyColumns(None, True, tuple(numeric))
    station = monotonic[0]
    # The first column is that of the stations, unless it counts rows and another one rises too.
    is_sure = station == numeric[0] and not (monotonic[1:] and _counts(_numbers(body, station)))
    return LikelyColumns(station, is_sure, tuple(at for at in numeric if at != station))


def _is_numeric(body: Sequence[SheetRow], column: int) -> bool:
    """Return whether at least half of a column's cells are numbers or formulas."""
    cells = [cell for row in body if (cell := row.cell(column)).text or cell.kind == "formula"]
    return 2 * sum(cell.kind == "formula" or is_a_number(cell) for cell in cells) >= len(cells) > 0


def _numbers(body: Sequence[SheetRow], column: int) -> list[float]:
    return [value for row in body if (value := number(row.cell(column).text, None)) is not None]


def _steps_alike(values: Sequence[float]) -> bool:
    steps = [after - before for before, after in pairwise(values)]
    return bool(steps) and (min(steps) > 0 or max(steps) < 0)


def _counts(values: Sequence[float]) -> bool:
    return all(after - before == 1 for before, after in pairwise(values))
