"""Caliper sheets: what is read, and what is refused by file, line, column, value and remedy."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sealtwin.core.errors import InputError
from validate.readings.read_readings import grid_of_rows, read_readings, readings_of
from validate.readings.rows import LONGEST_MM
from validate.settings import Readings

SETTINGS = Readings(file=Path("caliper.csv"), data="measured", role="held-out")
GOOD = """s_mm,level_1_mm,level_2_mm,level_3_mm
0,-16.1,-15.9,-16.0
5,-13.0,-13.2,
10,-10.0,-9.8,-10.2
"""


@pytest.fixture
def sheet(tmp_path):
    def write(content: str | bytes) -> Path:
        path = tmp_path / "caliper.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def read(path: Path, settings: Readings = SETTINGS) -> Any:
    return read_readings(path, settings, length_mm=80.0, depth_mm=16.0)


def take(table: Any, settings: Readings = SETTINGS) -> Any:
    """Read rows of numbers as those of a sheet."""
    grid = grid_of_rows(
        "caliper.csv", [["s_mm", *(f"level_{k}_mm" for k in range(1, table.shape[1]))], *table.tolist()]
    )
    return readings_of(grid, settings, 80.0, 16.0)


def test_levels_are_means_of_the_readings_that_are_there(sheet):
    profile = read(sheet(GOOD))
    assert profile.s_mm.tolist() == [0, 5, 10]
    assert profile.level_mm == pytest.approx([-16.0, -13.1, -10.0])
    assert np.isnan(profile.repeats_mm[1, 2])
    assert (profile.data, profile.source) == ("measured", "caliper.csv")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["no column"]),
        ("s_mm,level_1_cm\n0,-1\n5,-100\n", ["B3", "a level of -1000 mm"]),
        ("s_mm,level_1_mm,depth_2_mm\n0,1,1\n", ["columns.levels"]),
        (GOOD.replace("10,-10.0", "5.0001,-10.0"), ["A4", "twice"]),
        (GOOD.replace("0,-16.1", "-5,-16.1"), ["A2", "outside the crack", "80.0 mm"]),
        (GOOD.replace("-9.8", "9.8"), ["C4", "9.8", "possible", "upward"]),
        (GOOD.replace("-9.8", "-98"), ["C4", "-98"]),
        (GOOD.replace("-10.2", "-10,2"), ["row 4", "semicolons"]),
        (b"s_mm,level_1_mm\n0,\xff\x81\n", ["UTF-8"]),
        ('s_mm,level_1_mm\n0,"1\n5,2\n', ["not a CSV"]),
        ("s_mm,level_1_mm\n0,16\n5,12\n", ["Level counts upward, depth downward"]),
    ],
)
def test_every_fault_is_named_with_its_remedy(sheet, content, words):
    path = sheet(content)
    with pytest.raises(InputError) as fault:
        read(path)
    assert str(fault.value).startswith(str(path))
    assert [word for word in words if word not in str(fault.value)] == []


def test_stations_may_stand_as_close_as_a_caliper_reads(sheet):
    """0.01 mm apart, where binary fractions make it 0.00999999999999801."""
    assert read(sheet("s_mm,level_1_mm\n70.12,-1\n70.13,-1\n")).s_mm.tolist() == [70.12, 70.13]


def test_a_sheet_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match="cannot be opened"):
        read(tmp_path / "absent.csv")


TABLE = np.array([[0, -16.1, -15.9, -16.0], [10, -10.0, -9.8, -10.2], [5, -13.0, -13.2, np.nan]])


def test_readings_in_memory_are_those_of_a_sheet(sheet):
    taken, read_back = take(TABLE), read(sheet(GOOD))
    assert taken.s_mm.tolist() == [0, 5, 10]
    assert taken.level_mm == pytest.approx(read_back.level_mm)
    assert taken.repeats_mm == pytest.approx(read_back.repeats_mm, nan_ok=True)


SLOPE_MM = np.linspace(-12.0, -4.0, 9)


@pytest.mark.parametrize(
    ("change", "answer"),
    [(lambda mm: mm.__setitem__((3, 1), 0.0), "C5"), (lambda mm: mm.__imul__(-0.5), "sign")],
    ids=["a zero", "the sign"],
)
def test_an_array_raises_the_doubts_of_the_same_file(tmp_path, change, answer):
    """Broken on purpose, without its screens, an array raises none."""
    repeats_mm = np.round(SLOPE_MM[:, None] + 0.02 * np.random.default_rng(3).standard_normal((9, 3)), 2)
    change(repeats_mm)
    table = np.round(np.column_stack([np.arange(0.0, 81.0, 10.0), repeats_mm]), 3)
    taken = take(table)
    lines = [",".join(f"{value:g}" for value in row) for row in table]
    file = tmp_path / "caliper.csv"
    file.write_text("\n".join(["s_mm,level_1_mm,level_2_mm,level_3_mm", *lines]), encoding="utf-8")
    of_array, of_file = ([doubt.finding for doubt in one.questions] for one in (taken, read(file)))
    assert of_array == of_file != []
    assert any(doubt.answers["as_written"] == [answer] for doubt in taken.questions)
    answered = take(table, SETTINGS.model_copy(update={"as_written": (answer,)}))
    assert len(answered.doubts) == len(taken.doubts) - 1


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda table: table[:1], "1 station"),
        (lambda table: np.vstack([table, table[:1]]), "twice"),
        (lambda table: np.vstack([table, [90, 1, 1, 1]]), "90 mm in A5"),
        (lambda table: np.vstack([table, [20, 160, 1, 1]]), "160 mm in B5"),
        (lambda table: np.vstack([table, [np.nan, 1, 1, 1]]), "A5"),
    ],
    ids=["one station", "a place twice", "beyond the crack", "above any filling", "nowhere"],
)
def test_readings_in_memory_are_judged_as_those_of_a_sheet(change, named):
    with pytest.raises(InputError, match=r"^caliper\.csv") as caught:
        take(change(TABLE))
    assert named in str(caught.value)


@pytest.mark.parametrize(
    ("length_mm", "inside_mm", "outside_mm"),
    [
        # An end is known to two millimetres. An ingest once let any station pass, minus infinity included.
        *((length_mm, (-2.0,), (-2.1, -1e308)) for length_mm in (None, 80.0, 1000.0)),
        # The scale has its share at the end; without a crack no place is outside.
        (80.0, (82.4,), (82.5,)),
        (1000.0, (1029.0,), ()),
        (None, (900, LONGEST_MM), (1e308,)),
    ],
)
def test_stations_lie_on_the_crack(sheet, length_mm, inside_mm, outside_mm):
    for s_mm in (*inside_mm, *outside_mm):
        path = sheet(f"s_mm,level_1_mm\n{s_mm!r},-1\n40,-1\n")
        if s_mm in inside_mm:
            assert s_mm in read_readings(path, SETTINGS, length_mm, 16.0).s_mm
        else:
            with pytest.raises(InputError, match="A2"):
                read_readings(path, SETTINGS, length_mm, 16.0)
