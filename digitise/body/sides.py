"""Which wall of the crack a piece of its outline is: the left one, the right one, or at a tip something between."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from digitise.body.flat_ends import heading
from digitise.geometry.polyline import left_normals
from sealtwin.records import Floats, Outline

TURNOVER_DEG = 60.0
"""A tip's piece that faces farther sideways than this is all left or all right: most tips are sharper, and go over from
one wall to the other in their one corner."""


@dataclass(frozen=True)
class Sides:
    """What lies left of the centreline belongs to the left wall, also on a side crack or an island."""

    walk_mm: Floats
    """(n, 2): the centreline, run out straight past both ends."""
    tips: tuple["Tip", ...]

    def left_share(self, place_mm: Floats, outward: Floats) -> Floats:
        """1 on the left wall, 0 on the right one, (n,); ``outward`` points out of the crack, (n, 2)."""
        _, nearest = KDTree(self.walk_mm).query(place_mm)
        leftward = ((place_mm - self.walk_mm[nearest]) * left_normals(self.walk_mm)[nearest]).sum(axis=1)
        share = (leftward > 0).astype(float)
        for tip in self.tips:
            left_deg = tip.left_deg(outward)
            around = np.linalg.norm(place_mm - tip.place_mm, axis=1) < tip.reach_mm
            around &= np.abs(left_deg) < TURNOVER_DEG
            share[around] = 0.5 + left_deg[around] / (2 * TURNOVER_DEG)
        return share


@dataclass(frozen=True)
class Tip:
    """A closed end, where the walls go over into each other."""

    place_mm: Floats
    onward: Floats
    """Unit vector of the walk from s = 0 to the far end, here."""
    outward: Floats
    reach_mm: float

    def left_deg(self, direction: Floats) -> Floats:
        """Angle of each direction from straight out of the tip, positive towards the left of the walk, (n,)."""
        to_left = np.array([-self.onward[1], self.onward[0]])
        return np.degrees(np.arctan2(direction @ to_left, direction @ self.outward))


def sides(outline: Outline, run_out_mm: float) -> Sides:
    """``run_out_mm``: how far beyond the ends the outline's pieces may lie."""
    centre = outline.centreline_mm
    ahead = [heading(outline, number) for number in (0, 1)]
    tips = tuple(
        Tip(centre[-number], (1 if number else -1) * ahead[number], ahead[number], outline.mean_width_mm)
        for number in (0, 1)
        if outline.ends[number] == "closed"
    )
    beyond = np.arange(1.0, run_out_mm + 1.0)[:, None]
    walk_mm = np.vstack([centre[0] + beyond[::-1] * ahead[0], centre, centre[-1] + beyond * ahead[1]])
    return Sides(walk_mm, tips)
