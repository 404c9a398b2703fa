"""pairing.csv: shown, corrected by hand, remembered, and refused with all its rows."""

import shutil

import pytest

from sealtwin.core.errors import InputError
from sealtwin.lab.ingest import ingest
from tests.labs import QUIET, edit, fates

FAULTS = (
    "line 2: P01.png cannot be 'readings'; write one of photo, second_photo, mask, ignore.",
    "line 3: no file 'gone.png'",
    "line 4: P01.csv has no sample",
    "line 6: P02.png has two rows",
)


def test_the_pairing_is_shown_corrected_and_remembered(small, tmp_path):
    lab = tmp_path / "lab"
    (small / "P02_Messung.csv").rename(small / "PO2_Messung.csv")
    shutil.copy(small / "P01.png", small / "P01_side.png")
    assert fates(ingest(small, lab, QUIET)) == {"P01": "failed", "P02": "new", "PO2": "failed"}
    pairing = lab / "pairing.csv"
    edit(pairing, "PO2_Messung.csv,readings,PO2,", "PO2_Messung.csv,readings,p-02,")
    edit(pairing, "P01_side.png,photo,P01", "P01_side.png,ignore,")
    # Saved by a German spreadsheet, and in another order.
    head, *rows = [line.split(",")[:3] for line in pairing.read_text().splitlines()]
    corrected = "\r\n".join(";".join(row) for row in (head, *reversed(rows)))
    pairing.write_bytes(corrected.encode("utf-8-sig"))
    assert not [outcome.faults for outcome in ingest(small, lab, QUIET, dry_run=True).outcomes if outcome.faults]
    assert pairing.read_bytes() == corrected.encode("utf-8-sig"), "a dry run leaves it as it is"
    assert fates(ingest(small, lab, QUIET)) == {"P01": "new", "P02": "revised"}
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}
    (lab / "catalogue.json").unlink()
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}, "pairing.csv outlives it"


def test_a_pairing_that_cannot_be_is_refused_with_all_its_rows(small, tmp_path):
    pairing = tmp_path / "pairing.csv"
    pairing.write_text(
        "file,role,sample\nP01.png,readings,P01\ngone.png,photo,P01\nP01.csv,note,\nP02.png,photo,P02\nP02.png,photo,P3\n"
    )
    with pytest.raises(InputError) as refusal:
        ingest(small, tmp_path / "lab", QUIET, pairing=pairing)
    for sentence, words in zip(str(refusal.value).splitlines(), FAULTS, strict=True):
        assert words in sentence
    assert not (tmp_path / "lab").exists()
    pairing.write_text("file,role,sample\nP01.png,photo,../../x\n")
    with pytest.raises(
        InputError, match=r"P01.png: a sample '../../x'; names may have letters, digits, spaces and -_. only"
    ):
        ingest(small, tmp_path / "lab", QUIET, pairing=pairing)


def test_a_pairing_of_megabytes_or_none_is_told_of(small, tmp_path):
    with (tmp_path / "pairing.csv").open("wb") as sheet:
        sheet.truncate(1_000_000_000)
    for name, words in (("pairing", r"larger than [\d,]+ bytes"), ("gone", "no such file; 'sealtwin ingest FOLDER")):
        with pytest.raises(InputError, match=rf"{name}\.csv: {words}"):
            ingest(small, tmp_path / "lab", QUIET, pairing=tmp_path / f"{name}.csv")
