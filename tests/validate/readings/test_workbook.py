"""Sheets in workbooks: which sheet, and every cell that is no plain number."""

import datetime
import json
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
def first(book) -> Worksheet:
    sheet = book.worksheets[0]
    assert isinstance(sheet, Worksheet)
    return sheet


@pytest.fixture
def read(book, tmp_path):
    def saved(**declared) -> Profile:
        book.save(tmp_path / "lab.xlsx")
        return read_readings(tmp_path / "lab.xlsx", Declared(**declared))

    return saved


@pytest.fixture
def refused(read):
    def faults(**declared) -> SheetFaults:
        with pytest.raises(SheetFaults) as caught:
            read(**declared)
        return caught.value

    return faults


def rows_of(*cells: str) -> str:
    """Rows of two cells each, without addresses."""
    return "".join(f"<row>{one}{two}</row>" for one, two in zip(cells[::2], cells[1::2], strict=True))


HEADER = ('<c t="inlineStr"><is><t>s_mm</t></is></c>', '<c t="str"><v>depth_mm</v></c>')


def test_numbers_are_read_as_they_are_stored(read):
    assert read().s_mm.tolist() == [0, 5, 10]
    assert read().repeats_mm[0].tolist() == [-1.5, -1.6]
    assert read().dialect == (
        "XLSX, sheet 'Sheet'; wide, 2 repeats; depth downward in mm from the sample surface; 1 reading missing"
    )


@pytest.mark.parametrize(
    "changes",
    [
        {"B2": "1,5", "C2": "k.A."},
        # SAP and LIMS write a line's end as _x000D_.
        {"A1": "s_mm_x000D_", "B1": "Tiefe 1_x000D__x000A_[mm]"},
        {"B2": '0.00" mm days"', "B3": "[Red]0.0;-0.0", "B4": "0.0E+00"},
        # Writers store the word of their language, whose d, m, s and y openpyxl takes for those of a date.
        *({"B2": general, "B3": general, "B4": general} for general in ("Standard", "Est\u00e1ndar", "Standaard")),
    ],
    ids=["numbers kept as text", "control characters", "formats of numbers", "Standard", "Estándar", "Standaard"],
)
def test_what_programs_add_to_cells_changes_nothing(first, read, request, changes):
    formats = not request.node.callspec.id.startswith(("numbers", "control"))
    for cell, value in changes.items():
        setattr(first[cell], "number_format" if formats else "value", value)
    assert read().s_mm.tolist() == [0, 5, 10]
    assert read().repeats_mm[:, 0].tolist() == [-1.5, -2, -2.5]


def test_all_cells_that_are_no_numbers_are_named_at_once(first, refused):
    for cell, value in {"B2": "=C2-0.1", "C2": datetime.date(2026, 1, 16), "B3": "#DIV/0!", "C3": True}.items():
        first[cell] = value
    first["A4"], first["C4"] = 16.5, "tief"
    first["A4"].number_format = "DD.MM.YYYY"
    faults = refused()
    (date,) = [str(fault) for fault in faults.faults if (fault.place.row, fault.place.column) == (2, 2)]
    assert "cell C2" in date
    assert "'2026-01-16' is a date" in date
    words = "1 formula without a stored result, B2|cell B3|'#DIV/0!' is an error|cell C3|'TRUE' is not a number|cell A4"
    assert [each for each in (words + "|'1900-01-16 12:00'").split("|") if each not in str(faults)] == []
    assert len(faults.faults) == 6


def refill(sheet: Worksheet, *rows: list, row: int = 1, column: int = 1) -> None:
    sheet.delete_rows(1, 9)
    for down, cells in enumerate(rows, start=row):
        for across, value in enumerate(cells, start=column):
            sheet.cell(down, across, value)


def test_merged_cells_are_named(first, read, refused):
    first.merge_cells("B3:C3")
    (fault,) = refused().faults
    assert "cells B3 to C3 are merged" in fault.finding
    first.unmerge_cells("B3:C3")
    refill(first, ["Probe 7, Messung vom 3. April"], *ROWS)
    first.merge_cells("A1:C1")
    assert len(read().s_mm) == 3


@pytest.mark.parametrize("columns", [None, {"s": "A", "levels": ["C"]}, {"s": "A", "levels": ["C"], "repeat": "B"}])
def test_merged_places_have_their_rows_as_repeats(first, read, columns):
    rows = [[s_mm if one == 1 else None, one, s_mm + one / 10] for s_mm in (0, 5) for one in (1, 2, 3)]
    refill(first, ["S12 joint"], [], ["Station (mm)", "Run", "Depth below surface"], [None, None, "mm"], *rows)
    for span in ("A1:C1", "A3:A4", "B3:B4", "A5:A7", "A8:A10"):
        first.merge_cells(span)
    sheet = read(columns=None if columns is None else Columns.model_validate_json(json.dumps(columns)))
    assert sheet.s_mm.tolist() == [0, 5]
    assert sheet.repeats_mm.tolist() == [[-0.1, -0.2, -0.3], [-5.1, -5.2, -5.3]]


def test_one_name_over_two_units_is_no_name_of_repeats(first, refused):
    refill(first, ["Station (mm)", "Depth below surface", None], [None, "mm", "in"], [0, 2.54, 0.1], [5, 5.08, 0.2])
    first.merge_cells("B1:C1")
    assert "one name of columns in different units" in str(refused())


def test_a_merged_name_with_unknown_words_is_asked_about_and_keeps_its_unit(first, read, refused):
    refill(first, ["Ort", "Einsinkung [mm]"], [None, "Messung 1", "Messung 2"], *ROWS[1:])
    first.merge_cells("B1:C1")
    assert "B 'Einsinkung [mm] Messung 1' (1.5), C 'Einsinkung [mm] Messung 2'" in str(refused())
    declared = Columns(levels=("B:C",), sign="down", s="A")
    assert "'Ort': no unit" in str(refused(columns=declared))
    first["A1"] = "Ort [mm]"
    assert read(columns=declared).repeats_mm[0].tolist() == [-1.5, -1.6]


def test_several_sheets_are_named_and_one_is_asked_for(book, read, refused):
    """Empty ones are no choice."""
    book.create_sheet("Tabelle2")
    assert len(read().s_mm) == 3
    refill(book.create_sheet("<b>Riss $2$"), *ROWS)
    message = str(refused())
    assert "2 sheets have content: 'Sheet', '<b>Riss $2$'" in message
    assert "[readings] sheet" in message
    assert "sheet '<b>Riss $2$'" in read(sheet="<b>Riss $2$").dialect
    assert "no sheet 'riss'" in str(refused(sheet="riss"))


def test_hidden_sheets_are_not_read_unless_they_are_named(book, first, read):
    other = book.create_sheet("Rechnung")
    other.append(["Summe", 7])
    other.sheet_state = "veryHidden"
    assert read().dialect.endswith("1 hidden sheet ignored")
    first.sheet_state, other.sheet_state = "hidden", "visible"
    assert read(sheet="Sheet").dialect.endswith("this sheet is hidden")


ENTITY = '<!DOCTYPE a [<!ENTITY x "s_mm"><!ENTITY y "&x;&x;">]>'
PHONETIC = '<c t="inlineStr"><is><r><t>depth</t></r><r><t>_mm</t></r><rPh sb="0" eb="1"><t>no</t></rPh></is></c>'


@pytest.mark.parametrize(
    ("header", "cells"),
    [
        (HEADER, ("<v>0</v>", "<f>1+0.5</f><v>1.5</v>", "<v>5</v>", "<v>2E0</v>")),
        ((HEADER[0], PHONETIC), ("<v>0</v>", "<v>1.5</v>", "<v>5</v>", "<v>2</v>")),
        (HEADER, ("<v>-1</v>", "EMPTY", "<v>0</v>", "<v>1.5</v>", "<v>5</v>", "<v>2</v>")),
    ],
    ids=["stored results of formulas", "phonetic guides are no text", "an empty text is a missing reading"],
)
def test_cells_of_other_programs_are_read(tmp_path, header, cells):
    written = [f"<c>{cell}</c>".replace("<c>EMPTY", '<c t="str"><f>""</f><v></v>') for cell in cells]
    profile = read_readings(rewritten(tmp_path / "a.xlsx", sheet=rows_of(*header, *written)), Declared())
    assert (profile.s_mm.tolist(), profile.level_mm.tolist()) == ([0, 5], [-1.5, -2])


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


def test_other_files_are_named(tmp_path):
    (tmp_path / "a.xlsx").write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600))
    with zipfile.ZipFile(tmp_path / "a.ods", "w") as archive:
        archive.writestr("content.xml", "<x/>")
    for name, words in {"a.xlsx": "an old Excel workbook", "a.ods": "a zip file, but not an XLSX"}.items():
        with pytest.raises(InputError, match=words):
            read_cells(tmp_path / name, Declared())


@pytest.mark.parametrize(
    ("sheet", "words"),
    [
        # Nested entities of a few kilobytes are gigabytes of text; the standard library expands them.
        (ENTITY + rows_of("<c><v>&y;</v></c>", HEADER[1]), "Entities"),
        (rows_of(*HEADER, "<c><v>1E999</v></c>", "<c><v>1</v></c>"), r"cell A2 .s_mm.: 'inf'"),
        (rows_of("<c><v>deep</v></c>", HEADER[1]), None),
        (rows_of(*HEADER, "<c><v>NaN</v></c>", "<c><v>1</v></c>"), None),
        (rows_of('<c t="s"><v>7</v></c>', HEADER[1]), None),
        (rows_of('<c r="1A"><v>7</v></c>', HEADER[1]), None),
        (f'<c t="inlineStr"><is><t>{"x" * workbook.LARGEST_UNPACKED_BYTES}</t></is></c>', "MB when it is unpacked"),
        ("<row><c><v>7</v></c></row>" * 10_001, "more than 10000 rows"),
        (rows_of('<c r="XFD1"><v>7</v></c>', '<c r="A1"><v>1</v></c>'), "more than 256 columns"),
    ],
    ids=["entities", "infinity", "a word", "no number", "a string", "an address", "a bomb", "rows", "columns"],
)
def test_damaged_and_vast_worksheets_are_refused_by_file(tmp_path, sheet, words):
    prolog, sheet = (ENTITY, sheet.removeprefix(ENTITY)) if sheet.startswith(ENTITY) else ("", sheet)
    with pytest.raises(SheetFaults, match=words) as caught:
        read_readings(rewritten(tmp_path / "a.xlsx", sheet=sheet, prolog=prolog), Declared())
    assert caught.value.faults[0].place.path == tmp_path / "a.xlsx"


def test_what_openpyxl_leaves_out_is_no_warning(first, refused, recwarn):
    """The library warns of a date beyond the calendar, whose cell is then an error."""
    first["B2"] = 1e9
    first["B2"].number_format = "DD.MM.YYYY"
    assert "cell B2" in str(refused())
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
