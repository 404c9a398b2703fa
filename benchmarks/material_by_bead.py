"""Pump and paste by one bead, emulated: errors, intervals and their widths.

    python -m benchmarks.material_by_bead [--beads 200] [--seed 0]

Nothing here was measured. A bead's outline is that of a bar in particles which the law was not fitted to (kind
``judge`` of ``beads.csv``), between its stresses, with ends that lie as much farther out or in as those of bars of
other shapes do, and with surface tension's term in full. Its photo is drawn as a spread's. Weight, density, speed, the
nozzle's mark and the weight of surface tension are off by what the command takes for their standard uncertainties.
Three minutes of one core.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks.beads import JUDGED_LENGTH, between, judged_range
from benchmarks.material_by_scale import BANDS, HELD, Case, judged
from benchmarks.table import Row, run_benchmark
from digitise.bead import measure_bead
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.material.by_bead import MASS_ERROR_G, SPEED_ERROR, STIFFEST, LaidBead, identify
from sealtwin.material.paste import DENSITY_ERROR, EDGE_ERROR_N_M, EDGE_N_M
from simulate.spread_law import GRAVITY_M_S2
from tests.spreads import BEAD_BOARD, BEAD_FACE_MM, BeadPhoto

LENGTH_MM = (36.0, 60.0)
ENDS = 0.14
"""Half of what ends of bars lie apart, one as high as its filament and one 1.6 times as wide, over half the width."""
TOUCH_MM = 0.3  # Standard uncertainty of the nozzle's mark
NEAR_STIFFEST = 0.94  # Of the stiffest bead, beyond which noise alone decides what is refused
REFUSED = 5.0


def beads(count: int, seed: int) -> Iterator[tuple[Case, Case, Case] | None]:
    """Yield stress, flow and delay of emulated beads, their stresses even in the logarithm; None for a refused one."""
    random = np.random.default_rng([seed, 3])
    low, high = judged_range()
    high = min(high, NEAR_STIFFEST * STIFFEST)
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            shape = between(low * (high / low) ** ((number + random.uniform()) / count))
            root_mm = random.uniform(*LENGTH_MM) / JUDGED_LENGTH
            shape = shape._replace(half_length=shape.half_length + random.uniform(-ENDS, ENDS) * shape.half_width)
            declared = random.uniform(1300, 2000)
            density = declared * (1 + random.normal(0, DENSITY_ERROR))
            section, length_mm = root_mm**2, root_mm * JUDGED_LENGTH
            ring_mm = root_mm * shape.ring()
            edge = max(0.0, random.normal(EDGE_N_M, EDGE_ERROR_N_M))
            area_mm2 = shape.seen().area_mm2 * section
            held_pa = shape.stress * density * GRAVITY_M_S2 * root_mm * 1e-3
            stress_pa = held_pa - 1e3 * edge * area_mm2 / (np.pi * section * length_mm)
            speed, delay_s, turn = random.uniform(2, 8), random.uniform(0, 0.8), random.uniform(-0.4, 0.4)
            flow = section * speed
            forth = np.array([np.cos(turn), np.sin(turn)])
            middle = np.array([45.0, 30.0]) + random.uniform(-1.5, 1.5, 2)
            start = middle - forth * (length_mm / 2 + delay_s * speed) + random.normal(0, TOUCH_MM, 2)
            mm_per_px = random.uniform(0.08, 0.13)
            photo = BeadPhoto(
                edge_mm=tuple(map(tuple, (ring_mm * (1 + random.normal(0, 0.4 * mm_per_px) / root_mm)).tolist())),
                middle_mm=(float(middle[0]), float(middle[1])),
                radius_mm=root_mm,
                turn=turn,
                dark=bool(number % 3),
                mm_per_px=mm_per_px,
                tilt_deg=random.uniform(0, 7),
                lens_k1=random.uniform(-0.05, 0.02),
                gradient=random.uniform(-0.4, 0.4),
                noise=random.uniform(0.002, 0.03),
                seed=number,
            ).write(Path(folder, "bead.png"))
            laid = LaidBead(
                density_kg_m3=declared,
                mass_g=1e-6 * section * length_mm * density + random.normal(0, MASS_ERROR_G),
                asked_mm3_s=flow / random.uniform(0.7, 1.15),
                speed_mm_s=speed * (1 + random.normal(0, SPEED_ERROR)),
                start_mm=(float(start[0]), float(start[1])),
            )
            settings = PhotoInput(file=photo, data="synthetic", markers=BEAD_BOARD, face_mm=BEAD_FACE_MM)
            try:
                estimate = identify(laid, measure_bead(settings, Path(folder)))
            except InputError:
                yield None
                continue
            assert estimate.delay_s is not None, "its mark was given"
            yield (
                Case(stress_pa, estimate.stress_pa.value, *estimate.stress_pa.interval),
                Case(flow, estimate.flow_mm3_s.value, *estimate.flow_mm3_s.interval),
                Case(delay_s, estimate.delay_s.value, *estimate.delay_s.interval),
            )


def main(count: Annotated[int, Option("--beads")] = 200, seed: int = 0) -> list[Row]:
    print("All readings are emulated; nothing was measured.")
    laid = list(beads(count, seed))
    measured = [bead for bead in laid if bead is not None]
    stress, flow, delay = (list(cases) for cases in zip(*measured, strict=True))
    rows = [
        Row("beads refused", 100 * (1 - len(measured) / len(laid)), "%", 0, REFUSED, "0"),
        Row("least yield stress", min(case.true for case in stress), "Pa"),
        Row("largest yield stress", max(case.true for case in stress), "Pa"),
        *judged("bead's stress", stress),
    ]
    for low, high in BANDS:
        if band := [case for case in stress if low <= case.true < high]:
            rows += judged(f"bead's stress, {low:g} to {high:g} Pa", band)
    rows += judged("pump's flow by a bead", flow)
    off_s = np.array([case.found - case.true for case in delay])
    rows.append(Row("delay by a bead: RMS error", float(np.sqrt(np.mean(off_s**2))), "s"))
    rows.append(
        Row("delay by a bead: held by 95 % intervals", 100 * float(np.mean([c.held for c in delay])), "%", 100 * HELD)
    )
    return rows


if __name__ == "__main__":
    run_benchmark(main)
