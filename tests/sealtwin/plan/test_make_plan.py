"""The command 'plan', with a tiny crack and a search of one step."""

import html
import json

from typer.testing import CliRunner

from sealtwin.cli.app import app
from sealtwin.core import files
from sealtwin.plan import search
from tests.support.tiny_study import plannable_lab


def test_the_plan_command_plans_a_trial_and_writes_robot_programs(tmp_path, monkeypatch):
    monkeypatch.setattr(search, "MAX_STEPS", 1)
    lab, out = plannable_lab(tmp_path), tmp_path / "out"
    given = ("--cell", lab / "cell.toml", "--device", "cpu", "--out", out)
    quick = ("--set", "path.speed_mm_s=16", "--set", "solver.settle_s=0.2")
    few = ("--verify", 1, "--seeds", 2, "--knots", 3, "--json", "--quiet")
    answer = CliRunner().invoke(app, ["plan", *map(str, (lab / "planned.toml", *given, *quick, *few))])
    assert answer.exit_code == 0, answer.output
    planned = json.loads(answer.stdout)
    assert planned["drafts"]
    assert planned["seeds"][0]["total_mm3"] <= min(one["total_mm3"] for one in planned["baselines"].values())
    assert planned["fluid_warnings"]
    page = html.unescape((out / "plan.html").read_text())
    assert all(warning in page for warning in planned["fluid_warnings"])
    assert planned["verified"] == bool(planned.get("robot")) == (out / "robot").is_dir()
    assert planned["seeds"][0] != planned["seeds"][1]
    path = files.read_table(out / "plan.csv", ("t_s", "speed_mm_s"))
    # Twice the trial's speed at most; the cell would allow more.
    assert 0 < path[:, 1].max() <= 32.01


def test_a_plan_for_a_robot_program_with_constant_flow_is_refused(tmp_path):
    lab = plannable_lab(tmp_path)
    text = (lab / "cell.toml").read_text()
    (lab / "cell.toml").write_text(text.replace('formats = ["csv"]', 'formats = ["spel", "csv"]'))
    line = ["plan", str(lab / "planned.toml"), "--cell", str(lab / "cell.toml"), "--out", str(tmp_path / "out")]
    answer = CliRunner().invoke(app, line)
    assert answer.exit_code == 3
    assert 'cell.toml: with spel.motion = "curve" and spel.dispenser = "output"' in answer.output
    assert not (tmp_path / "out").exists()
