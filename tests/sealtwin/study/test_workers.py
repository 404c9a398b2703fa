"""Studies on workers: those that are killed, and those of a scheduler."""

import os
import signal
from dataclasses import replace
from typing import Any

import pytest

from sealtwin.core.cluster import KILLED, Lost, run_tasks
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.study import runner
from sealtwin.study.study_folder import profile_path, read_plan
from sealtwin.study.sweep import sweep
from sealtwin.trial.job import NUMBERS, own_numbers
from tests.support.ingested_lab import sealtwin
from tests.support.tiny_study import HERE, results_of


def _killed_at_300(bench, trials, options):
    """Kill the worker at two of the four runs, as the operating system does if memory runs out."""
    if trials[0].fluid.U == 300.0 and trials[0].fluid.D_cm == 0.3:
        os.kill(os.getpid(), signal.SIGKILL)
    return runner.seal(runner._unpickled(bench), trials, options)


def _lost_at_300(function, tasks, *_):
    """Tell of that run what is told of one whose workers were killed, and compute the others here."""
    for group, arguments in tasks:
        (trial,) = arguments[1]
        deadly = trial.fluid.U == 300.0 and trial.fluid.D_cm == 0.3
        yield group, Lost(KILLED) if deadly else function(*arguments)


@pytest.mark.parametrize(
    ("name", "stand_in"),
    # That workers which are killed are told so is tests/sealtwin/core/test_cluster.py; four new ones take 15 s.
    [("run_tasks", _lost_at_300), pytest.param("seal_in_worker", _killed_at_300, marks=pytest.mark.slow)],
)
def test_a_run_that_kills_three_workers_is_given_up_with_its_reason(
    lab, unbroken, tmp_path, monkeypatch, name, stand_in
):
    out = tmp_path / "out"
    monkeypatch.setattr(runner, name, stand_in)
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
    """The address of a scheduler with a worker, which knows nothing of the sweep's folder."""
    from distributed import LocalCluster

    cluster: Any = LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0", host="tcp://127.0.0.1")
    with cluster:
        yield cluster.scheduler_address


def test_a_cluster_gives_what_this_machine_gives(lab, unbroken, tmp_path, scheduler):
    answer = sealtwin(
        "sweep", lab, "--out", tmp_path / "out", "--device", "cpu", "--accurate", "--scheduler", scheduler, "--quiet"
    )
    assert answer.exit_code == 0, answer.output
    assert results_of(tmp_path / "out") == results_of(unbroken)


def test_a_worker_of_other_stage_numbers_is_refused(scheduler, monkeypatch):
    """Its version is the same, and its solver another: it would compute other levels into the same study."""
    own = NUMBERS["simulate"]
    monkeypatch.setitem(NUMBERS, "simulate", 999)
    with pytest.raises(InputError, match=rf"has stage numbers .*'simulate': {own}.*, but this machine has .*: 999"):
        next(run_tasks(pow, [(0, (1, 1))], 0, scheduler, own_numbers))
