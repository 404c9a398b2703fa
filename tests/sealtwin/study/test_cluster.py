"""A sweep on a cluster: a scheduler and workers as processes of their own, on this machine."""

import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

from sealtwin.progress import Progress
from sealtwin.study.ledger import profile_path, read_study
from sealtwin.study.sweep import Wish, sweep
from sealtwin.study.workers import Task, compute_all
from tests.studies import tiny_lab

pytestmark = [
    pytest.mark.slow,
    # Looked for and not imported: whoever runs the plain tests must not wait for it.
    pytest.mark.skipif(find_spec("distributed") is None, reason="needs the extra 'cluster'"),
]

HERE = Wish(device="cpu", jobs=1, batch=1)
ANSWER_S = 120
"""A worker imports half a second's worth of libraries, on a busy machine much more."""


class Cluster:
    """A scheduler; workers are started as they are needed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.processes: list[subprocess.Popen[bytes]] = []
        self._start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        content = self._when_it_is_there()
        self.address = content.split('"address": "')[1].split('"')[0]

    def add_worker(self) -> subprocess.Popen[bytes]:
        # Where the folder of the sweep does not lie: workers get all they need by value.
        home = self.folder / f"worker{len(self.processes)}"
        home.mkdir()
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(home))
        return self._start("dask_worker", *options)

    def end(self) -> None:
        for process in reversed(self.processes):
            process.kill()
            process.wait()

    def _start(self, program: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{program}", "--scheduler-file", str(self.folder / "where")]
        log = (self.folder / f"{program}.log").open("ab")
        process = subprocess.Popen([*command, *options], cwd=self.folder, stdout=log, stderr=log)
        log.close()
        self.processes.append(process)
        return process

    def _when_it_is_there(self) -> str:
        file = self.folder / "where"
        until = time.monotonic() + ANSWER_S
        while time.monotonic() < until:
            if file.is_file() and '"address"' in (content := file.read_text()):
                return content
            time.sleep(0.05)
        raise TimeoutError((self.folder / "dask_scheduler.log").read_text())


@pytest.fixture
def cluster(tmp_path):
    (tmp_path / "cluster").mkdir()
    made = Cluster(tmp_path / "cluster")
    yield made
    made.end()


def _start(lab, out, address):
    command = [sys.executable, "-m", "sealtwin", "sweep", str(lab), "--out", str(out), "--device", "cpu", "--quiet"]
    return subprocess.Popen([*command, "--dask", address], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def _wait_for_done(out, parent, count):
    while parent.poll() is None and sum(run.state == "done" for run in read_study(out)) < count:
        time.sleep(0.05)


def test_a_cluster_that_loses_a_worker_and_its_parent_gives_what_this_machine_gives(tmp_path, cluster):
    """Two workers; one is killed, later the parent; the same command ends it, with the same bytes."""
    lab = tiny_lab(tmp_path / "lab", '[grid]\nseed = [1, 2, 3, 4]\n"fluid.U" = [1.0, 10.0, 100.0]\n')
    sweep(lab, tmp_path / "here", replace(HERE, dry_run=True), Progress())
    shutil.copytree(tmp_path / "here", tmp_path / "there")
    compute_all(Task(tmp_path / "here", "cpu", batch=1, keep_runs=False))

    out = tmp_path / "there"
    first, _ = cluster.add_worker(), cluster.add_worker()
    parent = _start(lab, out, cluster.address)
    _wait_for_done(out, parent, 2)
    os.kill(first.pid, signal.SIGKILL)
    _wait_for_done(out, parent, 5)
    parent.kill()
    parent.communicate()
    before = {run.key: run.finished_unix_s for run in read_study(out) if run.state == "done"}
    assert 5 <= len(before) < 12
    _, errors = (again := _start(lab, out, cluster.address)).communicate(timeout=ANSWER_S)
    assert again.returncode == 0, errors

    here, there = read_study(tmp_path / "here"), read_study(out)
    assert [run.state for run in there] == ["done"] * 12
    for one, other in zip(here, there, strict=True):
        assert profile_path(tmp_path / "here", one.key).read_bytes() == profile_path(out, other.key).read_bytes()
    after = {run.key: run.finished_unix_s for run in there}
    assert {key: after[key] for key in before} == before


def test_a_cluster_that_is_not_there_is_told_in_words(tmp_path, cluster):
    lab = tiny_lab(tmp_path / "lab")
    parent = _start(lab, tmp_path / "out", cluster.address)
    _, errors = parent.communicate(timeout=ANSWER_S)
    assert parent.returncode == 3
    assert "the scheduler has no worker" in errors
    parent = _start(lab, tmp_path / "out", "tcp://127.0.0.1:9")
    _, errors = parent.communicate(timeout=ANSWER_S)
    assert parent.returncode == 3
    assert "no scheduler answers there" in errors
