"""Flow that viscosity rules: shear waves, what the solver adds of its own, and the currents of Huppert."""

from collections.abc import Callable, Iterator, Sequence
from math import pi, sqrt
from statistics import fmean
from typing import Any

import numpy as np

from benchmarks.physics_endless import Endless, stirred_mm
from benchmarks.physics_findings import Finding, reported, within
from benchmarks.physics_rest import pressure_at
from benchmarks.physics_tanks import GRAVITY_MM_S2, Mask, Pit, Tank, resolution, settled_mm
from sealtwin.core.records import Floats
from simulate.remarks import THIN
from simulate.setup.rheology import added_viscosity
from simulate.setup.signed_distance import CM
from tests.fluids import FRAME_S, sealant

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
OFF = 0.05
DRAWS = 24  # One draw of a fluid without viscosity is off the mean by 0.08, one standard deviation
TOLD_OFF = 0.1
"""Where a run says before it begins what its particles add: the bar of the channels' flow."""


def shear_wave() -> Iterator[Finding]:
    """A standing wave in an endless fluid: nu by its decay, of the viscous solve alone and of whole substeps.

    In these particles slide past each other and the pressure keeps them apart. At rest density that adds what a run
    of a thin fluid tells. Under a load it adds friction, a stress of 0.5 to 0.9 % of the pressure whatever the rate of
    shear, the substeps and the iterations: much to a thin fluid, little to a paste (decision 0064).
    """
    even = stirred_mm(BOX_MM, 1.0, WAVE_RADIUS_MM, STEP_S)
    source = "exp(-nu k2 t)"
    for asked in WEIGHTS_MM2_S:
        yield within(f"shear wave: nu for {asked:g} asked", _decay(even, asked)[0], "mm2/s", asked, OFF, source)
    added = 100 * added_viscosity(WAVE_RADIUS_MM * CM, STEP_S)
    for asked in WEIGHTS_MM2_S:
        name, own = f"shear wave, pressure active: nu for {asked:g} asked", _decay(even, asked, moves=True)[0]
        if added > THIN * asked:
            yield within(f"{name}, {added:.2g} told", own, "mm2/s", asked + added, TOLD_OFF, source)
        else:
            yield within(name, own, "mm2/s", asked, OFF, source)
    others = (stirred_mm(BOX_MM, 1.0, WAVE_RADIUS_MM, STEP_S, seed=seed) for seed in range(1, DRAWS))
    own = fmean(_decay(place_mm, 0.0, moves=True)[0] for place_mm in (even, *others))
    name = f"shear wave, U = 0: the solver's own nu over what is told, mean of {DRAWS}"
    yield Finding(name, own / added, "", 0.5, 2.0, "1", "decision 0111: a factor of two")
    loaded = stirred_mm(BOX_MM, COMPRESSED, WAVE_RADIUS_MM, STEP_S)
    own, box, speed_mm_s = _decay(loaded, 0.0, moves=True)
    stress = own * speed_mm_s * 2 * pi / BOX_MM[2] / sqrt(2)
    asked, name = WEIGHTS_MM2_S[1], f"the same, compressed by {100 * (box.density - 1):.1f} %"
    paste = _decay(loaded, asked, moves=True)[0]
    stress_share = stress / pressure_at(box.density - 1, box.tank)
    yield reported(f"{name}: own nu", own, "mm2/s", "0", "decision 0064")
    yield reported(f"{name}: stress over pressure", stress_share, "", "0", "friction")
    yield reported(f"{name}: nu for {asked:g} asked", paste, "mm2/s", f"{asked:g}", "decision 0064")


def _decay(place_mm: Floats, asked_mm2_s: float, *, moves: bool = False) -> tuple[float, Endless, float]:
    """Viscosity in mm2/s, the box afterwards, and the wave's height in mm/s midway."""
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
    return float((left ** (-1 / steps) - 1) / (k**2 * STEP_S)), box, WAVE_MM_S * left**0.5


EXPONENT_OFF = 0.1
"""A tenth of an exponent: the laws next to these, 1/8 and 1/4, are a quarter and more away."""


FACTOR_OFF = 0.1
"""The bar of the channels' flow; the front goes with its third or fifth root, and with the volume's."""
CURRENT_RADIUS_MM, CURRENT_STEP_S = 0.3, 1.8e-3


def plane_current() -> Iterator[Finding]:
    """A volume let go on a floor to which it sticks, between sides that slip: Huppert's t^(1/5).

    The sides are rough all the same, and stand far apart. By both pressures: local pressure leaves the fluid compressed
    where it is deep, and as it spreads it swells.
    """
    viscosity_mm2_s, start_mm, width_mm = 500.0, (14.0, 16.0), 7.0
    theory = 1.411 * (GRAVITY_MM_S2 * (start_mm[0] * start_mm[1]) ** 3 / (3 * viscosity_mm2_s)) ** 0.2
    compressed = "deep fluid is compressed, and swells as it spreads: two levels meet it"

    def slips(place_mm: Floats) -> Mask:
        """The floor alone holds the fluid: its wall particles lie a radius under it."""
        return place_mm[:, 2] > -0.5 * CURRENT_RADIUS_MM

    for pressure, because in (("local", compressed), ("two-level", "")):
        pit = Pit(85.0, width_mm, 24.0)
        path = _let_go(pit, start_mm, viscosity_mm2_s, 2.2, slips=slips, pressure=pressure)
        yield from _current(f"plane current, {pressure}", path, 0.2, theory, "Huppert 1982", because)


def slot_current(preset: str = "accurate") -> Iterator[Finding]:
    """The same in a slot whose sides alone hold it: Hele-Shaw flow, one-sided, x = (9 kappa A t)^(1/3)."""
    viscosity_mm2_s, start_mm, width_mm = 100.0, (12.0, 24.0), 3.1
    pit = Pit(100.0, width_mm, 30.0)
    of_floor_alone: dict[str, Any] = {"slips": lambda place: np.abs(place[:, 1]) < width_mm / 2}
    path = _let_go(pit, start_mm, viscosity_mm2_s, 2.0, preset=preset, **of_floor_alone)
    kappa = GRAVITY_MM_S2 * width_mm**2 / (12 * viscosity_mm2_s)
    theory = (9 * kappa * start_mm[0] * start_mm[1]) ** (1 / 3)
    yield from _current("slot current", path, 1 / 3, theory, "Barenblatt")


def _let_go(
    pit: Pit,
    start_mm: tuple[float, float],
    viscosity_mm2_s: float,
    seconds: float,
    *,
    slips: Callable[[Floats], Mask],
    preset: str = "accurate",
    **solver: Any,
) -> Floats:
    """Time and front, (n, 2), of a heap of that length and height; with the settings of a trial file, volume kept.

    The heap has come to rest by the pressure that lets it go: one that another leaves compressed bursts.
    """
    where = resolution(preset, CURRENT_RADIUS_MM, CURRENT_STEP_S, pit.width_mm) | {"keeps_volume": True, **solver}
    heap = settled_mm(Pit(start_mm[0], pit.width_mm, pit.depth_mm), height_mm=start_mm[1], **where)
    fluid = sealant(viscosity_pa_s=1e-3 * viscosity_mm2_s, density_kg_m3=1000.0)
    tank = Tank.of(pit, heap, fluid=fluid, slips=slips, **where)
    return np.array([[t, tank.front_mm()] for t in tank.run(seconds)])


def _current(
    name: str, path: Floats, exponent: float, theory: float, source: str, because: str = ""
) -> Iterator[Finding]:
    """The slope of log x over log t in the last three quarters of the run, and the factor before it."""
    late = path[:, 0] > 0.25 * path[-1, 0]
    time_s, front_mm = path[late].T
    slope = float(np.polyfit(np.log(time_s), np.log(front_mm), 1)[0])
    factor = float(np.mean(front_mm / time_s**exponent)) / theory
    yield within(f"{name}: exponent", slope, "", exponent, EXPONENT_OFF, source, because=because)
    yield within(f"{name}: front over theory", factor, "", 1.0, FACTOR_OFF, source)


CASES: Sequence[str] = ("shear_wave", "plane_current", "slot_current")
