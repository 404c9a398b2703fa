"""What benchmarks of time share: programs, timed, and the processor's name."""

import os
import platform
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

from tests.support.paths import ROOT

ONE_CORE = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
ENDED = (0, 5)  # Exit codes of a finished command: 5 if a trial misses its gate


class Used(NamedTuple):
    wall_s: float
    processor_s: float  # Of the program and of all processes that it waited for
    stdout: str


def run_program(arguments: list[str], env: dict[str, str] | None = None) -> Used:
    """Run Python with the packages of this repository.

    Raises CalledProcessError if the exit code is none of ``ENDED``.
    """
    before_s, began = _processor_s(), time.perf_counter()
    ended = subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        # Compiled modules are kept, as any user's are: else each run compiles the tree again.
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "", **(env or {})},
        capture_output=True,
        text=True,
        check=False,
    )
    used = Used(time.perf_counter() - began, _processor_s() - before_s, ended.stdout)
    if ended.returncode not in ENDED:
        print(ended.stderr, file=sys.stderr)
        ended.check_returncode()
    return used


def _processor_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def processor() -> str:
    return _listed("model name") or platform.processor()


def flags() -> list[str]:
    """What the processor can do, as Linux lists it; none on other systems."""
    return _listed("flags").split()


def _listed(name: str) -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith(name)), "")
