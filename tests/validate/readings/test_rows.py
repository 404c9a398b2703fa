"""Rows as stations: numbers, missing readings, repeats in rows of their own, rows to skip, and the crack's limits."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sealtwin.core.errors import InputError
from tests.validate.readings.conftest import brief, declared_of, listed
from validate.readings.grid import SheetFaults
from validate.readings.read_readings import grid_of_rows, read_readings, readings_of
from validate.settings import Columns, Declared

H = "s [mm];Tiefe [mm]\n"
PAIR = "s [mm];Tiefe 1 [mm];Tiefe 2 [mm]\n"
LONG = "s_mm;Wdh;depth_mm\n5;2;4\n0;1;1\n5;1;3\n0;10;2\n5;10;\n"
RUNS = "s_mm;k;depth_mm\n0;1;1\n5;1;2\n0;2;1,1\n5;2;2,1\n"
TWO = [[-1.0], [-2.0]]
PAIRS = [[-1.0, -1.1], [-2.0, -2.1]]
THREE_DIGITS = H + "0;1,234\n5;{}\n"
SAME = "s [mm];Tiefe [mm]\n0;1\n0;1,1\n5;2\n5;2,1\n"

NUMBERS = {"+1,5": 1.5, "\u22121,5": -1.5, "\u20131,5": -1.5, ",5": 0.5, "1,5e0": 1.5, "01,5": 1.5}
READ = {
    **{
        f"a number: {text!a}": (f"s [mm];level [mm]\n0;{text}\n5;-2\n", {}, [[level_mm], [-2]])
        for text, level_mm in NUMBERS.items()
    },
    **{
        f"the mark is that of {other}": (THREE_DIGITS.format(other), {}, [[-1.234], [level]])
        for other, level in {"16,1": -16.1, "0,250": -0.25, "12,3456": -12.3456}.items()
    },
    "points beside commas that separate": ("s_mm,level_mm\n0,-13.071\n5,-12.071\n", {}, [[-13.071], [-12.071]]),
    "missing readings": (PAIR + "0;n. m.;1,1\n5;-;k.A.\n10;2;/\n", {}, [[None, -1.1], [-2, None]]),
    "a place without readings": (H + "0;1\n3;\n5;2\n", {}, TWO),
    "means": (H + "0;1\n5;2\nMittelwert;1,5\nStabw.;0,5\nØ;1,5\n", {}, TWO),
    "a number of a repeat": (LONG, {}, [[-1, None, -2], [-3, -4, None]]),
    "a declared number of a repeat": (RUNS, {"columns": {"levels": ["C"], "repeat": "B"}}, PAIRS),
    "rows of one place, as written": (SAME, {"as_written": ("repeats",)}, PAIRS),
    "rows to skip": (H + "0;1\n5;2\n9;9\nSoll;7\nx;3\n", {"columns": {"skip": [4, 5, 6]}}, TWO),
    "readings to skip": (PAIR + "0;1;x y\n5;2;2,1\n", {"columns": {"skip": ["C2"]}}, [[-1, None], PAIRS[1]]),
    "repeats below a skipped row": (H + "0;1\n5;9\n;2\n", {"as_written": ("repeats",), "columns": {"skip": [3]}}, TWO),
}


@pytest.mark.parametrize(("text", "declared", "repeats_mm"), READ.values(), ids=READ)
def test_rows_of_common_layouts_are_read_correctly(read, text, declared, repeats_mm):
    profile = read(text, **declared)
    assert [doubt for doubt in profile.questions if doubt.kind == "cell"] == []
    skipped = declared.get("columns", {}).get("skip", [])
    assert all(f"{entry}" in profile.dialect.partition("skipped: ")[2] for entry in skipped)
    assert listed(profile) == [pytest.approx(row) for row in repeats_mm]


def test_an_empty_column_of_the_template_is_no_repeat_and_has_no_missing_readings(read):
    profile = read("s [mm];Tiefe 1 [mm];Tiefe 2 [mm];Tiefe 3 [mm]\n0;1;1,1;\n5;2;;\n9;3;3,1;\n")
    assert "2 repeats" in profile.dialect
    assert "1 reading missing" in profile.dialect


WRONG = "~2|<2|2±0,1|(2)|2*|1.234,5|1 234|1'234|1_0|\u0661|1e999|16. Jan|#2|2/3"
ASKED = {
    **{f"no number: {text}": (H + f"0;1\n5;{text}\n10;3\n", {}, "cell B3 = B3") for text in WRONG.split("|")},
    "another mark": (H + "0;1,5\n5;2.5\n10;3,5\n", {}, "cell B3 = B3"),
    "no place": (H + "0;1\n;2\n10;3\n", {}, "place A3 = repeats 3"),
    "a place that is none": (H + "0;1\nP5;2\n10;3\n", {}, "cell A3 = 3"),
    "numbers that became dates": (H + "0;1\n5.1.2026;16.1.2026\n10;3\n", {}, "cell A3 B3 = 3 B3"),
    "a mark that may be either": (THREE_DIGITS.format("2,345").replace("mm", "\u00b5m"), {}, "decimal"),
    "a place twice": (SAME, {}, "twice A3 A5 = repeats"),
    "a repeat twice": ("s_mm;Wdh;depth_mm\n0;1;1\n0;1;2\n5;1;2\n", {}, "twice A3 = 3"),
    "no such row": (H + "0;1\n5;2\n", {"columns": {"skip": ["B9", 9]}}, "skip"),
    "too few places": (H + "1;1\n2;2\n3;3\n4;3\n", {"columns": {"places": [0, 5, 9]}}, "places"),
    "one station": (H + "0;1\n", {}, "stations"),
    "a place outside the crack": (H + "0;1\n5;2\n300;3\n", {}, "outside A4"),
    "deeper than the crack": (H + "0;1\n5;160\n10;3\n", {}, "deep B3 = B3"),
    "higher than a bead": (H + "0;1\n5;-16\n10;3\n", {}, "deep B3 = B3"),
}


@pytest.mark.parametrize(("text", "declared", "questions"), ASKED.values(), ids=ASKED)
def test_ambiguous_or_impossible_rows_give_a_question(doubts_of, text, declared, questions):
    assert brief([doubt for doubt in doubts_of(text, 10.0, **declared) if doubt.kind != "outlier"]) == questions


def test_rows_of_python_values_are_read_like_rows_of_a_sheet():
    rows = [["s_mm", "depth_1_mm", "depth_2_mm"], [0, 1.0, np.float32(1.5)], [np.int64(5), 2, float("nan")], [9, None]]
    profile = readings_of(grid_of_rows("readings", rows), Declared())
    assert listed(profile) == [[-1, -1.5], [-2, None]]
    declared = declared_of({"s": "A", "levels": ["B", "C"]}, unit="mm", quantity="depth")
    assert listed(readings_of(grid_of_rows("readings", [[0, 1.0, 1.1], [5, 2.0, 2.1]]), declared)) == PAIRS
    with pytest.raises(InputError, match="inf is not a finite number"):
        grid_of_rows("readings", [[0, float("inf")]])
    with pytest.raises(SheetFaults) as caught:
        readings_of(grid_of_rows("readings", [["s_mm", "depth_mm"], [0, True], [5, 2.0], [9, 2.0]]), Declared())
    assert [doubt.cells for doubt in caught.value.doubts] == [("B2",)]


def test_words_behind_a_temperature_are_a_remark(read):
    (remark,) = read("s [mm];Tiefe [mm];Temp. [°C]\n0;1;20 ungefähr\n5;2;22 °C\n10;3;22\n").questions
    assert (remark.kind, remark.cells) == ("remark", ("C2",))


TEXTS = ";s_mm;depth_mm;0;5;1,5;n. m.;Mittel;# x;Riss 2;1 mm;7.5;x;Probe;Wdh;2 %"
CELLS = st.sampled_from(TEXTS.split(";"))


@given(st.lists(st.lists(CELLS, min_size=1, max_size=5), min_size=1, max_size=9), st.sampled_from([None, *"ABC"]))
@example([["s_mm"], ["depth_mm", "depth_mm"]], "A")
@settings(max_examples=60, deadline=None)
def test_any_table_is_read_or_gives_a_question(tmp_path_factory, rows, letter):
    """No arrangement of cells raises another exception, and every station that is read is in the sheet."""
    path = tmp_path_factory.mktemp("any") / "lab.csv"
    path.write_text("\n".join(";".join(row) for row in rows), encoding="utf-8")
    columns = None if letter is None else Columns(s=letter, levels=("B:C",))
    try:
        sheet = read_readings(path, Declared(columns=columns, unit="mm", quantity="depth"))
    except SheetFaults:
        return
    written = {cell.removesuffix(" mm").replace(",", ".") for row in rows for cell in row if "%" not in cell}
    assert {f"{s:g}" for s in sheet.s_mm} <= {f"{float(cell):g}" for cell in written if cell[:1].isdigit()}
