"""Notes with a place and its readings in each line, and several readings in one cell."""

import pytest

from validate.readings.text_table import several

LINES = "0: 11,1 11,1 10.8\n10: 11,4 11.2 11,3\n20: 10,9 n.m. 11,0\n"
LEVELS = [[-11.1, -11.1, -10.8], [-11.4, -11.2, -11.3], [-10.9, None, -11.0]]
MM_DOWN = {"unit": "mm", "quantity": "depth"}
ANNA = "[12.03.26, 14:05:11] Anna M.: "
ALONE = "0: 11,12\n10: 11,13\n20: 12,11\n"
LISTED = """\
S14
Tiefe ab Oberkante in mm

bei 0 mm
11,1
11,1
10.8
bei 10 mm
11,4
11.2
11,3
eine Blase hier
bei 20 mm
10,9
n.m.
11,0
"""
MARKDOWN = """\
# S14, 12.3.
Tiefe ab Oberkante in mm

| s (cm) | 1st  | 2nd  | 3rd  |
|-------:|-----:|:----:|------|
| 0      | 11.1 | 11.1 | 10.8 |
| 1      | 11.4 | 11.2 | 11.3 |
| 2      | 10.9 | -    | 11.0 |
"""
BEHIND = (" \u2014 ", " · ", " | ", "  ", " = ")
CELLS = "s [mm];Tiefe [mm]\n0;{}\n10;11,4/11.2/11,3\n20;10,9 n.m. 11,0\n"

DASHED = "0 - 11,1 - 11,1 - 10.8\n10 - 11,4 - 11.2 - 11,3\n20 - 10,9 - n.m. - 11,0\n"
SIGNED = "0 - 1,0 / 1,1\n10 - -1,0 / 1,1\n20 - 1,0 / 1,2\n"

READ = {
    **{f"{mark!r} behind a place": (LINES.replace(": ", f" mm{mark}"), MM_DOWN, LEVELS) for mark in BEHIND},
    "dots between readings": (
        *("- 0 mm \u2014 11,1 · 11,1 · 10.8\n- 10 mm \u2014 11,4 · 11.2 · 11,3\n- 20 mm \u2014 10,9 · n.m. · 11,0\n",),
        *(MM_DOWN, LEVELS),
    ),
    "a dash, as answered": (DASHED, {**MM_DOWN, "as_written": ("dash",)}, LEVELS),
    "a minus, as answered": (DASHED, {"unit": "mm", "quantity": "level", "as_written": ("minus",)}, LEVELS),
    "a dash before a minus": (SIGNED, MM_DOWN, [[-1.0, -1.1], [1.0, -1.1], [-1.0, -1.2]]),
    "a title with quantity and unit": ("S14 Tiefe mm\n" + LINES, {"unit": "mm"}, LEVELS),
    "a title with the unit beside unknown words": (
        "Profondeur sous la face en mm, 3 mesures par point\n(xyz = abc)\n" + LINES.replace(":", " mm:"),
        {"quantity": "depth"},
        LEVELS,
    ),
    "a title with the unit in brackets": (
        "S14 Tiefe ab xyz (mm)\n" + LINES.replace(":", " mm:"),
        {"quantity": "depth"},
        LEVELS,
    ),
    "a list in Markdown": ("- **0:** " + LINES[3:].replace("\n1", "\n- 1").replace("\n2", "\n- 2"), MM_DOWN, LEVELS),
    "a messenger": (ANNA + "S14 Tiefe\n" + ANNA + LINES.replace("\n1", f"\n{ANNA}1"), {"unit": "mm"}, LEVELS),
    "semicolons, slashes and tabs": (
        "0: 11,1; 11,1; 10.8\n10: 11,4/11.2/11,3\n20:\t10,9\tn.m.\t11,0\nMittel: 11,2\n",
        MM_DOWN,
        LEVELS,
    ),
    "a declared comma": (ALONE, {"decimal": "comma", **MM_DOWN}, [[-11.12], [-11.13], [-12.11]]),
    "commas that separate": (ALONE, {"decimal": "point", **MM_DOWN}, [[-11, -12], [-11, -13], [-12, -11]]),
    "readings below their place": (LISTED, {}, LEVELS),
    "a table in Markdown": (MARKDOWN, {"columns": {"s": "A", "levels": ["B:D"]}}, LEVELS),
    "a declared word among readings": (
        LINES.replace("n.m.", "n.l."),
        {"columns": {"missing": ["n.l."]}, **MM_DOWN},
        LEVELS,
    ),
    "cells": (CELLS.format("11,1 11,1 10.8"), {}, LEVELS),
    "a cell with more, as written": (
        CELLS.format("11,1 11,1 10 8"),
        {"as_written": ("2",)},
        [[-11.1, -11.1, -10, -8], [*LEVELS[1], None], [*LEVELS[2], None]],
    ),
}


@pytest.mark.parametrize(("text", "declared", "levels_mm"), READ.values(), ids=READ)
def test_a_note_is_read_with_its_repeats(read, text, declared, levels_mm):
    sheet = read(text, **declared)
    assert [[None if mm != mm else mm for mm in row] for row in sheet.repeats_mm.tolist()] == levels_mm
    assert sheet.s_mm.tolist() == [0, 10, 20]


REFUSED = {
    "a dash or a minus": (DASHED, MM_DOWN, ['as_written = ["dash"], or ["minus"]']),
    "no unit and no direction": (LINES, {}, ["'s', 'reading': no unit", "upward or downward"]),
    "a unit of readings is not that of places": ("S14 Tiefe mm\n" + LINES, {}, ["'s': no unit"]),
    "titles with two units": (
        "Tiefe xyz 1 in mm\nTiefe abc 2 in cm\n" + LINES.replace(":", " mm:"),
        {},
        ["'reading': no unit", "upward or downward"],
    ),
    "the unit of the places in a title": (
        "Abstand xyz in mm, Tiefe abc\n" + LINES,
        {},
        ["'s', 'reading': no unit", "upward or downward"],
    ),
    "the unit of the crack's depth": (
        "Tiefe des Risses xyz in mm\n" + LINES,
        {},
        ["'s', 'reading': no unit", "upward or downward"],
    ),
    "the depth of the crack": ("S14 Tiefe 16 mm\n" + LINES, {}, ["'s', 'reading': no unit", "upward or downward"]),
    "a level above another datum": ("Höhe über Boden\n" + LINES, {"unit": "mm"}, ["upward or downward"]),
    "a comma of one reading or two": (ALONE, MM_DOWN, ["'11,12' is one reading with a decimal comma, or two"]),
    "commas that may be either": (
        "0: 11,1,11,2\n10: 11,4,11,3\n",
        MM_DOWN,
        ["'11,1,11,2': each comma may be", "'11,4,11,3': each comma may be"],
    ),
    "a line without its colon": (
        LINES.replace("10:", "10"),
        MM_DOWN,
        ["'10 11,4 11.2 11,3' has 4 readings", "line 2, column s: '' is not a number"],
    ),
    "the first line without its colon": (
        LINES.replace("0:", "0", 1),
        MM_DOWN,
        ["'0 11,1 11,1 10.8' has 4 readings", "line 1, column s: '' is not a number"],
    ),
    "the first place garbled": (
        LINES.replace("0:", "O:", 1),
        MM_DOWN,
        ["line 1, column s: '' is not a number", "'O: 11,1 11,1 10.8' is not a number"],
    ),
    "the first of single readings garbled": (
        "x: 11,1\n5: 11,4\n9: 11\n",
        MM_DOWN,
        ["line 1, column s: '' is not a number", "'x: 11,1' is not a number"],
    ),
    "a line that is broken": (LINES.replace(" 11.2", "\n11.2"), MM_DOWN, ["line 3, column s: '' is not a number"]),
    "readings below a garbled first place": (
        LISTED.replace("bei 0", "bei O"),
        {},
        [*(f"line {line}, column s: '' is not a number" for line in (5, 6, 7)), *["has 3 readings"] * 2],
    ),
    "readings below a garbled place": (
        LISTED.replace("bei 10", "bei 1O"),
        {},
        ["'11,1; 11,1; 10.8; bei 1O mm; 11,4", "has 3 readings"],
    ),
    "readings below a lost place": (LISTED.replace("bei 10 mm\n", ""), {}, ["has 6 readings"]),
    "a word among readings": (LINES.replace("n.m.", "n.l."), MM_DOWN, ["If 'n.l.' marks a missing reading, add it"]),
    "two lines in one": (
        LINES.replace("\n10", " 10") + "30: 10,2 10,3 10,1\n",
        MM_DOWN,
        ["'11,1 11,1 10.8 10: 11,4 11.2 11,3' is not a number"],
    ),
    "a letter in a number": (LINES.replace("11.2", "1l.2"), MM_DOWN, ["'11,4 1l.2 11,3' is not a number"]),
    "a blank in a number": (LINES.replace("11.2", "11 2"), MM_DOWN, ["'11,4 11 2 11,3' has 4 readings"]),
    "no place": (LINES.replace("10:", "Ende:"), MM_DOWN, ["'Ende' is not a number"]),
    "a blank in a number of a cell": (CELLS.format("11,1 11,1 10 8"), {}, ["has 4 readings, most cells have 3"]),
}


@pytest.mark.parametrize(("text", "declared", "questions"), REFUSED.values(), ids=REFUSED)
def test_what_a_note_leaves_open_is_asked(refused, text, declared, questions):
    texts = [str(fault) for fault in refused(text, **declared).faults if "scatter" not in fault.finding]
    assert [words for words in questions if not any(words in text for text in texts)] == []
    assert len(texts) == len(questions)


@pytest.mark.parametrize(
    "text", ["14:30 11,2 11,3\n14:45 11,2 11,3\n", "Zeit;T\n14:30;5,2\n14:45;6,1\n", "Beginn 14:30\n21: 3\nTiefe: 9\n"]
)
def test_times_and_texts_are_no_notes(refused, text):
    assert "a place and its readings" not in str(refused(text))


SEVERAL = {
    "12,3 12,1 12.4": ["12,3", "12,1", "12.4"],
    "12.3/12.1/12.4": ["12.3", "12.1", "12.4"],
    "12,3; n. m.; 12,4;": ["12,3", "n. m.", "12,4"],
    "12 13 12": ["12", "13", "12"],
    "12.3,12.1": ["12.3", "12.1"],
    "-1,5 +1,6": ["-1,5", "+1,6"],
}
ONE = ["12,3", "1 234", "11 110 112", "12/13", "12 1/2", "3/4/26", "12,3 - 12,4", "12,3 \u00b10,1", "12,1,12", "n.m."]
NO_READINGS = ["", "3 Fotos", "12,3 (2)", "14:30 15:45", "12,3 mm 12,4 mm"]


@pytest.mark.parametrize(("text", "parts"), [*SEVERAL.items(), *((text, []) for text in (*ONE, *NO_READINGS))])
def test_several_readings_in_a_cell_are_none_that_may_be_one(text, parts):
    assert list(several(text)) == parts
