"""Cells besides header, positions and readings: harmless, or quoted as remarks, with which the sheet is read."""

from typing import Any

import numpy as np
import openpyxl
import pytest
from openpyxl.comments import Comment
from openpyxl.styles import Font, PatternFill

from tests.validate.readings.conftest import answered
from validate.readings.grid import SheetFaults
from validate.readings.read_readings import read_readings
from validate.settings import Columns, Declared

H = "s [mm];Tiefe [mm]"
ROWS = "0;1\n5;2\n10;3\n"
OF = "{0};0;1\n{0};5;2\n{0};10;3\n"
NOTED = H + ";{}\n0;1;{}\n5;2;{}\n10;3;{}\n"

HARMLESS = {
    "the sample": f"lab\n{H}\n{ROWS}",
    "date and operator": f"Datum;3.5.2026\nPrüfer;Meier\n{H}\n{ROWS}Geprüft: Kunz, 4.5.2026\n",
    "the sample in a column": f"Probe;{H}\n{OF.format('lab')}",
    "operators and pictures": H + ";Prüfer;Foto\n0;1;Meier;IMG_1\n5;2;Kunz;IMG_2\n10;3;;\n",
    "other quantities": H + ";Temp. [°C];Breite [mm]\n0;1;20;9\n5;2;20;8\n10;3;21;9\n",
    "a unit in each row": NOTED.format("Einheit", *["mm"] * 3),
    "empty remarks": NOTED.format("Bemerkung", "", "-", "keine"),
    "a row of means": f"{H}\n{ROWS}Mittel;2\n",
}
ASKED = {
    "above": (f"Fuß auf 5 mm Klotz\n{H}\n{ROWS}", ["A1"]),
    "a preposition that is spelt as a unit": (f"Nullpunkt war um 0,4 verschoben\n{H}\n{ROWS}", ["A1"]),
    "between": (f"{H}\n0;1\nab hier verrutscht\n5;2\n10;3\n", ["A3"]),
    "below": (f"{H}\n{ROWS}\nvom rechten Ende gemessen\n", ["A6"]),
    "another sample's rows": (f"Probe;{H}\n{OF.format('P02')}", ["A2", "A3", "A4"]),
    "beside, in a column of remarks": (NOTED.format("Bemerkung", "", "Ausreißer", ""), ["C3"]),
    "a number in a column of remarks": (NOTED.format("Bemerkung", "", "2,7", ""), ["C3"]),
    "codes beside some": (NOTED.format("Punkt", "x2", "", "x5"), ["C1", "C2", "C4"]),
    "a word for a repeat": ("s_mm;Wdh;depth_mm\n0;xa;1\n0;verworfen;9\n5;xa;2\n", ["B2", "B3", "B4"]),
    "a number that counts no repeat": ("s_mm;Messung;depth_mm\n0;1,5;1\n5;2,5;2\n10;3;3\n", ["B2", "B3"]),
}


@pytest.mark.parametrize("text", HARMLESS.values(), ids=HARMLESS)
def test_a_text_that_changes_no_reading_gives_no_question(read, text):
    profile = read(text)
    assert not profile.questions
    assert len(profile.s_mm) == 3


@pytest.mark.parametrize(("text", "entries"), ASKED.values(), ids=ASKED)
def test_a_text_that_may_change_readings_is_a_remark_and_the_sheet_is_read(read, text, entries):
    """Equal texts are one remark. An entry of as_written removes a cell, its row or its column from the remarks."""
    doubts = read(text).questions
    assert {doubt.kind for doubt in doubts} == {"remark"}
    assert all(doubt.is_remark for doubt in doubts)
    assert sorted(cell for doubt in doubts for cell in doubt.cells) == entries
    assert read(text, as_written=tuple(entries)).questions == ()
    assert read(text, as_written=tuple({entry.strip("0123456789") for entry in entries})).questions == ()
    assert [left.cells for left in read(text, as_written=("Z9", *entries[1:])).questions] == [(entries[0],)]
    if entries[0][1:]:
        assert read(text, as_written=tuple(entry[1:] for entry in entries)).questions == ()


OTHER_UNITS = {
    "in a row": (f"{H}\n0;1\nab hier in Zoll\n5;2\n10;3\n", ("A3",)),
    "in each row": (NOTED.format("Einheit", "mm", "cm", "mm"), ("C3",)),
    "above": (f"Einheit: Zoll\n{H}\n{ROWS}", ("A1",)),
}


@pytest.mark.parametrize(("text", "cells"), OTHER_UNITS.values(), ids=OTHER_UNITS)
def test_another_unit_beside_the_readings_is_asked_about(read, text, cells):
    with pytest.raises(SheetFaults) as faults:
        read(text)
    assert [doubt.cells for doubt in faults.value.doubts if doubt.kind == "unit"] == [cells]
    assert len(read(text, as_written=cells).s_mm) == 3


def _colour(sheet: Any, *cells: str) -> None:
    for cell in cells:
        sheet[cell].fill = PatternFill("solid", fgColor="FFFF0000")


WORKBOOKS = {
    "nothing": (lambda sheet: None, {}, {}),
    "another worksheet": (lambda sheet: sheet.parent.create_sheet().append(["in cm"]), {}, {"remark": []}),
    "a comment": (lambda sheet: setattr(sheet["B3"], "comment", Comment("slipped", "M")), {}, {"remark": ["B3"]}),
    "struck through": (lambda sheet: setattr(sheet["B3"], "font", Font(strike=True)), {}, {"marked": ["B3"]}),
    "a name struck through": (lambda sheet: setattr(sheet["B1"], "font", Font(strike=True)), {}, {"marked": ["B"]}),
    "a white number": (lambda sheet: setattr(sheet["B3"], "font", Font(color="FFFFFFFF")), {}, {"marked": ["B3"]}),
    "a format that hides": (lambda sheet: setattr(sheet["B3"], "number_format", ";;;"), {}, {"marked": ["B3"]}),
    "a number on another worksheet": (
        lambda sheet: sheet.parent.create_sheet().append([5]),
        {},
        {"remark": []},
    ),
    "the name of the back": (lambda sheet: setattr(sheet, "title", "Unterseite"), {}, {"remark": []}),
    "a hidden row": (lambda sheet: setattr(sheet.row_dimensions[4], "hidden", True), {}, {"marked": ["A4", "B4"]}),
    "a hidden column": (lambda sheet: setattr(sheet.column_dimensions["B"], "hidden", True), {}, {"marked": ["B"]}),
    "a red cell": (lambda sheet: _colour(sheet, "B3"), {}, {"marked": ["B3"]}),
    "a red header": (lambda sheet: _colour(sheet, "A1", "B1"), {}, {}),
    "a red row that is skipped": (lambda sheet: _colour(sheet, "B3"), {"columns": Columns(skip=(3,))}, {}),
    "another sample's worksheet": (
        *(lambda sheet: setattr(sheet, "title", "P02"), {"sample": "P01", "name": "P01.xlsx"}),
        {"remark": []},
    ),
    "the name of the worksheet": (lambda sheet: setattr(sheet, "title", "in inch"), {}, {"remark": []}),
    "the name of the file": (lambda sheet: None, {"name": "lab inch.xlsx"}, {"remark": []}),
}


@pytest.mark.parametrize(("change", "declared", "entries"), WORKBOOKS.values(), ids=WORKBOOKS)
def test_marks_comments_and_names_in_a_workbook_are_remarks(tmp_path, change, declared, entries):
    book, declared = openpyxl.Workbook(), {**declared}
    sheet, path = book.worksheets[0], tmp_path / declared.pop("name", "lab.xlsx")
    for row in (H.split(";"), *([s, 1 + (s % 3) / 10] for s in range(0, 60, 10))):
        sheet.append(row)
    change(sheet)
    book.save(path)
    doubts = read_readings(path, Declared(**declared)).questions
    assert {doubt.kind: [*doubt.cells] for doubt in doubts} == entries
    confirmed = tuple(entry for cells in entries.values() for entry in cells) or None
    if all(entries.values()):
        assert not read_readings(path, Declared(**declared, as_written=confirmed)).questions


def test_colours_on_more_than_a_fifth_of_the_rows_are_the_sheets_design(tmp_path):
    book, path = openpyxl.Workbook(), tmp_path / "lab.xlsx"
    for row in (H.split(";"), *([s, 1 + (s % 3) / 10] for s in range(0, 60, 10))):
        book.worksheets[0].append(row)
    _colour(book.worksheets[0], "B2", "B4")
    book.save(path)
    assert not read_readings(path, Declared()).questions


@pytest.mark.parametrize(("cells", "stations"), [("B4:B5", 5), ("B4:C4", 6)])
def test_a_reading_that_is_merged_with_other_cells_is_asked_about(tmp_path, cells, stations):
    """The station of the lower cell, or the second repeat, vanished without a word."""
    book, path = openpyxl.Workbook(), tmp_path / "lab.xlsx"
    for row in (H.split(";"), *([s, 1 + (s % 3) / 10] for s in range(0, 60, 10))):
        book.worksheets[0].append(row)
    book.worksheets[0].merge_cells(cells)
    book.save(path)
    with pytest.raises(SheetFaults) as faults:
        read_readings(path, Declared())
    assert [(doubt.kind, doubt.cells) for doubt in faults.value.doubts] == [("merged", ("B4",))]
    assert len(read_readings(path, Declared(as_written=("B4",))).s_mm) == stations


S = np.arange(0, 60, 4)
LEVEL = np.round(3.1 + np.sin(S / 9) + S / 300, 2)


def _rows(form: str = "{s};{a};{b}", changed: dict[int, str] | None = None, s_mm: Any = S) -> str:
    """Return rows of a sound profile, with some rows exchanged."""
    values = zip(s_mm, LEVEL, LEVEL + np.round(np.cos(S * 7) / 10, 2), strict=False)
    lines = [form.format(s=s, a=f"{a:.2f}", b=f"{b:.2f}") for s, a, b in values]
    return "\n".join((changed or {}).get(row, line) for row, line in enumerate(lines)) + "\n"


PAIR = "s [mm];Tiefe 1 [mm];Tiefe 2 [mm]"
NO_WAY = "s [mm];Messung 1 [mm];Messung 2 [mm]\n"
OPEN = {"columns", "unit", "quantity"}
SHEETS = {
    "unknown names, a word": (
        "Fuß auf 5 mm Klotz\nwo;a;b\n" + _rows(changed={3: "12;feucht;3.1", 5: "20;nass;2.9"}),
        OPEN | {"cell", "remark"},
    ),
    "no direction, far station, zero": (
        NO_WAY + _rows(changed={7: "28;0;0", 14: "560;3.9;3.8"}),
        {"quantity", "outside", "outlier"},
    ),
    "direction and short span": (NO_WAY + _rows(s_mm=np.round(S / 10, 1)), {"quantity", "span"}),
    "two tables below each other": (
        f"P1\n{PAIR}\n" + _rows(changed={4: "16;x;3.1"}) + f"\nP2, vom rechten Ende\n{PAIR}\n" + _rows(),
        {"range", "cell", "remark"},
    ),
    "several samples": (
        f"Probe;{PAIR};Bemerkung\n"
        + _rows("P0;{s};{a};{b};")
        + _rows("lab;{s};{a};{b};", {5: "lab;20;3.8;3.7;verrutscht"})
        + _rows("P2;{s};{b};{a};"),
        {"range", "remark"},
    ),
    "rows that occur twice, in an unknown order": (
        "s [mm];Tiefe\n" + _rows("{s};{a}") + _rows("{s};{b}", {14: "0;3.2"}),
        {"unit", "twice"},
    ),
    "thousands": ("s [mm];Tiefe\n" + _rows("{s};{a}").replace(".", ",").replace("\n", "1\n"), {"decimal", "unit"}),
    "a number in the name, a total": ("s [mm];Tiefe 5 mm\n" + _rows("{s};{a}") + ";51.2\n", {"columns", "place"}),
    "signs in the name": ("s [mm];Tiefe (+5 mm)\n" + _rows("{s};{a}"), {"columns", "name", "quantity"}),
}


RANGES = {"P2": {"columns.range": "A2:C17"}, "(+5 mm)": {"columns.levels": ["B"]}}


@pytest.mark.parametrize(("text", "kinds"), SHEETS.values(), ids=SHEETS)
def test_answers_to_all_questions_raise_no_further_questions(doubts_of, text, kinds):
    ranges = next((answers for kind, answers in RANGES.items() if kind in text), {}) | {"columns.skip": [16]}
    doubts = doubts_of(text, 20.0, 60.0)
    assert {doubt.kind for doubt in doubts} == kinds
    assert all(doubt.answers for doubt in doubts if doubt.kind != "remark")
    left = doubts_of(text, 20.0, 60.0, **answered(doubts, own=ranges))
    assert {doubt.kind for doubt in left} <= {"remark"}


FROM_OUTSIDE = {
    "a word in front of a position": ("remark;s_mm;level_mm\n;0;-3\nmax;10;-2\n;20;-2.5\n", {"remark": ["A3"]}),
    "a digit lost in a position": ("s_mm;level_mm\n10;-6\n20;-5\n30;-4\n4;-3\n50;-2\n", {"order": ["A4", "A5"]}),
    "two tables in one": ("s_mm;level_mm\n10;-6\n20;-5\n30;-4\n\n15;-1\n25;-2\n", {"order": ["A4", "A6"]}),
    "a number of a repeat twice": ("s_mm;level 1 mm;level 1 mm;level 2 mm\n0;-3;-3;-3\n5;-2;-2;-2\n", {"columns": []}),
}
"""Sheets of somebody who had not read the reader, and which were read without a word."""


@pytest.mark.parametrize("name", FROM_OUTSIDE)
def test_sheets_that_were_once_read_wrongly_give_a_question(name, write):
    text, questions = FROM_OUTSIDE[name]
    try:
        doubts = read_readings(write(text), Declared(), 80.0, None).questions
    except SheetFaults as faults:
        doubts = faults.doubts
    cells = {doubt.kind: [*doubt.cells] for doubt in doubts}
    assert questions.items() <= cells.items()


def test_a_column_of_operators_does_not_hide_rows(read):
    profile = read("operator;s_mm;level_mm\nKM;0;-3\nSD;5;-2\nKM;10;-2.5\n", as_written=("A",))
    assert profile.s_mm.tolist() == [0, 5, 10]
