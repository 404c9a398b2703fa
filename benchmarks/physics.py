"""The fluid against closed forms.

    python -m benchmarks.physics [--only NAME]...

A tolerance follows from a source or a reason that stands beside it in the code, never from what was measured. Particles
count for what they count for when a run begins; where a level or a current is judged, their volume is kept as in a run.
Six minutes of one core; tests/simulate/test_physics.py and test_remarks.py run some of the cases.
"""

from collections.abc import Callable, Iterator
from math import pi, sqrt, tanh
from statistics import fmean
from typing import Annotated, Any

import numpy as np
from scipy.optimize import curve_fit

from benchmarks.channels import bingham, channel, herschel
from benchmarks.loose_fluid import filled_box_mm
from benchmarks.table import Row, one_of, run_benchmark
from sealtwin.core.records import Floats
from simulate.remarks import THIN
from simulate.settings import particle_volume
from simulate.setup.rheology import added_viscosity
from simulate.setup.signed_distance import CLEARANCE, CM
from tests.support.periodic_box import Endless, stirred_mm
from tests.support.small_fluids import FRAME_S, sealant
from tests.support.tanks import GRAVITY_MM_S2, Pit, Tank, settled_mm

RADIUS_MM, STEP_S = 0.4, FRAME_S / 4
COLUMN, COLUMN_MM = Pit(6.0, 3.1, 24.0), 16.0
REST_S = 1.5  # Four times the memory of what keeps a run's volume


def within(name: str, value: float, unit: str, reference: float, off: float) -> Row:
    """A figure that may be ``off`` its reference, relative."""
    return Row(name, value, unit, reference * (1 - off), reference * (1 + off), f"{reference:.4g}")


def hydrostatic() -> Iterator[Row]:
    """A column of 16 mm under its weight, its volume kept as in a run: where its level is, and how dense its floor.

    Of the weight, local pressure's law may miss 15 %: walls bear up to 6 % by the particles' friction, and sums over a
    packing are 9 % off the integrals.
    """
    for substeps in (4, 8):
        how: dict[str, Any] = {"radius_mm": RADIUS_MM, "step_s": FRAME_S / substeps, "keeps_volume": True}
        # Water: enough to end the sloshing, little against the weight.
        tank = Tank.of(COLUMN, settled_mm(COLUMN, height_mm=COLUMN_MM, **how), viscosity_mm2_s=1.0, **how)
        tank.wait(REST_S)
        inside = tank.inside
        density, height = tank.engine.state.density.numpy()[inside], tank.place_mm[inside, 2]
        dense = float(density[(height > 1) & (height < 3)].mean() - 1)
        level_mm = float(np.median(tank.surface_mm()[:, 1]))
        # Of all particles: what splashed out, or leaked, is missing from the level.
        stands_mm = tank.engine.state.count * particle_volume(RADIUS_MM) / COLUMN.length_mm / COLUMN.width_mm
        name = f"column, {substeps} substeps"
        yield Row(f"{name}: level", level_mm, "mm", stands_mm - RADIUS_MM, stands_mm + RADIUS_MM, f"{stands_mm:.4g}")
        borne = pressure_at(dense, tank) / (GRAVITY_MM_S2 * (stands_mm - 2))
        yield within(f"{name}: floor's pressure over weight", borne, "", 1.0, 0.15)
        yield Row(f"{name}: floor compressed by", 100 * dense, "%")


def pressure_at(compression: float, tank: Tank) -> float:
    """Pressure over the density, in mm2/s2, that local iterations hold where density over rest density is 1 more.

    In each of n iterations a particle moves by the gradient of C (1 + 1.5 C) over S, where the continuum has
    S = 1.98 factor / h^2 + epsilon; n of them bear what a substep's fall would move it by, grad p dt^2.
    """
    engine, support = tank.engine, 4 * tank.radius_mm
    factor = engine.scheme.volume_factor * float(engine.state.swelling.numpy()[0])
    # Volume times the integral of the squared gradient of the spiky kernel: 8100 / pi B(3, 5) / h^5.
    squares = factor * particle_volume(tank.radius_mm) * 8100 / pi / 105 / support**5
    stiff = squares + engine.settings.relaxation / support**2
    return engine.scheme.iterations * compression * (1 + 1.5 * compression) / stiff / tank.step_s**2


def drop() -> Iterator[Row]:
    """Particles let go over a crack 16 mm deep: when and how fast the first one is at the floor, and none leaks."""
    height_mm = 16.0
    low = height_mm + CLEARANCE * RADIUS_MM
    fluid = filled_box_mm((2.0, -1.2, low), (4.0, 1.2, low + 2.4), RADIUS_MM)
    fluid[:, 2] += low - fluid[:, 2].min()
    tank = Tank.of(Pit(6.0, 3.1, height_mm), fluid, radius_mm=RADIUS_MM, step_s=7.23e-3 / 4)
    landed_s = speed_mm_s = 0.0
    for t in tank.run(0.3):
        if not landed_s:
            first = int(tank.place_mm[:, 2].argmin())
            speed_mm_s = max(speed_mm_s, float(-tank.velocity_mm_s[first, 2]))
            if tank.place_mm[first, 2] < 1.05 * CLEARANCE * RADIUS_MM:
                landed_s = t
    fall_ms, fast_m_s = 1e3 * sqrt(2 * height_mm / GRAVITY_MM_S2), sqrt(2 * height_mm * GRAVITY_MM_S2) / 1e3
    name = "drop from 16 mm"
    # Two substeps: the clock ticks in them, and the floor is met within one.
    yield Row(f"{name}: time to the floor", 1e3 * landed_s, "ms", fall_ms - 3.6, fall_ms + 3.6, f"{fall_ms:.4g}")
    yield Row(f"{name}: speed there", speed_mm_s / 1e3, "m/s", fast_m_s - 0.036, fast_m_s + 0.036, f"{fast_m_s:.4g}")
    yield Row(f"{name}: particles in the walls", tank.leaked(), "", 0, 0, "0")


SLOSH_MM, DEPTH_MM = (80.0, 3.0), 16.0
SWING_MM = 3.0
"""Of the surface at both ends: three layers of particles; theory beyond the linear one adds 1.1 % to the frequency."""


def sloshing() -> Iterator[Row]:
    """The first mode of a tank as large as the paper's crack, pushed as theory moves it: omega^2 = g k tanh(k h)."""
    k, pit = pi / SLOSH_MM[0], Pit(*SLOSH_MM, DEPTH_MM + 8)
    how: dict[str, Any] = {"radius_mm": RADIUS_MM, "step_s": 1e-3, "keeps_volume": True}
    # What the weight compresses, a run makes up for.
    fluid = settled_mm(pit, height_mm=DEPTH_MM, **how)
    tank = Tank.of(pit, fluid, **how)
    theory_hz = sqrt(GRAVITY_MM_S2 * k * tanh(k * DEPTH_MM)) / (2 * pi)
    x, z = k * fluid[:, 0], k * fluid[:, 2]
    mode = np.column_stack([np.cosh(z) * np.sin(x), 0 * x, -np.sinh(z) * np.cos(x)]) / np.sinh(k * DEPTH_MM)
    tank.set_velocity(2 * pi * theory_hz * SWING_MM * mode)
    path = np.array([[t, tank.place_mm[:, 0].mean()] for t in tank.run(1.0)])

    def wave(t: Floats, size: float, hz: float, decay: float, phase: float, middle: float) -> Floats:
        return middle + size * np.exp(-decay * t) * np.cos(2 * pi * hz * t + phase)

    _, hz, decay, _, _ = curve_fit(wave, *path.T, p0=(2.8, theory_hz, 1.0, -pi / 2, SLOSH_MM[0] / 2))[0]
    # Half a diameter of doubt about the depth moves the frequency by 1.3 %, the height of the wave by 1.1 %.
    yield within("sloshing, 80 x 16 mm: frequency", float(hz), "Hz", theory_hz, 0.025)
    yield Row("sloshing: height lost in a period, U = 0", 100 * (1 - float(np.exp(-decay / hz))), "%")


BOX_MM = np.array([8.0, 8.0, 12.0])
"""The wave is as long as the box is high: seven supports."""
WAVE_MM_S, LONGEST_S = 100.0, 0.1
"""Its height, as fast as the nozzle's jet, 71 mm/s, and half as fast again."""
DRAWS = 24  # One draw of a fluid without viscosity is off the mean by 0.08, one standard deviation


def shear_wave() -> Iterator[Row]:
    """A standing wave in an endless fluid: nu by its decay exp(-nu k^2 t), of the solve alone and of whole substeps.

    In these particles slide past each other and the pressure keeps them apart, which adds what a run of a thin fluid
    says before it begins (within a factor of two).
    """
    even, added = stirred_mm(BOX_MM, 1.0, RADIUS_MM, STEP_S), 100 * added_viscosity(RADIUS_MM * CM, STEP_S)
    for asked in (3.2, 32.2, 322.0):  # U = 3, 30 and 300 of the paper's radius and frame
        yield within(f"shear wave: nu for {asked:g} asked", _decay(even, asked), "mm2/s", asked, 0.05)
        acts, off = (asked + added, 0.1) if added > THIN * asked else (asked, 0.05)
        name = f"shear wave, pressure active: nu for {asked:g} asked, {acts:.3g} said"
        yield within(name, _decay(even, asked, moves=True), "mm2/s", acts, off)
    others = (stirred_mm(BOX_MM, 1.0, RADIUS_MM, STEP_S, seed=seed) for seed in range(1, DRAWS))
    own = fmean(_decay(place_mm, 0.0, moves=True) for place_mm in (even, *others))
    yield Row(f"shear wave, U = 0: nu over what is said, mean of {DRAWS}", own / added, "", 0.5, 2.0, "1")


def _decay(place_mm: Floats, asked_mm2_s: float, *, moves: bool = False) -> float:
    """Viscosity in mm2/s by the decay of the wave."""
    box = Endless(place_mm, BOX_MM, radius_mm=RADIUS_MM, step_s=STEP_S, viscosity_mm2_s=asked_mm2_s)
    k = 2 * pi / BOX_MM[2]
    box.set_velocity(np.outer(np.cos(k * place_mm[:, 2]), [WAVE_MM_S, 0.0, 0.0]))
    # A third of the wave is enough to see.
    steps = max(4, round(min(0.4 / max(asked_mm2_s * k**2, 1e-6), LONGEST_S) / STEP_S))
    (box.wait if moves else box.solve_alone)(steps)
    wave = np.cos(k * box.place_mm[:, 2])
    left = float(box.velocity_mm_s[:, 0] @ wave / (wave @ wave)) / WAVE_MM_S
    # Backward Euler takes 1 / (1 + rate dt) a step.
    return float((left ** (-1 / steps) - 1) / (k**2 * STEP_S))


def slot_current() -> Iterator[Row]:
    """A volume let go in a slot whose sides alone hold it: Hele-Shaw flow, one-sided, x = (9 kappa A t)^(1/3).

    A tenth of an exponent: the laws next to this, 1/5 and 1/2, are two fifths away. The front goes with its third root.
    """
    viscosity_mm2_s, start_mm, width_mm = 100.0, (12.0, 24.0), 3.1
    how: dict[str, Any] = {"radius_mm": 0.3, "step_s": 1.8e-3, "keeps_volume": True}
    heap = settled_mm(Pit(start_mm[0], width_mm, 30.0), height_mm=start_mm[1], **how)
    fluid = sealant(viscosity_pa_s=1e-3 * viscosity_mm2_s, density_kg_m3=1000.0)
    pit = Pit(100.0, width_mm, 30.0)
    tank = Tank.of(pit, heap, fluid=fluid, slips=lambda place: np.abs(place[:, 1]) < width_mm / 2, **how)
    path = np.array([[t, tank.front_mm()] for t in tank.run(2.0)])
    time_s, front_mm = path[path[:, 0] > 0.25 * path[-1, 0]].T
    theory = (9 * GRAVITY_MM_S2 * width_mm**2 / (12 * viscosity_mm2_s) * start_mm[0] * start_mm[1]) ** (1 / 3)
    slope = float(np.polyfit(np.log(time_s), np.log(front_mm), 1)[0])
    yield within("slot current: exponent", slope, "", 1 / 3, 0.1)
    yield within("slot current: front over theory", fmean(front_mm / time_s ** (1 / 3)) / theory, "", 1.0, 0.1)


CASES: dict[str, Callable[[], Iterator[Row]]] = {
    case.__name__: case
    for case in (
        *(drop, hydrostatic, sloshing, shear_wave, slot_current),
        *(channel, bingham, herschel),
    )
}


def main(only: Annotated[list[str] | None, one_of(CASES)] = None) -> list[Row]:
    return [row for name in only or CASES for row in CASES[name]()]


if __name__ == "__main__":
    run_benchmark(main)
