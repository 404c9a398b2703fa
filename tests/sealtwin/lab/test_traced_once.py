"""A photo is traced once: while its sample waits for answers, when they come, and in the sample's next revision."""

import json
from collections import Counter

import pytest

from sealtwin.core import run_folder
from sealtwin.core.run_folder import look_into
from sealtwin.trial import digitise_stage
from tests.labs import answer, edit, hashes_of, question, sealtwin
from tests.pictures import mortar, with_crack, write_png


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
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}})
    assert _ingest(folder, lab).exit_code == 0
    assert traced == {"P01": 1, "P02": 1}
    assert not (lab / ".traced").exists()
    finished = look_into(lab / "P02" / "run")
    assert finished.is_current("digitise", finished.manifest["stages"]["digitise"]["key"])
    with (folder / "P01.csv").open("a") as sheet:
        sheet.write("11.5,-1.1,-1.1,-1.0\n")
    assert _ingest(folder, lab).exit_code == 0
    assert (lab / "P01@2" / "run" / "overlay.png").is_file()
    assert traced == {"P01": 1, "P02": 1}, "a new revision with the same photo"
    write_png(folder / "P01.png", with_crack(mortar((200, 200), seed=9), [(40, 101), (160, 98)], 20))
    _ingest(folder, lab)
    assert traced["P01"] == 2, "another photo"


def test_a_process_killed_while_it_copies_a_tracing_leaves_none(answered, traced, monkeypatch):
    folder, lab = answered
    left = [5]
    write = run_folder.write_bytes

    def killed(path, content):
        left[0] -= 1
        if not left[0]:
            path.write_bytes(content[: len(content) // 2])
            raise KeyboardInterrupt
        write(path, content)

    with monkeypatch.context() as patch:
        patch.setattr(run_folder, "write_bytes", killed)
        assert _ingest(folder, lab).exit_code == 130
    assert json.loads((lab / "P02" / "run" / "manifest.json").read_text())["stages"] == {}
    assert _ingest(folder, lab).exit_code == 0
    assert traced["P02"] == 1
    finished = look_into(lab / "P02" / "run")
    assert not finished.edited("digitise")


def test_a_kept_tracing_that_was_changed_is_not_used(answered, traced):
    folder, lab = answered
    next(lab.glob(".traced/*/P02/run/outline.json")).write_text("{}")
    assert _ingest(folder, lab).exit_code == 0
    assert traced["P02"] == 2
