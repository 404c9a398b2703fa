"""A trial that lost what was kept in it gets it back; one that was changed is named, and nothing is overwritten."""

import shutil

import pytest

from sealtwin.lab.ingest import ingest
from sealtwin.lab.telling import exit_code, lines
from tests.labs import QUIET, hashes_of, rows_of, sealtwin


@pytest.fixture
def lab(small, tmp_path):
    """Of the two samples in ``small``."""
    ingest(small, tmp_path / "lab", QUIET)
    return tmp_path / "lab"


@pytest.mark.parametrize("name", ["", "inputs", "inputs/photo.png", "inputs/readings.csv", "trial.toml", "record.json"])
def test_what_is_gone_is_put_back_and_said(small, lab, name):
    """Broken on purpose by calling the same content unchanged: nothing comes back."""
    before, rows = hashes_of(lab), rows_of(lab)
    gone = lab / "P01" / name
    shutil.rmtree(gone) if gone.is_dir() else gone.unlink()
    left = hashes_of(lab)
    dry = ingest(small, lab, QUIET, dry_run=True)
    assert [outcome.fate for outcome in dry.outcomes] == ["restored", "unchanged"]
    assert hashes_of(lab) == left
    again = ingest(small, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["restored", "unchanged"]
    assert {file: digest for file, digest in hashes_of(lab).items() if file.startswith("P0")} == {
        file: digest for file, digest in before.items() if file.startswith("P0")
    }
    assert rows_of(lab) == rows
    assert exit_code(again) == 0
    assert [line for line in lines(again) if line.startswith("note: P01: ") and " was gone, and is put back" in line]
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["unchanged"] * 2


def test_a_kept_file_that_was_changed_is_named_and_left_alone(small, lab):
    photo = lab / "P02" / "inputs" / "photo.png"
    photo.write_bytes(photo.read_bytes() + b"x")
    mine = photo.read_bytes()
    (lab / "P02" / "trial.toml").unlink()
    again = ingest(small, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["unchanged", "failed"]
    assert exit_code(again) == 6
    (fault,) = again.faults
    assert "P02/inputs/photo.png: other bytes than were taken in from P02.png. Move it away" in fault.sentence
    assert photo.read_bytes() == mine
    assert (lab / "P02" / "trial.toml").is_file()  # what is gone comes back all the same
    photo.rename(lab / "P02" / "mine.png")
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["unchanged", "restored"]


def test_a_trial_file_is_the_users_to_edit(small, lab):
    trial = lab / "P01" / "trial.toml"
    trial.write_text("# Mine.\n" + trial.read_text())
    mine = trial.read_text()
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["unchanged"] * 2
    assert trial.read_text() == mine


def test_the_catalogue_tells_of_a_folder_that_is_gone(lab):
    shutil.rmtree(lab / "P01")
    rows = sealtwin("lab", "list", lab).stdout.splitlines()
    assert rows[1].endswith("its folder is gone")
    assert rows[2].endswith("not run")
