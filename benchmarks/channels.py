"""Flow between plane walls against closed forms, with the settings of a trial file and nothing else.

    python -m benchmarks.channels [--only momentum|channel|thin|bingham|herschel|walls|plugs|fronts]

Fluids have a density of 1000 kg/m3, stick to the walls since no D is given, and move as in a run: pressure, viscosity,
collisions. A channel repeats itself along x and z, its walls are planes in y; a push takes the place of gravity.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from math import pi
from typing import Annotated, Any

import numpy as np

from benchmarks.collapse import fronts
from benchmarks.physics_endless import Endless, stirred_mm
from benchmarks.physics_tanks import GRAVITY_MM_S2, Pit, Tank, raised, resolution
from benchmarks.sinking import plugs
from benchmarks.table import Row, one_of, run_benchmark
from sealtwin.core.records import Floats
from simulate.loose_fluid import filled_box_mm, substep_s
from simulate.settings import Fluid
from simulate.setup.rheology import added_viscosity
from simulate.setup.signed_distance import CM
from tests.fluids import FRAME_S, sealant

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

    def resolution(self, preset: str) -> dict[str, Any]:
        return resolution(preset, self.radius_mm, substep_s(self.radius_mm), self.width_mm)

    def slides(self, seconds: float, wall_share: float) -> float:
        """Mean speed at last of a fluid that begins at rest, on walls that take up a share of its stress."""
        radius_mm, step_s = self.radius_mm, substep_s(self.radius_mm)
        place_mm, side_mm = _filled(self.width_mm, radius_mm, 0)
        fluid = self.fluid.model_copy(update={"wall_share": wall_share})
        box = Endless(place_mm, side_mm, radius_mm=radius_mm, step_s=step_s, walled=True, fluid=fluid)
        box.push_mm_s2 = np.array([self.push_mm_s2, 0.0, 0.0])
        steps = round(seconds / step_s)
        box.wait(round((1 - LAST) * steps))
        before_mm, last = box.place_mm, round(LAST * steps)
        box.wait(last)
        return float(box.moved_mm(before_mm)[:, 0].mean()) / step_s / last

    def flow(self, seconds: float, seed: int = 0, preset: str = "accurate", **solver: Any) -> tuple[float, float]:
        """Mean speed at last, and that of the closed form at the same places; it starts as the closed form has it.

        It is the speed at which places change, which velocities need not have: until decision 0155 particles moved
        faster than their velocity, by g dt. ``seed`` chooses how particles lie at first.
        """
        how = self.resolution(preset)
        step_s: float = how["step_s"]
        place_mm, side_mm = _filled(self.width_mm, how["radius_mm"], seed)
        box = Endless(place_mm, side_mm, walled=True, fluid=self.fluid, **how, **solver)
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


CLOUD_STEPS = 6
"""11 ms."""
CHAOS_MM_S, TURN_PER_S = 40.0, 20.0
"""Speeds of a cloud's particles: at random, and of all around its middle."""


def momentum() -> Iterator[Row]:
    """A cloud in which speeds are at random about a turn: nothing in it can push or turn it as a whole.

    Under all forces it is the mean of many clouds, and no more than by pressure alone.
    """
    pressed = _mean_drift(0.0, 0.0)
    yield Row("cloud, pressure alone: momentum off rms", pressed, "")
    for name, fluid in CLOUDS.items():
        pushed, turned = drift(*fluid, alone=True)
        yield Row(f"cloud, {name} alone: momentum off rms", pushed, "", 0, 1e-5, "0")
        yield Row(f"cloud, {name} alone: angular momentum off", turned, "", 0, 0.01, "0")
        pushed = _mean_drift(*fluid)
        yield Row(f"cloud, {name} and pressure: momentum off rms", pushed, "", 0, pressed, "0", because=ROUNDING)


def _mean_drift(viscosity_mm2_s: float, yield_mm2_s2: float) -> float:
    return float(np.mean([drift(viscosity_mm2_s, yield_mm2_s2, seed=seed)[0] for seed in range(DRAWS)]))


ROUNDING = "the search for the viscosity's velocities is in float32, half of whose epsilon is 6e-8 of a speed"
DRAWS = 48
"""Clouds: their mean is known to 7 %."""
CLOUDS = {"32 mm2/s": (32.2, 0.0), "322 mm2/s": (322.0, 0.0), "12 Pa": (32.2, 7100.0)}
"""Viscosity in mm2/s, and yield stress over the density in mm2/s2, 12 Pa at that of paste."""


def drift(viscosity_mm2_s: float, yield_mm2_s2: float, *, alone: bool = False, seed: int = 3) -> tuple[float, float]:
    """Change of the mean speed over the root of the mean square, and of the angular momentum over itself."""
    radius_mm, step_s = 0.4, FRAME_S / 4
    cube = filled_box_mm((0.0, -3.0, 0.0), (6.0, 3.0, 6.0), radius_mm)
    random = np.random.default_rng(seed)
    # Particles overlap, so that densities differ.
    place = raised(cube + random.uniform(-0.15, 0.15, cube.shape), 30.0)
    paste = {"viscosity_mm2_s": viscosity_mm2_s, "yield_mm2_s2": yield_mm2_s2}
    how: dict[str, Any] = {"radius_mm": radius_mm, "step_s": step_s, "falls": True, **paste}
    tank = Tank.of(Pit(8.0, 8.0, 4.0), place, **how)
    away = place - place.mean(axis=0)
    turn = TURN_PER_S * np.column_stack([-away[:, 1], away[:, 0], 0 * away[:, 0]])
    tank.set_velocity(turn + random.normal(0.0, CHAOS_MM_S, place.shape))
    before = _momenta(tank)
    rms_mm_s = float(np.sqrt((tank.velocity_mm_s**2).sum(axis=1).mean()))
    engine = tank.engine
    engine.find_neighbours()
    engine.pressure.measure_density(engine.rows)
    for _ in range(CLOUD_STEPS):
        if alone:
            if yield_mm2_s2:
                engine.viscosity.measure_shear(engine.rows)
            engine.viscosity.solve_implicit(engine.rows)
        else:
            tank.set_velocity(tank.velocity_mm_s + np.array([0.0, 0.0, GRAVITY_MM_S2 * step_s]))
            tank.wait(step_s)
    pushed, turned = (after - once for after, once in zip(_momenta(tank), before, strict=True))
    return float(np.abs(pushed).max()) / rms_mm_s, float(np.linalg.norm(turned) / np.linalg.norm(before[1]))


def _momenta(tank: Tank) -> tuple[Floats, Floats]:
    """Means over the particles: velocity, and angular momentum about their middle; (3,) each."""
    place, velocity = tank.place_mm, tank.velocity_mm_s
    return velocity.mean(axis=0), np.cross(place - place.mean(axis=0), velocity - velocity.mean(axis=0)).mean(axis=0)


def channel(preset: str = "accurate") -> Iterator[Row]:
    """Poiseuille's flow at three widths."""
    for viscosity in (10.0, 32.0, 322.0, 3000.0):
        for across, off in ((4.0, 0.2), (5.0, OFF), (8.0, OFF)):
            flow = Channel(across, viscosity)
            # Three times what the slowest of the flow's modes takes, of which little is left from the start.
            seconds = np.clip(3 * flow.width_mm**2 / (pi**2 * viscosity), 0.1, 1.0)
            yield flow.row(f"{viscosity:g} mm2/s, {across:g} across", float(seconds), off, preset=preset)


def thin(preset: str = "accurate") -> Iterator[Row]:
    """Fluid to whose viscosity the particles add as much as the solver states."""
    for radius_mm in (0.25, 0.4):
        asked = Channel(8.0, 3.0, radius_mm=radius_mm)
        how = asked.resolution(preset)
        acts = 3.0 + 100 * added_viscosity(how["radius_mm"] * CM, how["step_s"])
        mean, exact = asked.flow(2.5, preset=preset)
        name = f"3 mm2/s, R {radius_mm:g}, acts as {acts:.2f}: speed over closed form"
        yield Row(name, mean / exact * acts / 3.0, "", 1 - OFF, 1 + OFF, "1")


def bingham(preset: str = "accurate") -> Iterator[Row]:
    """A yield stress of 0.2 to 0.8 of the stress at the walls; and one that holds the fluid."""
    for radius_mm in (0.25, 0.4):
        for yields in (0.2, 0.5, 0.8):
            flow = Channel(8.0, 32.0, yields, radius_mm=radius_mm)
            yield flow.row(f"Bingham, {yields:g} of the walls' stress, R {radius_mm:g}", 0.3, preset=preset)
    # An endless fluid never sleeps, so this is the creep of a fluid that is awake.
    creep, _ = Channel(8.0, 32.0, 1.2, radius_mm=0.25, mean_mm_s=6.0).flow(0.6, preset=preset)
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


def walls() -> Iterator[Row]:
    """Walls that take up a share of the paste's stress: it stands below that share, and slides above as one plug.

    The push gives a stress at the walls of 0.45 to 0.7 of the yield stress, at which nothing inside is sheared.
    """
    for stress, share, slides in ((0.7, 0.8, False), (0.7, 0.6, True), (0.45, 0.5, False), (0.55, 0.5, True)):
        speed = Channel(8.0, 32.0, 1 / stress, radius_mm=0.25, mean_mm_s=6.0).slides(0.25, share)
        low, high = (0.1, np.inf) if slides else (0, 0.01)
        yield Row(f"stress of {stress:g} of the yield stress, walls take up {share:g}: speed", speed, "mm/s", low, high)


CASES: dict[str, Callable[[], Iterator[Row]]] = {
    case.__name__: case for case in (momentum, channel, thin, bingham, herschel, walls, plugs, fronts)
}


def main(only: Annotated[list[str] | None, one_of(CASES)] = None) -> list[Row]:
    return [row for name in only or CASES for row in CASES[name]()]


if __name__ == "__main__":
    run_benchmark(main)
