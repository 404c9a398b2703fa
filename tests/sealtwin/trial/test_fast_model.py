"""Trials whose level is computed by the fast model, solver.model = "slot"."""

from pathlib import Path

import pytest

from sealtwin.cli.trial_answer import result_lines
from sealtwin.core.errors import InputError, present
from sealtwin.core.facts import texts
from sealtwin.core.files import read_json
from sealtwin.core.progress import Progress
from sealtwin.study.pipeline import FinishedStages, run_trial
from sealtwin.study.uncertainty_runs import vary
from sealtwin.trial.job import STAGES, StageName
from sealtwin.trial.trial_file import load_trial
from tests.support.report_stubs import leave_out_figures
from tests.support.tiny_study import TRIAL, job_in, tiny_lab

QUIET = Progress()
PASTE = TRIAL.replace("U = 30.0\nD_cm = 0.3\nfreeze_after_s = 0.2", 'viscosity_pa_s = 0.05\nfreeze_after_s = "never"')


def run(lab: Path, text: str, stages: tuple[StageName, ...] = STAGES) -> FinishedStages:
    trial = lab / "trial.toml"
    trial.write_text(text + "\n[gate]\nmean_error_mm = 9.0\n", encoding="utf-8")
    return run_trial(load_trial(trial), trial, lab / "out", stages, "cpu", QUIET)


def test_the_report_of_a_trial_by_the_fast_model_names_the_model(tmp_path, monkeypatch):
    leave_out_figures(monkeypatch)
    tiny_lab(tmp_path)
    out = tmp_path / "out"
    assert run(tmp_path, PASTE, STAGES[:2]).redone == ("digitise", "simulate")
    assert (out / "snapshots" / "snapshots.pvd").is_file()
    fast = PASTE.replace("[solver]", '[solver]\nmodel = "slot"')
    with pytest.raises(InputError, match=r"finished run of particles.*--out"):
        run(tmp_path, fast)
    finished = run(tmp_path, fast.replace("depth_mm = 8", "depth_mm = 9"))
    assert finished.redone == ("digitise", "simulate", "validate")
    # Files of the particle run are removed, and numbers of particles are None, not 0.
    assert not list((out / "snapshots").glob("*"))
    fluid, compared = present(finished.result.fluid, "fluid"), present(finished.result.comparison, "comparison")
    assert {fluid.particles, fluid.escaped_particles, fluid.spilled_particles} == {None}
    report = read_json(out / "report.json")
    assert report["headline"][0]["key"] == "verdict.screening"
    assert "gate of 9 mm is not applied" in report["headline"][0]["text"]
    lines = result_lines(finished.result, "validate", can_be_varied=finished.can_be_varied)
    assert not [line for line in lines if "--uncertainty" in line]
    assert report["outcome"] == "open"
    assert compared.passed is None
    tables = {table["title"]: dict(table["rows"]) for table in report["tables"]}
    assert tables["Dispensed sealant, by place"]["over the edge of the sample"] == "not computed by the fast model"
    assert "Fluid    fast model, without particles; for screening only, not as a result" in lines
    with job_in(out) as job, pytest.raises(InputError, match=r"\[uncertainty\] declares no"):
        vary(job)


def test_a_likely_unit_error_is_named_once_in_each_output(tmp_path, monkeypatch):
    leave_out_figures(monkeypatch)
    tiny_lab(tmp_path)
    (tmp_path / "trial.toml").write_text(PASTE)
    slips = {"crack.depth_mm": 1.6, "path.speed_mm_s": 0.2, "fluid.viscosity_pa_s": 60.0, "solver.model": "slot"}
    trial = load_trial(tmp_path / "trial.toml", slips)
    result = run_trial(trial, tmp_path / "trial.toml", tmp_path / "out", STAGES, "cpu", terminal := Progress()).result
    answer = *present(result.sample, "sample").warnings, *present(result.fluid, "fluid").warnings
    report = read_json(tmp_path / "out" / "report.json")
    printed = [warning.text for warning in terminal.warned]
    for sentences in (printed, texts(answer), [fact["text"] for fact in report["assumptions"]]):
        assert [sum(f"{name.partition('.')[2]} is " in text for text in sentences) for name in slips] == [1, 1, 1, 0]
