"""The volume that a bed keeps: three radii, four ways to come to rest, both pressures, two cracks; 48 short pours.

    python benchmarks/volume.py [--radius-mm 0.6] [--way freezing] [--pressure local] [--crack deep] [--seed 0]

Each pours the paper's nozzle along 28 mm and lets the bed settle for 2 s. ``deep`` is a piece of the paper's crack as
its photo was traced, 3.1 mm at the floor and 16 mm deep; ``wide`` is straight, 6 mm wide and 8 mm deep. The volume kept
is that between walls and surface over what was dispensed, of the settled particles as the product measures it, and
again on cells of another size. Nothing here is adjusted to a reading. All 48 take about 11 minutes of processor time.
"""

import itertools
import time
from functools import cache
from typing import Annotated

from benchmarks.stiffening import WAYS, Crack, Stiffening, advance, ready, trace
from benchmarks.table import Row, one_of, run_benchmark
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.records import Outline
from simulate.profile import volume_ratio
from tests.shapes import CUT, outline_between, straight_slot

LENGTH_MM, BEGINS_MM, TRIM_MM = 28.0, 26.0, 4.0
ML_PER_MM = 0.08  # The paper's 4.8 ml over 60 mm of path
WIDE_MM, WIDE_DEPTH_MM, WIDE_ML = 6.0, 8.0, 1.05
KEPT = 0.99, 1.01
OTHER_CELLS_MM = 0.25
ALIKE = 0.98, 1.02
"""Volume kept on cells of another size: a lattice of known volume is read at 0.984 to 1.004 on those of 0.4 mm."""
RADII_MM = (0.6, 0.5, 0.4)
PRESSURES = ("local", "two-level")
CASES = {
    "freezing": WAYS["freezing"],
    "12 Pa": WAYS["yield"],
    "30 Pa": Stiffening("yield stress of 30 Pa", 30.0, "never"),
    "Newtonian": WAYS["neither"],
}


@cache
def deep() -> Crack:
    traced = trace().outline
    piece = (traced.s_mm >= BEGINS_MM) & (traced.s_mm <= BEGINS_MM + LENGTH_MM)
    walls = (traced.centreline_mm[piece], traced.left_wall_mm[piece], traced.right_wall_mm[piece])
    shape = CrackShape(depth_mm=16.0, tilt="flare", wall_angle_deg=5.5)
    return _crack(outline_between(*walls, CUT, None), shape, ML_PER_MM * (LENGTH_MM - 2 * TRIM_MM))


@cache
def wide() -> Crack:
    shape = CrackShape(depth_mm=WIDE_DEPTH_MM, tilt="vertical", wall_angle_deg=0.0)
    return _crack(straight_slot(LENGTH_MM, WIDE_MM), shape, WIDE_ML)


CRACKS = {"deep": deep, "wide": wide}


def _crack(outline: Outline, shape: CrackShape, volume_ml: float) -> Crack:
    solid = build_solid(outline, shape)
    path = NozzlePath(volume_ml=volume_ml, speed_mm_s=4.0, trim_mm=TRIM_MM)
    return solid, outline, plan_trajectory(outline, path, cavity_volume_mm3=solid.cavity_volume_mm3)


def main(
    radius_mm: float | None = None,
    way: Annotated[str | None, one_of(CASES)] = None,
    pressure: Annotated[str | None, one_of(PRESSURES)] = None,
    crack: Annotated[str | None, one_of(CRACKS)] = None,
    seed: int = 0,
) -> list[Row]:
    chosen = itertools.product(
        [radius_mm] if radius_mm else RADII_MM,
        [pressure] if pressure else PRESSURES,
        [crack] if crack else CRACKS,
        [way] if way else CASES,
    )
    return [row for case in chosen for row in rows_of(*case, seed)]


def rows_of(
    radius_mm: float, pressure: str, crack: str, way: str, seed: int = 0, preset: str = "accurate"
) -> list[Row]:
    began = time.process_time()
    injection = ready(CRACKS[crack](), CASES[way], radius_mm, seed, preset, pressure=pressure, settle_s=2.0)
    advance(injection, injection.frames)
    took_s = time.process_time() - began
    (run,) = injection.results()
    kept, again = (volume_ratio(run, injection.solid, *cells) for cells in ((), (OTHER_CELLS_MM,)))
    name = f"R {radius_mm:g} mm, {pressure}, {crack}, {way}"
    factor = run.health.volume_factor
    print(f"{name}: kept {kept:.4f}, on other cells {again:.4f}, factor {factor:.3f}, {took_s:.1f} CPU s", flush=True)
    return [
        Row(f"{name}: kept", kept, "", *KEPT),
        Row(f"{name}: on other cells", again, "", *ALIKE),
        Row(f"{name}: in the walls", run.escaped_particles, "", 0, 0),
    ]


if __name__ == "__main__":
    run_benchmark(main)
