"""Yield stress of a heap of paste at rest on a plate, in closed form.

In a heap at rest on a rough plate, the yield stress tau at the plate balances rho g h dh/dr, where h is the height and
r the distance from the middle. In a flat heap, this balance alone determines the radius (Roussel and Coussot 2005). A
higher heap was also stretched in all directions as it spread, and its yield stress also resists stretching. The thrust
rho g h^2 / 2 of a section is therefore reduced by sqrt(3) pi / 4 tau h. This factor is for equal stretching along and
around the heap. In the plane problem, the factor is pi / 2 (Nye 1951, Dubash et al. 2009). The heap is therefore higher
than without stretching, and the formula for flat heaps gives too high a yield stress: by a fifth if the height is 1/13
of the width.
"""

import math

import numpy as np

from sealtwin.core.records import Floats
from sealtwin.core.regime import GRAVITY_M_S2

STRETCH = math.sqrt(3) * math.pi / 4
"""Reduction of a section's thrust by stretching, divided by tau h. Stretching adds sqrt(3) tau, the von Mises limit
without shear, averaged over a depth in which the shear stress increases linearly to tau."""
HIGHEST = 0.43
"""Largest ratio of a heap's height to its radius for which the closed form is used. Up to this ratio, it was compared
with simulated slumps: the yield stress is 10 % too high at a ratio of 0.09, and 23 % too low at 0.42."""


def flat_stress_pa(volume_mm3: Floats | float, radius_mm: Floats | float, density_kg_m3: Floats | float) -> Floats:
    """Return the yield stress of a flat heap in Pa: 225 rho g V^2 / (128 pi^2 R^5) (Roussel and Coussot 2005).

    V is the volume and R the radius of the heap.
    """
    volume_m3, radius_m = np.asarray(volume_mm3) * 1e-9, np.asarray(radius_mm) * 1e-3
    return 225 * np.asarray(density_kg_m3) * GRAVITY_M_S2 * volume_m3**2 / (128 * np.pi**2 * radius_m**5)


def heap_height_mm(stress_pa: Floats, radius_mm: Floats | float, density_kg_m3: Floats | float) -> Floats:
    """Return the height of a flat heap in its middle, sqrt(2 tau R / (rho g)), in mm.

    tau is the yield stress and R the radius.
    """
    return np.sqrt(2e3 * stress_pa * np.asarray(radius_mm) / (np.asarray(density_kg_m3) * GRAVITY_M_S2))


def stretched_stress_pa(volume_mm3: Floats | float, radius_mm: Floats | float, density_kg_m3: Floats | float) -> Floats:
    """Return the yield stress of a heap with stretching in Pa, to first order in the ratio of height to radius.

    With w = rho g and c = STRETCH tau / w, the balance w h^2 / 2 - STRETCH tau h = tau (R - r) gives the height of the
    heap, h = c + sqrt(c^2 + 2 tau (R - r) / w). For c = 0 it is the flat heap.
    """
    flat = np.atleast_1d(flat_stress_pa(volume_mm3, radius_mm, density_kg_m3)).astype(float)
    volume, radius, density = np.broadcast_arrays(volume_mm3, radius_mm, density_kg_m3)
    stress = flat.copy()
    for _ in range(30):
        # The volume is about proportional to the root of the stress.
        stress = stress * (np.atleast_1d(volume) / _heap_mm3(stress, radius, density)) ** 1.5
    return stress if np.ndim(radius_mm) or np.ndim(volume_mm3) or np.ndim(density_kg_m3) else stress[0]


def _heap_mm3(stress_pa: Floats | float, radius_mm: Floats | float, density_kg_m3: Floats | float) -> Floats:
    """Return the volume of a heap in mm3: 2 pi times the integral of r h, in closed form.

    h is the height at the distance r from the middle. In the code, u = R - r, with the radius R.
    """
    per_mm = np.atleast_1d(np.asarray(stress_pa) / (np.asarray(density_kg_m3) * GRAVITY_M_S2)) * 1e3
    radius, edge = np.asarray(radius_mm), STRETCH * per_mm
    # With q = edge^2 + 2 per_mm u as the variable, the integral is of powers of its root.
    low, high = edge, np.sqrt(edge**2 + 2 * per_mm * radius)
    roots = (radius + edge**2 / (2 * per_mm)) * (high**3 - low**3) / (3 * per_mm)
    roots = roots - (high**5 - low**5) / (10 * per_mm**2)
    return 2 * np.pi * (edge * radius**2 / 2 + roots)
