"""Synthetic sheets of readings: sound ones, and ones that do not say what was meant, in every manner that was met.

A sheet is drawn with the depth and the length of its crack.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import openpyxl
from openpyxl.styles import Font

from sealtwin.core.records import Floats
from tests.support.sheet_writers import Hand, write_sheet

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
    marks: tuple[Callable[[openpyxl.Workbook], object], ...] = ()  # Marks of a workbook's cells
    answers: frozenset[str] = field(default_factory=frozenset)
    """Answers of which one must be asked for, where the wrong cell is known."""

    def write(self, folder: Path, name: str) -> Path:
        path = folder / (f"{name}.xlsx" if self.hand.workbook else f"{name}.csv")
        write_sheet(path, self.hand, self.s_mm.tolist(), self.levels_mm)
        if self.marks:
            book = openpyxl.load_workbook(path)
            for mark in self.marks:
                mark(book)
            book.save(path)
        return path


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
    return DrawnSheet(s_mm, read_mm, depth_mm, length_mm, scatter_mm, hand or HANDS[int(random.integers(len(HANDS)))])


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


Turn = Callable[[DrawnSheet, Random], DrawnSheet]
PLAIN, DOWN = Hand(workbook=True), Hand(quantity="depth")
"""Hands whose repeats lie in columns, and whose first row is the header."""


def _cell(i: int, j: int) -> str:
    """Return the cell of a repeat in a wide sheet without a title."""
    return f"{'BCDEFGHIJ'[j]}{i + 2}"


def _deep(sheet: DrawnSheet, random: Random, least_mm: float) -> int:
    """Draw a station whose readings are so deep that no scatter takes them to the face."""
    middle_mm = np.nanmedian(sheet.levels_mm, axis=1)
    deep = middle_mm < -max(least_mm, 6 * sheet.scatter_mm)
    return int(random.choice(np.flatnonzero(deep)))


def _set(sheet: DrawnSheet, cells: Mapping[tuple[int, int], float]) -> DrawnSheet:
    levels_mm = sheet.levels_mm.copy()
    for place, value in cells.items():
        levels_mm[place] = value
    return replace(sheet, levels_mm=levels_mm, answers=frozenset(_cell(i, j) for i, j in cells))


def zero(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    return _set(sheet, {(_deep(sheet, random, 2.0), int(random.integers(sheet.levels_mm.shape[1]))): 0.0})


def slip(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    i, j = _deep(sheet, random, 1.5), int(random.integers(sheet.levels_mm.shape[1]))
    if np.isnan(sheet.levels_mm[i, j]):
        raise ValueError("a missing reading has no sign")
    return _set(sheet, {(i, j): -sheet.levels_mm[i, j]})


def all_signs(sheet: DrawnSheet, _: Random) -> DrawnSheet:
    if np.nanmean(sheet.levels_mm) > -1.2:
        raise ValueError("turned, a crack that is nearly full is nearly full")
    return replace(sheet, levels_mm=-sheet.levels_mm, answers=frozenset({"sign"}))


def centimetres(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    if 0.9 * np.nanmean(np.abs(sheet.levels_mm)) < WRONG_MM:
        raise ValueError("a bed so near the face that a tenth of it is hardly another")
    digits = 2 + int(random.integers(2))
    return replace(sheet, levels_mm=np.round(sheet.levels_mm / 10, digits), answers=frozenset({"unit"}))


def copied(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    levels_mm = sheet.levels_mm.copy()
    a, b = random.choice(levels_mm.shape[1], 2, replace=False)
    levels_mm[:, a] = levels_mm[:, b]
    return replace(sheet, levels_mm=levels_mm, answers=frozenset({"BCDEFG"[max(a, b)]}))


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
    return replace(sheet, levels_mm=levels_mm, answers=frozenset({f"{i + 2}"}))


def struck(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    i, j = int(random.integers(len(sheet.s_mm))), int(random.integers(sheet.levels_mm.shape[1]))

    def mark(book: openpyxl.Workbook) -> None:
        book.worksheets[0][_cell(i, j)].font = Font(strike=True)

    return replace(_set(sheet, {(i, j): sheet.levels_mm[i, j] - 0.4}), marks=(mark,))


def hidden_row(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    number = 2 + int(random.integers(1, len(sheet.s_mm) - 1))

    def mark(book: openpyxl.Workbook) -> None:
        book.worksheets[0].row_dimensions[number].hidden = True

    return replace(sheet, marks=(mark,), answers=frozenset({f"{number}"}))


def hidden_column(sheet: DrawnSheet, random: Random) -> DrawnSheet:
    letter = "BCDEFG"[int(random.integers(sheet.levels_mm.shape[1]))]

    def mark(book: openpyxl.Workbook) -> None:
        book.worksheets[0].column_dimensions[letter].hidden = True

    return replace(sheet, marks=(mark,), answers=frozenset({letter}))


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


THREE, FINE = {"repeats": 3}, {"step_mm": 0.01}
SHALLOW = {"depth_mm": 6.0}
MANNERS: tuple[Manner, ...] = (
    Manner("0.00 for a missing reading", zero, given=THREE),
    Manner("slip of a sign", slip, given=THREE),
    Manner("depths written negative", all_signs, "ramp", DOWN, SHALLOW),
    Manner("levels written positive downward", all_signs, "ramp", PLAIN, SHALLOW),
    Manner("centimetres under millimetres", centimetres, given=FINE),
    Manner("struck-through reading", struck),
    Manner("copied repeat", copied, given=FINE),
    Manner("copied repeats, steps of 0.5 mm", all_copied, given={"step_mm": 0.5, "stations": 17}),
    Manner("hidden row", hidden_row),
    Manner("hidden column", hidden_column),
    Manner("station that scatters tenfold", scattered, given=FINE),
)
"""What an independent check saw read wrong without a word."""
