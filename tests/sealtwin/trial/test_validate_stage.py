"""Readings of a trial: their origin, and doubts about them."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sealtwin.cli.app import app
from sealtwin.core.errors import InputError, present
from sealtwin.core.files import sha256
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import RunFolder
from sealtwin.trial.job import Job
from sealtwin.trial.trial_file import load_trial
from sealtwin.trial.validate_stage import ORIGIN, RECORD, keep_origin, sheet_of
from tests.support.paths import FIXTURE
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import run_tiny


@pytest.fixture
def job(tmp_path) -> Job:
    """The fixture's trial as a lab's ingest leaves it, about to be run elsewhere."""
    source, run = tmp_path / "lab", tmp_path / "run"
    (source / "inputs").mkdir(parents=True)
    run.mkdir()
    sheet = source / "inputs" / "readings.csv"
    sheet.write_bytes((FIXTURE / "caliper.csv").read_bytes())
    file = {"role": "readings", "original": "P01 Messung.csv", "kept_as": "inputs/readings.csv"}
    file["sha256"] = sha256(sheet)
    record = {"ingested_utc": "2026", "source": "/home/a", "files": [file], "operator": "A. B.", "date": "1.3.2026"}
    (source / RECORD).write_text(json.dumps(record))
    trial = load_trial(FIXTURE / "trial.toml")
    readings = present(trial.readings, "readings").model_copy(update={"file": Path("inputs/readings.csv")})
    trial = trial.model_copy(update={"readings": readings})
    return Job(trial, source, RunFolder(run, {"version": 1, "stages": {}}), sheet, "cpu", Progress())


def test_the_original_file_name_of_a_sheet_is_stored_in_the_run_folder(job):
    sheet = present(sheet_of(job), "sheet")
    assert (sheet.name, sheet.operator, sheet.date) == ("P01 Messung.csv", "A. B.", "1.3.2026")
    keep_origin(job)
    assert "/home/a" not in (job.path / ORIGIN).read_text()
    assert sheet_of(replace(job, source=job.path)) == sheet


def test_a_damaged_record_of_an_ingest_is_refused(job):
    for files in (7, [{"role": "readings", "original": 7, "sha256": "73cf"}], [{"role": "readings"}]):
        record = {"ingested_utc": "", "files": files, "operator": None, "date": None}
        (job.source / RECORD).write_text(json.dumps(record))
        with pytest.raises(InputError, match=r"record\.json: the content is not what its stage wrote"):
            sheet_of(job)


SHEET = """s_mm,level_1_mm,level_2_mm,level_3_mm
1,-2.0,-2.1,-1.95
4,-2.05,0.00,-2.0
7,-1.9,-2.0,-1.85
11,-1.95,-2.0,-2.05
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A finished run folder whose readings have a 0 for a missing one in cell C3."""
    leave_out_pages(monkeypatch)
    path = run_tiny(tmp_path)
    (path / "inputs" / "readings.csv").write_text(SHEET)
    return path


def _warnings(run) -> str:
    """Return what 'sealtwin validate --quiet' writes beside its answer, on one line."""
    answer = CliRunner().invoke(app, ["validate", str(run), "--quiet"])
    assert answer.exit_code == 0, answer.output
    return " ".join(answer.stderr.split())


def test_a_doubtful_reading_gives_a_warning_until_the_trial_confirms_the_cell(run):
    narration = _warnings(run)
    for words in ("warning:", "cell C3: 0 mm at s = 4 mm", 'readings.as_written = ["C3"]'):
        assert words in narration
    trial = run / "trial.toml"
    trial.write_text(trial.read_text().replace("[readings]\n", '[readings]\nas_written = ["C3"]\n'))
    assert "cell C3" not in _warnings(run)
