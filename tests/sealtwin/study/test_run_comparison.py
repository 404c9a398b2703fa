"""Comparisons of run folders."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sealtwin.cli.studies import compared_lines
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile
from sealtwin.core.run_folder import open_folder
from sealtwin.study.pipeline import run_stages
from sealtwin.study.run_comparison import SAME_MM, compare_runs, first_with_readings, ranking
from sealtwin.trial.job import StageName, stage_settings
from sealtwin.trial.trial_file import load_trial
from tests.support.comparison_sides import compared, side
from tests.support.ingested_lab import edit, sealtwin
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import TRIAL, job_in, run_tiny

pytestmark = pytest.mark.usefixtures("without_pictures")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A tiny run, compared. It freezes late, and so keeps enough volume for a ranking."""
    late = TRIAL.replace("freeze_after_s = 0.2", "freeze_after_s = 0.6")
    path = run_tiny(tmp_path_factory.mktemp("lab"), late)
    validate(path)
    return path


def validate(path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch, job_in(path) as job:
        leave_out_pages(patch)
        run_stages(job, ("validate",))


def change(path: Path, stage: StageName, old: str, new: str) -> None:
    """Change a setting of the trial and of a stage in the manifest."""
    edit(path / "trial.toml", old, new)
    with open_folder(path, create=False) as folder:
        folder.manifest["stages"][stage]["settings"] = stage_settings(load_trial(path / "trial.toml"), stage)
        folder.save()


@pytest.fixture
def other(run, tmp_path):
    path = shutil.copytree(run, tmp_path / "second")
    change(path, "simulate", "U = 30.0", "U = 3.0")
    return path


def test_a_comparison_of_runs_lists_the_settings_that_differ(run, other):
    text = sealtwin("compare", run, other).stdout
    content = json.loads(sealtwin("compare", run, other, "--json").stdout)
    assert content["differing"] == {"fluid.U": [30.0, 3.0]}
    facts = [[run[name] for name in ("name", "number", "readings", "not_ranked")] for run in content["runs"]]
    assert facts == [
        [f"tiny ({run})", 1, "synthetic, calibrated-on", None],
        [f"tiny ({other})", 2, "synthetic, calibrated-on, the same as for run 1", None],
    ]
    assert content["runs"][0]["mean_error_mm"] == files.read_json(run / "comparison.json")["errors"]["mean_error_mm"]
    (warning,) = [warning for warning in content["fluid_warnings"] if warning.startswith("2 of 2 runs: fluid.U is 3")]
    assert text.count(warning) == 1
    assert sealtwin("compare", run).exit_code == 2


def test_unfinished_or_damaged_run_folders_are_refused(run, other, tmp_path):
    def refused(second: Path, match: str) -> None:
        with pytest.raises(InputError, match=match):
            compare_runs([run, second])

    refused(tmp_path / "nowhere", "nowhere: is not a run folder")
    for name, old, new, match in (
        ("trial.toml", b"U = 3.0", b"U = 4.0", r"\[fluid\] differs from the settings with which simulate ran"),
        ("profile.csv", b",-", b",", r"profile\.csv was changed after the readings were compared"),
        ("manifest.json", b"{", b"[", r"manifest\.json: is damaged"),
    ):
        content = (other / name).read_bytes()
        (other / name).write_bytes(content.replace(old, new, 1))
        refused(other, match)
        (other / name).write_bytes(content)
    compare_runs([run, other])
    edit(other / "comparison.json", '"rmse_mm": ', '"rmse_mm": "many", "was": ')
    refused(other, r"comparison\.json: .* = 'many'")
    for name, stage in (("comparison.json", "validate"), ("profile.csv", "simulate")):
        (other / name).unlink()
        refused(other, rf"second: the stage {stage} is not finished \({name} is missing\)")


def test_runs_with_an_edited_level_or_a_wrong_volume_are_not_ranked(run, other):
    """A level that was edited and validated again is compared, with the statement that it was edited."""
    profile = record_files.read_profile(other)
    record_files.write_profile(other, Profile(profile.s_mm, profile.level_mm + 1.0))
    validate(other)
    content = compare_runs([run, other])
    assert "(profile.csv)" in content["runs"][1]["not_ranked"]
    lines = compared_lines(content)
    assert any("(profile.csv)" in line for line in lines if line.startswith("2: "))
    assert not any("Run 2 is nearest" in line for line in lines)
    simulation = files.read_json(other / "simulation.json")
    simulation["health"]["volume_ratio"] = 1.66
    files.write_json(other / "simulation.json", simulation)
    validate(other)
    lines = compared_lines(compare_runs([run, other]))
    assert any("1.660 of the dispensed volume" in line for line in lines if line.startswith("2: "))


NEAR = compared(mean_error_mm=0.2)


def test_equal_numbers_from_another_sheet_count_as_the_same_readings():
    """A copy in inches differs by rounding; repeated readings differ by more than a caliper's last digit."""
    run: Any = side("a", 0.1)
    in_inches_mm = np.round(run.readings.level_mm / 25.4, 4) * 25.4
    copied = replace(run, readings=replace(run.readings, level_mm=in_inches_mm, source="inches.xlsx", repeats_mm=None))
    again = side("b", 0.1, lowered_mm=2 * SAME_MM)
    fewer = replace(
        run,
        readings=replace(run.readings, s_mm=run.readings.s_mm[1:], level_mm=run.readings.level_mm[1:]),
    )
    bare = replace(run, readings=None, comparison=None)
    assert first_with_readings([run, bare, copied, again, fewer, run]) == [0, None, 0, 3, 4, 0]


def test_no_run_is_called_nearest_if_the_readings_or_the_stage_numbers_differ():
    near = replace(side("b", 0.2), comparison=NEAR)
    bare = replace(near, readings=None, comparison=None)
    assert ranking([bare, side("a", 0.5), near]).startswith("Run 3 is nearest")
    assert "different readings" in ranking([side("a", 0.5), side("b", 0.2, lowered_mm=1.0)])
    older = side("b", 0.2, settings={"stage_number.simulate": 1})
    assert "different stage numbers" in ranking([side("a", 0.5, settings={"stage_number.simulate": 2}), older])
