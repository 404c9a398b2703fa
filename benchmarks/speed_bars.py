"""The bars for the speed of the fluid run: against other programs, and against an earlier state of this one.

    git worktree add ../before 7065196
    python -m benchmarks.speed_bars ../before [--turns 3] [--only substep --only cold ...] [--without-avx512]

``cold`` is what ``benchmarks.cold`` finds. ``--only around --only accurate --only draft`` needs a tree of e3aefa51: all
of the trial but its frames, the whole trial from photo to report, and a draft of it. Both trees run the trial and the
study that the older one ships. Kernels are compiled in the first turn. All is processor time, but a step on two threads
is by the clock.
Contestants take turns in one process, work trees in processes of their own, and a figure is a ratio within this run.
The contestants are ours: ``pbf_numba.py``, and ``pbf_cpp/step.cpp`` if there is a g++, which takes as long as a
program by others (``pbf_step.py --peer``). It is judged only if the processor has AVX-512, which it then uses. Both
take the explicit substep of ``pbf_step.py``, which has that of a paste too.
"""

import gc
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Annotated

import numba
import numpy as np
import warp as wp
from typer import Option

from benchmarks import cold
from benchmarks.against import HERE, flags, processor, turn
from benchmarks.pbf_cpp import CppStep, has_compiler
from benchmarks.pbf_numba import NumbaStep
from benchmarks.pbf_step import ALIKE_MM, OVER_CPP
from benchmarks.pbf_tank import PARTICLES, RADIUS_MM, block_mm, in_cpp, settled_block, take_turns, tank
from benchmarks.table import Row, one_of, run_benchmark
from tests.fluids import engine_with

MANY = 50_000
SETTLED = 60

SHIPPED = """
import re, resource, subprocess
fixture = before / "fixtures/paper-trial"
text = re.sub('file = "(.+)"', lambda match: f'file = "{fixture / match[1]}"', (fixture / "trial.toml").read_text())
"""
DRAFTED = """
if Path("sealtwin/trial/draft.py").exists():
    text = text.replace('preset = "accurate"', 'preset = "draft"').replace("radius_mm = 0.4\\n", "")
    assert 'preset = "draft"' in text and "radius_mm" not in text
"""
"""The older tree has no drafts: there the trial is accurate."""
RUN = """
trial = scratch / "trial.toml"
trial.write_text(text)
command = [sys.executable, "-m", "sealtwin", "run", str(trial), "--device", "cpu", "--quiet"]
command += ["--out", str(scratch / f"run-{time.time_ns()}")]
ended = subprocess.run(command, check=False, stdout=subprocess.DEVNULL).returncode
assert ended in (0, 5), f"exit code {ended}: neither a kept gate nor a missed one"
used = resource.getrusage(resource.RUSAGE_CHILDREN)
took_s, result = used.ru_utime + used.ru_stime, 1.0
"""
TWELVE = """
import resource, subprocess
fixture = before / "fixtures/paper-trial"
text = (fixture / "study-paper.toml").read_text().split("[grid]")[0]
text = text.replace('"trial.toml"', repr(str(fixture / "trial.toml")))
study = scratch / f"twelve-{time.time_ns()}.toml"
study.write_text(text + '[grid]\\n"fluid.U" = [0.01, 30, 1000, 10000]\\n"fluid.D_cm" = [1e-4, 0.3, 3]\\n')
command = [sys.executable, "-m", "sealtwin", "sweep", str(study), "--jobs", "1", "--device", "cpu"]
subprocess.run([*command, "--out", str(study.with_suffix(""))], check=True, stdout=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
took_s, result = used.ru_utime + used.ru_stime, 1.0
"""
NARROW = """
import benchmarks.paper_run as paper
began = time.process_time()
rows = {row.name: row.value for row in paper._narrow(2)}
took_s, result = time.process_time() - began, rows["volume kept"]
"""
AROUND = """
from benchmarks import cold
from sealtwin.cli.app import main
spent, out = cold._clocked_parts(), str(scratch / f"around-{time.time_ns()}")
trial = before / "fixtures/paper-trial/trial.toml"
sys.argv = ["sealtwin", "run", str(trial), "--device", "cpu", "--quiet", "--out", out]
try:
    main()
except SystemExit as end:
    if end.code:
        raise
took_s, result = cold._processor_s() - spent[cold.FRAMES] - spent[cold.COMPILE], 1.0
"""
OLDER = "-target-cpu haswell"  # Flags of a compiler for a processor without AVX-512
SITE = f"""
import types, warp
class Fixed(types.ModuleType):
    def __setattr__(self, name, value):
        if name != "cpu_compiler_flags":
            super().__setattr__(name, value)
warp.config.cpu_compiler_flags = "{OLDER}"
warp.config.__class__ = Fixed
"""
"""What each program of a turn begins with, workers of a study too: the package's own flags do not replace these."""
PLAIN = f"""
import simulate.device, warp
assert warp.config.cpu_compiler_flags == "{OLDER}"
"""
AGAINST = {
    "trial": ("the trial, all stages", SHIPPED + RUN, 0.5, "<= 0.33"),
    "twelve": ("12 of the 132 runs at 0.6 mm", TWELVE, 0.5, "<= 0.33"),
    "around": ("what surrounds the frames", AROUND, 0.6, ""),
    "accurate": ("the trial, photo to report", SHIPPED + RUN, 0.85, ""),
    "draft": ("a draft of the trial, photo to report", SHIPPED + DRAFTED + RUN, 0.4, ""),
    "narrow": ("1 mm crack, two threads", NARROW, 0.5, "<= 0.25"),
}
AGAINST_E3AEFA51 = ("around", "accurate", "draft")


def main(
    before: Path,
    turns: Annotated[int, Option(help="of the rows against that tree")] = 3,
    only: Annotated[list[str] | None, one_of(("substep", "memory", "cold", *AGAINST))] = None,
    without_avx512: Annotated[
        bool, Option(help="compile for an older processor, in this tree and in the other")
    ] = False,
) -> list[Row]:
    wide = "avx512f" in flags() and not without_avx512
    if without_avx512:
        wp.config.cpu_compiler_flags = OLDER
    print(f"{processor()}, {'with' if wide else 'without'} AVX-512, load {os.getloadavg()[0]:.1f}")
    chosen = only or ("substep", "memory", "cold", *(name for name in AGAINST if name not in AGAINST_E3AEFA51))
    rows: list[Row] = []
    if "substep" in chosen:
        rows += [row for particles in (PARTICLES, MANY) for row in _substep(particles, judged=wide)]
        if has_compiler():
            rows += [_on_two_threads(particles, judged=wide) for particles in (PARTICLES, MANY)]
    if "memory" in chosen:
        rows.append(Row("memory a particle", _bytes_a_particle() / 1e3, "kB", 0, 1.0, "<= 0.7"))
    if "cold" in chosen:
        rows += _cold()
    for name in AGAINST:
        if name in chosen:
            title, body, bar, goal = AGAINST[name]
            ratio = _ratio(body, before.resolve(), turns, older=without_avx512)
            # Without AVX-512 the fluid's kernels gain less, and must not lose. The other bars hold on all processors.
            judged = bar if wide or name in AGAINST_E3AEFA51 else 1.0
            rows.append(Row(f"{title}, over {before.name}", ratio, "", 0, judged, goal))
    return rows


def _substep(particles: int, *, judged: bool) -> list[Row]:
    """A substep over those of the contestants, from one settled state."""
    engine = settled_block(particles, 1, steps=SETTLED)
    numba.set_num_threads(1)
    contestants: dict[str, NumbaStep | CppStep] = {"numba": NumbaStep.copy_of(engine)}
    rows = []
    if has_compiler():
        compiled = in_cpp(engine)
        contestants["C++"] = compiled
        engine.step()
        for contestant in contestants.values():
            contestant.step()
        apart_mm = np.abs(compiled.place_mm - engine.state.position_mm()).max(axis=1)
        rows.append(Row(f"{particles}: C++ a step on, apart, median", float(np.median(apart_mm)), "mm", 0, ALIKE_MM))
    ours, *theirs = take_turns([engine.step, *(it.step for it in contestants.values())], time.process_time)
    bars = {"numba": (0.6, "<= 0.4"), "C++": (OVER_CPP if judged else np.inf, "<= 1.3")}
    print(
        f"{particles} particles: {ours:.2f} ms; {', '.join(f'{ms:.2f}' for ms in theirs)} of {', '.join(contestants)}"
    )
    for name, ms in zip(contestants, theirs, strict=True):
        bar, goal = bars[name]
        rows.append(Row(f"{particles}: a substep over {name}", ours / ms, "", 0, bar, goal))
    return rows


def _on_two_threads(particles: int, *, judged: bool) -> Row:
    """A substep over that in C++ by the clock, each on two threads of a machine that does nothing else."""
    engine = settled_block(particles, 2, steps=SETTLED)
    compiled = in_cpp(engine, threads=2)
    (ours,) = take_turns([engine.step], time.perf_counter)
    # OpenMP's threads look for work after a step, and take a core from ours: they come last.
    (theirs,) = take_turns([compiled.step], time.perf_counter)
    print(f"{particles} particles, two threads: {ours:.2f} ms; {theirs:.2f} of C++")
    return Row(f"{particles}: over C++, two threads", ours / theirs, "", 0, OVER_CPP if judged else np.inf, "<= 1.3")


def _bytes_a_particle() -> float:
    """Of arrays on the device that one more particle needs, where all of them move."""
    sizes = {}
    crack, points = tank(PARTICLES), block_mm(PARTICLES)
    for count in (PARTICLES // 2, PARTICLES):
        # The first engine of a crack builds its walls, which the next ones share.
        engine_with(points[:10], crack, radius_mm=RADIUS_MM)
        before = _held()
        engine = engine_with(
            points[:count], crack, radius_mm=RADIUS_MM, reach_mm=(points.min(0) - 5, points.max(0) + 5)
        )
        sizes[count] = _held() - before
        del engine
    fewer, more = sizes.values()
    return (more - fewer) / (PARTICLES - PARTICLES // 2)


def _held() -> int:
    gc.collect()
    return sum(it.capacity for it in gc.get_objects() if isinstance(it, wp.array) and it.deleter is not None)


def _cold() -> list[Row]:
    """Of a process of its own, with as many threads as a user's has."""
    ran = subprocess.run([sys.executable, "-m", "benchmarks.cold"], cwd=HERE, stdout=subprocess.PIPE, text=True)
    print(ran.stdout)
    return cold.judged(**json.loads(ran.stdout.splitlines()[-1]))


def _ratio(body: str, before: Path, turns: int, *, older: bool) -> float:
    """The median over the turns of our processor time over the other tree's; of both for an ``older`` processor."""
    ratios, body = [], f"before = Path({str(before)!r})\n{body}"
    with tempfile.TemporaryDirectory() as place:
        here, there, site = (Path(place) / name for name in ("here", "there", "site"))
        for folder in (here, there, site):
            folder.mkdir()
        if older:
            (site / "sitecustomize.py").write_text(SITE, encoding="utf-8")
            body = PLAIN + body
        for _ in range(turns):
            ours, theirs = turn(body, HERE, here, site)[0], turn(body, before, there, site)[0]
            print(f"  {ours:.1f} s, {theirs:.1f} s: {ours / theirs:.3f}", flush=True)
            ratios.append(ours / theirs)
    return statistics.median(ratios)


if __name__ == "__main__":
    run_benchmark(main)
