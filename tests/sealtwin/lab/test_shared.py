"""One file of readings for several samples: each gets its own part, shown in the pairing and corrected there."""

import csv
import re

import openpyxl
import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.errors import InputError
from sealtwin.lab.ingest import ingest
from tests.labs import QUIET, answer, edit, fates, levels_mm, pairing_rows
from tests.open_document import write_ods

TABLE = "Probe;s [mm];Pegel 1 [mm]\nP01;1;-1,0\np-02;1;-2,0\nP01;11;-1,5\np-02;11;-2,5\n"


@pytest.fixture
def shared(small):
    """Two samples, and one table of readings of both."""
    for sheet in ("P01.csv", "P02_Messung.csv"):
        (small / sheet).unlink()
    (small / "caliper_all.csv").write_text(TABLE)
    return small


def test_rows_go_to_the_samples_that_they_name(shared, tmp_path):
    """In another folder than its photos a table once left its samples sound without readings."""
    name = "Carnet/mesures mai.csv"
    lab, table = tmp_path / "lab", shared / name
    table.parent.mkdir()
    (shared / "caliper_all.csv").rename(table)
    ingested = ingest(shared, lab, QUIET)
    assert fates(ingested) == {"P01": "new", "P02": "new"}
    assert levels_mm(lab, "P01") == [-1.0, -1.5]
    assert levels_mm(lab, "P02") == [-2.0, -2.5]
    assert f"{name}, rows of p-02" in "\n".join(ingest_answer(ingested).lines)
    assert (lab / "P02" / "inputs" / "readings.csv").read_bytes() == table.read_bytes()
    # What is added for one sample revises no other.
    table.write_text(TABLE + "P02;5;-2,2\n")
    assert fates(ingest(shared, lab, QUIET)) == {"P01": "unchanged", "P02": "revised"}
    assert levels_mm(lab, "P02@2") == [-2.0, -2.2, -2.5]


def test_a_pairing_without_parts_is_about_all_of_a_file(shared, tmp_path):
    """As one that was written by hand, or before a file was shared."""
    pairing = tmp_path / "mine.csv"
    pairing.write_text("file;role;sample\ncaliper_all.csv;ignore;\n")
    ingested = ingest(shared, tmp_path / "lab", QUIET, pairing=pairing)
    assert [dict(outcome.sample.files).get("readings") for outcome in ingested.outcomes] == [None, None]
    pairing.write_text(
        "file;role;sample;part\ncaliper_all.csv;readings;P01;rows of P07\ncaliper_all.csv;note;P01;rows of P01\n"
    )
    with pytest.raises(InputError) as refusal:
        ingest(shared, tmp_path / "other", QUIET, pairing=pairing)
    part, role = str(refusal.value).splitlines()
    assert "no part 'rows of P07'; its parts are 'rows of P01', 'rows of p-02'" in part
    assert "caliper_all.csv, rows of P01 cannot be 'note'; write one of readings, ignore." in role


def test_a_file_whose_name_and_rows_contradict_each_other_is_named(shared, tmp_path):
    (shared / "caliper_all.csv").write_text(TABLE.replace("p-02", "P01"))
    (shared / "caliper_all.csv").rename(shared / "P02.csv")
    fates = {outcome.sample.name: outcome for outcome in ingest(shared, tmp_path / "lab", QUIET).outcomes}
    assert fates["P02"].fate == "failed"
    assert "no row of sample 'P02'; column 'Probe' contains 'P01'" in fates["P02"].faults[0]


def _workbook(path, sheets):
    """Worksheets in the place of the shared table, by name."""
    (path.parent / "caliper_all.csv").unlink(missing_ok=True)
    book = openpyxl.Workbook()
    del book["Sheet"]
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)


def test_worksheets_named_after_samples_are_theirs(shared, tmp_path):
    head = "s_mm", "level_mm"
    first, second = (head, (1, -1.0), (11, -1.0)), (head, (1, -2.0), (11, -2.0))
    _workbook(shared / "Messungen Mai.xlsx", {"Sheet": [("Labor 3",)], "p 01": first, "P02 Messung": second})
    ingested = ingest(shared, tmp_path / "lab", QUIET)
    assert fates(ingested) == {"P01": "new", "P02": "new"}
    assert levels_mm(tmp_path / "lab", "P02") == [-2.0, -2.0]
    (sample,) = (outcome.sample for outcome in ingested.outcomes if outcome.sample.name == "P02")
    assert (str(sample.files["readings"]), str(sample.part)) == ("Messungen Mai.xlsx", "sheet P02 Messung")


def test_a_sheet_whose_header_is_unknown_holds_its_sample_back(shared, tmp_path):
    """It is no cover: passed over, its sample would pass for one that never had readings."""
    cover, rows = [("Labor 3", "Mai"), ("Bediener", "J.")], [(1, -1.0), (11, -2.0)]
    first, second = ([cover[1], ("Ort [mm]", header), *rows] for header in ("level_mm", "Füllung [mm]"))
    _workbook(shared / "caliper.xlsx", {"Sheet": cover, "P01": first, "P02": second})
    ingested = ingest(shared, tmp_path / "lab", QUIET)
    assert fates(ingested) == {"P01": "new", "P02": "failed"}
    fault, *_ = ingested.faults
    question = "caliper.xlsx, sheet 'P02', row 2: no column of readings besides 'Ort [mm]' in A 'Ort [mm]' (1), B 'Fül"
    assert question in fault.sentence


def test_a_cover_named_as_its_workbook_divides_nothing(shared, tmp_path):
    rows = ("s_mm", "level_mm"), (1, -1.0), (11, -1.0)
    _workbook(shared / "P02.xlsx", {"P02": [("Labor 3",)], "Messung": rows})
    (shared / "P02_Notiz.toml").write_text('crack.depth_mm = 8.0\nreadings.sheet = "Messung"\n')
    ingested = ingest(shared, tmp_path / "lab", QUIET)
    assert not ingested.faults
    assert levels_mm(tmp_path / "lab", "P02") == [-1.0, -1.0]


HEAD, FIRST, SECOND = "s [mm];Pegel 1 [mm];Pegel 2 [mm]", ("1;-1;-1,1", "11;-1,5;-1,6"), ("1;-2;-2,1", "11;-2,5;-2,6")
BELOW = "\n".join(["Labor 3\n\nProbe P01", HEAD, *FIRST, "Mittel;-1,2;-1,3\n\np-02", HEAD, *SECOND, "12;-2,6;-2,7"])
BESIDE = "\n".join(
    f"{one};;{two}" for one, two in zip(["P01;;", HEAD, *FIRST], ["Probe P02;;", HEAD, *SECOND], strict=True)
)
NAMED = "s [mm];Tiefe P01 [mm];Tiefe P02 [mm]\n1;1;2,1\n11;1,5;2,5\n"
ABOVE = ";P01;;P02;\ns [mm];Tiefe 1 [mm];Tiefe 2 [mm];Tiefe 3 [mm];Tiefe 4 [mm]\n1;1;1,1;2;2,1\n11;1,5;1,6;2,5;2,7\n"


@pytest.mark.parametrize(
    ("file", "text", "parts"),
    [
        ("caliper_all.csv", BELOW, ["A3:C7", "A9:C13"]),
        ("caliper.ods", BESIDE, ["A1:C4", "E1:G4"]),
        (
            "caliper_all.csv",
            BESIDE.replace(";;Probe", ";Probe").replace(";;s", ";s").replace(";;1;", ";1;").replace(";;11", ";11"),
            ["A1:C4", "D1:F4"],
        ),
        ("P01.csv", re.sub(r"(?m)(?<=\d)(?=;|$)(?<!P0\d)", " mm", BELOW), ["A3:C7", "A9:C13"]),
        ("P01.csv", NAMED, ["columns B", "columns C"]),
        ("P01.csv", ABOVE, ["columns B C", "columns D E"]),
    ],
)
def test_tables_and_columns_of_one_sheet_go_to_the_samples_that_they_name(shared, tmp_path, file, text, parts):
    """Repeats of a sheet called P01 were once the columns of both samples."""
    (shared / "caliper_all.csv").unlink()
    if file.endswith("ods"):
        rows = [
            [
                float(cell.replace(",", ".")) if cell[-1:].isdigit() and cell[0] in "-0123456789" else cell or None
                for cell in line.split(";")
            ]
            for line in text.split("\n")
        ]
        write_ods(shared / file, rows)
    else:
        (shared / file).write_text(text)
    ingested = ingest(shared, tmp_path / "lab", QUIET)
    assert {outcome.sample.name: str(outcome.sample.part) for outcome in ingested.outcomes} == dict(
        zip(["P01", "P02"], parts, strict=True)
    )
    assert fates(ingested) == {"P01": "new", "P02": "new"}
    assert levels_mm(tmp_path / "lab", "P01")[0] == pytest.approx(-1.0, abs=0.051)
    assert levels_mm(tmp_path / "lab", "P02")[0] == pytest.approx(-2.0, abs=0.101)


@pytest.mark.parametrize(
    ("file", "text", "questions"),
    [
        ("caliper_all.csv", BESIDE.replace("P01", "").replace("Probe P02", ""), ["A2:C4", "E2:G4"]),
        ("caliper_all.csv", BESIDE.replace("P02", "Z09"), ["E1:G4: no photo of sample Z09"]),
        ("caliper_all.csv", BESIDE.replace("P02", "P01"), ["2 tables are its readings"]),
        ("caliper_all.csv", BESIDE.replace("Pegel", "Wert X"), ["no column of readings", "no column of readings"]),
        ("P01.csv", ABOVE.replace("P02", "Z09"), ["columns D E: no photo of sample Z09"]),
        ("all.csv", "Name;Ort;Wert\nP01;1;-1\nP02;2;-2\nP01;5;-3\nP02;6;-4", ["all.csv: no photo of sample all"]),
        (
            "P01.csv",
            BESIDE.replace("P01", "").replace("Probe P02", ""),
            ["P01.csv, A2:C4: the sheet gives no sample for this table. Photos without readings: P01.png, P02.png"],
        ),
        ("P01.csv", BESIDE.replace("Pegel", "P").replace("P01", ""), ["A2:C4: the sheet", "no column of"]),
        ("P01.csv", f"{HEAD}\n1;-1;-1\n9;-1;-1\n\nMittel\ns [mm];Pegel [mm]\n1;-1\n9;-1", ["A1:C3", "A6:B8"]),
    ],
)  # fmt: skip
def test_a_table_whose_sample_or_content_is_open_is_asked_about(shared, tmp_path, file, text, questions):
    (shared / "caliper_all.csv").unlink()
    (shared / file).write_text(text)
    asked = [fault.sentence for fault in ingest(shared, tmp_path / "lab", QUIET).faults]
    for words in questions:
        assert any(words in sentence for sentence in asked), asked
    assert len(asked) >= len(questions)


def test_further_rows_divide_a_file_and_follow_its_tables(shared, tmp_path):
    """Titles between the rows of one table are no headers: the user gives the ranges."""
    text, lab = f"{HEAD}\nErste\n{FIRST[0]}\n{FIRST[1]}\nZweite\n{SECOND[0]}\n{SECOND[1]}\n", tmp_path / "lab"
    (shared / "caliper_all.csv").rename(shared / "P01.csv")
    (shared / "P01.csv").write_text(text)
    assert fates(ingest(shared, lab, QUIET)) == {"P01": "failed", "P02": "new"}
    pairing = answer(lab, {"P01.csv": {"range": "A1:C4"}})
    more = {"range": "6:7", "s": "A", "levels": "B:C", "unit": "mm", "sign": "up"}
    rows = [*pairing_rows(lab), {"file": "P01.csv", "role": "readings", "sample": "P02"} | more]
    with pairing.open("w", newline="") as file:
        writer = csv.DictWriter(file, [*(rows[0].keys() - more.keys()), *more])
        writer.writeheader()
        writer.writerows(rows)
    assert fates(ingest(shared, lab, QUIET)) == {"P01": "new", "P02": "revised"}
    assert levels_mm(lab, "P02@2") == pytest.approx([-2.05, -2.55])
    assert fates(ingest(shared, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}
    parts = [row["part"] for row in pairing_rows(lab) if row["file"] == "P01.csv"]
    assert parts == ["A1:C4", "6:7"]
    edit(pairing, "A1:C4", "")
    with pytest.raises(InputError, match="has rows for its parts too"):
        ingest(shared, lab, QUIET)


def test_an_answer_stays_with_a_table_that_gets_a_new_row(shared, tmp_path):
    lab, path = tmp_path / "lab", shared / "caliper_all.csv"
    path.write_text(BESIDE.replace("P01", "Messreihe"))
    ingest(shared, lab, QUIET)
    assert "caliper_all.csv,readings,,A1:C4," in (lab / "pairing.csv").read_text()
    edit(lab / "pairing.csv", "caliper_all.csv,readings,,A1:C4,", "caliper_all.csv,readings,P01,A1:C4,")
    assert fates(ingest(shared, lab, QUIET))["P02"] == "unchanged"
    path.write_text(BESIDE.replace("P01", "Messreihe") + "\n12;-1,7;-1,7;;12;-2,7;-2,7\n")
    assert fates(ingest(shared, lab, QUIET)) == {"P01": "revised", "P02": "revised"}
    assert len(levels_mm(lab, "P01@2")) == 3


@pytest.mark.parametrize("name", ["P01.csv", "Blatt 1.csv"])
def test_one_round_of_answers_is_enough_for_a_sheet_with_two_tables(shared, tmp_path, name):
    """An answer for the first table once led to the question about the other, and a sample to those about its sheet."""
    lab, rows = tmp_path / "lab", [f"{s_mm};-{1 + s_mm / 10:g};-{1.1 + s_mm / 11:.1f}" for s_mm in (1, 5, 11)]
    table = ["s;Wert 1;Wert 2", *rows]
    (shared / "caliper_all.csv").rename(shared / name)
    (shared / name).write_text("\n".join(["links", *table, "", "rechts", *table]))
    ingest(shared, lab, QUIET)
    asked = {row["part"]: row["question"] for row in pairing_rows(lab) if row["file"] == name}
    assert len(asked) == 2
    for text in asked.values():
        assert "Photos without readings: P01.png, P02.png" in text
        assert "no unit" in text
        assert "upward or downward" in text
    given = {"unit": "mm", "sign": "up"}
    samples = zip(asked, ("P01", "P02"), strict=True)
    answer(lab, {f"{name}, {part}": {"sample": sample, **given} for part, sample in samples})
    assert {fault.sentence for fault in ingest(shared, lab, QUIET).faults} == set()


def test_a_table_beside_the_given_range_is_asked_about(shared, tmp_path):
    """Numbers with letters make no table; the range of one sample left the other's table out in silence."""
    rows = [f"{s_mm}a;-{s_mm / 10}a;-{s_mm / 10}a" for s_mm in (1, 5, 11)]
    head, lab = "Abstand;Messung 1;Messung 2", tmp_path / "lab"
    (shared / "caliper_all.csv").unlink()
    (shared / "Blatt 1.csv").write_text("\n".join(["P01", head, *rows, "", "P02", head, *rows]))
    ingest(shared, lab, QUIET)
    answer(lab, {"Blatt 1.csv": {"sample": "P01", "range": "2:5", "sign": "up"}})
    for _ in range(2):  # Its row without an answer once was an error of the pairing file.
        outcome = ingest(shared, lab, QUIET)
        asked = [fault.name for fault in outcome.faults if "Blatt 1.csv, 7:11" in fault.sentence]
        assert "P01" in asked, "rows beside its range may be its own"
    answer(lab, {"Blatt 1.csv, 7:11": {"role": "ignore"}})
    assert not [fault for fault in ingest(shared, lab, QUIET).faults if "7:11" in fault.sentence]
