"""Reynolds, Bond and Bingham numbers of an injection."""

from typing import NamedTuple

GRAVITY_M_S2 = 9.81
SURFACE_TENSION_N_M = 0.072
"""Surface tension of water in air at 25 °C, since that of a paste is rarely measured. The simulation has no surface
tension."""


class Regime(NamedTuple):
    reynolds: float | None  # Inertia over viscosity in the nozzle; None for a fluid without viscosity
    bond: float  # Gravity over the surface tension of water, across the crack
    bingham: float | None  # Yield stress over viscous stress in the nozzle; None for a fluid without viscosity


def regime_of(
    *,
    viscosity_m2_s: float | None,
    density_kg_m3: float,
    yield_stress_pa: float,
    speed_mm_s: float,
    nozzle_mm: float,
    width_mm: float,
    flow_index: float = 1.0,
) -> Regime:
    """Return the numbers for the speed of the sealant in the nozzle and the width of the crack.

    With a ``flow_index``, the viscosity is that at a shear rate of 1/s, and the numbers have that at speed over nozzle.
    Without a viscosity or a speed, only the Bond number is computed.
    """
    bond = density_kg_m3 * GRAVITY_M_S2 * (1e-3 * width_mm) ** 2 / SURFACE_TENSION_N_M
    if not viscosity_m2_s or speed_mm_s == 0:
        return Regime(None, bond, None)
    flowing_m2_s = viscosity_m2_s * (speed_mm_s / nozzle_mm) ** (flow_index - 1)
    reynolds = 1e-6 * speed_mm_s * nozzle_mm / flowing_m2_s
    viscous_pa = density_kg_m3 * flowing_m2_s * speed_mm_s / nozzle_mm
    return Regime(reynolds, bond, yield_stress_pa / viscous_pa)


def standing_stress_pa(density_kg_m3: float, width_mm: float) -> float:
    """Return the yield stress above which upright walls carry the weight of the paste between them, rho g w / 2."""
    return density_kg_m3 * GRAVITY_M_S2 * 1e-3 * width_mm / 2
