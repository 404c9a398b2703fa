"""Mound under the nozzle and crown across the crack: the paste supports both, and an averaged flow would spread them.

The sideways pressure of paste that is pulled apart is 2 tau less than its weight, that of paste that is pushed together
2 tau more (Rankine's limits of a plastic soil without friction). At the nozzle's last place both meet along the crack,
and levels differ by 4 tau / rho g. Across the crack paste that was laid along the middle is pulled apart, and its level
is 2 tau / rho g higher there than at the walls.
"""

import numpy as np

from sealtwin.core.records import Floats
from simulate.slot.sections import Trapezoids

MOUND, CROWN = 4.0, 2.0
"""Heights of a mound and of a crown, divided by tau / rho g."""
MOST = 0.5
"""Largest share of the sealant that is in a mound. In a short crack a larger mound would have no bed under it."""


def mound_mm2(
    sections: Trapezoids, landed_mm3: float, *, held_mm: float, middle_mm: float, nozzle_mm: float, surface_mm: float
) -> Floats:
    """Return the mound's area in each section, (n,), above a bed with its surface at ``surface_mm``.

    It moves with the nozzle and remains at its last place, ``middle_mm``. Its top is as wide as the nozzle; its flanks
    are those of a slump on its base, h dh/dx = tau / rho g, which is ``held_mm``.
    """
    aside_mm = np.maximum(np.abs(sections.s_mm - middle_mm) - nozzle_mm / 2, 0.0)
    rise_mm = np.sqrt(np.maximum((MOUND * held_mm) ** 2 - 2 * held_mm * aside_mm, 0.0))
    _, width_mm = sections.area_mm2(surface_mm - sections.bottom_mm)
    area_mm2 = rise_mm * width_mm
    total_mm3 = float(area_mm2.sum()) * sections.step_mm
    return area_mm2 * (min(1.0, MOST * landed_mm3 / total_mm3) if total_mm3 > 0 else 0.0)


def crown_mm(height_mm: Floats, depth_mm: Floats, held_mm: float) -> Floats:
    """Return the level in the middle of the crack minus the mean across it, (n,).

    It is a third of the height of a parabola, and at most the height of the bed. It is 0 if the bed reaches the face,
    because paste above the face slumps next to the mouth.
    """
    return np.clip(np.minimum(height_mm, depth_mm - height_mm), 0.0, CROWN * held_mm / 3)
