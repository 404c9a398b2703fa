"""Run folders side by side."""

import json
import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sealtwin.cli.app import app
from sealtwin.cli.studies import compared_lines
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile
from sealtwin.core.run_folder import open_folder
from sealtwin.study.run_comparison import compare_runs
from sealtwin.trial.job import DIGITISED, SIMULATED, stage_settings, start_job
from sealtwin.trial.pipeline import run_stages
from sealtwin.trial.stage_numbers import NUMBERS
from sealtwin.trial.trial_file import load_trial
from tests.studies import tiny_lab
from validate.compare import compare
from validate.figures.compare_sheet import MOST
from validate.readings.read_readings import read_readings
from validate.result import COMPARISON

pytestmark = pytest.mark.usefixtures("without_pictures")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A tiny run, compared; no report is drawn. It freezes late, and so keeps enough volume for a ranking."""
    lab = tiny_lab(tmp_path_factory.mktemp("lab")).parent
    path = tmp_path_factory.mktemp("runs") / "first"
    text = (lab / "trial.toml").read_text(encoding="utf-8")
    (lab / "trial.toml").write_text(text.replace("freeze_after_s = 0.2", "freeze_after_s = 0.6"), encoding="utf-8")
    trial = load_trial(lab / "trial.toml")
    with open_folder(path, create=True) as folder:
        run_stages(start_job(trial, lab, folder, "cpu", Progress()), ("digitise", "simulate"))
    hold(path)
    return path


def hold(path: Path) -> None:
    """As the stage validate does it, but for the report."""
    trial = load_trial(path / "trial.toml")
    assert trial.readings is not None
    outline, solid = record_files.read_outline(path), record_files.read_solid(path)
    readings = read_readings(path / trial.readings.file, trial.readings, outline.length_mm, solid.depth_mm)
    found = compare(
        record_files.read_profile(path),
        readings,
        outline,
        solid,
        role=trial.readings.role,
        photo_data=trial.shown_by.data,
    )
    files.write_json(path / COMPARISON, found.model_dump())
    with open_folder(path, create=False) as folder:
        inputs = {name: files.sha256(path / name) for name in (*DIGITISED, *SIMULATED, trial.readings.file.as_posix())}
        settings = stage_settings(trial, "validate")
        facts = {"numbers": NUMBERS, "given": [str(trial.readings.file)]}
        folder.record("validate", "key", settings, inputs, [COMPARISON], 1.0, **facts)


@pytest.fixture
def other(run, tmp_path):
    """The same with another U in its trial and its manifest."""
    path = tmp_path / "second"
    shutil.copytree(run, path)
    trial = path / "trial.toml"
    text = trial.read_text(encoding="utf-8")
    assert "U = 30.0" in text
    trial.write_text(text.replace("U = 30.0", "U = 3.0"), encoding="utf-8")
    with open_folder(path, create=False) as folder:
        folder.manifest["stages"]["simulate"]["settings"] = stage_settings(load_trial(trial), "simulate")
        folder.save()
    return path


def test_runs_are_told_apart_by_what_differs(run, other, tmp_path):
    """Two trials of one name get their folders behind it; the one setting that was changed is what is told."""
    answer, sheet = compare_runs([run, other], tmp_path / "page")
    content = json.loads((tmp_path / "page" / "compare.json").read_text(encoding="utf-8"))
    assert content == json.loads(json.dumps(answer))
    assert content["differing"] == {"fluid.U": [30.0, 3.0]}
    assert [each["name"] for each in content["runs"]] == [f"tiny ({run})", f"tiny ({other})"]
    assert [(each["number"], each["readings_of_run"], each["edited"]) for each in content["runs"]] == [
        (1, 1, []),
        (2, 1, []),
    ]
    assert content["runs"][0]["mean_error_mm"] == files.read_json(run / "comparison.json")["mean_error_mm"]
    assert all((tmp_path / "page" / name).is_file() for name in content["files"])
    warned = [one for one in content["fluid_warnings"] if "without a yield stress" in one]
    assert [one[:25] for one in warned] == ["2 of 2 runs: fluid.U is 3"]
    assert [compared_lines(answer, sheet).count(one) for one in warned] == [1]
    assert content["finding"] == sheet.finding
    assert content["replicates"][0].startswith("No area validation metric")


def test_another_sheet_with_the_same_settings_is_a_replicate(run, tmp_path):
    """The same settings with readings of their own; with another nozzle's speed it is another trial."""
    path = tmp_path / "second"
    shutil.copytree(run, path)
    sheet = path / "inputs" / "readings.csv"
    sheet.write_text("s_mm,level_1_mm\n1,-3\n4,-3\n7,-2\n11,-2\n", encoding="utf-8")
    hold(path)
    (told,) = compare_runs([run, path], tmp_path / "page")[0]["replicates"]
    assert "over 2 replicates" in told
    trial = path / "trial.toml"
    text = trial.read_text(encoding="utf-8")
    assert "speed_mm_s = 20.0" in text
    trial.write_text(text.replace("speed_mm_s = 20.0", "speed_mm_s = 21.0"), encoding="utf-8")
    with open_folder(path, create=False) as folder:
        folder.manifest["stages"]["digitise"]["settings"] = stage_settings(load_trial(trial), "digitise")
        folder.save()
    (told,) = compare_runs([run, path], tmp_path / "page")[0]["replicates"]
    assert told.startswith("No area validation metric")


def test_what_is_no_finished_run_is_refused_by_name(run, other, tmp_path):
    with pytest.raises(InputError, match="nowhere: no run folder"):
        compare_runs([run, tmp_path / "nowhere"], tmp_path / "page")
    with pytest.raises(InputError, match="named twice"):
        compare_runs([run, run], tmp_path / "page")
    (other / "comparison.json").unlink()
    with pytest.raises(InputError, match="second: not compared with its readings yet"):
        compare_runs([run, other], tmp_path / "page")
    (other / "profile.csv").unlink()
    with pytest.raises(InputError, match=re.escape("second: simulate is not finished (profile.csv is not there)")):
        compare_runs([run, other], tmp_path / "page")


def test_results_of_other_settings_or_files_are_not_compared(run, other, tmp_path):
    """As validate does: what lies in the folder must be what its trial says, and the comparison of these very files."""

    def refused(sentence: str) -> None:
        with pytest.raises(InputError, match=re.escape(sentence)) as fault:
            compare_runs([run, other], tmp_path / "page")
        assert "\n" not in str(fault.value)

    kept = {name: (other / name).read_bytes() for name in ("trial.toml", "profile.csv", "manifest.json")}
    (other / "trial.toml").write_bytes(kept["trial.toml"].replace(b"U = 3.0", b"U = 4.0"))
    refused("[fluid] is not what simulate ran with here")
    (other / "trial.toml").write_bytes(kept["trial.toml"])
    (other / "profile.csv").write_bytes(kept["profile.csv"].replace(b",-", b",", 1))
    refused("profile.csv was changed since the readings were compared. Run 'sealtwin validate")
    (other / "profile.csv").write_bytes(kept["profile.csv"])
    (other / "manifest.json").write_text("null", encoding="utf-8")
    refused("manifest.json: damaged")
    (other / "manifest.json").write_bytes(kept["manifest.json"])
    compare_runs([run, other], tmp_path / "page")


def test_what_no_result_can_be_is_refused_by_its_name(run, other, tmp_path):
    """Also where the manifest takes the edited files for its own."""
    for name, before, after in (
        ("comparison.json", '"rmse_mm": ', '"rmse_mm": "many", "was": '),
        ("simulation.json", '"particles": ', '"particles": "many", "was": '),
    ):
        text = (other / name).read_text(encoding="utf-8")
        assert before in text
        (other / name).write_text(text.replace(before, after), encoding="utf-8")
        with open_folder(other, create=False) as folder:
            inputs = folder.manifest["stages"]["validate"]["inputs"]
            inputs |= {each: files.sha256(other / each) for each in inputs}
            folder.save()
        with pytest.raises(InputError, match=f"{name}: not as it was written .*= 'many'"):
            compare_runs([run, other], tmp_path / "page")
        (other / name).write_text(text, encoding="utf-8")


def test_what_was_edited_and_held_again_is_said(run, other, tmp_path):
    """Edited and then validated, a level is taken as it is; the page says so."""
    profile = record_files.read_profile(other)
    record_files.write_profile(other, Profile(profile.s_mm, profile.level_mm + 1.0))
    hold(other)
    content, sheet = compare_runs([run, other], tmp_path / "page")
    assert content["runs"][1]["edited"] == ["profile.csv"]
    lines = compared_lines(content, sheet)
    assert any("run 2: edited by hand since it was made (profile.csv)" in line for line in lines)
    assert not any("Nearest is run 2" in line for line in lines)


def test_a_run_that_gained_volume_is_named(run, other, tmp_path):
    """Its own report says so, and so does the page that sets it beside others."""
    path = other / "simulation.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    content["health"]["volume_ratio"] = 1.66
    path.write_text(json.dumps(content), encoding="utf-8")
    hold(other)
    lines = compared_lines(*compare_runs([run, other], tmp_path / "page"))
    assert any("1.660 of the dispensed volume" in line for line in lines if "run 2:" in line)


def test_the_command_wants_two_runs(run, other, tmp_path):
    asked = CliRunner().invoke(app, ["compare", str(run), str(other), "--out", str(tmp_path / "page"), "--json"])
    assert asked.exit_code == 0, asked.output
    assert json.loads(asked.stdout)["differing"] == {"fluid.U": [30.0, 3.0]}
    assert CliRunner().invoke(app, ["compare", str(run)]).exit_code == 2


def test_the_help_says_how_many_runs_it_takes():
    told = CliRunner().invoke(app, ["compare", "--help"]).output
    assert f"2 to {MOST}." in told
