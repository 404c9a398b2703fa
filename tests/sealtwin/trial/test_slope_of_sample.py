"""Slopes of a sample, the table [sample] of a trial."""

from dataclasses import replace
from pathlib import Path

import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.files import read_json
from sealtwin.core.progress import Progress
from sealtwin.study.pipeline import run_stages, run_trial
from sealtwin.study.study_folder import read_plan
from sealtwin.study.sweep import sweep
from sealtwin.trial.job import stage_settings
from sealtwin.trial.trial_file import load_trial
from tests.support.tiny_study import HERE, job_in, tiny_lab

QUIET = Progress()


def run(lab: Path, out: Path, table: str = "") -> tuple[str, ...]:
    """Bring the first two stages up to date; the third takes its time to draw a report."""
    trial = lab / "trial.toml"
    text = trial.read_text(encoding="utf-8").split("\n[output]")[0]
    trial.write_text(text + "\n[output]\nsnapshots_s = []\n" + table, encoding="utf-8")
    return run_trial(load_trial(trial), trial, out, ("digitise", "simulate"), "cpu", QUIET).redone


def test_a_changed_slope_repeats_only_the_simulation(tmp_path):
    tiny_lab(tmp_path)
    out = tmp_path / "out"
    # A level sample has the keys that it always had.
    assert set(stage_settings(load_trial(tmp_path / "trial.toml"), "simulate")) == {"fluid", "solver", "nozzle", "seed"}
    assert run(tmp_path, out) == ("digitise", "simulate")
    assert "sample" not in read_json(out / "simulation.json")["settings"]
    assert run(tmp_path, out, "\n[sample]\ngradient_deg = 0.0\n") == ()
    assert run(tmp_path, out, "\n[sample]\ngradient_deg = 5.0\n") == ("simulate",)
    assert read_json(out / "simulation.json")["settings"]["sample"] == {"crossfall_deg": 0.0, "gradient_deg": 5.0}
    # Seen to fail if only the tables of the present trial are compared.
    trial = out / "trial.toml"
    trial.write_text(trial.read_text(encoding="utf-8").replace("gradient_deg = 5.0", "gradient_deg = 0.0"))
    with (
        job_in(out) as job,
        pytest.raises(InputError, match=r"\[sample\] differs from the settings with which simulate ran"),
    ):
        run_stages(job, ("validate",))


def test_study_runs_on_different_slopes_share_no_launch(tmp_path):
    """One launch has one gravity. Seen to fail if a run's kin has the sample's folder in place of its slope."""
    lab = tiny_lab(tmp_path, '[grid]\n"sample.gradient_deg" = [0.0, 20.0]\n')
    out = tmp_path / "out"
    sweep(lab, out, replace(HERE, dry_run=True), QUIET)
    first, second = read_plan(out).runs
    assert first.sample == second.sample
    assert first.kin != second.kin
