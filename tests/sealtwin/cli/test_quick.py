"""'sealtwin quick': from a photo and a depth to a report that lists all assumptions."""

import json
import tomllib

import pytest
from typer.testing import CliRunner

from sealtwin.cli.app import app
from sealtwin.trial.starter_files import QUICK
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import READINGS, tiny_lab

GIVEN = {"--depth-mm": ["8"], "--mm-per-px": ["0,4"], "--ends": ["40,101", "160,98"], "--device": ["cpu"]}


@pytest.fixture
def lab(tmp_path, monkeypatch):
    tiny_lab(tmp_path / "lab")
    (tmp_path / "lab" / "caliper.csv").write_text(READINGS.replace("11,-1", "40,-1").replace("7,-1", "20,-1"))
    leave_out_pages(monkeypatch)
    return tmp_path / "lab"


def _quick(lab, *more):
    """Run with the options of ``GIVEN``, of which ``more`` may replace one."""
    given = [word for name, values in GIVEN.items() if name not in more for word in (name, *values)]
    return CliRunner().invoke(app, ["quick", str(lab / "crack.png"), *given, "--out", str(lab / "out"), *more])


def test_the_quick_command_writes_a_report_and_lists_the_assumed_settings(lab):
    """A trial that quick wrote with other ends is overwritten; a trial that the user edited is not."""
    assert _quick(lab, "--ends", "5,5", "20,190").exit_code == 3
    assert (lab / "out" / "trial.toml").is_file()
    answer = _quick(lab, "--caliper", str(lab / "caliper.csv"), "--json")
    assert answer.exit_code == 0, answer.output
    out = lab / "out"
    assert {"crack.stl", "trajectory.csv", "particles.csv", "report.json"} <= {
        file.name for file in (out / "run").iterdir()
    }
    result = json.loads(answer.stdout)
    assert result["stages"] == ["digitise", "simulate", "validate"]
    assert result["comparison"]["role"] == result["sample"]["data"] == "undeclared"
    text = (out / "trial.toml").read_text()
    trial = tomllib.loads(text)
    assert (trial["photo"]["file"], trial["readings"]["file"]) == ("../crack.png", "../caliper.csv")
    for name, value in QUICK.items():
        table, _, key = name.partition(".")
        assert trial[table][key] == value
        assert f"{name} = " in answer.stderr
        assert f"{name} = " in trial["note"]
    assert "# assumed" not in next(line for line in text.splitlines() if "mm_per_px" in line)
    again = CliRunner().invoke(app, ["run", str(out / "trial.toml"), "--out", str(out / "run"), "--device", "cpu"])
    assert "nothing to redo" in again.stderr
    written = out / "trial.toml"
    written.write_text(edited := text.replace("viscosity_pa_s = 0.3", "viscosity_pa_s = 0.2"))
    assert edited != text
    refused = _quick(lab)
    assert refused.exit_code == 3
    assert "you wrote or edited this file, so it is not overwritten" in refused.stderr
    assert written.read_text() == edited


@pytest.mark.parametrize(
    ("more", "named"),
    [(("--caliper", "none.csv"), "none.csv: no such file"), (("--mm-per-px", "9"), "photo.mm_per_px = 9.0: ")],
)
def test_the_quick_command_with_unusable_input_leaves_no_output_folder(lab, more, named):
    answer = _quick(lab, *more)
    assert answer.exit_code == 3
    assert named in answer.stderr
    assert not (lab / "out").exists()
