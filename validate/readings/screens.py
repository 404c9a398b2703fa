"""Screens of suspicious readings. Each yields what may be a mistake and its cells; none changes a value."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.doubts import CONFIRMS, Doubt
from sealtwin.core.records import Floats, Outline, Profile, Solid
from validate.metrics.volumes import fill_volumes
from validate.readings.grid import letters

NINES = re.compile(r"9{2,}(\.9+)?|9\.9{2,}")  # A number that programs write for a missing reading, without its sign
STEPS_MM = (1.0, 0.5, 0.25, 0.2, 0.1, 0.05)  # Usual last digits, the largest first

# Limits of the screens, in mm, in sd (the standard deviation of a single reading), or as shares. They were set on
# synthetic sheets whose seeds benchmarks/ingest.py does not use: planted mistakes are found, and few sound sheets are
# questioned. A stricter limit (smaller distance or ratio, larger probability) finds smaller mistakes and questions more
# sound sheets.
LEAST_SPREAD_MM = 0.02  # Smallest sd: the limit of error of a digital caliper, which no hand repeats better
EQUAL_MM = 0.056  # Repeats by hand differ with the probability of this divided by the last digit
ROUNDING_MM = 1e-6  # Margin for two equal means, above the error of binary fractions
CHANCE = 5e-3  # Probability of chance agreement below which a row or column is a mean of others or a copy
MEAN_PLACE = 0.02  # Probability that a row's place is the mean of the others' by chance
ONLY_COPY_CHANCE = 0.35  # Such a probability of a copy if no two columns differ. Few sheets are so coarse
COMPARED = 5  # Smallest number of stations at which columns are compared
ODD_MM = 1.0  # Distance from the other readings of its station from which on a reading is suspicious
ZERO_SD = 4.2  # The same distance for 0
SLIP_SD = 6.0  # The same distance for a reading of the other sign
OPPOSITE_SD = 4.0  # Distance of its opposite from the others below which a reading has a wrong sign
OPPOSITE_SHARE = 0.35  # The same as a share of the reading
DEEP_MM = 1.5  # Depth of its neighbours from which on a station of zeros, or of the other sign, is suspicious
STEEP = 3.0  # Steps between stations by which a level may go on at an end of the sheet
END_MM = 3.0  # Height by which it may do so besides
SCATTER = 5.0  # Ratio of a station's spread to the typical one from which on it is suspicious
NEAR_SCATTER = 0.25  # Share of the spread of a neighbour that is usual
SPAN = 0.2  # Share of the crack below which the span of all places is suspicious
COUNTED = 0.5  # The same for places that only count 1, 2, 3
FINEST_MM = 0.0075  # Between the last digit of a caliper, 0.01 mm, and that of a dial with thousandths
HEAP_MM = 2.6  # Height above the face that paste reaches in few places
PLATEAU_MM = 3.0  # Height above the face of the highest quarter of the stations
ABOVE_MM = 1.0  # Mean height above the face if no station is below it
FLOOR = 0.1  # Share of the depth by which a floor is uneven, at least 1 mm
TENTH = 0.13  # Share of the depth that contains all readings if centimetres were entered as millimetres
STEADY_MM = 0.033  # Spread of repeats that is smaller than by hand, and usual in centimetres
COVERED = 0.8  # Share of the crack's length between the outer stations from which on their volume counts
VOLUME_OFF = 0.14  # Logarithm of the ratio of volumes that raises a doubt
VOLUME_MET = 0.4  # Part of that logarithm that an explanation may leave
OFFSET_MM = 2.5  # Smallest constant offset that a volume shows
OFFSET_SHARE = 0.12  # The same as a share of the depth
NEARER, NEARER_MM = 0.6, 0.8
"""Share of the distance to the simulated level that a change may leave, and its least gain in mm."""
TURNED = (("sign", -1.0, "with the opposite sign"), ("unit", 10.0, "in centimetres"))
"""Mistakes that multiply all levels by a factor."""

CORRECT_UNIT, REMOVE = "Correct the unit in the header.", "Remove it from the repeats."
REMEDIES = {
    "code": "Clear it if it is the code of a missing reading.",
    "sign slip": "Correct its sign.",
    "scatter": "Correct the row.",
    "mean row": "Remove it from the table.",
    "mean column": REMOVE,
    "copy": REMOVE,
    "far column": "Correct the columns.",
    "span": "Correct the unit in the header; a place is a distance along the crack, no number.",
    "dial": CORRECT_UNIT,
    "unit": CORRECT_UNIT,
    "sign": "Correct the header: level counts upward from the face, depth downward.",
    "datum": "Measure from the face.",
    "direction": "Change the end of the crack at which s is 0.",
}
ANSWERS: dict[str, dict[str, Any]] = {
    "span": {CONFIRMS: ["unit"]},
    "dial": {CONFIRMS: ["unit"]},
    "datum": {"datum": "caliper_base", "datum_level_mm": 5.0},
    "direction": {"columns.s_from": "second"},
}
"""Answers to a doubt other than its cells or its kind."""
ALL = slice(None)


@dataclass(frozen=True)
class ReadCells:
    """Readings of a sheet as written, in mm, and their cells."""

    s_mm: Floats  # (n,), increasing
    readings_mm: Floats  # (n, r), in the direction of the sheet; NaN for a missing one
    rows: NDArray[np.int64]  # (n, r): row of each reading, from 1; of a missing one, a row of its station
    columns: NDArray[np.int64]  # (r,): column of each repeat, from 0
    digits_mm: Floats  # (n, r): place value of each reading's last digit that is not 0
    is_depth: bool = False  # True if the sheet counts downward
    datum_level_mm: float = 0.0  # Height of the datum above the face
    station_column: int = 0
    header_row: int = 1
    s_unit_mm: float = 1.0  # Unit of s in the sheet
    unit_mm: float = 1.0  # Unit of the readings in the sheet

    @property
    def levels_mm(self) -> Floats:
        """Levels that the readings mean, (n, r), upward from the face."""
        return (-self.readings_mm if self.is_depth else self.readings_mm) + self.datum_level_mm

    def from_other_end(self, length_mm: float) -> "ReadCells":
        """Return the readings with s counted from the other end of a crack of length ``length_mm``."""
        turned = {name: getattr(self, name)[::-1] for name in ("readings_mm", "rows", "digits_mm")}
        return replace(self, s_mm=length_mm - self.s_mm[::-1], **turned)


@dataclass(frozen=True)
class Filling:
    """The crack, the dispensed volume, and the simulated level if there is one."""

    outline: Outline
    solid: Solid
    volume_mm3: float
    simulated: Profile | None = None

    def held_mm3(self, s_mm: Floats, level_mm: Floats) -> float:
        """Return the volume of sealant below a level. Beyond the outer stations the level is constant."""
        profile = Profile(s_mm, np.maximum(level_mm, -self.solid.depth_at_mm(s_mm)))
        return fill_volumes(profile, self.outline, self.solid, 0.0, self.outline.length_mm)["sealant_mm3"]

    def admits(self, level_mm: Floats) -> bool:
        """Return whether a level is between the floor and the highest heap that paste forms."""
        return -1.1 * self.solid.depth_mm - 1.0 <= level_mm.min() and level_mm.max() <= PLATEAU_MM


class SheetAndCrack(NamedTuple):
    """The cells, and the crack as far as it is known."""

    cells: ReadCells
    depth_mm: float | None
    length_mm: float | None
    filling: Filling | None

    def profile_mm(self) -> tuple[Floats, Floats]:
        """Return s and median level of the stations with a reading; nothing if they are fewer than three."""
        level_mm = row_medians(self.cells.levels_mm)
        read = ~np.isnan(level_mm)
        read &= read.sum() > 2
        return self.cells.s_mm[read], level_mm[read]


class Finding(NamedTuple):
    """A possible mistake: of readings [i, j], of station i, of repeat j, or of the whole sheet."""

    kind: str
    sentence: str
    i: Any = ALL  # A station
    j: Any = ALL  # Repeats, in a list


def screens(
    cells: ReadCells,
    depth_mm: float | None,
    length_mm: float | None,
    filling: Filling | None,
    place: Callable[[int, int], str],
) -> list[Doubt]:
    """Return the doubts about readings. A doubtful reading is missing in the screens that follow.

    ``depth_mm`` and ``length_mm`` are of the crack, None if unknown; ``place`` names a cell by row and column.
    """
    doubts = dict[Any, Doubt]()
    for screen in SCREENS:
        readings_mm = cells.readings_mm.copy()
        for kind, sentence, i, j in screen(SheetAndCrack(cells, depth_mm, length_mm, filling)):
            row, column, names = _cells_of(cells, i, j)
            if names:
                readings_mm[i, j] = np.nan
            elif kind not in ("span", "direction"):
                column = int(cells.columns[0])
            answers = {CONFIRMS: list(names) or [kind], **ANSWERS.get(kind, {})}
            doubts.setdefault(names or kind, Doubt(kind, place(row, column), sentence, REMEDIES[kind], answers, names))
        cells = replace(cells, readings_mm=readings_mm)
    return list(doubts.values())


def _cells_of(cells: ReadCells, i: Any, j: Any) -> tuple[int, int, tuple[str, ...]]:
    """Return row and column of a finding, and the names of its cells, row or column; none for the whole sheet."""
    if j is ALL:
        row = cells.header_row if i is ALL else int(cells.rows[i].min())
        return row, cells.station_column, () if i is ALL else (f"{row}",)
    columns = cells.columns.tolist()
    column = columns[j[0]]
    if i is ALL and columns.count(column) == 1:
        return cells.header_row, column, (letters(column),)
    if i is ALL:
        # With one row a reading, a repeat has no column: its first cell stands for it.
        i = np.argmax(~np.isnan(cells.readings_mm[:, j[0]]))
    return int(cells.rows[i, j[0]]), column, tuple(f"{letters(columns[each])}{cells.rows[i, each]}" for each in j)


def row_medians(values: Floats) -> Floats:
    """Return the median of each row, (n,), ignoring NaN. A row of NaN gives NaN."""
    return np.ma.filled(np.ma.median(np.ma.masked_invalid(values), axis=1), np.nan)


def _medians_of_others(values: Floats) -> Floats:
    """Return for each value the median of the others of its row, (n, r), ignoring NaN; NaN if there are none."""
    return np.column_stack([row_medians(np.delete(values, j, axis=1)) for j in range(values.shape[1])])


def _last_digit_mm(readings_mm: Floats) -> float:
    """Return the largest usual step that divides the readings of all rows, or all but one; 0 if there is none."""
    for step_mm in STEPS_MM:
        off_mm = np.abs(readings_mm - step_mm * np.round(readings_mm / step_mm))
        if (off_mm > ROUNDING_MM).any(axis=1).sum() < 2:
            return step_mm
    return 0.0


def spread_mm(readings_mm: Floats) -> float:
    """Return the typical sd of a single reading. Without repeats it follows from the scatter along s."""
    off_mm = np.diff(readings_mm, axis=1) / np.sqrt(2)
    if (~np.isnan(off_mm)).sum() < 3:
        middle_mm = row_medians(readings_mm)
        middle_mm = middle_mm[~np.isnan(middle_mm)]
        off_mm = np.diff(middle_mm, n=2) / np.sqrt(6) if len(middle_mm) > 3 else np.array([0.34])
    return max(LEAST_SPREAD_MM, 0.4 * _last_digit_mm(readings_mm), 1.48 * np.nanmedian(np.abs(off_mm)))


def _mean_chances(values_mm: Floats, digits_mm: Floats, sd_mm: float) -> Floats:
    """Return how probably each row is the mean of all others by chance, (n,); infinite if it is not their mean."""
    read = ~np.isnan(values_mm)
    others = read.sum(axis=0) - read
    means_mm = (np.nansum(values_mm, axis=0) - np.nan_to_num(values_mm)) / np.maximum(others, 1)
    half_mm = 0.5 * np.where(read, digits_mm, np.inf).min(axis=1) + ROUNDING_MM
    compared = read & (others > 1)
    agree = (np.abs(values_mm - means_mm) <= half_mm[:, None]) | ~compared
    chance = np.minimum(1.0, np.maximum(0.8 * half_mm, 0.4 * _last_digit_mm(values_mm)) / sd_mm)
    return np.where(agree.all(axis=1), chance ** compared.sum(axis=1), np.inf)


def other_units(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield places in a small part of the crack, and readings in a dial's unit with too many digits for it."""
    (cells, _, length_mm, _), s_mm = sheet, sheet.cells.s_mm
    if length_mm is not None and len(s_mm) > 2:
        counts, span_mm = np.allclose(np.diff(s_mm), cells.s_unit_mm), np.ptp(s_mm)
        if span_mm < (COUNTED if counts else SPAN) * length_mm:
            yield Finding("span", f"all places are within {span_mm:.3g} mm of a crack of {length_mm:.3g} mm.")
    digit_mm = np.median(cells.digits_mm[~np.isnan(cells.readings_mm)])
    if digit_mm < FINEST_MM < cells.unit_mm < 1:
        yield Finding("dial", f"the readings have digits of {digit_mm:.2g} mm, which no caliper shows.")


def mean_rows(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield the row that is the mean of all other rows in every column."""
    values_mm, s_mm, rows = sheet.cells.readings_mm, sheet.cells.s_mm, sheet.cells.rows.min(axis=1)
    sd_mm, mean_mm = spread_mm(values_mm), (s_mm.sum() - s_mm) / (len(s_mm) - 1)
    in_place = np.abs(s_mm - mean_mm) < 0.07 + 0.005 * mean_mm
    # A row in the order of s may simply have the level in the middle. Else its place and its level are evidence too.
    in_place &= (np.roll(rows, 1) - rows) * (rows - np.roll(rows, -1)) < 0
    evidence = np.where(in_place, MEAN_PLACE * sd_mm / max(np.nanstd(values_mm), sd_mm), 1.0)
    chance = _mean_chances(values_mm, sheet.cells.digits_mm, sd_mm) * evidence
    for i in np.flatnonzero(chance < CHANCE)[:1].tolist():
        yield Finding("mean row", f"the row at s = {s_mm[i]:g} mm is the mean of all others in every column.", i)


def mean_columns(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield the repeat that is the mean of all others."""
    values_mm = sheet.cells.readings_mm
    chance = _mean_chances(values_mm.T, sheet.cells.digits_mm.T, spread_mm(values_mm))
    for j in np.flatnonzero(chance < CHANCE)[:1].tolist():
        yield Finding("mean column", "this repeat is the mean of all others at every station.", j=[j])


def copied_columns(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield repeats that are copies of another repeat."""
    values_mm = sheet.cells.readings_mm
    off_mm = (values_mm - each_mm[:, None] for each_mm in values_mm.T)
    both, equal = np.array([[(~np.isnan(each)).sum(axis=0), (each == 0).sum(axis=0)] for each in off_mm]).swapaxes(0, 1)
    shares = equal / np.maximum(both, 1)
    compared = np.triu(both > 2, 1)
    differ = compared & (shares < 1)
    # Probability that repeats with the scatter of a hand are rounded to the same value, at the least.
    rounded = max(0.1, 1 - EQUAL_MM / max(_last_digit_mm(values_mm), EQUAL_MM))
    chance = shares[differ].max(initial=rounded) ** both
    is_copy = compared & (shares == 1) & (chance < (CHANCE if differ.any() else ONLY_COPY_CHANCE))
    for j in np.flatnonzero(is_copy.any(axis=0)).tolist():
        yield Finding("copy", "this repeat is a copy of another, reading by reading.", j=[j])


def far_columns(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield repeats that are far from the others at most stations."""
    values_mm = sheet.cells.readings_mm
    off_mm = np.abs(values_mm - _medians_of_others(values_mm))
    repeats = np.flatnonzero((~np.isnan(off_mm)).sum(axis=0) >= COMPARED).tolist()
    # Of two repeats that differ, the first may be as wrong as the second: one question is enough.
    for j in repeats[-1:] if len(repeats) == 2 else repeats:
        far_mm = np.nanmedian(off_mm[:, j])
        if far_mm > ODD_MM and far_mm > SLIP_SD * spread_mm(np.delete(values_mm, j, axis=1)):
            sentence = f"this repeat differs from the others by {far_mm:.3g} mm at half of the stations."
            yield Finding("far column", sentence, j=[j])


def odd_readings(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield codes of nines, zeros and other signs, unlike the other readings of the station or its neighbours."""
    cells, values_mm = sheet.cells, sheet.cells.readings_mm
    nines = np.reshape([NINES.fullmatch(f"{abs(value):.8g}") is not None for value in values_mm.flat], values_mm.shape)
    usual_mm = np.where(nines, np.nan, values_mm)
    stations = np.flatnonzero((~np.isnan(usual_mm)).any(axis=1))
    if len(stations) < 3:
        return
    low_mm, high_mm = np.nanmin(usual_mm), np.nanmax(usual_mm)
    codes = nines & (np.maximum(low_mm - values_mm, values_mm - high_mm) > max(ODD_MM, high_mm - low_mm))
    values_mm, sd_mm = np.where(codes, np.nan, values_mm), spread_mm(values_mm)
    level_mm = np.interp(range(len(values_mm)), stations, row_medians(values_mm)[stations])

    # Another 0 does not confirm a 0, and one reading cannot tell which of two is wrong: then, or if all readings of a
    # station have one sign, the neighbours count. At an end the level may go on to rise or fall.
    ordinary_mm = np.where(values_mm == 0, np.nan, values_mm)
    others = (~np.isnan(ordinary_mm)).sum(axis=1, keepdims=True) - ~np.isnan(ordinary_mm)
    is_alone = (np.isnan(values_mm) | (np.sign(values_mm) == np.sign(level_mm)[:, None])).all(axis=1, keepdims=True)
    alone = is_alone | ((others < 2) & (values_mm != 0))
    peers_mm, slack_mm = _medians_of_others(ordinary_mm), np.zeros_like(level_mm)
    slack_mm[[0, -1]] = STEEP * np.abs(np.diff(level_mm)[[1, -2]]) + END_MM
    padded_mm = np.pad(level_mm, 1, "reflect")
    beside_mm = padded_mm[:-2], padded_mm[2:]
    low_mm = np.where(alone, (np.minimum(*beside_mm) - slack_mm)[:, None], peers_mm)
    high_mm = np.where(alone, (np.maximum(*beside_mm) + slack_mm)[:, None], peers_mm)
    away_mm = np.maximum(low_mm - values_mm, values_mm - high_mm)
    turned_mm = np.maximum(low_mm + values_mm, -values_mm - high_mm)
    zero = (values_mm == 0) & (away_mm > np.where(alone, DEEP_MM, max(ODD_MM, ZERO_SD * sd_mm)))
    # A formula that refers to empty cells gives 0 at s = 0 below the other rows.
    zero |= (values_mm == 0) & is_alone & (cells.s_mm[:, None] == 0) & (cells.rows > cells.rows.min())
    slip = (values_mm * low_mm < 0) & (values_mm * high_mm < 0)
    slip &= away_mm > np.where(alone, 2 * DEEP_MM, max(ODD_MM, SLIP_SD * sd_mm))
    slip &= turned_mm < np.maximum(OPPOSITE_SD * sd_mm, OPPOSITE_SHARE * np.abs(values_mm))
    for kind, cases in {"code": codes | zero, "sign slip": slip}.items():
        for i in np.flatnonzero(cases.any(axis=1)).tolist():
            j = np.flatnonzero(cases[i]).tolist()
            written = ", ".join(f"{value:g}" for value in cells.readings_mm[i, j])
            around_mm = (low_mm + high_mm)[i, j[0]] / 2
            sentence = f"{written} mm at s = {cells.s_mm[i]:g} mm is unlike the readings around, {around_mm:.3g} mm."
            yield Finding(kind, sentence, i, j)


def scattered_stations(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield stations whose repeats scatter far more than those of their neighbours and of the sheet."""
    values_mm = sheet.cells.readings_mm
    stations = np.flatnonzero((~np.isnan(values_mm)).sum(axis=1) > 1)
    if len(stations) < 4:
        return
    spreads_mm = np.nanstd(values_mm[stations], axis=1, ddof=1)
    near_mm = np.maximum(np.roll(spreads_mm, 1), np.roll(spreads_mm, -1))
    usual_mm = np.maximum(spread_mm(values_mm), NEAR_SCATTER * near_mm)
    for k in np.flatnonzero(spreads_mm > SCATTER * usual_mm).tolist():
        i = stations[k]
        sentence = (
            f"the readings at s = {sheet.cells.s_mm[i]:g} mm scatter by {spreads_mm[k]:.2g} mm, not {usual_mm[k]:.2g}."
        )
        yield Finding("scatter", sentence, i)


def impossible_levels(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield levels that paste does not form, or that the crack's depth makes unlikely."""
    (_, level_mm), (cells, depth_mm, _, _) = sheet.profile_mm(), sheet
    if not level_mm.size:
        return
    in_order, mean_mm = np.sort(level_mm), level_mm.mean()
    if (mean_mm > ABOVE_MM and in_order[0] > -0.1) or (mean_mm > 0 and in_order[-2] > HEAP_MM):
        yield Finding("sign", f"the stations are {mean_mm:.3g} mm above the face on average.")
    if (highest_mm := in_order[-max(1, len(level_mm) // 4) :].mean()) > PLATEAU_MM:
        yield Finding("datum", f"the highest quarter of the stations is {highest_mm:.3g} mm above the face.")
    if depth_mm is None:
        return
    if (below_mm := -in_order[0] - depth_mm) > max(1.0, FLOOR * depth_mm):
        yield Finding("datum", f"the deepest station is {below_mm:.3g} mm below the crack's floor.")
    read = ~np.isnan(cells.readings_mm)
    is_fine = np.isclose(cells.digits_mm[read], 0.001).mean() > 0.5
    is_steady = (read.sum(axis=1) > 1).sum() > 3 and spread_mm(cells.readings_mm) < STEADY_MM
    if 0 < (within_mm := np.abs(level_mm).max()) < TENTH * depth_mm and (is_fine or is_steady):
        yield Finding("unit", f"all readings are within {within_mm:.3g} mm of the face: they may be in centimetres.")


def other_volume(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield the change of sign, unit or datum with which the volume below the readings is the dispensed volume."""
    (s_mm, level_mm), filling = sheet.profile_mm(), sheet.filling
    if filling is None or filling.volume_mm3 <= 0 or not s_mm.size:
        return
    if np.ptp(s_mm) < COVERED * filling.outline.length_mm:
        return

    def off(level_mm: Floats) -> float:
        return np.log(max(filling.held_mm3(s_mm, level_mm), 1.0) / filling.volume_mm3)

    if abs(as_read := off(level_mm)) < VOLUME_OFF:
        return
    volumes = f"the volume below the readings is {np.exp(as_read):.2f} times that dispensed"
    for kind, factor, words in TURNED:
        other = off(factor * level_mm)
        if filling.admits(factor * level_mm) and abs(other) < VOLUME_MET * abs(as_read):
            yield Finding(kind, f"{volumes}; {words}, it would be {np.exp(other):.2f} times that.")
            return
    offsets_mm = filling.solid.depth_mm * np.linspace(-1, 1, 25)
    offset_mm = np.interp(0.0, [off(level_mm + each) for each in offsets_mm], offsets_mm, 0.0, 0.0)
    if abs(offset_mm) > max(OFFSET_MM, OFFSET_SHARE * filling.solid.depth_mm):
        yield Finding("datum", f"{volumes}, or the readings are {-offset_mm:+.2g} mm off.")


def other_level(sheet: SheetAndCrack) -> Iterator[Finding]:
    """Yield the change of direction, sign or unit that brings the readings much closer to the simulated level."""
    (s_mm, level_mm), filling = sheet.profile_mm(), sheet.filling
    if filling is None or (run := filling.simulated) is None:
        return
    places_mm = np.stack([s_mm, filling.outline.length_mm - s_mm])
    errors_mm = np.interp(places_mm, run.s_mm, run.level_mm, np.nan, np.nan) - level_mm
    both = ~np.isnan(errors_mm).any(axis=0)
    if both.sum() < 4:
        return
    level_mm, (read_mm, mirrored_mm) = level_mm[both], errors_mm[:, both]
    # A constant offset contains no information on the direction.
    changed_mm, own_mm = (_distance_mm(each - np.median(each)) for each in (mirrored_mm, read_mm))
    changes = [(changed_mm, own_mm, "direction", "with s from the crack's other end, apart from a constant")]
    for kind, factor, words in TURNED:
        if filling.admits(factor * level_mm):
            changes.append((_distance_mm(read_mm + (1 - factor) * level_mm), _distance_mm(read_mm), kind, words))
    changed_mm, own_mm, kind, words = min(changes, key=lambda change: change[0] / max(change[1], 1e-9))
    if changed_mm < NEARER * own_mm and own_mm - changed_mm > NEARER_MM:
        yield Finding(
            kind, f"the readings are {own_mm:.2g} mm from the simulated level, but {changed_mm:.2g} mm {words}."
        )


def _distance_mm(error_mm: Floats) -> float:
    return np.abs(error_mm).mean()


SCREENS: tuple[Callable[[SheetAndCrack], Iterator[Finding]], ...] = (
    other_units,
    mean_rows,
    copied_columns,
    mean_columns,
    far_columns,
    odd_readings,
    scattered_stations,
    impossible_levels,
    other_volume,
    other_level,
)
"""All screens, in order: what the first ones find is missing in those that follow."""
