"""A trial's table [sample]: a changed slope redoes the fluid, nothing before it; no two slopes share a launch."""

from dataclasses import replace
from pathlib import Path

import pytest

import sealtwin as st
from sealtwin.core.errors import InputError
from sealtwin.core.files import read_json
from sealtwin.core.progress import Progress
from sealtwin.study.pipeline import run_stages, run_trial
from sealtwin.study.study_folder import read_level, read_plan
from sealtwin.study.sweep import sweep
from sealtwin.trial.job import stage_settings
from sealtwin.trial.trial_file import load_trial
from tests.support.tiny_study import HERE, compute_here, job_in, tiny_lab

QUIET = Progress()


def run(lab: Path, out: Path, table: str = "") -> tuple[str, ...]:
    """Bring the first two stages up to date; the third takes its time to draw a report."""
    trial = lab / "trial.toml"
    text = trial.read_text(encoding="utf-8").split("\n[output]")[0]
    trial.write_text(text + "\n[output]\nsnapshots_s = []\n" + table, encoding="utf-8")
    return run_trial(load_trial(trial), lab, out, ("digitise", "simulate"), "cpu", QUIET).redone


def test_a_changed_slope_redoes_the_fluid_and_an_unchanged_one_nothing(tmp_path):
    tiny_lab(tmp_path)
    out = tmp_path / "out"
    # A level sample has the keys that it always had.
    assert set(stage_settings(load_trial(tmp_path / "trial.toml"), "simulate")) == {"fluid", "solver", "nozzle", "seed"}
    assert run(tmp_path, out) == ("digitise", "simulate")
    assert "sample" not in read_json(out / "simulation.json")["settings"]
    assert run(tmp_path, out, "\n[sample]\ngradient_deg = 0.0\n") == ()
    assert run(tmp_path, out, "\n[sample]\ngradient_deg = 5.0\n") == ("simulate",)
    assert read_json(out / "simulation.json")["settings"]["sample"] == {"crossfall_deg": 0.0, "gradient_deg": 5.0}
    # Seen to fail where only tables that are wanted now were compared.
    trial = out / "trial.toml"
    trial.write_text(trial.read_text(encoding="utf-8").replace("gradient_deg = 5.0", "gradient_deg = 0.0"))
    with (
        job_in(out) as job,
        pytest.raises(InputError, match=r"\[sample\] differs from the settings with which simulate ran"),
    ):
        run_stages(job, ("validate",))


def test_runs_of_a_study_on_two_slopes_share_no_launch(tmp_path):
    """One launch has one gravity. Seen to fail where a run's kin held its sample's folder in place of its slope."""
    lab = tiny_lab(tmp_path, '[grid]\n"sample.gradient_deg" = [0.0, 20.0]\n')
    out = tmp_path / "out"
    sweep(lab, out, replace(HERE, dry_run=True), QUIET)
    first, second = read_plan(out).runs
    assert first.sample == second.sample
    assert first.kin != second.kin
    compute_here(out, batch=4)
    level, sloping = (read_level(out, run).level_mm for run in read_plan(out).runs)
    assert abs(level - sloping).max() > 0.1


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_inject_takes_the_slopes_by_keyword(tmp_path):
    tiny_lab(tmp_path)
    crack = st.trace_crack(st.read_photo(tmp_path / "crack.png", mm_per_px=0.1), [(40, 101), (160, 98)])
    solid = st.build_solid(crack, 8, tilt="vertical")
    path = st.plan_path(crack, solid, volume_ml=0.04, speed_mm_s=20, trim_mm=1)
    given = crack, solid, path, st.Fluid(U=3, D_cm=0.03)
    solver = st.Solver(radius_mm=0.45, substeps=2, settle_s=0.3)
    middle = [st.inject(*given, solver=solver, gradient_deg=angle).position_mm[:, 0].mean() for angle in (20, -20)]
    assert middle[0] < middle[1] - 0.4
    with pytest.raises(InputError, match=r"inject: crossfall_deg = 46: .*45"):
        st.inject(*given, solver=solver, crossfall_deg=46)
