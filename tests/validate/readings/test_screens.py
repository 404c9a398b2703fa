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
    asked = [found[1].replace('"', "") for doubt in profile.doubts if (found := ANSWER.search(doubt))]
    assert len(asked) == len(profile.doubts)
    return asked, profile.doubts


def changed(i: int, j: int, value: float) -> Floats:
    table = TABLE.copy()
    table[i, j] = value
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
    path = written(changed(2, 2, 0.0))
    assert doubts(path)[0] == ["C4"]
    assert "P01.csv, line 4, column level_2_mm, cell C4: 0 mm at s = 10 mm" in doubts(path)[1][0]
    profile = read_readings(path, Declared(), None, 16.0)
    assert profile.repeats_mm is not None
    assert profile.repeats_mm[2].tolist() == [-10.0, 0.0, -10.06]
    assert doubts(path, "C4") == ([], ())


@pytest.mark.parametrize(("value", "cells"), [(-999, ["C4"]), (99.99, ["C4"]), (-9.99, [])])
def test_a_code_for_a_missing_reading_is_named(written, value, cells):
    """Without a depth, by which the first two are refused."""
    assert doubts(written(changed(2, 2, value)), depth_mm=None)[0] == cells


def test_two_zeros_of_three_are_both_named(written):
    table = changed(2, 2, 0.0)
    table[2, 3] = 0.0
    assert doubts(written(table))[0] == ["C4", "D4"]


def test_zero_at_a_filled_end_is_a_reading(written):
    table = TABLE.copy()
    table[-2:, 1:] = 0.0
    assert doubts(written(table))[0] == []
    assert doubts(written(table[:, :2]))[0] == []
    steep = np.column_stack([np.arange(0.0, 60.0, 10.0), [-9.0, -9.0, -8.5, -8.5, -6.5, 0.0]])
    assert doubts(written(steep))[0] == []


def test_a_station_of_zeros_between_deep_ones_is_named(written):
    assert doubts(written(changed(3, 1, 0.0)[:, :2]))[0] == ["B5"]


@pytest.mark.parametrize(("repeats", "cell"), [(3, "B7"), (2, "B7"), (1, "B7")])
def test_a_slip_of_the_sign_is_named(written, repeats, cell):
    table = changed(5, 1, 3.78)[:, : repeats + 1]
    assert doubts(written(table))[0] == [cell]
    assert "3.78 mm at s = 25 mm" in doubts(written(table))[1][0]


def test_a_level_that_rises_above_the_face_is_no_slip(written):
    """Its sign is another than that of the stations below, where the bed steps over the face."""
    table = np.column_stack([np.arange(0, 30, 5), [-1.2, -1.1, -1.2, 1.1, 1.2, 1.1]])
    assert doubts(written(table))[0] == []


def test_a_station_that_scatters_tenfold_is_named(written):
    table = TABLE.copy()
    table[6, 1:] = [-2.3, -4.0, -5.6]
    assert doubts(written(table))[0] == ["8"]
    assert doubts(written(table), "8")[0] == []


@pytest.mark.parametrize("digits", [1, 2])
@pytest.mark.parametrize("repeats", [1, 3])
def test_an_unlabelled_mean_row_is_named(written, repeats, digits):
    table = TABLE[:, : repeats + 1]
    mean = np.round(table[:16].mean(axis=0), digits)
    assert doubts(written(np.vstack([table[:16], mean])))[0] == ["18"]
    assert doubts(written(np.vstack([mean, table[:16]])))[0] == ["2"]


def test_the_middle_of_a_straight_bed_is_no_mean_row(written):
    s_mm = np.arange(0.0, 45.0, 5.0)
    assert doubts(written(np.column_stack([s_mm, -10 + 0.2 * s_mm])))[0] == []


def test_a_repeat_that_is_the_mean_of_the_others_is_named(written):
    means = np.round(TABLE[:, 1:].mean(axis=1), 2)
    assert doubts(written(np.column_stack([TABLE, means])))[0] == ["E"]
    assert doubts(written(np.column_stack([TABLE[:, 0], means, TABLE[:, 1:]])))[0] == ["B"]


def test_copied_repeats_are_named(written):
    table = np.column_stack([TABLE, TABLE[:, 2]])
    assert doubts(written(table))[0] == ["E"]
    assert doubts(written(table), "E")[0] == []


def test_repeats_in_coarse_steps_may_be_alike(written):
    """Of eight stations, two readings in steps of 0.5 mm agree at all of them once in three sheets."""
    table = np.round(TABLE[:8, :3] * 2) / 2
    table[:, 0], table[:, 2] = TABLE[:8, 0], table[:, 1]
    assert doubts(written(table))[0] == []


def test_levels_of_the_other_sign_are_questioned_by_their_height(written):
    s_mm = np.arange(0.0, 45.0, 5.0)
    bed = np.column_stack([s_mm, 4.0 - 0.05 * s_mm, 4.1 - 0.05 * s_mm])
    assert doubts(written(bed), depth_mm=8.0)[0][0] == "sign"
    assert doubts(written(bed * [1, -1, -1], "depth"), depth_mm=8.0)[0][0] == "sign"
    assert doubts(written(bed * [1, -1, -1]), depth_mm=8.0)[0] == []


def test_centimetres_under_millimetres_are_questioned(written):
    table = TABLE / [1, 10, 10, 10]
    assert doubts(written(table))[0] == ["unit"]
    assert doubts(written(table[:, :2], digits=3))[0] == ["unit"]
    assert doubts(written(table), depth_mm=None)[0] == []
    few = written(table[:, :2])
    assert doubts(few)[0] == []
    assert doubts(few, filling=paper_filling())[0] == ["unit"]


def test_a_constant_offset_shows_by_limits_or_by_the_volume(written):
    assert "datum" in doubts(written(shifted(5.0)))[0]
    assert doubts(written(shifted(-3.0)))[0] == ["datum"]
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
    said = Declared.model_validate({"columns": {"s_from": "second"}})
    turned = read_readings(written(mirrored), said, filling.outline.length_mm, 16.0, filling)
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
    asked, told = doubts(path)
    assert asked == ["9, 10", "C", "B3", "5"]
    assert "P01.xlsx, sheet 'Sheet', cell B3 (level_1_mm): -13.07 is struck through" in told[2]
    assert doubts(path, "9", "10", "C", "B3", "5")[0] == []
    assert doubts(path, "9", "C", "B3", "5")[0] == ["9, 10"]


def test_a_long_sheet_names_the_row_of_the_reading(tmp_path):
    lines = ["s_mm,repeat,level_mm"]
    table = changed(2, 2, 0.0)
    lines += [f"{row[0]},{j},{row[j]:.2f}" for row in table for j in (1, 2, 3)]
    path = tmp_path / "P01.csv"
    path.write_text("\n".join(lines))
    assert lines[8] == "10.0,2,0.00"
    assert doubts(path)[0] == ["C9"]


def test_cured_sealant_fills_less(written):
    filling = replace(paper_filling(), volume_mm3=paper_filling().volume_mm3 / 0.6)
    settings = Readings(file=written(TABLE), data="measured", role="held-out", state="cured", shrinkage_percent=40.0)
    assert read_readings(settings.file, settings, 80.0, 16.0, filling).doubts == ()
    wet = settings.model_copy(update={"state": "wet", "shrinkage_percent": None})
    assert len(read_readings(settings.file, wet, 80.0, 16.0, filling).doubts) == 1
