"""Laws of shear flow on the host: the viscosity at a shear rate, and the flow between two plates.

Each law is a member of ``Law``. To add a law:

- Add its viscosity and its power at rest to this module, and its viscosity on the device to ``apparent_weight`` in
  ``kernels.viscosity``.
- Add the setting that selects it to ``settings.LAWS``, which all code that replaces, draws or calibrates a law reads.
- For the fast model, add it to ``FLOW_BETWEEN_PLATES`` and its settings to ``settings.FAST_READS``. Other laws are
  refused.
- For a measured paste, add it to ``material_file.KEY_OF_LAW``.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from sealtwin.core.records import Floats


class Law(IntEnum):
    """Laws that give the stress as a function of the shear rate gamma. The device code uses the same numbers."""

    BINGHAM = 0
    """Bingham: stress tau + mu gamma, with yield stress tau and plastic viscosity mu."""
    HERSCHEL_BULKLEY = 1
    """Herschel-Bulkley: stress tau + K gamma^n, with yield stress tau, consistency K and flow index n."""


def apparent_viscosity(
    law: Law, viscosity: Floats | float, stress: Floats | float, shear_per_s: float, flow_index: float
) -> Floats | float:
    """Return the apparent viscosity, stress divided by shear rate.

    ``viscosity`` is the viscosity (Bingham) or the consistency at a shear rate of 1/s, and ``stress`` is the yield
    stress. Units are Pa s and Pa, or both divided by the density.
    """
    match law:
        case Law.BINGHAM:
            return viscosity + stress / shear_per_s
        case Law.HERSCHEL_BULKLEY:
            return viscosity * shear_per_s ** (flow_index - 1) + stress / shear_per_s


def power_at_rest(law: Law, flow_index: float) -> float:
    """Return the power of the shear rate in the stress above the yield stress, for a flow that comes to rest."""
    match law:
        case Law.BINGHAM:
            return 1.0
        case Law.HERSCHEL_BULKLEY:
            return flow_index


@dataclass(frozen=True)
class PlaneFlow:
    """Flow of Bingham or Herschel-Bulkley paste between plates, as a function of the pressure gradient in Pa/mm, (k,).

    The paste in the middle moves as a plug. The equations are from Bird, Armstrong and Hassager 1987, table 4.2-1.
    """

    threshold: Floats
    """Pressure gradient above which the paste flows, in Pa/mm, (k,)."""
    rate: Floats
    """Flow without a yield stress, divided by the pressure gradient to the power 1/n, (k,). n is the flow index."""
    power: float
    """The power 1/n, where n is the flow index."""

    def flow_mm3_s(self, push: Floats) -> tuple[Floats, Floats]:
        """Return the flow in mm3/s for each pressure gradient ``push``, and the derivative of the flow, (k,) each.

        The gradient may be negative. The derivative with respect to it is continuous and at least 0.
        """
        size = np.abs(push)
        m = self.power
        moves = size > self.threshold
        safe = np.where(moves, size, 1.0)
        plug = np.where(moves, self.threshold / safe, 1.0)
        sheared, shape = (1 - plug) ** m, 1 + plug / (m + 1)
        free = self.rate * safe ** (m - 1)
        share = sheared * (1 - plug) * shape
        steeper = plug * sheared * ((m + 1) * shape - (1 - plug) / (m + 1))
        return np.sign(push) * free * safe * share, free * (m * share + steeper)


FLOW_BETWEEN_PLATES = {Law.BINGHAM: PlaneFlow, Law.HERSCHEL_BULKLEY: PlaneFlow}


def flow_between_plates(
    law: Law,
    threshold: Floats,
    half_gap_mm: Floats | float,
    viscosity: Floats | float,
    flow_index: float,
    area_mm2: Floats | float = 1.0,
) -> PlaneFlow:
    """Return the flow of paste between plates through an area. With an area of 1 mm2, the flow is the mean speed.

    ``threshold`` is the pressure gradient above which the paste flows, in Pa/mm. ``viscosity`` is defined as in
    ``apparent_viscosity``. The threshold includes the particles' friction, which is right only for a law in which yield
    stress and viscous stress are added. Raises KeyError for a law that is not in ``FLOW_BETWEEN_PLATES``.
    """
    m = 1 / flow_index
    return FLOW_BETWEEN_PLATES[law](threshold, area_mm2 * (half_gap_mm ** (m + 1) / (m + 2) / viscosity**m), m)
