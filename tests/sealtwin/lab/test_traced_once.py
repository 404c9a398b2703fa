"""A photo is traced once: while its sample waits for answers, and when they come."""

from collections import Counter

import pytest

from sealtwin.core import files
from sealtwin.core.run_folder import look_into
from sealtwin.trial import digitise_stage
from tests.support.ingested_lab import answer, edit, hashes_of, question, sealtwin
from tests.support.photos import mortar, with_crack, write_png


@pytest.fixture
def traced(monkeypatch):
    """Number of tracings of each sample."""
    counts, digitise = Counter(), digitise_stage._digitise

    def counted(job):
        counts[job.trial.name] += 1
        return digitise(job)

    monkeypatch.setattr(digitise_stage, "_digitise", counted)
    return counts


@pytest.fixture
def waiting(small, tmp_path):
    """The sheet of P02 has no unit."""
    edit(small / "P02_Messung.csv", "[mm]", "")
    return small, tmp_path / "lab"


@pytest.fixture
def answered(waiting, traced):
    """P02 alone, traced and kept, with its answer in pairing.csv."""
    folder, lab = waiting
    for file in folder.glob("P01*"):
        file.unlink()
    _ingest(folder, lab)
    assert traced == {"P02": 1}
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}})
    return folder, lab


def _ingest(folder, lab, *more):
    return sealtwin("ingest", folder, "--out", lab, "--quiet", *more)


def test_rounds_of_questions_trace_no_photo_again(waiting, traced):
    folder, lab = waiting
    assert _ingest(folder, lab).exit_code == 6
    assert "no unit" in question(lab, "P02_Messung.csv")
    assert traced == {"P01": 1, "P02": 1}
    before = hashes_of(lab)
    assert _ingest(folder, lab, "--dry-run").exit_code == 6
    assert hashes_of(lab) == before
    assert traced == {"P01": 1, "P02": 1}, "a dry run traces nothing"
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}})
    assert _ingest(folder, lab).exit_code == 0
    assert traced == {"P01": 1, "P02": 1}
    finished = look_into(lab / "P02" / "run")
    assert finished.is_current("digitise", finished.manifest["stages"]["digitise"]["key"])
    write_png(folder / "P01.png", with_crack(mortar((200, 200), seed=9), [(40, 101), (160, 98)], 20))
    _ingest(folder, lab)
    assert traced["P01"] == 2, "another photo"
    assert (lab / "P01" / "run" / "overlay.png").is_file()


@pytest.mark.parametrize("name", ["trial.toml", "record.json"])
def test_a_process_killed_while_it_writes_a_trial_anew_continues(answered, monkeypatch, name):
    folder, lab = answered
    write = files.write_bytes

    def killed(path, content):
        if path.name == name:
            raise KeyboardInterrupt
        write(path, content)

    with monkeypatch.context() as patch:
        patch.setattr(files, "write_bytes", killed)
        assert _ingest(folder, lab).exit_code == 130
    assert "left out: P02: " in sealtwin("lab", "run", lab, "--device", "cpu").stdout, "nor is it run before"
    last = _ingest(folder, lab)
    assert last.exit_code == 0, last.output
    assert "1 of 1 sample is sound" in last.stdout


def test_a_kept_tracing_that_was_changed_is_not_used(answered, traced):
    folder, lab = answered
    (lab / "P02" / "run" / "outline.json").write_text("{}")
    assert _ingest(folder, lab).exit_code == 0
    assert traced["P02"] == 2
