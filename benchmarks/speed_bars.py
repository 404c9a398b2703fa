"""The bars for the speed of a run: its threads, what surrounds its frames, and an earlier state of this program.

    git worktree add ../before dfcd22dd
    python -m benchmarks.speed_bars [../before] [--turns 3] [--only frames --only beside ...]

``frames``: all frames of the shipped trial, digitised once, by 1, 2 and 4 threads, by the clock, alone and beside a
busy core; all end with the same bits. Two runs of one thread at once show what the cores give. ``beside``: processor
time of that trial beside its frames, of a first run, with nothing compiled, and of the next ones. ``draft``: its draft
over its accurate run. The others are ratios to the other tree, which takes the same files: ``trial``, the shipped
trial; ``photo``, the same with 306 particles (0.75 ml, for its time alone); ``mesh``, that with the crack as an
imported mesh; ``study``, 12 of the paper's 132 runs at 0.6 mm on two cores.

Programs take turns; a figure is the median of their ratios. Nothing else may run.
"""

import json
import os
import tempfile
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from hashlib import sha256
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Annotated, NamedTuple

import tomlkit
from typer import Argument, Option

from benchmarks.cold import COMPILE, FRAMES, TRIAL
from benchmarks.machine import LOADS, processor, run_program
from benchmarks.table import Row, one_of, run_benchmark
from sealtwin.core.record_files import read_sample
from sealtwin.trial.trial_file import load_trial
from simulate.injection import ComputeOptions, Injection, prepare
from tests.support.paths import ROOT

CASES = ("frames", "beside", "draft", "trial", "photo", "mesh", "study")
ALONE = "alone"
FRAMES_BARS = {ALONE: (0.68, "<= 0.6"), "beside a busy core": (1.05, "")}
THREADS = {"1 thread": (1,), "2 threads": (2,), "4 threads": (4,), "each of 2 runs at once": (1, 1)}  # Of each run
FRAMES_A_TURN = 25
ERROR_MM, SAME_MM = 1.18, 0.08
"""Mean error of the shipped trial, and by how much other rounding, which grows in a flow, may move it."""
DIGITISED = "digitised"  # Run folder of the shipped trial
TWELVE = '[grid]\n"fluid.U" = [0.01, 30, 1000, 10000]\n"fluid.D_cm" = [1e-4, 0.3, 3]\n'

begun: list[Injection] = []  # The run of a process of ``_by_threads``


class Ratio(NamedTuple):
    title: str
    clock: str  # Field of ``Used``
    bar: float
    command: list[str]
    over: list[str] | None = None  # What the command is compared with. Default: itself in the other tree


def main(
    before: Annotated[Path | None, Argument(help="a work tree of an earlier state")] = None,
    turns: Annotated[int, Option(help="of each ratio")] = 3,
    only: Annotated[list[str] | None, one_of(CASES)] = None,
) -> list[Row]:
    print(f"{processor()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}", flush=True)
    chosen, rows = only or CASES, list[Row]()
    with tempfile.TemporaryDirectory() as place:
        scratch = Path(place)
        run_program(["-m", "sealtwin", "digitise", str(TRIAL), "--quiet", "--out", str(scratch / DIGITISED)])
        rows += _frames(scratch) if "frames" in chosen else ()
        rows += _beside(scratch, turns) if "beside" in chosen else ()
        for name, ratio in _ratios(scratch).items():
            if name in chosen and (tree := ROOT if ratio.over else before):
                figures = [_turn(ratio, tree.resolve(), scratch) for _ in range(turns)]
                rows.append(Row(ratio.title, median(figures), "", 0, ratio.bar))
    return rows


def _frames(scratch: Path) -> Iterator[Row]:
    digests = set[str]()
    for load, (bar, goal) in FRAMES_BARS.items():
        with LOADS[load]():
            wall_s = _by_threads(scratch / DIGITISED, digests)
        one, two, *others = THREADS
        yield Row(f"frames, {one}, {load}", wall_s[one], "s")
        yield Row(f"frames, {two} over 1, {load}", wall_s[two] / wall_s[one], "", 0, bar, goal)
        for runs in others:
            yield Row(f"frames, {runs} over 1, {load}", wall_s[runs] / wall_s[one], "")
    yield Row("different results of 1, 2 and 4 threads, and loads", len(digests), "", 1, 1)


def _by_threads(digitised: Path, digests: set[str]) -> dict[str, float]:
    """Compute all frames by each of ``THREADS``, in turns; return wall times of a run in s, and add all digests."""
    wall_s = dict.fromkeys(THREADS, 0.0)
    with ExitStack() as stack:
        processes = {
            name: [
                stack.enter_context(ProcessPoolExecutor(1, get_context("spawn"), _begin, (digitised, number)))
                for number in threads
            ]
            for name, threads in THREADS.items()
        }
        while processes:
            for name, together in list(processes.items()):
                ends = [turn.result() for turn in [process.submit(_advance) for process in together]]
                wall_s[name] += max(took_s for took_s, _ in ends) / len(ends)
                if ends[0][1]:
                    digests.update(digest for _, digest in ends)
                    del processes[name]
    return wall_s


def _begin(digitised: Path, threads: int) -> None:
    """Prepare the run of this process. Its first frame, which loads the kernels, is not timed."""
    begun.append(prepare(load_trial(TRIAL).pour(read_sample(digitised)), ComputeOptions("cpu", threads)))
    begun[0].advance()


def _advance() -> tuple[float, str]:
    """Compute the frames of a turn; return their wall time in s and, after the last one, the digest of the result."""
    (injection,), began = begun, time.perf_counter()
    for _ in range(FRAMES_A_TURN):
        if injection.done == injection.frames or injection.at_rest:
            took_s, state = time.perf_counter() - began, injection.engine.state
            return took_s, sha256(state.position_mm().tobytes() + state.velocity_mm_s().tobytes()).hexdigest()
        injection.advance()
    return time.perf_counter() - began, ""


def _beside(scratch: Path, turns: int) -> Iterator[Row]:
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


def _ratios(scratch: Path) -> dict[str, Ratio]:
    trial = ["-m", "sealtwin", "run", str(TRIAL), "--device", "cpu", "--quiet"]
    few = ["--set", "solver.radius_mm=0.78", "--set", "path.volume_ml=0.75"]  # 306 particles
    photo, mesh = [*trial, *few], ["-m", "sealtwin", "run", _of_a_mesh(scratch), "--device", "cpu", "--quiet", *few]
    text = TRIAL.with_name("study-paper.toml").read_text().replace('"trial.toml"', json.dumps(str(TRIAL)))
    study = scratch / "study.toml"
    study.write_text(text.split("[grid]")[0] + TWELVE)
    sweep = ["-m", "sealtwin", "sweep", str(study), "--jobs", "2", "--set", "solver.radius_mm=0.6", "--device", "cpu"]
    return {
        "draft": Ratio("a draft over an accurate run, wall", "wall_s", 0.45, [*trial, "--preset", "draft"], trial),
        "trial": Ratio("photo to report, wall", "wall_s", 0.6, trial),
        "photo": Ratio("306 particles, photo to report, processor", "processor_s", 0.6, photo),
        "mesh": Ratio("306 particles, mesh to report, processor", "processor_s", 0.45, mesh),
        "study": Ratio("12 of the paper's runs, 2 cores, wall", "wall_s", 0.75, sweep),
    }


def _of_a_mesh(scratch: Path) -> str:
    """Write the shipped trial with its solid as an imported mesh; return the file's path."""
    trial = tomllib.loads(TRIAL.read_text())
    del trial["photo"], trial["crack"]
    trial["mesh"] = {"file": f"{DIGITISED}/crack.stl", "data": "synthetic", "units": "mm"}
    trial["readings"] |= {"file": str(TRIAL.with_name("caliper.csv")), "fitted": ["fluid.U", "fluid.D_cm"]}
    (scratch / "mesh.toml").write_text(tomlkit.dumps(trial))
    return str(scratch / "mesh.toml")


def _turn(ratio: Ratio, before: Path, scratch: Path) -> float:
    now_s, before_s = (
        getattr(run_program([*command, "--out", tempfile.mkdtemp(dir=scratch)], tree), ratio.clock)
        for command, tree in ((ratio.command, ROOT), (ratio.over or ratio.command, before))
    )
    print(f"  {ratio.title}: {now_s:.1f} s, {before_s:.1f} s: {now_s / before_s:.3f}", flush=True)
    return now_s / before_s


if __name__ == "__main__":
    run_benchmark(main)
