"""Estimate the yield stress of a bead of paste at rest on a plate, from its volume and its whole outline.

The thrust of paste at rest on a rough plate decreases towards the edge, as fast as the yield stress tau allows. The
height h of a flat heap then depends only on the distance d to the nearest edge: h^2 = 2 tau d / (rho g), where rho is
the density. This holds in a ridge, in its round ends and in a disc (Roussel and Coussot 2005). Stretching reduces the
thrust rho g h^2 / 2 of a section by STRETCH tau h (Nye 1951: pi / 2 in a plane). The middle line of the outline need
not be straight. The section in the middle follows from the heap at rest, without a model of the flow that laid it.
"""

import math
from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats

STRETCH = math.pi / 2
"""Reduction of a section's thrust by stretching in a plane, divided by tau h. Stretching adds 2 tau, Tresca's limit,
averaged over a depth in which the shear stress grows evenly to tau. In a disc the same average is 1.36."""


CLOSED_STRESS = (0.0315, 0.066, 0.105, 0.152)
STRESS_RATIO = (1.0, 1.052, 1.008, 0.925)
SECTION_RATIO = (0.908, 0.915, 0.923, 0.95)
"""Corrections of the closed form, from simulated bars of particles. ``STRESS_RATIO`` and ``SECTION_RATIO`` are the
stress and section by the closed form, divided by the stress and section of the bars. ``CLOSED_STRESS`` has the values
of tau / (rho g sqrt(A)) of these ratios, with the closed form's stress tau and section A. Each ratio is the geometric
mean of two bars: one as high as its filament, and one 1.6 times as wide. The ends of a bar spread and drain the middle
a little. How much depends on the height from which the bar was laid, which is not measured."""


@dataclass(frozen=True)
class PasteArea:
    """Area of the paste's footprint by distance from its edge, (m,), for all of it and for a piece in its middle.

    Distances are grouped in classes, and ``inward_mm`` is the middle of each class.
    """

    inward_mm: Floats
    area_mm2: Floats
    edge_mm: float  # Length of the edge
    middle_area_mm2: Floats
    middle_mm: float  # Length of the piece

    def volume_mm3(self, per_mm: Floats, scale: Floats, outward_mm: Floats, stretch: float) -> tuple[Floats, Floats]:
        """Return the volume of the heap in mm3, (n,), and the section in its middle in mm2, (n,).

        ``per_mm`` is tau / (rho g). Lengths are multiplied by ``scale``, and the edge is moved outward by
        ``outward_mm``. ``stretch`` is defined as ``STRETCH``.
        """
        height = heap_height_mm(per_mm, np.maximum(0.0, scale * self.inward_mm[:, None] + outward_mm), stretch)
        rim = outward_mm * heap_height_mm(per_mm, np.maximum(0.0, outward_mm / 2), stretch)
        volume = scale**2 * (self.area_mm2 @ height) + scale * self.edge_mm * rim
        return volume, scale * (self.middle_area_mm2 @ height) / self.middle_mm + 2 * rim

    def per_mm(self, volume_mm3: Floats, scale: Floats, outward_mm: Floats, stretch: float) -> Floats:
        """Return the tau / (rho g) at which heaps have the given volumes, (n,)."""
        per_mm = np.full(np.shape(volume_mm3), 1.0)
        for _ in range(14):
            # The volume grows about with the root of the stress, and at most in proportion to it.
            per_mm = per_mm * (volume_mm3 / self.volume_mm3(per_mm, scale, outward_mm, stretch)[0]) ** (4 / 3)
        return per_mm


def heap_height_mm(per_mm: Floats, inward_mm: Floats, stretch: float) -> Floats:
    """Return the height in mm of a heap at the distance ``inward_mm`` (d) from its edge: c + sqrt(c^2 + 2 k d).

    k is ``per_mm``, tau / (rho g), and c is stretch k.
    """
    return stretch * per_mm + np.sqrt((stretch * per_mm) ** 2 + 2 * per_mm * inward_mm)


def slumped_stress(per_mm: Floats, section_mm2: Floats) -> Floats:
    """Return tau / (rho g) of beads, (n,): the closed form's ``per_mm``, corrected to agree with simulated bars."""
    return per_mm / np.interp(per_mm / np.sqrt(section_mm2), CLOSED_STRESS, STRESS_RATIO)


def laid_section(per_mm: Floats, section_mm2: Floats) -> Floats:
    """Return the section of a bead as it was laid, in mm2, (n,).

    ``section_mm2`` is the closed form's section in the middle of the bead at rest.
    """
    return section_mm2 / np.interp(per_mm / np.sqrt(section_mm2), CLOSED_STRESS, SECTION_RATIO)
