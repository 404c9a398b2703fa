"""How long the fluid run of the paper's trial takes, a narrower crack, and what a particle costs at any number of them.

    python benchmarks/paper_run.py [--threads T]            the trial, against substeps of the numba baseline
    python benchmarks/paper_run.py --scaling                a substep of 1,000 to 200,000 particles, the paper's Fig. 11
    python benchmarks/paper_run.py --narrow                 a crack of 1 mm, which the paper puts at 54 minutes

The trial is the shipped one, until its nozzle stops: 14,527 particles, 4 substeps of 4 iterations. Time is that of the
run and its set-up, digitising apart; correctness is asserted beside it.
"""

import math
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.pbf_step import time_both
from benchmarks.pbf_tank import settled_block
from benchmarks.table import Row, run_benchmark
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core import record_files
from sealtwin.core.progress import Progress, progress_for_stderr
from sealtwin.core.records import Run, Sample
from sealtwin.core.run_folder import open_folder
from sealtwin.trial.job import start_job
from sealtwin.trial.pipeline import run_stages
from sealtwin.trial.trial_file import load_trial
from simulate.profile import volume_ratio
from simulate.run import fill
from simulate.settings import Fluid, Nozzle, Solver
from tests.places import FIXTURE
from tests.shapes import straight_slot

BASELINE_STEPS = 1500
"""Substeps of the numba port that the whole trial may take."""
PARTICLES = 14_527
LIKE_THE_PAPER = Fluid(U=30.0, D_cm=0.3, freeze_after_s=2.58)
COUNTS = (1_000, 3_000, 10_000, 30_000, 100_000, 200_000)
NARROW_MM = 1.0


def main(threads: int = 1, scaling: bool = False, narrow: bool = False) -> list[Row]:
    if scaling:
        return _scaling(threads)
    return _narrow(threads) if narrow else _trial(threads)


def _trial(threads: int) -> list[Row]:
    trial = load_trial(FIXTURE / "trial.toml", {"solver.settle_s": 0.0})
    with tempfile.TemporaryDirectory() as scratch:
        with open_folder(Path(scratch) / "run", create=True) as folder:
            run_stages(start_job(trial, FIXTURE, folder, "cpu", Progress()), ("digitise",))
        outline, solid = record_files.read_outline(folder.path), record_files.read_solid(folder.path)
        trajectory = record_files.read_trajectory(folder.path)
    baseline_ms = time_both(PARTICLES, threads).numba_ms
    clock = time.process_time if threads == 1 else time.perf_counter
    began, wall = clock(), time.perf_counter()
    run, _ = fill(
        Sample(outline, solid, trajectory),
        *trial.physics,
        seed=trial.seed,
        progress=progress_for_stderr(quiet=False),
        threads=threads,
    )
    took_s, wall_s = clock() - began, time.perf_counter() - wall
    in_substeps = took_s / (1e-3 * baseline_ms)
    return [
        Row("the trial, clock", wall_s, "s", goal="30 s quiet"),
        Row("the trial, in substeps of numba", in_substeps, "", 0, BASELINE_STEPS, f"<= {BASELINE_STEPS // 2}"),
        Row("numba, a substep of as many particles", baseline_ms, "ms"),
        *_sound(run),
        Row("particles", len(run.position_mm), "", PARTICLES, PARTICLES),
        Row("volume kept", volume_ratio(run, solid), "", 0.95, 1.05),
    ]


def _sound(run: Run) -> list[Row]:
    return [
        Row("particles through a wall", run.escaped_particles, "", 0, 0),
        Row("density error, 95th percentile", 100 * run.health.recorded()["density_error_p95"], "%", 0, 10),
    ]


def _scaling(threads: int) -> list[Row]:
    """Least of several turns at each number; the exponent by least squares over logarithms."""
    took_ms = []
    for count in COUNTS:
        engine = settled_block(count, threads, steps=40)
        best = math.inf
        for _ in range(6):
            began = time.process_time() if threads == 1 else time.perf_counter()
            engine.step()
            best = min(best, (time.process_time() if threads == 1 else time.perf_counter()) - began)
        took_ms.append(1e3 * best)
        print(f"{count:>8} particles  {took_ms[-1]:8.2f} ms a substep  {1e3 * took_ms[-1] / count:.3f} us a particle")
    exponent = float(np.polyfit(np.log(COUNTS), np.log(took_ms), 1)[0])
    return [
        Row("a substep of 200,000 particles", took_ms[-1], "ms"),
        # The paper's Fig. 11 is almost linear; caches make it somewhat more.
        Row("exponent of time over particles", exponent, "", 0.8, 1.2, "1"),
    ]


def _narrow(threads: int) -> list[Row]:
    """The paper's crack and nozzle speed at 1 mm: four particles across, less sealant and a thinner nozzle to match.

    It is 64 particles deep, where local pressure leaves a twentieth of what moves compressed by more than 16 %.
    """
    outline = straight_slot(80.0, NARROW_MM)
    solid = build_solid(outline, CrackShape(depth_mm=16.0, tilt="vertical", wall_angle_deg=0.0))
    path = NozzlePath(volume_ml=4.8 * NARROW_MM / 3.1, speed_mm_s=4.0, trim_mm=10.0)
    trajectory = plan_trajectory(outline, path, solid.cavity_volume_mm3, solid.sections)
    began = time.perf_counter()
    run, _ = fill(
        Sample(outline, solid, trajectory),
        LIKE_THE_PAPER,
        Solver(radius_mm=NARROW_MM / 8, pressure="two-level"),
        Nozzle(diameter_mm=NARROW_MM),
        seed=0,
        progress=progress_for_stderr(quiet=False),
        threads=threads,
    )
    minutes = (time.perf_counter() - began) / 60
    return [
        Row(f"a crack of {NARROW_MM:g} mm, clock", minutes, "min", 0, 10, "<= 5"),
        Row("particles", len(run.position_mm), "", 1e5, 2e5),
        Row("moving at one time, most", run.health.recorded()["moving_most"], ""),
        *_sound(run),
        Row("volume kept", volume_ratio(run, solid), "", 0.95, 1.05),
    ]


if __name__ == "__main__":
    run_benchmark(main)
