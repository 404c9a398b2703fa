"""What a particle costs at any number of them, and how long a narrower crack takes: both are the paper's.

    python benchmarks/paper_run.py [--threads T]            a substep of 1,000 to 200,000 particles, the paper's Fig. 11
    python benchmarks/paper_run.py --narrow                 a crack of 1 mm, which the paper puts at 54 minutes

Time is the processor's on one thread, else the clock's; correctness is asserted beside it.
"""

import math
import time

import numpy as np

from benchmarks.pbf_tank import settled_block
from benchmarks.table import Row, run_benchmark
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.progress import progress_for_stderr
from sealtwin.core.records import Sample
from simulate.injection import ComputeOptions
from simulate.pour import Pour
from simulate.profile import volume_ratio
from simulate.run import fill
from simulate.settings import Fluid, Nozzle, Solver
from tests.shapes import straight_slot

LIKE_THE_PAPER = Fluid(U=30.0, D_cm=0.3, freeze_after_s=2.58)
COUNTS = (1_000, 3_000, 10_000, 30_000, 100_000, 200_000)
NARROW_MM = 1.0


def main(threads: int = 1, narrow: bool = False) -> list[Row]:
    return _narrow(threads) if narrow else _scaling(threads)


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

    It is 64 particles deep, where single substeps leave a twentieth of what moves compressed by more than 16 %.
    """
    outline = straight_slot(80.0, NARROW_MM)
    solid = build_solid(outline, CrackShape(depth_mm=16.0, tilt="vertical", wall_angle_deg=0.0))
    path = NozzlePath(volume_ml=4.8 * NARROW_MM / 3.1, speed_mm_s=4.0, trim_mm=10.0)
    trajectory = plan_trajectory(outline, path, solid.cavity_volume_mm3, solid.sections)
    began = time.perf_counter()
    run, _ = fill(
        Pour(
            Sample(outline, solid, trajectory),
            (LIKE_THE_PAPER,),
            Solver(radius_mm=NARROW_MM / 8, substeps=2),
            Nozzle(diameter_mm=NARROW_MM),
        ),
        ComputeOptions(threads=threads, progress=progress_for_stderr(quiet=False)),
    )
    minutes = (time.perf_counter() - began) / 60
    return [
        Row(f"a crack of {NARROW_MM:g} mm, clock", minutes, "min", 0, 10, "<= 5"),
        Row("particles", len(run.position_mm), "", 1e5, 2e5),
        Row("moving at one time, most", run.health.recorded()["moving_most"], ""),
        Row("particles through a wall", run.escaped_particles, "", 0, 0),
        Row("density error, 95th percentile", 100 * run.health.recorded()["density_error_p95"], "%", 0, 10),
        Row("volume kept", volume_ratio(run, solid), "", 0.95, 1.05),
    ]


if __name__ == "__main__":
    run_benchmark(main)
