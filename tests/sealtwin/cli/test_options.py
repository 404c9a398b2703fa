"""Options of the command line: settings and numbers are read, or refused with the option's name."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typer

from sealtwin.cli.options import along, read_number, read_numbers, settings_of
from sealtwin.core.errors import InputError
from tests.house_rules import PACKAGES
from tests.support.paths import FIXTURE, ROOT
from tests.support.processes import commands, refusal, sealtwin
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import tiny_lab


@pytest.mark.parametrize("text", ["1,2,3", "a,b", "nan,1", ""])
def test_the_error_for_a_pair_that_is_not_two_finite_numbers_names_the_option(text):
    with pytest.raises(typer.BadParameter, match="--roi"):
        read_numbers(text, "X,Y", "--roi")


def test_a_depth_table_saved_by_a_spreadsheet_is_read(tmp_path):
    (tmp_path / "depths.csv").write_bytes("\ufeffnote;depth_mm;s_mm\r\n;12;0\r\n;16,5;40\r\n".encode())
    assert along(str(tmp_path / "depths.csv"), "--depth-mm") == [[0.0, 12.0], [40.0, 16.5]]


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("s_mm,depth_mm\n", "0 rows"),
        ("s_mm,tiefe\n0,12\n", "check depth_mm"),
        ('s_mm,depth_mm\n0,"1,250"\n', "row 2: .*1,250"),
        ("x" * 300_000, "larger than"),
    ],
)
def test_an_unusable_depth_table_is_refused_with_the_reason(tmp_path, content, named):
    (tmp_path / "depths.csv").write_text(content)
    with pytest.raises(InputError, match=rf"depths\.csv.*{named}"):
        along(str(tmp_path / "depths.csv"), "--depth-mm")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ('crack.tilt = "flare"', "flare"),
        ("path.volume_ml=1,5", 1.5),
        ("photo.path_only=true", True),
        ("note=1\nseed = 2", "1\nseed = 2"),
        ("crack.fill=fill.csv", Path("fill.csv").absolute()),
        ('crack.fill={file="fill.csv"}', {"file": Path("fill.csv").absolute()}),
        ("crack.wall_angle_deg=[4,9]", [4, 9]),
    ],
)
def test_a_value_of_the_set_option_is_read_as_toml_or_as_text(text, value):
    assert settings_of({}, [text]) == {text.partition("=")[0].strip(): value}


@pytest.mark.parametrize("text", ["crack.tilt", "=flare", "crack.=1", "a.b.c.d.e=1", "cra ck.tilt=1"])
def test_a_set_option_without_table_key_and_value_is_refused(text):
    with pytest.raises(typer.BadParameter, match=r"TABLE\.KEY=VALUE"):
        settings_of({}, [text])


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("crack.wall_angle_deg=11,8", r"11\.8 or \[11,8\]"),
        ("crack.depth_mm=5,3", r"5\.3 or \[5,3\]"),
        ("crack=3", r"crack\.KEY=VALUE"),
    ],
)
def test_an_ambiguous_value_of_the_set_option_is_refused(text, named):
    """``11,8`` may be one decimal number or left and right; ``crack=3`` would replace a whole table."""
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
def test_a_setting_that_is_given_twice_is_refused(options, others):
    with pytest.raises(typer.BadParameter, match="given twice"):
        settings_of(options, others)


@pytest.mark.parametrize(
    ("setting", "named"),
    [
        ("crack.tillt=lean", "settings of this call: crack.tillt: no such key; did you mean 'tilt'?"),
        ("path.volume_ml=1,000", "settings of this call: path.volume_ml = '1,000'"),
    ],
)
def test_settings_of_the_set_option_are_checked_like_those_of_a_trial_file(tmp_path, setting, named):
    answer = sealtwin("digitise", FIXTURE / "trial.toml", "--out", tmp_path / "run", "--set", setting)
    assert answer.exit_code == 3
    assert named in answer.stderr
    assert not (tmp_path / "run").exists()


@pytest.fixture
def lab(tmp_path, monkeypatch):
    tiny_lab(tmp_path / "lab")
    leave_out_pages(monkeypatch)
    return tmp_path / "lab"


def test_a_run_folder_stores_the_settings_of_earlier_commands(lab):
    """The same command computes nothing; another value repeats only the stages that depend on the value."""
    out = lab / "out"

    def recorded():
        return tomllib.loads((out / "trial.toml").read_text())

    def stages():
        return json.loads((out / "manifest.json").read_text())["stages"]

    line = ("run", lab / "trial.toml", "--out", out, "--device", "cpu", "--set", "crack.tilt=flare", "--seed", 5)
    assert sealtwin(*line).exit_code == 0
    assert (recorded()["crack"]["tilt"], recorded()["seed"]) == ("flare", 5)
    assert "nothing to redo" in sealtwin(*line).stderr
    before = stages()
    answer = sealtwin("simulate", out, "--device", "cpu", "--set", "seed=6")
    assert answer.exit_code == 0, answer.output
    assert (recorded()["crack"]["tilt"], recorded()["seed"]) == ("flare", 6)
    assert stages()["digitise"] == before["digitise"]
    assert stages()["simulate"]["settings"]["seed"] == 6
    (lab / "other.csv").write_bytes((lab / "readings.csv").read_bytes())
    answer = sealtwin("validate", out, "--device", "cpu", "--set", f"readings.file={lab / 'other.csv'}")
    assert answer.exit_code in (0, 5), answer.output
    assert recorded()["readings"]["file"] == "../other.csv"


def test_the_quick_command_assumes_no_setting_that_is_given(lab):
    line = ("quick", lab / "crack.png", "--mm-per-px", 0.4, "--ends", "40,101", "160,98", "--device", "cpu")
    assert sealtwin(*line, "--out", lab / "out").exit_code == 3, "without a depth"
    given = ("crack.depth_mm=8", "crack.tilt=vertical", "fluid.viscosity_pa_s=0.5", "solver.model=slot")
    options = [word for setting in given for word in ("--set", setting)]
    answer = sealtwin(*line, *options, "--seed", 3, "--out", lab / "out")
    assert answer.exit_code == 0, answer.output
    trial = tomllib.loads((lab / "out" / "trial.toml").read_text())
    assert (trial["crack"]["tilt"], trial["fluid"]["viscosity_pa_s"], trial["seed"]) == ("vertical", 0.5, 3)
    assert "U" not in trial["fluid"]
    assert "fluid.yield_stress_pa" in trial["assumed"]
    assert not {"crack.tilt", "crack.wall_angle_deg", "fluid.viscosity_pa_s"} & {*trial["assumed"]}


def test_the_set_option_of_sweep_is_accepted_only_for_settings_that_do_not_vary(lab):
    line = ("sweep", lab / "study.toml", "--out", lab / "out", "--device", "cpu", "--dry-run", "--set")
    assert sealtwin(*line, "nozzle.diameter_mm=1.9").exit_code == 0
    runs = json.loads((lab / "out" / "plan.json").read_text())["runs"]
    assert {run["trial"]["nozzle"]["diameter_mm"] for run in runs} == {1.9}
    assert "fluid.U" in runs[0]["settings"]
    # Each run's U would take the place of a viscosity.
    for name in ("fluid.U", "fluid.viscosity_pa_s"):
        assert f"--set {name}: {lab / 'study.toml'} also gives this setting" in refusal(*line, f"{name}=1")


def test_the_set_option_is_refused_for_a_setting_that_is_calibrated(lab):
    line = ("calibrate", lab / "trial.toml", "--out", lab / "out", "--device", "cpu", "--free", "fluid.U=3:30", "--set")
    named = "--set fluid.viscosity_pa_s: a --free setting replaces this setting"
    assert named in refusal(*line, "fluid.viscosity_pa_s=1")


COMMANDS = commands()
ALL_OPTIONS = {"--help", "--version"} | {
    name for command in COMMANDS.values() for parameter in command.params for name in parameter.opts if name[0] == "-"
}
OTHERS = {"--nworkers", "--nthreads", "--constraint", "--editable", "--anew"}
"""Options of Dask, of pip and of a benchmark."""


def test_every_option_and_command_that_a_text_names_exists():
    # Variables of a style sheet begin with two hyphens as well.
    drawn = {"theme.py", "charts.py"}
    code = (path for name in PACKAGES for path in (ROOT / name).rglob("*.py") if path.name not in drawn)
    pages = (ROOT / "README.md", *(ROOT / "docs").rglob("how-to/*.md"))
    texts = {
        path: path.read_text(encoding="utf-8") for path in (*code, *ROOT.glob("sealtwin/templates/*.toml"), *pages)
    }
    for pattern, names, count in (
        (r"(?<![\w(-])--[a-z][a-z-]*[a-z](?![\w:-])", ALL_OPTIONS | OTHERS, 50),
        (r"(?<='sealtwin )[a-z][a-z-]+", {*" ".join(COMMANDS).split()}, 10),
    ):
        named = {(path, name) for path, text in texts.items() for name in re.findall(pattern, text)}
        assert len(named) > count
        assert {(path, name) for path, name in named if name not in names} == set()


@pytest.mark.parametrize(
    ("name", "texts"), [("--depth-mm", "1_0 nan 1e999 \u0663 1,000 0x1"), ("--seed", "1_0 2,5 -1")]
)
def test_options_accept_a_decimal_comma_but_no_malformed_number(name, texts):
    """Exit code 3 is that of the missing photo, so that the number was read."""
    line = ("digitise", "none.png", "--mm-per-px", "0.1", "--depth-mm", "0,5")
    assert sealtwin(*line).exit_code == 3
    given = line[:-2] if name in line else line
    assert [text for text in ("", *texts.split()) if sealtwin(*given, name, text).exit_code != 2] == []


@pytest.mark.parametrize(("text", "value"), [("0,125", 0.125), ("-1,5e2", -150), (".5", 0.5), ("5.", 5), (" 12 ", 12)])
def test_numbers_with_decimal_comma_or_point_are_read(text, value):
    assert read_number(text) == value


ASIDE = """
import logging, os, warnings
from sealtwin.cli import app

def command():
    warnings.warn("aside", RuntimeWarning)
    logging.getLogger("library").warning("aside")
    print("płyta", os.environ.get("COLUMNS"))

app.app = command
app.main()
"""


@pytest.mark.parametrize(("options", "printed"), [((), b"p\\u0142yta None"), (("--json",), "płyta None".encode())])
def test_commands_print_any_character_but_no_warnings_of_libraries(options, printed, tmp_path):
    """An encoding without a letter gets an escape, as on Windows; JSON is UTF-8. COLUMNS = 0 would make help blank."""
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "COLUMNS": "0"}
    command = [sys.executable, "-c", ASIDE, *options]
    answer = subprocess.run(command, capture_output=True, cwd=tmp_path, env=environment, check=False)
    assert (answer.returncode, answer.stdout.strip(), answer.stderr) == (0, printed, b"")
