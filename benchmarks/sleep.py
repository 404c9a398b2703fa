"""Whether sleep changes the bed: mean levels of 24 seeds with it and without, in three beds.

    python benchmarks/sleep.py [--bed paper|thick|wide] [--seeds 24]

The cracks are those of ``benchmarks/volume.py``, poured at R = 0.6 mm. Two means of n runs differ by chance too: the
squares of both standard errors are taken off the mean squared difference. Twelve seeds are few: of a bed that 36 find
0.06 mm off, three sets of twelve say 0.14, 0.01 and 0.09 mm. All three beds take twenty minutes of processor time.
"""

import math
import time
from typing import Annotated, NamedTuple

import numpy as np

from benchmarks.stiffening import WAYS, Stiffening, advance, ready
from benchmarks.table import Row, one_of, run_benchmark
from benchmarks.volume import CRACKS
from sealtwin.core.records import Floats
from simulate.profile import measure_profile

RADIUS_MM, SETTLE_S = 0.6, 2.0
SEEDS = 24
APART_MM = 0.1
BEDS = {
    "paper": ("deep", WAYS["yield"]),
    "thick": ("deep", Stiffening("yield stress of 20 Pa", 20.0, "never")),
    "wide": ("wide", WAYS["yield"]),
}


class Poured(NamedTuple):
    level_mm: Floats  # (seeds, stations)
    cpu_s: float  # Mean of a run


def main(bed: Annotated[str | None, one_of(BEDS)] = None, seeds: int = SEEDS) -> list[Row]:
    return [row for name in ([bed] if bed else BEDS) for row in rows_of(name, seeds=seeds)]


def rows_of(bed: str, preset: str = "accurate", seeds: int = SEEDS) -> list[Row]:
    asleep, awake = (pour(bed, seeds, preset, sleep=sleep) for sleep in (True, False))
    apart_mm = asleep.level_mm.mean(axis=0) - awake.level_mm.mean(axis=0)
    chance_mm2 = sum(poured.level_mm.var(axis=0, ddof=1).mean() / seeds for poured in (asleep, awake))
    rms_mm = math.sqrt(max(0.0, float((apart_mm**2).mean() - chance_mm2)))
    print(
        f"{bed}: apart {rms_mm:.3f} mm RMS beyond chance ({math.sqrt(chance_mm2):.3f}), mean {apart_mm.mean():+.3f}, "
        f"most {np.abs(apart_mm).max():.2f}; {asleep.cpu_s:.1f} CPU s with sleep, {awake.cpu_s:.1f} without",
        flush=True,
    )
    return [
        Row(f"{bed}: levels with sleep off those without, RMS", rms_mm, "mm", 0, APART_MM),
        Row(f"{bed}: CPU with sleep over without", asleep.cpu_s / awake.cpu_s, "", 0, 1),
    ]


def pour(bed: str, seeds: int, preset: str, *, sleep: bool) -> Poured:
    crack, way = BEDS[bed]
    began, levels = time.process_time(), []
    for seed in range(seeds):
        injection = ready(CRACKS[crack](), way, RADIUS_MM, seed, preset, settle_s=SETTLE_S, sleep=sleep)
        advance(injection, injection.frames)
        levels.append(measure_profile(injection.results()[0], injection.outline, injection.solid).level_mm)
    return Poured(np.array(levels), (time.process_time() - began) / seeds)


if __name__ == "__main__":
    run_benchmark(main)
