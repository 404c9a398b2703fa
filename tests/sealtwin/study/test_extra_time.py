"""How long the runs of --uncertainty are said to take."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from sealtwin.core import record_files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import open_folder
from sealtwin.study import extra_runs
from sealtwin.study.estimate import size_of
from sealtwin.study.extra_runs import time_of_extra_runs
from sealtwin.trial.job import STAGES, Above, start_job
from sealtwin.trial.pipeline import run_stages
from sealtwin.trial.trial_file import load_trial
from tests.pages import leave_out_figures, leave_out_pdf
from tests.studies import TRIAL, job_in, run_tiny, tiny_lab

DECLARED = "[uncertainty]\nspeed_mm_s = 1.0\nvolume_ml = 0.01\nwidth_mm = 0.1\n"


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    return run_tiny(tmp_path_factory.mktemp("lab"))


@pytest.mark.parametrize(("declared", "designed"), [("", 0), (DECLARED, 4)])
def test_it_is_the_own_run_scaled_to_three_of_each_size_and_the_design(run_folder, monkeypatch, declared, designed):
    """By hand: three finer runs, two more of the own size, three coarser ones and the design, on two cores."""
    (run_folder / "trial.toml").write_text(TRIAL.replace("readings.csv", "inputs/readings.csv") + declared)
    monkeypatch.setattr(extra_runs, "cores", lambda: 2)
    manifest = json.loads((run_folder / "manifest.json").read_text())
    manifest["stages"]["simulate"]["wall_time_s"] = 1e5  # Hours have a decimal
    (run_folder / "manifest.json").write_text(json.dumps(manifest))
    trial, sample = load_trial(run_folder / "trial.toml"), record_files.read_sample(run_folder)
    finer_s, own_s, coarser_s = (
        size_of(
            trial.model_copy(update={"solver": trial.solver.model_copy(update={"radius_mm": 0.45 * ratio})}), sample
        ).work_s
        for ratio in (1 / 1.3, 1.0, 1.3)
    )
    expected_s = (3 * finer_s + 2 * own_s + (3 + designed) * coarser_s) / own_s * 1e5 / 2
    with job_in(run_folder) as job:
        hours, unit = time_of_extra_runs(job).split()
    # The last run leaves one of the cores idle.
    assert (float(hours), unit) == (pytest.approx(expected_s / 3600, rel=0.02), "h")


def test_the_fast_models_draws_take_as_long_as_one_of_them_on_this_machine(tmp_path, monkeypatch):
    """A run of the fast model with moved inputs, timed as 36 s: a thousand on two cores take 5 h."""
    text = TRIAL.replace("freeze_after_s = 0.2\n", 'freeze_after_s = "never"\nyield_stress_pa = 3.0\n').replace(
        "substeps = 2\n", 'model = "slot"\n'
    )
    run = run_tiny(tmp_path, text + DECLARED)
    monkeypatch.setattr(extra_runs, "cores", lambda: 2)
    ticks = iter([0.0, 36.0])
    monkeypatch.setattr(extra_runs, "time", SimpleNamespace(perf_counter=lambda: next(ticks)))
    with job_in(run) as job:
        assert time_of_extra_runs(job) == "5.0 h"


def test_a_sealant_that_is_too_stiff_in_finer_particles_has_no_time_and_no_fault(run_folder):
    """The run stands, and its report is written: what cannot be is for 'sealtwin validate RUN --uncertainty' to say."""
    stiff = TRIAL.replace("readings.csv", "inputs/readings.csv").replace("U = 30.0", "viscosity_pa_s = 1000")
    (run_folder / "trial.toml").write_text(stiff)
    trial, sample = load_trial(run_folder / "trial.toml"), record_files.read_sample(run_folder)
    size_of(trial, sample)
    finer = trial.model_copy(update={"solver": trial.solver.model_copy(update={"radius_mm": 0.45 / 1.3})})
    with pytest.raises(InputError, match=r"fluid\.viscosity_pa_s is 1000"):
        size_of(finer, sample)
    with job_in(run_folder) as job:
        assert time_of_extra_runs(job) == ""


def test_it_is_asked_for_once_a_command(tmp_path, monkeypatch):
    """It times a run of the fast model: asked for again, it could say another time than the report."""
    leave_out_figures(monkeypatch)
    leave_out_pdf(monkeypatch)
    tiny_lab(tmp_path)
    told = iter(["5 min", "6 min"])
    with open_folder(tmp_path / "run", create=True) as folder:
        job = start_job(load_trial(tmp_path / "trial.toml"), tmp_path, folder, "cpu", Progress())
        run_stages(replace(job, above=Above(extra_runs=lambda _: next(told))), STAGES)
    assert next(told) == "6 min"
