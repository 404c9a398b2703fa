"""ODS: read like any workbook, bounded against archives that unpack to more than any sheet holds."""

import time
import zipfile

import pytest

from tests.open_document import write_content, write_ods
from validate.readings.read_readings import read_readings
from validate.readings.sheet import SheetFaults
from validate.settings import Declared

ROWS = [["s [mm]", "Tiefe 1 [mm]", "Tiefe 2 [mm]"], [0.0, 1.5, 1.6], [5.0, 2.0, None], [10.0, 2.5, 2.6]]


NUMBER = '<table:table-cell office:value-type="float" office:value="{}"{}/>'
FLOAT = NUMBER.format(20, "")


def refused(path):
    with pytest.raises(SheetFaults) as caught:
        read_readings(path, Declared())
    return str(caught.value)


def test_numbers_are_read_as_they_are_stored_and_a_merged_header_spans_its_columns(tmp_path):
    sheet = read_readings(write_ods(tmp_path / "a.ods", ROWS), Declared())
    assert sheet.repeats_mm is not None
    assert sheet.repeats_mm[0].tolist() == [-1.5, -1.6]
    assert sheet.dialect.startswith("ODS, sheet 'Tabelle1'; wide, 2 repeats")
    rows = [["s [mm]", "{across=2}Tiefe [mm]"], [None, "Messung 1", "Messung 2"], *ROWS[1:]]
    assert read_readings(write_ods(tmp_path / "a.ods", rows), Declared()).level_mm.tolist() == sheet.level_mm.tolist()


def test_dates_and_formulas_are_told_as_of_other_workbooks(tmp_path):
    day = 'office:value-type="date" office:date-value="2026-01-16"'
    date = f"<table:table-cell {day}><text:p>16.1.</text:p></table:table-cell>"
    formula = '<table:table-cell table:formula="of:=1+1"/>'
    message = refused(
        write_ods(tmp_path / "a.ods", ROWS, more=f"<table:table-row>{FLOAT}{date}{formula}</table:table-row>")
    )
    assert "cell B5 (Tiefe 1 [mm]): '16.1.' is a date" in message
    assert "1 formula without a stored result, C5" in message


STRUCK = NUMBER.format(2.5, ' table:style-name="ce1"') + NUMBER.format(2.6, "")
STYLE = '<style:style style:name="ce1"><style:text-properties style:text-line-through-style="solid"/></style:style>'


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (f'<table:table-row table:visibility="collapse">{FLOAT}{FLOAT}</table:table-row>', "this row is hidden"),
        (f"<table:table-row>{FLOAT}{STRUCK}</table:table-row>", "2.5 is struck through"),
    ],
)
def test_hidden_rows_and_struck_cells_are_asked_about(tmp_path, row, words):
    with zipfile.ZipFile(write_ods(tmp_path / "a.ods", ROWS, more=row)) as archive:
        content = archive.read("content.xml").decode()
    table = content[content.index("<table:table ") : content.index("</office:spreadsheet>")]
    path = write_content(tmp_path / "b.ods", table, styles=STYLE)
    assert any(words in doubt for doubt in read_readings(path, Declared()).doubts)


def test_blank_rows_and_cells_that_are_repeated_a_million_times_are_not_unrolled(tmp_path):
    """As LibreOffice ends every sheet."""
    blank = (
        '<table:table-row table:number-rows-repeated="1048570"><table:table-cell '
        'table:number-columns-repeated="16384"/></table:table-row>'
    )
    began = time.process_time()
    assert len(read_readings(write_ods(tmp_path / "a.ods", ROWS, more=blank), Declared()).s_mm) == 3
    assert time.process_time() - began < 1


@pytest.mark.parametrize(
    ("tables", "prolog", "words"),
    [
        (
            '<table:table table:name="a"><table:table-row table:number-rows-repeated="999999999"><table:table-cell '
            'office:value-type="float" office:value="1" table:number-columns-repeated="9"/>'
            "</table:table-row></table:table>",
            "",
            "more than 10000 rows",
        ),
        ("x" * 33_000_000, "", "33 MB when it is unpacked"),
        ("&a;", '<!DOCTYPE x [<!ENTITY a "aaaa">]>', "damaged, or not an ODS"),
        ("<table:table>", "", "damaged, or not an ODS"),
    ],
    ids=["rows", "size", "entity", "broken"],
)
def test_bombs_and_broken_files_are_refused_shortly(tmp_path, tables, prolog, words):
    began = time.process_time()
    assert words in refused(write_content(tmp_path / "a.ods", tables, prolog=prolog))
    assert time.process_time() - began < 3


def test_a_number_that_its_column_is_too_narrow_for_is_no_error(tmp_path):
    """LibreOffice stores ### as the text of such a number."""
    cells = "".join(
        f'<table:table-cell office:value-type="float" office:value="{value}"><text:p>###</text:p></table:table-cell>'
        for value in (20, 3.5)
    )
    path = write_ods(tmp_path / "a.ods", ROWS, more=f"<table:table-row>{cells}</table:table-row>")
    assert read_readings(path, Declared()).level_mm[-1] == -3.5
