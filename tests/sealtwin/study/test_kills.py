"""A sweep whose processes are killed is completed by the same command."""

import random
import subprocess
import sys
import time

import psutil
import pytest

from sealtwin.core.progress import Progress
from sealtwin.study.study_folder import OUTCOME
from sealtwin.study.sweep import sweep
from tests.support.tiny_study import HERE, results_of, tiny_lab

GRID = '[grid]\nseed = [1, 2, 3, 4, 5, 6]\n"fluid.U" = [1.0, 10.0, 100.0, 1000.0]\n'


def _start(study, out):
    command = [sys.executable, "-m", "sealtwin", "sweep", study, "--out", out, "--device", "cpu", "--jobs", 2]
    line = [*map(str, command), "--accurate", "--quiet"]
    return subprocess.Popen(line, stderr=subprocess.PIPE, text=True)


def _finished(out):
    """Return the time at which the outcome of each finished run was written."""
    return {path.parent.name: path.stat().st_mtime_ns for path in out.glob(f"runs/*/{OUTCOME}")}


def _is_worker(process):
    try:
        return "spawn_main" in " ".join(process.cmdline())
    except psutil.Error:  # It has just ended.
        return False


@pytest.mark.slow
def test_a_sweep_killed_ten_times_gives_the_results_of_an_uninterrupted_sweep(tmp_path):
    """Workers and the parent are killed in turn, mostly while runs are computed."""
    study, chance, out = tiny_lab(tmp_path / "lab", GRID), random.Random(1), tmp_path / "out"
    sweep(study, tmp_path / "unbroken", HERE, Progress())
    seen, parent = [], _start(study, out)
    for number in range(10):
        wanted = len(_finished(out)) + chance.choice([0, 1, 1])
        while parent.poll() is None and len(_finished(out)) < wanted:
            time.sleep(0.02)
        time.sleep(chance.uniform(0, 0.3))
        seen.append(_finished(out))
        if parent.poll() is not None:
            break
        workers = [child for child in psutil.Process(parent.pid).children(recursive=True) if _is_worker(child)]
        if number % 2 == 0 and workers:
            chance.choice(workers).kill()
        else:
            parent.kill()
            parent.communicate()
            assert not psutil.wait_procs(workers, 20)[1], "workers outlive their parent"
            parent = _start(study, out)
    _, errors = parent.communicate(timeout=300)
    assert parent.returncode == 0, errors
    last = _finished(out)
    assert len(seen[0]) < len(last) == 24
    for before in seen:
        assert {key: last[key] for key in before} == before, "a finished run was computed again"
    assert results_of(out) == results_of(tmp_path / "unbroken")
    assert not list(out.glob("runs/*/.*"))
