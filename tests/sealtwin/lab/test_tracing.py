"""Tracing of samples after an ingest, and the questions about traced cracks in pairing.csv."""

import csv
import json
import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path, PurePath

import numpy as np
import pytest

from sealtwin.core import files
from sealtwin.core.doubts import Doubt, Location
from sealtwin.core.records import Profile
from sealtwin.core.run_folder import look_into
from sealtwin.lab import ingest as steps
from sealtwin.lab import tracing
from sealtwin.lab.ingest import ingest
from sealtwin.lab.tracing import PlannedTrace, trace_all
from sealtwin.trial import digitise_stage
from tests.support.ingested_lab import QUIET, answer, edit, hashes_of, pairing_rows, question, sealtwin
from tests.support.lab_folder import ENDS
from tests.support.photos import mortar, wandering, with_crack, write_png


def call_ingest(folder, lab, *more, code=0):
    """Return what the command prints."""
    answer = sealtwin("ingest", folder, "--out", lab, "--quiet", *more)
    assert answer.exit_code == code, answer.output
    return answer.stdout


@pytest.fixture
def late(small, tmp_path):
    """A photo of P02 with two cracks and without ends, and a reading of P01 beyond its crack's end."""
    one = with_crack(mortar((200, 200), seed=1), wandering([(40, 50), (160, 50)], 9.0), 12)
    write_png(small / "P02.png", with_crack(one, wandering([(40, 150), (160, 150)], 9.0), 12))
    edit(small / "lab.toml", "radius_mm = 0.45", "radius_mm = 0.3")
    edit(small / "lab.toml", f"ends_px = {ENDS}\n", "")
    with (small / "P01.csv").open("a") as sheet:
        sheet.write("40.0,-1.0,-1.0,-1.0\n")
    # Answers may be given before the first ingest.
    files.write_text(tmp_path / "lab" / "pairing.csv", f'file,role,photo.ends_px\nP01.png,photo,"{ENDS}"\n')
    return small, tmp_path / "lab"


def test_questions_about_traced_cracks_are_asked_and_answered_in_pairing_csv(late):
    """Neither sample would run before its question is answered."""
    folder, lab = late
    before = hashes_of(folder)
    assert "To answer the questions, edit" in call_ingest(folder, lab, code=6)
    assert (lab / "catalogue.csv").read_text().count(",asked,") == 4, "a row of each sample, and of each question"
    assert "which line is the crack?" in (asked := question(lab, "P02.png"))
    assert "for example photo.crack = 1" in asked
    assert Path(asked.partition("Look at ")[2].removesuffix(". Give crack = ....")).is_file(), asked
    assert question(lab, "P01.csv").startswith("P01.csv: 40 mm in A8 is outside the crack")
    assert question(lab, "P01.png") == ""
    again = call_ingest(folder, lab, code=6)
    assert sum(line.endswith(" asked") for line in again.splitlines()) == 2
    assert "sealtwin run" not in again, "none of them would run"
    answer(lab, {"P01.csv": {"skip": "8"}, "P02.png": {"crack": "2"}})
    assert "2 of 2 samples are sound" in call_ingest(folder, lab)
    rows = json.loads(call_ingest(folder, lab, "--json"))["traced"]
    assert {row["folder"]: row["sample"]["path_source"] for row in rows} == {"P01/run": "ends", "P02/run": "choice"}
    assert {row["question"] for row in pairing_rows(lab)} == {""}
    assert hashes_of(folder) == before


def test_which_line_is_the_crack_is_asked_in_the_same_round_as_a_missing_scale(late):
    folder, lab = late
    edit(folder / "lab.toml", "mm_per_px = 0.1", "")
    call_ingest(folder, lab, code=3)
    assert "which line is the crack?" in question(lab, "P02.png")
    assert "photo.mm_per_px is missing" in question(lab, "P02.png")
    assert "crack" in pairing_rows(lab)[0]


def test_remarks_that_need_the_traced_crack_are_counted_in_the_catalogue(small, tmp_path, monkeypatch):
    remark = Doubt("face", Location(PurePath("scan.ply")), "the face is stepped.", is_remark=True)
    checked = replace(Profile(np.arange(2.0), np.zeros(2)), questions=(remark,))
    for expected in ([remark], []):
        monkeypatch.setattr(steps, "check_run", lambda _, left=expected: replace(checked, questions=tuple(left)))
        ingest(small, tmp_path / "lab", QUIET, jobs=1)
        with (tmp_path / "lab" / "catalogue.csv").open(newline="", encoding="utf-8") as table:
            assert [row["remarks"] for row in csv.DictReader(table)] == [f"{len(expected)}"] * 2


def test_a_sample_that_is_paired_anew_leaves_no_ghost(waiting):
    """The earlier name stayed in the catalogue, with the words that its files are no longer in the folder."""
    folder, lab = waiting
    call_ingest(folder, lab, code=6)
    answer(lab, {name: {"sample": "Q7"} for name in ("P02.png", "P02_Messung.csv")})
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}})
    call_ingest(folder, lab)
    with (lab / "catalogue.csv").open(newline="", encoding="utf-8") as opened:
        assert [row["sample"] for row in csv.DictReader(opened)] == ["P01", "Q7"]


def test_samples_with_the_same_photo_wait_beside_each_other(waiting):
    """The earlier one lost its trial, and its folder then stood in its own way."""
    folder, lab = waiting
    for name in ("P02.png", "P02_Messung.csv"):
        shutil.copy(folder / name, folder / name.replace("P02", "P03"))
    call_ingest(folder, lab, code=6)
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}, "P03_Messung.csv": {"unit": "mm"}})
    assert "3 of 3 samples are sound" in call_ingest(folder, lab)


def test_an_answer_given_during_an_ingest_is_not_overwritten(late, monkeypatch):
    folder, lab = late
    traced = steps.trace_all

    def answered_meanwhile(*arguments, **more):
        answer(lab, {"P02.png": {"crack": "2"}})
        return traced(*arguments, **more)

    for file in (*folder.glob("P01*"), lab / "pairing.csv"):
        file.unlink()
    with monkeypatch.context() as patch:
        patch.setattr(steps, "trace_all", answered_meanwhile)
        call_ingest(folder, lab, code=6)
    trial = lab / "P02" / "trial.toml"
    assert next(row["crack"] for row in pairing_rows(lab) if row["file"] == "P02.png") == "2"
    assert "crack = 2" not in trial.read_text()
    ingest(folder, lab, QUIET)
    assert "crack = 2" in trial.read_text()


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
    """A folder whose sheet of P02 has no unit, and the path of its lab."""
    edit(small / "P02_Messung.csv", "[mm]", "")
    return small, tmp_path / "lab"


@pytest.fixture
def answered(waiting, traced):
    """P02 alone, traced and kept, with its answer in pairing.csv."""
    folder, lab = waiting
    for file in folder.glob("P01*"):
        file.unlink()
    call_ingest(folder, lab, code=3)
    assert traced == {"P02": 1}
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}})
    return folder, lab


def test_unchanged_photos_are_not_traced_again_after_an_answer(waiting, traced):
    folder, lab = waiting
    call_ingest(folder, lab, code=6)
    assert "no unit" in question(lab, "P02_Messung.csv")
    before = hashes_of(lab)
    call_ingest(folder, lab, "--dry-run", code=6)
    assert hashes_of(lab) == before
    answer(lab, {"P02_Messung.csv": {"unit": "mm"}})
    call_ingest(folder, lab)
    assert traced == {"P01": 1, "P02": 1}
    finished = look_into(lab / "P02" / "run")
    assert finished.is_current("digitise", finished.manifest["stages"]["digitise"]["key"])
    write_png(folder / "P01.png", with_crack(mortar((200, 200), seed=9), [(40, 101), (160, 98)], 20))
    call_ingest(folder, lab)
    assert traced["P01"] == 2, "another photo"
    assert "P01/run/overlay.png" in (lab / "index.html").read_text()
    assert (lab / "P01" / "run" / "overlay.png").is_file()


@pytest.mark.parametrize("name", ["trial.toml", "record.json"])
def test_an_ingest_interrupted_while_rewriting_a_trial_can_be_repeated(answered, monkeypatch, name):
    folder, lab = answered
    write = files.write_bytes

    def killed(path, content):
        if path.name == name:
            raise KeyboardInterrupt
        write(path, content)

    with monkeypatch.context() as patch:
        patch.setattr(files, "write_bytes", killed)
        call_ingest(folder, lab, code=130)
    assert "left out: P02: " in sealtwin("lab", lab, "--device", "cpu").stdout, "nor is it run before"
    assert "1 of 1 sample is sound" in call_ingest(folder, lab)


def test_a_photo_is_traced_again_if_its_stored_outline_was_changed(answered, traced):
    folder, lab = answered
    (lab / "P02" / "run" / "outline.json").write_text("{}")
    call_ingest(folder, lab)
    assert traced["P02"] == 2


def test_a_bug_in_one_photo_is_reported_without_stopping_other_photos(lab, monkeypatch):
    """The page has a picture of the traced photo, a reason for the other one, and loads nothing."""
    real = tracing.run_stages

    def burst(job, stages):
        if job.trial.name == "P02":
            return real(job, stages)
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(tracing, "run_stages", burst)
    planned = [PlannedTrace(lab / name / "trial.toml", f"{name}/run", {}) for name in ("P01", "P02")]
    rows = trace_all(planned, lab, QUIET, 1, {})
    assert [(row.folder, row.status) for row in rows] == [("P01/run", "bug"), ("P02/run", "ok")]
    assert "ZeroDivisionError: on purpose" in (lab / "P01" / "run" / "fault.txt").read_text()
    page = (lab / "index.html").read_text()
    assert page.count("data:image/jpeg;base64,") == 1
    assert "1 of 2 photos digitised" in page
    assert "http" not in page.replace("http-equiv", "")
