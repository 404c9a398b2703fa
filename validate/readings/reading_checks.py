"""Find suspicious readings. Each function yields possible mistakes and their cells, and none changes a value."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from sealtwin.core.arrays import runs
from sealtwin.core.doubts import CONFIRMS, Doubt, Location
from sealtwin.core.records import Booleans, Floats, Integers
from validate.readings.grid import letters

# Limits of the checks, in mm, in sd (the standard deviation of a single reading), or as fractions. They were chosen on
# synthetic sheets whose seeds benchmarks/ingest.py does not use, so that planted mistakes are found and few correct
# sheets are questioned. A stricter limit (smaller distance or ratio, larger probability) finds smaller mistakes and
# questions more correct sheets.
MIN_SPREAD_MM = 0.02  # Smallest sd, since nobody repeats a reading more closely than a caliper's limit of error
USUAL_SPREAD_MM = 0.5  # sd that is assumed if there are too few readings to estimate it
CHANCE = 1e-6  # Readings are copies if chance would make them equal less often than this
FEWEST_COPIED = 3  # Smallest number of stations in a copied block
FEWEST_SHIFTED = 8  # Smallest number of stations of a shifted repeat
SHIFTED = 0.35  # A repeat is shifted if moving it by a station reduces its mean distance to less than this fraction
JUMPS = ((-1.0, 0.35, "with the opposite sign"), (10.0, 0.15, "in centimetres"), (25.4, 0.15, "in inches"))
"""Factors that may explain a jump of the level, each with the largest fraction of the jump that it may leave, and its
words."""
JUMP_MM, JUMP_STEPS = 2.0, 3.0
"""Smallest suspicious jump, in mm and as a multiple of the step that seven in ten steps do not exceed. The limits were
chosen on 780 sheets of 14 stations whose sign was turned from some row on (5 % missed, whose levels were within 1 mm of
the face there), 500 each with centimetres and inches from some row on (4 % missed), and 1,500 sound sheets (1 %
remarked)."""
COMPARED = 5  # Smallest number of stations at which repeats are compared
FAR_MM = 1.0  # A repeat farther than this from the median at half of its stations is suspicious
SCATTER_SD = 5.4  # Scatter of a station's readings above which its outer readings are suspicious
ZERO_MM, ZERO_SD = 1.0, 4.2  # Suspicious distance of a 0 from the other readings of its station
DEEP_MM = 1.5  # Distance from both neighbours above which a station of zeros is suspicious
TURNED_MM = 3.0  # Distance from both neighbours above which a station with the opposite sign is suspicious
PEAK_MM = 15.0  # Distance from both neighbours above which any station is suspicious
SPAN = 0.2  # Fraction of the crack's length below which the span of all positions is suspicious
COUNTED = 0.5  # Same fraction of the length, for positions that only count 1, 2, 3
ABOVE_MM = 1.5  # Mean height above the face that is suspicious, because paste does not stay so high
TENTH = 0.13  # Fraction of the depth that contains all readings if centimetres were entered as mm
STEADY_MM = 0.033  # Spread of repeats too small for mm read by hand, but usual for cm entered as mm
FINEST_MM = 0.0015  # Last digit in mm that a caliper does not show, but cm with three decimals entered as mm do

REMEDIES = {
    "outlier": "Correct it, or clear it if it stands for a missing reading.",
    "repeat": "Remove it from the repeats.",
    "span": "Correct the unit in the header; a position is a distance in mm, not a count of stations.",
    "unit": "Correct the unit in the header.",
    "sign": "Correct the header: level counts upward from the face, depth downward.",
}
REMEDIES_OF_SCANS = {
    "unit": "Correct the unit of the heights.",
    "sign": "Heights that grow away from the sensor need a negative readings.placement.count_mm for a height map, "
    'readings.placement.up = "-z" for a camera\'s axes (x right, y down), or else an export with z out of the face.',
}
ANSWERS: dict[str, dict[str, Any]] = {"span": {CONFIRMS: ["unit"]}}
"""Answers to doubts of some kinds, in addition to the cells or the kind itself."""
REMARKS = ("outlier", "repeat")
"""Kinds of doubts about some readings. All other kinds change what every reading means, so they must be answered."""
ALL = slice(None)


@dataclass(frozen=True)
class ReadCells:
    """Readings of a sheet as written, in mm, and their cells."""

    s_mm: Floats  # (n,), increasing
    readings_mm: Floats  # (n, r), in the direction of the sheet. NaN for a missing reading.
    rows: Integers  # (n, r): row of each reading, from 1. For a missing reading, a row of its station.
    columns: Integers  # (r,): column of each repeat, from 0
    digits_mm: Floats  # (n, r): place value of each reading's last digit that is not 0
    is_depth: bool = False  # True if the sheet counts downward
    datum_level_mm: float = 0.0  # Height of the datum above the face
    station_column: int = 0

    @property
    def levels_mm(self) -> Floats:
        """Levels from the readings, (n, r), upward from the face."""
        return (-self.readings_mm if self.is_depth else self.readings_mm) + self.datum_level_mm

    def from_other_end(self, length_mm: float) -> "ReadCells":
        """Return the readings with s measured from the other end of a crack of length ``length_mm``."""
        turned = {name: getattr(self, name)[::-1] for name in ("readings_mm", "rows", "digits_mm")}
        return replace(self, s_mm=length_mm - self.s_mm[::-1], **turned)


class SheetAndCrack(NamedTuple):
    """The cells of a sheet, and what is known about the crack."""

    cells: ReadCells
    depth_mm: float | None
    length_mm: float | None

    def profile_mm(self) -> tuple[Floats, Floats]:
        """Return s and median level, (k,) each, of the stations with a reading.

        Returns empty arrays for fewer than three stations.
        """
        level_mm = row_medians(self.cells.levels_mm)
        read = ~np.isnan(level_mm)
        read &= read.sum() > 2
        return self.cells.s_mm[read], level_mm[read]


class Finding(NamedTuple):
    """A possible mistake: in readings [i, j], in station i, in repeat j, or in the whole sheet."""

    kind: str
    sentence: str
    i: Any = ALL  # Index of a station
    j: Any = ALL  # List of the indices of repeats


Check = Callable[[SheetAndCrack], Iterator[Finding]]


def check_readings(
    sheet: SheetAndCrack, where: Location, checks: Sequence[Check] = (), remedies: Mapping[str, str] = REMEDIES
) -> list[Doubt]:
    """Return the warnings about readings. A reading that one check finds suspicious is missing in the next ones."""
    doubts = dict[Any, Doubt]()
    for screen in checks or CHECKS:
        readings_mm = sheet.cells.readings_mm.copy()
        for kind, sentence, i, j in screen(sheet):
            names = _names(sheet.cells, i, j)
            if names:
                readings_mm[i, j] = np.nan
            of_sheets = ANSWERS.get(kind, {}) if remedies is REMEDIES else {}
            answers = {CONFIRMS: list(names) or [kind], **of_sheets}
            kind_of_part = "row" if j is ALL else "column" if i is ALL else "cell"
            part = [f"{kind_of_part} {', '.join(names)}"] if names else []
            of_cells = where._replace(part=", ".join(filter(None, (where.part, *part))))
            is_remark = kind in REMARKS
            doubts.setdefault(names or kind, Doubt(kind, of_cells, sentence, remedies[kind], answers, names, is_remark))
        sheet = sheet._replace(cells=replace(sheet.cells, readings_mm=readings_mm))
    return list(doubts.values())


def check_scan(s_mm: Floats, level_mm: Floats, depth_mm: float, where: Location) -> list[Doubt]:
    """Return the warnings about the levels of a scan as a whole, (n,) each. That about their sign must be answered."""
    nowhere = np.zeros((len(s_mm), 1), dtype=int)
    cells = ReadCells(s_mm, level_mm[:, None], nowhere, nowhere[0], np.ones((len(s_mm), 1)))
    return check_readings(SheetAndCrack(cells, depth_mm, None), where, (heaps, impossible_levels), REMEDIES_OF_SCANS)


def _names(cells: ReadCells, i: Any, j: Any) -> tuple[str, ...]:
    """Return the names of the cells, the row or the column of a finding. Returns () for the whole sheet."""
    if j is ALL:
        return () if i is ALL else (f"{cells.rows[i].min()}",)
    columns = [letters(column) for column in cells.columns.tolist()]
    if i is ALL and columns.count(columns[j[0]]) == 1:
        return (columns[j[0]],)
    # If each reading has its own row, a repeat has no column. Its first cell then represents it.
    i = np.argmax(~np.isnan(cells.readings_mm[:, j[0]])) if i is ALL else i
    return tuple(f"{columns[column]}{cells.rows[i, column]}" for column in j)


def row_medians(values: Floats) -> Floats:
    """Return the median of each row, (n,), ignoring NaN. A row of only NaN gives NaN."""
    return np.ma.filled(np.ma.median(np.ma.masked_invalid(values), axis=1), np.nan)


def spread_mm(readings_mm: Floats) -> float:
    """Return the typical standard deviation of a single reading.

    Without repeats, it is estimated from the scatter along s.
    """
    off_mm = np.diff(readings_mm, axis=1) / np.sqrt(2)
    if (~np.isnan(off_mm)).sum() < 3:
        middle_mm = row_medians(readings_mm)
        off_mm = np.diff(middle_mm[~np.isnan(middle_mm)], n=2) / np.sqrt(6)
    off_mm = np.abs(off_mm[~np.isnan(off_mm)])
    if len(off_mm) < 2:
        return USUAL_SPREAD_MM
    # The smallest difference is the last digit, up to 1 mm, which hides less scatter.
    return max(MIN_SPREAD_MM, 0.6 * off_mm[off_mm > 0].min(initial=1.0), 1.48 * float(np.median(off_mm)))


def short_spans(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield a finding if all positions are in a small part of the crack."""
    s_mm, length_mm = sheet.cells.s_mm, sheet.length_mm
    if length_mm is not None and len(s_mm) > 2:
        counts, span_mm = np.allclose(np.diff(s_mm), 1.0), np.ptp(s_mm)
        if span_mm < (COUNTED if counts else SPAN) * length_mm:
            yield Finding("span", f"all positions are within {span_mm:.3g} mm; the crack is {length_mm:.3g} mm long.")


def copies(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield repeats that equal another repeat, and stations that equal others, so often that it cannot be chance."""
    # Another 0 does not confirm a 0.
    s_mm, values_mm = sheet.cells.s_mm, np.where(sheet.cells.readings_mm == 0, np.nan, sheet.cells.readings_mm)
    # Probability that two readings of one level are equal, for a normal distribution and the finest difference.
    digit_mm = np.diff(np.unique(values_mm[~np.isnan(values_mm)])).min(initial=1.0)
    equal = min(1.0, 0.28 * float(digit_mm) / spread_mm(values_mm))
    count, repeats = values_mm.shape
    for j in range(1, repeats):
        for other in range(j):
            begin, end = _longest_run(values_mm[:, j] == values_mm[:, other])
            if end - begin >= COMPARED and equal ** (end - begin) < CHANCE:
                sentence = f"this repeat equals another at all of {end - begin} stations from s = {s_mm[begin]:g} mm."
                yield Finding("repeat", sentence, j=[j])
                break
    for shift in range(1, count):
        same = ((values_mm[shift:] == values_mm[:-shift]) | np.isnan(values_mm[shift:])).all(axis=1)
        begin, end = _longest_run(same)
        if end - begin >= FEWEST_COPIED and equal ** ((end - begin) * repeats) < CHANCE:
            first = begin + shift
            sentence = (
                f"{end - begin} stations from s = {s_mm[first]:g} mm have the readings of those from {s_mm[begin]:g}."
            )
            yield Finding("repeat", sentence, first)


def _longest_run(which: Booleans) -> tuple[int, int]:
    """Return the begin and the end of the longest run of True values. Returns (0, 0) if there is none."""
    return max(map(tuple, runs(which).tolist()), key=lambda run: run[1] - run[0], default=(0, 0))


def shifted_columns(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield the repeat that is much nearer to the others if it is moved by one station."""
    values_mm = sheet.cells.readings_mm
    if len(values_mm) < FEWEST_SHIFTED or values_mm.shape[1] < 2:
        return
    best = 1.0, 0
    for j in range(values_mm.shape[1]):
        others_mm = row_medians(np.delete(values_mm, j, axis=1))
        away_mm = _mean_distance_mm(values_mm[:, j], others_mm)
        moved_mm = min(
            _mean_distance_mm(a, b) for a, b in ((values_mm[1:, j], others_mm[:-1]), (values_mm[:-1, j], others_mm[1:]))
        )
        best = min(best, (moved_mm / max(away_mm, MIN_SPREAD_MM), j))
    if best[0] < SHIFTED:
        yield Finding("repeat", "this repeat is far nearer to the others if it is moved by one station.", j=[best[1]])


def _mean_distance_mm(first_mm: Floats, second_mm: Floats) -> float:
    off_mm = np.abs(first_mm - second_mm)
    return float(np.mean(off_mm[~np.isnan(off_mm)])) if not np.isnan(off_mm).all() else np.inf


def far_columns(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield the repeat that is far from the others at most stations."""
    values_mm = sheet.cells.readings_mm
    far_mm = np.nan_to_num(row_medians(np.abs(values_mm - row_medians(values_mm)[:, None]).T))
    # Of two repeats that differ, either may be wrong: one question, about the second, is enough.
    if far_mm.max() > FAR_MM and len(values_mm) >= COMPARED:
        sentence = f"this repeat is {far_mm.max():.3g} mm or more from the median at half of the stations."
        yield Finding("repeat", sentence, j=np.flatnonzero(far_mm == far_mm.max())[-1:].tolist())


def outliers(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield readings that differ from the others of their station, and stations that differ from both neighbours."""
    cells, values_mm = sheet.cells, sheet.cells.readings_mm
    level_mm, sd_mm = row_medians(values_mm), spread_mm(values_mm)
    stations = np.flatnonzero(~np.isnan(level_mm))
    if len(stations) < 3:
        return
    # Another 0 does not confirm a 0.
    usual_mm = np.where(values_mm == 0, np.nan, values_mm)
    middle_mm, others = row_medians(usual_mm)[:, None], (~np.isnan(usual_mm)).sum(axis=1, keepdims=True) - 1
    off_mm = np.abs(usual_mm - middle_mm)
    scatter_mm = np.sqrt(np.nansum(off_mm**2, axis=1, keepdims=True) / np.maximum(others, 1))
    odd = (values_mm == 0) & (np.abs(middle_mm) > max(ZERO_MM, ZERO_SD * sd_mm))
    # Of two readings, either may be wrong.
    odd |= (scatter_mm > SCATTER_SD * sd_mm) & (2 * off_mm > scatter_mm)
    level_mm = np.interp(range(len(level_mm)), stations, level_mm[stations])
    # At an end the level may continue to rise or fall.
    padded_mm = np.pad(level_mm, 1, "edge")
    low_mm, high_mm = np.sort([padded_mm[:-2], padded_mm[2:]], axis=0)
    away_mm = np.maximum(low_mm - level_mm, level_mm - high_mm)
    is_turned = (level_mm * low_mm < 0) & (level_mm * high_mm < 0)
    alone = away_mm > np.select([level_mm == 0, is_turned], [DEEP_MM, TURNED_MM], PEAK_MM)
    odd |= (alone & ~odd.any(axis=1))[:, None] & ~np.isnan(values_mm)
    for i in np.flatnonzero(odd.any(axis=1)).tolist():
        j = np.flatnonzero(odd[i]).tolist()
        written = ", ".join(f"{value:g}" for value in values_mm[i, j])
        beside = f"{low_mm[i]:.3g} and {high_mm[i]:.3g} mm"
        sentence = f"{written} mm at s = {cells.s_mm[i]:g} mm differs from the others; the neighbours have {beside}."
        yield Finding("outlier", sentence, i, j)


def jumps(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield a station at which the level jumps, but would not if the stations from it on had another sign or unit."""
    s_mm, level_mm = sheet.profile_mm()
    before_mm, after_mm = level_mm[:-1], level_mm[1:]
    jump_mm = np.abs(after_mm - before_mm)
    least_mm = max(JUMP_MM, JUMP_STEPS * np.quantile(jump_mm, 0.7)) if jump_mm.size else JUMP_MM
    for factor, left, words in JUMPS:
        is_jump = (jump_mm > least_mm) & (np.abs(factor * after_mm - before_mm) < left * jump_mm)
        for i, end in runs(is_jump):
            # A single station that differs is an outlier.
            if end == i + 1:
                sentence = f"the level jumps by {jump_mm[i]:.2g} mm here. From here on {words}, it would not."
                yield Finding("outlier", sentence, int(np.searchsorted(sheet.cells.s_mm, s_mm[end])))


def impossible_levels(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield a finding if paste does not form such levels, or if they are unlikely for the depth of the crack."""
    (_, level_mm), depth_mm = sheet.profile_mm(), sheet.depth_mm or np.nan
    if not level_mm.size:
        return
    if (mean_mm := level_mm.mean()) > ABOVE_MM:
        yield Finding("sign", f"the readings are {mean_mm:.3g} mm above the face on average.")
    within_mm, readings_mm = np.abs(level_mm).max(), sheet.cells.readings_mm
    is_fine = np.median(sheet.cells.digits_mm) < FINEST_MM
    is_fine |= readings_mm.shape[1] > 1 and spread_mm(readings_mm) < STEADY_MM
    if 0 < within_mm < TENTH * depth_mm and is_fine:
        yield Finding("unit", f"all readings are within {within_mm:.3g} mm of the face: they may be in centimetres.")


def heaps(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield a finding if the level of a scan is above the face on the whole: a depth map shows a bed as a heap."""
    if (mean_mm := float(np.nanmean(sheet.cells.levels_mm))) > 0:
        yield Finding("sign", f"the sealant is {mean_mm:.2f} mm above the face on average.")


CHECKS = (
    short_spans,
    copies,
    far_columns,
    shifted_columns,
    jumps,
    outliers,
    impossible_levels,
)
"""All checks, in order. A reading that one check finds suspicious is treated as missing by the next ones."""
