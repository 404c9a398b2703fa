"""Headers, columns, units and direction, which are read or, if they are ambiguous, asked about."""

import pytest

from tests.validate.readings.conftest import brief, listed

TWO = [[-1.5, -1.6], [-2.0, -2.1], [-3.0, -3.1]]
ONE = [[-1.5], [-2.0], [-3.0]]
ROWS = "0;1,5;1,6\n5;2;2,1\n10;3;3,1\n"
SINGLE = "0;1,5\n5;2\n10;3\n"
S = "s [mm];"
H = "s [mm];Tiefe 1 [mm];Tiefe 2 [mm]\n"
BY_LETTER = {"s": "A", "levels": ["B", "C"]}
MM_DOWN = {"unit": "mm", "quantity": "depth"}
BESIDE = "s [mm];Tiefe [mm];;s [mm];Tiefe [mm]\n0;1,5;;0;7\n5;2;;5;8\n10;3;;10;9\n"
BELOW = H + ROWS + "\nP02\n" + H + "0;7;7\n5;8;8\n"
SAMPLES = "Probe;s [mm];Tiefe [mm]\nP00;0;7\n;5;8\nlab;0;1,5\n;5;2\n;10;3\nP02;0;9\nP02;5;9\n"

READ = {
    "a header of one row": (H + ROWS, {}, TWO),
    "names and units": ("Abstand;Tiefe;Tiefe\n[mm];1 [mm];2 [mm]\n" + ROWS, {}, TWO),
    "names, numbers and units": ("Probe lab;;\nOrt;Tiefe;\n;1. Messung;2. Messung\nmm;mm;mm\n" + ROWS, {}, TWO),
    "a name above its repeats": ("Abstand [mm];Tiefe unter Oberkante [mm];\n;1;2\n" + ROWS, {}, TWO),
    "units of other quantities": ("s;Tiefe;Temp.\nmm;mm;[°C]\n0;1,5;20\n5;2;20\n10;3;21\n", {}, ONE),
    "particulars above": ("Probe;lab\nDatum;3.5.2026\nPrüfer;Meier\n\n" + H + ROWS, {}, TWO),
    "no readings": ("Nr.;s [mm];Risstiefe;Tiefe [mm];Mittel\n1;0;9;1,5;5\n2;5;9;2;5\n3;10;9;3;5\n", {}, ONE),
    "units of their own": ("s [m],depth [cm]\n0,0.15\n0.005,0.2\n0.01,0.3\n", {}, ONE),
    "inches": ("s in;depth in\n0;0.0590551181102362\n0.196850393700787;0.078740157480315\n", {}, [[-1.5], [-2.0]]),
    "units behind all numbers": ("Position;depth\n0 mm;0,15 cm\n5 mm;0,2 cm\n10 mm;0,3 cm\n", {}, ONE),
    "a declared unit, of names without one": ("Ort;Tiefe [mm]\n0;1,5\n0,5;2\n1;3\n", {"unit": "cm"}, ONE),
    "a bare Messung": ("s [mm];Messung\n" + SINGLE, MM_DOWN, ONE),
    "a datum": (H + ROWS, {"datum": "caliper_base", "datum_level_mm": 1.5}, [[0, -0.1], [-0.5, -0.6], [-1.5, -1.6]]),
    "columns by letter": ("i;a;b;c\n" + ROWS.replace("\n", ";9\n"), {"columns": BY_LETTER, **MM_DOWN}, TWO),
    "a table beside another": (BESIDE, {"columns": {"range": "A:B"}}, ONE),
    "a range without a header": (H + ROWS + "15;9;9\n", {"columns": {"range": "A2:C4"}}, TWO),
    "a table below another": (BELOW, {"columns": {"range": "A1:C4"}, "as_written": ("A6",)}, TWO),
    "one of several samples": (SAMPLES, {"columns": {"range": "A4:C6"}}, ONE),
    "a merged sample": ("Probe;s [mm];Tiefe [mm]\nlab;0;1,5\n;5;2\n;10;3\n", {}, ONE),
    "the other end": (H + ROWS, {"columns": {"s_from": "second"}}, TWO[::-1]),
    "columns parted by blanks": ("s_mm depth_mm\n  0  1.5\n  5  2.0\n 10  3.0\n", {}, ONE),
    "names behind a sign of comment": ("# s_mm depth_mm\n0 1.5\n5 2.0\n10 3.0\n", {}, ONE),
    "names of several words": ("Position [mm]   Depth below face [mm]\n0   1.5\n5   2.0\n10  3.0\n", {}, ONE),
    "signs of comment before particulars": ("// Probe lab\n% s [mm];Tiefe [mm]\n" + SINGLE, {}, ONE),
    "a legend": ("s [mm];level [mm] (0 = sample face, + up)\n0;-1,5\n5;-2\n10;-3\n", {}, ONE),
    "an index without a name": (";s [mm];Tiefe [mm]\n0;0;1,5\n1;5;2\n2;10;3\n", {}, ONE),
    "names of several words, without brackets": ("s mm   depth mm\n0   1.5\n5   2.0\n10  3.0\n", {}, ONE),
    "a unit and a direction in the title": (
        "Tiefe ab Oberfläche, alles in mm\n\nWeg;Versuch 1;Versuch 2\n" + ROWS,
        {"as_written": ("A1", "B", "C")},
        TWO,
    ),
    "a column of units": ("s;Tiefe;Einheit\n0;1,5;mm\n5;2;mm\n10;3;mm\n", {}, ONE),
    "a station number, and a position in another column": (
        "Station;Abstand [mm];Tiefe [mm]\n1;0;1,5\n2;5;2\n3;10;3\n",
        {},
        ONE,
    ),
    "a standard deviation that is called s": ("x/mm;Tiefe/mm;s/mm\n0;1,5;0,2\n5;2;0,1\n10;3;0,3\n", {}, ONE),
    "letters that count repeats": ("s_mm;depth_below_face_a_mm;depth_below_face_b_mm\n" + ROWS, {}, TWO),
    "labels below a name": ("s [mm];Tiefe ab Oberfläche [mm];\n;Hin;Zurück\n" + ROWS, {}, TWO),
    "other labels below a name": ("s [mm];Tiefe [mm];\n;L1;L2\n" + ROWS, {"as_written": ("B", "C")}, TWO),
    "ordinals": ("s [mm];prima lettura, profondità [mm];seconda lettura, profondità [mm]\n" + ROWS, {}, TWO),
    "a legend of negative numbers": (
        "unterhalb der Oberseite negativ\n\ns [mm];Lesung [mm]\n0;-1,5\n5;-2\n10;-3\n",
        {"as_written": ("A1", "B")},
        ONE,
    ),
    "a quantity and a unit in each row": (
        "s [mm];Prüfung;Messwert;Einheit\n0;Tiefe unter OK;1,5;mm\n5;Tiefe unter OK;2;mm\n10;Tiefe unter OK;3;mm\n",
        {"as_written": ("B", "C")},
        ONE,
    ),
    "stations of several rows": (
        "station;s_mm;rep;depth_mm\n1;0;a;1,5\n1;0;b;1,6\n2;5;a;2\n2;5;b;2,1\n3;10;a;3\n3;10;b;3,1\n",
        {"as_written": ("C",)},
        TWO,
    ),
    "positions under an unknown name beside stations without numbers": (
        "estacion;a_mm_del_inicio;altura_mm\nE1;0;-1,5\nE2;5;-2\nE3;10;-3\n",
        {"as_written": ("A", "B")},
        ONE,
    ),
    "a count of points below the header": ("//s_mm depth_mm\n3\n0 1.5\n5 2.0\n10 3.0\n", {}, ONE),
    "decimals that could be thousands": ("s [mm];Tiefe [mm]\n0;1,500\n5;2,000\n10;3,000\n", {}, ONE),
    "a second row that counts": ("Ort [mm];q;\n;1;2\n" + ROWS, {"columns": BY_LETTER, **MM_DOWN}, TWO),
}


@pytest.mark.parametrize(("text", "declared", "repeats_mm"), READ.values(), ids=READ)
def test_a_table_of_a_common_layout_is_read_correctly(read, text, declared, repeats_mm):
    profile = read(text, **declared)
    assert not profile.questions
    assert listed(profile) == [pytest.approx(row) for row in repeats_mm]
    s_mm = [2, 7, 12] if repeats_mm == TWO[::-1] else [0, 5, 10]
    assert profile.s_mm == pytest.approx(s_mm[: len(repeats_mm)])


LIKELY = {
    "unknown words": (S + "Tiefe unter Balken 1 [mm];Tiefe unter Balken 2 [mm]\n" + ROWS, TWO, ["B", "C"]),
    "an unknown position": ("Tratto [mm];Tiefe [mm]\n" + SINGLE, ONE, ["A"]),
    "unknown readings, with a direction in the title": (
        "Tiefe\n\ns [mm];Foo 1 [mm];Foo 2 [mm]\n" + ROWS,
        TWO,
        ["B", "C"],
    ),
}


@pytest.mark.parametrize(("text", "repeats_mm", "columns"), LIKELY.values(), ids=LIKELY)
def test_a_column_whose_role_is_clear_is_read_and_its_unknown_words_are_remarked(read, text, repeats_mm, columns):
    profile = read(text)
    assert listed(profile) == [pytest.approx(row) for row in repeats_mm]
    (doubt,) = [doubt for doubt in profile.questions if doubt.kind == "name"]
    assert (doubt.is_remark, list(doubt.cells)) == (True, columns)
    assert not [doubt for doubt in read(text, as_written=tuple(columns)).questions if doubt.kind == "name"]


MARKED = "depth (+5 mm)|depth [mm-5]|depth [mm²]|depth [nm]|Tiefe x10 [mm]|Tiefe rechts [mm]"
UNIT, B = {"unit": "mm"}, {"columns": {"levels": ["B"]}}
ASKED = {
    "no header": (ROWS, {}, "columns; unit A B C; quantity"),
    "a side in another name": ("Stelle;von links (mm);Tiefe [mm]\n" + ROWS, {}, "columns = A; unit A; name B = B"),
    "a title apart": (
        "Projekt;+5 mm\n\nOrt;a\n" + SINGLE,
        {"columns": BY_LETTER | {"levels": ["B"]}, **MM_DOWN},
        "remark A1",
    ),
    "a number and a place": ("Position;Ort [mm];Tiefe [mm]\n1;0;1,5\n2;5;2\n", {}, "columns = C"),
    "readings beside their numbers": ("s [mm];Messung;q\n0;1;9\n1;2;9\n5;1;8\n", {}, "unit C; quantity; name C"),
    "names that differ by a word": (S + "Tiefe Anna [mm];Tiefe Ben [mm]\n" + ROWS, {}, "columns = A B C"),
    "another end": ("Distance from right end [mm];level [mm]\n0;-1,5\n5;-2\n10;-3\n", {}, "name A = A; name A"),
    "a station number, and an unknown position": (
        "Station;Foo;Tiefe [mm]\n1;0;1,5\n2;5;2\n3;10;3\n",
        {},
        "columns; unit A",
    ),
    "two directions in the title": ("Tiefe, Höhe\n\ns [mm];Foo [mm]\n" + SINGLE, {}, "quantity; name B; remark A1"),
    "an unknown name": (S + "Tiefe [mm];q\n" + ROWS, {}, "columns = A"),
    "up and down": (S + "Tiefe [mm];Level [mm]\n" + ROWS, {}, "columns = A B"),
    "a number that counts nothing": (S + "Tiefe 5 mm\n" + SINGLE, {}, "columns = A B"),
    "the crack's own depth": (S + "Risstiefe [mm]\n" + SINGLE, {}, "columns = A; quantity"),
    "no such column": (H + ROWS, {"columns": {"s": "Q"}}, "columns; columns = B C"),
    "a place that is a reading": (H + ROWS, {"columns": {"s": "A", "levels": ["A:C"]}}, "columns = A B C"),
    "places side by side": (S + "0;5\nTiefe [mm];1;2\n", {}, "columns; unit B C; quantity; remark A1; remark A2"),
    "a table below": (BELOW, {}, "range; remark A6"),
    "several samples": (SAMPLES, {}, "range = 4:6"),
    "a reading behind a sign of comment": (S + "Tiefe [mm]\n0;1,5\n#5;9\n10;3\n", {}, "cell A3 = 3"),
    "a row behind a sign of comment": ("s_mm depth_mm\n0 1.5\n# 5 9.0\n10 3.0\n15 3.0\n", {}, "remark A3"),
    "several samples in turn": ("Probe;s [mm];Tiefe [mm]\nlab;0;1\nP2;0;2\nlab;5;1\nP2;5;2\n", {}, "range"),
    "two spellings": ("Probe;s [mm];Tiefe [mm]\nlab;0;1\nlab;5;1\nlab';10;2\n", {}, "range = 2:3"),
    "a dial": (S + "Tiefe [1/10 mm]\n" + SINGLE, {}, "columns = A; quantity; name B = B"),
    "a unit of another kind": (S + "Tiefe [cm]\n" + SINGLE, UNIT, "unit"),
    "units in some cells": (S + "Tiefe\n0;1,5 mm\n5;2\n10;3 mm\n", UNIT, "unit"),
    "no direction": (S + "x 1 [mm]\n" + SINGLE, B, "quantity; name B = B"),
    "another direction": (S + "Tiefe [mm]\n" + SINGLE, {"quantity": "level"}, "quantity"),
    **{
        f"no length: {name}": (f"{name};Tiefe [mm]\n" + SINGLE, {"columns": {"s": "A"}, "unit": "mm"}, "name A = A")
        for name in ("s [-]", "s/L", "s [%]", "s rel. [mm]", "Masse [g]")
    },
    **{f"a mark in {name}": (f"{S}{name}\n" + SINGLE, {**B, **MM_DOWN}, "name B = B") for name in MARKED.split("|")},
}


@pytest.mark.parametrize(("text", "declared", "questions"), ASKED.values(), ids=ASKED)
def test_an_ambiguous_table_gives_questions(doubts_of, text, declared, questions):
    assert brief(doubts_of(text, **declared)) == questions


def test_a_sheet_is_read_as_a_sentence_that_ends_with_columns_that_were_not_read(read):
    assert read(*READ["no readings"][:1]).dialect.endswith("column C 'Risstiefe', column E 'Mittel'")


def test_the_setting_columns_places_gives_the_positions_of_numbered_stations(read):
    text = "Ort;Tiefe [mm]\n1;1,5\n2;2\n3;3\n"
    assert read(text, columns={"places": [0, 10]}).s_mm.tolist() == [0, 5, 10]
    assert read(text, columns={"places": [0, 4, 10]}).s_mm.tolist() == [0, 4, 10]
