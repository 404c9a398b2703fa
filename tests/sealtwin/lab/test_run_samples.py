"""'sealtwin lab run' runs all sound samples: a failure costs no other, questions are left out."""

import json
import shutil

import pytest

from sealtwin.lab import run_samples
from tests.labs import edit, sealtwin
from tests.pages import leave_out_figures, leave_out_pdf


@pytest.fixture
def ready(small, tmp_path, monkeypatch):
    """P01 and P02 are sound; P03 has P02's files, and no unit in its sheet."""
    leave_out_figures(monkeypatch)
    leave_out_pdf(monkeypatch)
    for file in list(small.glob("P02*")):
        shutil.copy(file, small / file.name.replace("P02", "P03"))
    edit(small / "P03_Messung.csv", "[mm]", "")
    assert sealtwin("ingest", small, "--out", tmp_path / "lab", "--quiet").exit_code == 6
    return tmp_path / "lab"


def test_all_sound_samples_are_run_once_and_the_others_named(ready, monkeypatch):
    monkeypatch.setattr("sealtwin.core.cluster.cores", lambda: 0)
    edit(ready / "P02" / "trial.toml", "radius_mm = 0.45", "radius_mm = 0.9")
    first = sealtwin("lab", "run", ready, "--device", "cpu", "--json", "--quiet")
    assert first.exit_code == 6
    samples = {one["name"]: one for one in json.loads(first.stdout)["samples"]}
    assert {name: one["state"] for name, one in samples.items()} == {"P01": "done", "P02": "failed", "P03": "left out"}
    assert "fewer than 2 particles fit abreast" in samples["P02"]["reason"]
    assert samples["P03"]["reason"].startswith("P03_Messung.csv, line 1:")
    assert (ready / "P01" / "run" / "report.html").is_file()
    assert samples["P01"]["mean_error_mm"] > 0
    edit(ready / "P02" / "trial.toml", "radius_mm = 0.9", "radius_mm = 0.45")
    text = sealtwin("lab", "run", ready, "--device", "cpu").stdout
    for words in ("P01     up to date", "P02     done", "P03     left out", "left out: P03: P03_Messung.csv, line 1"):
        assert words in text


def test_a_bug_in_one_run_stops_no_other(ready, monkeypatch):
    work = run_samples.run_trial

    def broken(trial, *more, **named):
        if trial.name == "P01":
            raise ZeroDivisionError("by zero")
        return work(trial, *more, **named)

    monkeypatch.setattr(run_samples, "run_trial", broken)
    monkeypatch.setattr("sealtwin.core.cluster.cores", lambda: 0)
    answer = sealtwin("lab", "run", ready, "--device", "cpu")
    assert answer.exit_code == 1
    assert "P02     done" in answer.stdout
    assert "failed: P01: ZeroDivisionError: by zero. A bug: please report" in answer.stdout
    assert "by zero" in (ready / "P01" / "run" / "fault.txt").read_text()


@pytest.mark.parametrize("arguments", [("list", "--jobs", "2"), ("list", "--device", "cpu"), ("run", "P01")])
def test_options_of_another_action_are_refused(ready, arguments):
    action, *rest = arguments
    assert sealtwin("lab", action, ready, *rest).exit_code == 2
