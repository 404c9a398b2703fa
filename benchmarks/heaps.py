"""Heaps of paste let go in a slot, against those of interFoam: tables in ``benchmarks/interfoam``, which it is not run for.

    python -m benchmarks.heaps [--yield-pa 5|9|12|15] [--radius-mm 0.4]

The paste is given as a trial file gives it, by viscosity and yield stress, and sticks to the walls by both. It starts
as an even lattice, 12 mm long and 24 mm high, against the end of a slot of 3.1 mm, as in ``physics_yield.py``; of half
a millimetre and less in interFoam only its shape is the same. A level is the mean over the slot's width in both.
"""

import argparse
import csv
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.channels import step_of
from benchmarks.interfoam.__main__ import HEAP_MM, TABLES, VISCOSITY_PA_S, WIDTH_MM, slope
from benchmarks.interfoam.cases import DENSITY_KG_M3
from benchmarks.physics_tanks import GRAVITY_MM_S2, Pit, Tank, block_mm, spacing_mm
from benchmarks.table import Row, finish
from sealtwin.core.records import Floats
from simulate.settings import Fluid

PIT = Pit(60.0, WIDTH_MM, 26.0)
EVERY_S = 0.025
OFF, LATE = 0.1, 0.25
"""Of a slope or a height, and of a time."""


class Course(NamedTuple):
    """How a heap goes down: a row for each time."""

    t_s: Floats
    tan: Floats
    height_mm: Floats
    centre_mm: Floats
    """Height of the centre of all paste."""

    def half_s(self, end_s: float) -> float:
        """Time at which the centre has gone half of its way down until then."""
        end_mm = float(np.interp(end_s, self.t_s, self.centre_mm))
        return float(np.interp(-(self.centre_mm[0] + end_mm) / 2, -self.centre_mm, self.t_s))

    def at(self, t_s: float) -> tuple[float, float]:
        """Tan and height."""
        row = int(np.abs(self.t_s - t_s).argmin())
        return float(self.tan[row]), float(self.height_mm[row])


@cache
def references() -> dict[tuple[float, float, float], Course]:
    """What interFoam found, by yield stress in Pa, cells in mm and limit of the viscosity in m2/s."""
    with (TABLES / "heaps.csv").open(newline="") as file:
        rows = [[float(part) for part in row] for row in list(csv.reader(file))[1:]]
    keys = dict.fromkeys((row[0], row[1], row[2]) for row in rows)
    return {key: Course(*np.array([row[3:] for row in rows if tuple(row[:3]) == key]).T) for key in keys}


def surface_mm(place_mm: Floats, radius_mm: float) -> tuple[Floats, Floats]:
    """Middles and levels of columns of a millimetre: half a spacing above the topmost centres, over the width."""
    strips = max(1, round(WIDTH_MM / (2 * radius_mm)))
    across = np.clip(((place_mm[:, 1] / WIDTH_MM + 0.5) * strips).astype(int), 0, strips - 1)
    top = np.zeros((round(PIT.length_mm), strips))
    np.maximum.at(top, (place_mm[:, 0].astype(int), across), place_mm[:, 2] + spacing_mm(radius_mm) / 2)
    return np.arange(len(top)) + 0.5, top.mean(axis=1)


def collapse(yield_pa: float, radius_mm: float, end_s: float, *, sleep: bool = True) -> Course:
    """The same heap in particles."""
    fluid = Fluid.model_validate(
        {
            "density_kg_m3": DENSITY_KG_M3,
            "yield_stress_pa": yield_pa,
            "viscosity_pa_s": VISCOSITY_PA_S,
            "freeze_after_s": "never",
        }
    )
    heap = block_mm((0.0, -WIDTH_MM / 2, 0.0), (HEAP_MM[0], WIDTH_MM / 2, HEAP_MM[1]), radius_mm)
    tank = Tank.of(PIT, heap, radius_mm=radius_mm, step_s=step_of(radius_mm), fluid=fluid, sleep=sleep)
    rows = [(0.0, *_figures(tank))]
    for t_s in tank.run(end_s):
        if t_s >= rows[-1][0] + EVERY_S:
            rows.append((t_s, *_figures(tank)))
    rows.append((end_s, *_figures(tank)))
    return Course(*np.array(rows).T)


def _figures(tank: Tank) -> tuple[float, float, float]:
    x, level = surface_mm(tank.place_mm, tank.radius_mm)
    return slope(x, level), float(level.max()), float(tank.place_mm[:, 2].mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--yield-pa", type=float, help="that heap alone")
    parser.add_argument("--radius-mm", type=float, action="append", help="0.4 and 0.3 if left out")
    asked = parser.parse_args()
    found = {key[0]: course for key, course in references().items() if key[1:] == (SIZE_MM, LIMIT_M2_S)}
    stresses = [asked.yield_pa] if asked.yield_pa else sorted(found)
    finish([row for stress in stresses for radius in asked.radius_mm or (0.4, 0.3) for row in rows(stress, radius)])


if __name__ == "__main__":
    main()
