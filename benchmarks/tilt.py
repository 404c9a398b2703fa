"""A sample that does not lie level: the surface of a liquid at rest is square to gravity, and no particle escapes.

    python benchmarks/tilt.py

A tank of Newtonian liquid settles under gravity that leans in its frame. A plane through the topmost particles, away
from the walls, gives the surface's slope; it is averaged over some moments, for particles at rest still shift a little.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from benchmarks.physics_tanks import Pit, Tank, settled_mm
from benchmarks.table import Row, run_benchmark
from sealtwin.core.records import Floats
from simulate.settings import Fluid, SampleSlope
from tests.fluids import path, pour, sealant, slot

RADIUS_MM, STEP_S = 0.5, 1.8e-3
SIZE_MM, FILL_MM = (22.0, 22.0), 8.0
VISCOSITY_MM2_S = 100.0  # Thick enough to end all sloshing within SETTLE_S, thin enough to find its level
SETTLE_S, SEEN_S, EVERY = 0.8, 0.6, 15
COLUMN_MM = 1.0
BESIDE_WALLS_MM = 1.5
WITHIN_DEG = 0.2


class Slope(NamedTuple):
    gradient_deg: float
    crossfall_deg: float


SLOPES = (Slope(2.0, 0.0), Slope(0.0, 5.0), Slope(-5.0, 5.0), Slope(10.0, 0.0), Slope(10.0, 10.0))


def main() -> list[Row]:
    rows = []
    for pressure in ("local", "two-level"):
        for slope in SLOPES:
            angles_deg = settled_slope_deg(slope, pressure)
            for name, angle_deg, wanted_deg in zip(("gradient", "crossfall"), angles_deg, slope, strict=True):
                case = f"{pressure}, {slope.gradient_deg:g} and {slope.crossfall_deg:g} deg: {name}"
                rows.append(Row(f"{case}, off by", abs(angle_deg + wanted_deg), "deg", 0, WITHIN_DEG, "0"))
    rows += [Row(f"escaped, {name}", escaped(*case), "", 0, 0, "0") for name, case in POURS.items()]
    return rows


def settled_slope_deg(
    slope: Slope,
    pressure: str,
    size_mm: tuple[float, float] = SIZE_MM,
    fill_mm: float = FILL_MM,
    settle_s: float = SETTLE_S,
) -> tuple[float, float]:
    """Angles of a settled liquid's surface with x and with y of its tank, in degrees."""
    length, width = size_mm
    pit = Pit(length, width, fill_mm + 12)
    fluid = _level(pit, fill_mm)
    how = {"pressure": pressure, "slope": SampleSlope(**slope._asdict())}
    tank = Tank.of(pit, fluid, radius_mm=RADIUS_MM, step_s=STEP_S, viscosity_mm2_s=VISCOSITY_MM2_S, **how)
    tank.wait(settle_s)
    seen = [_plane_deg(tank) for number, _ in enumerate(tank.run(SEEN_S)) if number % EVERY == 0]
    along_deg, across_deg = np.mean(seen, axis=0)
    return float(along_deg), float(across_deg)


@cache
def _level(pit: Pit, fill_mm: float) -> Floats:
    """Particles at rest in a level tank: a lattice bursts, and two-level pressure throws it over the rim."""
    return settled_mm(pit, RADIUS_MM, STEP_S, fill_mm)


def _plane_deg(tank: Tank) -> tuple[float, float]:
    """Angles of the plane through the topmost particle of each column."""
    corner = np.array([0.0, -tank.pit.width_mm / 2])
    place = tank.place_mm
    column = np.floor((place[:, :2] - corner) / COLUMN_MM).astype(int)
    top = np.full(column.max(axis=0) + 1, -np.inf)
    np.maximum.at(top, (column[:, 0], column[:, 1]), place[:, 2])
    middle = (np.argwhere(np.isfinite(top)) + 0.5) * COLUMN_MM
    size = np.array([tank.pit.length_mm, tank.pit.width_mm])
    inner = (np.minimum(middle, size - middle) > BESIDE_WALLS_MM).all(axis=1)
    axes = np.column_stack([middle[inner], np.ones(inner.sum())])
    along, across, _ = np.linalg.lstsq(axes, top[np.isfinite(top)][inner], rcond=None)[0]
    return float(np.degrees(np.arctan(along))), float(np.degrees(np.arctan(across)))


def escaped(fluid: Fluid, pressure: str) -> int:
    crack = slot(12.0)
    way = path(crack[1], 0.2, speed_mm_s=20.0)
    slope = SampleSlope(gradient_deg=-30.0, crossfall_deg=20.0)
    return pour(crack, way, fluid, slope=slope, pressure=pressure, settle_s=0.5).escaped_particles


THICK, PASTE = sealant(U=1e4, D_cm=3.0), sealant(U=1e3, yield_stress_pa=5.0)
POURS = {
    "thick, -30 and 20 deg, local": (THICK, "local"),
    "thick, -30 and 20 deg, two-level": (THICK, "two-level"),
    "paste of 5 Pa, -30 and 20 deg, local": (PASTE, "local"),
}


if __name__ == "__main__":
    run_benchmark(main)
