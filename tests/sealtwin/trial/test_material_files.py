"""Trials whose sealant is described by tables, which are stored with the run and compared by content."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from sealtwin.cli.app import app
from sealtwin.core.errors import InputError, present
from sealtwin.core.files import read_json
from sealtwin.core.progress import Progress
from sealtwin.study.perturbed_inputs import Base
from sealtwin.study.pipeline import run_stages, run_trial
from sealtwin.study.uncertainty_runs import _variants
from sealtwin.trial.trial_file import load_trial
from simulate.material_curve import MaterialCurve
from simulate.material_file import Material
from tests.support.ingested_lab import edit
from tests.support.report_stubs import leave_out_figures
from tests.support.tiny_study import job_in, tiny_lab

QUIET = Progress()
STAGES = ("digitise", "simulate")
CURING = "age_s,viscosity_pa_s,yield_stress_pa\n0,0.05,0\n0.2,5,20\n"
THINNING = "age_s,viscosity_pa_s\n0,50\n0.5,0.05\n"
MEASURED = """\
method = "by hand"
date = "2026-11-21"
data = "synthetic"
yield_stress_pa = 12.0
yield_stress_error_pa = 1.0
yield_stress_95_pa = [10.0, 14.0]
viscosity_pa_s = 0.5
viscosity_error_percent = 10.0
density_kg_m3 = 1690.0
density_error_kg_m3 = 10.0
not_for = ["anything"]
"""


def lab_with(folder: Path, fluid: str, varies: str | None = None) -> Path:
    """Return the trial of a tiny lab whose fluid is that."""
    study = tiny_lab(folder) if varies is None else tiny_lab(folder, varies)
    trial = study.parent / "trial.toml"
    text = trial.read_text(encoding="utf-8")
    head, rest = text.split("[fluid]\n")
    rest = rest[rest.index("[solver]") :]
    trial.write_text(f"{head}[fluid]\n{fluid}\n{rest}\n[output]\nsnapshots_s = []\n", encoding="utf-8")
    for name, table in (("curing.csv", CURING), ("thinning.csv", THINNING)):
        (folder / name).write_text(table, encoding="utf-8")
    return trial


def run(trial: Path, out: Path) -> tuple[str, ...]:
    return run_trial(load_trial(trial), trial, out, STAGES, "cpu", QUIET).redone


def test_a_run_is_repeated_only_if_the_content_of_its_material_table_changes(tmp_path):
    trial, out = lab_with(tmp_path, 'curve = "curing.csv"\nfreeze_after_s = "never"'), tmp_path / "out"
    assert run(trial, out) == STAGES
    recorded = read_json(out / "simulation.json")
    assert recorded["settings"]["fluid"]["curve"]["yield_stress_pa"] == [0.0, 20.0]
    assert recorded["health"]["viscosity_pa_s"] == pytest.approx(0.05)
    (tmp_path / "curing.csv").rename(tmp_path / "renamed.csv")
    edit(trial, "curing.csv", "renamed.csv")
    assert run(trial, out) == ()
    (tmp_path / "renamed.csv").unlink()
    with job_in(out) as job:
        assert run_stages(job, ("simulate",)).redone == ()
    (tmp_path / "renamed.csv").write_text(CURING.replace("20\n", "21\n"), encoding="utf-8")
    assert run(trial, out) == ("simulate",)


def test_extra_runs_move_the_viscosity_table(tmp_path):
    """Every viscosity is scaled, and every yield stress is shifted by the same step."""
    fluid = 'curve = "thinning.csv"\nfreeze_after_s = "never"'
    trial, out = lab_with(tmp_path, fluid), tmp_path / "out"
    text = trial.read_text(encoding="utf-8").replace("radius_mm = 0.45", "radius_mm = 0.36")
    declared = "\n[uncertainty]\nviscosity_percent = 10.0\nyield_stress_pa = 2.0\n"
    trial.write_text(text + declared, encoding="utf-8")
    run(trial, out)
    with job_in(out) as job:
        variants = _variants(Base.of(job), designed=True)
    curves = [(moved, each.fluid.curve) for moved, each, _ in variants if each.fluid is not None]
    assert len(curves) > 3
    for moved, curve in curves:
        assert isinstance(curve, MaterialCurve)
        grown = 1 + moved.get("viscosity_percent", 0.0) / 100
        assert curve.viscosity_pa_s == pytest.approx((50 * grown, 0.05 * grown))
        step_pa = moved.get("yield_stress_pa")
        assert curve.yield_stress_pa == (None if step_pa is None else (max(0.0, step_pa),) * 2)


def test_a_run_uses_values_and_uncertainties_of_a_material_file(tmp_path, monkeypatch):
    """The material is stored with the run; a declared [uncertainty] replaces that of the material."""
    leave_out_figures(monkeypatch)
    (tmp_path / "curve.csv").write_text("shear_rate_per_s,stress_pa\n1,12.5\n3,13.4\n10,17.2\n30,27.1\n100,62\n")
    line = ["material", "rheometer", str(tmp_path / "curve.csv"), "--density-kg-m3", "1800", "--data", "synthetic"]
    assert CliRunner().invoke(app, [*line, "--out", str(tmp_path / "material.toml")]).exit_code == 0
    trial, out = lab_with(tmp_path, 'material = "material.toml"\nfreeze_after_s = "never"'), tmp_path / "out"
    trial.write_text(trial.read_text().replace("[solver]", '[solver]\nmodel = "slot"'))
    run_trial(load_trial(trial), trial, out, (*STAGES, "validate"), "cpu", QUIET)
    assert "Do not use it for shear rates outside" in (out / "report.html").read_text(encoding="utf-8")
    recorded = load_trial(out / "trial.toml")
    fluid, uncertainty = present(recorded.fluid, "fluid"), recorded.uncertainty
    assert isinstance(fluid.material, Material)
    assert (fluid.yield_stress_pa, fluid.viscosity_pa_s) == pytest.approx((12.0, 0.502), rel=0.01)
    assert fluid.density_kg_m3 == 1800
    assert uncertainty.yield_stress_pa == fluid.material.yield_stress_error_pa > 0.3
    assert uncertainty.moved["viscosity_percent"] == fluid.material.viscosity_error_percent
    assert read_json(out / "simulation.json")["settings"]["fluid"]["material"]["not_for"]
    text = trial.read_text(encoding="utf-8")
    trial.write_text(text + "\n[uncertainty]\nyield_stress_pa = 3.0\n", encoding="utf-8")
    assert load_trial(trial).loaded(tmp_path).uncertainty.yield_stress_pa == 3.0


@pytest.mark.parametrize(
    ("fluid", "named"),
    [
        ('"material.toml"\nU = 5.0', "material cannot .* U,"),
        ('"material.toml"\nviscosity_pa_s = 1.0', "has a viscosity, but fluid.viscosity_pa_s is 1"),
        ('"nowhere.toml"', "nowhere.toml: no such file"),
    ],
)
def test_a_material_file_that_is_missing_or_contradicts_the_trial_is_refused(tmp_path, fluid, named):
    (tmp_path / "material.toml").write_text(MEASURED, encoding="utf-8")
    with pytest.raises(InputError, match=named):
        load_trial(lab_with(tmp_path, f'material = {fluid}\nfreeze_after_s = "never"')).loaded(tmp_path)
