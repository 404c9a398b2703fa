"""Ingest: ten dialects and all planted faults; nothing of the lab's changed."""

import hashlib
import re

import numpy as np
import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.errors import InputError, present
from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.ingest import ingest
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import QUIET, fates, hashes_of, sealtwin
from tests.support.lab_folder import FAULTS, HANDS, LENGTH_MM, S_MM, levels_mm, make_lab_folder
from validate.readings.read_readings import read_readings


def test_ten_samples_in_ten_dialects_become_ten_trials(sound):
    _, _, lab, ingested = sound
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
        # What was written with a hundredth of a millimetre, or with eight digits of an inch.
        assert np.allclose(present(profile.repeats_mm, "repeats"), expected, atol=1e-6, equal_nan=True)
        assert np.allclose(profile.s_mm, S_MM, atol=1e-6)


def test_nothing_of_the_labs_is_changed_and_its_files_are_kept_byte_for_byte(sound):
    folder, before, lab, _ = sound
    assert hashes_of(folder) == before
    kept = [(record, file) for record in Catalogue.of(lab).records for file in record.files]
    assert len(kept) == 30
    for record, file in kept:
        assert before[file.original] == file.sha256
        assert hashlib.sha256((lab / record.folder / file.kept_as).read_bytes()).hexdigest() == file.sha256


def test_every_planted_fault_is_named_and_the_rest_goes_on(tmp_path):
    folder = make_lab_folder(tmp_path / "folder")
    for fault in FAULTS:
        fault.plant(folder)
    answer = sealtwin("ingest", folder, "--out", tmp_path / "lab", "--quiet")
    assert answer.exit_code == 6, answer.output
    assert len(FAULTS) >= 12
    assert not [fault.what for fault in FAULTS if not re.search(fault.says, answer.stdout)]
    # As many sentences as faults, what several lack being told once; and that P07 and P12 wait for their sheets.
    assert sum(line.startswith("failed: ") for line in answer.stdout.splitlines()) == len(FAULTS) + 1
    catalogue = Catalogue.of(tmp_path / "lab")
    assert catalogue.latest.keys() - catalogue.faults().keys() == {"p10"}
    assert "/folder/" not in answer.stdout


def test_a_lab_is_not_mixed_up_with_other_files(small, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.docx").touch()
    with pytest.raises(InputError, match="has files that no ingest wrote"):
        ingest(small, tmp_path / "mine", QUIET)
    for lab in (small, small / "lab", tmp_path):
        with pytest.raises(InputError, match="must be neither inside nor around"):
            ingest(small, lab, QUIET)
