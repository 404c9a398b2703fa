"""Run folders side by side."""

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sealtwin import files
from sealtwin.cli import app
from sealtwin.comparing import compare_runs
from sealtwin.errors import InputError
from sealtwin.folder import open_folder
from sealtwin.job import start_job
from sealtwin.pipeline import run_stages
from sealtwin.progress import Progress
from sealtwin.trial import load_trial
from tests.studies import tiny_lab
from validate.caliper import read_readings
from validate.compare import compare


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A tiny run, compared; no report is drawn."""
    lab = tiny_lab(tmp_path_factory.mktemp("lab")).parent
    path = tmp_path_factory.mktemp("runs") / "first"
    trial = load_trial(lab / "trial.toml")
    with open_folder(path, create=True) as folder:
        run_stages(start_job(trial, lab, folder, "cpu", Progress()), ("digitise", "simulate"))
    hold(path)
    return path


def hold(path: Path) -> None:
    trial = load_trial(path / "trial.toml")
    assert trial.readings is not None
    outline, solid = files.read_outline(path), files.read_solid(path)
    readings = read_readings(path / trial.readings.file, trial.readings, outline.length_mm, solid.depth_mm)
    found = compare(
        files.read_profile(path), readings, outline, solid, role=trial.readings.role, photo_data=trial.sample.data
    )
    files.write_comparison(path, found)


@pytest.fixture
def other(run, tmp_path):
    """The same with another U in its trial."""
    path = tmp_path / "second"
    shutil.copytree(run, path)
    trial = path / "trial.toml"
    text = trial.read_text(encoding="utf-8")
    assert "U = 30.0" in text
    trial.write_text(text.replace("U = 30.0", "U = 3.0"), encoding="utf-8")
    return path


def test_runs_are_told_apart_by_what_differs(run, other, tmp_path):
    """Two trials of one name get their folders behind it; the one setting that was changed is what is told."""
    compared = compare_runs([run, other], tmp_path / "page")
    content = json.loads((tmp_path / "page" / "compare.json").read_text(encoding="utf-8"))
    assert content == json.loads(json.dumps(compared.content))
    assert content["differing"] == {"fluid.U": [30.0, 3.0]}
    assert [each["name"] for each in content["runs"]] == [f"tiny ({run})", f"tiny ({other})"]
    assert content["runs"][0]["mean_error_mm"] == files.read_json(run / "comparison.json")["mean_error_mm"]
    assert all((tmp_path / "page" / name).is_file() for name in content["files"])
    assert content["replicates"][0].startswith("No area validation metric")


def test_another_sheet_with_the_same_settings_is_a_replicate(run, tmp_path):
    """The same settings with readings of their own; with another nozzle's speed it is another trial."""
    path = tmp_path / "second"
    shutil.copytree(run, path)
    sheet = path / "inputs" / "readings.csv"
    sheet.write_text("s_mm,level_1_mm\n1,-3\n4,-3\n7,-2\n11,-2\n", encoding="utf-8")
    hold(path)
    (told,) = compare_runs([run, path], tmp_path / "page").content["replicates"]
    assert "over 2 replicates" in told
    trial = path / "trial.toml"
    text = trial.read_text(encoding="utf-8")
    assert "speed_mm_s = 20.0" in text
    trial.write_text(text.replace("speed_mm_s = 20.0", "speed_mm_s = 21.0"), encoding="utf-8")
    (told,) = compare_runs([run, path], tmp_path / "page").content["replicates"]
    assert told.startswith("No area validation metric")


def test_what_is_no_finished_run_is_refused_by_name(run, other, tmp_path):
    with pytest.raises(InputError, match="nowhere: no run folder"):
        compare_runs([run, tmp_path / "nowhere"], tmp_path / "page")
    with pytest.raises(InputError, match="named twice"):
        compare_runs([run, run], tmp_path / "page")
    (other / "comparison.json").unlink()
    with pytest.raises(InputError, match="second: not held against its readings yet"):
        compare_runs([run, other], tmp_path / "page")
    (other / "profile.csv").unlink()
    with pytest.raises(InputError, match="second: not simulated yet"):
        compare_runs([run, other], tmp_path / "page")


def test_the_command_wants_two_runs(run, other, tmp_path):
    asked = CliRunner().invoke(app, ["compare", str(run), str(other), "--out", str(tmp_path / "page"), "--json"])
    assert asked.exit_code == 0, asked.output
    assert json.loads(asked.stdout)["differing"] == {"fluid.U": [30.0, 3.0]}
    assert CliRunner().invoke(app, ["compare", str(run)]).exit_code == 2
