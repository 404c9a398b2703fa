"""Sheets in workbooks: which sheet, and every cell that is no plain number."""

import datetime
import zipfile

import openpyxl
import pytest
from openpyxl.worksheet.worksheet import Worksheet

from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile
from tests.sheet_writers import rewritten
from validate.readings import workbook
from validate.readings.read_readings import read_readings
from validate.readings.samples import read_cells
from validate.readings.sheet import SheetFaults
from validate.settings import Columns, Declared

ROWS = [["s [mm]", "Tiefe 1 [mm]", "Tiefe 2 [mm]"], [0, 1.5, 1.6], [5, 2, None], [10, 2.5, 2.6]]


@pytest.fixture
def book() -> openpyxl.Workbook:
    book = openpyxl.Workbook()
    for row in ROWS:
        book.worksheets[0].append(row)
    return book


@pytest.fixture
def read(tmp_path):
    def saved(book: openpyxl.Workbook, **declared) -> Profile:
        book.save(tmp_path / "lab.xlsx")
        return read_readings(tmp_path / "lab.xlsx", Declared(**declared))

    return saved


def first(book: openpyxl.Workbook) -> Worksheet:
    sheet = book.worksheets[0]
    assert isinstance(sheet, Worksheet)
    return sheet


def faults_of(read, book, **declared) -> SheetFaults:
    with pytest.raises(SheetFaults) as caught:
        read(book, **declared)
    return caught.value


def rows_of(*cells: str) -> str:
    """Rows of two cells each, without addresses."""
    return "".join(f"<row>{one}{two}</row>" for one, two in zip(cells[::2], cells[1::2], strict=True))


HEADER = ('<c t="inlineStr"><is><t>s_mm</t></is></c>', '<c t="str"><v>depth_mm</v></c>')


def test_numbers_are_read_as_they_are_stored(book, read):
    sheet = read(book)
    assert sheet.s_mm.tolist() == [0, 5, 10]
    assert sheet.repeats_mm[0].tolist() == [-1.5, -1.6]
    assert sheet.dialect == (
        "XLSX, sheet 'Sheet'; wide, 2 repeats; depth downward in mm from the sample surface; 1 reading missing"
    )


def test_numbers_kept_as_text_are_read_with_their_own_mark(book, read):
    first(book)["B2"], first(book)["C2"] = "1,5", "k.A."
    assert read(book).repeats_mm[0, 0] == -1.5


def test_all_cells_that_are_no_numbers_are_named_at_once(book, read):
    sheet = first(book)
    sheet["B2"] = "=C2-0.1"
    sheet["C2"] = datetime.date(2026, 1, 16)
    sheet["B3"] = "#DIV/0!"
    sheet["C3"] = True
    sheet["A4"] = 16.5
    sheet["A4"].number_format = "DD.MM.YYYY"
    sheet["C4"] = "tief"
    found = {fault.place.column: str(fault) for fault in faults_of(read, book).faults if fault.place.row == 2}
    assert "cell C2" in found[2]
    assert "'2026-01-16' is a date" in found[2]
    others = str(faults_of(read, book))
    for words in (
        "1 formula without a stored result, B2",
        "cell B3",
        "'#DIV/0!' is an error",
        "cell C3",
        "'TRUE' is not a number",
        "cell A4",
        "'1900-01-16 12:00'",
    ):
        assert words in others
    assert len(faults_of(read, book).faults) == 6


def test_formats_of_numbers_are_no_dates(book, read):
    for cell, form in zip(("B2", "B3", "B4"), ('0.00" mm days"', "[Red]0.0;-0.0", "0.0E+00"), strict=True):
        first(book)[cell].number_format = form
    assert read(book).repeats_mm[:, 0].tolist() == [-1.5, -2, -2.5]


@pytest.mark.parametrize("general", ["Standard", "Est\u00e1ndar", "Standaard"])
def test_the_word_for_a_general_format_is_no_date(book, read, general):
    """Writers store the word of their language, whose d, m, s and y openpyxl takes for those of a date."""
    for row in (2, 3, 4):
        first(book).cell(row, 2).number_format = general
    assert read(book).repeats_mm[:, 0].tolist() == [-1.5, -2, -2.5]


def test_control_characters_of_names_are_decoded(book, read):
    """SAP and LIMS write a line's end as _x000D_."""
    first(book)["A1"], first(book)["B1"] = "s_mm_x000D_", "Tiefe 1_x000D__x000A_[mm]"
    assert read(book).s_mm.tolist() == [0, 5, 10]


def test_merged_cells_are_named(book, read):
    first(book).merge_cells("B3:C3")
    (fault,) = faults_of(read, book).faults
    assert "cells B3 to C3 are merged" in fault.finding
    first(book).unmerge_cells("B3:C3")
    first(book).insert_rows(1)
    first(book)["A1"] = "Probe 7, Messung vom 3. April"
    first(book).merge_cells("A1:C1")
    assert len(read(book).s_mm) == 3


def test_one_name_over_several_columns_is_each_ones(read):
    """As spreadsheets merge it; a CSV of the same sheet has blanks there."""
    book = openpyxl.Workbook()
    sheet = first(book)
    for row in ROWS:
        sheet.append(row)
    sheet.insert_rows(1)
    sheet["A1"], sheet["B1"] = "s [mm]", "Tiefe [mm]"
    sheet["A2"], sheet["B2"], sheet["C2"] = None, "Messung 1", "Messung 2"
    sheet.merge_cells("A1:A2")
    sheet.merge_cells("B1:C1")
    assert read(book).repeats_mm[0].tolist() == [-1.5, -1.6]
    sheet["C2"] = None
    assert "column C contains numbers and has no name" in str(faults_of(read, book))


def test_a_merged_name_with_unknown_words_is_asked_about_and_keeps_its_unit(read):
    book = openpyxl.Workbook()
    for row in (["Ort", "Einsinkung [mm]"], [None, "Messung 1", "Messung 2"], *ROWS[1:]):
        first(book).append(row)
    first(book).merge_cells("B1:C1")
    assert "B 'Einsinkung [mm] Messung 1' (1.5), C 'Einsinkung [mm] Messung 2'" in str(faults_of(read, book))
    said = Columns(levels=("B:C",), sign="down", s="A")
    assert "'Ort': no unit" in str(faults_of(read, book, columns=said))
    first(book)["A1"] = "Ort [mm]"
    assert read(book, columns=said).repeats_mm[0].tolist() == [-1.5, -1.6]


def test_empty_sheets_are_no_choice(book, read):
    book.create_sheet("Tabelle2")
    assert len(read(book).s_mm) == 3


def test_several_sheets_are_named_and_one_is_asked_for(book, read):
    other = book.create_sheet("<b>Riss $2$")
    for row in ROWS:
        other.append(row)
    message = str(faults_of(read, book))
    assert "2 sheets have content: 'Sheet', '<b>Riss $2$'" in message
    assert "[readings] sheet" in message
    assert "sheet '<b>Riss $2$'" in read(book, sheet="<b>Riss $2$").dialect
    assert "no sheet 'riss'" in str(faults_of(read, book, sheet="riss"))


def test_hidden_sheets_are_not_read_unless_they_are_named(book, read):
    other = book.create_sheet("Rechnung")
    other.append(["Summe", 7])
    other.sheet_state = "veryHidden"
    assert read(book).dialect.endswith("1 hidden sheet not read")
    book.worksheets[0].sheet_state, other.sheet_state = "hidden", "visible"
    assert read(book, sheet="Sheet").dialect.endswith("this sheet is hidden")


def test_hidden_rows_are_read_and_said(book, read):
    first(book).row_dimensions[3].hidden = True
    first(book).column_dimensions["C"].hidden = True
    sheet = read(book)
    assert len(sheet.s_mm) == 3
    assert "1 hidden row and 1 hidden column are read too" in sheet.dialect


def test_a_table_may_stand_anywhere(read):
    book = openpyxl.Workbook()
    sheet = first(book)
    sheet["C2"] = "Probe 7"
    for row, cells in enumerate(ROWS, start=5):
        for column, value in enumerate(cells, start=4):
            sheet.cell(row + (row > 5), column, value)
    assert read(book).repeats_mm[0].tolist() == [-1.5, -1.6]


def test_stored_results_of_formulas_are_read(tmp_path):
    numbers = ("<c><v>0</v></c>", "<c><f>1+0.5</f><v>1.5</v></c>", "<c><v>5</v></c>", "<c><v>2E0</v></c>")
    path = rewritten(tmp_path / "a.xlsx", sheet=rows_of(*HEADER, *numbers))
    assert read_readings(path, Declared()).level_mm.tolist() == [-1.5, -2]


def test_an_empty_text_of_a_formula_is_a_missing_reading(tmp_path):
    rows = ("<c><v>0</v></c>", '<c t="str"><f>""</f><v></v></c>', "<c><v>5</v></c>", "<c><v>2</v></c>")
    path = rewritten(tmp_path / "a.xlsx", sheet=rows_of(*HEADER, *rows, "<c><v>9</v></c>", "<c><v>2</v></c>"))
    assert read_readings(path, Declared()).s_mm.tolist() == [5, 9]


def test_phonetic_guides_are_no_part_of_a_text(tmp_path):
    header = '<c t="inlineStr"><is><r><t>depth</t></r><r><t>_mm</t></r><rPh sb="0" eb="1"><t>no</t></rPh></is></c>'
    numbers = [f"<c><v>{value}</v></c>" for value in (0, 1.5, 5, 2)]
    path = rewritten(tmp_path / "a.xlsx", sheet=rows_of(HEADER[0], header, *numbers))
    assert read_readings(path, Declared()).level_mm.tolist() == [-1.5, -2]


def test_a_merged_sheet_takes_no_memory(book, tmp_path):
    """A worksheet of openpyxl would hold 17 thousand million cells of it."""
    book.save(path := tmp_path / "merged.xlsx")
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    part = "xl/worksheets/sheet1.xml"
    merged = b'</sheetData><mergeCells count="1"><mergeCell ref="A1:XFD1048576"/></mergeCells>'
    parts[part] = parts[part].replace(b"</sheetData>", merged)
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in parts.items():
            archive.writestr(name, text)
    with pytest.raises(SheetFaults, match="cells A1 to XFD1048576 are merged"):
        read_readings(path, Declared())


def test_an_old_workbook_is_named(tmp_path):
    (tmp_path / "a.xlsx").write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600))
    with pytest.raises(InputError, match="an old Excel workbook"):
        read_cells(tmp_path / "a.xlsx", Declared())


def test_another_zip_is_no_workbook(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.ods", "w") as archive:
        archive.writestr("content.xml", "<x/>")
    with pytest.raises(InputError, match="a zip file, but not an XLSX"):
        read_cells(tmp_path / "a.ods", Declared())


@pytest.mark.parametrize(
    "sheet",
    [
        rows_of("<c><v>&x;</v></c>", HEADER[1]),
        rows_of("<c><v>deep</v></c>", HEADER[1]),
        rows_of(*HEADER, "<c><v>NaN</v></c>", "<c><v>1</v></c>"),
        rows_of('<c t="s"><v>7</v></c>', HEADER[1]),
        rows_of('<c r="1A"><v>7</v></c>', HEADER[1]),
    ],
    ids=["an entity", "a word", "no number", "a string", "an address"],
)
def test_damaged_worksheets_are_refused_by_file(tmp_path, sheet):
    with pytest.raises(SheetFaults) as caught:
        read_cells(rewritten(tmp_path / "a.xlsx", sheet=sheet), Declared())
    assert caught.value.faults[0].place.path == tmp_path / "a.xlsx"


def test_entities_are_refused(tmp_path):
    """A few kilobytes of nested ones are gigabytes of text; the standard library expands them."""
    prolog = '<!DOCTYPE a [<!ENTITY x "s_mm"><!ENTITY y "&x;&x;">]>'
    cell = '<c t="inlineStr"><is><t>&y;</t></is></c>'
    with pytest.raises(SheetFaults, match="Entities"):
        read_cells(rewritten(tmp_path / "a.xlsx", sheet=rows_of(cell, HEADER[1]), prolog=prolog), Declared())


@pytest.mark.parametrize(
    ("sheet", "words"),
    [
        (f'<c t="inlineStr"><is><t>{"x" * workbook.LARGEST_UNPACKED_BYTES}</t></is></c>', "unpacks to"),
        (rows_of(*["<c><v>7</v></c>"] * 24_000), "more than 10000 rows"),
        (rows_of('<c r="XFD1"><v>7</v></c>', '<c r="A1"><v>1</v></c>'), "more than 256 columns"),
    ],
    ids=["a bomb", "rows", "columns"],
)
def test_vast_worksheets_are_refused(tmp_path, sheet, words):
    with pytest.raises(SheetFaults, match=words):
        read_cells(rewritten(tmp_path / "a.xlsx", sheet=sheet), Declared())


def test_an_infinite_number_is_none(tmp_path):
    path = rewritten(tmp_path / "a.xlsx", sheet=rows_of(*HEADER, "<c><v>1E999</v></c>", "<c><v>1</v></c>"))
    with pytest.raises(SheetFaults, match=r"cell A2 .s_mm.: 'inf'"):
        read_readings(path, Declared())


def test_what_openpyxl_leaves_out_is_no_warning(book, read, recwarn):
    """The library warns of a date beyond the calendar, whose cell is then an error."""
    first(book)["B2"] = 1e9
    first(book)["B2"].number_format = "DD.MM.YYYY"
    assert "cell B2" in str(faults_of(read, book))
    assert not recwarn.list


@pytest.mark.parametrize("at", [24, -6], ids=["size", "offset"])
def test_an_archive_that_lies_about_its_parts_is_damaged(tmp_path, at):
    """The directory gives a worksheet one byte, or begins before the file; no more is ever unpacked."""
    path = rewritten(tmp_path / "a.xlsx", sheet=rows_of(*HEADER))
    content = bytearray(path.read_bytes())
    entry = content.rfind(b"xl/worksheets/sheet1.xml") - 46
    assert content[entry : entry + 4] == b"PK\x01\x02"
    if at == 24:
        content[entry + at : entry + at + 4] = (1).to_bytes(4, "little")
    else:
        content[at : at + 4] = (1 << 30).to_bytes(4, "little")
    path.write_bytes(content)
    with pytest.raises(SheetFaults, match="damaged"):
        read_cells(path, Declared())
