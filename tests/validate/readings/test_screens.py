"""Readings that may not be what was meant: each doubt names its cell and its answer, and no value is changed."""

import re
from dataclasses import replace

import numpy as np
import openpyxl
import pytest
from openpyxl.styles import Font

from benchmarks.doubtful_sheets import crack
from sealtwin.core.records import Floats, Profile
from tests.places import FIXTURE
from validate.readings.read_readings import read_readings
from validate.readings.whole_sheet import Filling
from validate.settings import Declared, Readings

TABLE = np.loadtxt(FIXTURE / "caliper.csv", delimiter=",", skiprows=1)
"""The paper's sheet: s, and three repeats from -16 mm at s = 0 to 1 mm at s = 80."""
ANSWER = re.compile(r"readings\.as_written = \[([^]]*)\]")


@pytest.fixture
def written(tmp_path):
    """Write a table of s and repeats."""

    def write(table: Floats, name: str = "level", digits: int = 2):
        path = tmp_path / "P01.csv"
        header = ",".join(["s_mm", *(f"{name}_{j}_mm" for j in range(1, table.shape[1]))])
        rows = [",".join("" if np.isnan(one) else f"{one:.{digits}f}" for one in row) for row in table]
        path.write_text("\n".join([header, *rows]) + "\n")
        return path

    return write


def doubts(path, *as_written: str, depth_mm: float | None = 16.0, filling: Filling | None = None):
    """Return the answers that the sheet's doubts ask for, in order, and the sentences."""
    length_mm = None if filling is None else filling.outline.length_mm
    profile = read_readings(path, Declared(as_written=as_written or None), length_mm, depth_mm, filling)
    asked = [answer[1].replace('"', "") for doubt in profile.doubts if (answer := ANSWER.search(doubt))]
    assert len(asked) == len(profile.doubts)
    return asked, profile.doubts


def changed(values: dict[tuple[int, int], float]) -> Floats:
    table = TABLE.copy()
    for at, value in values.items():
        table[at] = value
    return table


def shifted(offset_mm: float) -> Floats:
    return np.column_stack([TABLE[:, 0], TABLE[:, 1:] + offset_mm])


def paper_filling(*, simulated: Profile | None = None) -> Filling:
    outline, solid = crack(80.0, 16.0)
    filling = Filling(outline, solid, 1.0, simulated)
    return replace(filling, volume_mm3=filling.held_mm3(TABLE[:, 0], TABLE[:, 1:].mean(axis=1)))


def test_the_papers_sheet_is_not_questioned(written):
    simulated = Profile(TABLE[:, 0], TABLE[:, 1] + 1.0)
    assert doubts(written(TABLE), filling=paper_filling(simulated=simulated)) == ([], ())


def test_zero_among_deep_readings_is_named_and_stays(written):
    path = written(changed({(2, 2): 0.0}))
    assert "P01.csv, line 4, column level_2_mm, cell C4: the reading 0 mm at s = 10 mm" in doubts(path)[1][0]
    profile = read_readings(path, Declared(), None, 16.0)
    assert profile.repeats_mm is not None
    assert profile.repeats_mm[2].tolist() == [-10.0, 0.0, -10.06]


def bed(level_mm, *, every_mm: float = 5.0):
    return np.column_stack([every_mm * np.arange(len(level_mm)), level_mm])


def with_mean(repeats: int, digits: int, *, last: bool) -> Floats:
    table = TABLE[:16, : repeats + 1]
    mean = np.round(table.mean(axis=0), digits)
    return np.vstack([table, mean] if last else [mean, table])


MEANS = np.round(TABLE[:, 1:].mean(axis=1), 2)
COARSE = np.round(TABLE[:8, 1:3] * 2) / 2
HIGH = np.column_stack([np.arange(0.0, 45.0, 5.0), 4.0 - 0.25 * np.arange(9), 4.1 - 0.25 * np.arange(9)])
IN_CM = TABLE / [1, 10, 10, 10]

ASKED = {
    "zero among deep readings": (changed({(2, 2): 0.0}), {}, ["C4"]),
    "two zeros of three": (changed({(2, 2): 0.0, (2, 3): 0.0}), {}, ["C4", "D4"]),
    # Codes of a missing reading, without a depth, by which the first two are refused.
    "-999": (changed({(2, 2): -999}), {"depth_mm": None}, ["C4"]),
    "99.99": (changed({(2, 2): 99.99}), {"depth_mm": None}, ["C4"]),
    "-9.99 among tens": (changed({(2, 2): -9.99}), {"depth_mm": None}, []),
    "zero at a filled end": (changed({(i, j): 0.0 for i in (-2, -1) for j in (1, 2, 3)}), {}, []),
    "zero at a filled end, once": (changed({(-2, 1): 0.0, (-1, 1): 0.0})[:, :2], {}, []),
    "zero at a steep end": (bed([-9.0, -9.0, -8.5, -8.5, -6.5, 0.0], every_mm=10.0), {}, []),
    "a station of zeros between deep ones": (changed({(3, 1): 0.0})[:, :2], {}, ["B5"]),
    **{f"a sign that slipped, of {n}": (changed({(5, 1): 3.78})[:, : n + 1], {}, ["B7"]) for n in (1, 2, 3)},
    # Its sign is another than that of the stations below, where the bed steps over the face.
    "a level that rises above the face": (bed([-1.2, -1.1, -1.2, 1.1, 1.2, 1.1]), {}, []),
    "a station that scatters tenfold": (changed({(6, 1): -2.3, (6, 2): -4.0, (6, 3): -5.6}), {}, ["8"]),
    "a mean row, last, of 1, 1 digit": (with_mean(1, 1, last=True), {}, ["18"]),
    "a mean row, last, of 3, 2 digits": (with_mean(3, 2, last=True), {}, ["18"]),
    "a mean row, first, of 3, 1 digit": (with_mean(3, 1, last=False), {}, ["2"]),
    "the middle of a straight bed": (bed(-10 + np.arange(9.0)), {}, []),
    "a mean of the others, last": (np.column_stack([TABLE, MEANS]), {}, ["E"]),
    "a mean of the others, first": (np.column_stack([TABLE[:, 0], MEANS, TABLE[:, 1:]]), {}, ["B"]),
    "copied repeats": (np.column_stack([TABLE, TABLE[:, 2]]), {}, ["E"]),
    # Of eight stations, two readings in steps of 0.5 mm agree at all of them once in three sheets.
    "repeats in coarse steps": (np.column_stack([TABLE[:8, 0], COARSE[:, 0], COARSE[:, 0]]), {}, []),
    "levels above the face": (HIGH, {"depth_mm": 8.0}, ["sign"]),
    "depths above the face": (HIGH * [1, -1, -1], {"depth_mm": 8.0, "name": "depth"}, ["sign"]),
    "levels below the face": (HIGH * [1, -1, -1], {"depth_mm": 8.0}, []),
    "centimetres under millimetres": (IN_CM, {}, ["unit"]),
    "centimetres, of three digits": (IN_CM[:, :2], {"digits": 3}, ["unit"]),
    "centimetres without a depth": (IN_CM, {"depth_mm": None}, []),
    "centimetres, read once": (IN_CM[:, :2], {}, []),
    "centimetres, read once, in a solid": (IN_CM[:, :2], {"filling": True}, ["unit"]),
    "a datum below": (shifted(-3.0), {}, ["datum"]),
}


@pytest.mark.parametrize(("table", "how", "asked"), ASKED.values(), ids=ASKED)
def test_what_may_not_be_meant_is_named_once_and_an_answer_is_enough(written, table, how, asked):
    how = dict(how)
    path = written(table, **{key: how.pop(key) for key in ("name", "digits") if key in how})
    if "filling" in how:
        how["filling"] = paper_filling()
    first = doubts(path, **how)[0]
    assert first[: len(asked)] == asked
    assert bool(first) == bool(asked)
    assert asked == ["sign"] or len(first) == len(asked)
    assert not set(doubts(path, *asked, **how)[0]) & set(asked)


def test_a_constant_offset_shows_by_limits_or_by_the_volume(written):
    assert "datum" in doubts(written(shifted(5.0)))[0]
    flat = np.column_stack([np.arange(0.0, 85.0, 5.0), np.full(17, -6.0), np.full(17, -5.9)])
    filling = paper_filling()
    full = replace(filling, volume_mm3=filling.held_mm3(flat[:, 0], flat[:, 1] - 5))
    assert doubts(written(flat))[0] == []
    assert doubts(written(flat), filling=full)[0] == ["datum"]


def test_the_direction_of_s_is_questioned_by_the_simulated_level(written):
    mirrored = np.column_stack([80 - TABLE[:, 0], TABLE[:, 1:]])
    simulated = Profile(TABLE[:, 0], TABLE[:, 1] + 1.0)
    assert doubts(written(mirrored), filling=paper_filling())[0] == []
    filling = paper_filling(simulated=simulated)
    assert doubts(written(mirrored), filling=filling)[0] == ["direction"]
    turned_round = Declared.model_validate({"columns": {"s_from": "second"}})
    turned = read_readings(written(mirrored), turned_round, filling.outline.length_mm, 16.0, filling)
    assert turned.doubts == ()
    as_meant = read_readings(written(TABLE), Declared(), filling.outline.length_mm, 16.0, filling)
    assert turned.s_mm == pytest.approx(as_meant.s_mm, abs=filling.outline.length_mm - 80 + 1e-9)
    assert turned.level_mm == pytest.approx(as_meant.level_mm)
    assert turned.repeats_mm == pytest.approx(as_meant.repeats_mm)


def test_struck_and_hidden_cells_are_named(tmp_path):
    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    sheet.append(["s_mm", "level_1_mm", "level_2_mm", "note"])
    for row in TABLE:
        sheet.append([*row[:3].tolist(), "x"])
    for cell in ("B3", "A5", "B5", "C5", "D7"):
        sheet[cell].font = Font(strike=True)
    for row in (9, 10):
        sheet.row_dimensions[row].hidden = True
    sheet.column_dimensions["C"].hidden = True
    path = tmp_path / "P01.xlsx"
    book.save(path)
    asked, sentences = doubts(path)
    assert asked == ["9, 10", "C", "B3", "5"]
    assert "P01.xlsx, sheet 'Sheet', cell B3 (level_1_mm): -13.07 is struck through" in sentences[2]
    assert doubts(path, "9", "10", "C", "B3", "5")[0] == []
    assert doubts(path, "9", "C", "B3", "5")[0] == ["9, 10"]


def test_cured_sealant_fills_less(written):
    filling = replace(paper_filling(), volume_mm3=paper_filling().volume_mm3 / 0.6)
    settings = Readings(file=written(TABLE), data="measured", role="held-out", state="cured", shrinkage_percent=40.0)
    assert read_readings(settings.file, settings, 80.0, 16.0, filling).doubts == ()
    wet = settings.model_copy(update={"state": "wet", "shrinkage_percent": None})
    assert len(read_readings(settings.file, wet, 80.0, 16.0, filling).doubts) == 1
