"""Trials with several seeds, whose level is the mean of runs that differ in the seed alone."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sealtwin.calibration.search import Twin
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError, present
from sealtwin.core.run_folder import look_into, open_folder
from sealtwin.plan.verify import require_plannable
from sealtwin.study import run_comparison, runner, uncertainty_runs
from sealtwin.study.pipeline import FinishedStages, run_stages
from sealtwin.study.runner import Sealing
from sealtwin.study.study_folder import read_plan
from sealtwin.study.sweep import sweep
from sealtwin.trial.job import SEEDS, StageName, start_job
from sealtwin.trial.trial_file import load_trial
from sealtwin.trial.validate_stage import read_spread
from tests.support.messages import Narration
from tests.support.report_stubs import leave_out_pages
from tests.support.tiny_study import HERE, TRIAL, job_in, run_tiny, tiny_lab
from validate.report.write_report import report_data
from validate.uncertainty.computed import numerical_errors

DECLARED = "\n[uncertainty]\nvolume_ml = 0.01\n"


@pytest.fixture(scope="module")
def single(tmp_path_factory) -> Path:
    """The tiny trial, simulated with one seed. Two particles are abreast at the coarser size too."""
    return run_tiny(tmp_path_factory.mktemp("lab"), TRIAL.replace("radius_mm = 0.45", "radius_mm = 0.36") + DECLARED)


@pytest.fixture(scope="module")
def three(single, tmp_path_factory) -> Path:
    """The same folder after 'sealtwin validate RUN --set seeds=3'."""
    path = shutil.copytree(single, tmp_path_factory.mktemp("three") / "run")
    with pytest.MonkeyPatch.context() as patch:
        given = leave_out_pages(patch)
        finished = _validate(path, settings={"seeds": 3})
    assert finished.redone == ("validate",)
    (path / "given.json").write_text(report_data(given[0]).model_dump_json(), encoding="utf-8")
    return path


@pytest.fixture
def path(three, tmp_path, monkeypatch) -> Path:
    leave_out_pages(monkeypatch)
    return shutil.copytree(three, tmp_path / "run")


def _validate(
    path: Path, progress: Narration | None = None, stage: StageName = "validate", settings: dict | None = None
) -> FinishedStages:
    with open_folder(path, create=False) as folder:
        job = start_job(load_trial(path / "trial.toml", settings), path, folder, "cpu", progress or Narration())
        return run_stages(job, [stage])


def _levels(path: Path) -> dict[str, np.ndarray]:
    table = np.genfromtxt(path / "level.csv", delimiter=",", names=True)
    return {name: table[name] for name in present(table.dtype.names, "names")}


def test_the_level_of_a_trial_with_several_seeds_is_the_mean_of_its_runs(single, three):
    levels = _levels(three)
    assert list(levels) == ["s_mm", "level_mm", "low_95_mm", "high_95_mm", "seed_0_mm", "seed_1_mm", "seed_2_mm"]
    assert (three / "profile.csv").read_bytes() == (single / "profile.csv").read_bytes(), "the first seed's own"
    assert np.array_equal(levels["seed_0_mm"], record_files.read_profile(single).level_mm)
    with job_in(single) as job:
        sample, trial = record_files.read_sample(job.path), job.trial.model_copy(update={"seed": 2, "readings": None})
    (alone,) = runner.seal(sample, [trial], HERE)
    assert isinstance(alone, Sealing)
    assert levels["seed_2_mm"] == pytest.approx(alone.profile.level_mm, abs=5.1e-7), "as 'sealtwin run --seed 2'"
    runs_mm = np.array([levels[f"seed_{seed}_mm"] for seed in range(3)])
    assert levels["level_mm"] == pytest.approx(runs_mm.mean(axis=0), abs=1e-6)
    scatter_mm = np.sqrt(runs_mm.var(axis=0, ddof=1).mean())
    assert scatter_mm > 0.01
    half_mm = (levels["high_95_mm"] - levels["low_95_mm"]) / 2
    assert half_mm == pytest.approx(1.96 * np.sqrt(4 / 3) * scatter_mm, abs=2e-6), "as the band of a plan"
    seeds = files.read_json(three / "seeds.json")
    assert seeds["seeds"] == [0, 1, 2]
    assert seeds["scatter_mm"] == pytest.approx(scatter_mm, abs=1e-6)


def test_comparison_report_and_record_use_the_mean_level_of_all_seeds(three):
    """A page that compares runs uses the mean level too."""
    levels, result = _levels(three), files.read_json(three / "run.json")
    s_mm, readings_mm = [1.0, 4.0, 7.0, 11.0], np.array([-2.0, -2.0, -1.0, -1.0])
    errors_mm = np.interp(s_mm, levels["s_mm"], levels["level_mm"]) - readings_mm
    assert result["comparison"]["uncertainty"]["stations"]["error_mm"] == pytest.approx(errors_mm)
    report = files.read_json(three / "given.json")
    assert report["seeds"] == result["seeds"] == files.read_json(three / "seeds.json")
    assert result["stages"] == ["digitise", "simulate", SEEDS, "validate"]
    assert report["provenance"]["seed"] == "0, 1, 2"
    half = f"± {result['seeds']['band_95_mm']:.2f} mm"
    (sentence,) = (
        fact["text"] for fact in report["uncertainty"] if "mean of 3 runs, with seeds 0 to 2" in fact["text"]
    )
    assert half in sentence
    with job_in(three) as job:
        side = run_comparison._side(job)
    assert side.profile.level_mm == pytest.approx(levels["level_mm"])
    assert side.settings["seeds"] == 3


def test_seeds_that_give_equal_levels_are_refused(single, tmp_path, monkeypatch):
    path = shutil.copytree(single, tmp_path / "run")
    own = record_files.read_profile(path)
    monkeypatch.setattr(uncertainty_runs, "read_level", lambda *_: own)
    with pytest.raises(InputError, match="the runs with seed = 0 and with seed = 1 have the same level"):
        _validate(path, settings={"seeds": 3})
    assert SEEDS not in look_into(path).finished()
    assert not (path / "report.html").exists()


def test_the_scatter_of_a_mean_of_3_runs_is_divided_by_sqrt_3(path, monkeypatch):
    """The runs of the seeds also serve as the extra runs of the trial's own particle size."""
    monkeypatch.setattr(uncertainty_runs, "cores", lambda: 0)
    with job_in(path) as job:
        assert uncertainty_runs.vary(job)
        spread = present(read_spread(job), "spread")
        assert "uncertainty.json" in job.folder.manifest["stages"]["uncertainty"]["outputs"]
    runs = read_plan(path / "uncertainty").runs
    assert sum("solver.radius_mm" in run.settings for run in runs) == 6, "none of the trial's own size"
    assert not any("seeds" in run.trial for run in runs)
    levels = _levels(path)
    sizes = present(spread.sizes, "sizes")
    assert sizes[1].levels_mm == pytest.approx(np.array([levels[f"seed_{seed}_mm"] for seed in range(3)]))
    s_mm = levels["s_mm"][::10]
    of_mean, of_single = (
        {error.name: error.draws_mm for error in numerical_errors(present(runs.sizes_at(s_mm), "replicates"), None)}
        for runs in (spread, replace(spread, mean_of=1))
    )
    assert of_mean["scatter of the mean of 3 runs"] == pytest.approx(of_single["scatter of single runs"] / np.sqrt(3))
    assert of_mean["particle size"] == pytest.approx(of_single["particle size"])
    assert "mean_of" not in files.read_json(path / "uncertainty.json")


@pytest.mark.parametrize(
    ("seeds", "old", "new", "named"),
    [
        pytest.param(3, "substeps = 2", 'model = "slot"', "seeds = 3, but the fast model", id="the fast model"),
        pytest.param(21, "", "", "seeds", id="too many"),
    ],
)
def test_too_many_seeds_and_seeds_of_the_fast_model_are_refused(tmp_path, seeds, old, new, named):
    tiny_lab(tmp_path)
    (tmp_path / "trial.toml").write_text(
        f"seeds = {seeds}\n{TRIAL.replace(old, new) if old else TRIAL}", encoding="utf-8"
    )
    with pytest.raises(InputError, match=named):
        load_trial(tmp_path / "trial.toml")


@pytest.mark.parametrize(
    "begin",
    {
        "sweep": lambda lab: sweep(lab / "study.toml", lab / "out", HERE, Narration()),
        "calibrate": lambda lab: Twin(lab / "trial.toml", lab / "out", HERE, Narration()),
        "plan": lambda lab: require_plannable(load_trial(lab / "trial.toml"), "trial.toml"),
    }.values(),
)
def test_sweep_calibrate_and_plan_refuse_a_trial_with_several_seeds(tmp_path, begin):
    tiny_lab(tmp_path)
    (tmp_path / "trial.toml").write_text("seeds = 3\n" + TRIAL, encoding="utf-8")
    with pytest.raises(InputError, match=r"trial\.toml: seeds = 3 is only for 'sealtwin run'"):
        begin(tmp_path)
