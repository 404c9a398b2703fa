"""Calibration: refusals before the first run, and the prediction of a held-out trial."""

from dataclasses import replace
from datetime import date
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sealtwin as st
from sealtwin.calibration import CalibrationOptions
from sealtwin.calibration import calibrate as calibrating
from sealtwin.calibration import search as searching
from sealtwin.calibration.calibrate import MAX_FREE, calibrate
from sealtwin.calibration.search import Twin
from sealtwin.cli.app import app
from sealtwin.core.errors import InputError, present
from sealtwin.core.progress import Progress
from sealtwin.study import runner
from sealtwin.study.study_folder import read_plan
from simulate.settings import Fluid
from tests.support.report_stubs import leave_out_figures
from tests.support.tiny_study import AGED, HERE, tiny_lab
from validate.calibration.posterior import Free, smooth_errors_mm2
from validate.settings import Uncertainty

YIELD = {"fluid.yield_stress_pa": (2.0, 20.0)}


@pytest.fixture
def lab(tmp_path):
    tiny_lab(tmp_path)
    return tmp_path


def _edited(lab, name, **changes):
    """Write the trial with other words in place of its own: ``changes`` by the old ones."""
    text = (lab / "trial.toml").read_text(encoding="utf-8")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    (lab / name).write_text(text, encoding="utf-8")
    return lab / name


def _refused(lab, files, ranges, *words, held_out=()):
    with pytest.raises(InputError) as refusal:
        calibrate(files, CalibrationOptions(free=ranges, hold_out=held_out), lab / "out", HERE, Progress())
    assert all(word in str(refusal.value) for word in words), refusal.value
    assert not list((lab / "out").glob("library/*/runs/*"))


def test_readings_whose_role_contradicts_their_use_are_refused(lab):
    held_out = _edited(lab, "held.toml", **{"calibrated-on": "held-out"})
    _refused(lab, [held_out], YIELD, "held.toml", 'readings.role = "held-out"')
    trial = lab / "trial.toml"
    _refused(lab, [trial], YIELD, "trial.toml", 'readings.role = "calibrated-on"', held_out=[trial])
    slot = _edited(lab, "slot.toml", **{"[solver]": '[solver]\nmodel = "slot"'})
    _refused(lab, [trial, slot], YIELD, "slot.toml", 'solver.model is "slot"')
    assert not (lab / "out").exists(), "no crack is digitised before"


def test_held_out_readings_that_equal_the_calibration_readings_are_refused(lab):
    held_out = _edited(lab, "held.toml", **{"calibrated-on": "held-out", '"tiny"': '"other"'})
    _refused(lab, [lab / "trial.toml"], YIELD, "held.toml", "has the same readings as", held_out=[held_out])


@pytest.mark.parametrize(
    ("ranges", "words"),
    [
        ({"fluid.yeild_stress_pa": (1.0, 2.0)}, ("fluid.yeild_stress_pa", "fluid.yield_stress_pa")),
        ({"fluid.yield_stress_pa": (20.0, 2.0)}, ("fluid.yield_stress_pa=20:2",)),
        ({f"fluid.{number}": (0.0, 1.0) for number in range(MAX_FREE + 1)}, ("7 free settings",)),
        ({"solver.preset": (0.0, 1.0)}, ("solver.preset",)),
    ],
)
def test_free_settings_with_an_invalid_name_or_range_are_refused(lab, ranges, words):
    _refused(lab, [lab / "trial.toml"], ranges, *words)


def test_a_volume_cannot_be_calibrated_from_several_pours(lab):
    other = _edited(lab, "other.toml", **{'"tiny"': '"other"'})
    _refused(lab, [lab / "trial.toml", other], {"path.volume_ml": (0.05, 0.1)}, "path.volume_ml", "2 pours")


def test_smooth_errors_and_ranges_are_of_the_trials_own_path(lab):
    """The smooth errors of each trial are those at the ends of its own path."""
    twin = Twin(lab / "trial.toml", lab / "library", HERE, Progress())
    first_mm, last_mm = (float(twin._sample.trajectory.s_mm[at]) for at in (0, -1))
    smooth_mm2 = smooth_errors_mm2(twin.evidence.s_mm, (first_mm, last_mm))
    assert np.allclose(twin.evidence.smooth_mm2, smooth_mm2)
    twin.require([Free("path.trim_mm", 0.0, 3.0)])


def test_the_error_for_a_malformed_free_option_names_the_option():
    for text in ("fluid.U", "fluid.U=3", "fluid.U=3:x", "=3:4"):
        answer = CliRunner().invoke(app, ["calibrate", "trial.toml", "--free", text])
        assert answer.exit_code == 3
        assert "--free" in answer.output
    assert CliRunner().invoke(app, ["calibrate", "t.toml", "--free", "fluid.U=1:3", "--budget", "39"]).exit_code == 3


def emulated_trials(lab):
    """Write a trial to calibrate on and one that is held out, whose readings are EMULATED by runs of a known paste.

    Paste that does not freeze keeps its volume, even of so few particles. An emulator of a dozen tiny runs is off by as
    much as the readings are.
    """
    tiny_lab(lab)
    paste = {
        AGED: 'viscosity_pa_s = 0.1\nyield_stress_pa = 1.0\nfreeze_after_s = "never"',
        "substeps = 2\nsettle_s = 0.0": "substeps = 3\nsettle_s = 0.6",
    }
    held_out = {'"tiny"': '"other"', "calibrated-on": "held-out", "readings.csv": "others.csv", "0.08": "0.1"}
    other, trial = (
        _edited(lab, "other.toml", **paste, **held_out),
        _edited(lab, "trial.toml", **paste, **{"0.08": "0.12"}),
    )
    s_mm = np.arange(1.0, 11.5, 0.5)
    for number, (file, sheet) in enumerate(((trial, "readings.csv"), (other, "others.csv"))):
        errors_mm = 0.3 * np.random.default_rng(number).standard_normal((3, len(s_mm)))

        def write(level_mm, sheet=sheet, errors_mm=errors_mm):
            columns, head = np.column_stack([s_mm, *(level_mm + errors_mm)]), "s_mm,level_1_mm,level_2_mm,level_3_mm"
            np.savetxt(lab / sheet, columns, "%.2f", ",", header=head, comments="")

        write(np.zeros(len(s_mm)))
        truth = {"fluid.viscosity_pa_s": 0.1, "fluid.yield_stress_pa": 2.0}
        (level_mm,) = Twin(file, lab / "truth", HERE, Progress()).run([(truth, 900 + number)])
        write(present(level_mm, "level"))
    return trial, other


def test_a_calibration_predicts_a_held_out_trial(tmp_path, monkeypatch):
    """The case is coarse: tiny trials, draft runs, and half the runs of a search.

    The runs of the last round, and those of the held-out trial, are accurate.
    """
    leave_out_figures(monkeypatch)
    for name, count in (
        *(("FIRST", 8), ("AGAIN", 2), ("ROUND", 2), ("CONFIRM", 2)),
        *(("STEPS", 150), ("STEPS_OF_A_ROUND", 40)),
    ):
        monkeypatch.setattr(searching, name, count)
    monkeypatch.setattr(calibrating, "CONFIRM", 2)
    monkeypatch.setattr(calibrating, "PREDICTING", 3)
    one, other = emulated_trials(tmp_path)
    with one.open("a", encoding="utf-8") as trial:
        trial.write("\n[uncertainty]\npass_mm = 0.0\n")
    ranges = {"fluid.viscosity_pa_s": (0.03, 0.4), "fluid.yield_stress_pa": (0.5, 6.0)}
    progress, later_s = Progress(), list[float]()
    progress.later = lambda left_s, times=0: later_s.append(left_s)
    # Finished runs do not correct the estimate, since times of such small runs depend on the machine.
    monkeypatch.setattr(runner, "slowness", lambda _: 1.0)
    how = replace(HERE, drafts=True)
    options = CalibrationOptions(free=ranges, hold_out=(other,)).model_copy(update={"budget": 14})
    content = calibrate([one], options, tmp_path / "out", how, progress)
    # Six more runs and three of the held-out trial follow the first eight; three follow the last two; then none does.
    some_s = [left_s for left_s in later_s if left_s > 0]
    assert some_s[0] > 1.5 * some_s[-1]
    assert later_s[-1] == 0.0
    assert content["possible"], content["finding"]
    assert content["drafts_of_each_trial"] == [12]
    presets = {
        name: [run.trial["solver"]["preset"] for run in read_plan(tmp_path / "out/library" / name).runs]
        for name in ("tiny", "other")
    }
    assert presets == {"tiny": ["draft"] * 12 + ["accurate"] * 2, "other": ["accurate"] * 3}
    roles = {one["trial"]: one["role"] for one in content["predictions"]}
    assert roles == {"tiny": "calibrated", "other": "held out"}
    assert content["predictions"][1]["rms_mm"] < content["predictions"][1]["flat_rms_mm"]
    assert content["predictions"][1]["stations_in_band"] >= 0.8
    assert {*content["fluid_warnings"]} <= {*content["cautions"]}
    assert {one.partition(":")[0] for one in content["fluid_warnings"]} == {"tiny", "other"}
    assert callable(st.calibrate), "a package of that name once took its place from the second call on"


def test_the_material_of_a_shear_thinning_paste_has_a_consistency_and_a_flow_index():
    """A run records K as its viscosity at a shear rate of 1/s; a free n has the interval of its draws."""
    fluid = Fluid(consistency_pa_s_n=4.0, flow_index=0.5, yield_stress_pa=7.0)
    trial = SimpleNamespace(fluid=fluid, uncertainty=Uncertainty())
    run = SimpleNamespace(viscosity_pa_s=5.0, substeps=3)
    twin: Any = SimpleNamespace(trial=trial, health=run, radius_mm=0.4)
    frees = [Free("fluid.consistency_pa_s_n", 3.0, 7.0), Free("fluid.flow_index", 0.4, 0.8)]
    result: Any = SimpleNamespace(frees=frees, best=np.array([0.5, 0.25]), points=[0], levels_mm=[0])
    draws = np.random.default_rng(0).uniform(0.0, 0.5, (500, 2))
    calibrated: Any = SimpleNamespace(emulated=False, marginals=())
    material = calibrating._material(result, draws, calibrated, twin, date(2026, 11, 26))
    assert material is not None
    assert (material.viscosity_pa_s, material.consistency_pa_s_n, material.flow_index) == (None, 5.0, 0.5)
    assert material.flow_index_95 == pytest.approx((0.405, 0.595), abs=0.01)
    assert material.viscosity_error_percent is not None
    result.frees, result.best = [Free("fluid.viscosity_pa_s", 3.0, 7.0)], np.array([0.5])
    material = calibrating._material(result, draws[:, :1], calibrated, twin, date(2026, 11, 26))
    assert material is not None, "a free viscosity replaces K and n"
    assert (material.viscosity_pa_s, material.consistency_pa_s_n, material.flow_index) == (5.0, None, None)


@pytest.mark.parametrize(("given", "drafts"), [({"solver.settle_s": 0.1}, True), ({"solver.radius_mm": 0.5}, False)])
def test_calibration_runs_are_drafts_unless_the_solver_resolution_is_given(lab, monkeypatch, given, drafts):
    chosen = []

    def twin(_file, _library, how, *_, **__):
        chosen.append(how.drafts)
        raise InputError("computes nothing")

    monkeypatch.setattr(calibrating, "Twin", twin)
    how = replace(HERE, drafts=True)
    with pytest.raises(InputError, match="computes nothing"):
        calibrate([lab / "trial.toml"], CalibrationOptions(free=YIELD), lab / "out", how, Progress(), given)
    assert chosen == [drafts]
