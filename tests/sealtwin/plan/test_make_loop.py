"""An emulated pour by coarse particles, its page and the replay of its log; and both commands on a tiny trial."""

import html
import json
import warnings
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from digitise.settings import CrackShape
from sealtwin.api.planning import read_loop
from sealtwin.cli.app import app
from sealtwin.core import files
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile
from sealtwin.core.run_figures import RunHealth
from sealtwin.plan import loop_model, make_loop, search
from sealtwin.plan.emulation import Emulated, Faults, emulate
from sealtwin.plan.loop_model import write_model
from sealtwin.plan.loop_step import LevelFrame, LoggedStep, LoopState, step
from sealtwin.plan.make_loop import TABLES, replay
from sealtwin.plan.verify import Misfit
from sealtwin.trial.job import shown
from sealtwin.trial.stage_numbers import NUMBERS, numbers_up_to
from simulate.settings import LEVEL, Fluid, Nozzle, Solver
from tests.planned_slot import OUTLINE, areas, model, passes
from tests.studies import plannable_lab

FAULTS = Faults(flow_factor=0.7, noise_mm=0.1, latency_s=0.3, lost_share=0.2)
PHYSICS = (
    Fluid(viscosity_pa_s=1.0, yield_stress_pa=5.0, freeze_after_s="never"),
    Solver(radius_mm=0.95, settle_s=0.5, volume_factor=1.05),
    Nozzle(diameter_mm=2.4),
)


@cache
def poured() -> Emulated:
    shape = CrackShape(depth_mm=10.0, tilt="vertical")
    return emulate(model(), passes(), OUTLINE, shape, PHYSICS, FAULTS, seed=1, slope=LEVEL)


@cache
def by_fast_model() -> Emulated:
    """Return such a pour with the fast model as reality, of which three levels in four arrive."""
    state, lines, it = LoopState.start(model()), [], model().sections
    for t_s in np.arange(4.0, passes().motion.t_s[-1], 1.0).tolist():
        filled = areas(0.9 * np.array(state.commands), np.array([t_s]))[0]
        level_mm = it.bottom_mm + it.height_mm(filled)
        frame = LevelFrame(t_s, tuple(it.s_mm.tolist()), tuple(level_mm.tolist())) if t_s % 4 else None
        state, plan = step(model(), state, t_s, frame)
        lines.append(LoggedStep(t_s, frame, state, plan))
    level = Profile(it.s_mm, np.zeros_like(it.s_mm))
    return Emulated(Misfit(12.4, 3.2, 0.5), Misfit(77.7, 0.0, -0.1), level, 1234.0, tuple(lines))


def log_of(folder: Path) -> Path:
    """Write tables and log as ``run_loop`` does."""
    write_model(folder / TABLES, model(), "", numbers_up_to("simulate"))
    head = {"version": 1, "tables_sha256": files.sha256(folder / TABLES)}
    log = folder / "loop-1.jsonl"
    log.write_text("".join(f"{json.dumps(line)}\n" for line in (head, *map(asdict, by_fast_model().lines))))
    return log


@pytest.mark.slow
def test_a_pump_that_gives_less_is_made_good_in_particles():
    """Uncorrected, 0.7 of the plan's 1,470 mm3 are given."""
    it, planned_mm3 = poured(), passes().with_flow(passes().nominal).dispensed_mm3
    assert it.given_mm3 > 0.85 * planned_mm3
    assert it.misfit.under_mm3 < 0.7 * it.after_first.under_mm3
    assert it.lines[-1].state.flow == pytest.approx(0.7, abs=0.15)


@pytest.mark.slow
def test_a_sensor_loses_levels_is_late_and_does_not_see_the_nozzle():
    lines = poured().lines
    frames = [line.level for line in lines if line.level is not None]
    assert 0 < len(frames) < len(lines)
    for line in lines:
        if (level := line.level) is not None:
            assert level.t_s == pytest.approx(line.t_s - 0.3, abs=0.05)
            at_mm = np.interp(level.t_s, passes().motion.t_s, passes().motion.s_mm)
            assert np.abs(np.array(level.s_mm) - at_mm).min() > 6
        else:
            assert line.plan.said != "corrected"


def test_a_log_is_answered_alike_and_another_answer_is_named_by_its_line(tmp_path):
    log = log_of(tmp_path)
    assert replay(tmp_path, log) == len(by_fast_model().lines) > 10
    lines = log.read_text().splitlines()
    third = json.loads(lines[2])
    third["state"]["flow"] += 0.01
    log.write_text("\n".join([*lines[:2], json.dumps(third), *lines[3:]]))
    with pytest.raises(NumericalError, match=r"loop-1\.jsonl, line 3"):
        replay(tmp_path, log)


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        (lambda text: text.replace("{", "", 1), "line 1"),
        (lambda text: text.replace('"t_s"', '"t"'), "loop-1.jsonl"),
        (lambda text: text.replace('tables_sha256": "', 'tables_sha256": "0'), TABLES),
        (lambda text: "", "loop-1.jsonl"),
        (lambda text: text + "[1]\n", "loop-1.jsonl"),
        (lambda text: text + text.splitlines()[-1], "is repeated"),
        (lambda text: "\n".join([text.splitlines()[row] for row in (0, 2, 1)]), "line 3: t_s = 4"),
    ],
)
def test_a_log_that_is_damaged_or_of_another_plan_is_refused(tmp_path, damage, named):
    log = log_of(tmp_path)
    log.write_text(damage(log.read_text()))
    with pytest.raises(InputError) as refused:
        replay(tmp_path, log)
    assert named in str(refused.value)


def test_a_cell_whose_programs_keep_one_flow_is_refused_before_any_run(tmp_path):
    lab = plannable_lab(tmp_path)
    text = (lab / "cell.toml").read_text()
    (lab / "cell.toml").write_text(text.replace('formats = ["csv"]', 'formats = ["spel", "csv"]'))
    line = ["plan", str(lab / "planned.toml"), "--cell", str(lab / "cell.toml"), "--out", str(tmp_path / "out")]
    answer = CliRunner().invoke(app, line)
    assert answer.exit_code == 3
    assert 'cell.toml: spel.motion = "curve" and spel.dispenser = "output"' in answer.output
    assert not (tmp_path / "out").exists()


def test_tables_of_another_solver_are_made_anew(tmp_path, monkeypatch):
    """Their plan is the same, and its motion: only who computes the areas is another."""
    made = []
    stand_ins = {"case_of": lambda *_: None, "by_particles": lambda *_, **__: None}
    stand_ins["make_model"] = lambda *_, **__: made.append(1) or model()
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(make_loop, name, stand_in)
    (tmp_path / "plan.csv").write_text("t_s\n0\n")
    trial: Any = SimpleNamespace(seed=0)
    bench: Any = SimpleNamespace(trajectory=None)
    for raised, times in (("", 1), ("", 1), ("digitise", 2), ("simulate", 3)):
        monkeypatch.setitem(NUMBERS, raised, 999)
        make_loop._model(tmp_path, bench, trial, passes(), PHYSICS, Progress())
        assert len(made) == times


def test_who_replays_or_reads_a_loop_of_another_solver_is_told_so(tmp_path, monkeypatch):
    log, own = log_of(tmp_path), NUMBERS["simulate"]
    command = ["loop", str(tmp_path), "--replay", str(log), "--quiet"]
    for number, times in ((own, 0), (999, 1)):
        monkeypatch.setitem(NUMBERS, "simulate", number)
        answers = [CliRunner().invoke(app, [*command, *more]) for more in ([], ["--json"])]
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            assert read_loop(tmp_path).first == model().first
        others = json.loads(answers[1].stdout)["other_versions"]
        words = f"{shown(tmp_path)}: the tables of its loop were computed by "
        assert [words in one for one in others] == [True] * times
        assert [str(one.message) for one in caught] == others
        assert [answers[0].stdout.count(one) for one in others] == [1] * times


def test_plan_and_loop_of_a_tiny_trial(tmp_path, monkeypatch):
    monkeypatch.setattr(loop_model, "LOOP", replace(loop_model.LOOP, first=10, again=8, tried=2))
    monkeypatch.setattr(search, "MOST_STEPS", 2)
    lab, out = plannable_lab(tmp_path), tmp_path / "out"

    def called(*words: object) -> dict:
        answer = CliRunner().invoke(app, [*map(str, words), "--json", "--quiet"])
        assert answer.exit_code == 0, answer.output
        return json.loads(answer.stdout)

    given = ("--cell", lab / "cell.toml", "--posterior", lab / "draws.csv", "--device", "cpu", "--out", out)
    planned = called("plan", lab / "planned.toml", *given, "--verify", 1, "--seeds", 2, "--knots", 3)
    assert planned["drafts"]
    assert planned["seeds"][0]["total_mm3"] <= min(one["total_mm3"] for one in planned["baselines"].values())
    assert planned["chances"]["draws"] == 3
    assert planned["fluid_warnings"]
    page = html.unescape((out / "plan.html").read_text())
    assert all(warning in page for warning in planned["fluid_warnings"])
    assert planned["verified"] == bool(planned.get("robot")) == (out / "robot").is_dir()
    assert planned["seeds"][0] != planned["seeds"][1]
    path = files.read_table(out / "plan.csv", ("t_s", "speed_mm_s"))
    # Twice the trial's speed at most; the cell would allow more.
    assert 0 < path[:, 1].max() <= 16.01
    emulated = called("loop", out, "--emulate", lab / "faults.toml")
    assert emulated["data"] == "EMULATED"
    assert emulated["fluid_warnings"] == planned["fluid_warnings"]
    assert called("loop", out, "--replay", out / emulated["log"])["steps"] == emulated["updates"] > 5
    assert "EMULATED" in (out / "loop.html").read_text()
    uncorrected = called("loop", out, "--emulate", lab / "faults.toml", "--uncorrected")
    assert uncorrected["updates"] == 0
    # The pump gives 0.8 of what the first pass asks for, which in so short a crack is 0.76 of the plan.
    assert uncorrected["given_mm3"] == pytest.approx(0.8 * 0.76 * planned["sealant_mm3"], rel=0.1)
    assert uncorrected["given_mm3"] < emulated["given_mm3"]


@pytest.mark.parametrize(("finer", "substeps"), [([None, None], None), ([None, 2], 6)])
def test_a_loop_pours_with_the_substeps_of_a_plan_that_was_computed_anew(tmp_path, monkeypatch, finer, substeps):
    healths = [
        RunHealth(volume_factor=1.0 + 0.1 * n, substeps=3 * (one or 1), finer=one) for n, one in enumerate(finer)
    ]
    runs = [SimpleNamespace(figures=SimpleNamespace(health=health)) for health in healths]
    monkeypatch.setattr(make_loop, "read_plan", lambda _: SimpleNamespace(runs=[*runs, SimpleNamespace(figures=None)]))
    settings = make_loop.as_verified(tmp_path)
    assert settings.pop("volume_factor") == pytest.approx(1.05)
    assert settings == ({} if substeps is None else {"substeps": substeps})
