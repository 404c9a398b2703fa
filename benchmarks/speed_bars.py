"""What surrounds the frames of a run, and a draft's time over an accurate run's.

    python -m benchmarks.speed_bars [--turns 3] [--only beside|draft]

``beside``: processor time of the shipped trial beside its frames, of a first run, with nothing compiled, and of the
next ones. ``draft``: its draft over its accurate run, by the clock, in turns; the figure is the median of their ratios.
Nothing else may run.
"""

import json
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from statistics import median
from typing import Annotated

from typer import Option

from benchmarks.cold import COMPILE, FRAMES, TRIAL
from benchmarks.machine import processor, run_program
from benchmarks.table import Row, one_of, run_benchmark

ERROR_MM, SAME_MM = 1.18, 0.08
"""Mean error of the shipped trial, and by how much other rounding, which grows in a flow, may move it."""


def beside(scratch: Path, turns: int) -> Iterator[Row]:
    """The first run has empty caches of kernels and fonts."""
    caches = {"WARP_CACHE_PATH": str(scratch / "kernels"), "MPLCONFIGDIR": str(scratch / "fonts")}
    beside_s = list[float]()
    for turn in range(turns + 1):
        run = scratch / f"beside-{turn}"
        used = run_program(["-m", "benchmarks.cold", str(run)], env=caches)
        spent = json.loads(used.stdout.splitlines()[-1])
        beside_s.append(used.processor_s - spent[FRAMES])
        print(f"  {beside_s[-1]:.1f} s beside: {', '.join(f'{part} {s:.1f}' for part, s in spent.items())}", flush=True)
        if turn == 0:
            yield Row("the first run: compiling", spent[COMPILE], "s")
            errors = json.loads((run / "run.json").read_text())["comparison"]["errors"]
            yield Row("its mean error", errors["mean_error_mm"], "mm", ERROR_MM - SAME_MM, ERROR_MM + SAME_MM)
    yield Row("the first run, nothing compiled, beside its frames", beside_s[0], "s", 0, 10, "<= 6")
    yield Row("a run beside its frames, processor time", median(beside_s[1:]), "s", 0, 8)


def draft(scratch: Path, turns: int) -> Iterator[Row]:
    trial = ["-m", "sealtwin", "run", str(TRIAL), "--device", "cpu", "--quiet"]

    def wall_s(*preset: str) -> float:
        return run_program([*trial, *preset, "--out", tempfile.mkdtemp(dir=scratch)]).wall_s

    ratios = [wall_s("--preset", "draft") / wall_s() for _ in range(turns)]
    yield Row("a draft over an accurate run, wall", median(ratios), "", 0, 0.45)


CASES: Mapping[str, Callable[[Path, int], Iterator[Row]]] = {case.__name__: case for case in (beside, draft)}


def main(
    turns: Annotated[int, Option(help="of each case")] = 3,
    only: Annotated[list[str] | None, one_of(CASES)] = None,
) -> list[Row]:
    print(f"{processor()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}", flush=True)
    with tempfile.TemporaryDirectory() as place:
        return [row for name in only or CASES for row in CASES[name](Path(place), turns)]


if __name__ == "__main__":
    run_benchmark(main)
