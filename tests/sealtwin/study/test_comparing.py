"""Run folders side by side."""

import json
import re
import shutil
from pathlib import Path

import pytest

from sealtwin.cli.studies import compared_lines
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile
from sealtwin.core.run_folder import open_folder
from sealtwin.study.pipeline import run_stages
from sealtwin.study.run_comparison import compare_runs
from sealtwin.trial.job import StageName, stage_settings
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import edit, sealtwin
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import TRIAL, job_in, run_tiny
from validate.figures.compare_page import MOST

pytestmark = pytest.mark.usefixtures("without_pictures")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A tiny run, compared. It freezes late, and so keeps enough volume for a ranking."""
    late = TRIAL.replace("freeze_after_s = 0.2", "freeze_after_s = 0.6")
    path = run_tiny(tmp_path_factory.mktemp("lab"), late)
    hold(path)
    return path


def hold(path: Path) -> None:
    """Compare a run with its readings; draw no report."""
    with pytest.MonkeyPatch.context() as patch, job_in(path) as job:
        leave_out_pages(patch)
        run_stages(job, ("validate",))


def change(path: Path, stage: StageName, old: str, new: str) -> None:
    """Change a trial, and its settings in the manifest of a stage."""
    edit(path / "trial.toml", old, new)
    with open_folder(path, create=False) as folder:
        folder.manifest["stages"][stage]["settings"] = stage_settings(load_trial(path / "trial.toml"), stage)
        folder.save()


@pytest.fixture
def other(run, tmp_path):
    """The same with another U in its trial and its manifest."""
    path = shutil.copytree(run, tmp_path / "second")
    change(path, "simulate", "U = 30.0", "U = 3.0")
    return path


def test_runs_are_told_apart_by_what_differs(run, other, tmp_path):
    """Two trials of one name get their folders behind it; the one setting that was changed is what is told."""
    answer, sheet = compare_runs([run, other], tmp_path / "page")
    content = json.loads((tmp_path / "page" / "compare.json").read_text(encoding="utf-8"))
    assert content == json.loads(json.dumps(answer))
    assert content["differing"] == {"fluid.U": [30.0, 3.0]}
    assert [each["name"] for each in content["runs"]] == [f"tiny ({run})", f"tiny ({other})"]
    facts = [(each["number"], each["readings_of_run"], each["edited"]) for each in content["runs"]]
    assert facts == [(1, 1, []), (2, 1, [])]
    assert content["runs"][0]["mean_error_mm"] == files.read_json(run / "comparison.json")["errors"]["mean_error_mm"]
    assert all((tmp_path / "page" / name).is_file() for name in content["files"])
    warned = [one for one in content["fluid_warnings"] if "at any U" in one]
    assert [one[:25] for one in warned] == ["2 of 2 runs: fluid.U is 3"]
    assert [compared_lines(answer, sheet).count(one) for one in warned] == [1]
    assert content["finding"] == sheet.finding


@pytest.mark.parametrize(("model", "idle"), [("particles", ()), ("slot", ("solver.relaxation",))])
def test_settings_without_effect_come_last(run, other, tmp_path, model, idle):
    """Declared uncertainties filled the table. The fast model has no particles, so their settings do not count."""
    gate = "[gate]\nmean_error_mm = 1.0\n"
    change(other, "validate", "[uncertainty]", f"{gate}\n[uncertainty]\nspeed_mm_s = 0.1\nwidth_mm = 0.1")
    change(other, "simulate", "relaxation = 1.5", "relaxation = 1.25")
    if model == "slot":
        for path in (run := shutil.copytree(run, tmp_path / "first"), other):
            record = files.read_json(path / "simulation.json")
            record["settings"]["solver"] = {"model": "slot", "settle_s": 0.0}
            files.write_json(path / "simulation.json", record)
            with open_folder(path, create=False) as folder:
                inputs = folder.manifest["stages"]["validate"]["inputs"]
                inputs |= {each: files.sha256(path / each) for each in inputs}
                folder.save()
    content, _ = compare_runs([run, other], tmp_path / "page")
    named = ["gate.mean_error_mm", "gate.reason", "uncertainty.speed_mm_s", "uncertainty.width_mm"]
    effective = [name for name in ("fluid.U", "solver.relaxation") if name not in idle]
    names = [*content["differing"]]
    assert names[: len(effective)] == effective
    assert sorted(names[len(effective) :]) == sorted([*named, *idle])


def test_what_is_no_finished_run_of_its_own_trial_is_refused_by_name(run, other, tmp_path):
    """As validate does: what lies in the folder must be what its trial says, and the comparison of these very files."""

    def refused(second: Path, sentence: str) -> None:
        with pytest.raises(InputError, match=re.escape(sentence)) as fault:
            compare_runs([run, second], tmp_path / "page")
        assert "\n" not in str(fault.value)

    refused(tmp_path / "nowhere", "nowhere: not a run folder")
    refused(run, "named twice")
    for name, change, sentence in (
        ("trial.toml", (b"U = 3.0", b"U = 4.0", 1), "[fluid] differs from the settings of simulate here"),
        (
            "profile.csv",
            (b",-", b",", 1),
            "profile.csv was changed since the readings were compared. Run 'sealtwin vali",
        ),
        ("manifest.json", (b"{", b"[", 1), "manifest.json: damaged"),
    ):
        content = (other / name).read_bytes()
        (other / name).write_bytes(content.replace(*change))
        refused(other, sentence)
        (other / name).write_bytes(content)
    compare_runs([run, other], tmp_path / "page")
    (other / "comparison.json").unlink()
    refused(other, "second: validate is not finished (comparison.json is missing)")
    (other / "profile.csv").unlink()
    refused(other, "second: simulate is not finished (profile.csv is missing)")


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
    """Edited and then validated, a level is taken as it is; the page says so, and that a run gained volume."""
    profile = record_files.read_profile(other)
    record_files.write_profile(other, Profile(profile.s_mm, profile.level_mm + 1.0))
    hold(other)
    content, sheet = compare_runs([run, other], tmp_path / "page")
    assert content["runs"][1]["edited"] == ["profile.csv"]
    lines = compared_lines(content, sheet)
    assert any("run 2, because files were edited by hand after the run (profile.csv)" in line for line in lines)
    assert not any("Run 2 is nearest" in line for line in lines)
    simulation = files.read_json(other / "simulation.json")
    simulation["health"]["volume_ratio"] = 1.66
    files.write_json(other / "simulation.json", simulation)
    hold(other)
    lines = compared_lines(*compare_runs([run, other], tmp_path / "page"))
    assert any("1.660 of the dispensed volume" in line for line in lines if "run 2," in line)


def test_the_command_wants_two_runs(run, other, tmp_path):
    answer = sealtwin("compare", run, other, "--out", tmp_path / "page", "--json")
    assert json.loads(answer.stdout)["differing"] == {"fluid.U": [30.0, 3.0]}
    assert sealtwin("compare", run).exit_code == 2
    assert f"2 to {MOST}." in sealtwin("compare", "--help").output
