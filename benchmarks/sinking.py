"""Plugs of liquid that sink between upright plates, over the closed form; ``benchmarks.channels --only plugs``.

A plug hangs clear of the floor, between plates 28 mm long, and sinks by its own weight. Between its ends the mean speed
of a section is g w^2 / 12 nu. Near its ends liquid also moves across, which the closed form does not have. So these
figures are reported, and flow that fills its channel is judged: ``channels.channel``.
"""

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from benchmarks.physics_tanks import GRAVITY_MM_S2, Pit, Tank, raised, settled_mm
from benchmarks.table import Row
from simulate.loose_fluid import substep_s
from tests.fluids import sealant

VISCOSITY_PA_S, DENSITY_KG_M3 = 5.0, 1000.0
ABREAST, TALL_MM = (3.5, 4.0, 6.0), (12.0, 40.0)
RADIUS_MM, LONG_MM = 0.4, 28.0
SINKS = 0.5
"""Of the width, by the closed form: how far a plug is watched, a fifth of the lowest one's height at most."""
CLEAR_MM, ROOM_MM = 3.0, 8.0
"""Over three particle diameters that stay free below a plug, and room above it."""


def plugs() -> Iterator[Row]:
    """Speed of a plug's places, and of those in its middle."""
    for across, tall_mm in product(ABREAST, TALL_MM):
        speed, middle = sunk(across, tall_mm)
        name = f"plug of {tall_mm:g} mm, {across:g} across"
        yield Row(f"{name}: speed over closed form", speed, "")
        yield Row(f"{name}: the same of its middle", middle, "")


def sunk(across: float, tall_mm: float) -> tuple[float, float]:
    """Return the speed over the closed form, of all heights and of the middle half, in the middle half of the length.

    The plug begins as it rests by two-level pressure, which compresses nothing: one that local pressure leaves swells
    as it sinks.
    """
    width_mm, step_s = 2 * across * RADIUS_MM, substep_s(RADIUS_MM)
    how: dict[str, Any] = {"radius_mm": RADIUS_MM, "step_s": step_s}
    fluid = sealant(viscosity_pa_s=VISCOSITY_PA_S, density_kg_m3=DENSITY_KG_M3)
    closed_mm_s = GRAVITY_MM_S2 * width_mm**2 / (12 * 1e6 * VISCOSITY_PA_S / DENSITY_KG_M3)
    above_mm = 2 * SINKS * width_mm + CLEAR_MM
    resting_mm = settled_mm(Pit(LONG_MM, width_mm, tall_mm + ROOM_MM), height_mm=tall_mm, pressure="two-level", **how)
    pit = Pit(LONG_MM, width_mm, above_mm + tall_mm + ROOM_MM)
    tank = Tank.of(pit, raised(resting_mm, above_mm), fluid=fluid, **how)
    before_mm = tank.place_mm
    tank.wait(SINKS * width_mm / closed_mm_s)
    speeds = (before_mm - tank.place_mm)[:, 2] / (step_s * tank.steps) / closed_mm_s
    along = np.abs(before_mm[:, 0] - LONG_MM / 2) < LONG_MM / 4
    middle = along & (np.abs(before_mm[:, 2] - above_mm - tall_mm / 2) < tall_mm / 4)
    return float(speeds[along].mean()), float(speeds[middle].mean())
