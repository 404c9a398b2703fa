"""ODS: read like any workbook, bounded against archives that unpack to more than any sheet holds."""

import time

import pytest

from tests.support.ods_writer import write_content
from validate.readings.grid import Cell, SheetFaults, read_grid

LOOKS = 'xmlns:fo="urn:oasis:names:tc:opendocument:xmlns:xsl-fo-compatible:1.0" fo'
STYLE = '<style:style style:name="{}" style:parent-style-name="{}"><style:{}-properties {}/></style:style>'
STRUCK = f'style:text-line-through-style="solid" {LOOKS}:color="#000000"'
STYLES = STYLE.format("Bad", "", "text", f'{LOOKS}:color="#cc0000"') + STYLE.format("ce2", "", "text", STRUCK)
STYLES += STYLE.format("ce1", "Bad", "table-cell", f'{LOOKS}:background-color="#FFFF00"')
STYLES += STYLE.format("ta0", "", "table", 'table:display="false"')
NOTE = "<office:annotation><text:p>in inch!</text:p><text:p>wrong</text:p></office:annotation>"
VAST = 'table:number-{}-repeated="999999999"'
FORMULA = 'table:formula="of:=1"'


def cell(text: str = "", marks: str = "", kind: str = "string", value: object = None) -> str:
    typed = f'office:value-type="{kind}"' + (f' office:value="{value}"' if value is not None else "")
    return f"<table:table-cell {typed} {marks}>{text}</table:table-cell>"


def number(value: float, text: str = "", marks: str = "") -> str:
    return cell(text and f"<text:p>{text}</text:p>", marks, "float", value)


def row(*cells: str, marks: str = "") -> str:
    return f"<table:table-row {marks}>{''.join(cells)}</table:table-row>"


def table(*rows: str, name: str = "a", columns: str = "", marks: str = "") -> str:
    return f'<table:table table:name="{name}" {marks}>{columns}{"".join(rows)}</table:table>'


KINDS = {
    cell("<text:p>16.1.</text:p>", 'office:date-value="2026-01-16"', "date"): Cell("16.1.", "date"),
    f"<table:table-cell {FORMULA}/>": Cell("", "formula"),
    cell("<text:p>WAHR</text:p>", 'office:boolean-value="true"', "boolean"): Cell("WAHR", "truth"),
    number(0, "#DIV/0!"): Cell("#DIV/0!", "error"),
    cell("<text:p>#WERT!</text:p>", FORMULA): Cell("#WERT!", "error"),
    # LibreOffice stores ### as the text of a number that its column is too narrow for.
    number(3.5, "###"): Cell("3.5", "number"),
    cell("<text:p>50 %</text:p>", "", "percentage", 0.5): Cell("0.5", "number", "%"),
    cell("<text:p>a</text:p><text:p><text:span>b</text:span></text:p>"): Cell("a\nb"),
}


@pytest.mark.parametrize(("written", "read"), KINDS.items(), ids=map(str, KINDS.values()))
def test_cells_have_their_kind(tmp_path, written, read):
    assert read_grid(write_content(tmp_path / "a.ods", table(row(number(1), written)))).rows[1][1][:3] == read[:3]


def test_marks_are_of_cells_with_content(tmp_path):
    yellow, struck = 'table:style-name="ce1"', 'table:style-name="ce2"'
    span = '<text:span text:style-name="ce2">2.3</text:span>'
    rows = (
        row(number(0, "", yellow), cell(f"{NOTE}<text:p>2.1 {span}</text:p>")),
        row(number(5, "", struck), cell("", yellow)),
        row(number(10), marks='table:visibility="filter"'),
        row(number(15), marks='table:visibility="collapse"'),
        row(number(20), number(1), number(2), marks='table:number-rows-repeated="2"'),
        row(cell(NOTE)),
    )
    usual = '<table:table-column table:default-cell-style-name="ce2" table:visibility="collapse"/>'
    columns = f'<table:table-column table:number-columns-repeated="2"/>{usual}'
    grid = read_grid(write_content(tmp_path / "a.ods", table(*rows, columns=columns), styles=STYLES))
    assert grid.rows[1][1].text == "2.1 2.3"
    cells = {(row, k): cell for row, cells in grid.rows.items() for k, cell in cells.items()}
    assert {key for key, cell in cells.items() if cell.is_struck} == {(1, 1), (2, 0), (5, 2), (6, 2)}
    assert {key: cell.colours for key, cell in cells.items() if cell.colours} == {(1, 0): "#ffff00 #cc0000"}
    assert (grid.hidden_rows, grid.hidden_columns) == ({3, 4}, {2})
    assert grid.comments == [(1, 1, "in inch!\nwrong"), (7, 0, "in inch!\nwrong")]


BOMBS = {
    "rows": (table(row(number(1, "", VAST.format("columns")), marks=VAST.format("rows"))), "", "more than 10100 rows"),
    "columns": (table(row(number(1, "", VAST.format("columns")))), "", "more than 256 columns"),
    "size": ("x" * 33_000_000, "", "33 MB when it is unpacked"),
    "entity": ("&a;", '<!DOCTYPE x [<!ENTITY a "aaaa">]>', "damaged"),
    "broken": ("<table:table>", "", "damaged"),
    "nothing": ("", "", "no readings"),
}


@pytest.mark.parametrize(("tables", "prolog", "words"), BOMBS.values(), ids=BOMBS)
def test_bombs_and_broken_files_are_refused_shortly(tmp_path, tables, prolog, words):
    began = time.process_time()
    with pytest.raises(SheetFaults, match=words) as caught:
        read_grid(write_content(tmp_path / "a.ods", tables, prolog=prolog))
    assert caught.value.doubts[0].where.file == tmp_path / "a.ods"
    assert time.process_time() - began < 10  # Without the limits, minutes
