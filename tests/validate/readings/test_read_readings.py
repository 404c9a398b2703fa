"""Caliper sheets: their readings, and refusals with file, cell, value and remedy."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Profile
from validate.readings.grid import SheetFaults
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


def read(path: Path) -> Profile:
    return read_readings(path, SETTINGS, length_mm=80.0, depth_mm=16.0)


def take(table: Floats, settings: Readings = SETTINGS) -> Profile:
    """Read rows of numbers as those of a sheet."""
    head = ["s_mm", *(f"level_{k}_mm" for k in range(1, table.shape[1]))]
    return readings_of(grid_of_rows("caliper.csv", [head, *table.tolist()]), settings, 80.0, 16.0)


def doubts_of(reader: Callable[[], Profile]) -> Sequence[Doubt]:
    try:
        return reader().questions
    except SheetFaults as faults:
        return faults.doubts


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["no column"]),
        (GOOD.replace("10,-10.0", "5.0001,-10.0"), ["A4", "twice"]),
        (GOOD.replace("-9.8", "9.8"), ["C4", "9.8", "upward"]),
        (GOOD.replace("-10.2", "-10,2"), ["row 4", "semicolons"]),
        (b"s_mm,level_1_mm\n0,\xff\x81\n", ["UTF-8"]),
        ("s_mm,level_1_mm\n0,16\n5,12\n", ["Level counts upward, depth downward"]),
    ],
)
def test_a_faulty_sheet_is_refused_with_the_cell_and_the_reason(sheet, content, words):
    path = sheet(content)
    with pytest.raises(InputError) as fault:
        read(path)
    assert str(fault.value).startswith(str(path))
    assert [word for word in words if word not in str(fault.value)] == []


SLOPE_MM = np.linspace(-12.0, -4.0, 9)


@pytest.mark.parametrize(
    ("change", "answer"),
    [(lambda mm: mm.__setitem__((3, 1), 0.0), "C5"), (lambda mm: mm.__imul__(-0.5), "sign")],
    ids=["a zero", "the sign"],
)
def test_an_array_gives_the_same_doubts_as_a_file_with_its_numbers(sheet, change, answer):
    """Broken on purpose, without the screens for arrays, an array gives no doubts."""
    repeats_mm = np.round(SLOPE_MM[:, None] + 0.02 * np.random.default_rng(3).standard_normal((9, 3)), 2)
    change(repeats_mm)
    table = np.round(np.column_stack([np.arange(0.0, 81.0, 10.0), repeats_mm]), 3)
    lines = [",".join(f"{value:g}" for value in row) for row in table]
    text, confirmed = "\n".join(["s_mm,level_1_mm,level_2_mm,level_3_mm", *lines]), {"as_written": (answer,)}
    of_array, of_file = doubts_of(lambda: take(table)), doubts_of(lambda: read(sheet(text)))
    assert [doubt.finding for doubt in of_array] == [doubt.finding for doubt in of_file] != []
    assert any(doubt.answers["as_written"] == [answer] for doubt in of_array)
    assert len(take(table, SETTINGS.model_copy(update=confirmed)).doubts) == len(of_array) - 1


@pytest.mark.parametrize(
    ("length_mm", "inside_mm", "outside_mm"),
    [
        # An end is known to two millimetres. An ingest once let any station pass, minus infinity included.
        *((length_mm, (-2.0,), (-2.1, -1e308)) for length_mm in (None, 80.0, 1000.0)),
        # The scale's uncertainty counts at the far end; without a crack no position is outside.
        (80.0, (82.4,), (82.5,)),
        (1000.0, (1029.0,), ()),
        (None, (900, LONGEST_MM), (1e308,)),
        # 0.01 mm apart, where binary fractions make it 0.00999999999999801.
        (80.0, (40.01,), ()),
    ],
)
def test_a_station_beyond_the_ends_of_the_crack_is_refused(sheet, length_mm, inside_mm, outside_mm):
    for s_mm in (*inside_mm, *outside_mm):
        path = sheet(f"s_mm,level_1_mm\n{s_mm!r},-1\n40,-1\n")
        with nullcontext() if s_mm in inside_mm else pytest.raises(InputError, match="A2"):
            assert s_mm in read_readings(path, SETTINGS, length_mm, 16.0).s_mm
