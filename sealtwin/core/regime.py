"""Forces on a liquid in a crack: Reynolds, Bond and Bingham numbers of an injection, and the meniscus between walls.

The profile of the meniscus of a wetting liquid between upright walls balances weight and surface tension (Young and
Laplace): with phi the angle of the surface, z its height over the lowest line, k the curvature there and l the
capillary length,

    z = l^2 (sqrt(k^2 + 2 (1 - cos phi) / l^2) - k),    dx / dphi = cos phi / sqrt(k^2 + 2 (1 - cos phi) / l^2)

and phi is a right angle at a wall that the liquid wets. The curvature follows from the width.
"""

from typing import Any, NamedTuple

import numpy as np

from sealtwin.core.records import Floats

GRAVITY_M_S2 = 9.81
SURFACE_TENSION_N_M = 0.072
"""Surface tension of water in air at 25 °C, since that of a paste is rarely measured. The simulation has no surface
tension."""
FLAT_WIDTHS = 60.0  # Width, in capillary lengths, from which the middle of the surface is flat
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)


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


def capillary_length_mm(surface_tension_n_m: float, density_kg_m3: float) -> float:
    return 1e3 * float(np.sqrt(surface_tension_n_m / (density_kg_m3 * GRAVITY_M_S2)))


def raise_and_height_mm(width_mm: float, capillary_mm: float) -> tuple[float, float]:
    """Return the mean level and that at the walls, both over the lowest line.

    In a narrow crack they are 1 - pi / 4 times and once half the width. In a wide one the walls lift the liquid by
    sqrt(2) capillary lengths, and the mean is 2 capillary lengths squared over the width. An infinite capillary length
    is that without gravity.
    """
    from scipy.optimize import brentq

    if np.isinf(capillary_mm):
        return width_mm / 2 * (1 - np.pi / 4), width_mm / 2
    if width_mm > FLAT_WIDTHS * capillary_mm:
        return 2 * capillary_mm**2 / width_mm, capillary_mm * float(np.sqrt(2))

    def profile(curvature: float) -> tuple[Floats, Floats]:
        """Return the heights of the pieces of half the surface, and their lengths across the crack, (k,) each."""
        # phi = k l sinh(t): the same pieces suit a half circle and an edge far from a flat middle.
        scale = curvature * capillary_mm
        end = np.arcsinh(np.pi / 2 / scale)
        t = (NODES + 1) * end / 2
        phi = scale * np.sinh(t)
        root = np.sqrt(curvature**2 + 2 * (1 - np.cos(phi)) / capillary_mm**2)
        return capillary_mm**2 * (root - curvature), WEIGHTS * end / 2 * scale * np.cosh(t) * np.cos(phi) / root

    # Without gravity the curvature is 2 / width; gravity reduces it, up to exponentially with the width.
    low, high = np.log(2 / width_mm) - FLAT_WIDTHS, np.log(4 / width_mm)
    log_curvature: Any = brentq(lambda log: profile(np.exp(log))[1].sum() - width_mm / 2, low, high)
    curvature = float(np.exp(log_curvature))
    height_mm, across_mm = profile(curvature)
    wall_mm = capillary_mm**2 * (np.sqrt(curvature**2 + 2 / capillary_mm**2) - curvature)
    return float(height_mm @ across_mm) / (width_mm / 2), float(wall_mm)


def mean_level_mm(levels_mm: Floats, width_mm: float, capillary_mm: float) -> Floats:
    """Return the mean level for each level of the lowest line of the liquid's surface, (k,).

    Near the face, the edges of the crack pin the liquid, and its surface flattens. With the lowest line at the face
    (0), the surface is flat.
    """
    if capillary_mm == 0:
        return levels_mm
    mean_mm, wall_mm = raise_and_height_mm(width_mm, capillary_mm)
    return levels_mm + mean_mm * np.minimum(1.0, -levels_mm / wall_mm)
