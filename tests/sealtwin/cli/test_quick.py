"""'sealtwin quick': from a photo and a depth to a report that lists all assumptions."""

import json
import re
import tomllib

import pytest
from typer.testing import CliRunner

from sealtwin.cli.app import app
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.record_files import read_trajectory
from sealtwin.core.run_folder import open_folder
from sealtwin.trial.job import SIMULATED, made_by, start_job
from sealtwin.trial.starter_files import SEALANT
from sealtwin.trial.trial_file import UNMEASURED, load_trial
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import READINGS, tiny_lab

GIVEN = {"--depth-mm": ["8"], "--mm-per-px": ["0,4"], "--ends": ["40,101", "160,98"]}


@pytest.fixture
def lab(tmp_path, monkeypatch):
    tiny_lab(tmp_path / "lab")
    (tmp_path / "lab" / "caliper.csv").write_text(READINGS.replace("11,-1", "40,-1").replace("7,-1", "20,-1"))
    leave_out_pages(monkeypatch)
    return tmp_path / "lab"


def _quick(lab, *more):
    """Run with the options of ``GIVEN``, of which ``more`` may replace one."""
    given = {name: values for name, values in (GIVEN | {"--device": ["cpu"]}).items() if name not in more}
    return CliRunner().invoke(app, ["quick", str(lab / "crack.png"), *_words(given), "--out", str(lab / "out"), *more])


def _words(options):
    return [word for name, values in options.items() for word in (name, *values)]


def test_the_quick_command_writes_a_report_and_names_what_was_assumed(lab):
    assert _quick(lab, "--ends", "5,5", "20,190").exit_code == 3
    answer = _quick(lab, "--caliper", str(lab / "caliper.csv"), "--json")
    assert answer.exit_code == 0, answer.output
    out, result = lab / "out", json.loads(answer.stdout)
    assert {"crack.stl", "trajectory.csv", "particles.csv", "report.json"} <= {file.name for file in out.iterdir()}
    assert result["stages"] == ["digitise", "simulate", "validate"]
    assert result["comparison"]["role"] == result["sample"]["data"] == "undeclared"
    trial = tomllib.loads((out / "trial.toml").read_text())
    assert trial["photo"]["file"] == "../crack.png"
    assert {*SEALANT, *UNMEASURED} == {*trial["assumed"]}
    assert len(result["assumed"]) == len(trial["assumed"]) + 3  # Origins of photo and readings, use of the readings
    again = CliRunner().invoke(app, ["run", str(out / "trial.toml"), "--device", "cpu"])
    assert "nothing to redo" in again.stderr
    assert _quick(lab, "--caliper", str(lab / "caliper.csv")).exit_code == 0


def test_each_remedy_names_the_trial_file_that_the_user_has(lab):
    """The run folder's own copy stays as it was when somebody edits the trial in the lab's folder."""
    answer = _quick(lab)
    assert answer.exit_code == 0, answer.output
    assert f"'sealtwin run {lab / 'out' / 'trial.toml'}'" in answer.stdout, "a quick run has assumed values to correct"
    faster = ("--set", "path.speed_mm_s=19", "--out", str(lab / "faster"), "--device", "cpu")
    answer = CliRunner().invoke(app, ["run", str(lab / "out" / "trial.toml"), *faster])
    assert f"'sealtwin run {lab / 'faster' / 'trial.toml'}'" in answer.stdout, "only that trial has the new speed"
    assert "no snapshot" not in answer.stderr, "nobody asked for the times of the default"
    trial = lab / "trial.toml"
    run = ("run", str(trial), "--out", str(lab / "run"), "--device", "cpu")
    assert CliRunner().invoke(app, run).exit_code == 0
    with open_folder(lab / "run", create=False) as folder:
        edited = load_trial(trial, {"fluid.U": 4.0})
        job = start_job(edited, lab, folder, "cpu", Progress(), trial)
        with pytest.raises(InputError, match=re.escape(f"'sealtwin run {trial}'")):
            made_by(job, "simulate", SIMULATED)


def test_a_trial_that_the_user_edited_is_run_in_its_folder_and_never_replaced(lab):
    digitised = CliRunner().invoke(app, ["digitise", str(lab / "crack.png"), *_words(GIVEN), "--out", str(lab / "out")])
    assert digitised.exit_code == 0, digitised.output
    written = lab / "out" / "trial.toml"
    written.write_text(edited := written.read_text().replace("speed_mm_s = 4.0", "speed_mm_s = 8.0  # faster"))
    assert "faster" in edited
    refused = _quick(lab)
    assert refused.exit_code == 3
    assert written.read_text() == edited
    assert CliRunner().invoke(app, ["digitise", str(written)]).exit_code == 0
    assert written.read_text() == edited
    assert read_trajectory(lab / "out").speed_mm_s.max() == 8.0


@pytest.mark.parametrize(
    ("more", "named"),
    [(("--caliper", "none.csv"), "none.csv: not found"), (("--mm-per-px", "9"), "--mm-per-px = 9: ")],
)
def test_the_quick_command_with_unusable_input_leaves_no_output_folder(lab, more, named):
    answer = _quick(lab, *more)
    assert answer.exit_code == 3
    assert named in answer.stderr
    assert not (lab / "out").exists()
