"""Synthetic sheets of readings: sound ones, and ones that do not say what was meant, in every manner that was met.

A sheet is drawn with the crack that it is of, the volume in it and a simulated level, as a run would know them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
import openpyxl
from openpyxl.styles import Font

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Floats, Outline, Profile, Solid
from tests.support.shapes import straight_slot
from tests.support.sheet_writers import Hand, write_sheet
from validate.readings.reading_checks import Filling

Random = np.random.Generator
LENGTHS_MM, DEPTHS_MM, WIDTH_MM = (50.0, 80.0, 140.0), (6.0, 10.0, 16.0, 24.0), 3.1
STEPS_MM = (0.01, 0.01, 0.01, 0.05, 0.1, 0.5)
HANDS = (
    Hand(),
    Hand(quantity="depth"),
    Hand(workbook=True),
    Hand(workbook=True, quantity="depth", language="german", units="brackets"),
    Hand(separator=";", decimal=",", language="german", units="parentheses", quantity="depth"),
    Hand(long=True),
    Hand(long=True, language="spanish", units="brackets", quantity="depth", workbook=True),
    Hand(language="english", units="brackets", station_unit="cm", unit="cm"),
)
WRONG_MM = 2.0  # Mean difference that a turned direction or unit must make
BEDS = ("paper", "steps", "plateau", "shallow", "deep", "mound", "ramp", "filled end")


@dataclass(frozen=True)
class DrawnSheet:
    """Levels that a sheet says, how it is written, and the crack that it is of."""

    s_mm: Floats  # (n,)
    levels_mm: Floats  # (n, r)
    depth_mm: float
    length_mm: float
    scatter_mm: float
    hand: Hand
    volume_mm3: float
    simulated: Profile
    marks: tuple[Callable[[openpyxl.Workbook], object], ...] = ()  # Marks of a workbook's cells
    answers: frozenset[str] = field(default_factory=frozenset)
    """Answers of which one must be asked for, where the wrong cell is known."""

    @property
    def filling(self) -> Filling:
        outline, solid = crack(self.length_mm, self.depth_mm)
        return Filling(outline, solid, self.volume_mm3, self.simulated)

    def write(self, folder: Path, name: str) -> Path:
        path = folder / (f"{name}.xlsx" if self.hand.workbook else f"{name}.csv")
        write_sheet(path, self.hand, self.s_mm.tolist(), self.levels_mm)
        if self.marks:
            book = openpyxl.load_workbook(path)
            for mark in self.marks:
                mark(book)
            book.save(path)
        return path


@cache
def crack(length_mm: float, depth_mm: float) -> tuple[Outline, Solid]:
    outline = straight_slot(length_mm=length_mm, width_mm=WIDTH_MM)
    return outline, build_solid(outline, CrackShape(depth_mm=depth_mm, tilt="vertical"))


def sound_sheet(random: Random, bed: str | None = None, hand: Hand | None = None, **given: float) -> DrawnSheet:
    """Draw a sheet that says what was meant; ``given`` fixes stations, repeats, depth_mm, scatter_mm or step_mm."""
    kind = bed or str(random.choice(BEDS))
    depth_mm = given.get("depth_mm", float(random.choice(DEPTHS_MM)))
    length_mm = float(random.choice(LENGTHS_MM))
    stations = int(given.get("stations", random.integers(5, 29)))
    repeats = int(given.get("repeats", random.integers(1, 6)))
    scatter_mm = given.get("scatter_mm", float(np.exp(random.uniform(np.log(0.05), np.log(0.5)))))
    step_mm = given.get("step_mm", float(random.choice(STEPS_MM)))
    corners = _bed(kind, depth_mm, random)
    s_mm = np.round(
        np.linspace(0, length_mm, stations) if random.random() < 0.7 else _uneven(length_mm, stations, random), 2
    )
    bed_mm = np.interp(s_mm / length_mm, *corners)
    read_mm = bed_mm[:, None] + scatter_mm * _noise(random, (stations, repeats))
    read_mm += random.uniform(0, 0.2) * random.standard_normal(repeats)
    read_mm = np.clip(read_mm, -1.2 * depth_mm, max(4.9, depth_mm / 2 - 0.1))
    read_mm = np.round(np.round(read_mm / step_mm) * step_mm, 4) + 0.0
    if kind == "filled end":
        read_mm[-int(random.integers(1, 3)) :] = 0.0
    if repeats > 1 and random.random() < 0.15:
        read_mm[int(random.integers(stations)), int(random.integers(repeats))] = np.nan
    fine_mm = np.linspace(0, length_mm, 161)
    true_mm = np.interp(fine_mm / length_mm, *corners)
    sheet = DrawnSheet(
        s_mm,
        read_mm,
        depth_mm,
        length_mm,
        scatter_mm,
        hand or HANDS[int(random.integers(len(HANDS)))],
        0.0,
        Profile(fine_mm, true_mm + _simulation_error(fine_mm, random)),
    )
    held_mm3 = sheet.filling.held_mm3(fine_mm, true_mm)
    return replace(sheet, volume_mm3=held_mm3 * float(np.exp(0.06 * random.standard_normal())))


def _bed(kind: str, depth_mm: float, random: Random) -> tuple[Floats, Floats]:
    """Return places, as shares of the length, and levels of a bed's corners."""
    inner, above_mm, draw = np.sort(random.uniform(0.1, 0.9, 3)), random.uniform(0.2, 1.5), random.uniform
    places: Sequence[float] = [0, inner[1], 1]
    match kind:
        case "paper":
            middle_mm = -draw(0.15, 0.4) * depth_mm
            places, levels = [0, *inner, 1], [-depth_mm, middle_mm, middle_mm, above_mm, above_mm]
        case "steps":
            low_mm, high_mm = -draw(0.3, 0.9) * depth_mm, draw(-2, 1.0)
            places, levels = [0, inner[1] - 0.02, inner[1] + 0.02, 1], [low_mm, low_mm, high_mm, high_mm]
        case "plateau":
            level_mm = -draw(0.1, 0.8) * depth_mm
            places, levels = [0, 1], [level_mm, level_mm + draw(-1, 1)]
        case "shallow":
            levels = draw(-2.5, 0.5, 3)
        case "deep":
            levels = -draw(0.6, 0.95, 3) * depth_mm
        case "mound":
            ends_mm, top_mm = draw(-3, 0.5, 2), draw(0.5, 2.2)
            places, levels = [0, 0.2, 0.8, 1], [ends_mm[0], top_mm, top_mm * draw(0.6, 1), ends_mm[1]]
        case "ramp":
            places, levels = [0, 1], [-draw(0.5, 1.0) * depth_mm, draw(-2, 1)]
        case _:  # A filled end
            places, levels = [0, inner[1], 0.85, 1], [-draw(0.3, 0.9) * depth_mm, -draw(0.2, 0.4) * depth_mm, -0.3, 0]
    levels_mm = np.array(levels, dtype=float)
    backward = random.random() < 0.4 and kind != "filled end"
    places_ = np.array(places, dtype=float)
    return (1 - places_[::-1], levels_mm[::-1]) if backward else (places_, levels_mm)


def _uneven(length_mm: float, stations: int, random: Random) -> Floats:
    gaps = random.uniform(0.6, 1.4, stations - 1)
    return np.concatenate([[0.0], np.cumsum(gaps) / gaps.sum()]) * length_mm


def _noise(random: Random, size: tuple[int, int]) -> Floats:
    """Draw errors of standard deviation 1: normal, lognormal or Student's t of 3."""
    law = int(random.integers(3))
    if law == 0:
        return random.standard_normal(size)
    if law == 1:
        return (random.lognormal(0, 0.5, size) - np.exp(0.125)) / np.sqrt((np.exp(0.25) - 1) * np.exp(0.25))
    return random.standard_t(3, size) / np.sqrt(3)


def _simulation_error(s_mm: Floats, random: Random) -> Floats:
    """Draw an error of about 1 mm, root mean square, alike over some 10 mm, and a constant one."""
    wave = sum(
        random.standard_normal() * np.sin(s_mm / random.uniform(4, 20) + random.uniform(0, 6.3)) for _ in range(3)
    )
    return 0.8 * np.asarray(wave) + 0.6 * random.standard_normal()


Turn = Callable[[DrawnSheet, Random], DrawnSheet]
PLAIN, DOWN = Hand(workbook=True), Hand(quantity="depth")
"""Hands whose repeats lie in columns, and whose first row is the header."""


def _cell(i: int, j: int) -> str:
    """Return the cell of a repeat in a wide sheet without a title."""
    return f"{'BCDEFGHIJ'[j]}{i + 2}"


def _deep(sheet: DrawnSheet, random: Random, *, inner: bool = False, least_mm: float = 2.0) -> int:
    """Draw a station whose readings are so deep that no scatter takes them to the face."""
    middle_mm = np.nanmedian(sheet.levels_mm, axis=1)
    deep = middle_mm < -max(least_mm, 6 * sheet.scatter_mm)
    if inner:
        deep[1:-1] &= deep[:-2] & deep[2:]
        deep[[0, -1]] = False
    return int(random.choice(np.flatnonzero(deep)))


def _set(sheet: DrawnSheet, cells: Mapping[tuple[int, int], float]) -> DrawnSheet:
    levels_mm = sheet.levels_mm.copy()
    for place, value in cells.items():
        levels_mm[place] = value
    return replace(sheet, levels_mm=levels_mm, answers=_answers(sheet, *(_cell(i, j) for i, j in cells)))


def _answers(sheet: DrawnSheet, *names: str) -> frozenset[str]:
    """Return the answers to a wide sheet; none of a long one, whose cells are elsewhere."""
    return frozenset(() if sheet.hand.long else names)


def zero(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    return _set(sheet, {(_deep(sheet, random), int(random.integers(sheet.levels_mm.shape[1]))): 0.0})


def zero_station(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    i = _deep(sheet, random, inner=True)
    return _set(sheet, {(i, j): 0.0 for j in range(sheet.levels_mm.shape[1])})


def two_zeros(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    return zero(zero(sheet, random), random)


def zero_at_the_end(sheet: DrawnSheet, _: Random) -> DrawnSheet:
    middle_mm = np.nanmedian(sheet.levels_mm, axis=1)
    return _set(sheet, {(0 if middle_mm[0] < middle_mm[-1] else len(middle_mm) - 1, 0): 0.0})


def slip(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    i, j = _deep(sheet, random, least_mm=1.5), int(random.integers(sheet.levels_mm.shape[1]))
    if np.isnan(sheet.levels_mm[i, j]):
        raise ValueError("a missing reading has no sign")
    return _set(sheet, {(i, j): -sheet.levels_mm[i, j]})


def slip_of_a_station(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    i = _deep(sheet, random, inner=True)
    return _set(sheet, {(i, j): -value for j, value in enumerate(sheet.levels_mm[i])})


def all_signs(sheet: DrawnSheet, _: Random) -> DrawnSheet:
    if np.nanmean(sheet.levels_mm) > -1.2:
        raise ValueError("turned, a crack that is nearly full is nearly full")
    return replace(sheet, levels_mm=-sheet.levels_mm, answers=frozenset({"sign"}))


def centimetres(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    if 0.9 * np.nanmean(np.abs(sheet.levels_mm)) < WRONG_MM:
        raise ValueError("a bed so near the face that a tenth of it is hardly another")
    digits = 2 + int(random.integers(2))
    return replace(sheet, levels_mm=np.round(sheet.levels_mm / 10, digits), answers=frozenset({"unit"}))


def all_centimetres(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    return replace(centimetres(sheet, random), s_mm=np.round(sheet.s_mm / 10, 3))


def reversed_s(sheet: DrawnSheet, _: Random) -> DrawnSheet:
    middle_mm = np.nanmedian(sheet.levels_mm, axis=1)
    mirrored_mm = np.interp(sheet.length_mm - sheet.s_mm, sheet.s_mm, middle_mm)
    if np.abs(middle_mm - mirrored_mm).mean() < WRONG_MM:
        raise ValueError("a bed that is nearly its own mirror image")
    s_mm = np.round(sheet.length_mm - sheet.s_mm, 2)
    return replace(sheet, s_mm=s_mm[::-1], levels_mm=sheet.levels_mm[::-1], answers=frozenset({"direction"}))


def reversed_rows(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    turned = reversed_s(sheet, random)
    return replace(turned, s_mm=turned.s_mm[::-1], levels_mm=turned.levels_mm[::-1])


def offset(offset_mm: float) -> Turn:
    def moved(sheet: DrawnSheet, _: Random) -> DrawnSheet:
        return replace(sheet, levels_mm=np.round(sheet.levels_mm + offset_mm, 4))

    return moved


def mean_row(*, first: bool = False, digits: int = 2, in_order: bool = False) -> Turn:
    def with_mean(sheet: DrawnSheet, _: Random) -> DrawnSheet:
        row_mm, s_mm = np.round(np.nanmean(sheet.levels_mm, axis=0), digits), round(float(sheet.s_mm.mean()), digits)
        s_mm += 0.01 * bool((np.abs(sheet.s_mm - s_mm) < 0.01).any())
        at = 0 if first else int(np.searchsorted(sheet.s_mm, s_mm)) if in_order else len(sheet.s_mm)
        return replace(
            sheet,
            s_mm=np.insert(sheet.s_mm, at, s_mm),
            levels_mm=np.insert(sheet.levels_mm, at, row_mm, axis=0),
            answers=_answers(sheet, f"{at + 2}"),
        )

    return with_mean


def mean_column(*, first: bool = False, digits: int = 2) -> Turn:
    def with_mean(sheet: DrawnSheet, _: Random) -> DrawnSheet:
        column_mm = np.round(np.nanmean(sheet.levels_mm, axis=1), digits)
        at = 0 if first else sheet.levels_mm.shape[1]
        levels_mm = np.insert(sheet.levels_mm, at, column_mm, axis=1)
        return replace(sheet, levels_mm=levels_mm, answers=_answers(sheet, "BCDEFG"[at]))

    return with_mean


def copied(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    levels_mm = sheet.levels_mm.copy()
    a, b = random.choice(levels_mm.shape[1], 2, replace=False)
    levels_mm[:, a] = levels_mm[:, b]
    return replace(sheet, levels_mm=levels_mm, answers=_answers(sheet, "BCDEFG"[max(a, b)]))


def all_copied(sheet: DrawnSheet, _: Random) -> DrawnSheet:
    return replace(sheet, levels_mm=np.repeat(sheet.levels_mm[:, :1], sheet.levels_mm.shape[1], axis=1))


def scattered(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    """Give one station ten to fifteen times the spread of the others."""
    whole = ~np.isnan(sheet.levels_mm).any(axis=1)
    spreads_mm = sheet.levels_mm[whole].std(axis=1, ddof=1)
    i = int(random.choice(np.flatnonzero(whole)))
    pattern = random.permutation(np.linspace(-1, 1, sheet.levels_mm.shape[1]))
    pattern *= random.uniform(10, 15) * max(float(np.median(spreads_mm)), 0.03) / pattern.std(ddof=1)
    levels_mm = sheet.levels_mm.copy()
    levels_mm[i] = np.round(np.nanmedian(levels_mm[i]) + pattern, 2)
    return replace(sheet, levels_mm=levels_mm, answers=_answers(sheet, f"{i + 2}"))


def struck(what: str) -> Turn:
    def with_struck(sheet: DrawnSheet, random: Random) -> DrawnSheet:
        i, j = int(random.integers(len(sheet.s_mm))), int(random.integers(sheet.levels_mm.shape[1]))
        columns = range(sheet.levels_mm.shape[1] + 1) if what == "row" else [0 if what == "station" else j + 1]
        names = ["ABCDEFGH"[column] + f"{i + 2}" for column in columns]

        def mark(book: openpyxl.Workbook) -> None:
            for name in names:
                book.worksheets[0][name].font = Font(strike=True)

        moved = _set(sheet, {(i, j): sheet.levels_mm[i, j] - 0.4})
        return replace(moved, marks=(mark,), answers=frozenset({f"{i + 2}"} if what == "row" else names))

    return with_struck


def hidden(what: str) -> Turn:
    def with_hidden(sheet: DrawnSheet, random: Random) -> DrawnSheet:
        i, j = int(random.integers(1, len(sheet.s_mm) - 1)), int(random.integers(sheet.levels_mm.shape[1]))
        columns = {"column": ["BCDEFG"[j]], "group": ["B", "C"]}.get(what, [])

        def mark(book: openpyxl.Workbook) -> None:
            table = book.worksheets[0]
            if columns:
                table.column_dimensions.group(columns[0], columns[-1], hidden=True)
            for row in range(i + 2, i + {"row": 3, "rows": 4}.get(what, 0)):
                table.row_dimensions[row].hidden = True

        return replace(sheet, marks=(mark,), answers=frozenset(columns or {f"{i + 2}"}))

    return with_hidden


@dataclass(frozen=True)
class Manner:
    """A manner in which a sheet says what was not meant, and the sheets that it is drawn on."""

    name: str
    turn: Turn
    bed: str | None = "paper"
    hand: Hand = PLAIN
    given: Mapping[str, float] = field(default_factory=dict)

    def draw(self, random: Random) -> DrawnSheet:
        """Draw a sheet until the manner is possible in it: a deep station, for one, must be there."""
        for _ in range(100):
            sheet = sound_sheet(random, self.bed, self.hand, **{"repeats": int(random.integers(2, 6)), **self.given})
            try:
                return self.turn(sheet, random)
            except ValueError:
                continue
        raise RuntimeError(f"{self.name}: no sheet of a hundred.")


THREE, ONE, FINE = {"repeats": 3}, {"repeats": 1}, {"step_mm": 0.01}
SHALLOW = {"depth_mm": 6.0}
REVIEWED: tuple[Manner, ...] = (
    Manner("0.00 for a missing reading", zero, given=THREE),
    Manner("slip of a sign", slip, given=THREE),
    Manner("depths written negative", all_signs, "ramp", DOWN, SHALLOW),
    Manner("levels written positive downward", all_signs, "ramp", PLAIN, SHALLOW),
    Manner("centimetres under millimetres", centimetres, given=FINE),
    Manner("unlabelled mean row", mean_row(), given=FINE),
    Manner("struck-through reading", struck("cell")),
    Manner("direction of s turned", reversed_s),
    Manner("fourth repeat the mean of three", mean_column(), given=THREE | FINE),
    Manner("gauge 5 mm too high", offset(5.0)),
    Manner("copied repeat", copied, given=FINE),
    Manner("copied repeats, steps of 0.5 mm", all_copied, given={"step_mm": 0.5, "stations": 17}),
    Manner("hidden row", hidden("row")),
    Manner("hidden column", hidden("column")),
    Manner("station that scatters tenfold", scattered, given=FINE),
)
"""What an independent check saw read wrong without a word."""
LONG = Hand(long=True)
INCHES = Hand(language="english", units="brackets", unit="inch")
GERMAN = Hand(separator=";", decimal=",", language="german", units="parentheses", quantity="depth")
VARIED: tuple[Manner, ...] = (
    Manner("0.00, single readings", zero_station, "deep", PLAIN, ONE),
    Manner("0.00 in all repeats of a station", zero_station, "plateau", PLAIN, {"depth_mm": 16.0}),
    Manner("0.00 twice", two_zeros, "steps", GERMAN, THREE),
    Manner("0.00 in a long sheet", zero, "ramp", LONG),
    Manner("0.00 at an end, among repeats", zero_at_the_end, "paper", DOWN, THREE),
    Manner("slip, single readings", slip_of_a_station, "deep", PLAIN, ONE),
    Manner("slip of a whole station", slip_of_a_station, "plateau", GERMAN, {"depth_mm": 16.0}),
    Manner("slip of one of two", slip, "deep", DOWN, {"repeats": 2}),
    Manner("slip in a long sheet", slip, "ramp", LONG, {"repeats": 4}),
    Manner("all signs, a shallow plateau", all_signs, "plateau", GERMAN, SHALLOW),
    Manner("all signs, a step", all_signs, "steps", PLAIN, SHALLOW),
    Manner("all signs, in inches", all_signs, "plateau", INCHES, SHALLOW),
    Manner("centimetres, a long sheet", centimetres, "deep", LONG, FINE),
    Manner("centimetres, places as well", all_centimetres, "steps", PLAIN, FINE),
    Manner("centimetres, single readings", centimetres, "ramp", DOWN, ONE | FINE),
    Manner("mean row first", mean_row(first=True), "ramp", PLAIN, FINE),
    Manner("mean row in the order of s", mean_row(in_order=True), "paper", GERMAN, FINE),
    Manner("mean row to a tenth", mean_row(digits=1), "steps", PLAIN, FINE | THREE),
    Manner("mean row of single readings", mean_row(), "paper", PLAIN, ONE | FINE),
    Manner("mean row, a long sheet", mean_row(), "ramp", LONG, FINE),
    Manner("struck-through row", struck("row"), "mound"),
    Manner("struck-through station", struck("station"), "plateau"),
    Manner("two hidden rows", hidden("rows"), "steps"),
    Manner("hidden group of columns", hidden("group"), "deep"),
    Manner("first repeat the mean", mean_column(first=True), "plateau", GERMAN, FINE),
    Manner("mean to a tenth", mean_column(digits=1), "ramp", PLAIN, {"repeats": 3, "scatter_mm": 0.3, "step_mm": 0.1}),
    Manner("mean in a long sheet", mean_column(), "deep", LONG, FINE | THREE),
    Manner("copy in a long sheet", copied, "steps", LONG, FINE),
    Manner("gauge 5 mm too low", offset(-5.0), "plateau"),
    Manner("direction of s, rows turned too", reversed_rows, "ramp", DOWN),
)
"""Thirty variations of them in other beds, hands and layouts."""
