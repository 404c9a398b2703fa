"""Plans for the rest of an interrupted pour, with the fast model in place of a real pour."""

import html
import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import sealtwin as st
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.cli.app import app
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile, Sample, Trajectory
from sealtwin.plan import PlanOptions, search
from sealtwin.plan.rest import Continued, Rest, read_levels, rest_of
from sealtwin.plan.search import Case, Knots, Limits
from sealtwin.plan.verify import Misfit, misfit
from simulate.pour import Pour
from simulate.settings import Fluid, Solver
from simulate.slot.fill import HerschelBulkley
from tests.support.shapes import straight_slot
from tests.support.tiny_study import plannable_lab

OUTLINE = straight_slot(40.0, 4.0)
SOLID = build_solid(OUTLINE, CrackShape(depth_mm=10.0, tilt="vertical"))
WAY = plan_trajectory(OUTLINE, NozzlePath(trim_mm=3.0), SOLID.cavity_volume_mm3)
SAMPLE = Sample(OUTLINE, SOLID, WAY)
FLUID = Fluid(viscosity_pa_s=1.0, yield_stress_pa=5.0, freeze_after_s="never")
CASE = Case(Pour(SAMPLE, (FLUID,), Solver(settle_s=2.0)), HerschelBulkley(1690, 5.0, 1.0))
LIMITS = Limits((10.0, 500.0), (1.0, 6.0))
FLOWS = (221.0, 132.0, 125.0, 61.0, 18.0)
"""Flow at knots of a plan that the fast model finds for this slot at 3 mm/s, rounded."""
PAUSED_MM = 20.0


def planned() -> Trajectory:
    settings = NozzlePath(trim_mm=3.0, speed_mm_s=3.0, lead_in_mm=4.0, lead_out_mm=2.0)
    own = plan_trajectory(OUTLINE, settings, SOLID.cavity_volume_mm3)
    plan = np.concatenate([np.log(FLOWS), np.full(len(FLOWS), np.log(3.0)), [1.8, 0.2]])
    return Knots(own, len(FLOWS)).trajectory(plan)


def with_flow(path, factor) -> Trajectory:
    return replace(path, flow_mm3_s=factor * path.flow_mm3_s)


def judged(bed) -> Misfit:
    return misfit(SAMPLE, Profile(bed.sections.s_mm, bed.level_mm))


def paused(path) -> Trajectory:
    """Return the path up to ``PAUSED_MM``."""
    row = int(np.abs(path.s_mm - PAUSED_MM).argmin()) + 1
    flow_mm3_s = np.append(path.flow_mm3_s[: row - 1], 0.0)
    return Trajectory(path.t_s[:row], path.position_mm[:row], path.s_mm[:row], path.speed_mm_s[:row], flow_mm3_s)


def continued(path, factor, knots: int = 3) -> tuple[Rest, Misfit]:
    """Pour half of a path by a pump that gives ``factor`` of its flow, measure, plan the rest and pour it alike."""
    bed = CASE.fill(with_flow(paused(path), factor))
    s_mm = np.linspace(float(path.s_mm[path.giving][0]), PAUSED_MM, 18)
    levels = read_levels(np.column_stack([s_mm, np.interp(s_mm, bed.sections.s_mm, bed.level_mm)]))
    rest = rest_of(CASE, path, levels, LIMITS, PlanOptions(knots=knots))
    reality = Continued(**vars(CASE), poured=paused(path), flow_factor=factor)
    return rest, judged(reality.fill(rest.trajectory))


def test_the_planned_rest_corrects_a_pour_with_10_percent_too_little_flow():
    """Without a new plan 132 of 1,600 mm3 are missing. The rest starts anew, since the first half is low."""
    path = planned()
    rest, at_end = continued(path, 0.9, knots=6)
    unchanged = judged(CASE.fill(with_flow(path, 0.9)))
    assert rest.flow_factor == pytest.approx(0.9, abs=0.005)
    assert rest.trajectory.s_mm[0] == path.s_mm[path.giving][0]
    assert unchanged.total_mm3 == pytest.approx(132, abs=5)
    assert at_end.total_mm3 < 0.35 * unchanged.total_mm3
    assert rest.misfit.total_mm3 == pytest.approx(at_end.total_mm3, abs=3)
    assert rest.unchanged.total_mm3 == pytest.approx(unchanged.total_mm3, abs=3)


@pytest.mark.parametrize(
    ("levels", "words"),
    [
        ([[1.0, -2.0], [2.5, -2.0]], ("s_mm is from 1 to 2.5", "begins at 3.0")),
        ([[3.0, -9.5], [20.0, -9.5]], ("level_mm", "0.6 to 1.5")),
        ([[3.0, 1.0], [40.0, 1.0]], ("pour has reached its end",)),
        ([3.0, 20.0], ("shape is (2,)", "level_mm")),
    ],
)
def test_measured_levels_that_do_not_fit_the_pour_are_refused(levels, words):
    with pytest.raises(InputError) as refused:
        rest_of(CASE, planned(), read_levels(levels), LIMITS, PlanOptions())
    assert all(word in str(refused.value) for word in ("levels: ", *words)), refused.value


def test_the_plan_command_plans_a_trial_and_the_rest_of_its_pour(tmp_path, monkeypatch):
    monkeypatch.setattr(search, "MAX_STEPS", 1)
    lab, out = plannable_lab(tmp_path), tmp_path / "out"

    def called(*words: object) -> dict:
        answer = CliRunner().invoke(app, ["plan", *map(str, words), "--json", "--quiet"])
        assert answer.exit_code == 0, answer.output
        return json.loads(answer.stdout)

    given = ("--cell", lab / "cell.toml", "--posterior", lab / "draws.csv", "--device", "cpu", "--out", out)
    quick = ("--set", "path.speed_mm_s=16", "--set", "solver.settle_s=0.2")
    planned = called(lab / "planned.toml", *given, *quick, "--verify", 1, "--seeds", 2, "--knots", 3)
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
    assert 0 < path[:, 1].max() <= 32.01
    levels = [[2.0, -1.5], [4.0, -1.5], [6.0, -2.5]]
    (lab / "levels.csv").write_text("s_mm,level_mm\n" + "".join(f"{s},{level}\n" for s, level in levels))
    how = ("--cell", lab / "cell.toml", "--knots", 3, "--out", tmp_path / "rest")
    rest = called(out / "trial.toml", "--from", lab / "levels.csv", *how)
    assert rest["reached_mm"] == 6.0
    assert rest["robot"]
    same = st.plan_rest(out / "trial.toml", levels, out=tmp_path / "same", cell=lab / "cell.toml", knots=3)
    assert same.content["total_mm3"] == rest["total_mm3"]
    assert np.dot(same.flow_mm3_s[:-1], np.diff(same.t_s)) == pytest.approx(rest["sealant_mm3"], rel=1e-4)
    assert same.half_width_mm is None


def test_a_plan_for_a_robot_program_with_constant_flow_is_refused(tmp_path):
    lab = plannable_lab(tmp_path)
    text = (lab / "cell.toml").read_text()
    (lab / "cell.toml").write_text(text.replace('formats = ["csv"]', 'formats = ["spel", "csv"]'))
    line = ["plan", str(lab / "planned.toml"), "--cell", str(lab / "cell.toml"), "--out", str(tmp_path / "out")]
    answer = CliRunner().invoke(app, line)
    assert answer.exit_code == 3
    assert 'cell.toml: with spel.motion = "curve" and spel.dispenser = "output"' in answer.output
    assert not (tmp_path / "out").exists()
