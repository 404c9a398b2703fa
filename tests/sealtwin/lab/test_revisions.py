"""Ingested again: what is the same adds nothing, what changed becomes a revision."""

import re
import shutil

from sealtwin.lab.catalogue import CATALOGUE
from sealtwin.lab.ingest import ingest
from tests.labs import QUIET, hashes_of, rows_of
from tests.pictures import mortar, write_png


def test_ingesting_twice_adds_nothing(sound):
    folder, _, lab, _ = sound
    before, rows = hashes_of(lab), rows_of(lab)
    again = ingest(folder, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["unchanged"] * 10
    assert rows_of(lab) == rows
    assert {name: digest for name, digest in hashes_of(lab).items() if name != CATALOGUE} == {
        name: digest for name, digest in before.items() if name != CATALOGUE
    }


def test_a_changed_file_makes_a_revision_and_the_old_one_stays(small, tmp_path):
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    old = hashes_of(lab / "P01")
    (small / "P01.csv").write_text((small / "P01.csv").read_text() + "11.5,-1.0,-1.0,-1.0\n")
    again = ingest(small, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["revised", "unchanged"]
    assert hashes_of(lab / "P01") == old
    assert (lab / "P01@2" / "inputs" / "readings.csv").read_bytes() == (small / "P01.csv").read_bytes()
    assert [row[:3] for row in rows_of(lab)] == [("P01", 1, "P01"), ("P01", 2, "P01@2"), ("P02", 1, "P02")]


def test_a_word_in_lab_toml_revises_all_that_it_is_about_and_a_comment_none(small, tmp_path):
    (small / "P02_Messung.csv").unlink()
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    defaults = small / "lab.toml"
    defaults.write_text(f"# Seen.\n{defaults.read_text()}")
    assert {outcome.fate for outcome in ingest(small, lab, QUIET).outcomes} == {"unchanged"}
    defaults.write_text(defaults.read_text().replace("held-out", "calibrated-on"))
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["revised", "unchanged"]
    defaults.write_text(defaults.read_text().replace("volume_ml = 0.08", "volume_ml = 0.09"))
    assert {outcome.fate for outcome in ingest(small, lab, QUIET).outcomes} == {"revised"}


def test_an_answer_goes_into_a_trial_that_was_neither_edited_nor_run(small, tmp_path):
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    (lab / "P02" / "trial.toml").write_text("# Mine.\n" + (lab / "P02" / "trial.toml").read_text())
    before = hashes_of(lab / "P02")
    for volume, trials in (("0.09", ("P01", "P02@2")), ("0.07", ("P01@2", "P02@2"))):
        (small / "lab.toml").write_text(
            re.sub(r"volume_ml = [\d.]+", f"volume_ml = {volume}", (small / "lab.toml").read_text())
        )
        assert tuple(outcome.trial for outcome in ingest(small, lab, QUIET).outcomes) == trials
        assert f"volume_ml = {volume}" in (lab / trials[0] / "trial.toml").read_text()
        assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["unchanged"] * 2
        (lab / "P01" / "run").mkdir(exist_ok=True)
        (lab / "P01" / "run" / "profile.csv").write_text("a level")
    assert hashes_of(lab / "P02") == before
    assert len(rows_of(lab)) == 4


def test_the_same_name_from_another_folder_is_another_sample(small, tmp_path):
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    other = shutil.copytree(small, tmp_path / "other")
    write_png(other / "P02.png", mortar((200, 200), seed=99))
    fates = {outcome.sample.name: outcome for outcome in ingest(other, lab, QUIET).outcomes}
    assert fates["P01"].fate == "unchanged"  # the very same files, copied
    assert "a sample P02 with another photo came from" in fates["P02"].faults[0]
    assert len(rows_of(lab)) == 2


def test_a_lab_without_its_catalogue_is_still_whole(small, tmp_path):
    """The folders say all that the rows say."""
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    rows = rows_of(lab)
    (lab / CATALOGUE).unlink()
    again = ingest(small, lab, QUIET)
    assert [outcome.fate for outcome in again.outcomes] == ["unchanged"] * 2
    assert rows_of(lab) == rows
