"""pairing.csv: shown, corrected by hand, remembered, and refused with all its rows."""

import shutil

import pytest

from sealtwin.core.errors import InputError
from sealtwin.lab.ingest import ingest
from tests.labs import QUIET


def test_the_pairing_is_shown_corrected_and_remembered(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P02_Messung.csv").rename(small / "PO2_Messung.csv")
    shutil.copy(small / "P01.png", small / "P01_side.png")
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["failed", "new", "failed"]
    pairing = lab / "pairing.csv"
    text = pairing.read_text()
    assert "PO2_Messung.csv,readings,PO2," in text
    # Saved by a German spreadsheet, and in another order.
    text = text.replace("PO2_Messung.csv,readings,PO2", "PO2_Messung.csv,readings,p-02")
    text = text.replace("P01_side.png,photo,P01", "P01_side.png,ignore,")
    head, *rows = [line.split(",")[:3] for line in text.splitlines()]
    corrected = "\r\n".join(";".join(row) for row in (head, *reversed(rows)))
    pairing.write_bytes(corrected.encode("utf-8-sig"))
    assert not [outcome.faults for outcome in ingest(small, lab, QUIET, dry_run=True).outcomes if outcome.faults]
    assert pairing.read_bytes() == corrected.encode("utf-8-sig"), "a dry run leaves it as it is"
    ingested = ingest(small, lab, QUIET)
    assert [(outcome.sample.name, outcome.fate) for outcome in ingested.outcomes] == [
        ("P01", "new"),
        ("P02", "revised"),
    ]
    again = ingest(small, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["unchanged"] * 2


def test_an_edited_pairing_outlives_the_catalogue(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P02_Messung.csv").rename(small / "PO2_Messung.csv")
    ingest(small, lab, QUIET)
    text = (lab / "pairing.csv").read_text()
    (lab / "pairing.csv").write_text(text.replace("PO2_Messung.csv,readings,PO2", "PO2_Messung.csv,readings,P02"))
    ingest(small, lab, QUIET)
    (lab / "catalogue.json").unlink()
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["unchanged"] * 2


def test_a_pairing_that_cannot_be_is_refused_with_all_its_rows(small, tmp_path):
    pairing = tmp_path / "pairing.csv"
    pairing.write_text(
        "file,role,sample\nP01.png,readings,P01\ngone.png,photo,P01\nP01.csv,note,\nP02.png,photo,P02\nP02.png,photo,P3\n"
    )
    with pytest.raises(InputError) as refusal:
        ingest(small, tmp_path / "lab", QUIET, pairing=pairing)
    told = str(refusal.value).splitlines()
    assert "line 2: P01.png cannot be 'readings'; write one of photo, second_photo, mask, ignore." in told[0]
    assert "line 3: no file 'gone.png'" in told[1]
    assert "line 4: P01.csv has no sample" in told[2]
    assert "line 6: P02.png has two rows" in told[3]
    assert not (tmp_path / "lab").exists()
    pairing.write_text("file,role,sample\nP01.png,photo,../../x\n")
    with pytest.raises(
        InputError, match=r"P01.png: a sample '../../x'; names may have letters, digits, spaces and -_. only"
    ):
        ingest(small, tmp_path / "lab", QUIET, pairing=pairing)


def test_a_pairing_of_megabytes_is_none(small, tmp_path):
    with (tmp_path / "pairing.csv").open("wb") as sheet:
        sheet.truncate(1_000_000_000)
    with pytest.raises(InputError, match=r"pairing\.csv: larger than [\d,]+ bytes"):
        ingest(small, tmp_path / "lab", QUIET, pairing=tmp_path / "pairing.csv")


def test_a_pairing_that_is_not_there_is_told_of(small, tmp_path):
    with pytest.raises(InputError, match=r"gone\.csv: no such file; 'sealtwin ingest FOLDER --out LAB' writes"):
        ingest(small, tmp_path / "lab", QUIET, pairing=tmp_path / "gone.csv")
