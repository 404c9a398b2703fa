"""Options of the command line: settings and numbers are read, or refused with the option's name."""

import json
import os
import re
import subprocess
import sys
import tomllib
from itertools import pairwise
from pathlib import Path

import pytest
import typer

from sealtwin.cli.options import FLUID, PHOTO, along, read_value, settings_of
from sealtwin.core.errors import InputError
from sealtwin.trial.starter_files import begin_trial
from sealtwin.trial.trial_file import UNMEASURED, load_trial, trial_text
from tests.house_rules import PACKAGES
from tests.support.paths import FIXTURE, ROOT
from tests.support.processes import commands, refusal, sealtwin
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import tiny_lab


def test_a_depth_table_saved_by_a_spreadsheet_is_read(tmp_path):
    (tmp_path / "depths.csv").write_bytes("\ufeffdepth_mm;s_mm\r\n12;0\r\n16,5;40\r\n".encode())
    assert along(str(tmp_path / "depths.csv"), "depth_mm") == [[0.0, 12.0], [40.0, 16.5]]


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("s_mm,depth_mm\n", "0 rows"),
        ("s_mm,tiefe\n0,12\n", "column 'tiefe'"),
        ('s_mm,depth_mm\n0,"1,250"\n', "1,250.* thousands"),
        ("s_mm,depth_mm\n0,12 cm\n", "row 2, column depth_mm: '12 cm'"),
        ("x" * 300_000, "larger than"),
    ],
)
def test_an_unusable_depth_table_is_refused_with_the_reason(tmp_path, content, named):
    (tmp_path / "depths.csv").write_text(content)
    with pytest.raises(InputError, match=rf"depths\.csv.*{named}"):
        along(str(tmp_path / "depths.csv"), "depth_mm")


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
    assert {*trial["assumed"]} == {"fluid.freeze_after_s", *UNMEASURED} - {"crack.tilt", "crack.wall_angle_deg"}
    assert trial["fluid"]["yield_stress_pa"] == 0.0


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


TEXTS = {
    **{"crack.depth_mm": "8", "photo.mm_per_px": "0.4", "photo.markers": "m.toml", "photo.face_mm": "160x40"},
    **{"photo.ends_px": ("40,101", "160,98"), "photo.via_px": "80,99 90,98", "photo.roi_px": "9,9 90,9 90,80"},
    **{"photo.mask": "mask.png", "photo.width_mm": "3,5", "solver.preset": "draft", "seed": "3", "seeds": "2"},
}
"""Text of each everyday option."""
BESIDE = {
    "photo.markers": (),
    "photo.face_mm": ("photo.markers",),
    "photo.via_px": ("photo.mm_per_px", "photo.ends_px"),
}
"""Options that an option needs beside the depth. Default: a scale."""


@pytest.mark.parametrize("key", [*PHOTO, *FLUID])
def test_each_everyday_option_is_stored_by_each_command_that_has_it(key, tmp_path, monkeypatch):
    """The table of the markers once had a value that TOML lacks, and 'quick' ended with a traceback."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trial.toml").write_bytes((FIXTURE / "trial.toml").read_bytes())
    assert sealtwin("markers", "--face-mm", "160x40", "--out", "m.pdf", "--toml", "m.toml").exit_code == 0
    needed = ("crack.depth_mm", *BESIDE.get(key, ("photo.mm_per_px",)), key)
    settings, photo = settings_of({name: TEXTS[name] for name in needed}, ()), FIXTURE / "photo.jpg"
    written = tmp_path / "begun.toml"
    written.write_text(trial_text(begin_trial(photo, settings).content))
    trials = [load_trial(written)]
    if key in FLUID:
        trials.append(load_trial(tmp_path / "trial.toml", {key: settings[key]}))
    for trial in trials:
        value = trial
        for part in key.split("."):
            value = getattr(value, part)
        assert value not in (None, ())


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


@pytest.mark.parametrize("columns", [80, 100, 140])
def test_the_help_breaks_no_line_before_its_width_and_shows_no_type_of_a_flag(columns, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    for name in COMMANDS:
        text = sealtwin(*name.split(), "--help").output
        assert "<bool>" not in text
        lines = [line.strip() for line in text.partition("╭")[0].splitlines()[3:]]
        pairs = [(line, after) for line, after in pairwise(lines) if line and after]
        assert [pair for pair in pairs if len(f"{pair[0]} {pair[1].split()[0]}") <= columns - 2] == [], name


@pytest.mark.parametrize(
    ("name", "texts"), [("--depth-mm", "1_0 nan 1e999 \u0663 1,000 0x1"), ("--seed", "1_0 2,5 -1")]
)
def test_options_accept_a_decimal_comma_but_no_malformed_number(name, texts, tmp_path):
    (tmp_path / "none.png").write_bytes(b"no photo")
    line = ("quick", tmp_path / "none.png", "--out", tmp_path / "out", "--mm-per-px", "0.1", "--depth-mm", "0,5")
    assert "--depth-mm" not in refusal(*line)
    given = line[:-2] if name in line else line
    assert [text for text in ("", *texts.split()) if f"sealtwin: {name} = " not in refusal(*given, name, text)] == []


@pytest.mark.parametrize(("text", "value"), [("0,125", 0.125), ("-1,5e2", -150), (".5", 0.5), ("5.", 5), (" 12 ", 12)])
def test_numbers_with_decimal_comma_or_point_are_read(text, value):
    assert read_value(text) == value


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
