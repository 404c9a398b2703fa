"""What a lab's folder holds and is not read: its sample is held back, the others go on."""

import os

import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.lab import found_files
from sealtwin.lab.ingest import ingest
from tests.labs import QUIET


def _fates(ingested):
    return {outcome.sample.name: outcome.fate for outcome in ingested.outcomes}


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        (
            "P02_Messung.xls",
            b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
            "an old Excel workbook (.xls), or one with a password",
        ),
        ("P02 mesures.xlsb", b"PK\x03\x04", "damaged, or not an XLSX"),
    ],
)
def test_a_sample_whose_sheet_is_refused_is_not_sound(small, tmp_path, name, content, says):
    """Once it was new, without readings, and nobody looked again."""
    (small / "P02_Messung.csv").unlink()
    (small / name).write_bytes(content)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert _fates(ingested) == {"P01": "new", "P02": "failed"}
    (fault,) = ingested.faults
    assert fault.name == "P02"
    assert fault.sentence.startswith(f"{name}: {says}")


def test_what_was_saved_anew_beside_it_stands_in(small, tmp_path):
    (small / "P02_Messung.xls").write_bytes(b"old")
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert _fates(ingested) == {"P01": "new", "P02": "new"}
    assert str(ingested.outcomes[1].sample.files["readings"]) == "P02_Messung.csv"


def test_a_link_in_place_of_a_sheet_holds_its_sample_back(small, tmp_path):
    (small / "P02_Messung.csv").rename(tmp_path / "elsewhere.csv")
    (small / "P02_Messung.csv").symlink_to(tmp_path / "elsewhere.csv")
    assert _fates(ingest(small, tmp_path / "lab", QUIET)) == {"P01": "new", "P02": "failed"}


def test_an_unreadable_folder_is_named_and_the_rest_goes_on(small, tmp_path, monkeypatch):
    (small / "shut").mkdir()
    real = os.scandir

    def scandir(place):
        if str(place).endswith("shut"):
            raise PermissionError(13, "Permission denied", str(place))
        return real(place)

    monkeypatch.setattr(found_files.os, "scandir", scandir)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert _fates(ingested) == {"P01": "new", "P02": "new"}
    assert ingest_answer(ingested).exit_code == 6
    sentences = [fault.sentence for fault in ingested.faults]
    assert "shut: this folder cannot be read (Permission denied). Make it readable, or move it away." in sentences
