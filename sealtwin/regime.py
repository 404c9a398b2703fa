"""Which forces rule an injection: its Reynolds, Bond and Bingham numbers, and where the model's range ends."""

from typing import NamedTuple

GRAVITY_M_S2 = 9.81
SURFACE_TENSION_N_M = 0.072
"""Water's against air at 25 degrees; a paste's is seldom known. The fluid here has none."""


class Regime(NamedTuple):
    reynolds: float | None
    """In the nozzle: inertia over viscosity; None for a fluid without viscosity."""
    bond: float
    """Across the crack: gravity over surface tension, by water's."""
    bingham: float | None
    """In the nozzle: yield stress over viscous stress; None for a fluid without viscosity."""


def regime_of(
    *,
    viscosity_m2_s: float,
    density_kg_m3: float,
    yield_stress_pa: float,
    speed_mm_s: float,
    nozzle_mm: float,
    width_mm: float,
) -> Regime:
    """``speed_mm_s`` is that of the sealant in the nozzle, ``width_mm`` the crack's."""
    bond = density_kg_m3 * GRAVITY_M_S2 * (1e-3 * width_mm) ** 2 / SURFACE_TENSION_N_M
    if viscosity_m2_s == 0 or speed_mm_s == 0:
        return Regime(None, bond, None)
    reynolds = 1e-6 * speed_mm_s * nozzle_mm / viscosity_m2_s
    viscous_pa = density_kg_m3 * viscosity_m2_s * speed_mm_s / nozzle_mm
    return Regime(reynolds, bond, yield_stress_pa / viscous_pa)
