"""XLSX workbooks: the choice of the sheet, kinds of cells, marks, and texts on other sheets."""

import datetime

import openpyxl
import pytest
from openpyxl.cell.rich_text import CellRichText, TextBlock
from openpyxl.cell.text import InlineFont
from openpyxl.comments import Comment
from openpyxl.styles import Font, PatternFill
from openpyxl.styles.colors import Color

from tests.support.sheet_writers import rewritten
from validate.readings.grid import FORMULA, LARGEST_UNPACKED_MB, Cell, Grid, SheetFaults, read_grid

ROWS = [["s [mm]", "Tiefe 1 [mm]", "Tiefe 2 [mm]"], [0, 1.5, 1.6], [5, 2, None], [10, 2.5, 2.6]]


@pytest.fixture
def first():
    sheet = openpyxl.Workbook().worksheets[0]
    for row in ROWS:
        sheet.append(row)
    return sheet


@pytest.fixture
def read(first, tmp_path):
    def saved(sheet: str | None = None) -> Grid:
        first.parent.save(tmp_path / "lab.xlsx")
        return read_grid(tmp_path / "lab.xlsx", sheet)

    return saved


def cells_of(grid: Grid) -> dict[tuple[int, int], Cell]:
    """Return the cells by row and column."""
    return {(row, k): cell for row, cells in grid.rows.items() for k, cell in cells.items() if cell.text}


def rows_of(*cells: str) -> str:
    """Rows of two cells each, without addresses."""
    return "".join(f"<row>{first}{second}</row>" for first, second in zip(cells[::2], cells[1::2], strict=True))


HEADER = ('<c t="inlineStr"><is><t>s_mm</t></is></c>', '<c t="str"><v>depth_mm</v></c>')


@pytest.mark.parametrize("code", ['0.0" mm days"', "[Red]0.0;-0.0", "0.0E+00", "Standard", "Est\u00e1ndar"])
@pytest.mark.parametrize("value", [0.25, 2, 60.5, -2.5])
def test_a_number_format_does_not_turn_a_number_into_a_date(first, read, code, value):
    """Some programs store the format General in their language, such as Standard. openpyxl takes its d for a date's."""
    first["B2"], first["B2"].number_format = value, code
    assert read().rows[2][1][:2] == (f"{value:g}", "number")


def test_a_text_that_a_format_shows_beside_a_number_counts_as_its_unit(first, read):
    for cell, code in {"B2": '0.0" cm"', "B3": '"<"0.00'}.items():
        first[cell], first[cell].number_format = 1.5, code
    assert [row[1].unit for row in (read().rows[2], read().rows[3])] == ["cm", "<"]


def test_cells_other_than_numbers_are_read_with_their_kind(first, read):
    values = {"B2": "=C2-0.1", "C2": datetime.date(2026, 1, 16), "B3": "#DIV/0!", "C3": True, "B4": "1,5", "C4": 1e9}
    for cell, value in {**values, "A1": "s_mm_x000D_", "A4": 16.5}.items():
        first[cell] = value
    first["A4"].number_format = first["C4"].number_format = "DD.MM.YYYY"
    rows = {row: [*cells.values()] for row, cells in read().rows.items()}
    assert rows[1][0] == Cell("s_mm")
    assert rows[2][1:] == [FORMULA, Cell("2026-01-16", "date")]
    assert rows[3][1:] == [Cell("#DIV/0!", "error"), Cell("TRUE", "truth")]
    assert rows[4] == [Cell("1900-01-16 12:00", "date"), Cell("1,5"), Cell("#VALUE!", "error")]


def test_colours_and_strikethrough_are_read_only_for_cells_with_content(first, read):
    yellow, struck, red = PatternFill("solid", fgColor="FFFFFF00"), Font(strike=True), Font(color="FFFF0000")
    first["C2"] = CellRichText("2.1 ", TextBlock(InlineFont(strike=True), "2.3"))
    first["A2"].font, first["B2"].fill, first["B3"].font = struck, yellow, red
    first["A4"].fill, first["A4"].font = PatternFill("solid", fgColor="FFFFFFFF"), Font(color=Color(theme=5))
    first["F9"].fill, first["F9"].font = yellow, struck
    plain = Color(rgb="00FFFFFF"), Color(theme=1), Color(indexed=64), Color(auto=True), Color(rgb="FF000000")
    for column, (colour, other) in enumerate(zip(plain[:3], plain[2:], strict=True), start=1):
        first.cell(1, column).fill, first.cell(1, column).font = PatternFill("solid", fgColor=colour), Font(color=other)
    shown = {(2, 1): "fill rgb FFFFFF00 0.0", (3, 1): "font rgb FFFF0000 0.0", (4, 0): "font theme 5 0.0"}
    cells = cells_of(grid := read())
    assert {key: cell.colours for key, cell in cells.items() if cell.colours} == shown
    assert {key for key, cell in cells.items() if cell.is_struck} == {(2, 0), (2, 2)}
    assert grid.rows[2][2].text == "2.1 2.3"


def test_comments_are_read_without_their_author(first, read):
    first["B2"].comment, first["D9"].comment = Comment("PC 1:\nin inch!", "PC 1"), Comment("zero: 5 mm", "PC 1")
    first.parent.create_sheet("Notes")["C3"].comment = Comment("from the right end", "x")
    grid = read()
    assert grid.comments == [(2, 1, "in inch!"), (9, 3, "zero: 5 mm")]
    assert grid.elsewhere == [("sheet 'Notes', comment in row 3", "from the right end")]


def test_texts_of_other_sheets_headers_and_footers_are_listed_with_their_location(first, read):
    hidden, many = first.parent.create_sheet("in inch"), first.parent.create_sheet("Log")
    hidden.append([7, "Sample P02"])
    first.oddHeader.center.text, first.evenFooter.left.text = "P01 &[Page]", "all in cm"
    first.oddHeader.center.font, first.oddFooter.right.text = "Arial,Bold", "&P"
    hidden.sheet_state, hidden.oddFooter.center.text = "veryHidden", "end"
    for line in range(250):
        many.append([line, None, f"line {line}"])
    elsewhere = read("Sheet").elsewhere
    assert elsewhere[:2] == [("page header", "P01"), ("page footer", "all in cm")]
    assert elsewhere[2:4] == [("sheet 'in inch', page footer", "end"), ("sheet 'in inch', row 1", "7 Sample P02")]
    assert len(elsewhere) == 4 + 250
    assert elsewhere[-1] == ("sheet 'Log', row 250", "249 line 249")


def test_several_sheets_with_tables_give_one_question(first, read):
    def question(sheet: str | None = None) -> str:
        (doubt,) = read(sheet).doubts
        assert (doubt.kind, doubt.answers, doubt.is_remark) == ("sheet", {"sheet": None}, False)
        return doubt.finding

    second = first.parent.copy_worksheet(first)
    second.title = "<b>Riss $2$"
    first.parent.create_sheet("Empty")
    assert "'Sheet', '<b>Riss $2$'." in question()
    assert read("<b>Riss $2$").sheet == "<b>Riss $2$"
    assert "'riss', only 'Sheet', '<b>Riss $2$', 'Empty'" in question("riss")
    first.sheet_state = second.sheet_state = "hidden"
    assert "hidden" in question()


ENTITY = '<!DOCTYPE a [<!ENTITY x "s_mm"><!ENTITY y "&x;&x;">]>'
PHONETIC = '<c t="inlineStr"><is><r><t>depth</t></r><r><t>_mm</t></r><rPh sb="0" eb="1"><t>no</t></rPh></is></c>'
ZERO, SUM = "<c><f>A1</f><v>0</v></c>", "<c><f>1+0.5</f><v>1.5</v></c>"
WRITTEN = {
    "never calculated": (ZERO, SUM, ["formula", "1.5"]),
    "phonetic guides": (HEADER[0], PHONETIC, ["s_mm", "depth_mm"]),
    "an empty text": ("<c><v>-1</v></c>", '<c t="str"><f>""</f><v></v></c>', ["-1"]),
    "infinity": (HEADER[0], "<c><v>1E999</v></c>", ["s_mm", "inf"]),
    "one zero": (ZERO, "<c><v>0</v></c>", ["0", "0"]),
    "only zeros": (ZERO, ZERO, ["formula", "formula"]),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_cells_written_by_other_programs_are_read(tmp_path, name):
    *cells, read = WRITTEN[name]
    path = rewritten(tmp_path / "a.xlsx", sheet=rows_of(*HEADER, *cells), on_load=name == "never calculated")
    assert [cell.text or cell.kind for cell in read_grid(path).rows[2].values()] == read


DAMAGED = {
    # Nested entities of a few kilobytes are gigabytes of text; the standard library expands them.
    "entities": (rows_of("<c><v>&y;</v></c>", HEADER[1]), "Entities"),
    "a word": (rows_of("<c><v>deep</v></c>", HEADER[1]), "damaged"),
    "an address": (rows_of('<c r="1A"><v>7</v></c>', HEADER[1]), "damaged"),
    "a bomb": (rows_of(f"<c><v>{'1' * LARGEST_UNPACKED_MB * 1_000_000}</v></c>", HEADER[1]), "MB when it is unpacked"),
    "rows": ("<row><c><v>7</v></c></row>" * 10_101, "more than 10100 rows"),
    "columns": (rows_of('<c r="XFD1"><v>7</v></c>', '<c r="A1"><v>1</v></c>'), "more than 256 columns"),
    "nothing": ("", "Strict Open XML"),
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_damaged_and_too_large_worksheets_are_refused(tmp_path, damage, recwarn):
    sheet, words = DAMAGED[damage]
    with pytest.raises(SheetFaults, match=words) as caught:
        read_grid(rewritten(tmp_path / "a.xlsx", sheet=sheet, prolog=ENTITY if damage == "entities" else ""))
    assert caught.value.doubts[0].where.file == tmp_path / "a.xlsx"
    assert not recwarn.list
