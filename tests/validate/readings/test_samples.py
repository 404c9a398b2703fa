"""Sheets of several samples or tables: the user chooses one by its name in a column, or by a range."""

import csv

import openpyxl
import pytest

from validate.readings.read_readings import read_readings
from validate.readings.samples import part_of
from validate.readings.sheet import SheetFaults
from validate.settings import Columns, Declared

TABLE = "sample,s_mm,level_1_mm\nP08,0,-1\np 08,5,-1.5\nP09,5,-2.5\nP09,0,-2\n"


def _written(folder, text):
    path = folder / "all.csv"
    path.write_text(text, encoding="utf-8")
    return path


BLANKS = "sample,s_mm,level_mm\nP08,0,-1\n,5,-1.5\nP09,0,-2\n,5,-2.5\n"


def test_a_name_goes_on_over_the_rows_that_it_is_merged_with(tmp_path):
    book = openpyxl.Workbook()
    for row in csv.reader(BLANKS.splitlines()):
        book.worksheets[0].append([float(text) if text[-1:].isdecimal() and text[:1] != "P" else text for text in row])
    for cells in ("A2:A3", "A4:A5"):
        book.worksheets[0].merge_cells(cells)
    book.save(tmp_path / "all.xlsx")
    first, second = (read_readings(tmp_path / "all.xlsx", Declared(sample=sample)) for sample in ("P08", "P09"))
    assert (first.level_mm.tolist(), second.level_mm.tolist()) == ([-1.0, -1.5], [-2.0, -2.5])


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
        (BLANKS, "P09", "rows without a sample name, 3 to 5. Write the rows of this sample into the column range"),
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


HEAD, ROWS = "s [mm];Pegel 1 [mm];Pegel 2 [mm]", ("0;-1;-1,1", "5;-1;-1,2")
TABLE_OF_TWO = "\n".join((HEAD, *ROWS))


def _beside(*tables: str) -> str:
    """Lay tables beside each other, with a blank column between them."""
    return "\n".join(";;".join(lines) for lines in zip(*(table.split("\n") for table in tables), strict=True))


SEVERAL = {
    "side by side": (_beside(TABLE_OF_TWO, TABLE_OF_TWO), "A:C", "'E:G'"),
    "without a blank column": ("P 1;;P 2;\ns [mm];Pegel;s [mm];Pegel\n0;-1;0;-1\n1;-1;1;-1\n", "A:B", ""),
    "under unknown names": (_beside(*["x;h 1;h 2\n0;1;1\n1;1;1"] * 2), "", ""),
    "one under unknown names": (_beside(TABLE_OF_TWO, "x;h 1;h 2\n0;1;1\n1;1;1"), "A:C", ""),
    "under names with a sample": ("P1 s;P1 Pegel;P2 s;P2 Pegel\n0;-1;0;-1\n1;-1;1;-1\n", "", ""),
    "one below the other": (f"Labor\n\nP 1\n{TABLE_OF_TWO}\nMittel;-1;-1\n\nP 2\n\n{TABLE_OF_TWO}", "3:7", ""),
    "without a blank row": (f"P 1\n{TABLE_OF_TWO}\nP 2\n{TABLE_OF_TWO.replace('5;', '7;')}", "1:4", ""),
    "a sample's code above rows that go on": (f"{TABLE_OF_TWO}\nP02\n7;-2;-2\n9;-2;-2", "1:3", "row 5"),
    "unknown names again, further on": ("x;h\n0;1\n1;1\nx;h\n2;1\n3;1", "", ""),
}


@pytest.mark.parametrize(("text", "span", "words"), SEVERAL.values(), ids=SEVERAL)
def test_of_several_tables_none_is_chosen(tmp_path, text, span, words):
    path, declared = _written(tmp_path, text), Declared(unit="mm", quantity="level", separator="semicolon")
    if "x;h" in text and not span:
        declared = declared.model_copy(update={"columns": Columns(s="A", levels=("B",))})
    if "h 2" not in text or span:
        with pytest.raises(SheetFaults) as caught:
            read_readings(path, declared)
        assert words.strip("'") in str(caught.value)
    if span:
        declared = declared.model_copy(update={"columns": Columns(range=span)})
        assert read_readings(path, declared).level_mm[0] == pytest.approx(-1.0, abs=0.051)


def test_a_line_about_all_tables_is_a_remark_of_each(tmp_path):
    """Outside the range of the second table it was lost, and with it the doubt about the zero."""
    path = _written(tmp_path, "Nullpunkt: Tisch\n" + _beside(f"P 1;;\n{TABLE_OF_TWO}", f"P 2;;\n{TABLE_OF_TWO}"))
    for span in ("A2:C5", "E2:G5"):
        (doubt,) = (one for one in read_readings(path, Declared(columns=Columns(range=span))).doubts if "datum" in one)
        assert "line 1" in doubt


def test_a_part_is_named_by_the_user(tmp_path):
    path = _written(tmp_path, _beside(TABLE_OF_TWO, TABLE_OF_TWO))
    names = ["A1:C3", "sheet Mai, B:D", "columns B D", "rows of P1", "sheet Mai", "P1"]
    parts = [part_of(path, name) for name in names]
    assert [None if part is None else str(part) for part in parts] == [*names[:-1], None]


def test_columns_of_numbered_samples_are_no_repeats(tmp_path):
    path = _written(tmp_path, "s [mm];Probe 1 Tiefe [mm];Probe 2 Tiefe [mm]\n0;1;2\n5;1;2\n")
    with pytest.raises(SheetFaults) as caught:
        read_readings(path, Declared())
    assert "'Probe 1 Tiefe [mm]', 'Probe 2 Tiefe [mm]': columns of several samples" in str(caught.value)
    assert read_readings(path, Declared(columns=Columns(levels=("C",)))).level_mm.tolist() == [-2.0, -2.0]
