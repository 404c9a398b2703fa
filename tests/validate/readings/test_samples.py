"""Sheets of several samples: a column names the sample of each row."""

import csv
import json

import openpyxl
import pytest

from validate.readings.read_readings import read_readings
from validate.readings.samples import parts_of
from validate.readings.sheet import SheetFaults
from validate.settings import Columns, Declared

TABLE = "sample,s_mm,level_1_mm\nP08,0,-1\np 08,5,-1.5\nP09,5,-2.5\nP09,0,-2\n"


def _written(folder, text):
    path = folder / "all.csv"
    path.write_text(text, encoding="utf-8")
    return path


BLANKS = "sample,s_mm,level_mm\nP08,0,-1\n,5,-1.5\nP09,0,-2\n,5,-2.5\n"


@pytest.mark.parametrize("columns", [None, {"range": "B1:C5", "s": "B", "levels": ["C"]}])
@pytest.mark.parametrize("is_merged", [False, True])
def test_a_name_goes_on_below_it(tmp_path, is_merged, columns):
    """A range of an answer may leave out the column of the names."""
    path = _written(tmp_path, BLANKS)
    if is_merged:
        book = openpyxl.Workbook()
        for row in csv.reader(BLANKS.splitlines()):
            book.worksheets[0].append(
                [float(text) if text[-1:].isdecimal() and text[:1] != "P" else text for text in row]
            )
        for cells in ("A2:A3", "A4:A5"):
            book.worksheets[0].merge_cells(cells)
        path = tmp_path / "all.xlsx"
        book.save(path)
    given = Columns.model_validate_json(json.dumps(columns)) if columns else None
    first, second = (read_readings(path, Declared(sample=sample, columns=given)) for sample in ("P08", "P09"))
    assert (first.level_mm.tolist(), second.level_mm.tolist()) == ([-1.0, -1.5], [-2.0, -2.5])
    assert [str(part) for part in parts_of(path)] == ["rows of P08", "rows of P09"]


@pytest.mark.parametrize(
    ("text", "sample", "words"),
    [
        (
            TABLE,
            None,
            "rows of several samples: 'P08', 'P09'. Write the one to read",
        ),
        (TABLE, "P10", "no row of sample 'P10'; column 'sample' contains 'P08', 'P09'"),
        (TABLE + ",10,-3\n", "P09", "line 6, column sample"),
        (BLANKS.replace("P09,0", "P09,7").replace(",5,-2.5", ",9,-2.5"), "P09", "column range of its row"),
        ("sample,s_mm,level_mm\nP08,0,-1\nP09,0,-2\nP08,5,-1\n,5,-2\n", "P09", "column range of its row"),
        ("s_mm,level_1_mm\n0,-1\n5,-1\n", "P08", "no column contains sample names, but [readings] sample = 'P08'"),
        (TABLE.replace("-2.5", "deep"), "P09", "'deep' is not a number"),
    ],
)
def test_which_of_several_samples_is_meant_must_be_said(tmp_path, text, sample, words):
    with pytest.raises(SheetFaults) as caught:
        read_readings(_written(tmp_path, text), Declared(sample=sample))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sample"),
    [(TABLE.replace("-2.5", "deep"), "P08"), (TABLE[: TABLE.index("P09")], None)],
    ids=["another sample's faults are not this one's", "a column that names one sample"],
)
def test_a_sample_alone_is_read(tmp_path, text, sample):
    assert len(read_readings(_written(tmp_path, text), Declared(sample=sample)).s_mm) == 2


def test_a_workbook_is_divided_by_its_sheets_and_their_columns(tmp_path):
    book = openpyxl.Workbook()
    sheets = {
        "P10": [("s_mm", "depth_mm"), (0, 1), (5, 2)],
        "May": [("Probe", "s_mm", "level_mm"), ("P08", 0, -1), ("p 08", 5, -1), ("P09", 0, -2)],
        "cover": [("Labor 3",)],
    }
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(tmp_path / "all.xlsx")
    parts = [(part.sheet, part.rows_of, part.headed) for part in parts_of(tmp_path / "all.xlsx")]
    assert parts == [("P10", None, True), ("May", "P08", True), ("May", "P09", True), ("cover", None, False)]


def test_a_part_changes_with_its_own_rows_only(tmp_path):
    """One more sample in a lab's sheet makes no revision of the others, and equal readings have equal hashes."""

    def hashes(text: str) -> list[str]:
        return [part.sha256 for part in parts_of(_written(tmp_path, text))]

    before = hashes(TABLE)
    assert hashes(TABLE + "P10,0,-3\n")[:2] == before
    assert hashes(TABLE.replace("-2.5", "-2.6"))[0] == before[0]
    assert hashes(TABLE.replace("-2.5", "-2.6"))[1] != before[1]
    same = hashes("sample,s_mm,level_mm\nA,0,-1\nB,0,-1\n")
    assert same[0] == same[1]


def test_what_cannot_be_read_has_no_parts(tmp_path):
    """Reading it as the sheet of a sample reports the fault."""
    assert parts_of(_written(tmp_path, "")) == ()
    assert parts_of(tmp_path / "gone.csv") == ()
