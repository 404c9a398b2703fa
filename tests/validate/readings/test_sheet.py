"""Sheets in text: what is asked and never guessed, and every fault of a file named at once."""

import os
from pathlib import Path

import numpy as np
import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile
from validate.readings.read_readings import read_readings
from validate.readings.samples import read_cells
from validate.readings.sheet import MOST_SHOWN, SheetFaults
from validate.settings import Columns, Declared, Readings


@pytest.fixture
def read(tmp_path):
    def from_text(text: str | bytes, depth_mm: float | None = None, **declared) -> Profile:
        path = tmp_path / "lab.csv"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return read_readings(path, Declared(**declared), 80.0, depth_mm)

    return from_text


def faults_of(read, text: str | bytes, **declared) -> SheetFaults:
    with pytest.raises(SheetFaults) as caught:
        read(text, **declared)
    return caught.value


@pytest.mark.parametrize(("decimal", "depth_mm"), [("comma", 1.234), ("point", None)])
def test_a_comma_before_three_digits_is_asked_for(read, decimal, depth_mm):
    """The text 1,234 is one and a quarter, or more than a thousand."""
    text = "s [mm]\tTiefe [mm]\n5\t1,234\n10\t2,345\n"
    (fault,) = faults_of(read, text).faults
    assert "'1,234' is 1.234, or 1234" in fault.finding
    assert "2 such numbers" in fault.finding
    assert 'decimal = "comma" or "point"' in fault.remedy
    assert (fault.place.row, fault.place.name, fault.value) == (2, "Tiefe [mm]", "1,234")
    if depth_mm is None:
        (*_, last) = faults_of(read, text, decimal=decimal).faults
        assert "thousands" in last.finding
    else:
        assert read(text, decimal=decimal).repeats_mm[0, 0] == -depth_mm


@pytest.mark.parametrize("other", ["16,1", "0,250", "12,3456", "1234,5", "-,5"])
def test_the_rest_of_the_file_may_tell_the_mark(read, other):
    assert read(f"s [mm]\tTiefe [mm]\n5\t1,234\n10\t{other}\n").repeats_mm[0, 0] == -1.234


def test_points_before_three_digits_are_decimals_where_commas_separate(read):
    """A table of numbers with three decimals, as programs write it."""
    assert read("s_mm,level_1_mm\n5.125,-13.071\n6.125,-12.071\n").repeats_mm[:, 0].tolist() == [-13.071, -12.071]


@pytest.mark.parametrize("text", ["1.234,5", "1 234", "1'234", "1,234.5", "1.234.567"])
def test_thousands_set_apart_are_refused(read, text):
    fault = faults_of(read, f"s [mm];Tiefe [mm]\n5;2,5\n10;{text}\n").faults[0]
    assert fault.value == text
    assert fault.place.row == 3


def test_which_way_readings_count_is_asked_for(read):
    text = "s [mm];rep1 [mm];rep2 [mm]\n0;-1,5;-1,6\n5;-2;-2,1\n"
    (fault,) = faults_of(read, text).faults
    assert "upward or downward" in fault.finding
    assert "quantity" in fault.remedy
    assert read(text, quantity="level").repeats_mm[0].tolist() == [-1.5, -1.6]
    assert read(text, quantity="depth").repeats_mm[0].tolist() == [1.5, 1.6]


def test_the_unit_is_asked_for(read):
    text = "s;Tiefe\n0;1,5\n5;2\n"
    (fault,) = faults_of(read, text).faults
    assert "no unit" in fault.finding
    assert '[readings] unit = "mm"' in fault.remedy
    assert read(text, unit="cm").repeats_mm[:, 0].tolist() == [-15, -20]


def test_what_is_declared_cannot_contradict_the_sheet(read):
    text = "s [mm];Tiefe [cm]\n0;1,5\n5;2\n"
    assert "quantity" in str(faults_of(read, text, quantity="level"))
    assert "readings.unit differ" in str(faults_of(read, text, unit="cm"))
    assert "which has no sheets" in str(faults_of(read, text, sheet="Messung"))
    assert read(text, quantity="depth").repeats_mm[1, 0] == -20


def test_the_datum_lifts_all_levels_alike(read):
    text = "s [mm];Tiefe [mm]\n0;1,5\n5;2\n"
    base = read(text, datum="caliper_base", datum_level_mm=4.0)
    assert base.repeats_mm[:, 0].tolist() == [2.5, 2.0]
    assert "from the caliper's base, +4 mm from the sample surface" in base.dialect
    assert read(text).repeats_mm[:, 0].tolist() == [-1.5, -2.0]


def test_each_reading_is_in_its_own_unit(read):
    sheet = read("s [m],depth 1 [cm],depth 2 [inch]\n0,1,1\n0.01,2,2\n")
    assert sheet.s_mm.tolist() == [0, 10]
    assert sheet.repeats_mm.tolist() == [[-10, -25.4], [-20, -50.8]]


PLANTED = """Riss 4;;;;
Abstand [mm];Tiefe 1 [mm];Tiefe 2 [mm];Bemerkung;
0;-1,5;1,4;gut;
5;zwei;1,4;;
;1,4;1,4;;
10;1.4;n/a;;
15;1,4;nan;;x
20;1,4
5;1,4;1,4;;
300;1,4;160;;
Mittel;1,4;1,4;;
"""


def test_all_faults_of_a_file_are_named_at_once(read):
    faults = faults_of(read, PLANTED, depth_mm=16)
    found = {(fault.place.row, fault.place.name, fault.value): str(fault) for fault in faults.faults}
    assert list(found) == [
        (4, "Tiefe 1 [mm]", "zwei"),
        (5, "Abstand [mm]", ""),
        (6, "Tiefe 1 [mm]", "1.4"),
        (10, "Abstand [mm]", "300"),
        (10, "Tiefe 2 [mm]", "160"),
        (9, "Abstand [mm]", "5"),
    ]
    for row, words in {4: "not a number in mm, such as -4,25", 6: "decimal comma"}.items():
        assert any(words in text for (at, _, _), text in found.items() if at == row)
    assert str(faults).count("\n") == len(found) - 1
    assert all(
        text.startswith(str(fault.place.path)) for text, fault in zip(found.values(), faults.faults, strict=True)
    )


def test_a_message_stays_readable(read):
    columns = range(1, MOST_SHOWN + 5)
    names = ",".join(f"level_{column}_mm" for column in columns)
    faults = faults_of(read, f"s_mm,{names}\n" + "".join(f"{i}{',deep' * len(columns)}\n" for i in range(125)))
    lines = str(faults).splitlines()
    assert len(lines) == MOST_SHOWN + 1
    assert lines[-1].endswith("more faults like these.")


def test_one_mistake_in_many_rows_is_told_once(read):
    faults = faults_of(
        read, "s_mm;level_mm\n" + "".join(f"{i};{word}\n" for i, word in enumerate(["x", "yy", "-"] * 4))
    )
    (line,) = str(faults).splitlines()
    assert "line 2, column level_mm: 'x' is not a number in mm" in line
    assert line.endswith("The same in 7 more: row 3, 5, 6, 8, 9, 11, 12.")
    (line,) = str(faults_of(read, "s_mm,level_mm\n" + "".join(f"{i},deep\n" for i in range(3_000)))).splitlines()
    assert line.endswith("The same in 999 more: row 3 to 1001.")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("s_mm,depth_mm,\n0,1,7\n5,1,\n", ["line 2", "3 fields under 2"]),
        ("s_mm,,depth_mm\n0,7,1\n5,,1\n", ["line 1", "column B contains numbers and has no name"]),
        ("s_mm,position_mm,depth_mm\n0,0,1\n5,5,1\n", ["'s_mm', 'position_mm' both name the station"]),
        ("s_mm,mean depth_mm\n0,1\n5,1\n", ["no column of readings beside 's_mm'", "B 'mean depth_mm' (1)", "levels"]),
        ("s_mm,depth 1_mm,rep2_mm\n0,1,1\n5,1,2\n", ["'rep2_mm': neither header"]),
        (
            "s_mm,depth 1_mm,depth 2_mm,depth_mm\n0,1,1,1\n5,1,2,2\n",
            ["'depth_mm': no repeat number, but there are 3 columns"],
        ),
        ("s_mm,depth 1_mm,depth 1_cm\n0,1,1\n5,1,2\n", ["'depth 1_mm', 'depth 1_cm'"]),
        ("s_mm,repeat,depth_mm\n0,1,1\n0,1,2\n5,1,2\n", ["line 3", "repeat '1' of 0 mm"]),
        ("s_mm,repeat,depth_mm\n0,,1\n5,1,2\n", ["line 2", "column repeat"]),
        ("s_mm,repeat,rep1_mm,rep2_mm\n0,1,1,1\n5,1,2,2\n", ["numbers repeats, but there are several columns"]),
        ("s_mm,depth_mm\n0,1\n0,2\n5,2\n", ["line 3", "first in row 2", "column 'repeat'"]),
        ("s_mm,depth_mm\n0,1\n5,2 mm\n", ["line 3", "'2 mm' is not a number"]),
        ("s_mm,depth_mm\n0,1\n5,1_0\n", ["'1_0' is not a number"]),
        ("s_mm,depth_mm\n0,1\n5,\u0661\n", ["is not a number"]),
        ("s_mm,depth_mm\n0,1\n5,1e999\n", ["'1e999' is not a number"]),
        ("s_mm,depth_mm\n0,1\n5,a\x1b[31mb\x00\n", ["'a\\x1b[31mb\\x00' is not a number"]),
        ("sep=|\ns_mm|depth_mm\n0|1\n", ["no column of places", "read as CSV, UTF-8"]),
    ],
)
def test_faults_are_named_with_their_place(read, text, words):
    message = str(faults_of(read, text))
    for word in words:
        assert word in message


def test_a_long_sheet_gathers_its_stations_from_anywhere(read):
    sheet = read("s_mm,Wdh,depth_mm\n5,2,4\n0,1,1\n5,1,3\n0,10,2\n5,10,\n")
    assert "long, 3 repeats" in sheet.dialect
    np.testing.assert_array_equal(sheet.repeats_mm, [[-1, np.nan, -2], [-3, -4, np.nan]])


def test_a_bare_messung_holds_the_readings_where_nothing_else_does(read):
    assert read("s [mm];Messung\n0;1\n5;2\n", quantity="depth", unit="mm").repeats_mm.tolist() == [[-1], [-2]]


@pytest.mark.parametrize(("text", "level_mm"), [("+1,5", 1.5), ("\u22121,5", -1.5), ("\u20131,5", -1.5), (",5", 0.5)])
def test_signs_are_read_as_people_and_word_processors_write_them(read, text, level_mm):
    assert read(f"s [mm];level [mm]\n0;{text}\n5;-2\n").repeats_mm[0, 0] == level_mm


def test_a_line_that_holds_only_a_remark_is_no_reading(read):
    assert read("s_mm,depth_mm,note\n0,1,\n,,the caliper slipped\n5,2,\n").s_mm.tolist() == [0, 5]


def test_a_header_of_two_lines_is_read_as_one(read):
    text = "Riss 4;;;\nPosition [mm];Tiefe;;Bemerkung\n;1. Messung;2. Messung;\n;mm;mm;\n0;1,5;1,6;gut\n5;2,5;2,6;\n"
    sheet = read(text)
    assert sheet.repeats_mm.tolist() == [[-1.5, -1.6], [-2.5, -2.6]]
    fault = faults_of(read, text.replace("2,6", "x")).faults[0]
    assert (fault.place.row, fault.place.name) == (6, "Tiefe 2. Messung")


def test_a_sheet_says_how_it_was_understood(read):
    sheet = read("Probe 7\n\nAbstand [cm];Tiefe 1 [mm];Tiefe 2 [mm];Mittelwert\n0;1,5;k.A.;1,5\n1;2;-;2\n")
    assert sheet.dialect == (
        "CSV, UTF-8, semicolons, decimal comma; wide, 2 repeats; depth downward in mm from the sample surface, places "
        "in cm; 2 readings missing; 1 line above the header; not readings: Mittelwert"
    )


def test_the_separator_may_be_declared_or_announced(read):
    """Notes full of semicolons divide the rows of this one as evenly as its commas do."""
    text = "s_mm,depth_mm,note; who; why\n0,1,a;b;c\n5,2,d;e;f\n"
    assert "read as CSV, UTF-8, semicolons" in str(faults_of(read, text))
    assert read(text, separator="comma").repeats_mm[:, 0].tolist() == [-1, -2]
    assert read("sep=,\n" + text).repeats_mm[:, 0].tolist() == [-1, -2]
    assert "line 3, column depth_mm" in str(faults_of(read, "sep=;\ns_mm;depth_mm\n0;x\n"))


@pytest.mark.parametrize(
    "table",
    [
        {"datum": "sealant_top"},
        {"datum": "sample_surface", "datum_level_mm": 1.0},
        {"datum_level_mm": 1.0},
        {"decimal": ","},
        {"unit": "micron"},
    ],
)
def test_half_a_declaration_is_refused(table):
    with pytest.raises(InputError):
        Declared(**table)


def test_only_cured_sealant_has_shrunk():
    given = {"file": Path("a.csv"), "data": "measured", "role": "held-out", "shrinkage_percent": 3.0}
    assert Readings(**given, state="cured").shrinkage_percent == 3.0
    with pytest.raises(InputError, match="cured"):
        Readings(**given)


def test_cells_of_any_table_can_be_read(tmp_path):
    """Notes of a sample are pairs of a key and a value; they need no header."""
    path = tmp_path / "note.csv"
    path.write_text("Probe;7\nTiefe [mm];16,5\n")
    grid = read_cells(path, Declared())
    assert [[cell.text for cell in row.cells] for row in grid.rows] == [["Probe", "7"], ["Tiefe [mm]", "16,5"]]


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="cannot be opened"):
        read_cells(tmp_path / "pipe.csv", Declared())


def test_a_lone_column_of_means_is_told_how_to_be_taken(read):
    faults = str(faults_of(read, "s_mm,level_mean_mm\n0,-1\n5,-2\n"))
    assert "no column of readings beside 's_mm' in A 's_mm' (0), B 'level_mean_mm' (-1)" in faults
    assert read("s_mm,level_mean_mm\n0,-1\n5,-2\n", columns=Columns(levels=("B",)), quantity="level").level_mm[0] == -1
