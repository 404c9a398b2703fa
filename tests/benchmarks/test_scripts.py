"""Benchmarks start as their first lines say."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent


def test_no_benchmark_hides_a_module_that_another_one_needs():
    """As a script, its folder is the first place that Python looks in: one of ours was once taken for ``coverage``.

    numba looks for the most.
    """
    script = [sys.executable, "benchmarks/pbf_step.py", "--help"]
    answer = subprocess.run(script, cwd=ROOT, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr
    assert "--particles" in answer.stdout
