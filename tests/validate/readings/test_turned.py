"""Sheets with a column for each station: declarations count the file's own rows and columns."""

import pytest

SHEET = """\
Height over face;;;;;
Sample;Run;Distance / mm;;;

;;0;5;9;
A1;1;-1;-2;-3;
;2;-1.1;-2.1;-3.1;
;mean;-1.05;-2.05;-3.05;
A2;1;-4;-5;-6;
"""
EXPORT = """\
Obs,Date,Operator,Pos 0mm,Pos 5mm,Pos 9mm
Nominal,,,0.0,0.0,0.0
1,5/18,TK,-0.05,-0.1,-0.12
2,5/18,TK,,-0.11,-0.13
Mean,,,-0.05,-0.105,-0.125
"""
MM_UP = {"unit": "mm", "quantity": "level"}
INCH = {"unit": "inch", "quantity": "level"}
FIRST = [[-1, -1.1], [-2, -2.1], [-3, -3.1]]
BY_ROW = {"s": "4", "levels": ["5:6"]}
READ = {
    "rows, with a blank row above": (SHEET, BY_ROW, FIRST),
    "rows of a range": (SHEET, {**BY_ROW, "range": "1:7"}, FIRST),
    "cells of a range": (SHEET, {**BY_ROW, "range": "A1:E7"}, FIRST),
    "a range without the row of places": (SHEET, {**BY_ROW, "range": "B5:E6"}, FIRST),
    "skipped within a span, by word": (SHEET, {"s": "4", "levels": ["5:8"], "skip": ["A2", 7]}, FIRST),
    "a word of a missing reading": (SHEET.replace("-1.1;", "n.g.;"), {**BY_ROW, "missing": ["n.g."]}, None),
}
REFUSED = {
    "letters": ({"transposed": True, "s": "C", "levels": ["D:F"]}, '"C" is a column'),
    "letters of readings": ({"s": "4", "levels": ["D:F"]}, '"D:F" is a column'),
    "rows of a header": ({**BY_ROW, "header_rows": "1:2"}, "header_rows"),
    "a row outside of the range": ({**BY_ROW, "range": "1:5"}, 'row 6, which "5:6" includes, is outside of the range'),
    "a row that does not exist": ({"s": "4", "levels": ["5:19"]}, "row 19"),
    "a skipped row": ({"s": "4", "levels": ["7"], "skip": [7]}, "row 7"),
    "places outside of the range": ({**BY_ROW, "range": "A1:D7"}, "1 place with readings, in E, outside of the range"),
}


@pytest.mark.parametrize(("text", "columns", "repeats_mm"), READ.values(), ids=READ)
def test_a_turned_sheet_is_read_by_its_own_rows_and_columns(read, text, columns, repeats_mm):
    sheet = read(text, columns=columns, **MM_UP)
    assert sheet.s_mm.tolist() == [0, 5, 9]
    assert repeats_mm is None or sheet.repeats_mm.tolist() == repeats_mm


@pytest.mark.parametrize(("columns", "words"), REFUSED.values(), ids=REFUSED)
def test_no_part_of_a_turned_sheet_is_lost_silently(refused, columns, words):
    assert words in str(refused(SHEET, columns=columns, **MM_UP))


def test_places_outside_of_a_range_may_be_confirmed(read):
    sheet = read(SHEET, columns={**BY_ROW, "range": "A1:D7"}, as_written=("range",), **MM_UP)
    assert sheet.s_mm.tolist() == [0, 5]


def test_an_export_with_a_column_for_each_place_is_read(read, refused):
    columns = {"s": "2", "levels": ["4:5"]}
    sheet = read(f"Unit:,in\n{EXPORT}", columns=columns, **INCH)
    assert sheet.s_mm.tolist() == [0, 5, 9]
    assert sheet.repeats_mm[1].tolist() == pytest.approx([-2.54, -2.794])
    assert "'Unit: in', but the columns are in mm" in str(refused(f"Unit:,in\n{EXPORT}", columns=columns, **MM_UP))


def test_answers_name_the_cells_of_the_file(read):
    """0.00 in cell D5 once was to be confirmed as E4, the cell of the turned sheet."""
    text = SHEET.replace("A1;1;-1;-2;-3;", "A1;1;-1;0.00;-3;")
    (doubt,) = (one for one in read(text, columns=BY_ROW, **MM_UP).doubts if "0.00" in one or "D5" in one)
    assert '["D5"]' in doubt.partition("cell D5")[2]
    assert not read(text, columns=BY_ROW, as_written=("D5",), **MM_UP).doubts
