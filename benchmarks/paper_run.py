"""How long the paper's crack and nozzle speed take at 1 mm, which the paper puts at 54 minutes; is it computed right?

    python benchmarks/paper_run.py [--threads T]

Four particles across, less sealant and a thinner nozzle to match. The crack is 64 particles deep, where single substeps
leave a twentieth of what moves compressed by more than 16 %.
"""

import time

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
from tests.support.shapes import straight_slot

LIKE_THE_PAPER = Fluid(U=30.0, D_cm=0.3, freeze_after_s=2.58)
NARROW_MM = 1.0


def main(threads: int = 1) -> list[Row]:
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
        ComputeOptions(threads=threads, progress=progress_for_stderr()),
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
