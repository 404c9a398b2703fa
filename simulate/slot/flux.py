"""The flow of a Herschel-Bulkley paste through a section, driven by the push along the crack."""

from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats, Integers
from simulate.shear_law import Law, PlaneFlow, flow_between_plates
from simulate.slot.sections import Trapezoids

DUCT = (1.0, -1.3553, 1.9467, -1.7012, 0.9564, -0.2537)
"""Coefficients of a polynomial in short side over long side. It gives the friction of rectangular ducts divided by that
of plates (Shah and London 1978)."""


GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class HerschelBulkley:
    """Paste with the stress tau + K gamma^n. Particles add a share of the pressure to it."""

    density_kg_m3: float
    yield_stress_pa: float
    consistency_pa_s_n: float
    flow_index: float = 1.0
    friction: float = 0.0
    """Share of the pressure that resists shear, as it does between grains. It is 0 for paste."""
    wall_share: float = 1.0
    """Stress at a wall over the paste's own."""
    law: Law = Law.HERSCHEL_BULKLEY

    @property
    def weight_pa_mm(self) -> float:
        """Hydrostatic pressure per millimetre of depth."""
        return 1e-3 * self.density_kg_m3 * GRAVITY_M_S2


def conduits(
    paste: HerschelBulkley, sections: Trapezoids, area_mm2: Floats, height_mm: Floats, at: Integers
) -> PlaneFlow:
    """Return the flow through sections ``at``, (k,), which are filled to ``area_mm2`` and ``height_mm``, (n,) each.

    It is that between plates, with two radii of the section in place of half the gap: one for its yield stress, one for
    its viscous flow.
    """
    wetted_mm = sections.wetted_mm(height_mm)
    # The mean pressure on the walls is half of that at the floor.
    pressure_pa = paste.weight_pa_mm * np.maximum(height_mm, 0.0) * (1 + sections.floor_mm / wetted_mm) / 2
    holds_pa = paste.wall_share * paste.yield_stress_pa + paste.friction * pressure_pa
    with np.errstate(divide="ignore", invalid="ignore"):
        threshold = np.where(area_mm2 > 0, holds_pa / sections.holding_mm(area_mm2, wetted_mm), np.inf)
    radius_mm = area_mm2 / wetted_mm * np.sqrt(_rounder(sections.slenderness(area_mm2, height_mm)))
    viscosity = paste.wall_share * paste.consistency_pa_s_n
    return flow_between_plates(paste.law, threshold[at], radius_mm[at], viscosity, paste.flow_index, area_mm2[at])


def _rounder(side_by_side: Floats) -> Floats:
    """Return the viscous flow through a rectangular duct, divided by that between plates.

    The plates have the same ratio of area to perimeter.
    """
    return 1 / np.polynomial.polynomial.polyval(side_by_side, DUCT)
