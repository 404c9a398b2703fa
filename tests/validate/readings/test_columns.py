"""Columns that are declared, headers of several rows, and rows that are no readings: read, or asked about."""

import re

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sealtwin.core.errors import InputError
from validate.readings.read_readings import read_readings
from validate.readings.sheet import SheetFaults
from validate.settings import Columns, Declared

WIDE = "Ort;x1;x2;x3\n0;1,5;1,6;9\n5;2;2,1;9\n"
ONE = [[-1.0], [-2.0]]
TWO = [[-1.5, -1.6], [-2.0, -2.1]]
MM_DOWN = {"unit": "mm", "quantity": "depth"}
BY_LETTER = {"s": "A", "levels": ["B"]}
LETTERED = "Stelle;A;b\n0;1;2\n5;3;4\n"
TURNED = {
    "names": "Probe 2;;;\nPosition mm;0;5;9\nTiefe 1;1,5;2,0;2,5\nTiefe 2;1,6;2,1;2,6\n",
    "names of samples": "s [mm];1;11\nTiefe P01 [mm];1;1,5\nTiefe P02 [mm];2,1;2,5",
    "labels": "Height over face;;;;\nSample;Run;Distance / mm;;\n\n;;0;5;9\nA1;1;-1;-2;-3\n;2;-1.1;-2.1;-3.1\n",
    "an export": "Obs,Date,Operator,Pos 0mm,Pos 5mm,Pos 9mm\nNominal,,,0.0,0.0,0.0\n1,5/18,TK,-0.05,-0.1,-0.12\n",
}
"""A column for each place, which once was read."""
PASSED = "s_mm;depth_1_mm;depth_2_mm\n# abends gemessen\n0;1;n. m.\n5;2;2\nMittelwert;1,5;2\nStabw.;0,5;0\nMüller;;\n"
SPANNED = "Abstand [mm];Tiefe unter Oberkante [mm];;\n;1. Messung;2. Messung;Mittelwert\n0;1;2;1,5\n5;3;4;3,5\n"
BESIDE = "s_mm,depth_mm,,s_mm,depth_mm\n0,1,,0,5\n5,2,,5,6\n"
TITLED = "Probe S11;;Prüfer A. Meier\nDatum;12.3.2026;Mittel\n{}0;1,5;1,6;1,5\n5;2;2,1;2\n"
THREE_ROWS = TITLED.format("Abstand;Tiefe ab OK;;Mittel\n{};;[mm]\n;1;2;\n")
UNKNOWN_ROWS = TITLED.format("x;Füllung;;\nmm;mm;;\n;1;2;3\n")
LOGGED = "Operator\tLab\nTime\t14:02:11.5\nT_Value\tDepth_0 [mm]\tDepth_1 [mm]\n0\t1.5\t1.6\n5\t2\t2.1\n"
SCANNED = (
    '"VR","4.3"\n"XY scale","7.393","µm"\n"Unit","X","mm"\n"No.","P [mm]","Z 1 [{0}]","Z 2 [{0}]"\n'
    "1,0,-1500,-1600\n2,5,-2000,-2100\n"
)
COUNTED = "Along,Level rel. to face,,avg\nmm,mm,,mm\n,#1,#2,\n0,-1.5,-1.6,-1.55\n5,-2,-2.1,-2.05\n"
RUNS = "Kanal;{};Position [mm];Messwert [mm]\nCH1;1;0;-1,5\nCH1;1;5;-2\nCH1;2;5;-2,1\nCH1;2;0;-1,6\n"
PIVOT = ",level_mm,level_mm\n{},1,2\ns_mm,,\n0,-1.5,-1.6\n5,-2,-2.1\n"
COUNTS = "Station (mm),Height above surface (mm),,Mean\n,{},{},\n0,-1.5,-1.6,-1.55\n5,-2,-2.1,-2.05\n"
NAMED_ABOVE = "Ort;{};;Mittel\nlängs;1a misura;2a misura;\n[mm];[mm];[mm];[mm]\n0;1,5;1,6;1,55\n5;2;2,1;2,05\n"
EXPORT = "Nr.;Merkmal;Messwert;Einheit\n1;{0} {1};-1,5;mm\n2;{0} {1};-1,6;mm\n3;{0} {2};-2;mm\n4;{0} {2};-2,1;mm\n"
CALLED = "{};Level [mm]\n{}0{};-1\n{}5{};-2\n"
DATES = ["Datum: 3.5.2026;;\n", "Datum;3.5.2026;\n", "03.05.2026;;\n", ";;\n3. 5. 2026\n"]

READ = {
    # It was once taken for inches.
    "a status of In": (
        *("s_mm;Value 1;Value 2;Status\n0;1,5;1,6;In\n5;2;2,1;In\n", None, MM_DOWN),
        TWO,
    ),
    "a range of columns": (WIDE, {"s": "ort", "levels": ["B:C"]}, MM_DOWN, TWO),
    "a name and a letter": (WIDE, {"levels": ["X1", "C"]}, MM_DOWN, TWO),
    "a declared column's word states its direction": (
        *("x;Tiefe Mai;Tiefe Juni\n0;1;2\n5;3;4\n", {"s": "A", "levels": ["B", "C"]}, {"unit": "mm"}),
        [[-1, -2], [-3, -4]],
    ),
    "a title with unit and direction": (
        *("Q10 - hauteur par rapport à la face, mm;;\nPoint (mm);Lecture 1;Lecture 2\n0;-1,5;-1,6\n5;-2;-2,1\n",),
        *(None, {}, TWO),
    ),
    "no header": ("0;1,5\n5;2\n", BY_LETTER, MM_DOWN, [[-1.5], [-2]]),
    "skip a first cell": ("s_mm,depth_mm\n0,1\n5,2\n4,7\n9,3\n", {"skip": ["cell 4", "row 5"]}, {}, ONE),
    "skip by word": ("s_mm,depth_mm\n0,1\n5,2\nSoll,7\n", {"skip": ["Soll"]}, {}, ONE),
    "a range of cells": ("s_mm,depth_mm\n0,1\n5,2\n9,7\n", {"range": "A1:B3"}, {"as_written": ("range",)}, ONE),
    "one of two tables": (BESIDE, {"range": "A:B"}, {}, ONE),
    "two header rows": ("u,v\na,b\n0,1\n5,2\n", {"header_rows": 2, "unit": "mm", "sign": "down", **BY_LETTER}, {}, ONE),
    "a second header row of one reading": ("Riss 4;\ns [mm];Tiefe [mm]\n;Messung 1\n0;1\n5;2\n", None, {}, ONE),
    "a word before distances": (EXPORT.format("Stelle", 0, 5), {"places": "mm"}, {"quantity": "level"}, TWO),
    "a word before numbers of places": (
        *(EXPORT.format("Stelle", 1, 2), {"places": [0, 5], "s": "B", "levels": ["C"]}, {"quantity": "level"}),
        TWO,
    ),
    **{
        f"words around {words}": (CALLED.format("Element", *words * 2), {"s": "A"} | given, {"quantity": "level"}, ONE)
        for words, given in (
            (("Surface point ", " mm"), {}),
            (("PNT(", ")"), {"places": "mm"}),
            (("Point_", ""), {"places": [0, 5]}),
        )
    },
    "a unit of a dial": (
        *("Ort;a\n0;-100\n0,5;-200\n", {"s": "A", "levels": ["B"], "places": "cm", "unit": "mm/100", "sign": "up"}),
        *({}, ONE),
    ),
    "places of numbers, each": ("Ort;Tiefe [mm]\n1;1\n2;2\n3;3\n", {"places": [0, 5, 9]}, {}, [[-1], [-2], [-3]]),
    **{
        f"a word with a unit: {cells}": (CALLED.format(name, *cells * 2), None, {}, ONE)
        for name, cells in [
            ("Position [mm]", ("Pos. ", "")),
            ("Station [mm]", ("Station", "")),
        ]
    },
    "rows of one place, as written": (
        *("s_mm;level_mm\n0;-1,5\n5;-2\n0;-1,6\n5;-2,1\n", None, {"as_written": ("repeats",)}),
        TWO,
    ),
    "a pivot of pandas": (PIVOT.format("rep"), None, {}, TWO),
    **{
        f"repeats called {one}": (COUNTS.format(one, two), None, {}, TWO)
        for one, two in [("1st", "2nd"), ("rep 1", "rep 2"), ("1\u00b0", "2\u00b0")]
    },
    "a height of the sealant over the face": (
        *(
            NAMED_ABOVE.format("Quota del sigillante rispetto alla faccia").replace(";1,", ";-1,").replace(";2", ";-2"),
            None,
        ),
        *({}, TWO),
    ),
    "rows of no readings": (PASSED, None, {}, [[-1, None], [-2, -2]]),
    "units of other quantities": ("s;Tiefe;Temp.\nmm;mm;[°C]\n0;1;20\n5;2;21\n", None, {}, ONE),
    "numbers of repeats beside a unit": ("Ort;Tiefe [mm];\n[mm];1;2\n0;1,5;1,6\n5;2;2,1\n", None, {}, TWO),
    "another quantity beside a blank column": ("s_mm;depth_mm;;min;Temp.\n0;1;;0;20\n5;2;;10;21\n", None, {}, ONE),
    "units behind all numbers": ("Position;depth\n0 mm;1,5 cm\n5 mm;2 cm\n", None, {}, [[-15], [-20]]),
    "units above the numbers of repeats": (THREE_ROWS.format("[mm];[mm]"), None, {}, TWO),
    "units in between, one for each column": (
        *("Ort;Tiefe;;T\nmm;cm;mm;°C\n;Messung 1;Messung 2;\n0;1,5;1,6;9\n5;2;2,1;9\n", {"range": "A:C"}, {}),
        [[-15, -1.6], [-20, -2.1]],
    ),
    "an unknown name above units and numbers": (UNKNOWN_ROWS, {"s": "A", "levels": ["B:C"]}, MM_DOWN, TWO),
    "the rows of the header": (
        UNKNOWN_ROWS,
        {"header_rows": "3:5", "s": "x", "levels": ["Füllung 1", "C"]},
        MM_DOWN,
        TWO,
    ),
    "given columns begin below particulars": (
        *(SCANNED.format("µm"), {"s": "B", "levels": ["C:D"], "sign": "up"}, {}),
        TWO,
    ),
    "given columns keep units, direction and repeats": (COUNTED, {"s": "A", "levels": ["B:C"]}, {}, TWO),
    "micrometres": ("s;Tiefe 1;Tiefe 2\nmm;um;\u03bcm\n0;1500;1600\n5;2000;2100\n", None, {}, TWO),
    "runs by their name": (RUNS.format("Lauf"), None, {"quantity": "level"}, TWO),
    "runs that are given": (
        RUNS.format("k"),
        {"s": "C", "levels": ["D"], "repeat": "B"},
        {"quantity": "level"},
        TWO,
    ),
    **{f"a line with a date: {at!r}": (f"{at}s;Tiefe\nmm;mm\n0;1\n5;2\n", None, {}, ONE) for at in DATES},
}


@pytest.mark.parametrize(("text", "columns", "declared", "repeats_mm"), READ.values(), ids=READ)
def test_a_table_is_read_as_it_is_meant(read, text, columns, declared, repeats_mm):
    sheet = read(text, columns=columns, **declared)
    assert [[None if mm != mm else mm for mm in row] for row in sheet.repeats_mm.tolist()] == repeats_mm
    assert sheet.s_mm.tolist() == [0, 5, 9][: len(repeats_mm)]


@pytest.mark.parametrize(
    ("text", "columns", "declared", "roles"),
    [
        (SPANNED, None, {}, "A s|B depth downward, 1|C depth downward, 2|D not read"),
        (PASSED, None, {}, "2 row, not read|5 row, not read|6 row, not read|7 row, not read"),
        ("s_mm;depth_mm\n0;1\n5;2\n", {"skip": ["Soll", 9]}, {}, "Soll skip: no such row|9 skip: no such row"),
        (
            "s_mm;depth_mm\n" + "".join(f"{s};{s % 3}\n" for s in range(20, 60, 2)),
            {"skip": [f"row {row}" for row in range(4, 17)]},
            *({}, "|".join(f"{row} row, not read" for row in range(4, 17))),
        ),
        (
            "s_mm;depth_mm\n0;1\n5;2\n" + "ab;\n" * 9 + "Mittelwert;1,5\n",
            *(None, {}, "13 row, not read"),
        ),
    ],
)
def test_each_column_and_row_is_named_with_its_role(read, text, columns, declared, roles):
    parts = read(text, columns=columns, **declared).columns
    assert set(roles.split("|")) <= {f"{by} {column.role}" for column in parts for by in (column.place, column.name)}


REFUSED = {
    **{f"a column for each place: {by}": (text, None, "transpose the table in a copy") for by, text in TURNED.items()},
    "rows by numbers": (TURNED["labels"], {"s": "4", "levels": ["5:6"]}, "'4' is not a column"),
    "a direction left open": ("x;Tiefe von oben Mai;x\n0;1;2\n5;3;4\n", {"s": "A", "levels": ["B"]}, "upward or down"),
    "a row, or a first cell": ("s_mm;depth_mm\n4;1\n5;2\n9;3\n", {"skip": [4]}, '"row 4" or "cell 4"'),
    "a first cell, or no row": ("s_mm;depth_mm\n4;1\n5;2\n9;3\n", {"skip": [9]}, '"row 9" or "cell 9"'),
    "a range that ends early": ("s_mm;depth_mm\n0;1\n5;2\n9;3\n", {"range": "1:3"}, 'as_written = ["range"]'),
    "a range that begins late": (
        *("0;1,5\n5;2\n9;3\n", {**BY_LETTER, "range": "2:3", "sign": "down"}),
        "1 place with readings, in row 1",
    ),
    "a letter that is a name": (LETTERED, {"s": "A", "levels": ["B", "C"]}, "is a letter and also a name"),
    "a row taken out": ("s_mm;depth_1_mm;depth_2_mm\n0;1;1\n5;2;2\n#9;7;7\n", None, "'#9' is not a number"),
    "a unit above the numbers of repeats": (
        *(THREE_ROWS.format("[mm];mil"), None),
        "'mil', below 'Tiefe ab OK 1', is not a supported",
    ),
    "a thickness of the sealant is no level": (NAMED_ABOVE.format("Höhe der Füllung"), None, "upward or downward"),
    "rows that words tell apart": (
        *("s_mm;Art;level_mm\n0;innen;-1\n0;außen;-2\n5;innen;-1\n5;außen;-2\n", None),
        'as_written = ["repeats"]',
    ),
    "a word before what may be numbers": (CALLED.format("Ort", *("Pos. ", "") * 2), None, "column places"),
    "a word before numbers, with a unit of readings": (
        *(CALLED.format("Ort", *("Pos. ", "") * 2), {"sign": "up"}),
        "'Pos 0' to 'Pos 5'",
    ),
    "places that are too few": (
        *("Ort;Tiefe [mm]\n1;1\n2;2\n3;3\n4;3\n", {"places": [0, 5, 9]}),
        "places has 3 numbers",
    ),
    "two words": (CALLED.format("Ort [mm]", "Pos. ", "", "Stelle ", ""), None, "'Pos. 0' is not a number"),
    "a row of names is not left above": (NAMED_ABOVE.format("Füllstand xy"), None, "line 1: '1a misura', '2a misura'"),
    "titles are no names": (UNKNOWN_ROWS, None, "A 'x' (0), B 'Füllung 1' (1,5), C 'Füllung 2' (1,6), D 'Füllung 3'"),
    "rows of decimals are no names": (
        "Units;mm\nPiece;Nom X;Nom Y;Dev Z;Test\n1;0.0;0.01;-1.5;Fail\n1;5.0;0.02;-2.0;Pass\n2;0.0;0.0;-1.6;Pass\n",
        None,
        "A 'Piece' (1), B 'Nom X' (0.0)",
    ),
    "particulars of a logger are no names": (LOGGED, None, "A 'T_Value' (0)"),
    "a unit that no answer settles": (
        "s;Z [nm]\n0;1\n5;2\n",
        {"s": "A", "levels": ["B"], "sign": "up"},
        "unit 'nm' is",
    ),
    "runs without a name": (RUNS.format("k"), {"s": "C", "levels": ["D"], "sign": "up"}, 'repeat = "B"'),
    "as many rows for each place, beside a counter": (
        *("s_mm;depth_mm;X\n0;1;1\n0;1,1;2\n5;2;1\n5;2,1;2\n", {"s": "A", "levels": ["B"]}),
        'repeat = "C"',
    ),
    "a counter that has readings": ("s_mm;depth_mm;Messung\n0;1;1,5\n5;2;2,5\n", None, "'Messung' numbers repeats"),
    "tabs are no blanks": ("wo\ta\n0\t1\n5\t2\n", None, "A 'wo' (0), B 'a' (1)"),
    "rows that are no header": ("s_mm;depth_mm\n0;1\n5;2\n", {"header_rows": "8:9"}, "no rows 8:9"),
    "a letter beyond the table": ("s_mm;depth_mm\n0;1\n5;2\n", {"s": "Q"}, "'Q' is not a column"),
    "a table beside": (BESIDE, None, 'sample\'s table, "A:B" or "D:E"'),
    "a table below": (
        "s_mm;depth_mm\n0;1\n5;2\n\nX\ns_mm;depth_mm\n0;3\n5;4\n",
        None,
        'sample\'s table, "1:5" or "6:8"',
    ),
    "the way back": ("s_mm;depth_mm\n0;1\n5;2\nzurück\n2;3\n4;4\n", None, "a second table begins in row 5"),
    "an unknown name": ("s_mm;depth_mm;z\n0;1;7\n5;2;8\n", None, "'z' has an unknown name and contains numbers"),
    "an unknown name, beside a blank": ("s_mm;depth_mm;;min;Ofen\n0;1;;0;20\n5;2;;10;21\n", None, "'Ofen' has an unkn"),
    "no name": ("s_mm;depth_mm;\n0;1;7\n5;2;8\n", None, "column C contains numbers and has no name"),
    "another unit": (
        "s;Tiefe 1;Tiefe 2\nmm;mm;mil\n0;1;9\n5;2;9\n",
        None,
        "'mil', below 'Tiefe 2', is not a supported",
    ),
    # It was once joined to names that nobody knows, and they could not be told apart.
    **{f"a date: {at!r}": (f"{at}wo;a;b\n0;1;2\n5;2;3\n", None, "A 'wo' (0), B 'a' (1), C 'b' (2)") for at in DATES},
}


@pytest.mark.parametrize(("text", "columns", "words"), REFUSED.values(), ids=REFUSED)
def test_what_may_mean_something_else_is_asked_about(refused, text, columns, words):
    assert words in str(refused(text, columns=columns, **({} if columns is None else {"unit": "mm"})))


PLACES, UNIT, WAY, MARK = "no column of places", ": no unit", "upward or downward", "is 1.234, or 1234"
MISSING = "'n. lesbar' is not a number"
AT_ONCE = {
    "a word before the number of each place": (
        *(EXPORT.format("Stelle", 0, 5), None),
        ["'Stelle 0' to 'Stelle 5'", "'Messwert': nothing states"],
    ),
    "a unit of a dial is none of places": (
        *("Ort;a\n0;-100\n0,5;-200\n", {**BY_LETTER, "unit": "1/100 mm", "sign": "up"}),
        ["'Ort': no unit of the places. Write their unit, such as cm, into the column places"],
    ),
    "places in remarks, several times": (
        *("Date;Value;Unit;Note\n" + "3.5.;1,5;mm;0 mm\n3.5.;2,5;mm;5 mm\n3.5.;1,6;mm;0 mm\n", None),
        [PLACES, WAY, "0 mm occurs twice"],
    ),
    "words around the number of each place": (
        *(CALLED.format("Element", *("PNT(", ")") * 2), None),
        [PLACES, "'PNT 0' to 'PNT 5'"],
    ),
    "unknown names": (
        *("x;a;b\n0;1,234;2,345\n5;n. lesbar;2,345\n9;1,234;2,335\n", None),
        [PLACES, f"'x', 'a', 'b'{UNIT}", "'a', 'b': nothing states", MARK, MISSING],
    ),
    "no header": ("0;1,5;1,6\n5;2;2,1\n9;2;2,1\n", None, [PLACES, f"'A', 'B', 'C'{UNIT}", WAY]),
    "unknown places": (
        "y [mm];Tiefe 1;Tiefe 2\n0;1,5;1,6\n5;n. lesbar;2,1\n",
        None,
        [PLACES, f"'Tiefe 1', 'Tiefe 2'{UNIT}", MISSING],
    ),
    "unknown readings": ("s [mm];a [mm];b\n0;1,5;1,6\n5;2;2,1\n", None, ["no column of readings", WAY]),
    "readings of which some may be no readings": (
        "s [mm];Tiefe x [mm];T\n0;1,5;20\n5;2;21\n",
        None,
        ["no column of readings"],
    ),
    "numbers of rows or places": ("i;k;Tiefe [mm]\n1;0;1,5\n2;5;2,5\n3;9;2\n", None, [PLACES]),
    "a declared column that is none": (
        "x;Tiefe [mm]\n0;1,5\n5;n. lesbar\n",
        {"s": "Q"},
        ["'Q' is not a column", f"'x'{UNIT}", MISSING],
    ),
    "an unknown unit": (
        SCANNED.format("xy"),
        {"s": "B", "levels": ["C:D"]},
        ["unit 'xy' is unknown; give it in mm", WAY],
    ),
    "doubts beside faults": (
        *(
            "s [mm];Tiefe 1 [mm];Tiefe 2 [mm]\n2;3;3,1\n4;0;3,2\n6;n. lesbar;3,3\n8;3,1;3,4\n# Nullpunkt: Fuß\n",
            None,
        ),
        [MISSING, "mentions a zero point", "0 mm at s = 4 mm"],
    ),
    "a sign beside faults": (
        *("s [mm];Höhe 1 [mm];Höhe 2 [mm]\n0;3;3,1\n2;3,2;3,1\n4;n. lesbar;3,2\n6;3,1;3,4\n", None),
        [MISSING, '["sign"]', '["datum"]'],
    ),
    "no sign of an unknown direction": ("s [mm];x1 [mm]\n0;3\n2;3,2\n4;3,2\n6;3,1\n", {"levels": ["B"]}, [WAY]),
}


@pytest.mark.parametrize(("text", "columns", "questions"), AT_ONCE.values(), ids=AT_ONCE)
def test_all_questions_of_a_sheet_come_at_once(refused, text, columns, questions):
    """Nothing is asked that only follows from a stand-in for another answer."""
    texts = list(map(str, refused(text, columns=columns).faults))
    assert [words for words in questions if not any(words in text for text in texts)] == []
    assert len(texts) == len(questions)


ROWS = ((0, 15.0, 12.1, 0.2), (5, 12.1, 9.2, 0.1), (9, 4.4, 4.1, 0.3), (15, 4.5, 4.2, 0.2), (20, -0.9, -0.8, 0.1))
MEASURED = "Abst;x1;x2;x3;{}\n" + "".join(f"{s};{a};{a + 0.1:.2f};{b};{c}\n" for s, a, b, c in ROWS)
LOGGED_ROWS = "Zeit;Ort;Wert\n" + "".join(f"10:{at:02d};{at % 5};{1 + at % 5}.{at}\n" for at in range(15))
WRONG = re.compile("Correct (the columns|missing)")
CHOSEN = {
    "readings": (MEASURED.format("e"), {"s": "A", "levels": ["B:C"]}, ""),
    "a name of a calculated value": (MEASURED.format("Sigma"), {"s": "A", "levels": ["B:C", "E"]}, "E"),
    "readings far from the others": (MEASURED.format("e"), {"s": "A", "levels": ["B:C", "E"]}, "E"),
    "readings as places": (MEASURED.format("e"), {"s": "B", "levels": ["D"]}, "B"),
    "places that are not read": (MEASURED.format("e").replace("4.5;", "4.3;"), {"s": "B", "levels": ["D"]}, "B"),
    "a reading as a missing one": (MEASURED.format("e"), {"s": "A", "levels": ["B:C"], "missing": ["4.4"]}, "B4"),
    "times as repeats": (LOGGED_ROWS, {"s": "B", "levels": ["C"], "repeat": "A"}, "A"),
}


@pytest.mark.parametrize(("text", "columns", "answer"), CHOSEN.values(), ids=CHOSEN)
def test_a_chosen_column_that_may_be_another_is_asked_about(read, text, columns, answer):
    asked = [doubt for doubt in read(text, columns=columns, **MM_DOWN).doubts if WRONG.search(doubt)]
    assert [doubt.rpartition(" = ")[2] for doubt in asked] == ([f'["{answer}"].'] if answer else [])
    doubts = read(text, columns=columns, as_written=(answer or "A",), **MM_DOWN).doubts
    assert not any(map(WRONG.search, doubts))


def test_what_columns_gives_is_not_given_twice():
    with pytest.raises(InputError, match="columns gives"):
        Declared(unit="mm", columns=Columns(unit="cm"))


@pytest.mark.parametrize(
    ("zero", "asked"),
    [
        ("Nullpunkt: Probenoberfläche", False),
        ("Nullpunkt: Oberkante Messschieber", True),
        ("zeroed on the base", True),
        ("caliper zero checked on face", False),
        ("zero on caliper face", True),
        ("zero not checked on face", True),
        ("Z zero: plane fit on top face", False),
        ("QUINDOS 7.16   Leitz Reference HP 12.10.7", False),
        ("Height Reference OK 12.10.26", True),
    ],
)
def test_a_remark_on_another_zero_is_asked_about(read, zero, asked):
    text = f"# {zero}\ns_mm;depth_mm\n0;1\n5;2\n9;2\n"
    assert any('["datum"]' in doubt for doubt in read(text).doubts) == asked
    assert not read(text, as_written=("datum",)).doubts
    assert not read(text, datum="caliper_base", datum_level_mm=1.0).doubts


CELLS = st.sampled_from(
    ["", "s_mm", "depth_mm", "0", "5", "1,5", "n. m.", "Mittel", "# x", "Riss 2", "1 mm", "7.5", "x"]
)


@given(st.lists(st.lists(CELLS, min_size=1, max_size=5), min_size=1, max_size=9), st.sampled_from([None, *"ABC"]))
@example([["s_mm"], ["depth_mm", "depth_mm"]], "A")
@settings(max_examples=40, deadline=None)
def test_any_table_is_read_or_asked_about(tmp_path_factory, rows, letter):
    """No arrangement of cells raises anything else, and every station that is read stands in the sheet."""
    path = tmp_path_factory.mktemp("any") / "lab.csv"
    path.write_text("\n".join(";".join(row) for row in rows), encoding="utf-8")
    columns = None if letter is None else Columns(s=letter, levels=("B:C",))
    try:
        sheet = read_readings(path, Declared(columns=columns, unit="mm", quantity="depth"))
    except SheetFaults:
        return
    written = {cell.removesuffix(" mm").replace(",", ".") for row in rows for cell in row}
    assert {f"{s:g}" for s in sheet.s_mm} <= {f"{float(cell):g}" for cell in written if cell[:1].isdigit()}
