"""Ingested again: the same adds nothing, what changed or was lost becomes a revision, and nothing is overwritten."""

import re
import shutil

import pytest

from sealtwin.lab.catalogue import CATALOGUE
from sealtwin.lab.ingest import ingest
from tests.support.ingested_lab import QUIET, edit, fates, hashes_of, rows_of
from tests.support.photos import mortar, write_png

UNCHANGED = {"P01": "unchanged", "P02": "unchanged"}


def test_ingesting_twice_adds_nothing(sound):
    folder, _, lab, _ = sound
    before, rows = hashes_of(lab), rows_of(lab)
    assert set(fates(ingest(folder, lab, QUIET)).values()) == {"unchanged"}
    assert rows_of(lab) == rows
    after = hashes_of(lab)
    assert after | {CATALOGUE: ""} == before | {CATALOGUE: ""}


def test_a_changed_file_makes_a_revision_of_a_run_and_what_was_run_stays(small, lab):
    (lab / "P01" / "run").mkdir()
    (lab / "P01" / "run" / "profile.csv").write_text("a level")
    old = hashes_of(lab / "P01")
    with (small / "P01.csv").open("a") as sheet:
        sheet.write("11.5,-1.0,-1.0,-1.0\n")
    assert fates(ingest(small, lab, QUIET)) == {"P01": "revised", "P02": "unchanged"}
    assert hashes_of(lab / "P01") == old
    assert (lab / "P01@2" / "inputs" / "readings.csv").read_bytes() == (small / "P01.csv").read_bytes()
    assert [row[:3] for row in rows_of(lab)] == [("P01", 1, "P01"), ("P01", 2, "P01@2"), ("P02", 1, "P02")]


@pytest.mark.parametrize("name", ["inputs", "trial.toml"])
def test_a_trial_that_lost_a_file_is_completed(small, lab, name):
    """Broken on purpose by calling the same content unchanged: no command of the trial would run."""
    gone = lab / "P01" / name
    shutil.rmtree(gone) if gone.is_dir() else gone.unlink()
    assert fates(ingest(small, lab, QUIET)) == {"P01": "revised", "P02": "unchanged"}
    assert (lab / "P01" / "inputs" / "photo.png").read_bytes() == (small / "P01.png").read_bytes()
    assert (lab / "P01" / "trial.toml").is_file()
    assert fates(ingest(small, lab, QUIET)) == UNCHANGED


def test_a_trial_file_is_the_users_to_edit_and_a_lab_without_its_catalogue_is_still_whole(small, lab):
    """The folders say all that the rows say."""
    trial, rows = lab / "P01" / "trial.toml", rows_of(lab)
    trial.write_text(mine := f"# Mine.\n{trial.read_text()}")
    assert fates(ingest(small, lab, QUIET)) == UNCHANGED
    (lab / CATALOGUE).unlink()
    assert fates(ingest(small, lab, QUIET)) == UNCHANGED
    assert rows_of(lab) == rows
    assert trial.read_text() == mine


def test_a_word_in_lab_toml_revises_all_that_it_is_about_and_a_comment_none(small, tmp_path):
    (small / "P02_Messung.csv").unlink()
    lab, defaults = tmp_path / "lab", small / "lab.toml"
    ingest(small, lab, QUIET)
    defaults.write_text(f"# Seen.\n{defaults.read_text()}")
    assert fates(ingest(small, lab, QUIET)) == UNCHANGED
    edit(defaults, "held-out", "calibrated-on")
    assert fates(ingest(small, lab, QUIET)) == {"P01": "revised", "P02": "unchanged"}
    edit(defaults, "volume_ml = 0.08", "volume_ml = 0.09")
    assert fates(ingest(small, lab, QUIET)) == {"P01": "revised", "P02": "revised"}


def test_an_answer_goes_into_a_trial_that_was_neither_edited_nor_run(small, lab):
    (lab / "P02" / "trial.toml").write_text("# Mine.\n" + (lab / "P02" / "trial.toml").read_text())
    before = hashes_of(lab / "P02")
    for volume, trials in (("0.09", ("P01", "P02@2")), ("0.07", ("P01@2", "P02@2"))):
        lab_toml = re.sub(r"volume_ml = [\d.]+", f"volume_ml = {volume}", (small / "lab.toml").read_text())
        (small / "lab.toml").write_text(lab_toml)
        assert tuple(sample.record.folder for sample in ingest(small, lab, QUIET).samples if sample.record) == trials
        assert f"volume_ml = {volume}" in (lab / trials[0] / "trial.toml").read_text()
        assert fates(ingest(small, lab, QUIET)) == UNCHANGED
        (lab / "P01" / "run").mkdir(exist_ok=True)
        (lab / "P01" / "run" / "profile.csv").write_text("a level")
    assert hashes_of(lab / "P02") == before
    assert len(rows_of(lab)) == 4


def test_the_same_name_from_another_folder_is_another_sample(small, lab, tmp_path):
    other = shutil.copytree(small, tmp_path / "other")
    write_png(other / "P02.png", mortar((200, 200), seed=99))
    outcomes = {outcome.name: outcome for outcome in ingest(other, lab, QUIET).samples}
    assert outcomes["P01"].fate == "unchanged"  # the very same files, copied
    assert "a sample P02 with another photo came from" in next(iter(outcomes["P02"].questions))
    assert len(rows_of(lab)) == 2
