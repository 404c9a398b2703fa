"""Positions at which a crack is narrower than the sections of the fast model.

A section of that model is a mean over a cell. Necks and walls across the crack reduce the area, or increase the wall
length for the same area. They therefore resist the paste more. To find them, the crack is cut at shorter distances than
the cells. Stones and meshes are not searched: the model is not valid for them.
"""

from typing import NamedTuple

import numpy as np

from sealtwin.core.records import Floats, Outline, Solid
from simulate.slot.sections import Trapezoids, sections_of

CUTS = 8  # Number of cuts in each cell
RESISTANCE_TOLERANCE = 0.05  # Fraction by which a cell may resist more, equal to the allowed error of a trapezoid


class Narrows(NamedTuple):
    """Lengths of crack that are equivalent to its narrow positions.

    They are 0 if there are none, infinite if one is closed.
    """

    holds_mm: float  # Length of crack on which the yield stress resists as much as at the narrow positions
    drags_mm: float  # Length of crack that drags a liquid as much as the narrow positions do
    s_mm: float  # Arc length of the cell that adds most drag


def narrows(outline: Outline, solid: Solid, sections: Trapezoids, fill: float) -> Narrows:
    """Return the length of crack equivalent to the narrow positions of a crack filled to a fraction of its sections."""
    height_mm = sections.height_mm(min(fill, 1.0) * sections.full_mm2)
    own_mm2, own_wetted_mm = sections.area_mm2(height_mm)[0], sections.wetted_mm(height_mm)
    fine = sections_of(outline, solid, CUTS * len(height_mm), reach_per_mm=0.0)
    there_mm = np.maximum(np.repeat(_surface_mm(sections, height_mm), CUTS) - fine.bottom_mm, 0.0)
    area_mm2, wetted_mm = fine.area_mm2(np.minimum(there_mm, fine.depth_mm))[0], fine.wetted_mm(there_mm)
    opens, closed = area_mm2 > 0, np.full(len(area_mm2), np.inf)
    per_mm = np.divide(1.0, fine.holding_mm(area_mm2, wetted_mm), out=closed.copy(), where=opens)
    holds = np.repeat(sections.holding_mm(own_mm2, own_wetted_mm), CUTS) * per_mm
    drags = np.divide(holds**2 * np.repeat(own_mm2, CUTS), area_mm2, out=closed, where=opens)
    # The end cells do not count: at a closed tip the width goes to 0, and nothing flows farther.
    holds_mm, drags_mm = (
        sections.step_mm * np.maximum(more.reshape(-1, CUTS).mean(axis=1) - 1 - RESISTANCE_TOLERANCE, 0.0)[1:-1]
        for more in (holds, drags)
    )
    return Narrows(float(holds_mm.sum()), float(drags_mm.sum()), float(sections.s_mm[1:-1][drags_mm.argmax()]))


def _surface_mm(sections: Trapezoids, height_mm: Floats) -> Floats:
    """Return the highest level of each cell and its neighbours, (n,).

    A step in the floor is then not taken for a dam.
    """
    level_mm = np.pad(sections.bottom_mm + height_mm, 1, mode="edge")
    return np.max([level_mm[:-2], level_mm[1:-1], level_mm[2:]], axis=0)
