"""Processor time of four benchmarks, over that of another work tree of the project in the same run.

    git worktree add ../before 7065196
    python -m benchmarks.against ../before [--turns 7] [--only pbf_step]

Both trees take turns, each turn in a fresh process that times its own tree's benchmark and prints what it computed. A
figure is the median over the turns of the ratio within a turn. The results of both trees are compared as well.
"""

import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

from benchmarks.table import Row, one_of, run_benchmark

HERE = Path(__file__).parent.parent
SLOWER_AT_MOST = 1.03
ALIKE = 1e-3
"""Largest relative difference of a result between both trees; a report has none that both trees print alike."""
ONE_CORE = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}

STEP = """
from benchmarks.pbf_step import settled_block
engine = settled_block(15_000, 1, steps=60)
began = time.process_time()
for _ in range(40):
    engine.step()
took_s, result = time.process_time() - began, float(engine.state.density.numpy().mean())
"""
DIGITISE = """
import benchmarks.digitise_speed as speed
trial = scratch / "trial.toml"
if not trial.exists():
    specimen = speed.make_specimen(speed.SEED, speed.RECIPE)
    (scratch / "photo.jpg").write_bytes(specimen.jpeg)
    trial.write_text(speed._trial_text(specimen.board, specimen.ends_px), encoding="utf-8")
found = speed._run(trial, scratch / f"run-{time.time_ns()}")
took_s, result = found["cpu_s"], found["mean_width_mm"]
"""
REPORT = """
import benchmarks.report_speed as speed
run = scratch / "run"
if not run.exists():
    source = speed.FIXTURE / "trial.toml"
    with speed.open_folder(run, create=True) as folder:
        job = speed.start_job(speed.load_trial(source), speed.FIXTURE, folder, "cpu", speed.PlainProgress())
        speed.run_stages(job, ("digitise", "simulate", "validate"))
took_s, result = speed._make(run)["cpu_s"], 1.0
"""
RUN = """
import types
import benchmarks.paper_run as paper
# Against a numba substep of 1 ms, the row in substeps is the processor's milliseconds.
paper.time_both = lambda *_: types.SimpleNamespace(numba_ms=1.0)
rows = {row.name: row.value for row in paper._trial(1)}
took_s, result = rows["the trial, in substeps of numba"] / 1e3, rows["volume kept"]
"""
CHILD = """
import json, sys, time
from pathlib import Path
scratch = Path(sys.argv[1])
{body}
print(json.dumps([took_s, result]))
"""
BENCHMARKS = {"pbf_step": STEP, "digitise_speed": DIGITISE, "report_speed": REPORT, "paper_run": RUN}


def main(other: Path, turns: int = 7, only: Annotated[list[str] | None, one_of(BENCHMARKS)] = None) -> list[Row]:
    print(f"{processor()}, load {os.getloadavg()[0]:.1f}; {turns} turns against {other.name}")
    rows = []
    for name in only or BENCHMARKS:
        with tempfile.TemporaryDirectory() as here, tempfile.TemporaryDirectory() as there:
            scratches = {HERE: Path(here), other.resolve(): Path(there)}
            pairs = [
                [turn(BENCHMARKS[name], tree, scratch) for tree, scratch in scratches.items()] for _ in range(turns)
            ]
        ratios = [ours[0] / theirs[0] for ours, theirs in pairs]
        print(
            f"{name}: {' '.join(f'{ratio:.3f}' for ratio in ratios)}; {statistics.median(t[0][0] for t in pairs):.2f} s"
        )
        rows.append(Row(f"{name}: processor time over the other's", statistics.median(ratios), "", 0, SLOWER_AT_MOST))
        apart = max(abs(ours[1] / theirs[1] - 1) for ours, theirs in pairs)
        rows.append(Row(f"{name}: result, relative difference", apart, "", 0, ALIKE))
    return rows


def turn(body: str, tree: Path, scratch: Path, site: Path | None = None) -> tuple[float, float]:
    """Seconds of the processor, and the result that is compared.

    Each Python program of the turn begins with ``sitecustomize.py`` in the folder ``site``.
    """
    child = subprocess.run(
        [sys.executable, "-c", CHILD.format(body=body), str(scratch)],
        cwd=tree,
        env={**os.environ, **ONE_CORE, "PYTHONPATH": os.pathsep.join(map(str, filter(None, [site, tree])))},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    took_s, result = json.loads(child.stdout.splitlines()[-1])
    return took_s, result


def processor() -> str:
    info = Path("/proc/cpuinfo")
    models = (
        [line.split(":")[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")]
        if info.exists()
        else []
    )
    return models[0] if models else platform.processor()


def flags() -> list[str]:
    """What the processor can do, as Linux lists it; none on other systems."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    return next((line.split() for line in lines if line.startswith("flags")), [])


if __name__ == "__main__":
    run_benchmark(main)
