"""'sealtwin lab run' runs all sound samples: a failure or a bug costs no other, questions are left out."""

import json
import shutil

import pytest

from sealtwin.lab import catalogue
from sealtwin.lab.catalogue import latest_trials
from tests.support.ingested_lab import edit, sealtwin
from tests.support.report_stubs import leave_out_figures


@pytest.fixture
def ready(small, tmp_path):
    """P01 to P03 are sound; P04 has no unit in its sheet."""
    for file in list(small.glob("P02*")):
        for name in ("P03", "P04"):
            shutil.copy(file, small / file.name.replace("P02", name))
    edit(small / "P04_Messung.csv", "[mm]", "")
    edit(small / "lab.toml", "substeps = 2", "substeps = 2\nsettle_s = 0.1")
    assert sealtwin("ingest", small, "--out", tmp_path / "lab", "--quiet").exit_code == 6
    return tmp_path / "lab"


def test_all_sound_samples_are_run_once_and_the_others_named(ready, monkeypatch):
    leave_out_figures(monkeypatch)
    monkeypatch.setattr("sealtwin.core.cluster.cores", lambda: 0)
    work = catalogue.run_trial

    def broken(trial, *more, **named):
        if trial.name == "P01":
            raise ZeroDivisionError("by zero")
        return work(trial, *more, **named)

    edit(ready / "P02" / "trial.toml", "trim_mm = 1.0", "trim_mm = 9.0")
    with monkeypatch.context() as patch:
        patch.setattr(catalogue, "run_trial", broken)
        first = sealtwin("lab", "run", ready, "--device", "cpu", "--json", "--quiet")
    assert first.exit_code == 1
    samples = {one["name"]: one for one in json.loads(first.stdout)["samples"]}
    states = [one["state"] for one in samples.values()]
    assert states == ["failed", "failed", "done", "left out"]
    assert samples["P01"]["reason"].startswith("ZeroDivisionError: by zero. A bug: please report")
    assert "by zero" in (ready / "P01" / "run" / "fault.txt").read_text()
    assert "trim_mm" in samples["P02"]["reason"]
    assert samples["P04"]["reason"].startswith("P04_Messung.csv: column A")
    assert (ready / "P03" / "run" / "report.html").is_file()
    assert samples["P03"]["mean_error_mm"] > 0
    text = sealtwin("lab", "run", ready, "--device", "cpu").stdout
    for words in ("P01     done", "P03     up to date", "P04     left out", "left out: P04: P04_Messung.csv: column A"):
        assert words in text


def test_a_sample_that_was_removed_with_its_questions_is_not_run(ready, small):
    for file in small.glob("P0[14]*"):
        file.unlink()
    sealtwin("ingest", small, "--out", ready, "--quiet")
    faults = {fault.name: fault.sentence for fault in latest_trials(ready)[1]}
    assert "open questions" in faults.pop("P04")
    assert not faults


def test_options_of_another_action_are_refused(two):
    for action, *rest in (("list", "--jobs", "2"), ("list", "--device", "cpu"), ("run", "P01")):
        assert sealtwin("lab", action, two / "lab", *rest).exit_code == 2
