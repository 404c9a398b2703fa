"""A trial that lost what was kept in it becomes a new revision, and nothing of the old one is overwritten."""

import shutil

import pytest

from sealtwin.lab.ingest import ingest
from tests.labs import QUIET, hashes_of, sealtwin


@pytest.fixture
def lab(small, tmp_path):
    """Of the two samples in ``small``."""
    ingest(small, tmp_path / "lab", QUIET)
    return tmp_path / "lab"


@pytest.mark.parametrize("name", ["inputs", "inputs/photo.png", "inputs/readings.csv", "trial.toml"])
def test_a_trial_that_lost_a_file_is_taken_in_again_as_a_revision(small, lab, name):
    """Broken on purpose by calling the same content unchanged: no command of the trial would run."""
    gone = lab / "P01" / name
    shutil.rmtree(gone) if gone.is_dir() else gone.unlink()
    left = hashes_of(lab / "P01")
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["revised", "unchanged"]
    assert hashes_of(lab / "P01") == left
    assert (lab / "P01@2" / "inputs" / "photo.png").read_bytes() == (small / "P01.png").read_bytes()
    assert (lab / "P01@2" / "trial.toml").is_file()
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["unchanged"] * 2


def test_a_trial_file_is_the_users_to_edit(small, lab):
    trial = lab / "P01" / "trial.toml"
    trial.write_text("# Mine.\n" + trial.read_text())
    mine = trial.read_text()
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["unchanged"] * 2
    assert trial.read_text() == mine


def test_a_trial_whose_folder_is_gone_is_taken_in_anew(small, lab):
    shutil.rmtree(lab / "P01")
    assert [row.split()[0] for row in sealtwin("lab", "list", lab).stdout.splitlines()] == ["sample", "P02"]
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["new", "unchanged"]
