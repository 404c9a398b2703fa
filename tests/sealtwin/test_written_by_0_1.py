"""Files that version 0.1.0 wrote are read, or refused in one sentence that names the command which makes them again."""

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from sealtwin.cli.app import app
from sealtwin.core import record_files
from sealtwin.core.run_folder import look_into
from sealtwin.trial.trial_file import load_trial
from tests.pages import leave_out_pages

WRITTEN = Path(__file__).parents[2] / "fixtures" / "written-by-0.1"


@pytest.fixture
def written(tmp_path, monkeypatch) -> Path:
    """A copy of the fixture, which is also the current folder."""
    shutil.copytree(WRITTEN, tmp_path / "written")
    monkeypatch.chdir(tmp_path / "written")
    return tmp_path / "written"


@pytest.fixture
def no_pages(monkeypatch):
    """For what is made anew, whose pages are as those of any run."""
    leave_out_pages(monkeypatch)


def read_or_refused(remedy: str, *arguments: str) -> Result:
    """Run the command; it must succeed, or refuse in one sentence that names ``remedy``."""
    answer = CliRunner().invoke(app, [*arguments, "--quiet"] if arguments[0] != "lab" else arguments)
    if answer.exit_code != 0:
        (sentence,) = answer.stderr.splitlines()
        assert (answer.exit_code, sentence.startswith("sealtwin: ")) == (3, True), answer.output
        assert remedy in sentence
    return answer


def test_a_trial_file_is_read():
    trial = load_trial(WRITTEN / "trial" / "trial.toml")
    assert trial.fluid is not None
    assert (trial.name, trial.fluid.U, trial.solver.size_mm) == ("tiny", 30.0, 0.45)


def test_a_run_folder_is_read():
    folder = WRITTEN / "run"
    assert look_into(folder).settings_of("simulate") is not None
    assert record_files.read_outline(folder).length_mm == pytest.approx(14.4, abs=0.1)
    assert record_files.read_solid(folder).depth_mm == 8.0
    assert record_files.read_run(folder).device == "CPU (x86_64), Warp 1.19.0"
    assert record_files.read_trajectory(folder).duration_s > 0
    assert len(record_files.read_profile(folder).s_mm) > 10


@pytest.mark.parametrize("command", ["validate", "simulate", "film"])
def test_a_run_folder_is_taken_up(written, monkeypatch, command):
    remedy = "sealtwin run" if command == "validate" else "sealtwin simulate"
    if command == "simulate":
        leave_out_pages(monkeypatch)
    answer = read_or_refused(remedy, command, "run", *(() if command == "film" else ("--device", "cpu")))
    assert answer.exit_code == 0


def test_a_run_folder_is_brought_up_to_date_by_its_trial(written, no_pages):
    answer = read_or_refused("--out", "run", "trial/trial.toml", "--out", "run", "--device", "cpu", "--json")
    assert json.loads(answer.stdout)["stages"] == ["digitise", "simulate", "validate"]


def test_a_checkpoint_is_resumed_or_its_run_begun_again(written, no_pages):
    arguments = ["run", "trial/trial.toml", "--out", "killed", "--device", "cpu"]
    answer = CliRunner().invoke(app, arguments)
    assert answer.exit_code == 0, answer.output
    (noted,) = [line for line in answer.stderr.splitlines() if line.startswith("checkpoint.npz: ")]
    assert "after frame 25" in noted or "starts again" in noted
    assert record_files.read_run(written / "killed").spilled_particles == 0


def test_a_study_is_read_and_brought_up_to_date(written):
    read_or_refused("sealtwin sweep", "sweep", "status", "study")
    arguments = ("sweep", "trial/study.toml", "--out", "study", "--device", "cpu", "--jobs", "1", "--json")
    answer = read_or_refused("--out", *arguments)
    if answer.exit_code == 0:
        assert json.loads(answer.stdout)["states"]["done"] == 2


@pytest.mark.parametrize("arguments", [("list", "lab"), ("show", "lab", "P01"), ("export", "lab", "--out", "lab.csv")])
def test_a_catalogue_is_read(written, arguments):
    answer = read_or_refused("sealtwin ingest", "lab", *arguments)
    assert answer.exit_code != 0 or "P01" in answer.stdout + "".join(path.read_text() for path in written.glob("*.csv"))
