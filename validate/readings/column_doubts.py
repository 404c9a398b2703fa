"""Doubts about the columns of a sheet: whether they are places, readings and numbers of repeats at all."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from validate.readings.header import Column, Header
from validate.readings.header_words import meaning
from validate.readings.place_words import only_number
from validate.readings.screens import LIMITS, NINES, Doubt, ReadCells, row_medians, spread_mm
from validate.readings.sheet import SheetGrid, letters, quoted
from validate.readings.text_table import number

LEAST = 5  # Places in a column that is compared
MARGIN = 0.1  # Share of the range of readings by which another one may exceed it
MOST_LABELS = 2  # Labels of repeats, as a multiple of the most readings of a place
CORRECT = "Correct the columns"


def column_doubts(grid: SheetGrid, header: Header, cells: ReadCells, missing: Sequence[str]) -> Iterator[Doubt]:
    """Yield doubts about columns that an answer chose, by their names and their numbers.

    ``missing`` are the declared words for a missing reading.
    """
    named = [column for column in header.readings if _is_no_reading(header, column)]
    for column in named:
        yield _doubt(header, column, f"the name of {quoted(column.name)} is that of no readings.")
    yield from (doubt for doubt in _far_columns(header, cells) if doubt.column not in {one.index for one in named})
    yield from _of_places(header)
    yield from _of_repeats(header)
    yield from _of_missing(grid, header, missing)


def _doubt(header: Header, column: Column, finding: str) -> Doubt:
    return Doubt("column", header.row.number, column.index, (letters(column.index),), finding, CORRECT)


def _is_no_reading(header: Header, column: Column) -> bool:
    """Return whether a name is that of places, or of another quantity beside columns of readings."""
    what = meaning(column.name)
    is_beside = not all(map(_is_other, header.readings))
    return (what is not None and what.role == "station") or (is_beside and _is_other(column))


def _is_other(column: Column) -> bool:
    """Return whether a name means another quantity, or one that is calculated from readings."""
    return (what := meaning(column.name)) is not None and what.role in ("skipped", "mass", "sample")


def _far_columns(header: Header, cells: ReadCells) -> Iterator[Doubt]:
    """Yield doubts about columns whose readings are far from those of the other columns at most stations."""
    by_index = {column.index: column for column in header.readings}
    columns = list(dict.fromkeys(cells.columns.tolist()))
    middles = {at: row_medians(cells.readings_mm[:, cells.columns == at]) for at in columns if at in by_index}
    # Of two columns that differ, the first may be as wrong as the second: one question is enough.
    for at in list(middles)[-1:] if len(middles) == 2 else middles:
        others_mm = np.array([middle_mm for other, middle_mm in middles.items() if other != at]).T
        if not others_mm.size:
            return
        off_mm = np.abs(middles[at] - row_medians(others_mm))
        off_mm = off_mm[~np.isnan(off_mm)]
        far_mm = max(LIMITS.zero_mm, LIMITS.slip_sd * spread_mm(others_mm))
        if len(off_mm) >= LEAST and float(np.median(off_mm)) > far_mm:
            finding = f"this column differs from the other repeats by {np.median(off_mm):.3g} mm at half of the places."
            yield _doubt(header, by_index[at], finding)


def _of_places(header: Header) -> Iterator[Doubt]:
    """Yield doubts about places whose column has another name than one of places."""
    station = header.station
    if (what := meaning(station.name)) is not None and what.role == "station":
        return
    places = _numbers(header, station.index)
    is_sorted = _is_sorted(places) or len(set(places)) < len(places)  # Passes of a long sheet begin again
    left_out = [
        column
        for column in header.skipped
        if column.index < station.index and _may_be_places(column, _numbers(header, column.index), len(places))
    ]
    findings = {
        "the places neither rise nor fall from row to row": not is_sorted,
        f"the place {min(places, default=0):g} is before the crack": min(places, default=0) < 0,
        f"column {', '.join(letters(one.index) for one in left_out)} beside it, which is not read, may be the places": (
            bool(left_out)
        ),
    }
    if any(findings.values()):
        yield _doubt(header, station, f"{'; '.join(text for text, applies in findings.items() if applies)}.")


def _may_be_places(column: Column, numbers: Sequence[float], places: int) -> bool:
    what = meaning(column.name)
    counts = all(after - before == 1 for before, after in pairwise(numbers))
    is_open = what is None or what.role == "station"
    return is_open and len(numbers) >= max(places, LEAST) and _is_sorted(numbers, strictly=True) and not counts


def _numbers(header: Header, column: int) -> list[float]:
    return [value for row in header.body if (value := only_number(row.cell(column))) is not None]


def _is_sorted(values: Sequence[float], *, strictly: bool = False) -> bool:
    steps = [after - before for before, after in pairwise(values)]
    return not steps or min(steps) >= 0 + strictly * 1e-9 or max(steps) <= 0 - strictly * 1e-9


def _of_repeats(header: Header) -> Iterator[Doubt]:
    """Yield a doubt about a column of repeats with far more labels than any place has readings."""
    if (column := header.repeat) is None:
        return
    labels = {row.cell(column.index).text for row in header.body}
    most = max(Counter(row.cell(header.station.index).text for row in header.body).values(), default=0)
    if len(labels) > max(MOST_LABELS, MOST_LABELS * most):
        finding = f"column {letters(column.index)} numbers {len(labels)} repeats, but no place has more than {most}."
        yield _doubt(header, column, finding)


def _of_missing(grid: SheetGrid, header: Header, missing: Sequence[str]) -> Iterator[Doubt]:
    """Yield a doubt about a declared word that is a number among the readings, and neither zero nor a code of nines."""
    columns, rows = [column.index for column in header.readings], {row.number for row in header.body}
    read = [value for at in columns for value in _numbers(header, at)] or [0.0]
    margin = MARGIN * (max(read) - min(read))
    for word in missing:
        value = number(word, None)
        if not value or NINES.fullmatch(f"{abs(value):.8g}"):
            continue
        own = [row for row in grid.rows if row.number in rows and min(read) - margin <= value <= max(read) + margin]
        places = [(row.number, at) for row in own for at in columns if row.cell(at).text == word]
        for row, at in places[:1]:
            answers = tuple(f"{letters(column)}{row}" for row, column in places)
            finding = f"missing has {word}, which may be a reading like the others."
            yield Doubt("column", row, at, answers, finding, "Correct missing")
