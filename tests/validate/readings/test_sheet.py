"""Sheets in text: what is asked and never guessed, and every fault of a file named at once."""

import os
from pathlib import Path

import pytest

from sealtwin.core.errors import InputError
from validate.readings.samples import read_cells
from validate.readings.sheet import MOST_SHOWN
from validate.settings import Declared, Readings

MM = "s [mm];Tiefe [mm]\n0;1,5\n5;2\n"
THREE_DIGITS = "s [mm]\tTiefe [mm]\n5\t1,234\n10\t{}\n"
NO_UNIT = "s;Tiefe\n0;1,5\n5;2\n"
NO_WAY = "s [mm];rep1 [mm];rep2 [mm]\n0;-1,5;-1,6\n5;-2;-2,1\n"
BASE = {"datum": "caliper_base", "datum_level_mm": 4.0}
LONG = "s_mm,Wdh,depth_mm\n5,2,4\n0,1,1\n5,1,3\n0,10,2\n5,10,\n"
TWO_LINES = "Riss 4;;;\nPosition [mm];Tiefe;;Bemerkung\n;1. Messung;2. Messung;\n;mm;mm;\n0;1,5;1,6;gut\n5;2,5;2,6;\n"
NOTES = "s_mm,depth_mm,note; who; why\n0,1,a;b;c\n5,2,d;e;f\n"
"""Notes full of semicolons divide the rows of this one as evenly as its commas do."""
MEANS = "s_mm,level_mean_mm\n0,-1\n5,-2\n"
SIGNED = "s [mm];level [mm]\n0;{}\n5;-2\n"

READ = {
    "a declared comma": (THREE_DIGITS.format("2,345"), {"decimal": "comma"}, [[-1.234], [-2.345]]),
    **{
        f"the mark is told by {other}": (THREE_DIGITS.format(other), {}, [[-1.234], *levels])
        for other, levels in {"16,1": [[-16.1]], "0,250": [[-0.25]], "12,3456": [[-12.3456]], "-,5": [[0.5]]}.items()
    },
    "points are decimals beside commas": ("s_mm,level_mm\n5.125,-13.071\n6,-12.071\n", {}, [[-13.071], [-12.071]]),
    "declared levels": (NO_WAY, {"quantity": "level"}, [[-1.5, -1.6], [-2, -2.1]]),
    "declared depths": (NO_WAY, {"quantity": "depth"}, [[1.5, 1.6], [2, 2.1]]),
    "a declared unit": (NO_UNIT, {"unit": "cm"}, [[-15], [-20]]),
    "what the sheet says too": ("s [mm];Tiefe [cm]\n0;1,5\n5;2\n", {"quantity": "depth"}, [[-15], [-20]]),
    "the surface is the datum": (MM, {}, [[-1.5], [-2]]),
    "a datum lifts all alike": (MM, BASE, [[2.5], [2]]),
    "each in its own unit": ("s [m],depth 1 [cm],depth 2 [inch]\n0,1,1\n0.01,2,2\n", {}, [[-10, -25.4], [-20, -50.8]]),
    "long, from anywhere": (LONG, {}, [[-1, None, -2], [-3, -4, None]]),
    "a bare Messung": ("s [mm];Messung\n0;1\n5;2\n", {"quantity": "depth", "unit": "mm"}, [[-1], [-2]]),
    **{
        f"a sign: {text!a}": (SIGNED.format(text), {}, [[level_mm], [-2]])
        for text, level_mm in {"+1,5": 1.5, "\u22121,5": -1.5, "\u20131,5": -1.5, ",5": 0.5}.items()
    },
    "a line of a remark": ("s_mm,depth_mm,note\n0,1,\n,,the caliper slipped\n5,2,\n", {}, [[-1], [-2]]),
    "a header of two lines": (TWO_LINES, {}, [[-1.5, -1.6], [-2.5, -2.6]]),
    "a declared separator": (NOTES, {"separator": "comma"}, [[-1], [-2]]),
    "an announced separator": ("sep=,\n" + NOTES, {}, [[-1], [-2]]),
    "a declared column of means": (MEANS, {"columns": {"levels": ["B"]}, "quantity": "level"}, [[-1], [-2]]),
}


@pytest.mark.parametrize(("text", "declared", "repeats_mm"), READ.values(), ids=READ)
def test_numbers_are_read_as_they_are_meant(read, text, declared, repeats_mm):
    read_mm = read(text, **declared).repeats_mm.tolist()
    assert [[None if mm != mm else mm for mm in row] for row in read_mm] == repeats_mm


REFUSED = [
    (MM.replace("[mm]\n", "[cm]\n"), {"quantity": "level"}, ["quantity"]),
    (MM.replace("[mm]\n", "[cm]\n"), {"unit": "mm"}, ["readings.unit differ"]),
    (MM, {"sheet": "Messung"}, ["which has no sheets"]),
    (THREE_DIGITS.format("2,345"), {"decimal": "point"}, ["thousands"]),
    (NOTES, {}, ["read as CSV, UTF-8, semicolons"]),
    ("sep=;\ns_mm;depth_mm\n0;x\n", {}, ["line 3, column depth_mm"]),
    (MEANS, {}, ["no column of readings besides 's_mm' in A 's_mm' (0), B 'level_mean_mm' (-1)"]),
    ("s_mm,depth_mm,\n0,1,7\n5,1,\n", {}, ["line 2", "3 fields under 2"]),
    ("s_mm,,depth_mm\n0,7,1\n5,,1\n", {}, ["line 1", "column B contains numbers and has no name"]),
    ("s_mm,position_mm,depth_mm\n0,0,1\n5,5,1\n", {}, ["'s_mm', 'position_mm' both name the station"]),
    ("s_mm,mean depth_mm\n0,1\n5,1\n", {}, ["no column of readings besides 's_mm'", "B 'mean depth_mm' (1)", "levels"]),
    ("s_mm,depth 1_mm,rep2_mm\n0,1,1\n5,1,2\n", {}, ["'rep2_mm': nothing states"]),
    ("s_mm,depth 1_mm,depth 2_mm,depth_mm\n0,1,1,1\n5,1,2,2\n", {}, ["'depth_mm': no repeat number, but there are 3"]),
    ("s_mm,depth 1_mm,depth 1_cm\n0,1,1\n5,1,2\n", {}, ["'depth 1_mm', 'depth 1_cm'"]),
    ("s_mm,repeat,depth_mm\n0,1,1\n0,1,2\n5,1,2\n", {}, ["line 3", "repeat '1' of 0 mm"]),
    ("s_mm,repeat,depth_mm\n0,,1\n5,1,2\n", {}, ["line 2", "column repeat"]),
    ("s_mm,repeat,rep1_mm,rep2_mm\n0,1,1,1\n5,1,2,2\n", {}, ["numbers repeats, but there are several columns"]),
    ("s_mm,depth_mm\n0,1\n0,2\n5,2\n", {}, ["line 3", "first in row 2", "column 'repeat'"]),
    ("s_mm,depth_mm\n0,1\n5,2 mm\n", {}, ["line 3", "'2 mm' is not a number"]),
    ("s_mm,depth_mm\n0,1\n5,1_0\n", {}, ["'1_0' is not a number"]),
    ("s_mm,depth_mm\n0,1\n5,\u0661\n", {}, ["is not a number"]),
    ("s_mm,depth_mm\n0,1\n5,1e999\n", {}, ["'1e999' is not a number"]),
    ("s_mm,depth_mm\n0,1\n5,a\x1b[31mb\x00\n", {}, ["'a\\x1b[31mb\\x00' is not a number"]),
    ("sep=|\ns_mm|depth_mm\n0|1\n", {}, ["no column of places", "read as CSV, UTF-8"]),
]


@pytest.mark.parametrize(("text", "declared", "words"), REFUSED)
def test_faults_are_named_with_their_place(refused, text, declared, words):
    message = str(refused(text, **declared))
    assert [word for word in words if word not in message] == []


@pytest.mark.parametrize(
    ("text", "row", "name", "value", "finding", "remedy"),
    [
        (
            *(THREE_DIGITS.format("2,345"), 2, "Tiefe [mm]", "1,234"),
            *(["'1,234' is 1.234, or 1234", "2 numbers are like this"], 'decimal = "comma" or "point"'),
        ),
        *(
            (f"s [mm];Tiefe [mm]\n5;2,5\n10;{text}\n", 3, "Tiefe [mm]", text, [], "")
            for text in ("1.234,5", "1 234", "1'234", "1,234.5", "1.234.567")
        ),
        (NO_WAY, 1, "", "", ["upward or downward"], "quantity"),
        (NO_UNIT, 1, "", "", ["no unit"], '[readings] unit = "mm"'),
        (TWO_LINES.replace("2,6", "x"), 6, "Tiefe 2. Messung", "x", [], ""),
    ],
)
def test_a_question_has_its_place_its_value_and_its_answer(refused, text, row, name, value, finding, remedy):
    fault = refused(text).faults[0]
    assert (fault.place.row, fault.place.name or "", fault.value or "") == (row, name, value)
    assert [words for words in finding if words not in fault.finding] == []
    assert remedy in fault.remedy


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


def test_all_faults_of_a_file_are_named_at_once(refused):
    faults = refused(PLANTED, 16.0)
    texts = {(fault.place.row, fault.place.name, fault.value): str(fault) for fault in faults.faults}
    assert list(texts) == [
        (4, "Tiefe 1 [mm]", "zwei"),
        (5, "Abstand [mm]", ""),
        (6, "Tiefe 1 [mm]", "1.4"),
        (10, "Abstand [mm]", "300"),
        (10, "Tiefe 2 [mm]", "160"),
        (9, "Abstand [mm]", "5"),
    ]
    assert "not a number in mm, such as -4,25" in texts[4, "Tiefe 1 [mm]", "zwei"]
    assert "decimal comma" in texts[6, "Tiefe 1 [mm]", "1.4"]
    assert str(faults).count("\n") == len(texts) - 1
    assert all(text.startswith(str(faults.faults[0].place.path)) for text in texts.values())


def test_a_message_stays_readable(refused):
    columns = range(1, MOST_SHOWN + 5)
    names = ",".join(f"level_{column}_mm" for column in columns)
    faults = refused(f"s_mm,{names}\n" + "".join(f"{i}{',deep' * len(columns)}\n" for i in range(125)))
    lines = str(faults).splitlines()
    assert len(lines) == MOST_SHOWN + 1
    assert lines[-1].endswith("more faults like these.")


def test_one_mistake_in_many_rows_is_told_once(refused):
    words = enumerate(["x", "yy", "-"] * 4)
    (line,) = str(refused("s_mm;level_mm\n" + "".join(f"{i};{word}\n" for i, word in words))).splitlines()
    assert "line 2, column level_mm: 'x' is not a number in mm" in line
    assert line.endswith("7 more rows: 3, 5, 6, 8, 9, 11, 12.")
    (line,) = str(refused("s_mm,level_mm\n" + "".join(f"{i},deep\n" for i in range(1_100)))).splitlines()
    assert line.endswith("999 more rows: 3 to 1001.")


@pytest.mark.parametrize(
    "table",
    [{"datum": "sealant_top"}, {"datum": "sample_surface", "datum_level_mm": 1.0}, {"datum_level_mm": 1.0}],
)
def test_half_a_declaration_is_refused(table):
    with pytest.raises(InputError):
        Declared(**table)


def test_only_cured_sealant_has_shrunk():
    given = {"file": Path("a.csv"), "data": "measured", "role": "held-out", "shrinkage_percent": 3.0}
    assert Readings(**given, state="cured").shrinkage_percent == 3.0
    with pytest.raises(InputError, match="cured"):
        Readings(**given)


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="cannot be opened"):
        read_cells(tmp_path / "pipe.csv", Declared())
