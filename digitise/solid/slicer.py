"""Cut the cavity into horizontal sections, to weigh a fill and to refuse walls that meet or leave the block."""

from collections.abc import Callable

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType

from digitise.geometry.region import pieces
from digitise.settings import AGAINST_EACH_OTHER, CrackShape
from digitise.solid.footprint import Footprint
from digitise.solid.wedges import Stretch, tilted_walls, wall_shifts_mm

LEVELS = 8  # Sections of an undercut between floor and face that are tried for one that fits
HALVINGS = 10  # Halvings of the interval between the one that fits and the next
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

    @property
    def block(self) -> CrossSection:
        return self._footprint.block

    def between_walls(self, depth_mm: float) -> CrossSection:
        """Return the region between the walls, above the floor or below it."""
        crack = self._moved(depth_mm / self._shape.deepest_mm)
        return (crack ^ self._footprint.block) - self._footprint.stoppers

    def cavity(self, depth_mm: float) -> CrossSection:
        """Return the region between the walls and above the floor."""
        section, floor = self.between_walls(depth_mm), self._footprint.floor
        return section if floor is None else section - floor.ground.slice(-depth_mm)

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


def meeting_share(slicer: Slicer, shape: CrackShape) -> float | None:
    """Return the largest share of an undercut's move that keeps its parts apart below the face; None if all of it does.

    Parts that meet leave a hanging stone, or a bridge over the crack. A spike that ends above the floor is neither.
    """
    face = slicer.between_walls(0.0)

    def meets(share: float) -> bool:
        crack = slicer.between_walls(share * shape.deepest_mm)
        return not (_matched(slicer.block - face, slicer.block - crack) and _matched(crack, face))

    return largest_share(meets)


def _matched(region: CrossSection, within: CrossSection) -> bool:
    """Return whether each piece of a region contains exactly one piece of a smaller one."""
    smaller = pieces(within)
    return all(sum(bool(pieces(piece ^ other)) for other in smaller) == 1 for piece in pieces(region))


def largest_share(fails: Callable[[float], bool]) -> float | None:
    """Return the largest share of the walls' move that does not fail, to 1/8192. None if all of it does not fail."""
    if not fails(1.0):
        return None
    low = next((level for level in range(LEVELS - 1, 0, -1) if not fails(level / LEVELS)), 0)
    low, high = low / LEVELS, (low + 1) / LEVELS
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if fails(middle) else (middle, high)
    return low
