"""Checks for suspicious readings. Each yields doubts with their cells; none changes a value."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.records import Floats
from validate.readings.sheet import letters

Ints = NDArray[np.int64]
OfCell = Literal["zero", "sign slip", "code"]
Kind = OfCell | Literal["scatter", "mean row", "mean column", "copy", "sign", "unit", "datum", "direction"]

NINES = re.compile(r"9{2,}(\.9+)?|9\.9{2,}")  # A number that programs write for a missing reading, without its sign
STEPS_MM = (1.0, 0.5, 0.25, 0.2, 0.1, 0.05)  # Usual last digits, the largest first
MEDIAN_OF_SPREADS = {2: 0.674, 3: 0.833, 4: 0.888, 5: 0.916}
"""Median standard deviation of so many normal readings, as a share of the true standard deviation."""


@dataclass(frozen=True)
class CellLimits:
    """Limits of the checks of cells, rows and columns; "sd" is the standard deviation of a single reading.

    They were set on synthetic sheets whose seeds ``benchmarks/ingest.py`` does not use: planted mistakes are found, and
    at most 5 % of sound sheets are questioned. A stricter limit (smaller distance or ratio, larger probability) finds
    smaller mistakes and questions more sound sheets.
    """

    least_spread_mm: float = 0.02  # Smallest sd: the limit of error of a digital caliper, which no hand repeats better
    zero_sd: float = 4.2  # Distance from its peers, in sd, above which 0.00 is suspicious
    zero_mm: float = 1.0  # The smallest such distance, in mm
    deep_mm: float = 1.5  # Depth of the neighbours above which a station of zeros, or of the other sign, is suspicious
    deep_at_end_mm: float = 4.0  # The same depth at an end of the sheet
    slip_sd: float = 8.0  # Distance from its peers, in sd, above which a reading of the other sign is suspicious
    opposite_sd: float = 4.0  # Distance of its opposite from its peers, in sd, below which it has a wrong sign
    slip_share: float = 0.35  # Share of a level by which scattered repeats may differ from it
    neighbour_share: float = 0.15  # Share of a level by which scattered neighbours may differ from it
    scatter: float = 9.0  # Ratio of a station's spread to that of its neighbours; about ten, since theirs is uncertain
    mean_row_chance: float = 3e-3  # Probability of chance agreement below which a row is the mean of others
    mean_column_chance: float = 1e-2  # Probability of chance agreement below which a column is the mean of others
    copy_chance: float = 1e-3  # Probability of chance agreement below which a column is a copy
    at_mean: float = 0.02  # Probability that a row's position is the mean of the others' by chance
    rounding_mm: float = 1e-6  # Margin for two equal means, above the error of binary fractions
    hand_mm: float = 0.05  # Smallest sd of a reading by hand
    copied: float = 0.35
    """Equal columns are copies if rounding makes them equal with a probability below this. Few sheets are so coarse."""


LIMITS = CellLimits()


@dataclass(frozen=True)
class ReadCells:
    """Readings of a sheet as written, in mm, the levels that they mean, and their cells."""

    s_mm: Floats  # (n,), increasing
    readings_mm: Floats  # (n, r), in the direction of the sheet; NaN for a missing one
    levels_mm: Floats  # (n, r), upward from the face
    rows: Ints  # (n, r): row of each reading, from 1
    columns: Ints  # (r,): column of each repeat, from 0
    digits_mm: Floats  # (n, r): place value of each reading's last digit that is not 0
    is_depth: bool  # True if the sheet counts downward
    station_column: int = 0
    header_row: int = 1
    declared_unit_mm: float | None = None  # Unit of s if the sheet itself names none, else None

    @property
    def stations_mm(self) -> Floats:
        """Median reading of each station, (n,); NaN if all of them are missing."""
        return row_medians(self.readings_mm)

    def from_other_end(self, length_mm: float) -> "ReadCells":
        """Return the readings with s counted from the other end of a crack of length ``length_mm``."""
        turned = {name: getattr(self, name)[::-1] for name in ("readings_mm", "levels_mm", "rows", "digits_mm")}
        return replace(self, s_mm=length_mm - self.s_mm[::-1], **turned)

    def without(self, masked: NDArray[np.bool_]) -> "ReadCells":
        """Return the readings with those in ``masked`` set to missing."""
        return replace(
            self,
            readings_mm=np.where(masked, np.nan, self.readings_mm),
            levels_mm=np.where(masked, np.nan, self.levels_mm),
        )


@dataclass(frozen=True)
class Doubt:
    """A possible mistake in a sheet, its cell, and the entries of ``readings.as_written`` that confirm the value."""

    kind: Kind | Literal["struck", "hidden", "column"]
    row: int  # From 1
    column: int  # From 0
    answers: tuple[str, ...]
    finding: str
    remedy: str


def row_medians(values: Floats) -> Floats:
    """Return the median of each row, (n,), ignoring NaN. A row of NaN gives NaN."""
    medians = np.full(len(values), np.nan)
    some = ~np.isnan(values).all(axis=1)
    medians[some] = np.nanmedian(values[some], axis=1)
    return medians


def last_digit_mm(readings_mm: Floats) -> float:
    """Return the largest usual step that divides all readings; 0 if there is none."""
    read_mm = readings_mm[~np.isnan(readings_mm)]
    return next((step for step in STEPS_MM if (np.abs(read_mm - step * np.round(read_mm / step)) < 1e-6).all()), 0.0)


def spread_mm(readings_mm: Floats) -> float:
    """Return the typical standard deviation of a single reading.

    Without repeats it follows from the scatter along s.
    """
    count = (~np.isnan(readings_mm)).sum(axis=1)
    several = count > 1
    least_mm = max(LIMITS.least_spread_mm, 0.4 * last_digit_mm(readings_mm))
    if several.sum() >= 3:
        spreads_mm = np.nanstd(readings_mm[several], axis=1, ddof=1)
        usual = MEDIAN_OF_SPREADS.get(int(np.median(count[several])), 1.0)
        return max(least_mm, float(np.median(spreads_mm)) / usual)
    middle_mm = row_medians(readings_mm)
    middle_mm = middle_mm[~np.isnan(middle_mm)]
    if len(middle_mm) < 4:
        return max(least_mm, 0.5)
    bends_mm = np.abs(middle_mm[1:-1] - (middle_mm[:-2] + middle_mm[2:]) / 2)
    return max(least_mm, 1.48 * float(np.median(bends_mm)) / 1.22)


def doubtful_cells(cells: ReadCells) -> Iterator[tuple[Doubt, NDArray[np.bool_]]]:
    """Yield doubts about single readings and about whole stations, each with a mask of its reading, (n, r)."""
    read = ~np.isnan(cells.readings_mm)
    of_stations: list[tuple[tuple[int, int], OfCell]] = [
        ((i, int(j)), kind) for i, kind in _odd_stations(cells) for j in np.flatnonzero(read[i])
    ]
    for (i, j), kind in (*sorted((_odd_readings(cells) | _codes(cells)).items()), *of_stations):
        mask = np.zeros_like(read)
        mask[i, j] = True
        yield _on_cell(cells, kind, i, j), mask


def _on_cell(cells: ReadCells, kind: OfCell, i: int, j: int) -> Doubt:
    row, column = int(cells.rows[i, j]), int(cells.columns[j])
    beside_mm, peers = np.delete(cells.readings_mm[i], j), "the other readings there"
    if not np.nan_to_num(beside_mm).any():
        beside_mm = cells.stations_mm[[k for k in (i - 1, i + 1) if 0 <= k < len(cells.s_mm)]]
        peers = "its neighbours"
    shown = " and ".join(f"{one:.4g}" for one in beside_mm if not np.isnan(one))
    value = f"the reading {cells.readings_mm[i, j]:g} mm at s = {cells.s_mm[i]:g} mm differs from {peers} ({shown} mm)"
    may, remedy = "it may be a code for a missing reading", "Clear it"
    if kind == "sign slip":
        may, remedy = "it may have the wrong sign", "Correct it"
    return Doubt(kind, row, column, (cell_name(row, column),), f"{value}: {may}.", remedy)


def cell_name(row: int, column: int) -> str:
    return f"{letters(column)}{row}"


def _odd_readings(cells: ReadCells) -> dict[tuple[int, int], OfCell]:
    """Return the cells that are 0, or have the opposite sign, unlike the other repeats of their station."""
    values_mm, stations_mm, one_mm = cells.readings_mm, cells.stations_mm, spread_mm(cells.readings_mm)
    odd: dict[tuple[int, int], OfCell] = {}
    mixed = (values_mm >= 0).any(axis=1) & (values_mm <= 0).any(axis=1)
    for i in np.flatnonzero(mixed).tolist():
        row_mm = values_mm[i]
        for j in np.flatnonzero(~np.isnan(row_mm)):
            peers_mm = np.delete(row_mm, j)
            peers_mm = peers_mm[~np.isnan(peers_mm)]
            if not len(peers_mm):
                continue
            value, middle = row_mm[j], float(np.median(peers_mm))
            if value == 0 and peers_mm.any():
                # Another 0 does not confirm a 0; if few others are not 0, one of them may be wrong itself.
                others_mm, far_mm = peers_mm[peers_mm != 0], max(LIMITS.zero_mm, LIMITS.zero_sd * one_mm)
                alone = 2 * len(others_mm) <= len(peers_mm)
                beside_mm = expected_mm(stations_mm, i, 0.0) if alone else np.inf
                if min(abs(float(np.median(others_mm))), abs(beside_mm)) > far_mm:
                    odd[i, int(j)] = "zero"
            slipped = value * middle < 0 and abs(value - middle) > max(LIMITS.zero_mm, LIMITS.slip_sd * one_mm)
            # Of only two readings, the one that differs in sign from its neighbouring stations is wrong.
            slipped &= len(peers_mm) > 1 or value * expected_mm(stations_mm, i, middle) < 0
            opposite_mm = LIMITS.opposite_sd * one_mm
            near_mm = max(opposite_mm, min(LIMITS.slip_share * abs(middle), 2 * opposite_mm))
            if slipped and abs(value + middle) < near_mm:
                odd[i, int(j)] = "sign slip"
    return odd


def _codes(cells: ReadCells) -> dict[tuple[int, int], OfCell]:
    """Return the cells with only nines, such as 999, that are farther from the other readings than their own range."""
    values_mm = cells.readings_mm
    nines = np.array([[NINES.fullmatch(f"{abs(value):.8g}") is not None for value in row] for row in values_mm])
    others_mm = values_mm[~nines & ~np.isnan(values_mm)]
    if not len(others_mm):
        return {}
    low_mm, high_mm = others_mm.min(), others_mm.max()
    far = np.maximum(low_mm - values_mm, values_mm - high_mm) > max(LIMITS.zero_mm, high_mm - low_mm)
    return {(int(i), int(j)): "code" for i, j in np.argwhere(nines & far)}


def expected_mm(stations_mm: Floats, i: int, otherwise: float) -> float:
    """Return the mean of the neighbouring stations, or ``otherwise`` without neighbours."""
    beside = [stations_mm[k] for k in (i - 1, i + 1) if 0 <= k < len(stations_mm) and not np.isnan(stations_mm[k])]
    return float(np.mean(beside)) if beside else otherwise


def _odd_stations(cells: ReadCells) -> Iterator[tuple[int, OfCell]]:
    """Yield stations whose readings are all 0, or all of the opposite sign, between deep neighbours."""
    middle_mm, one_mm = cells.stations_mm, spread_mm(cells.readings_mm)
    stations = np.flatnonzero(~np.isnan(middle_mm))
    if len(stations) < 4:
        return
    for place, i in enumerate(stations):
        row_mm = cells.readings_mm[i][~np.isnan(cells.readings_mm[i])]
        before, after = place - 1, place + 1
        at_end = before < 0 or after >= len(stations)
        if at_end:
            inward = stations[[1, 2]] if place == 0 else stations[[-2, -3]]
            a, b = middle_mm[inward]
        else:
            a, b = middle_mm[stations[before]], middle_mm[stations[after]]
        if a * b <= 0:
            continue
        nearer, farther = sorted((abs(a), abs(b)))
        if (row_mm == 0).all():
            # At an end the crack may be filled: the level then rises towards it.
            flat_mm = max(0.1 * farther, one_mm)
            even = nearer > LIMITS.deep_at_end_mm and abs(abs(a) - abs(b)) < flat_mm
            deep = nearer > LIMITS.deep_mm and nearer > 3 * min(one_mm, 1.0)
            if deep and (even if at_end else nearer > 0.2 * farther):
                yield int(i), "zero"
            continue
        value = float(middle_mm[i])
        # If only one of several readings has the other sign, it is a doubt of its own.
        if value * a >= 0 or not (row_mm * value > 0).all():
            continue
        scattered_mm = min(LIMITS.opposite_sd * one_mm, 3 * LIMITS.neighbour_share * abs(value))
        slack_mm = max(0.2, LIMITS.neighbour_share * abs(value), scattered_mm)
        low, high = nearer - slack_mm, farther + slack_mm
        if at_end:
            ahead = abs(2 * a - b)
            low, high = min(abs(a), ahead) - slack_mm, max(abs(a), ahead) + slack_mm
        if abs(value) > (2 * LIMITS.deep_mm if at_end else LIMITS.deep_mm) and low <= abs(value) <= high:
            yield int(i), "sign slip"


def scattered_stations(cells: ReadCells) -> Iterator[Doubt]:
    """Yield doubts about stations whose repeats scatter far more than those of their neighbours and of the sheet."""
    values_mm = cells.readings_mm
    several = (~np.isnan(values_mm)).sum(axis=1) > 1
    if several.sum() < 4:
        return
    where = np.flatnonzero(several)
    spreads_mm = np.nanstd(values_mm[where], axis=1, ddof=1)
    least_mm = max(LIMITS.least_spread_mm, 0.4 * last_digit_mm(values_mm))
    far = spreads_mm > LIMITS.scatter * least_mm
    for place, i in zip(np.flatnonzero(far).tolist(), where[far].tolist(), strict=True):
        # Four neighbours, at an end all on one side: the spread of fewer is too uncertain.
        first_near = min(max(place - 2, 0), max(len(where) - 5, 0))
        near = [k for k in range(first_near, min(first_near + 5, len(where))) if k != place]
        others_mm = float(np.median(np.delete(spreads_mm, place)))
        usual_mm = max(least_mm, others_mm, 0.5 * float(np.median(spreads_mm[near])))
        if spreads_mm[place] > LIMITS.scatter * usual_mm:
            first = int(np.flatnonzero(~np.isnan(values_mm[i]))[0])
            row = int(cells.rows[i, first])
            finding = (
                f"the readings at s = {cells.s_mm[i]:g} mm scatter by {spreads_mm[place]:.2g} mm, "
                f"{spreads_mm[place] / usual_mm:.0f} times the usual scatter ({usual_mm:.2g} mm)."
            )
            yield Doubt("scatter", row, cells.station_column, (f"{row}",), finding, "Correct the row")


def mean_rows(cells: ReadCells) -> Iterator[Doubt]:
    """Yield a doubt about the row that is the mean of all other rows, or of all rows above it, in every column."""
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
            # The first column may agree by chance as close levels do, the others as repeats do.
            half_mm = max(_half_digit_mm(cells.digits_mm[i, here]), last_digit_mm(values_mm[others]) / 2)
            scales_mm = np.full(here.sum(), spread_mm(values_mm[others]))
            # Between its neighbours the row may simply have a level like theirs.
            bent_mm = abs(cells.stations_mm[i] - expected_mm(cells.stations_mm, i, np.inf))
            in_order = i in (first_row.argsort()[i], first_row.argsort()[~i])
            expected = in_order and bent_mm < LIMITS.opposite_sd * scales_mm[0]
            if not expected:
                scales_mm[0] = max(float(np.nanstd(cells.stations_mm[others])), LIMITS.least_spread_mm)
            place_mm = float(np.mean(s_mm[others]))
            at_mean = abs(s_mm[i] - place_mm) <= max(0.07, 0.005 * place_mm)
            chance = float(np.minimum(1.0, 0.8 * half_mm / scales_mm).prod())
            chance *= len(s_mm) if not at_mean else 1.0 if expected else LIMITS.at_mean
            if chance < LIMITS.mean_row_chance:
                row = int(first_row[i])
                finding = f"the row at s = {s_mm[i]:g} mm is the mean of {others.sum()} other rows in every column."
                yield Doubt("mean row", row, cells.station_column, (f"{row}",), finding, "Remove it from the table")
                return


def _half_digit_mm(digits_mm: Floats) -> float:
    """Return the rounding error of a mean: half a unit in its finest digit, plus a margin for binary fractions."""
    return 0.5 * float(digits_mm.min()) + LIMITS.rounding_mm


def alike_columns(cells: ReadCells) -> Iterator[Doubt]:
    """Yield doubts about repeats that are copies of another repeat, or the mean of all others."""
    values_mm, copies = cells.readings_mm, set[int]()
    repeats = range(values_mm.shape[1])
    # Probability that repeats with the scatter of a hand are rounded to the same value.
    rounded = max(0.1, 1 - 1.13 * LIMITS.hand_mm / max(last_digit_mm(values_mm), LIMITS.hand_mm))
    pairs = {(a, b): ~np.isnan(values_mm[:, [a, b]]).any(axis=1) for a, b in combinations(repeats, 2)}
    shares = {
        (a, b): float((values_mm[both, a] == values_mm[both, b]).mean())
        for (a, b), both in pairs.items()
        if both.sum() >= 3
    }
    usual = [share for share in shares.values() if share < 1]
    for (a, b), share in shares.items():
        limit = LIMITS.copy_chance if usual else LIMITS.copied
        if share == 1 and b not in copies and max(rounded, *usual, 0.0) ** int(pairs[a, b].sum()) < limit:
            copies.add(b)
            what = f"a copy of the one in {_named(cells, a)[1]}, reading by reading"
            yield _on_column(cells, "copy", b, what)
    for j in (j for j in repeats if j not in copies):
        others = [k for k in repeats if k != j and k not in copies]
        compared = ~np.isnan(values_mm[:, j]) & (~np.isnan(values_mm[:, others])).any(axis=1)
        if len(others) < 2 or compared.sum() < 3:
            continue
        half_mm = _half_digit_mm(cells.digits_mm[compared, j])
        off_mm = np.abs(values_mm[compared, j] - np.nanmean(values_mm[compared][:, others], axis=1))
        by_chance = min(1.0, 0.8 * half_mm / spread_mm(values_mm[:, others])) ** int(compared.sum())
        if (off_mm <= half_mm).all() and by_chance < LIMITS.mean_column_chance:
            yield _on_column(cells, "mean column", j, f"the mean of the other {len(others)} repeats at every station")
            return


def _named(cells: ReadCells, j: int) -> tuple[int, str, str]:
    """Return row, name and answer of a repeat. They refer to its column, or to its first cell in a long sheet."""
    column = int(cells.columns[j])
    if (cells.columns == column).sum() == 1:
        return cells.header_row, f"column {letters(column)}", letters(column)
    row = int(cells.rows[np.flatnonzero(~np.isnan(cells.readings_mm[:, j]))[0], j])
    return row, f"cell {cell_name(row, column)}", cell_name(row, column)


def _on_column(cells: ReadCells, kind: Literal["copy", "mean column"], j: int, what: str) -> Doubt:
    row, _, answer = _named(cells, j)
    return Doubt(kind, row, int(cells.columns[j]), (answer,), f"this repeat is {what}.", "Remove it from the repeats")
