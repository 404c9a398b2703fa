"""The yield stress of a bead of paste at rest on a plate, from its volume and its whole outline.

The thrust of paste at rest on a rough plate falls towards the edge at the rate that the yield stress allows. Its height
then depends on the distance d to the nearest edge: h^2 = 2 tau d / (rho g) if it is flat, in a ridge, in its round ends
and in a disc (Roussel and Coussot 2005). Stretching reduces the thrust rho g h^2 / 2 of a section by STRETCH tau h (Nye
1951: pi / 2 in a plane). The middle of the outline need not be straight. The section in the middle follows from the
heap at rest, without a model of the flow that laid it.
"""

import math
from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats

STRETCH = math.pi / 2
"""Reduction of a section's thrust by stretching, divided by tau h, in a plane. It is 2 tau, Tresca's limit, averaged
over a depth in which the shear stress grows evenly to tau. In a disc the same averaging gives 1.36."""


CLOSED_STRESS = (0.0315, 0.066, 0.105, 0.152)
STRESS_RATIO = (1.0, 1.052, 1.008, 0.925)
SECTION_RATIO = (0.908, 0.915, 0.923, 0.95)
"""Ratios of stress and of section, closed form over bars in particles, at values of the closed form's stress over rho g
sqrt(A) (``CLOSED_STRESS``). They are geometric means of a bar as high as its filament and one 1.6 times as wide.
The ends spread and drain the middle a little, which depends on the height from
which they were laid. That height is not measured."""


@dataclass(frozen=True)
class PasteArea:
    """Area of the paste's footprint in classes of distance from its edge, (m,): of all, and of a piece in its middle.

    ``inward_mm`` is the middle of each class.
    """

    inward_mm: Floats
    area_mm2: Floats
    edge_mm: float  # Length of the edge
    middle_area_mm2: Floats
    middle_mm: float  # Length of the piece

    def volume_mm3(self, per_mm: Floats, scale: Floats, outward_mm: Floats, stretch: float) -> tuple[Floats, Floats]:
        """Return the volume of the heap and the section in its middle, in mm3 and mm2, (n,) each.

        ``per_mm`` is tau / (rho g). Lengths are multiplied by ``scale``; the edge is moved out by ``outward_mm``.
        """
        height = heap_height_mm(per_mm, np.maximum(0.0, scale * self.inward_mm[:, None] + outward_mm), stretch)
        rim = outward_mm * heap_height_mm(per_mm, np.maximum(0.0, outward_mm / 2), stretch)
        volume = scale**2 * (self.area_mm2 @ height) + scale * self.edge_mm * rim
        return volume, scale * (self.middle_area_mm2 @ height) / self.middle_mm + 2 * rim

    def per_mm(self, volume_mm3: Floats, scale: Floats, outward_mm: Floats, stretch: float) -> Floats:
        """Return tau / (rho g) of heaps with a given volume, (n,)."""
        per_mm = np.full(np.shape(volume_mm3), 1.0)
        for _ in range(14):
            # The volume grows about with the root of the stress, and at most in proportion to it.
            per_mm = per_mm * (volume_mm3 / self.volume_mm3(per_mm, scale, outward_mm, stretch)[0]) ** (4 / 3)
        return per_mm


def heap_height_mm(per_mm: Floats, inward_mm: Floats, stretch: float) -> Floats:
    """Return c + sqrt(c^2 + 2 k d) with k = tau / (rho g) and c = stretch k."""
    return stretch * per_mm + np.sqrt((stretch * per_mm) ** 2 + 2 * per_mm * inward_mm)


def slumped_stress(per_mm: Floats, section_mm2: Floats) -> Floats:
    """Return tau / (rho g) of beads, (n,): that of the closed form, corrected to agree with bars in particles."""
    return per_mm / np.interp(per_mm / np.sqrt(section_mm2), CLOSED_STRESS, STRESS_RATIO)


def laid_section(per_mm: Floats, section_mm2: Floats) -> Floats:
    """Return the section that was laid, in mm2, (n,). ``section_mm2`` is that of the closed form in the middle."""
    return section_mm2 / np.interp(per_mm / np.sqrt(section_mm2), CLOSED_STRESS, SECTION_RATIO)
