"""Doubts about suspicious readings: each has its cells and its answer, and no value is changed."""

from pathlib import PurePath
from typing import Any

import numpy as np
import pytest

from sealtwin.core.doubts import Doubt, Location
from sealtwin.core.records import Floats
from tests.support.paths import FIXTURE
from validate.readings.reading_checks import ReadCells, SheetAndCrack, check_readings

TABLE = np.loadtxt(FIXTURE / "caliper.csv", delimiter=",", skiprows=1)
"""The paper's sheet: s, and three repeats from -16 mm at s = 0 to 1 mm at s = 80."""


def cells_of(table: Floats, *, digits: int = 2, **facts: Any) -> ReadCells:
    """Return the cells of a sheet with one row a station, its header in row 1 and s in column A."""
    readings_mm = np.round(table[:, 1:], digits)
    stations, repeats = readings_mm.shape
    decimals = [[len(f"{value:.{digits}f}".rstrip("0").partition(".")[2]) for value in row] for row in readings_mm]
    rows = np.repeat(np.arange(2, stations + 2)[:, None], repeats, axis=1)
    return ReadCells(table[:, 0], readings_mm, rows, np.arange(1, repeats + 1), 10.0 ** -np.array(decimals), **facts)


def doubts_of(cells: ReadCells, *, depth_mm: float | None = 16.0, length_mm: float | None = None) -> list[Doubt]:
    return check_readings(SheetAndCrack(cells, depth_mm, length_mm), Location(PurePath("lab.csv")))


def asked_of(
    table: Floats, *, depth_mm: float | None = 16.0, length_mm: float | None = None, **facts: Any
) -> list[str]:
    """Return the entries of ``as_written`` that the doubts ask for, in order."""
    doubts = doubts_of(cells_of(table, **facts), depth_mm=depth_mm, length_mm=length_mm)
    return [answer for doubt in doubts for answer in doubt.answers["as_written"]]


def changed(values: dict[tuple[int, int], float]) -> Floats:
    table = TABLE.copy()
    for cell, value in values.items():
        table[cell] = value
    return table


def bed(level_mm, *, every_mm: float = 5.0) -> Floats:
    return np.column_stack([every_mm * np.arange(float(len(level_mm))), level_mm])


def shifted(offset_mm: float) -> Floats:
    return np.column_stack([TABLE[:, 0], TABLE[:, 1:] + offset_mm])


COARSE = np.round(TABLE[:8, 1:3] * 2) / 2
HIGH = bed(np.column_stack([4.0 - 0.25 * np.arange(9), 4.1 - 0.25 * np.arange(9)]))
IN_CM = TABLE / [1, 10, 10, 10]

NOISE = np.round(TABLE[:, 1:] + 0.1 * np.random.default_rng(5).standard_normal((len(TABLE), 3)), 2)


def copied_from(first: int) -> Floats:
    table = np.column_stack([TABLE[:, 0], NOISE])
    table[first:, 3] = table[first:, 2]
    return table


def with_block(first: int, to: int, count: int) -> Floats:
    table = np.column_stack([TABLE[:, 0], NOISE])
    table[to : to + count, 1:] = table[first : first + count, 1:]
    return table


def moved(rows: int) -> Floats:
    """The second of three repeats, moved by a row; its lost reading is missing."""
    table = np.column_stack([TABLE[:, 0], NOISE])
    table[:, 2] = np.roll(table[:, 2], rows)
    table[0 if rows > 0 else -1, 2] = np.nan
    return table


ASKED = {
    "the paper's sheet": (TABLE, {"length_mm": 80.0}, []),
    "zero among deep readings": (changed({(2, 2): 0.0}), {}, ["C4"]),
    "-999": (changed({(2, 2): -999}), {"depth_mm": None}, ["C4"]),
    "zero at a filled end": (changed({(i, j): 0.0 for i in (-2, -1) for j in (1, 2, 3)}), {}, []),
    "zero at a steep end": (bed([-9.0, -9.0, -8.5, -8.5, -6.5, 0.0], every_mm=10.0), {}, []),
    "a station of zeros between deep ones": (changed({(3, 1): 0.0})[:, :2], {}, ["B5"]),
    "a level that is zero between its neighbours": (bed([-3.0, -2.0, -1.0, 0.0, 1.0, 1.5]), {}, []),
    **{f"a sign that slipped, of {n}": (changed({(5, 1): 3.78})[:, : n + 1], {}, ["B7"]) for n in (1, 3)},
    "a sign that slipped, of 2": (changed({(5, 1): 3.78})[:, :3], {}, ["B7", "C7"]),  # Either may be wrong
    "a level that rises above the face": (bed([-1.2, -1.1, -0.6, 0.2, 0.8, 1.1]), {}, []),
    "a sign that turns at row 12": (
        bed([-2.9, -2.5, -2.3, -2.2, -1.2, -1.3, -1.6, -1.5, -1.8, -2.6, 3.2, 3.4]),
        {},
        ["12"],
    ),
    "a sign that turns twice": (bed([-2.5, -2.3, -2.2, 1.9, 1.6, 1.5, -1.8, -2.6, -2.7]), {}, ["5", "8"]),
    "inches from row 5 on": (bed([-7.1, -6.9, -6.8, -0.27, -0.26, -0.27]), {}, ["5"]),
    "centimetres from row 7 on, with a scatter above them": (
        bed([[-3.8, -3.8], [-3.6, -3.6], [-3.9, -4.1], [-3.8, -3.9], [-4.4, -4.2], *[[-0.44, -0.44]] * 7]),
        {},
        ["7"],
    ),
    "centimetres from row 5 on": (bed([-4.1, -3.9, -3.8, -0.36, -0.35, -0.34]), {}, ["5"]),
    "a station that scatters tenfold": (changed({(6, 1): -2.3, (6, 2): -4.0, (6, 3): -5.6}), {}, ["B8", "D8"]),
    "the middle of a straight bed": (bed(-10 + np.arange(9.0)), {}, []),
    "copied repeats": (np.column_stack([TABLE, TABLE[:, 2]]), {}, ["E"]),
    # Two readings in steps of 0.5 mm agree at all of eight stations in one of three sheets.
    "equal repeats in coarse steps": (np.column_stack([TABLE[:8, 0], COARSE[:, 0], COARSE[:, 0]]), {}, []),
    "equal repeats but for one station": (
        np.column_stack([TABLE[:, :2], TABLE[:, 1] + 0.1 * (np.arange(len(TABLE)) == 5)]),
        {},
        ["C"],
    ),
    "a repeat of another quantity": (np.column_stack([TABLE[:, :3], TABLE[:, 3] + 20]), {"depth_mm": None}, ["D"]),
    "a repeat of the other sign": (np.column_stack([TABLE[:, :2], -TABLE[:, 2]]), {}, ["C"]),
    "levels above the face": (HIGH, {"depth_mm": 8.0}, ["sign"]),
    "depths above the face": (HIGH * [1, -1, -1], {"depth_mm": 8.0, "is_depth": True}, ["sign"]),
    "centimetres under millimetres": (IN_CM, {}, ["unit"]),
    "centimetres, read once": (IN_CM[:, :2], {}, []),
    "a declared datum": (shifted(-3.0), {"datum_level_mm": 3.0}, []),
    "places in centimetres": (TABLE / [10, 1, 1, 1], {"length_mm": 80.0}, ["unit"]),
    "a repeat that is copied from a station on": (copied_from(5), {}, ["D"]),
    "a block of stations that is copied": (with_block(2, 9, 4), {}, ["11"]),
    "a repeat one row down": (moved(1), {}, ["C"]),
    "a repeat one row up": (moved(-1), {}, ["C"]),
    "another sign from a station on": (bed(np.repeat([-1, 1], 6) * (3.1 - 0.1 * np.arange(12.0))), {}, ["8"]),
    "centimetres from a station on": (bed(np.repeat([-1, -0.1], 6) * (4.1 - 0.01 * np.arange(12.0))), {}, ["8"]),
}


@pytest.mark.parametrize(("table", "facts", "asked"), ASKED.values(), ids=ASKED)
def test_suspicious_readings_give_one_doubt_each_and_usual_readings_give_none(table, facts, asked):
    assert asked_of(table, **facts) == asked


def test_a_doubt_about_a_reading_has_its_cell_its_answers_and_a_remedy():
    cells = cells_of(changed({(2, 2): 0.0}))
    (doubt,) = doubts_of(cells)
    assert (doubt.kind, doubt.where.named(), doubt.cells) == ("outlier", "lab.csv, cell C4", ("C4",))
    assert doubt.answers == {"as_written": ["C4"]}
    assert "0 mm at s = 10 mm" in doubt.finding
    assert doubt.remedy
    assert cells.readings_mm[2].tolist() == [-10.0, 0.0, -10.06]
    assert doubt.is_remark
    (doubt,) = doubts_of(cells_of(HIGH), depth_mm=8.0)
    assert (doubt.where.part, doubt.cells, doubt.answers) == ("", (), {"as_written": ["sign"]})
    assert not doubt.is_remark


def test_readings_from_the_other_end_are_turned():
    mirrored = np.column_stack([80 - TABLE[:, 0], TABLE[:, 1:]])[::-1]
    turned = cells_of(mirrored).from_other_end(80.0)
    assert turned.s_mm == pytest.approx(TABLE[:, 0])
    assert turned.levels_mm == pytest.approx(TABLE[:, 1:])
