"""One file of readings for several samples: each gets its own part, shown in the pairing and corrected there."""

import csv
import re

import openpyxl
import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.errors import InputError
from sealtwin.lab.ingest import ingest
from tests.labs import QUIET, answer, edit, fates, levels_mm, pairing_rows, question

TABLE = "Probe;s [mm];Pegel 1 [mm]\nP01;1;-1,0\np-02;1;-2,0\nP01;11;-1,5\np-02;11;-2,5\n"


@pytest.fixture
def shared(small):
    """Two samples, and one table of readings of both."""
    for sheet in ("P01.csv", "P02_Messung.csv"):
        (small / sheet).unlink()
    (small / "caliper_all.csv").write_text(TABLE)
    return small


def _divided(lab, *rows):
    """Write rows of pairing.csv for a file in place of its own."""
    others = [row for row in pairing_rows(lab) if row["file"] not in {each["file"] for each in rows}]
    rows = [*others, *({"role": "readings", **row} for row in rows)]
    with (lab / "pairing.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows(rows)


def test_rows_of_samples_are_asked_about_and_divided_by_the_pairing(shared, tmp_path):
    """In another folder than its photos a table once left its samples sound without readings."""
    name = "Carnet/mesures mai.csv"
    lab, table = tmp_path / "lab", shared / name
    table.parent.mkdir()
    (shared / "caliper_all.csv").rename(table)
    assert fates(ingest(shared, lab, QUIET)) == dict.fromkeys(("Carnet-mai", "P01", "P02"), "failed")
    assert "'rows of NAME' in the column part" in question(lab, name)
    assert "rows of several samples: 'P01', 'p-02'" in question(lab, name)
    parts = {"P01": "rows of P01", "P02": "rows of p-02"}
    _divided(lab, *({"file": name, "sample": sample, "part": part} for sample, part in parts.items()))
    ingested = ingest(shared, lab, QUIET)
    assert fates(ingested) == {"P01": "new", "P02": "new"}
    assert levels_mm(lab, "P01") == [-1.0, -1.5]
    assert levels_mm(lab, "P02") == [-2.0, -2.5]
    assert f"{name}, rows of p-02" in "\n".join(ingest_answer(ingested).lines)
    assert (lab / "P02" / "inputs" / "readings.csv").read_bytes() == table.read_bytes()
    table.write_text(TABLE + "P02;5;-2,2\n")
    assert fates(ingest(shared, lab, QUIET))["P02"] == "revised"
    assert levels_mm(lab, "P02@2") == [-2.0, -2.2, -2.5]


def test_a_pairing_without_parts_is_about_all_of_a_file(shared, tmp_path):
    """As one that was written by hand, or before a file was shared."""
    pairing = tmp_path / "mine.csv"
    pairing.write_text("file;role;sample\ncaliper_all.csv;ignore;\n")
    ingested = ingest(shared, tmp_path / "lab", QUIET, pairing=pairing)
    assert [dict(outcome.sample.files).get("readings") for outcome in ingested.outcomes] == [None, None]
    pairing.write_text(
        "file;role;sample;part\ncaliper_all.csv;readings;P01;P07\ncaliper_all.csv;note;P01;rows of P01\n"
    )
    with pytest.raises(InputError) as refusal:
        ingest(shared, tmp_path / "other", QUIET, pairing=pairing)
    part, role = str(refusal.value).splitlines()
    assert "a part 'P07'; write a range, such as A1:D20, or rows of NAME" in part
    assert "caliper_all.csv, rows of P01 cannot be 'note'; write one of readings, ignore." in role


@pytest.mark.parametrize(
    ("sample", "words"), [("P01", "'P01' names another sample"), ("P07", "column Probe names sample 'P07', but by its")]
)
def test_a_file_whose_name_and_rows_contradict_each_other_is_named(shared, tmp_path, sample, words):
    (shared / "caliper_all.csv").unlink()
    (shared / "P02.csv").write_text(TABLE.replace("p-02", "P01").replace("P01", sample).replace("1;-2", "5;-2"))
    lab = tmp_path / "lab"
    assert fates(ingest(shared, lab, QUIET))["P02"] == "failed"
    assert words in question(lab, "P02.csv")
    answer(lab, {"P02.csv": {"settings": f"readings.sample = '{sample}'"}})
    assert fates(ingest(shared, lab, QUIET))["P02"] == "new"


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


def test_worksheets_of_samples_are_divided_by_the_pairing(shared, tmp_path):
    lab, head, file = tmp_path / "lab", ("s_mm", "level_mm"), "Messungen Mai.xlsx"
    first, second = (head, (1, -1.0), (11, -1.0)), (head, (1, -2.0), (11, -2.0))
    _workbook(shared / file, {"Sheet": [("Labor 3",)], "p 01": first, "P02 Messung": second})
    assert fates(ingest(shared, lab, QUIET)) == dict.fromkeys(("Mai", "P01", "P02"), "failed")
    assert "its sheet" in question(lab, file)
    sheets = {"P01": "p 01", "P02": "P02 Messung"}
    _divided(lab, *({"file": file, "sample": sample, "sheet": sheet} for sample, sheet in sheets.items()))
    ingested = ingest(shared, lab, QUIET)
    assert fates(ingested) == {"P01": "new", "P02": "new"}
    assert levels_mm(lab, "P02") == [-2.0, -2.0]
    assert [str(outcome.sample.part) for outcome in ingested.outcomes] == ["sheet p 01", "sheet P02 Messung"]


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
NUMBERED = "s [mm];Tiefe 1 [mm];Tiefe 2 [mm];Tiefe 3 [mm];Tiefe 4 [mm]\n1;1;1,1;2;2,1\n11;1,5;1,6;2,5;2,7\n"
UNNAMED = BESIDE.replace("P01", "").replace("Probe P02", "")
TRANSPOSED = "s [mm];1;11\nTiefe P01 [mm];1;1,5\nTiefe P02 [mm];2,1;2,5"
RUNS = "Tiefe in mm\nProbe;Lauf;1 mm;11 mm\nP01;1;1;1,5\n;2;1,1;1,6\nP02;1;2;2,5\n;2;2,1;2,6\n;Mittel;2;2,6"
ASKED = {
    "below": BELOW,
    "with units": re.sub(r"(?m)(?<=\d)(?=;|$)(?<!P0\d)", " mm", BELOW),
    "below, without names": BELOW.replace("Probe P01", "").replace("p-02", ""),
    "beside": BESIDE,
    "beside, without a blank": BESIDE.replace(";;", ";"),
    "beside, without names": UNNAMED,
    "beside, one without a photo": BESIDE.replace("P02", "Z09"),
    "beside, one sample": BESIDE.replace("P02", "P01"),
    "beside, unknown readings": BESIDE.replace("Pegel", "Wert X"),
    "beside, unknown names of one": BESIDE.replace(f";;{HEAD}", ";;x;h 1;h 2").replace("Probe P02", ""),
    "columns": NAMED,
    "columns, one without a photo": NAMED.replace("P02", "Z09"),
    "labels": f";P01;;P02;\n{NUMBERED}",
    "labels behind a word": f"Probe;P01;;P02;\n{NUMBERED}",
    "labels, one without a photo": f";P01;;Z09;\n{NUMBERED}",
    "labels without digits": f";links;;rechts;\n{NUMBERED}",
    "transposed": TRANSPOSED,
    "transposed, with another": f"{TRANSPOSED}\n;2;3",
    "transposed runs": RUNS,
    "rows": TABLE,
    "rows under unknown names": "Name;Ort;Wert\nP01;1;-1\nP02;2;-2\nP01;5;-3\nP02;6;-4",
    "a table below": f"{HEAD}\n1;-1;-1\n9;-1;-1\n\nMittel\ns [mm];Pegel [mm]\n1;-1\n9;-1",
    "a remark": f"{HEAD}\n1;-1;-1,1\n9;-1;-1,1\nwie P02",
}


@pytest.mark.parametrize("text", ASKED.values(), ids=ASKED)
def test_a_file_that_may_be_of_several_samples_or_tables_is_asked_about(shared, tmp_path, text):
    """Each once was divided by names in it. Repeats of a sheet called P01 were once the columns of both samples."""
    lab = tmp_path / "lab"
    (shared / "caliper_all.csv").rename(shared / "P01.csv").write_text(text)
    ingested = fates(ingest(shared, lab, QUIET))
    assert ingested["P01"] == "failed"
    assert question(lab, "P01.csv")
    assert ingested["P02"] == "failed" or "P02" not in text


def test_further_rows_divide_a_file_and_follow_its_tables(shared, tmp_path):
    """Titles between the rows of one table are no headers: the user gives the ranges."""
    text, lab = f"{HEAD}\nErste\n{FIRST[0]}\n{FIRST[1]}\nZweite\n{SECOND[0]}\n{SECOND[1]}\n", tmp_path / "lab"
    (shared / "caliper_all.csv").rename(shared / "P01.csv")
    (shared / "P01.csv").write_text(text)
    assert fates(ingest(shared, lab, QUIET)) == {"P01": "failed", "P02": "new"}
    more = {"range": "6:7", "s": "A", "levels": "B:C", "unit": "mm", "sign": "up"}
    first, second = ({"file": "P01.csv", "sample": sample} for sample in ("P01", "P02"))
    _divided(lab, first | {"range": "A1:C4"}, second | more)
    assert fates(ingest(shared, lab, QUIET)) == {"P01": "new", "P02": "revised"}
    assert levels_mm(lab, "P02@2") == pytest.approx([-2.05, -2.55])
    assert fates(ingest(shared, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}
    parts = [row["part"] for row in pairing_rows(lab) if row["file"] == "P01.csv"]
    assert parts == ["A1:C4", "6:7"]
    edit(lab / "pairing.csv", "A1:C4", "")
    with pytest.raises(InputError, match="has rows for its parts too"):
        ingest(shared, lab, QUIET)


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
