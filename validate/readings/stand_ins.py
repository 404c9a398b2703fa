"""The likeliest columns of a table with unknown names, so that its other faults are reported with the question."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from validate.readings.sheet import SheetRow
from validate.readings.table_rows import is_a_number
from validate.readings.text_table import number


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
