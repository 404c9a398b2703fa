"""Cut the cavity into horizontal sections, to weigh a fill and to refuse walls that meet."""

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType

from digitise.geometry.region import pieces
from digitise.settings import AGAINST_EACH_OTHER, CrackShape
from digitise.solid.footprint import Footprint
from digitise.solid.wedges import Stretch, tilted_walls, wall_shifts_mm

ARC_SEGMENTS = 128  # Segments of a full turn of a rounded offset corner: 0.04 % of the corner's own area


class Slicer:
    """Horizontal sections of the cavity at any depth, inside the block. Cut ends are closed."""

    def __init__(self, footprint: Footprint, shape: CrackShape) -> None:
        self._footprint = footprint
        self._shape = shape
        self._shifts_mm = wall_shifts_mm(shape)
        self._stretches: list[Stretch] = []
        if shape.tilt in AGAINST_EACH_OTHER and self._shifts_mm[0] != self._shifts_mm[1]:
            self._stretches = tilted_walls(footprint, shape)

    def between_walls(self, depth_mm: float) -> CrossSection:
        """Return the region between the walls, above the floor or below it."""
        crack = self._moved(depth_mm / self._shape.deepest_mm)
        return (crack ^ self._footprint.block) - self._footprint.stoppers

    def cavity(self, depth_mm: float) -> CrossSection:
        """Return the region between the walls and above the floor."""
        section, floor = self.between_walls(depth_mm), self._footprint.floor
        return section if floor is None else section - floor.ground.slice(-depth_mm)

    def meets_below(self) -> bool:
        """Return whether parts of the crack meet below the face, which leaves a hanging stone or a bridge.

        A spike that ends above the floor is neither.
        """
        block = self._footprint.block
        face, floor = self.between_walls(0.0), self.between_walls(self._shape.deepest_mm)
        return not (_matched(block - face, block - floor) and _matched(floor, face))

    def _moved(self, share: float) -> CrossSection:
        crack, shift_mm = self._footprint.crack, self._shifts_mm[0]
        if self._shape.tilt == "vertical":
            return crack
        if self._shape.tilt == "lean":
            x, y = share * shift_mm * self._footprint.lean
            return crack.translate((float(x), float(y)))
        outward = self._shape.tilt != "funnel"
        share = 1 - share if self._shape.tilt == "flare" else share
        if share <= 0:
            return crack
        if self._stretches:
            # All have the same orientation, so overlaps add up.
            rings = [np.vstack([at, (at + share * (moved - at))[::-1]]) for at, moved in self._stretches]
            walls = CrossSection(rings, FillRule.NonZero)
            return crack + walls if outward else crack - walls
        return crack.offset(share * shift_mm * (1 if outward else -1), JoinType.Round, circular_segments=ARC_SEGMENTS)


def _matched(region: CrossSection, within: CrossSection) -> bool:
    """Return whether each piece of a region contains exactly one piece of a smaller one."""
    smaller = pieces(within)
    return all(sum(bool(pieces(piece ^ other)) for other in smaller) == 1 for piece in pieces(region))
