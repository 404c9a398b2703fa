"""Flow that viscosity rules: shear waves, what the solver adds of its own, and the currents of Huppert."""

from collections.abc import Sequence
from math import pi

import numpy as np

from benchmarks.physics_findings import Finding, within
from benchmarks.physics_tanks import (
    CUBE_RADIUS_MM,
    GRAVITY_MM_S2,
    Pit,
    Tank,
    cube_mm,
    no_slip_mm,
    raised,
    settled_mm,
)
from sealtwin.records import Floats
from tests.fluids import FRAME_S

WEIGHTS_MM2_S = (3.2, 32.2, 322.0)
"""U = 3, 30 and 300 of the paper's radius and frame."""


CUBE_MM = 12.0
"""Of a side, and the length of the wave: seven supports."""
STEP_S = FRAME_S / 4
LONGEST_S, HIGH_MM = 0.15, 150.0
"""Of a fall, and how deep that is at most."""
STRAIN = 0.5
"""Of the block while the wave decays: layers slide by half their distance, and the cube stays one."""


def shear_wave() -> list[Finding]:
    """A standing wave in a block that falls freely, so that neither weight nor wall touches it; nu by its decay.

    First the viscous solve alone, in place; then whole substeps, in which particles slide past each other by layers
    and the pressure keeps them apart.
    """
    found = []
    for asked in WEIGHTS_MM2_S:
        still = _wave_viscosity(asked, moves=False)
        found.append(within(f"shear wave: nu for {asked:g} asked", still, "mm2/s", asked, 0.05, "exp(-nu k2 t)"))
    for asked in WEIGHTS_MM2_S:
        name = f"shear wave, pressure active: nu for {asked:g} asked"
        found.append(within(name, _wave_viscosity(asked, moves=True), "mm2/s", asked, 0.05, "exp(-nu k2 t)"))
    own = _wave_viscosity(0.0, moves=True)
    return [*found, Finding("shear wave, U = 0: the solver's own nu", own, "mm2/s", "0", "exp(-nu k2 t)")]


def _wave_viscosity(asked_mm2_s: float, moves: bool) -> float:
    k = 2 * pi / CUBE_MM
    # A third of the wave is lost before what happens at the sides has come to the middle.
    rate = max(asked_mm2_s, 1e-6) * k**2
    steps = max(4, round(min(0.4 / rate, LONGEST_S) / STEP_S))
    size_mm_s = STRAIN / (k * steps * STEP_S)
    # A cube let go also swells a little; of two opposite waves that is the same.
    left = (_wave_left(asked_mm2_s, steps, size_mm_s, moves) - _wave_left(asked_mm2_s, steps, -size_mm_s, moves)) / 2
    # Backward Euler takes 1 / (1 + rate dt) a step.
    return float(((left / size_mm_s) ** (-1 / steps) - 1) / (k**2 * STEP_S))


def _wave_left(asked_mm2_s: float, steps: int, size_mm_s: float, moves: bool) -> float:
    fluid = cube_mm(CUBE_MM)
    tank = Tank.of(
        Pit(CUBE_MM, CUBE_MM, 4.0),
        raised(fluid, HIGH_MM),
        radius_mm=CUBE_RADIUS_MM,
        step_s=STEP_S,
        viscosity_mm2_s=asked_mm2_s,
        falls=True,
    )
    wave = np.cos(2 * pi / CUBE_MM * fluid[:, 2])
    tank.set_velocity(np.outer(wave, [size_mm_s, 0.0, 0.0]))
    if moves:
        tank.wait(steps * STEP_S)
    else:
        tank.engine.find_neighbours()
        tank.engine.measure_density()
        for _ in range(steps):
            tank.engine.viscosity.solve_implicit(tank.engine.rows)
    # Away from the surface, where half of a kernel is missing: two supports at the sides, one above and below.
    inner = np.abs(fluid[:, 2] - CUBE_MM / 2) < CUBE_MM / 2 - 1.6
    inner &= (np.abs(fluid[:, :2] - [CUBE_MM / 2, 0]) < CUBE_MM / 2 - 3.2).all(axis=1)
    return float(tank.velocity_mm_s[inner, 0] @ wave[inner] / (wave[inner] @ wave[inner]))


VORTEX_MM, VORTEX_DEPTH_MM = 16.0, 5.0
SPIN_MM_S = 50.0


def vortex() -> list[Finding]:
    """Taylor's vortex in a pit with D = 0: particles move under their weight, and exp(-2 nu k^2 t) is exact.

    Where walls slip, that is: D = 0 leaves walls made of particles, which are rough. What is above nu is theirs.
    """
    return [
        Finding(
            f"vortex in a pit with D = 0: nu for {asked:g} asked",
            _vortex_viscosity(asked, seconds),
            "mm2/s",
            f"{asked:g}, slip",
            "exp(-2 nu k2 t)",
        )
        for asked, seconds in ((0.0, 1.0), (32.2, 0.4))
    ]


def _vortex_viscosity(asked_mm2_s: float, seconds: float) -> float:
    radius_mm, step_s = 0.5, 2e-3
    pit = Pit(VORTEX_MM, VORTEX_MM, VORTEX_DEPTH_MM + 5)
    fluid = settled_mm(pit, radius_mm, step_s, VORTEX_DEPTH_MM)
    tank = Tank.of(pit, fluid, radius_mm=radius_mm, step_s=step_s, viscosity_mm2_s=asked_mm2_s)
    tank.set_velocity(SPIN_MM_S * _mode(tank.place_mm))
    rows = []
    for t in tank.run(seconds):
        mode = _mode(tank.place_mm)
        rows.append([t, float((tank.velocity_mm_s * mode).sum() / (mode**2).sum())])
    time_s, speed_mm_s = np.array(rows).T
    # From a tenth on, when the start has passed, to where the wave is still well above the particles' own noise.
    seen = (time_s > 0.1 * seconds) & (speed_mm_s > 0.1 * SPIN_MM_S)
    rate = -np.polyfit(time_s[seen], np.log(speed_mm_s[seen]), 1)[0]
    k = pi / VORTEX_MM
    return float(rate / (2 * k**2))


def _mode(place_mm: Floats) -> Floats:
    k = pi / VORTEX_MM
    x, y = k * place_mm[:, 0], k * (place_mm[:, 1] + VORTEX_MM / 2)
    return np.column_stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y), 0 * x])


EXPONENT_OFF = 0.1
"""A tenth of an exponent: the laws next to these, 1/8 and 1/4, are a quarter and more away."""


def plane_current() -> list[Finding]:
    """A volume let go on a floor to which it sticks, between sides that slip: Huppert's t^(1/5).

    The sides are rough all the same, and stand far apart: at 2.5 mm they make it t^(0.23), on the way to a slot's.
    """
    radius_mm, viscosity_mm2_s, step_s, width_mm = 0.3, 500.0, 1.8e-3, 7.0
    start_mm = (14.0, 16.0)
    fluid = settled_mm(Pit(start_mm[0], width_mm, 24.0), radius_mm, step_s, start_mm[1])
    tank = Tank.of(
        Pit(85.0, width_mm, 24.0),
        fluid,
        radius_mm=radius_mm,
        step_s=step_s,
        viscosity_mm2_s=viscosity_mm2_s,
        drag_mm=no_slip_mm(viscosity_mm2_s, radius_mm, step_s),
        # The floor alone holds the fluid: its wall particles lie a radius under it.
        slips=lambda place: place[:, 2] > -0.5 * radius_mm,
    )
    path = np.array([[t, tank.front_mm()] for t in tank.run(2.2)])
    theory = 1.411 * (GRAVITY_MM_S2 * (start_mm[0] * start_mm[1]) ** 3 / (3 * viscosity_mm2_s)) ** 0.2
    return _current("plane current", path, 0.2, theory, "Huppert 1982")


def slot_current() -> list[Finding]:
    """The same in a slot whose sides alone hold it: Hele-Shaw flow, one-sided, x = (9 kappa A t)^(1/3)."""
    radius_mm, viscosity_mm2_s, step_s, width_mm = 0.3, 100.0, 1.8e-3, 3.1
    start_mm = (12.0, 24.0)
    fluid = settled_mm(Pit(start_mm[0], width_mm, 30.0), radius_mm, step_s, start_mm[1])
    pit = Pit(100.0, width_mm, 30.0)
    tank = Tank.of(
        pit,
        fluid,
        radius_mm=radius_mm,
        step_s=step_s,
        viscosity_mm2_s=viscosity_mm2_s,
        drag_mm=no_slip_mm(viscosity_mm2_s, radius_mm, step_s),
        slips=lambda place: np.abs(place[:, 1]) < width_mm / 2,
    )
    path = np.array([[t, tank.front_mm()] for t in tank.run(2.0)])
    kappa = GRAVITY_MM_S2 * width_mm**2 / (12 * viscosity_mm2_s)
    theory = (9 * kappa * start_mm[0] * start_mm[1]) ** (1 / 3)
    return _current("slot current", path, 1 / 3, theory, "Barenblatt")


def _current(name: str, path: Floats, exponent: float, theory: float, source: str) -> list[Finding]:
    """The slope of log x over log t in the last three quarters of the run, and the factor before it."""
    late = path[:, 0] > 0.25 * path[-1, 0]
    time_s, front_mm = path[late].T
    slope = float(np.polyfit(np.log(time_s), np.log(front_mm), 1)[0])
    factor = float(np.mean(front_mm / time_s**exponent)) / theory
    return [
        within(f"{name}: exponent", slope, "", exponent, EXPONENT_OFF, source),
        Finding(f"{name}: front over theory", factor, "", "1", f"{source}; of nu as asked"),
    ]


CASES: Sequence[str] = ("shear_wave", "vortex", "plane_current", "slot_current")
