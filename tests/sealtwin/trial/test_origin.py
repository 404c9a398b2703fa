"""Whose readings a report judges: as the lab noted it, and no note for another sheet."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.core.files import sha256
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import RunFolder
from sealtwin.trial.job import Job
from sealtwin.trial.trial_file import load_trial
from sealtwin.trial.validate_stage import ORIGIN, RECORD, keep_origin, sheet_of
from tests.support.paths import FIXTURE


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


def test_a_sheet_is_named_as_the_lab_named_it_and_in_the_run_folder_still(job):
    sheet = present(sheet_of(job), "sheet")
    assert (sheet.name, sheet.operator, sheet.date) == ("P01 Messung.csv", "A. B.", "1.3.2026")
    keep_origin(job)
    assert "/home/a" not in (job.path / ORIGIN).read_text()
    assert sheet_of(replace(job, source=job.path)) == sheet


def test_another_sheet_than_the_lab_gave_has_no_operator(job):
    job.sheet.write_text("s_mm,level_1_mm\n0,1\n")
    sheet = present(sheet_of(job), "sheet")
    assert (sheet.name, sheet.operator) == ("readings.csv, not as the lab gave it", None)
    assert sheet.sha256 == sha256(job.sheet)


@pytest.mark.parametrize("content", [None, '{"made": "by something else"}'])
def test_a_trial_of_no_lab_has_the_name_of_its_file(job, content):
    (job.source / RECORD).unlink()
    if content is not None:
        (job.source / RECORD).write_text(content)
    sheet = present(sheet_of(job), "sheet")
    assert (sheet.name, sheet.operator, sheet.date) == ("readings.csv", None, None)
    keep_origin(job)
    assert not (job.path / ORIGIN).exists()


def test_a_record_that_somebody_broke_is_named(job):
    for files in (7, [{"role": "readings", "original": 7, "sha256": "73cf"}], [{"role": "readings"}]):
        record = {"ingested_utc": "", "files": files, "operator": None, "date": None}
        (job.source / RECORD).write_text(json.dumps(record))
        with pytest.raises(InputError, match=r"record\.json: not as its stage wrote it"):
            sheet_of(job)
