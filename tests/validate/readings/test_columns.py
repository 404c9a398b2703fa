"""Columns that are declared, headers of several rows, and rows that are no readings: read, or asked about."""

import json

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile
from validate.readings.read_readings import read_readings
from validate.readings.sheet import SheetFaults, column_of, letters
from validate.settings import Columns, Declared

WIDE = "Ort;x1;x2;x3\n0;1,5;1,6;9\n5;2;2,1;9\n"


@pytest.fixture
def read(tmp_path):
    def from_text(text: str, columns: dict | None = None, **declared) -> Profile:
        path = tmp_path / "lab.csv"
        path.write_text(text, encoding="utf-8")
        said = Columns.model_validate_json(json.dumps(columns)) if columns else None
        return read_readings(path, Declared(columns=said, **declared))

    return from_text


@pytest.mark.parametrize(
    "columns",
    [
        {"s": "Ort", "levels": ["x1", "x2"]},
        {"s": "A", "levels": ["B", "C"]},
        {"s": "ort", "levels": ["B:C"]},
        {"levels": ["X1", "C"]},
    ],
)
def test_columns_are_declared_by_name_or_letter(read, columns):
    sheet = read(WIDE, columns, unit="mm", quantity="depth")
    assert sheet.repeats_mm is not None
    assert sheet.repeats_mm.tolist() == [[-1.5, -1.6], [-2.0, -2.1]]
    assert [column.role for column in sheet.columns] == ["s", "depth downward, 1", "depth downward, 2", "not read"]


def test_words_of_declared_columns_state_their_direction(read):
    text = "x;Tiefe Mai;Tiefe Juni\n0;1;2\n5;3;4\n"
    assert read(text, {"s": "A", "levels": ["B", "C"]}, unit="mm").level_mm.tolist() == [-1.5, -3.5]
    with pytest.raises(SheetFaults, match="upward or downward"):
        read(text.replace("Tiefe Mai", "Tiefe von oben Mai"), {"s": "A", "levels": ["B"]}, unit="mm")


def test_a_letter_that_is_another_columns_name_is_not_guessed(read):
    text = "Stelle;A;b\n0;1;2\n5;3;4\n"
    with pytest.raises(SheetFaults, match="both a letter and another's name"):
        read(text, {"s": "A", "levels": ["B", "C"]}, unit="mm", quantity="level")
    sheet = read(text, {"s": "A:A", "levels": ["B"]}, unit="mm", quantity="level")
    assert sheet.level_mm.tolist() == [1, 3]


def test_what_columns_say_of_the_sheet_is_said_of_the_readings(read):
    columns = {"levels": ["B"], "unit": "cm", "sign": "down", "datum": "caliper_base", "datum_level_mm": 4.0}
    assert read(WIDE, columns).level_mm.tolist() == [-11.0, -16.0]
    with pytest.raises(InputError, match="columns gives"):
        Declared(unit="mm", columns=Columns(unit="cm"))


def test_a_sheet_without_a_header_is_read_by_letters(read):
    sheet = read("0;1,5\n5;2\n", {"s": "A", "levels": ["B"]}, unit="mm", quantity="depth")
    assert sheet.level_mm.tolist() == [-1.5, -2.0]
    titled = read("Riss 4\n\nx;y\n0;1,5\n5;2\n", {"s": "A", "levels": ["B"]}, unit="mm", quantity="depth")
    assert titled.level_mm.tolist() == [-1.5, -2.0]


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("s_mm,depth_mm\n0,1\n5,2\n9,7\n", {"skip": [4]}),
        ("s_mm,depth_mm\n0,1\n5,2\nSoll,7\n", {"skip": ["Soll"]}),
        ("s_mm,depth_mm\n0,1\n5,2\n9,7\n", {"range": "A1:B3"}),
        ("s_mm,depth_mm,,s_mm,depth_mm\n0,1,,0,5\n5,2,,5,6\n", {"range": "A:B"}),
        ("u,v\na,b\n0,1\n5,2\n", {"header_rows": 2, "s": "A", "levels": ["B"], "unit": "mm", "sign": "down"}),
    ],
)
def test_rows_and_columns_are_left_out_on_request(read, text, columns):
    assert read(text, columns).level_mm.tolist() == [-1, -2]


def test_a_header_of_two_rows_spans_its_columns(read):
    sheet = read("Abstand [mm];Tiefe unter Oberkante [mm];;\n;1. Messung;2. Messung;Mittelwert\n0;1;2;1,5\n5;3;4;3,5\n")
    assert sheet.repeats_mm is not None
    assert sheet.repeats_mm.tolist() == [[-1, -2], [-3, -4]]
    assert [(column.place, column.role) for column in sheet.columns][-1] == ("D", "not read")


@pytest.mark.parametrize("below", ["Messung 1", "1"])
def test_a_single_reading_may_have_a_second_header_row_too(read, below):
    assert read(f"Riss 4;\ns [mm];Tiefe [mm]\n;{below}\n0;4\n5;4\n").s_mm.tolist() == [0, 5]


def test_numbers_of_repeats_are_a_second_header_row_and_no_station(read):
    assert read("s [mm];Tiefe [mm];;\n;1;2;3\n0;4;5;6\n5;4;5;6\n").s_mm.tolist() == [0, 5]
    assert read("s [mm];Tiefe 1 [mm];Tiefe 2 [mm]\n1;2;3\n5;4;5\n").s_mm.tolist() == [1, 5]


def test_rows_that_hold_no_readings_are_passed_over_and_named(read):
    sheet = read(
        "s_mm;depth_1_mm;depth_2_mm\n# abends gemessen\n0;1;n. m.\n5;2;2\nMittelwert;1,5;2\nStabw.;0,5;0\nMüller;;\n"
    )
    assert sheet.s_mm.tolist() == [0, 5]
    passed = {column.place: column.name for column in sheet.columns if column.role == "row, not read"}
    assert passed == {"2": "# abends gemessen", "5": "Mittelwert", "6": "Stabw.", "7": "Müller"}


def test_a_row_that_somebody_has_taken_out_is_asked_about(read):
    with pytest.raises(SheetFaults, match="'#9' is not a number"):
        read("s_mm;depth_1_mm;depth_2_mm\n0;1;1\n5;2;2\n#9;7;7\n")
    assert read("Nr.;s_mm;depth_mm\n#1;0;1\n#2;5;2\n").s_mm.tolist() == [0, 5]


@pytest.mark.parametrize(
    ("zero", "asked"),
    [("Nullpunkt: Probenoberfläche", False), ("Nullpunkt: Oberkante Messschieber", True), ("zeroed on the base", True)],
)
def test_a_remark_on_another_zero_is_asked_about(read, zero, asked):
    text = f"# {zero}\ns_mm;depth_mm\n0;1\n5;2\n9;2\n"
    assert any('["datum"]' in doubt for doubt in read(text).doubts) == asked
    assert not read(text, as_written=("datum",)).doubts
    assert not read(text, datum="caliper_base", datum_level_mm=1.0).doubts


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("s_mm,depth_mm,,s_mm,depth_mm\n0,1,,0,5\n5,2,,5,6\n", 'range = "A:B"'),
        ("s_mm;depth_mm\n0;1\n5;2\n\nRiss 2\ns_mm;depth_mm\n0;3\n5;4\n", 'range = "1:5" or "6:8"'),
        ("s_mm;depth_mm\n0;1\n5;2\nzurück\n2;3\n4;4\n", "a second table begins in row 5"),
        ("s_mm;depth_mm;z\n0;1;7\n5;2;8\n", "'z' has an unknown name and contains numbers"),
        ("s_mm;depth_mm;\n0;1;7\n5;2;8\n", "column C contains numbers and has no name"),
    ],
)
def test_what_may_be_another_table_is_asked_about(read, text, words):
    with pytest.raises(SheetFaults) as caught:
        read(text)
    assert words in str(caught.value)


@pytest.mark.parametrize("above", ["Datum: 3.5.2026;;\n", "Datum;3.5.2026;\n", "03.05.2026;;\n", ";;\n3. 5. 2026\n"])
def test_a_line_with_a_date_is_no_part_of_the_header(read, above):
    """It was once joined to names that nobody knows, and they could not be told apart."""
    with pytest.raises(SheetFaults, match="A 'wo' \\(0\\), B 'a' \\(1\\), C 'b' \\(2\\)"):
        read(f"{above}wo;a;b\n0;1;2\n5;2;3\n")
    assert read(f"{above}s;Tiefe 1;Tiefe 2\nmm;mm;mm\n0;1;2\n5;2;3\n").level_mm.tolist() == [-1.5, -2.5]


def test_a_row_of_units_may_hold_units_of_other_quantities(read):
    assert read("s;Tiefe;Temp.\nmm;mm;[°C]\n0;1;20\n5;2;21\n").level_mm.tolist() == [-1, -2]
    with pytest.raises(SheetFaults, match="'µm', below 'Tiefe 2', is not a supported unit of length"):
        read("s;Tiefe 1;Tiefe 2\nmm;mm;µm\n0;1;2000\n5;2;2000\n")


def test_numbers_of_repeats_may_stand_beside_the_unit_of_places(read):
    sheet = read("Ort;Tiefe [mm];;\n[mm];1;2;3\n0;1,5;1,6;1,7\n5;2;2,1;2,2\n")
    assert sheet.repeats_mm is not None
    assert sheet.repeats_mm.tolist() == [[-1.5, -1.6, -1.7], [-2.0, -2.1, -2.2]]


def test_what_is_to_be_skipped_and_is_nowhere_is_said(read):
    sheet = read("s_mm;depth_mm\n0;1\n5;2\n", {"skip": ["Soll", 9]})
    assert [(column.name, column.role) for column in sheet.columns[2:]] == [
        ("Soll", "skip: no such row"),
        ("9", "skip: no such row"),
    ]


def test_another_quantity_beside_a_blank_column_is_no_reading(read):
    sheet = read("s_mm;depth_mm;;min;Ofen\n0;1;;0;20\n5;2;;10;21\n")
    assert sheet.level_mm.tolist() == [-1, -2]
    assert [column.name for column in sheet.columns if column.role == "not read"] == ["min", "Ofen"]


def test_units_behind_all_numbers_of_a_column_are_its_unit(read):
    assert read("Position;depth\n0 mm;1,5 cm\n5 mm;2 cm\n").level_mm.tolist() == [-15, -20]


@given(st.integers(0, 20_000))
@settings(max_examples=50, deadline=None)
def test_letters_and_numbers_of_columns_are_one(column):
    assert column_of(letters(column)) == column


CELLS = st.sampled_from(
    ["", "s_mm", "depth_mm", "0", "5", "1,5", "n. m.", "Mittel", "# x", "Riss 2", "1 mm", "7.5", "x"]
)


@given(st.lists(st.lists(CELLS, min_size=1, max_size=5), min_size=1, max_size=9), st.sampled_from([None, *"ABC"]))
@example(
    [["s_mm"], ["depth_mm", "depth_mm"]], "A"
)  # A letter beyond the rows of a turned sheet once ended in an IndexError
@settings(max_examples=200, deadline=None)
def test_any_table_is_read_or_asked_about(tmp_path_factory, rows, letter):
    """No arrangement of cells raises anything else, and every station that is read stands in the sheet."""
    path = tmp_path_factory.mktemp("any") / "lab.csv"
    path.write_text("\n".join(";".join(row) for row in rows), encoding="utf-8")
    columns = None if letter is None else Columns(s=letter, levels=("B:C",))
    try:
        sheet = read_readings(path, Declared(columns=columns, unit="mm", quantity="depth"))
    except SheetFaults:
        return
    written = {cell.removesuffix(" mm").replace(",", ".") for row in rows for cell in row}
    assert {f"{s:g}" for s in sheet.s_mm} <= {f"{float(cell):g}" for cell in written if cell[:1].isdigit()}


def test_stations_in_a_row_are_turned_and_faults_keep_their_places(read):
    text = "Probe 2;;;\nPosition mm;0;5;9\nTiefe 1;1,5;{};2,5\nTiefe 2;1,6;2,1;2,6\n"
    sheet = read(text.format("2,0"), unit="mm")
    assert sheet.repeats_mm is not None
    assert sheet.repeats_mm.tolist() == [[-1.5, -1.6], [-2.0, -2.1], [-2.5, -2.6]]
    assert "stations in a row" in sheet.dialect
    assert [(column.place, column.role) for column in sheet.columns[1:4]] == [
        ("row 2", "s"),
        ("row 3", "depth downward, 1"),
        ("row 4", "depth downward, 2"),
    ]
    with pytest.raises(SheetFaults) as caught:
        read(text.format("tief"), unit="mm")
    (fault,) = caught.value.faults
    assert (fault.place.row, fault.place.column, fault.value) == (3, 2, "tief")
    plain = read("x;0;5\ny;1;2\n", {"transposed": True, "s": "A", "levels": ["B"]}, unit="mm", quantity="depth")
    assert plain.level_mm.tolist() == [-1, -2]
