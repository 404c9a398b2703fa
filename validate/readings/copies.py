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
AT_MEAN = 0.02  # Probability that a row's place is the mean of the others'
ROUNDING_MM = 1e-6  # Least distance of two means, more than binary fractions leave
HAND_MM = 0.05  # Least standard deviation of a reading by hand
COPIED = 0.35  # Probability of equal columns by rounding below which they are copies; few sheets are so coarse


def mean_rows(cells: ReadCells) -> Iterator[Doubt]:
    """Yield the row that holds the mean of all others, or of all rows above it, in every column."""
    values_mm, s_mm = cells.readings_mm, cells.s_mm
    first_row = np.nanmin(np.where(np.isnan(values_mm), np.inf, cells.rows), axis=1)
    for i in range(len(s_mm)):
        here = ~np.isnan(values_mm[i])
        for others in (np.arange(len(s_mm)) != i, first_row < first_row[i]):
            counts = (~np.isnan(values_mm[others])).sum(axis=0)
            if (counts[here] < 3).any():
                continue
            means_mm = np.nanmean(values_mm[others][:, here], axis=0)
            if (np.abs(values_mm[i, here] - means_mm) > _half_digit_mm(cells.digits_mm[i, here])).any():
                continue
            # The first column agrees by chance as levels lie close, and the others as repeats do.
            half_mm = max(_half_digit_mm(cells.digits_mm[i, here]), last_digit_mm(values_mm[others]) / 2)
            scales_mm = np.full(here.sum(), spread_mm(values_mm[others]))
            # In its place among its neighbours the mean may be a level like theirs.
            bent_mm = abs(cells.stations_mm[i] - expected_mm(cells.stations_mm, i, np.inf))
            expected = bent_mm < SLIP_NEAR * scales_mm[0] and i in (first_row.argsort()[i], first_row.argsort()[~i])
            if not expected:
                scales_mm[0] = max(float(np.nanstd(cells.stations_mm[others])), LEAST_SPREAD_MM)
            place_mm = float(np.mean(s_mm[others]))
            at_mean = abs(s_mm[i] - place_mm) <= max(0.07, 0.005 * place_mm)
            chance = float(np.minimum(1.0, 0.8 * half_mm / scales_mm).prod())
            chance *= len(s_mm) if not at_mean else 1.0 if expected else AT_MEAN
            if chance < MEAN_ROW_BY_CHANCE:
                row = int(first_row[i])
                found = f"the row at s = {s_mm[i]:g} mm holds the mean of {others.sum()} other rows in every column."
                yield Doubt("mean row", row, cells.station_column, (f"{row}",), found, "Take it out of the table")
                return


def _half_digit_mm(digits_mm: Floats) -> float:
    """Return half of the finest digit of a mean, to which it was rounded, and a little for binary fractions."""
    return 0.5 * float(digits_mm.min()) + ROUNDING_MM


def alike_columns(cells: ReadCells) -> Iterator[Doubt]:
    """Yield repeats that are copies of another one, or the mean of all others."""
    values_mm, copies = cells.readings_mm, set[int]()
    repeats = range(values_mm.shape[1])
    # Repeats that differ by a hand's scatter are rounded to one value as often as this.
    rounded = max(0.1, 1 - 1.13 * HAND_MM / max(last_digit_mm(values_mm), HAND_MM))
    pairs = {(a, b): ~np.isnan(values_mm[:, [a, b]]).any(axis=1) for a, b in combinations(repeats, 2)}
    shares = {
        (a, b): float((values_mm[both, a] == values_mm[both, b]).mean())
        for (a, b), both in pairs.items()
        if both.sum() >= 3
    }
    usual = [share for share in shares.values() if share < 1]
    for (a, b), share in shares.items():
        limit = COPY_BY_CHANCE if usual else COPIED
        if share == 1 and b not in copies and max(rounded, *usual, 0.0) ** int(pairs[a, b].sum()) < limit:
            copies.add(b)
            what = f"a copy of the one in {_named(cells, a)[1]}, reading by reading"
            yield _on_column(cells, "copy", b, what)
    for j in (j for j in repeats if j not in copies):
        others = [k for k in repeats if k != j and k not in copies]
        known = ~np.isnan(values_mm[:, j]) & (~np.isnan(values_mm[:, others])).any(axis=1)
        if len(others) < 2 or known.sum() < 3:
            continue
        half_mm = _half_digit_mm(cells.digits_mm[known, j])
        off_mm = np.abs(values_mm[known, j] - np.nanmean(values_mm[known][:, others], axis=1))
        by_chance = min(1.0, 0.8 * half_mm / spread_mm(values_mm[:, others])) ** int(known.sum())
        if (off_mm <= half_mm).all() and by_chance < MEAN_COLUMN_BY_CHANCE:
            yield _on_column(cells, "mean column", j, f"the mean of the other {len(others)} at every station")
            return


def _named(cells: ReadCells, j: int) -> tuple[int, str, str]:
    """Return row and name of the place of a repeat, and its answer: its column, or in a long sheet its first cell."""
    column = int(cells.columns[j])
    if (cells.columns == column).sum() == 1:
        return cells.header_row, f"column {letters(column)}", letters(column)
    row = int(cells.rows[np.flatnonzero(~np.isnan(cells.readings_mm[:, j]))[0], j])
    return row, f"cell {cell_name(row, column)}", cell_name(row, column)


def _on_column(cells: ReadCells, kind: Literal["copy", "mean column"], j: int, what: str) -> Doubt:
    row, _, answer = _named(cells, j)
    return Doubt(kind, row, int(cells.columns[j]), (answer,), f"this repeat is {what}.", "Take it out of the repeats")
