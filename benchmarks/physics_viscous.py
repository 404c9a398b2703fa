"""Flow that viscosity rules: shear waves, what the solver adds of its own, and the currents of Huppert."""

from collections.abc import Sequence
from math import pi, sqrt

import numpy as np

from benchmarks.physics_endless import Endless, stirred_mm
from benchmarks.physics_findings import Finding, within
from benchmarks.physics_tanks import GRAVITY_MM_S2, Pit, Tank, settled_mm
from sealtwin.core.records import Floats
from simulate.settings import PRESETS
from simulate.setup.rheology import no_slip_weight
from tests.fluids import FRAME_S

WEIGHTS_MM2_S = (3.2, 32.2, 322.0)
"""U = 3, 30 and 300 of the paper's radius and frame."""

BOX_MM = np.array([8.0, 8.0, 12.0])
"""The wave is as long as the box is high: seven supports."""
WAVE_RADIUS_MM, STEP_S = 0.4, FRAME_S / 4
WAVE_MM_S = 100.0
"""As fast as the nozzle's jet, 71 mm/s, and half as fast again."""
LONGEST_S = 0.1
COMPRESSED = 1.05
"""Times as many particles as the box holds at rest: about what lies at the middle of a bed of 16 mm."""
OF_THE_LAW = 0.7
"""Of the law of compression that fluid of calibrated walls shows; see ``hydrostatic``."""


def shear_wave() -> list[Finding]:
    """A standing wave in an endless fluid: nu by its decay, of the viscous solve alone and of whole substeps.

    In these particles slide past each other and the pressure keeps them apart. At rest density that adds some mm2/s.
    Under a load it adds friction, a stress of 0.5 to 0.8 % of the pressure whatever the rate of shear, the substeps and
    the iterations: much to a thin fluid, little to a paste. (Decision 0064. A cube that falls freely, which stood for
    this once, comes apart within 0.1 s: its 13 % less viscosity was that of a mist.)
    """
    even = stirred_mm(BOX_MM, 1.0, WAVE_RADIUS_MM, STEP_S)
    source = "exp(-nu k2 t)"
    found = []
    for asked in WEIGHTS_MM2_S:
        name = f"shear wave: nu for {asked:g} asked"
        found.append(within(name, _decay(even, asked, moves=False)[0], "mm2/s", asked, 0.05, source))
    for asked in WEIGHTS_MM2_S:
        name = f"shear wave, pressure active: nu for {asked:g} asked"
        found.append(within(name, _decay(even, asked)[0], "mm2/s", asked, 0.05, source))
    found.append(Finding("shear wave, U = 0: the solver's own nu", _decay(even, 0.0)[0], "mm2/s", "0", source))
    loaded = stirred_mm(BOX_MM, COMPRESSED, WAVE_RADIUS_MM, STEP_S)
    own, density, speed_mm_s = _decay(loaded, 0.0)
    stress = own * speed_mm_s * 2 * pi / BOX_MM[2] / sqrt(2)
    # The law of compression, for the pressure: rho - 1 = 4 p dt^2 / (n h^2), p over the density.
    iterations = PRESETS["accurate"].iterations
    pressure = (density - 1) / OF_THE_LAW * iterations * (4 * WAVE_RADIUS_MM) ** 2 / (4 * STEP_S**2)
    paste = _decay(loaded, WEIGHTS_MM2_S[1])[0]
    name = f"the same, compressed by {100 * (density - 1):.1f} %"
    return [
        *found,
        Finding(f"{name}: own nu", own, "mm2/s", "0", source),
        Finding(f"{name}: own stress over pressure", stress / pressure, "", "0", "friction"),
        Finding(f"{name}: nu for {WEIGHTS_MM2_S[1]:g} asked", paste, "mm2/s", f"{WEIGHTS_MM2_S[1]:g}", source),
    ]


def _decay(place_mm: Floats, asked_mm2_s: float, moves: bool = True) -> tuple[float, float, float]:
    """Viscosity in mm2/s, mean density over rest density, and the wave's height in mm/s midway."""
    box = Endless(place_mm, BOX_MM, radius_mm=WAVE_RADIUS_MM, step_s=STEP_S, viscosity_mm2_s=asked_mm2_s)
    k = 2 * pi / BOX_MM[2]
    box.set_velocity(np.outer(np.cos(k * place_mm[:, 2]), [WAVE_MM_S, 0.0, 0.0]))
    # A third of the wave is enough to see.
    steps = max(4, round(min(0.4 / max(asked_mm2_s * k**2, 1e-6), LONGEST_S) / STEP_S))
    if moves:
        box.wait(steps)
    else:
        box.solve_alone(steps)
    wave = np.cos(k * box.place_mm[:, 2])
    left = float(box.velocity_mm_s[:, 0] @ wave / (wave @ wave)) / WAVE_MM_S
    # Backward Euler takes 1 / (1 + rate dt) a step.
    return float((left ** (-1 / steps) - 1) / (k**2 * STEP_S)), box.density, WAVE_MM_S * left**0.5


VORTEX_MM, VORTEX_DEPTH_MM = 16.0, 5.0
SPIN_MM_S = 50.0


def vortex() -> list[Finding]:
    """Taylor's vortex in a pit with D = 0: particles move under their weight, and exp(-2 nu k^2 t) is exact.

    Where walls slip, that is: D = 0 leaves walls made of particles, which are rough. What is above nu is theirs, and
    the particles' own friction under half a centimetre of fluid (``shear_wave``).
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
        drag_mm=no_slip_weight(viscosity_mm2_s, 4 * radius_mm, step_s),
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
        drag_mm=no_slip_weight(viscosity_mm2_s, 4 * radius_mm, step_s),
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
