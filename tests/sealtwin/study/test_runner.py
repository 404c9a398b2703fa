"""Runs of a study: their progress, their workers, and those by the fast model."""

import csv
import time
from dataclasses import replace
from typing import Any

import pytest

from sealtwin.cli.studies import swept_lines
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.workers import KILLED, Lost, run_tasks
from sealtwin.study import runner
from sealtwin.study.runner import StudyOptions
from sealtwin.study.study_folder import StudyRun, profile_path, read_plan
from sealtwin.study.study_map import chart_of
from sealtwin.study.sweep import sweep
from sealtwin.trial.job import NUMBERS, own_numbers
from tests.support.ingested_lab import sealtwin
from tests.support.tiny_study import HERE, results_of, tiny_lab
from validate.figures.map_page import map_page


def _lost_at_300(function, tasks, *_):
    """Report one run as lost with its workers, and compute the other runs in this process."""
    for group, arguments in tasks:
        (trial,) = arguments[1]
        deadly = trial.fluid.U == 300.0 and trial.fluid.D_cm == 0.3
        yield group, Lost(KILLED) if deadly else function(*arguments)


# tests/sealtwin/core/test_workers.py has the tests of workers that are killed.
def test_a_run_that_kills_three_workers_is_recorded_as_failed(lab, unbroken, tmp_path, monkeypatch):
    out = tmp_path / "out"
    monkeypatch.setattr(runner, "run_tasks", _lost_at_300)
    report = sweep(lab, out, replace(HERE, jobs=1), Progress())
    assert report["exit_code"] == 6
    runs = read_plan(out).runs
    assert [run.state for run in runs] == ["done", "done", "done", "failed"]
    assert "3 worker processes were killed" in (runs[3].reason or "")
    assert runs[3].figures is None
    assert not profile_path(out, runs[3]).exists()
    monkeypatch.undo()
    assert sweep(lab, out, HERE, Progress())["exit_code"] == 6  # kept as failed, until it is asked for
    assert sweep(lab, out, replace(HERE, retry=True), Progress())["exit_code"] == 0
    assert results_of(out) == results_of(unbroken)


@pytest.fixture(scope="module")
def scheduler():
    """The address of a scheduler with one worker."""
    from distributed import LocalCluster

    cluster: Any = LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0", host="tcp://127.0.0.1")
    with cluster:
        yield cluster.scheduler_address


def test_a_cluster_gives_the_same_results_as_the_local_machine(lab, unbroken, tmp_path, scheduler):
    answer = sealtwin(
        "sweep", lab, "--out", tmp_path / "out", "--device", "cpu", "--accurate", "--scheduler", scheduler, "--quiet"
    )
    assert answer.exit_code == 0, answer.output
    assert results_of(tmp_path / "out") == results_of(unbroken)


def test_a_worker_with_other_stage_numbers_is_refused(scheduler, monkeypatch):
    """A worker with the same version and another solver would compute other levels for the same study."""
    own = NUMBERS["simulate"]
    monkeypatch.setitem(NUMBERS, "simulate", 999)
    with pytest.raises(InputError, match=rf"has stage numbers .*'simulate': {own}.*, but this machine has .*: 999"):
        next(run_tasks(pow, [(0, (1, 1))], 0, scheduler, own_numbers))


FAST = """
[fixed]
"solver.model" = "slot"
"solver.settle_s" = 1.0
"fluid.freeze_after_s" = "never"

[grid]
"fluid.viscosity_pa_s" = [0.05, 0.5]
"fluid.yield_stress_pa" = [0.5, 1.0, 40.0]
"""


def test_a_study_by_the_fast_model_is_marked_as_screening_in_all_outputs(tmp_path):
    study, out = tiny_lab(tmp_path, FAST), tmp_path / "out"
    swept = sweep(study, out, StudyOptions("cpu", 0), Progress())
    assert swept["states"] == {"waiting": 0, "done": 6, "failed": 0}
    with (out / "runs.csv").open(newline="", encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    assert [row["model"] for row in rows] == ["slot"] * 6
    assert {row["particles"] for row in rows} == {""}
    # The stiff pastes stack under the nozzle.
    assert ["slope" in row["unfit"] for row in rows] == [False, False, True] * 2
    assert swept["screening"].startswith("The fast model computed 6 of 6 runs")
    assert "It is not valid for 2 of these runs" in swept["screening"]
    assert swept["screening"] in swept_lines(swept)
    plan = read_plan(out)
    assert [run.ranked for run in plan.runs] == [True, True, False] * 2
    chart = chart_of(out, [run for run in plan.runs if run.ranked], plan)
    assert {run.number: run.reason.key for run in chart.excluded} == {3: "unfit", 6: "unfit"}
    assert "do not scatter" in chart.flatness
    assert map_page(chart, []).cautions[0] == swept["screening"]


def test_the_time_left_is_shown_during_a_run(monkeypatch):
    """A first run of eleven minutes once showed only the word "Running"."""
    monkeypatch.setattr(runner, "SHOWN_EVERY_S", 0.02)
    times_s, steps = list[float](), list[int]()

    class Steps(Progress):
        def expect(self, left_s):
            times_s.append(left_s)

        def advance(self, done, note=""):
            steps.append(done)

    runs = [StudyRun(number, f"{number}", {}, {}, "", f"{number}", 10.0) for number in (1, 2)]
    work: Any = (time.sleep, lambda _: (0.3,), lambda run, _: replace(run, state="done", wall_s=0.3))
    monkeypatch.setattr(
        runner, "run_tasks", lambda function, tasks, *_: ((run, [function(*more)]) for run, more in tasks)
    )
    runner.launch(runs, runner.StudyOptions("cpu", 0), "Running", Steps(), work)
    first = times_s[: steps.count(0)]
    assert len(first) > 3
    # Both runs were estimated to take 10 s each; the first one took 0.3 s.
    assert 19.0 < first[-1] < first[0] < 20.0
    assert 0.0 < times_s[len(first)] < 0.31
    assert (steps[-1], times_s[-1]) == (2000, 0.0)
