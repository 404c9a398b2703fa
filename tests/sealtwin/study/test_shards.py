"""Studies in parts and on other machines: shards and their merge, and schedulers."""

import csv
import os
import shutil
import signal
from dataclasses import replace
from typing import Any

import pytest

from sealtwin.cli.studies import swept_lines
from sealtwin.core.cluster import KILLED, Lost, run_tasks
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.study import runner
from sealtwin.study.study_folder import PLAN, profile_path, read_plan
from sealtwin.study.sweep import merge, sweep
from sealtwin.trial.stage_numbers import NUMBERS, own_numbers
from tests.labs import sealtwin
from tests.studies import HERE, results_of, tiny_lab


@pytest.fixture(scope="module")
def shards(lab, tmp_path_factory):
    folders = [tmp_path_factory.mktemp("shards") / str(number) for number in (1, 2, 3)]
    for number, folder in enumerate(folders, start=1):
        sweep(lab, folder, replace(HERE, shard=(number, 3)), Progress())
    return folders


def _rows(out):
    return list(csv.DictReader((out / "runs.csv").read_text().splitlines()))


def test_shards_hold_each_run_once_and_a_merge_is_continued_by_a_sweep_or_another_merge(
    lab, shards, unbroken, tmp_path
):
    assert [[run.number for run in read_plan(shard).runs] for shard in shards] == [[1, 4], [2], [3]]
    out = tmp_path / "out"
    assert "2 of the study's 4 runs" in "\n".join(swept_lines(merge(shards[:1], out)))
    assert merge(shards[1:], out)["states"]["done"] == 4
    assert results_of(out) == results_of(unbroken)
    assert [{**row, "wall_s": ""} for row in _rows(out)] == [{**row, "wall_s": ""} for row in _rows(unbroken)]
    # A sweep of the whole study finds nothing left to do.
    again = sweep(lab, out, replace(HERE, dry_run=True), Progress())
    assert again["states"] == {"waiting": 0, "done": 4, "failed": 0}
    merge(shards[:2], tmp_path / "other")
    sweep(lab, tmp_path / "other", HERE, Progress())
    assert results_of(tmp_path / "other") == results_of(unbroken)


def test_what_is_no_shard_of_the_same_study_is_not_merged(shards, tmp_path):
    other = tiny_lab(tmp_path / "lab", '[grid]\n"fluid.U" = [1.0, 2.0, 3.0, 4.0]\n')
    sweep(other, tmp_path / "other", replace(HERE, shard=(2, 4), dry_run=True), Progress())
    with pytest.raises(InputError, match="inputs of run 2 differ"):
        merge([shards[1], tmp_path / "other"], tmp_path / "out")
    with pytest.raises(InputError, match=r"--out .*1: "):
        merge(shards, shards[0])
    with pytest.raises(InputError, match="not a study"):
        merge([*shards, tmp_path / "lab"], tmp_path / "out")
    changed = tmp_path / "changed"
    shutil.copytree(shards[0], changed)
    (sample,) = (changed / "samples").iterdir()
    (sample / "trajectory.csv").write_text("another")
    with pytest.raises(InputError, match=r"trajectory\.csv"):
        merge([changed, *shards[1:]], tmp_path / "out")
    assert not (tmp_path / "out" / PLAN).exists()


def test_a_shard_that_cannot_be_is_refused(lab, tmp_path):
    for shard in ("0/2", "3/2", "1", "a/b", "1/2/3"):
        assert sealtwin("sweep", lab, "--shard", shard).exit_code == 2, shard
    with pytest.raises(InputError, match="--shard 5/5: the study has 4 runs"):
        sweep(lab, tmp_path / "out", replace(HERE, shard=(5, 5)), Progress())
    assert not (tmp_path / "out").exists()


def _killed_at_300(bench, trials, device, keep_runs, keep_fills):
    """Kill the worker at two of the four runs, as the operating system does if memory runs out."""
    if trials[0].fluid.U == 300.0 and trials[0].fluid.D_cm == 0.3:
        os.kill(os.getpid(), signal.SIGKILL)
    return runner.seal(runner._unpickled(bench), trials, device=device, keep_runs=keep_runs, keep_fills=keep_fills)


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
    assert not profile_path(out, runs[3].key).exists()
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


def test_a_scheduler_that_is_not_there_is_bad_input(lab, tmp_path, monkeypatch):
    monkeypatch.setattr("sealtwin.core.cluster.CONNECT_S", 0.1)
    answer = sealtwin("sweep", lab, "--out", tmp_path / "out", "--device", "cpu", "--scheduler", "tcp://127.0.0.1:9")
    assert answer.exit_code == 3
    assert "--scheduler tcp://127.0.0.1:9: " in answer.stderr
