"""Flow between plane walls against closed forms, with the settings of a trial file: cases of ``benchmarks.physics``.

Fluids have a density of 1000 kg/m3, stick to the walls since no D is given, and move as in a run: pressure, viscosity,
collisions. A channel repeats itself along x and z, its walls are planes in y; a push takes the place of gravity.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from math import pi
from typing import Any

import numpy as np

from benchmarks.loose_fluid import substep_s
from benchmarks.table import Row
from sealtwin.core.records import Floats
from simulate.settings import Fluid
from tests.support.periodic_box import Endless, stirred_mm
from tests.support.small_fluids import sealant

DENSITY_KG_M3 = 1000.0
"""A viscosity in mm2/s is then one in mPa s, a stress over the density in mm2/s2 one in mPa."""
LONG = 16
"""Length and height of a channel over R: four supports, after which it repeats."""
MEAN_MM_S = 40.0
"""Speed of a flow by its closed form: some particle diameters in a tenth of a second, as in the trial."""
LAST = 1 / 3
"""Of a flow's steps, over which its speed is taken."""
OFF = 0.1
MANY = 8
"""Arrangements of particles, where one alone says little."""


@dataclass(frozen=True)
class Channel:
    """Herschel and Bulkley's fluid between plates: stress tau + K gamma^n, all over the density, in mm and s."""

    across: float
    """Particle diameters from wall to wall."""
    viscosity: float
    """K, in mm2 s^(n-2): for n = 1 a kinematic viscosity in mm2/s."""
    yields: float = 0.0
    """Yield stress over that at the walls."""
    index: float = 1.0
    radius_mm: float = 0.4
    mean_mm_s: float = MEAN_MM_S

    @property
    def width_mm(self) -> float:
        return 2 * self.across * self.radius_mm

    @cached_property
    def push_mm_s2(self) -> float:
        """Acceleration that gives the mean speed; of one that stands, what gives the speed at 0.8 of the stress."""
        # The speed goes with the push to the power 1/n where the yield stress goes with it.
        return (self.mean_mm_s / self._mean(1.0)) ** self.index

    def _mean(self, push_mm_s2: float) -> float:
        y = np.linspace(0.0, self.width_mm / 2, 2001)
        return float(np.trapezoid(self._speed(y, push_mm_s2, min(self.yields, 0.8)), y)) / (self.width_mm / 2)

    def _speed(self, y_mm: Floats, push_mm_s2: float, yields: float) -> Floats:
        half, power = self.width_mm / 2, 1 + 1 / self.index
        plug = min(yields, 1.0) * half
        sheared = (half - plug) ** power - np.maximum(np.abs(y_mm) - plug, 0.0) ** power
        return (push_mm_s2 / self.viscosity) ** (1 / self.index) * sheared / power

    def speed_mm_s(self, y_mm: Floats) -> Floats:
        """The closed form, y = 0 in the middle."""
        return self._speed(y_mm, self.push_mm_s2, self.yields)

    @property
    def fluid(self) -> Fluid:
        stress_mm2_s2 = self.yields * self.push_mm_s2 * self.width_mm / 2
        thickness = 1e-6 * DENSITY_KG_M3 * self.viscosity
        flow: dict[str, float] = {"viscosity_pa_s": thickness}
        if self.index != 1:
            flow = {"consistency_pa_s_n": thickness, "flow_index": self.index}
        stress_pa = 1e-6 * DENSITY_KG_M3 * stress_mm2_s2
        return sealant(density_kg_m3=DENSITY_KG_M3, yield_stress_pa=stress_pa, **flow)

    def flow(self, seconds: float, seed: int = 0, **solver: Any) -> tuple[float, float]:
        """Mean speed at last, and that of the closed form at the same places; it starts as the closed form has it.

        It is the speed at which places change, which velocities need not have: earlier, particles moved
        faster than their velocity, by g dt. ``seed`` chooses how particles lie at first.
        """
        radius_mm, step_s = self.radius_mm, substep_s(self.radius_mm)
        place_mm, side_mm = _filled(self.width_mm, radius_mm, seed)
        box = Endless(place_mm, side_mm, radius_mm=radius_mm, step_s=step_s, walled=True, fluid=self.fluid, **solver)
        box.push_mm_s2 = np.array([self.push_mm_s2, 0.0, 0.0])
        box.set_velocity(np.outer(self.speed_mm_s(place_mm[:, 1] - self.width_mm / 2), [1.0, 0.0, 0.0]))
        seen = []
        steps = round(seconds / step_s)
        for step in range(steps):
            before_mm = box.place_mm
            box.wait(1)
            if step >= (1 - LAST) * steps:
                y_mm = box.place_mm[:, 1] - self.width_mm / 2
                seen.append([box.moved_mm(before_mm)[:, 0].mean() / step_s, self.speed_mm_s(y_mm).mean()])
        mean, exact = np.mean(seen, axis=0)
        return float(mean), float(exact)

    def row(self, name: str, seconds: float, off: float = OFF, seeds: int = 1, **solver: Any) -> Row:
        flows = [self.flow(seconds, seed, **solver) for seed in range(seeds)]
        mean = float(np.mean([seen / exact for seen, exact in flows]))
        return Row(f"{name}: speed over closed form", mean, "", 1 - off, 1 + off, "1")


@cache
def _filled(width_mm: float, radius_mm: float, seed: int) -> tuple[Floats, Floats]:
    """Particles at rest in no order in a channel, (n, 3), and its sides."""
    side_mm = np.array([LONG * radius_mm, width_mm, LONG * radius_mm])
    return stirred_mm(side_mm, 1.0, radius_mm, substep_s(radius_mm), walled=True, seed=seed), side_mm


def channel() -> Iterator[Row]:
    """Poiseuille's flow at three widths."""
    for viscosity in (10.0, 32.0, 322.0, 3000.0):
        for across, off in ((4.0, 0.2), (5.0, OFF), (8.0, OFF)):
            flow = Channel(across, viscosity)
            # Three times what the slowest of the flow's modes takes, of which little is left from the start.
            seconds = np.clip(3 * flow.width_mm**2 / (pi**2 * viscosity), 0.1, 1.0)
            yield flow.row(f"{viscosity:g} mm2/s, {across:g} across", float(seconds), off)


def bingham() -> Iterator[Row]:
    """A yield stress of 0.2 to 0.8 of the stress at the walls; and one that holds the fluid."""
    for radius_mm in (0.25, 0.4):
        for yields in (0.2, 0.5, 0.8):
            flow = Channel(8.0, 32.0, yields, radius_mm=radius_mm)
            yield flow.row(f"Bingham, {yields:g} of the walls' stress, R {radius_mm:g}", 0.3)
    # An endless fluid never sleeps, so this is the creep of a fluid that is awake.
    creep, _ = Channel(8.0, 32.0, 1.2, radius_mm=0.25, mean_mm_s=6.0).flow(0.6)
    yield Row("Bingham, 1.2 of it: creep", creep, "mm/s", 0, 0.01, "0")


def herschel() -> Iterator[Row]:
    """A fluid that thins as it is sheared and one that thickens; K gives 32 mm2/s at 50/s."""
    for index in (0.5, 1.5):
        for yields in (0.0, 0.2, 0.5, 0.8):
            flow = Channel(8.0, 32.0 * 50.0 ** (1 - index), yields, index, radius_mm=0.25)
            name = f"n = {index:g}, {yields:g} of the walls' stress"
            # A layer thinner than a particle is sheared at each wall by then, most of all of a thinning fluid: one
            # arrangement is 7 % off another.
            yield flow.row(name, 0.3, seeds=MANY if (index, yields) == (0.5, 0.8) else 1)
