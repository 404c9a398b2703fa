"""Screens for rows and repeats that are computed or copied from others: means, and columns that are alike."""

from collections.abc import Iterator
from itertools import combinations
from typing import Literal

import numpy as np

from sealtwin.core.records import Floats
from validate.readings.screens import (
    LEAST_SPREAD_MM,
    SLIP_NEAR,
    Doubt,
    ReadCells,
    cell_name,
    expected_mm,
    last_digit_mm,
    spread_mm,
)
from validate.readings.sheet import letters

MEAN_ROW_BY_CHANCE, MEAN_COLUMN_BY_CHANCE, COPY_BY_CHANCE = 3e-3, 1e-2, 1e-3
"""Probabilities below which digits that agree do not do so by chance."""
ROUNDING_MM = 1e-6  # Least distance of two means, more than binary fractions leave
HAND_MM = 0.05  # Least standard deviation of a reading by hand
COPIED = 0.35  # Probability of equal columns by rounding below which they are copies; few sheets are so coarse


def mean_rows(cells: ReadCells) -> Iterator[Doubt]:
    """Yield the row that holds the mean of all others, or of all rows above it, in every column."""
    values_mm, s_mm, middle_mm = cells.readings_mm, cells.s_mm, cells.stations_mm
    first_row = np.nanmin(np.where(np.isnan(values_mm), np.inf, cells.rows), axis=1)
    for above in (False, True):
        for i in _rows_of_means(cells, first_row, above=above):
            here = ~np.isnan(values_mm[i])
            others = first_row < first_row[i] if above else np.arange(len(s_mm)) != i
            half_mm = max(_half_digit_mm(cells.digits_mm[i, here]), last_digit_mm(values_mm[others]) / 2)
            # The first column agrees by chance as levels lie close, the others, and all in a place where the mean is
            # expected, as repeats do.
            scales_mm = np.full(here.sum(), spread_mm(values_mm[others]))
            in_order = _is_monotonic(first_row) or not _is_monotonic(first_row[others])
            bent_mm = abs(middle_mm[i] - expected_mm(middle_mm, i, np.inf))
            expected = in_order and bent_mm < SLIP_NEAR * scales_mm[0]
            if not expected:
                scales_mm[0] = max(float(np.nanstd(middle_mm[others])), LEAST_SPREAD_MM)
            chance = float(np.minimum(1.0, 0.8 * half_mm / scales_mm).prod())
            place = float(np.mean(s_mm[others]))
            if abs(s_mm[i] - place) > max(0.07, 0.005 * place):
                chance *= len(s_mm)
            elif not expected:
                chance *= 0.02
            chance *= 1.0 if in_order else 0.05
            if chance < MEAN_ROW_BY_CHANCE:
                row = int(first_row[i])
                found = f"the row at s = {s_mm[i]:g} mm holds the mean of {others.sum()} other rows in every column."
                yield Doubt("mean row", row, cells.station_column, (f"{row}",), found, "Take it out of the table")
                return


def _rows_of_means(cells: ReadCells, first_row: Floats, *, above: bool) -> list[int]:
    """Return the rows that hold, to their digits, the means of three other rows or more."""
    read = ~np.isnan(cells.readings_mm)
    values_mm = np.where(read, cells.readings_mm, 0.0)
    if above:
        order = np.argsort(first_row, kind="stable")
        sums_mm, counts = np.empty_like(values_mm), np.empty(values_mm.shape)
        sums_mm[order] = np.cumsum(values_mm[order], axis=0) - values_mm[order]
        counts[order] = np.cumsum(read[order], axis=0) - read[order]
    else:
        sums_mm, counts = values_mm.sum(axis=0) - values_mm, read.sum(axis=0) - read
    means_mm = sums_mm / np.maximum(counts, 1)
    halves_mm = 0.5 * np.where(read, cells.digits_mm, np.inf).min(axis=1, keepdims=True) + ROUNDING_MM
    agree = (np.abs(values_mm - means_mm) <= halves_mm) & (counts >= 3)
    return np.flatnonzero((agree | ~read).all(axis=1) & read.any(axis=1)).tolist()


def _is_monotonic(rows: Floats) -> bool:
    steps = np.diff(rows)
    return bool((steps > 0).all() or (steps < 0).all())


def _half_digit_mm(digits_mm: Floats) -> float:
    """Return half of the finest digit of a mean, to which it was rounded, and a little for binary fractions."""
    return 0.5 * float(digits_mm.min()) + ROUNDING_MM


def alike_columns(cells: ReadCells) -> Iterator[Doubt]:
    """Yield repeats that are copies of another one, or the mean of all others."""
    values_mm = cells.readings_mm
    repeats = values_mm.shape[1]
    if repeats < 2 or len(values_mm) < 3:
        return
    copies = set[int]()
    # Repeats that differ by a hand's scatter are rounded to one value as often as this, and less where they do not.
    rounded = max(0.1, 1 - 1.13 * HAND_MM / max(last_digit_mm(values_mm), HAND_MM))
    pairs = {(a, b): values_mm[:, a] == values_mm[:, b] for a, b in combinations(range(repeats), 2)}
    both = {(a, b): ~np.isnan(values_mm[:, [a, b]]).any(axis=1) for a, b in pairs}
    shares = {pair: float(pairs[pair][both[pair]].mean()) for pair in pairs if both[pair].sum() >= 3}
    usual = [share for share in shares.values() if share < 1]
    for (a, b), share in shares.items():
        if share < 1 or b in copies:
            continue
        count = int(both[a, b].sum())
        if max(rounded, *usual, 0.0) ** count < (COPY_BY_CHANCE if usual else COPIED):
            copies.add(b)
            found = f"this repeat is a copy of the one in {_column_name(cells, a)}, reading by reading."
            yield _on_column(cells, "copy", b, found)
    for j in range(repeats):
        others = [k for k in range(repeats) if k != j and k not in copies]
        known = ~np.isnan(values_mm[:, j]) & (~np.isnan(values_mm[:, others])).any(axis=1)
        if j in copies or len(others) < 2 or known.sum() < 3:
            continue
        means_mm = np.nanmean(values_mm[known][:, others], axis=1)
        half_mm = _half_digit_mm(cells.digits_mm[known, j])
        if (np.abs(values_mm[known, j] - means_mm) > half_mm).any():
            continue
        own_mm = spread_mm(values_mm[:, others])
        if min(1.0, 0.8 * half_mm / own_mm) ** int(known.sum()) < MEAN_COLUMN_BY_CHANCE:
            found = f"this repeat is the mean of the other {len(others)} at every station."
            yield _on_column(cells, "mean column", j, found)
            return


def _column_name(cells: ReadCells, j: int) -> str:
    own = (cells.columns == cells.columns[j]).sum() == 1
    return (
        f"column {letters(int(cells.columns[j]))}"
        if own
        else f"cell {cell_name(int(cells.rows[0, j]), int(cells.columns[j]))}"
    )


def _on_column(cells: ReadCells, kind: Literal["copy", "mean column"], j: int, found: str) -> Doubt:
    """Return a doubt on a repeat: its column, or in a long sheet its first cell."""
    first = int(np.flatnonzero(~np.isnan(cells.readings_mm[:, j]))[0])
    own = (cells.columns == cells.columns[j]).sum() == 1
    row, column = cells.header_row if own else int(cells.rows[first, j]), int(cells.columns[j])
    return Doubt(
        kind, row, column, (letters(column) if own else cell_name(row, column),), found, "Take it out of the repeats"
    )
