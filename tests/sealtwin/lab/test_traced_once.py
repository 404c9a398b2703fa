"""A photo is traced once: while its sample waits for answers, when they come, and in the sample's next revision."""

import json
from collections import Counter
from pathlib import Path

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


def _ingest(folder, lab, *more):
    return sealtwin("ingest", folder, "--out", lab, "--quiet", *more)


def test_rounds_of_questions_trace_no_photo_again(waiting, traced):
    folder, lab = waiting
    assert _ingest(folder, lab).exit_code == 6
    assert "no unit" in question(lab, "P02_Messung.csv")
    assert traced == {"P01": 1, "P02": 1}
    assert _ingest(folder, lab).exit_code == 6
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


def test_a_refused_photo_has_its_picture_while_its_sample_waits(waiting):
    folder, lab = waiting
    one = with_crack(mortar((200, 200), seed=1), [(40, 51), (80, 47), (120, 53), (160, 48)], 12)
    write_png(folder / "P02.png", with_crack(one, [(40, 151), (80, 147), (120, 153), (160, 148)], 12))
    (folder / "P02_Notiz.toml").write_text("crack.depth_mm = 8.0\n")
    _ingest(folder, lab)
    asked = question(lab, "P02.png")
    assert Path(asked.partition("Look at ")[2].rpartition(".")[0]).is_file(), asked


@pytest.mark.parametrize("written", [1, 5, 9])
def test_a_process_killed_while_it_copies_a_tracing_leaves_none(waiting, traced, monkeypatch, written):
    folder, lab = waiting
    _ingest(folder, lab)
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}})
    left = [written]
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


def test_a_kept_tracing_that_was_changed_is_not_used(waiting, traced):
    folder, lab = waiting
    _ingest(folder, lab)
    next(lab.glob(".traced/*/P02/outline.json")).write_text("{}")
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}})
    assert _ingest(folder, lab).exit_code == 0
    assert traced["P02"] == 2
