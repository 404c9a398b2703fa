"""Sweeps: finished runs are kept, and failed runs have no figures."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sealtwin.cli.studies import swept_lines
from sealtwin.core import record_files
from sealtwin.core.errors import BusyError, InputError, NumericalError
from sealtwin.core.files import read_json
from sealtwin.core.progress import Progress
from sealtwin.core.records import Run
from sealtwin.core.run_folder import holding
from sealtwin.study import runner
from sealtwin.study.study_folder import OUTCOME, profile_path, read_plan, run_path
from sealtwin.study.sweep import sweep
from simulate.injection import Injection, prepare
from tests.support.ingested_lab import edit, sealtwin
from tests.support.messages import Narration
from tests.support.tiny_study import HERE, compute_here, results_of, tiny_lab


def test_repeating_a_finished_sweep_computes_nothing(lab, unbroken, done):
    narration = Narration()
    report = sweep(lab, done, HERE, narration)
    assert report["exit_code"] == 0
    assert report["states"] == {"waiting": 0, "done": 4, "failed": 0}
    written_ns, before_ns = (
        [(run_path(out, run) / OUTCOME).stat().st_mtime_ns for run in read_plan(out).runs] for out in (done, unbroken)
    )
    assert written_ns == before_ns
    assert not [note for note in narration.notes if "fluid.U" in note], "a remark on what runs begin with"
    figures_of = {number: figures for number, (_, figures) in results_of(done).items()}
    off = [number for number, figures in figures_of.items() if not 0.9495 < figures["volume_ratio"] < 1.0505]
    assert [run["number"] for run in report["not_ranked"]] == off != []
    best, ranked = report["best"], figures_of.keys() - {*off}
    assert best["number"] == min(ranked, key=lambda number: figures_of[number]["mean_error_mm"])
    assert best["beats_flat_level"] is (best["mean_error_mm"] < best["flat_level_error_mm"])
    assert any("Not ranked" in line for line in swept_lines(report))
    head, *rows = (done / "runs.csv").read_text().splitlines()
    assert len(rows) == 4
    assert head.startswith("number,fluid.U,fluid.D_cm,model,unfit,state,mean_error_mm")


def test_only_lost_edited_or_incomplete_results_are_computed_again(lab, unbroken, done):
    """Temporary files of a killed process are removed."""
    runs = read_plan(done).runs
    profile_path(done, runs[0]).unlink()
    profile_path(done, runs[3]).write_text("s_mm,level_mm\n0,0\n")
    (run_path(done, runs[2]) / OUTCOME).unlink()
    (run_path(done, runs[2]) / ".sealtwin-tmp-4711-0123abcd.csv").write_text("s_mm,le")
    sweep(lab, done, replace(HERE, dry_run=True), Progress())
    assert [run.state for run in read_plan(done).runs] == ["waiting", "done", "waiting", "waiting"]
    compute_here(done)
    assert results_of(done) == results_of(unbroken)
    assert not list(done.glob("runs/*/.*"))


def test_a_study_with_changed_values_reuses_its_finished_runs(done, tmp_path, lab):
    more = tiny_lab(tmp_path / "lab", '[grid]\n"fluid.U" = [1.0, 3.0, 300.0]\n"fluid.D_cm" = [0.3]\n')
    for study, states in ((more, ["waiting", "done", "done"]), (lab, ["done"] * 4)):
        sweep(study, done, replace(HERE, dry_run=True), Progress())
        assert [run.state for run in read_plan(done).runs] == states


def test_fluids_with_different_substeps_share_no_launch(tmp_path):
    """Paste has longer substeps than liquid. In one launch, against the rule, both have the same bits as alone."""
    lab = tiny_lab(tmp_path, '[grid]\n"fluid.freeze_after_s" = ["never"]\n"fluid.yield_stress_pa" = [0.0, 12.0]\n')
    edit(tmp_path / "trial.toml", "radius_mm = 0.45\nsubsteps = 2", "radius_mm = 0.42")
    out = tmp_path / "out"
    sweep(lab, out, replace(HERE, dry_run=True), Progress())
    liquid, paste = read_plan(out).runs
    assert liquid.kin != paste.kin
    sample, trials = _sample_of(out, liquid), [liquid.checked_trial, paste.checked_trial]
    assert [prepare(trial.pour(sample)).engine.substeps for trial in trials] == [6, 5]
    apart = [runner.seal(sample, [trial], HERE)[0] for trial in trials]
    for single, joined in zip(apart, runner.seal(sample, trials, HERE), strict=True):
        assert isinstance(single, runner.Sealing)
        assert isinstance(joined, runner.Sealing)
        np.testing.assert_array_equal(single.profile.level_mm, joined.profile.level_mm)


def _sample_of(out, run):
    return record_files.read_sample(out / "samples" / run.sample)


def test_runs_in_one_launch_equal_separate_runs_to_the_bit(fresh, unbroken):
    compute_here(fresh, batch=2)
    alone, together = results_of(unbroken), results_of(fresh)
    assert together.keys() == alone.keys()
    for number, (profile, figures) in together.items():
        assert profile == alone[number][0]
        for name in ("mean_error_mm", "volume_ratio"):
            assert figures[name] == alone[number][1][name]


def test_runs_with_the_explicit_viscosity_solver_are_launched_one_by_one(fresh, monkeypatch):
    """The stiffest fluid of a launch sets the number of passes, which would change the other results."""
    launches, seal = [], runner._seal

    def noted(sample, trials, *rest):
        launches.append(len(trials))
        return seal(sample, trials, *rest)

    monkeypatch.setattr(runner, "_seal", noted)
    run = read_plan(fresh).runs[0]
    trial = run.checked_trial
    explicit = trial.model_copy(update={"solver": trial.solver.model_copy(update={"viscosity_solve": "explicit"})})
    outcomes = runner.seal(_sample_of(fresh, run), [explicit] * 2, HERE)
    assert launches == [1, 1]
    assert [type(outcome) for outcome in outcomes] == [runner.Sealing] * 2


def test_a_failed_run_is_reported_with_its_reason_without_stopping_other_runs(lab, fresh, unbroken, monkeypatch):
    """One run diverges and one meets a bug, in one launch with the two other runs."""
    seal = runner._seal

    def stumble(sample, trials, *rest):
        weights = {trial.fluid.U for trial in trials if trial.fluid.D_cm == 0.3}
        if 3.0 in weights:
            raise NumericalError("A position is no number any more. Frame 7.")
        if 300.0 in weights:
            raise ZeroDivisionError("on purpose")
        return seal(sample, trials, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(runner, "_seal", stumble)
        compute_here(fresh, batch=4)
        runs = first, diverged, other, bug = read_plan(fresh).runs
        report = sweep(lab, fresh, HERE, Progress())
    assert [run.state for run in runs] == ["done", "failed", "done", "failed"]
    assert (diverged.reason, diverged.trace) == ("A position is no number any more. Frame 7.", None)
    assert "ZeroDivisionError: on purpose" in (bug.reason or "")
    assert "in stumble" in (bug.trace or "")
    assert (diverged.figures, bug.figures) == (None, None)
    expected = results_of(unbroken)
    for run in (first, other):
        assert profile_path(fresh, run).read_bytes() == expected[run.number][0]
    assert report["exit_code"] == 1  # a bug's code, before that of runs that failed
    failed = "failed: run 2 (fluid.U = 3, fluid.D_cm = 0.3): A position is no number any more. Frame 7."
    assert failed in swept_lines(report)
    sweep(lab, fresh, replace(HERE, retry=True, dry_run=True), Progress())
    compute_here(fresh)
    assert results_of(fresh) == expected


def test_a_run_whose_particles_went_through_a_wall_fails_without_results(fresh, monkeypatch):
    outcomes = Injection.outcomes

    def escaping(self):
        return [replace(outcome, escaped_particles=2) for outcome in outcomes(self) if isinstance(outcome, Run)]

    monkeypatch.setattr(Injection, "outcomes", escaping)
    compute_here(fresh)
    run = read_plan(fresh).runs[0]
    assert (run.state, run.figures) == ("failed", None)
    assert "2 particles went through a wall" in (run.reason or "")
    assert not profile_path(fresh, run).exists()


def test_wrong_arguments_of_sweep_exit_with_2_and_missing_files_with_3(tmp_path, lab):
    for arguments, code in (
        ((), 2),
        (("--example", tmp_path / "mine.toml"), 0),
        # A file with other content is not overwritten.
        (("--example", lab), 3),
        ((lab, "--example", tmp_path / "other.toml"), 2),
        ((lab, lab), 2),
        ((tmp_path / "missing.toml",), 3),
    ):
        assert sealtwin("sweep", *arguments).exit_code == code, arguments


def test_settings_that_do_not_fit_the_crack_are_refused_before_the_first_run(tmp_path):
    study = tiny_lab(tmp_path, '[grid]\n"solver.radius_mm" = [0.45, 3.0]\n"fluid.U" = [1.0, 2.0]\n')
    with pytest.raises(InputError) as caught:
        sweep(study, tmp_path / "out", HERE, Progress())
    assert "runs 3, 4: solver.radius_mm is 3: fewer than 2 particles fit side by side" in str(caught.value)
    assert read_plan(tmp_path / "out").runs == []


def test_a_foreign_busy_or_edited_sweep_folder_is_refused(lab, tmp_path, fresh):
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match=r"has files that no sweep wrote \(thesis.txt\)"):
        sweep(lab, tmp_path / "theirs", HERE, Progress())
    other = tiny_lab(tmp_path / "lab")
    edit(other, 'name = "tiny"', 'name = "another"')
    with pytest.raises(InputError, match="has the study 'tiny', but this is 'another'"):
        sweep(other, fresh, HERE, Progress())
    with holding(fresh), pytest.raises(BusyError, match="in use by process"):
        sweep(lab, fresh, HERE, Progress())
    plan = read_json(fresh / "plan.json")
    plan["runs"][0]["trial"]["readings"] = "readings.csv"
    (fresh / "plan.json").write_text(json.dumps(plan))
    with pytest.raises(
        InputError, match=r"plan\.json: the content differs from what sealtwin wrote .*readings is not a table"
    ):
        read_plan(fresh)
