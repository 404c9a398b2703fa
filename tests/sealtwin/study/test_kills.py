"""A sweep whose processes are killed: the same command ends it with the bytes of an unbroken one."""

import os
import random
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from sealtwin.core.progress import Progress
from sealtwin.study.study_folder import OUTCOME
from sealtwin.study.sweep import sweep
from tests.support.processes import start_interruptible
from tests.support.tiny_study import HERE, results_of, tiny_lab

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/task").is_dir(), reason="finds a process' children as Linux lists them"
)
GRID = '[grid]\nseed = [1, 2, 3, 4, 5, 6]\n"fluid.U" = [1.0, 10.0, 100.0, 1000.0]\n'


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """The study file of 24 tiny runs."""
    return tiny_lab(tmp_path_factory.mktemp("lab"), GRID)


@pytest.fixture(scope="module")
def results(many, tmp_path_factory):
    """Their results, computed in this process from beginning to end."""
    out = tmp_path_factory.mktemp("unbroken") / "out"
    sweep(many, out, HERE, Progress())
    return results_of(out)


def _start(study, out, jobs=2):
    command = [sys.executable, "-m", "sealtwin", "sweep", study, "--out", out, "--device", "cpu", "--jobs", jobs]
    # A group of its own, as a terminal makes it.
    return start_interruptible([*map(str, command), "--accurate", "--quiet"], start_new_session=True)


def _workers(pid):
    """Processes that compute for a parent, whichever thread of it started them."""
    children = []
    for listed in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):  # The thread has ended.
            children += map(int, listed.read_text().split())
    return [child for child in children if b"spawn_main" in _command(child)]


def _command(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def _finished(out):
    """When the outcome of each finished run was written."""
    return {path.parent.name: path.stat().st_mtime_ns for path in out.glob(f"runs/*/{OUTCOME}")}


def _wait_for_progress(parent, out, more):
    """Until ``more`` runs have finished than now."""
    wanted = len(_finished(out)) + more
    until = time.monotonic() + 120
    while parent.poll() is None and len(_finished(out)) < wanted and time.monotonic() < until:
        time.sleep(0.02)


def _gone(pids):
    until = time.monotonic() + 20
    while any(_command(pid) for pid in pids) and time.monotonic() < until:
        time.sleep(0.05)
    return not any(_command(pid) for pid in pids)


@pytest.mark.slow
def test_a_sweep_killed_ten_times_ends_as_an_unbroken_one(many, results, tmp_path):
    """Kill now a worker and now the parent, or both, most of them while runs are computed."""
    chance, out = random.Random(1), tmp_path / "out"
    seen, parent = [], _start(many, out)
    for number in range(10):
        _wait_for_progress(parent, out, chance.choice([0, 1, 1]))
        time.sleep(chance.uniform(0, 0.3))
        seen.append(_finished(out))
        workers = _workers(parent.pid)
        if number % 2 == 0 and workers:
            with suppress(ProcessLookupError):  # Its parent has just finished.
                os.kill(chance.choice(workers), signal.SIGKILL)
        if number % 2 or not workers:
            parent.kill()
            parent.communicate()
            assert _gone(workers), "workers outlive their parent"
            parent = _start(many, out)
    _, errors = parent.communicate(timeout=300)
    assert parent.returncode == 0, errors
    last = _finished(out)
    assert len(seen[0]) < len(last) == 24
    for before in seen:
        assert {key: last[key] for key in before} == before, "a finished run was computed again"
    assert results_of(out) == results
    assert not list(out.glob("runs/*/.*"))
