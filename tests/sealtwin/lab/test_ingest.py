"""Ingest of samples into a lab: dialects, faults, revisions and interruptions."""

import hashlib
import re
import shutil

import numpy as np
import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.errors import InputError, present
from sealtwin.lab import ingest as steps
from sealtwin.lab.catalogue import CATALOGUE, Catalogue
from sealtwin.lab.ingest import ingest
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import QUIET, fates, hashes_of, rows_of, sealtwin
from tests.support.lab_folder import FAULTS, HANDS, LENGTH_MM, S_MM, levels_mm, make_lab_folder
from tests.support.photos import mortar, write_png
from validate.readings.read_readings import read_readings


def test_ten_samples_in_different_dialects_become_ten_trials(sound):
    """Files of the folder stay unchanged, and the lab has exact copies. A second ingest changes nothing."""
    folder, before, lab, ingested = sound
    assert list(fates(ingested).values()) == ["new"] * 10
    assert not ingested.faults
    assert len({outcome.dialect for outcome in ingested.samples}) == 9
    assert ingest_answer(ingested).exit_code == 0
    for sample, (_, hand) in HANDS.items():
        settings = present(load_trial(lab / sample / "trial.toml").readings, "readings")
        profile = read_readings(lab / sample / settings.file, settings, LENGTH_MM, 8.0)
        expected = levels_mm(sample)
        if hand.missing:
            expected[2, 1] = np.nan
        # Readings are written to 0.01 mm, or with eight digits in inches.
        assert np.allclose(present(profile.repeats_mm, "repeats"), expected, atol=1e-6, equal_nan=True)
        assert np.allclose(profile.s_mm, S_MM, atol=1e-6)
    kept = {
        file.original: hashlib.sha256((lab / record.folder / file.kept_as).read_bytes()).hexdigest()
        for record in Catalogue.of(lab).records
        for file in record.files
    }
    assert len(kept) == 20
    assert hashes_of(folder) == before
    assert kept.items() <= before.items()
    in_lab, rows = hashes_of(lab), rows_of(lab)
    assert set(fates(ingest(folder, lab, QUIET)).values()) == {"unchanged"}
    assert (rows_of(lab), hashes_of(lab) | {CATALOGUE: ""}) == (rows, in_lab | {CATALOGUE: ""})


def test_every_planted_fault_is_reported_without_stopping_other_samples(tmp_path):
    folder = make_lab_folder(tmp_path / "folder")
    for fault in FAULTS:
        fault.plant(folder)
    answer = sealtwin("ingest", folder, "--out", tmp_path / "lab", "--quiet")
    assert answer.exit_code == 6, answer.output
    assert len(FAULTS) >= 10
    assert not [fault.what for fault in FAULTS if not re.search(fault.says, answer.stdout)]
    # One sentence for each fault, also of several samples, one that P07 lacks its sheet, and one on the order of P09.
    assert sum(line.startswith(("failed: ", "asked: ")) for line in answer.stdout.splitlines()) == len(FAULTS) + 2
    catalogue = Catalogue.of(tmp_path / "lab")
    assert catalogue.latest.keys() - catalogue.faults().keys() == {"p02", "p03", "p10"}
    assert "/folder/" not in answer.stdout


def test_an_ingest_into_a_folder_with_other_files_is_refused(small, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "index.html").touch()
    with pytest.raises(InputError, match="has files that no ingest wrote"):
        ingest(small, tmp_path / "mine", QUIET)
    for lab in (small, small / "lab", tmp_path):
        with pytest.raises(InputError, match="must not be inside the lab's folder"):
            ingest(small, lab, QUIET)


UNCHANGED = {"P01": "unchanged", "P02": "unchanged"}


def test_a_changed_file_of_a_sample_makes_a_revision_beside_the_unchanged_run(small, lab):
    (lab / "P01" / "run").mkdir()
    (lab / "P01" / "run" / "profile.csv").write_text("a level")
    old = hashes_of(lab / "P01")
    with (small / "P01.csv").open("a") as sheet:
        sheet.write("11.5,-1.0,-1.0,-1.0\n")
    assert fates(ingest(small, lab, QUIET)) == {"P01": "revised", "P02": "unchanged"}
    assert hashes_of(lab / "P01") == old
    assert (lab / "P01@2" / "inputs" / "readings.csv").read_bytes() == (small / "P01.csv").read_bytes()
    assert [row[:3] for row in rows_of(lab)] == [("P01", 1, "P01"), ("P01", 2, "P01@2"), ("P02", 1, "P02")]


def test_an_ingest_keeps_edited_trials_and_rebuilds_a_deleted_catalogue(small, lab):
    """The folders of the samples contain all that the catalogue lists."""
    trial, rows = lab / "P01" / "trial.toml", rows_of(lab)
    trial.write_text(mine := f"# Mine.\n{trial.read_text()}")
    assert fates(ingest(small, lab, QUIET)) == UNCHANGED
    (lab / CATALOGUE).unlink()
    assert fates(ingest(small, lab, QUIET)) == UNCHANGED
    assert rows_of(lab) == rows
    assert trial.read_text() == mine


def test_a_known_sample_name_with_another_photo_gives_a_question(small, lab, tmp_path):
    other = shutil.copytree(small, tmp_path / "other")
    write_png(other / "P02.png", mortar((200, 200), seed=99))
    outcomes = {outcome.name: outcome for outcome in ingest(other, lab, QUIET).samples}
    assert outcomes["P01"].fate == "unchanged"  # the very same files, copied
    assert "the lab already has a sample P02 with another photo, from" in next(iter(outcomes["P02"].questions))
    assert len(rows_of(lab)) == 2


@pytest.mark.parametrize("step", [(steps, "keep"), (Catalogue, "save"), (steps.files, "write_if_new")])
def test_repeating_an_interrupted_ingest_completes_the_lab(small, two, tmp_path, monkeypatch, step):
    lab = tmp_path / "lab"

    def stop(*_, **__):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(*step, stop)
        with pytest.raises(KeyboardInterrupt):
            ingest(small, lab, QUIET)
    assert not ingest(small, lab, QUIET).faults
    unbroken = two / "lab"
    assert rows_of(lab) == rows_of(unbroken)
    assert sorted(path.name for path in lab.iterdir()) == sorted(path.name for path in unbroken.iterdir())


def test_a_bug_in_one_sample_does_not_stop_the_ingest_of_other_samples(small, tmp_path, monkeypatch):
    real = steps.prepare

    def burst(prepared):
        if prepared.name == "P01":
            raise ZeroDivisionError("on purpose")
        real(prepared)

    monkeypatch.setattr(steps, "prepare", burst)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert fates(ingested) == {"P01": "bug", "P02": "new"}
    assert "P01.png: ZeroDivisionError: on purpose" in next(iter(ingested.samples[0].questions))
    assert ingest_answer(ingested).exit_code == 1


def test_an_unreadable_file_fails_only_its_sample_but_a_full_disk_stops_the_ingest(small, tmp_path, monkeypatch):
    real, lab = steps.gather, tmp_path / "lab"

    def failing(at):
        def gather(sample, *notes):
            if sample.name == "P01":
                raise OSError(28, "on purpose", str(at))
            return real(sample, *notes)

        monkeypatch.setattr(steps, "gather", gather)

    failing(small / "P01.png")
    outcomes = ingest(small, lab, QUIET).samples
    assert [*outcomes[0].questions] == ["P01.png: on purpose. Make it readable."]
    assert outcomes[1].fate == "new"
    failing(lab / "P01")
    with pytest.raises(OSError, match="on purpose"):
        ingest(small, lab, QUIET)


def test_a_file_that_changes_during_the_ingest_gives_a_question(small, tmp_path, monkeypatch):
    real = steps.keep

    def changing(*arguments):
        (small / "P01.csv").write_text("s_mm,level_1_mm\n1,-1\n2,-1\n")
        return real(*arguments)

    monkeypatch.setattr(steps, "keep", changing)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert "P01.csv changed during the ingest" in next(iter(ingested.samples[0].questions))
    assert "p01" in Catalogue.of(tmp_path / "lab").faults(), "nor is it run"
