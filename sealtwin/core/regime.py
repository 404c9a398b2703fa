"""Compute the Reynolds, Bond and Bingham numbers of an injection, and the meniscus of a liquid in a crack.

The meniscus of a wetting liquid between upright walls balances weight and surface tension (Young-Laplace equation).
phi is the angle of the surface, z its height above its lowest line, k the curvature at the lowest line, l the capillary
length, and x the distance across the crack:

    z = l^2 (sqrt(k^2 + 2 (1 - cos phi) / l^2) - k),    dx / dphi = cos phi / sqrt(k^2 + 2 (1 - cos phi) / l^2)

At a wall, which the liquid wets, phi is a right angle. k follows from the width of the crack.
"""

from typing import Any, NamedTuple

import numpy as np

from sealtwin.core.records import Floats

GRAVITY_M_S2 = 9.81
SURFACE_TENSION_N_M = 0.072
"""Surface tension for the Bond number: water in air at 25 °C, since a paste's surface tension is rarely measured.

The simulation has no surface tension."""
FLAT_WIDTHS = 60.0  # Width of a crack, in capillary lengths, above which the middle of the surface is flat
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)


class Regime(NamedTuple):
    reynolds: float | None  # Ratio of inertia to viscosity in the nozzle. None for a fluid without viscosity
    bond: float  # Ratio of gravity to the surface tension of water, across the crack
    bingham: float | None  # Ratio of yield stress to viscous stress in the nozzle. None for a fluid without viscosity


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
    """Return the Reynolds, Bond and Bingham numbers of an injection.

    ``speed_mm_s`` is the speed of the sealant in the nozzle, ``nozzle_mm`` the nozzle's diameter and ``width_mm`` the
    crack's width. ``viscosity_m2_s`` is the viscosity at a shear rate of 1/s. The numbers use the viscosity at the
    shear rate ``speed_mm_s / nozzle_mm``, which differs if ``flow_index`` is not 1. Without a viscosity or a speed,
    only the Bond number is computed.
    """
    bond = density_kg_m3 * GRAVITY_M_S2 * (1e-3 * width_mm) ** 2 / SURFACE_TENSION_N_M
    if not viscosity_m2_s or speed_mm_s == 0:
        return Regime(None, bond, None)
    flowing_m2_s = viscosity_m2_s * (speed_mm_s / nozzle_mm) ** (flow_index - 1)
    reynolds = 1e-6 * speed_mm_s * nozzle_mm / flowing_m2_s
    viscous_pa = density_kg_m3 * flowing_m2_s * speed_mm_s / nozzle_mm
    return Regime(reynolds, bond, yield_stress_pa / viscous_pa)


def standing_stress_pa(density_kg_m3: float, width_mm: float) -> float:
    """Return the yield stress above which upright walls carry the weight of the paste between them: rho g w / 2.

    rho is the density, g gravity, and w the distance between the walls.
    """
    return density_kg_m3 * GRAVITY_M_S2 * 1e-3 * width_mm / 2


def capillary_length_mm(surface_tension_n_m: float, density_kg_m3: float) -> float:
    return 1e3 * float(np.sqrt(surface_tension_n_m / (density_kg_m3 * GRAVITY_M_S2)))


def raise_and_height_mm(width_mm: float, capillary_mm: float) -> tuple[float, float]:
    """Return the mean height of a meniscus and its height at the walls, both above its lowest line, in mm.

    For a narrow crack the mean is (1 - pi / 4) w / 2 and the height at the walls is w / 2, with w the width. For a wide
    crack they are 2 l^2 / w and sqrt(2) l, with l the capillary length. Without gravity, l is infinite.
    """
    from scipy.optimize import brentq

    if np.isinf(capillary_mm):
        return width_mm / 2 * (1 - np.pi / 4), width_mm / 2
    if width_mm > FLAT_WIDTHS * capillary_mm:
        return 2 * capillary_mm**2 / width_mm, capillary_mm * float(np.sqrt(2))

    def profile(curvature: float) -> tuple[Floats, Floats]:
        """Return the height of each piece of half the surface, and its length across the crack, (k,) each."""
        # With phi = k l sinh(t), the same nodes t resolve a half circle, and a steep edge beside a flat middle.
        scale = curvature * capillary_mm
        end = np.arcsinh(np.pi / 2 / scale)
        t = (NODES + 1) * end / 2
        phi = scale * np.sinh(t)
        root = np.sqrt(curvature**2 + 2 * (1 - np.cos(phi)) / capillary_mm**2)
        return capillary_mm**2 * (root - curvature), WEIGHTS * end / 2 * scale * np.cosh(t) * np.cos(phi) / root

    # Without gravity the curvature is 2 / width. Gravity reduces it, at most exponentially with the width.
    low, high = np.log(2 / width_mm) - FLAT_WIDTHS, np.log(4 / width_mm)
    log_curvature: Any = brentq(lambda log: profile(np.exp(log))[1].sum() - width_mm / 2, low, high)
    curvature = float(np.exp(log_curvature))
    height_mm, across_mm = profile(curvature)
    wall_mm = capillary_mm**2 * (np.sqrt(curvature**2 + 2 / capillary_mm**2) - curvature)
    return float(height_mm @ across_mm) / (width_mm / 2), float(wall_mm)


def mean_level_mm(levels_mm: Floats, width_mm: float, capillary_mm: float) -> Floats:
    """Return the mean level of a liquid for each level of its surface's lowest line, (k,).

    Near the face, the crack's edges hold the liquid and the surface becomes flatter. If the lowest line is at the face
    (level 0), the surface is flat.
    """
    if capillary_mm == 0:
        return levels_mm
    mean_mm, wall_mm = raise_and_height_mm(width_mm, capillary_mm)
    return levels_mm + mean_mm * np.minimum(1.0, -levels_mm / wall_mm)
