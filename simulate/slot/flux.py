"""The flow of a Herschel-Bulkley paste through a section, driven by the push along the crack."""

from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats, Integers
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

    @property
    def weight_pa_mm(self) -> float:
        """Hydrostatic pressure per millimetre of depth."""
        return 1e-3 * self.density_kg_m3 * GRAVITY_M_S2


@dataclass(frozen=True)
class Conduits:
    """The faces between cells as conduits, (k,). They give the flow through each face for its push.

    It is the flow of a Bingham or Herschel-Bulkley paste between plates. Two radii of the section replace half the gap:
    one for its yield stress, one for its viscous flow.
    """

    area_mm2: Floats
    threshold: Floats
    """Push above which the paste flows, in Pa/mm."""
    rate: Floats
    """Mean speed without a yield stress, divided by the push to the power 1/n."""
    power: float

    def flow_mm3_s(self, push: Floats) -> tuple[Floats, Floats]:
        """Return the flow for each push in Pa/mm, of either sign, and its derivative.

        The derivative is continuous and at least 0.
        """
        size = np.abs(push)
        m = self.power
        moves = size > self.threshold
        safe = np.where(moves, size, 1.0)
        plug = np.where(moves, self.threshold / safe, 1.0)
        sheared, shape = (1 - plug) ** m, 1 + plug / (m + 1)
        free = self.area_mm2 * self.rate * safe ** (m - 1)
        share = sheared * (1 - plug) * shape
        steeper = plug * sheared * ((m + 1) * shape - (1 - plug) / (m + 1))
        return np.sign(push) * free * safe * share, free * (m * share + steeper)


def conduits(
    paste: HerschelBulkley, sections: Trapezoids, area_mm2: Floats, height_mm: Floats, at: Integers
) -> Conduits:
    """Return conduits with the sections ``at``, (k,), which are filled to ``area_mm2`` and ``height_mm``, (n,) each."""
    wetted_mm = sections.wetted_mm(height_mm)
    # The mean pressure on the walls is half of that at the floor.
    pressure_pa = paste.weight_pa_mm * np.maximum(height_mm, 0.0) * (1 + sections.floor_mm / wetted_mm) / 2
    holds_pa = paste.wall_share * paste.yield_stress_pa + paste.friction * pressure_pa
    with np.errstate(divide="ignore", invalid="ignore"):
        threshold = np.where(area_mm2 > 0, holds_pa / sections.holding_mm(area_mm2, wetted_mm), np.inf)
    m = 1 / paste.flow_index
    radius_mm = area_mm2 / wetted_mm * np.sqrt(_rounder(sections.slenderness(area_mm2, height_mm)))
    rate = radius_mm ** (m + 1) / (m + 2) / (paste.wall_share * paste.consistency_pa_s_n) ** m
    return Conduits(area_mm2[at], threshold[at], rate[at], m)


def _rounder(side_by_side: Floats) -> Floats:
    """Return the viscous flow through a rectangular duct, divided by that between plates.

    The plates have the same ratio of area to perimeter.
    """
    return 1 / np.polynomial.polynomial.polyval(side_by_side, DUCT)
