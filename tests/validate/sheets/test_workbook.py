"""Sheets in workbooks: which sheet, and every cell that is no plain number. Workbooks are openpyxl's, or by hand."""

import datetime
import zipfile
from pathlib import Path

import openpyxl
import pytest
from openpyxl.worksheet.worksheet import Worksheet

from sealtwin.errors import InputError
from validate.settings import Declared
from validate.sheets import workbook_archive
from validate.sheets.cells import read_cells
from validate.sheets.faults import SheetFaults
from validate.sheets.sheet import Sheet, read_sheet

ROWS = [["s [mm]", "Tiefe 1 [mm]", "Tiefe 2 [mm]"], [0, 1.5, 1.6], [5, 2, None], [10, 2.5, 2.6]]
MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
STRICT = "http://purl.oclc.org/ooxml/spreadsheetml/main"


@pytest.fixture
def book() -> openpyxl.Workbook:
    book = openpyxl.Workbook()
    for row in ROWS:
        book.worksheets[0].append(row)
    return book


@pytest.fixture
def read(tmp_path):
    def saved(book: openpyxl.Workbook, **declared) -> Sheet:
        book.save(tmp_path / "lab.xlsx")
        return read_sheet(tmp_path / "lab.xlsx", Declared(**declared))

    return saved


def first(book: openpyxl.Workbook) -> Worksheet:
    sheet = book.worksheets[0]
    assert isinstance(sheet, Worksheet)
    return sheet


def faults_of(read, book, **declared) -> SheetFaults:
    with pytest.raises(SheetFaults) as caught:
        read(book, **declared)
    return caught.value


def by_hand(path: Path, sheet: str, *, namespace: str = MAIN, **others: str | bytes) -> Path:
    """The least that is an XLSX."""
    relation = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    parts = {
        "xl/workbook.xml": f'<workbook xmlns="{namespace}" xmlns:r="{relation}"><sheets>'
        '<sheet name="A" sheetId="1" r:id="r1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships><Relationship Id="r1" Type="{relation}/worksheet" '
        f'Target="worksheets/a.xml"/><Relationship Id="r2" Type="{relation}/styles" Target="/xl/styles.xml"/>'
        "</Relationships>",
        "xl/styles.xml": f'<styleSheet xmlns="{namespace}"/>',
        "xl/worksheets/a.xml": sheet,
        **{name.replace("__", "/").replace("_xml", ".xml"): text for name, text in others.items()},
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in parts.items():
            archive.writestr(name, text)
    return path


def hand_sheet(*cells: str, prefix: str = "") -> str:
    """Rows of two cells each, without addresses."""
    rows = "".join(f"<{prefix}row>{one}{two}</{prefix}row>" for one, two in zip(cells[::2], cells[1::2], strict=True))
    names = f'xmlns{":" + prefix[:-1] if prefix else ""}="{STRICT if prefix else MAIN}"'
    return f"<{prefix}worksheet {names}><{prefix}sheetData>{rows}</{prefix}sheetData></{prefix}worksheet>"


HEADER = ('<c t="inlineStr"><is><t>s_mm</t></is></c>', '<c t="str"><v>depth_mm</v></c>')


def test_numbers_are_read_as_they_are_stored(book, read):
    sheet = read(book)
    assert sheet.s_mm.tolist() == [0, 5, 10]
    assert sheet.repeats_mm[0].tolist() == [1.5, 1.6]
    assert sheet.dialect.sentence == (
        "XLSX, sheet 'Sheet'; wide, 2 repeats; depth downward in mm from the sample surface; 1 reading missing"
    )


def test_numbers_kept_as_text_are_read_with_their_own_mark(book, read):
    first(book)["B2"], first(book)["C2"] = "1,5", "k.A."
    assert read(book).repeats_mm[0, 0] == 1.5


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
    assert "cell B2 (Tiefe 1 [mm])" in found[1]
    assert "result is not stored" in found[1]
    assert "cell C2" in found[2]
    assert "'2026-01-16' is a date" in found[2]
    others = str(faults_of(read, book))
    for words in (
        "cell B3",
        "'#DIV/0!' is an error",
        "cell C3",
        "'TRUE' is no number",
        "cell A4",
        "'1900-01-15 12:00'",
    ):
        assert words in others
    assert len(faults_of(read, book).faults) == 6


def test_formats_of_numbers_are_no_dates(book, read):
    for cell, form in zip(("B2", "B3", "B4"), ('0.00" mm days"', "[Red]0.0;-0.0", "0.0E+00"), strict=True):
        first(book)[cell].number_format = form
    assert read(book).repeats_mm[:, 0].tolist() == [1.5, 2, 2.5]


def test_merged_cells_are_named(book, read):
    first(book).merge_cells("B3:C3")
    (fault,) = faults_of(read, book).faults
    assert "cells B3 to C3 are merged" in fault.found
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
    assert read(book).repeats_mm[0].tolist() == [1.5, 1.6]
    sheet["C2"] = None
    message = str(faults_of(read, book))
    assert "cell C3: 1.6 stands in a column without a name" in message.replace("'", "")


def test_empty_sheets_are_no_choice(book, read):
    book.create_sheet("Tabelle2")
    assert len(read(book).s_mm) == 3


def test_several_sheets_are_named_and_one_is_asked_for(book, read):
    other = book.create_sheet("<b>Riss $2$")
    for row in ROWS:
        other.append(row)
    message = str(faults_of(read, book))
    assert "2 sheets hold something: 'Sheet', '<b>Riss $2$'" in message
    assert "[readings] sheet" in message
    assert "sheet '<b>Riss $2$'" in read(book, sheet="<b>Riss $2$").dialect.sentence
    assert "no sheet 'riss'" in str(faults_of(read, book, sheet="riss"))


def test_hidden_sheets_are_not_read_unless_they_are_named(book, read):
    other = book.create_sheet("Rechnung")
    other.append(["Summe", 7])
    other.sheet_state = "veryHidden"
    assert read(book).dialect.sentence.endswith("1 hidden sheet not read")
    book.worksheets[0].sheet_state, other.sheet_state = "hidden", "visible"
    assert read(book, sheet="Sheet").dialect.sentence.endswith("this sheet is hidden")


def test_hidden_rows_are_read_and_said(book, read):
    first(book).row_dimensions[3].hidden = True
    first(book).column_dimensions["C"].hidden = True
    sheet = read(book)
    assert len(sheet.s_mm) == 3
    assert "1 hidden row and 1 hidden column are read too" in sheet.dialect.sentence


def test_a_table_may_stand_anywhere(read):
    book = openpyxl.Workbook()
    sheet = first(book)
    sheet["C2"] = "Probe 7"
    for row, cells in enumerate(ROWS, start=5):
        for column, value in enumerate(cells, start=4):
            sheet.cell(row + (row > 5), column, value)
    assert read(book).repeats_mm[0].tolist() == [1.5, 1.6]


def test_stored_results_of_formulas_are_read(tmp_path):
    path = by_hand(
        tmp_path / "a.xlsx",
        hand_sheet(*HEADER, "<c><v>0</v></c>", "<c><f>1+0.5</f><v>1.5</v></c>", "<c><v>5</v></c>", "<c><v>2E0</v></c>"),
    )
    assert read_sheet(path, Declared()).repeats_mm[:, 0].tolist() == [1.5, 2]


def test_an_empty_text_of_a_formula_is_a_missing_reading(tmp_path):
    rows = ("<c><v>0</v></c>", '<c t="str"><f>""</f><v></v></c>', "<c><v>5</v></c>", "<c><v>2</v></c>")
    path = by_hand(tmp_path / "a.xlsx", hand_sheet(*HEADER, *rows, "<c><v>9</v></c>", "<c><v>2</v></c>"))
    assert read_sheet(path, Declared()).s_mm.tolist() == [5, 9]


def test_other_programs_namespaces_prefixes_and_spoken_texts_change_nothing(tmp_path):
    header = (
        '<x:c t="s"><x:v>0</x:v></x:c>',
        '<x:c t="inlineStr"><x:is><x:r><x:t>depth</x:t></x:r><x:r><x:t>_mm</x:t></x:r>'
        "<x:rPh><x:t>no</x:t></x:rPh></x:is></x:c>",
    )
    numbers = [f"<x:c><x:v>{value}</x:v></x:c>" for value in (0, 1.5, 5, 2)]
    strings = f'<sst xmlns="{STRICT}"><si><t>s_</t><rPh><t>es</t></rPh><r><t>mm</t></r></si></sst>'
    path = by_hand(tmp_path / "a.xlsx", hand_sheet(*header, *numbers, prefix="x:"), xl__strings_xml=strings)
    relations = "xl/_rels/workbook.xml.rels"
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name).decode() for name in archive.namelist()}
    parts[relations] = parts[relations].replace(
        "</Relationships>", '<Relationship Id="r3" Type="x/sharedStrings" Target="strings.xml"/></Relationships>'
    )
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in parts.items():
            archive.writestr(name, text)
    assert read_sheet(path, Declared()).repeats_mm[:, 0].tolist() == [1.5, 2]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "an old Excel workbook"),
        (b"PK\x03\x04 and nothing else", "damaged"),
    ],
)
def test_files_of_other_programs_are_named(tmp_path, content, words):
    (tmp_path / "a.xlsx").write_bytes(content)
    with pytest.raises(InputError, match=words):
        read_cells(tmp_path / "a.xlsx", Declared())


def test_another_zip_is_no_workbook(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.ods", "w") as archive:
        archive.writestr("content.xml", "<x/>")
    with pytest.raises(InputError, match="another program's format"):
        read_cells(tmp_path / "a.ods", Declared())


@pytest.mark.parametrize(
    ("sheet", "words"),
    [
        ("<!DOCTYPE a [<!ENTITY x 'y'>]>" + hand_sheet(*HEADER), "declares entities"),
        (hand_sheet("<c><v>&x;</v></c>", HEADER[1]), "damaged"),
        (hand_sheet("<c><v>deep</v></c>", HEADER[1]), "'deep' stands where a number is stored"),
        (hand_sheet('<c t="s"><v>7</v></c>', HEADER[1]), "'7' stands where a number up to"),
        (hand_sheet('<c r="ABCD1"><v>7</v></c>', HEADER[1]), "'ABCD1' is no cell's address"),
        (
            hand_sheet(f'<c t="inlineStr"><is><t>{"x" * workbook_archive.LARGEST_PART}</t></is></c>', HEADER[1]),
            "unpacks to more",
        ),
        (hand_sheet(*["<c><v>7</v></c>"] * 24_000), "more rows than the 10000"),
        (hand_sheet('<c r="XFD1"><v>7</v></c>', '<c r="A1"><v>1</v></c>'), "only the first 256 columns"),
    ],
    ids=["entities", "an entity", "a word", "a string", "an address", "a bomb", "rows", "columns"],
)
def test_hostile_workbooks_are_refused_by_name(tmp_path, sheet, words):
    with pytest.raises(SheetFaults, match=words):
        read_cells(by_hand(tmp_path / "a.xlsx", sheet), Declared())


def test_many_sheets_together_are_bounded(tmp_path, book, read, monkeypatch):
    monkeypatch.setattr(workbook_archive, "LARGEST_PARTS", 2_000)
    assert "unpack to more than 0.002 MB together" in str(faults_of(read, book))


def test_an_archive_that_lies_about_its_sizes_is_damaged(tmp_path):
    """The directory says a byte; more is never unpacked."""
    path = by_hand(tmp_path / "a.xlsx", hand_sheet(*HEADER))
    content = bytearray(path.read_bytes())
    at = content.rfind(b"xl/worksheets/a.xml") - 46
    assert content[at : at + 4] == b"PK\x01\x02"
    content[at + 24 : at + 28] = (1).to_bytes(4, "little")
    path.write_bytes(content)
    with pytest.raises(SheetFaults, match="damaged"):
        read_cells(path, Declared())


def test_an_archive_whose_parts_begin_before_it_is_damaged(tmp_path):
    """The standard library's reader then seeks to before the file, and older ones do not call that a bad archive."""
    path = by_hand(tmp_path / "a.xlsx", hand_sheet(*HEADER))
    content = bytearray(path.read_bytes())
    content[-6:-2] = (1 << 30).to_bytes(4, "little")
    path.write_bytes(content)
    with pytest.raises(SheetFaults, match="damaged"):
        read_cells(path, Declared())


@pytest.mark.parametrize("word", ["NaN", "nan", "inf", "-INF"])
def test_what_is_stored_as_no_finite_number_is_none(tmp_path, word):
    """No program writes it; as a place it would be outside any crack by a comparison that means nothing."""
    path = by_hand(tmp_path / "a.xlsx", hand_sheet(*HEADER, f"<c><v>{word}</v></c>", "<c><v>1</v></c>"))
    with pytest.raises(SheetFaults, match=f"cell A2 .s_mm.: '{word}' is no number in mm"):
        read_sheet(path, Declared())
