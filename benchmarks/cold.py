"""A newcomer's first run of the shipped trial, beside its frames: how much of the processor's time each part takes.

    python -m benchmarks.cold

One fresh process, in which no kernel is compiled and no font listed before. The time is that of all its threads and of
its children; what is between two parts counts as import.
"""

import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.table import Row, finish, run_benchmark

FRAMES, IMPORT, COMPILE = "frames", "import", "compile"
MOST_S = 10.0
ERROR_MM, SAME_MM = 1.14, 0.05
"""Mean error of the shipped trial, and by how much other rounding, which grows in a flow, may move it."""


def main() -> None:
    before_s = _processor_s()
    with tempfile.TemporaryDirectory() as place:
        spent, error_mm = _run_cold(Path(place))
    spent[IMPORT] = _processor_s() - before_s - sum(spent.values())
    beside_s = sum(spent.values()) - spent[FRAMES]
    print(f"load {os.getloadavg()[0]:.1f}; the frames, {spent.pop(FRAMES):.1f} s, are not counted")
    rows = [Row(f"cold: {part}", seconds, "s") for part, seconds in spent.items()]
    finish(rows + judged(beside_s, error_mm), json.dumps({"beside_s": beside_s, "error_mm": error_mm}))


def judged(beside_s: float, error_mm: float) -> list[Row]:
    return [
        Row("the shipped trial, cold, beside its frames", beside_s, "s", 0, MOST_S, "<= 6"),
        Row("its mean error", error_mm, "mm", ERROR_MM - SAME_MM, ERROR_MM + SAME_MM),
    ]


def _run_cold(place: Path) -> tuple[dict[str, float], float]:
    """Processor time by parts in seconds, but for imports, and the run's mean error in mm."""
    kernels, run = place / "kernels", place / "run"
    os.environ |= {"WARP_CACHE_PATH": str(kernels), "MPLCONFIGDIR": str(place / "fonts")}
    from sealtwin.cli.app import main as sealtwin

    spent = _clocked_parts()
    sys.argv = ["sealtwin", "run", "fixtures/paper-trial/trial.toml", "--device", "cpu", "--quiet", "--out", str(run)]
    try:
        sealtwin()
    except SystemExit as end:
        if end.code:
            raise
    if not list(kernels.rglob("*.o")):
        raise RuntimeError(f"{kernels}: no kernel was compiled, so that the run was not cold")
    return spent, float(json.loads((run / "run.json").read_text())["comparison"]["errors"]["mean_error_mm"])


def _clocked_parts() -> dict[str, float]:
    """Clock the parts of runs in this process: seconds by part, each without the parts inside it, which grow later."""
    import warp as wp

    import simulate.run
    from sealtwin.trial import digitise_stage, simulate_stage, validate_stage
    from simulate.injection import Injection

    spent: dict[str, float] = {}
    inside_s: list[float] = []

    def clock(owner: Any, name: str, part: str) -> None:
        work = getattr(owner, name)
        spent.setdefault(part, 0.0)

        def by_the_clock(*given: Any, **options: Any) -> Any:
            began_s = time.process_time()
            inside_s.append(0.0)
            try:
                return work(*given, **options)
            finally:
                took_s = time.process_time() - began_s
                spent[part] += took_s - inside_s.pop()
                if inside_s:
                    inside_s[-1] += took_s

        setattr(owner, name, by_the_clock)

    clock(digitise_stage, "bring_up_to_date", "digitise")
    clock(simulate.run, "prepare", "walls and particles")
    # A module compiles as its first kernel is launched, wherever that is.
    clock(wp.Module, "load", COMPILE)
    clock(Injection, "advance", FRAMES)
    clock(simulate_stage, "bring_up_to_date", "profile and pictures of the run")
    clock(validate_stage, "bring_up_to_date", "comparison and report")
    return spent


def _processor_s() -> float:
    used = [resource.getrusage(of) for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


if __name__ == "__main__":
    run_benchmark(main)
