"""The walls' share of the stress by strips, and the volume by the sample's weight: both EMULATED.

    python -m benchmarks.wall_and_volume [--tests 400] [--seed 20261127]

Errors are as large as the commands take them to be, strips scatter by 2 to 12 %, and the paste's yield stress is off by
its stated uncertainty.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.table import Row, run_benchmark
from digitise.settings import Dispensed
from sealtwin.core.errors import InputError
from sealtwin.material.by_strip import StripErrors, share_of
from simulate.spread_law import GRAVITY_M_S2

DENSITY_KG_M3 = (1300.0, 2000.0)
ERRORS = StripErrors()
HELD = 92.0, 98.0


def main(tests: int = 400, seed: int = 20261127) -> list[Row]:
    random = np.random.default_rng(seed)
    return [*_strips(tests, random), *_weighings(tests, random)]


def _strips(tests: int, random: np.random.Generator) -> Iterator[Row]:
    inside, off, wide, refused = [], [], [], 0
    for _ in range(tests):
        share, stress_pa, count = random.uniform(0.2, 1.0), random.uniform(5, 25), int(random.integers(3, 9))
        relative = random.uniform(0.03, 0.1)
        # The paste whose strips slide has the true stress; its file has one that is off.
        stated_pa = stress_pa * (1 + relative * random.normal())
        length_mm, width_mm, over_mm = random.uniform(40, 80), random.uniform(15, 30), random.uniform(80, 200)
        thick_mm = random.uniform(2, 5)
        density = random.uniform(*DENSITY_KG_M3)
        mass_g = 1e-6 * density * length_mm * width_mm * thick_mm * random.normal(1, 0.03, count)
        slides_pa = share * stress_pa * np.exp(random.normal(0, random.uniform(0.02, 0.12), count))
        sine = slides_pa * length_mm * width_mm / (1e3 * mass_g * GRAVITY_M_S2)
        if (sine >= 0.9).any():
            continue
        sides_mm = random.normal(0, ERRORS.side_error_mm, 2)
        strips = {
            "mass_g": mass_g + random.normal(0, ERRORS.mass_error_g),
            "length_mm": np.full(count, length_mm + sides_mm[0]),
            "width_mm": np.full(count, width_mm + sides_mm[1]),
            "rise_mm": sine * over_mm + random.normal(0, ERRORS.rise_error_mm),
            "over_mm": np.full(count, over_mm),
        }
        try:
            measured = share_of(strips, ERRORS, stated_pa, relative * stated_pa).share
        except InputError:
            refused += 1
            inside.append(False)
            continue
        low, high = measured.interval
        inside.append(low <= share <= high)
        off.append(measured.value / share - 1)
        wide.append((high - low) / 2 / share)
    yield Row("strips: tests", len(inside), "")
    yield Row("strips: refused, since more than the paste bears", 100 * refused / tests, "%", 0, 5)
    yield Row("strips: 95 % intervals that hold the walls' share", 100 * float(np.mean(inside)), "%", *HELD)
    yield Row("strips: share off by, RMS", 100 * float(np.sqrt(np.mean(np.square(off)))), "%")
    yield Row("strips: half-width of the interval, median", 100 * float(np.median(wide)), "%")


def _weighings(tests: int, random: np.random.Generator) -> Iterator[Row]:
    inside, wide = [], []
    for _ in range(tests):
        volume_ml, density = random.uniform(1, 20), random.uniform(*DENSITY_KG_M3)
        sd_g, density_sd = random.uniform(0.02, 0.2), 0.003 * density
        # A sample is weighed before and after.
        mass_g = 1e-3 * density * volume_ml + random.normal(0, sd_g, 2) @ [1, -1]
        weighed = Dispensed(
            mass_g=float(mass_g),
            mass_sd_g=float(np.sqrt(2) * sd_g),
            density_kg_m3=density + random.normal(0, density_sd),
            density_sd_kg_m3=density_sd,
        )
        inside.append(abs(weighed.volume_ml - volume_ml) <= 1.96 * weighed.volume_sd_ml)
        wide.append(1.96 * weighed.volume_sd_ml / volume_ml)
    yield Row("sample weighed: 95 % intervals that hold the volume", 100 * float(np.mean(inside)), "%", *HELD)
    yield Row("sample weighed: half-width of the interval, median", 100 * float(np.median(wide)), "%")


if __name__ == "__main__":
    run_benchmark(main)
