"""Settings on the command line: --set and the options of every day."""

import json
import re
import tomllib
from pathlib import Path

import pytest
import typer

from sealtwin.cli.options import settings_of
from tests.support.paths import FIXTURE
from tests.support.processes import commands, sealtwin
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import tiny_lab


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("crack.tilt=flare", "flare"),
        ('crack.tilt = "flare"', "flare"),
        ("path.volume_ml=1,5", 1.5),
        ("photo.path_only=true", True),
        ("photo.ruler_px=[[0,0],[100,0]]", [[0, 0], [100, 0]]),
        ("note=1\nseed = 2", "1\nseed = 2"),
        ("photo.mask=b.png", Path("b.png").absolute()),
        ("crack.fill=fill.csv", Path("fill.csv").absolute()),
        ('crack.fill={file="fill.csv"}', {"file": Path("fill.csv").absolute()}),
        ("crack.wall_angle_deg=[4,9]", [4, 9]),
    ],
)
def test_a_value_is_read_as_in_toml_or_as_a_bare_word(text, value):
    assert settings_of({}, [text]) == {text.partition("=")[0].strip(): value}


def test_no_help_has_brackets_that_a_terminal_takes_as_markup():
    """Broken on purpose with "needs sealtwin[cluster]", a terminal shows "needs sealtwin"."""
    helps = [getattr(one, "help", "") or "" for command in commands().values() for one in (command, *command.params)]
    assert len(helps) > 100
    assert [text for text in helps if re.search(r"\[/?[a-zA-Z@#]", text)] == []


@pytest.mark.parametrize("text", ["crack.tilt", "=flare", "crack.=1", "a.b.c.d.e=1", "cra ck.tilt=1"])
def test_what_names_no_setting_is_refused(text):
    with pytest.raises(typer.BadParameter, match=r"TABLE\.KEY=VALUE"):
        settings_of({}, [text])


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("crack.wall_angle_deg=11,8", r"11\.8 or \[11,8\]"),
        ("crack.depth_mm=5,3", r"5\.3 or \[5,3\]"),
        ("nozzle={diameter_mm=2}", r"nozzle\.KEY=VALUE"),
        ("crack=3", r"crack\.KEY=VALUE"),
    ],
)
def test_what_is_easily_misread_is_refused(text, named):
    """``--wall-angle-deg 11,8`` was left and right; a table of 'quick' was lost beside what it assumes."""
    with pytest.raises(typer.BadParameter, match=named):
        settings_of({}, [text])


@pytest.mark.parametrize(
    ("options", "others"),
    [
        ({}, ["crack.tilt=lean", "crack.tilt=flare"]),
        ({"crack.depth_mm": "8"}, ["crack.depth_mm=9"]),
        ({}, ["photo.markers.size_mm=8", "photo.markers=frame.toml"]),
    ],
)
def test_a_setting_is_given_once(options, others):
    with pytest.raises(typer.BadParameter, match="given twice"):
        settings_of(options, others)


@pytest.mark.parametrize(
    ("setting", "named"),
    [
        ("crack.tilt=steep", "settings of this call: crack.tilt = 'steep': "),
        ("crack.tillt=lean", "settings of this call: crack.tillt: no such key; did you mean 'tilt'?"),
        ("crack.depth_mm=[[0,5],[9,900]]", "settings of this call: crack.depth_mm.1.1 = 900"),
        ("path.volume_ml=1,000", "settings of this call: path.volume_ml = '1,000'"),
        ("path.volume_ml=nan", "settings of this call: path.volume_ml = nan"),
        ("photo.edge_fraction=\u0663", "settings of this call: photo.edge_fraction = '\u0663'"),
    ],
)
def test_a_setting_is_checked_as_in_a_trial_file(tmp_path, setting, named):
    answer = sealtwin("digitise", FIXTURE / "trial.toml", "--out", tmp_path / "run", "--set", setting)
    assert answer.exit_code == 3
    assert named in answer.stderr
    assert not (tmp_path / "run").exists()


@pytest.fixture
def lab(tmp_path, monkeypatch):
    tiny_lab(tmp_path / "lab")
    leave_out_pages(monkeypatch)
    return tmp_path / "lab"


def test_a_run_records_what_was_set_and_goes_on_from_there(lab):
    """The same command redoes nothing; another value makes the stages anew that it concerns."""
    out = lab / "out"
    line = ("run", lab / "trial.toml", "--out", out, "--device", "cpu", "--set", "crack.tilt=flare", "--seed", 5)
    assert sealtwin(*line).exit_code == 0
    recorded = tomllib.loads((out / "trial.toml").read_text())
    assert (recorded["crack"]["tilt"], recorded["seed"]) == ("flare", 5)
    assert "nothing to redo" in sealtwin(*line).stderr
    stages = json.loads((out / "manifest.json").read_text())["stages"]
    answer = sealtwin("simulate", out, "--device", "cpu", "--set", "seed=6")
    assert answer.exit_code == 0, answer.output
    recorded = tomllib.loads((out / "trial.toml").read_text())
    assert (recorded["crack"]["tilt"], recorded["seed"]) == ("flare", 6)
    again = json.loads((out / "manifest.json").read_text())["stages"]
    assert again["digitise"] == stages["digitise"]
    assert again["simulate"]["settings"]["seed"] == 6
    refused = sealtwin("simulate", out, "--set", "crack.tilt=lean")
    assert refused.exit_code == 3
    assert "[crack] differs from the settings of digitise here" in refused.stderr
    assert tomllib.loads((out / "trial.toml").read_text()) == recorded
    (lab / "other.csv").write_bytes((lab / "readings.csv").read_bytes())
    answer = sealtwin("validate", out, "--device", "cpu", "--set", f"readings.file={lab / 'other.csv'}")
    assert answer.exit_code in (0, 5), answer.output
    assert tomllib.loads((out / "trial.toml").read_text())["readings"]["file"] == "inputs/other.csv"
    assert (out / "inputs" / "other.csv").is_file()


def test_a_quick_trial_assumes_nothing_that_is_given(lab):
    line = ("quick", lab / "crack.png", "--mm-per-px", 0.4, "--ends", "40,101", "160,98", "--device", "cpu")
    assert sealtwin(*line, "--out", lab / "out").exit_code == 2, "without a depth"
    given = ("crack.depth_mm=8", "crack.tilt=vertical", "fluid.viscosity_pa_s=0.5", "solver.model=slot")
    options = [word for setting in given for word in ("--set", setting)]
    answer = sealtwin(*line, *options, "--seed", 3, "--out", lab / "out")
    assert answer.exit_code == 0, answer.output
    text = (lab / "out" / "trial.toml").read_text()
    trial = tomllib.loads(text)
    assert (trial["crack"]["tilt"], trial["fluid"]["viscosity_pa_s"], trial["seed"]) == ("vertical", 0.5, 3)
    assert "U" not in trial["fluid"]
    for name in ("crack.tilt", "fluid.U", "fluid.viscosity_pa_s"):
        assert f"{name} = " not in trial["note"]
    assert 'tilt = "vertical"\n' in text


def test_a_study_starts_from_the_trial_with_what_is_set(lab):
    line = ("sweep", lab / "study.toml", "--out", lab / "out", "--device", "cpu", "--dry-run", "--set")
    assert sealtwin(*line, "nozzle.diameter_mm=1.9").exit_code == 0
    runs = json.loads((lab / "out" / "plan.json").read_text())["runs"]
    assert {run["trial"]["nozzle"]["diameter_mm"] for run in runs} == {1.9}
    assert "fluid.U" in runs[0]["settings"]
    # Each run's U would take the place of a viscosity.
    for name in ("fluid.U", "fluid.viscosity_pa_s"):
        twice = sealtwin(*line, f"{name}=1")
        assert twice.exit_code == 3
        assert f"--set {name}: {lab / 'study.toml'} also sets this setting" in twice.stderr


def test_what_a_calibration_finds_removes_nothing_that_is_set(lab):
    line = ("calibrate", lab / "trial.toml", "--out", lab / "out", "--device", "cpu", "--free", "fluid.U=3:30", "--set")
    refused = sealtwin(*line, "fluid.viscosity_pa_s=1")
    assert refused.exit_code == 3
    assert "--set fluid.viscosity_pa_s: a --free setting replaces it" in refused.stderr
