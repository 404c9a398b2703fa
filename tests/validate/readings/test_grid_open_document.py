"""ODS: read like any workbook, bounded against archives that unpack to more than any sheet holds."""

import time

import pytest

from tests.open_document import write_content, write_ods
from validate.readings.files import read_grid
from validate.readings.grid import Cell, SheetFaults

ROWS = [["s [mm]", "{across=2}Tiefe [mm]"], [0.0, 1.5, 1.6], [5.0, 2.0, None], [10.0, 2.5, 2.6]]
CELL = "<table:table-cell {}>{}</table:table-cell>"
NUMBER = 'office:value-type="float" office:value="{}"'
LOOKS = 'xmlns:fo="urn:oasis:names:tc:opendocument:xmlns:xsl-fo-compatible:1.0"'
STYLES = (
    f'<style:style style:name="Bad"><style:text-properties {LOOKS} fo:color="#cc0000"/></style:style>'
    f'<style:style style:name="ce1" style:parent-style-name="Bad"><style:table-cell-properties {LOOKS} '
    'fo:background-color="#FFFF00"/></style:style>'
    f'<style:style style:name="ce2"><style:table-cell-properties {LOOKS} fo:background-color="transparent"/>'
    f'<style:text-properties {LOOKS} fo:color="#000000" style:text-line-through-style="solid"/></style:style>'
    '<style:style style:name="ro0"><style:table-row-properties style:row-height="0.00cm"/></style:style>'
    '<style:style style:name="ta0"><style:table-properties table:display="false"/></style:style>'
)


def row(*cells: str, marks: str = "") -> str:
    return f"<table:table-row {marks}>{''.join(cells)}</table:table-row>"


def number(value: float, text: str = "", marks: str = "") -> str:
    return CELL.format(f"{NUMBER.format(value)} {marks}", text and f"<text:p>{text}</text:p>")


def table(*rows: str, name: str = "a", columns: str = "", marks: str = "") -> str:
    return f'<table:table table:name="{name}" {marks}>{columns}{"".join(rows)}</table:table>'


def test_numbers_and_merged_cells_are_read_as_they_are_stored(tmp_path):
    grid = read_grid(write_ods(tmp_path / "a.ods", ROWS))
    assert (grid.written, grid.sheet, grid.merged) == (("ODS", "sheet 'Tabelle1'"), "Tabelle1", ((1, 1, 1, 2),))
    assert grid.rows[1] == (Cell("s [mm]"), Cell("Tiefe [mm]"))
    assert grid.rows[2] == (Cell("0", "number"), Cell("1.5", "number"), Cell("1.6", "number"))
    assert grid.rows[3] == (Cell("5", "number"), Cell("2", "number"))


@pytest.mark.parametrize(
    ("cell", "read"),
    [
        (
            CELL.format('office:value-type="date" office:date-value="2026-01-16"', "<text:p>16.1.</text:p>"),
            ("16.1.", "date"),
        ),
        (CELL.format('table:formula="of:=1+1"', ""), ("", "formula")),
        (CELL.format('office:value-type="boolean" office:boolean-value="true"', ""), ("TRUE", "truth")),
        (number(0, "#DIV/0!"), ("#DIV/0!", "error")),
        (number(0, "Err:503"), ("Err:503", "error")),
        (
            CELL.format('office:value-type="string" table:formula="of:=A1"', "<text:p>#WERT!</text:p>"),
            ("#WERT!", "error"),
        ),
        (number(float("inf")), ("inf", "error")),
        # LibreOffice stores ### as the text of a number that its column is too narrow for.
        (number(3.5, "###"), ("3.5", "number")),
        (number(2.5, "2,50 cm"), ("2.5", "number", "cm")),
        (
            CELL.format('office:value-type="percentage" office:value="0.5"', "<text:p>50 %</text:p>"),
            ("0.5", "number", "%"),
        ),
        (CELL.format("", "<text:p>a</text:p><text:p><text:span>b</text:span></text:p>"), ("a\nb", "text")),
    ],
)
def test_cells_have_their_kind(tmp_path, cell, read):
    grid = read_grid(write_content(tmp_path / "a.ods", table(row(number(1), cell))))
    assert grid.rows[1][1] == Cell(*read)


@pytest.mark.parametrize(("results", "kind"), [((0, 0), "formula"), ((0, 1), "number")])
def test_formulas_of_which_all_results_are_0_were_never_calculated(tmp_path, results, kind):
    cells = [number(value, marks='table:formula="of:=1"') for value in results]
    assert read_grid(write_content(tmp_path / "a.ods", table(row(*cells)))).rows[1][0].kind == kind


def test_marks_are_of_cells_with_content(tmp_path):
    note = "<office:annotation><text:p>in inch!</text:p><text:p>wrong</text:p></office:annotation>"
    span = '<text:p>2.1 <text:span text:style-name="ce2">2.3</text:span></text:p>'
    rows = (
        row(number(0, marks='table:style-name="ce1"'), CELL.format('office:value-type="string"', f"{note}{span}")),
        row(number(5, marks='table:style-name="ce2"'), CELL.format('table:style-name="ce1"', "")),
        row(number(10), marks='table:visibility="filter"'),
        row(number(15), marks='table:style-name="ro0"'),
        row(number(20), number(1), number(2), marks='table:number-rows-repeated="2"'),
        row(CELL.format("", note)),
    )
    columns = (
        '<table:table-column table:number-columns-repeated="2"/>'
        '<table:table-column table:default-cell-style-name="ce2" table:visibility="collapse"/>'
    )
    path = write_content(tmp_path / "a.ods", table(*rows, columns=columns), styles=STYLES)
    grid = read_grid(path)
    assert grid.rows[1][1].text == "2.1 2.3"
    assert {tuple(mark) for mark in grid.marks} == {
        (1, 0, "coloured", "fill #ffff00 font #cc0000"),
        (1, 1, "comment", "in inch!\nwrong"),
        (1, 1, "struck", ""),
        (2, 0, "struck", ""),
        (3, 0, "hidden", ""),
        (4, 0, "hidden", ""),
        *((line, 2, kind, "") for line in (5, 6) for kind in ("hidden", "struck")),
        (7, 0, "comment", "in inch!\nwrong"),
    }


def test_texts_of_other_sheets_are_elsewhere(tmp_path):
    note = "<office:annotation><text:p>wrong</text:p></office:annotation>"
    rows = [row(number(value), number(1)) for value in (0, 5)]
    other = table(
        row(CELL.format("", f"{note}<text:p>all in cm</text:p>"), number(5)), name="N", marks='table:style-name="ta0"'
    )
    path = write_content(tmp_path / "a.ods", table(*rows) + other, styles=STYLES)
    assert read_grid(path).elsewhere == (("sheet 'N', cell A1", "wrong"), ("sheet 'N', cell A1", "all in cm"))
    path = write_content(tmp_path / "a.ods", table(*rows) + table(*rows, name="b"))
    with pytest.raises(SheetFaults) as caught:
        read_grid(path)
    assert caught.value.doubts[0].answers == {"sheet": "a"}
    assert read_grid(path, "b").sheet == "b"


def test_blank_rows_and_cells_that_are_repeated_a_million_times_are_not_unrolled(tmp_path):
    """As LibreOffice ends every sheet."""
    cells = '<table:table-cell table:number-columns-repeated="16384"/>'
    blank = row(cells, marks='table:number-rows-repeated="1048570"')
    began = time.process_time()
    assert len(read_grid(write_ods(tmp_path / "a.ods", ROWS, more=blank)).rows) == 4
    assert time.process_time() - began < 1


REPEATED = 'table:number-rows-repeated="999999999"'


@pytest.mark.parametrize(
    ("tables", "prolog", "words"),
    [
        (table(row(number(1, marks='table:number-columns-repeated="9"'), marks=REPEATED)), "", "more than 10000 rows"),
        (table(row(number(1, marks='table:number-columns-repeated="999"'))), "", "more than 256 columns"),
        ("x" * 33_000_000, "", "33 MB when it is unpacked"),
        ("&a;", '<!DOCTYPE x [<!ENTITY a "aaaa">]>', "damaged"),
        ("<table:table>", "", "damaged"),
        ("", "", "no rows"),
    ],
    ids=["rows", "columns", "size", "entity", "broken", "nothing"],
)
def test_bombs_and_broken_files_are_refused_shortly(tmp_path, tables, prolog, words):
    began = time.process_time()
    with pytest.raises(SheetFaults, match=words) as caught:
        read_grid(write_content(tmp_path / "a.ods", tables, prolog=prolog))
    assert caught.value.doubts[0].where.startswith(str(tmp_path / "a.ods"))
    assert time.process_time() - began < 3
