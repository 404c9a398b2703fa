"""The catalogue of a lab: its table, and runs of its samples."""

import csv
import json
import shutil

import pytest

from sealtwin.core import files
from sealtwin.lab import catalogue
from sealtwin.lab.ingest import ingest
from tests.support.evidence import make_evidence
from tests.support.ingested_lab import QUIET, edit, sealtwin
from tests.support.lab_folder import FAULTS
from tests.support.report_stubs import leave_out_figures
from validate.result import TrialResult


@pytest.fixture(scope="module")
def lab(two, sound, tmp_path_factory):
    """P01 in two revisions, of which the second has results; P02; P05 with a fault."""
    folder = shutil.copytree(two / "folder", tmp_path_factory.mktemp("asking") / "folder")
    shutil.copytree(sound[0] / "P05", folder / "P05")
    next(fault for fault in FAULTS if fault.what == "two photos of one sample").plant(folder)
    lab = folder.parent / "lab"
    ingest(folder, lab, QUIET)
    files.write_text(lab / "P01" / "run" / "profile.csv", "a level")
    with (folder / "P01.csv").open("a") as sheet:
        sheet.write("11.5,-1.0,-1.0,-1.0\n")
    answer = sealtwin("ingest", folder, "--out", lab, "--quiet")
    assert answer.exit_code == 6, answer.output
    comparison = make_evidence(folder, error_mm=0.456).comparison
    result = TrialResult(name="P01", folder="run", wall_time_s=1.0, stages=("digitise",), comparison=comparison)
    files.write_json(lab / "P01@2" / "run" / "run.json", result.model_dump())
    return lab


def test_the_catalogue_has_a_row_for_each_sample_including_failed_samples(lab):
    catalogue.write_table(lab)
    with (lab / "catalogue.csv").open(newline="", encoding="utf-8") as opened:
        rows = {row["sample"]: row for row in csv.DictReader(opened)}
    assert len(rows) == 3
    assert (rows["P02"]["date"], rows["P02"]["operator"], rows["P02"]["depth_mm"]) == ("2026-05-03", "A. Muster", "8")
    assert rows["P05"]["state"] == "asked"
    assert rows["P05"]["reason"].startswith("P05/photo.png, P05/side.png: 2 files")
    assert (rows["P01"]["revision"], rows["P01"]["mean_error_mm"], rows["P01"]["result"]) == (
        "2",
        "0.456",
        "digitise done",
    )
    assert rows["P01"]["readings_sha256"] == files.sha256(lab / "P01@2" / "inputs" / "readings.csv")
    assert rows["P02"]["result"] == "digitise done"


@pytest.fixture
def ready(small, tmp_path):
    """P01 to P03 have no fault; the sheet of P04 has no unit."""
    for file in list(small.glob("P02*")):
        for name in ("P03", "P04"):
            shutil.copy(file, small / file.name.replace("P02", name))
    edit(small / "P04_Messung.csv", "[mm]", "")
    edit(small / "lab.toml", "settle_s = 0.0", "settle_s = 0.1")
    assert sealtwin("ingest", small, "--out", tmp_path / "lab", "--quiet").exit_code == 6
    return tmp_path / "lab"


def test_lab_run_continues_past_failed_samples_and_gives_their_reasons(ready, monkeypatch):
    leave_out_figures(monkeypatch)
    monkeypatch.setattr("sealtwin.core.workers.cores", lambda: 0)
    work = catalogue.run_trial

    def broken(trial, *more, **named):
        if trial.name == "P01":
            raise ZeroDivisionError("by zero")
        return work(trial, *more, **named)

    edit(ready / "P02" / "trial.toml", "trim_mm = 1.0", "trim_mm = 9.0")
    with monkeypatch.context() as patch:
        patch.setattr(catalogue, "run_trial", broken)
        first = sealtwin("lab", ready, "--device", "cpu", "--json", "--quiet")
    assert first.exit_code == 1
    samples = {one["name"]: one for one in json.loads(first.stdout)["samples"]}
    states = [one["state"] for one in samples.values()]
    assert states == ["failed", "failed", "done", "left out"]
    assert samples["P01"]["reason"].startswith("ZeroDivisionError: by zero. This is a bug; please report")
    assert "by zero" in (ready / "P01" / "run" / "fault.txt").read_text()
    assert "trim_mm" in samples["P02"]["reason"]
    assert samples["P04"]["reason"].startswith("P04_Messung.csv: column A")
    assert (ready / "P03" / "run" / "report.html").is_file()
    assert samples["P03"]["mean_error_mm"] > 0
    text = sealtwin("lab", ready, "--device", "cpu").stdout
    for words in ("P01     done", "P03     up to date", "P04     left out", "left out: P04: P04_Messung.csv: column A"):
        assert words in text
