"""Compute upright sections of a cavity at the stations of its outline, and horizontal sections at any depth.

An upright section is bounded by two straight walls and a floor. Stones in it are subtracted. Horizontal sections give
the volume of a weighed fill, and detect walls that meet.
"""

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType
from scipy.spatial import KDTree
from skimage.measure import points_in_poly

from digitise.geometry.polyline import left_normals, resampled
from digitise.geometry.region import pieces
from digitise.settings import CrackShape
from digitise.solid.footprint import Footprint
from digitise.solid.wedges import tilted_walls, wall_shifts_mm
from sealtwin.core.records import Floats, Outline, Sections

SAMPLES = 256  # Samples of the line from wall to wall, for stones. A stone's side is right to 0.2 % of the width
UPRIGHT = 1e-9  # Smallest slope to divide by. It replaces the slope of an upright wall
STONE_STEP_MM = 0.05  # Spacing of points on a stone's side. Distances of 1 mm or more are right to 0.1 %
ARC_SEGMENTS = 128  # Segments per full turn of a rounded offset corner. Its area is right to 0.04 %


def crack_sections(outline: Outline, shape: CrackShape) -> Sections:
    """Return the sections at the outline's stations: areas between two straight walls and the floor, minus stones.

    Their integral along the crack is approximately the cavity's volume. It omits side cracks, the part around a tip,
    and the additional volume in a bend.
    """
    s_mm, width_mm = outline.s_mm, outline.width_mm
    depth_mm, closing = shape.depth_at_mm(s_mm), -_slopes(shape).sum()
    if shape.tilting.floor_traced:
        # The traced width is the width at the deepest level. A shallower floor is wider.
        mouth_mm, open_mm = width_mm + closing * shape.deepest_mm, depth_mm
    else:
        mouth_mm, open_mm = width_mm, np.minimum(depth_mm, width_mm / max(closing, UPRIGHT))
    area_mm2 = mouth_mm * open_mm - closing * open_mm**2 / 2
    return Sections(
        s_mm, depth_mm, area_mm2 - _stones_mm2(outline, depth_mm, shape) if outline.islands_mm else area_mm2
    )


def _slopes(shape: CrackShape) -> Floats:
    """Return by how many mm the left and the right wall widen the crack for each mm of depth, (2,)."""
    return np.tan(np.radians(shape.wall_angles_deg)) * shape.tilting.opens


def _stones_mm2(outline: Outline, depth_mm: Floats, shape: CrackShape) -> Floats:
    """Return the area in mm² that stones fill in each section, (n,).

    Stones narrow upward from the deepest level in a flare, and downward in an undercut. In a funnel they widen
    downward, also along the crack.
    """
    rings = [np.vstack([ring, ring[:1]]) for ring in outline.islands_mm]
    side_mm = np.vstack([resampled(ring, STONE_STEP_MM) for ring in rings])
    _, station = KDTree(outline.centreline_mm).query(side_mm)
    to_left = (side_mm - outline.centreline_mm[station]) * left_normals(outline.centreline_mm)[station]
    left, right = np.maximum(np.abs(_slopes(shape)), UPRIGHT)
    width_mm, share = outline.width_mm[:, None], (np.arange(SAMPLES) + 0.5) / SAMPLES
    across_mm = outline.right_wall_mm - outline.left_wall_mm
    place_mm = outline.left_wall_mm[:, None] + share[:, None] * across_mm[:, None]
    away_mm, nearest = KDTree(side_mm).query(place_mm)
    inside = np.any([points_in_poly(place_mm.reshape(-1, 2), ring) for ring in rings], axis=0).reshape(away_mm.shape)
    # Height over which the side of the nearest stone moves as far as the point is away from it.
    height_mm = away_mm / np.where(to_left.sum(axis=1) > 0, left, right)[nearest]
    if shape.tilting.away < 0:
        open_mm = np.minimum(depth_mm[:, None], np.minimum(share * width_mm / left, (1 - share) * width_mm / right))
        filled_mm = np.where(inside, open_mm, np.maximum(open_mm - height_mm, 0.0))
    else:
        below_mm = shape.deepest_mm - depth_mm if shape.tilting.floor_traced else np.zeros_like(depth_mm)
        filled_mm = np.where(inside, np.clip(height_mm - below_mm[:, None], 0.0, depth_mm[:, None]), 0.0)
    return outline.width_mm * filled_mm.mean(axis=1)


class Slicer:
    """Computes horizontal sections of the cavity inside the block at any depth. Cut ends are closed."""

    def __init__(self, footprint: Footprint, shape: CrackShape) -> None:
        self._footprint = footprint
        self._shape = shape
        self._shifts_mm = wall_shifts_mm(shape)
        left_mm, right_mm = self._shifts_mm
        self._stretches = tilted_walls(footprint, shape) if left_mm != right_mm else []

    def between_walls(self, depth_mm: float) -> CrossSection:
        """Return the region between the walls at a depth. The floor is ignored."""
        crack = self._moved(depth_mm / self._shape.deepest_mm)
        return (crack ^ self._footprint.block) - self._footprint.stoppers

    def cavity(self, depth_mm: float) -> CrossSection:
        """Return the region between the walls and above the floor at a depth."""
        section, floor = self.between_walls(depth_mm), self._footprint.floor
        return section if floor is None else section - floor.ground.slice(-depth_mm)

    def meets_below(self, face: CrossSection, floor: CrossSection) -> bool:
        """Return True if parts of the crack meet below the face, so that a stone hangs free or a bridge remains.

        ``face`` and ``floor`` are the sections between the walls at the face and at the deepest floor. A spike of
        material that ends above the floor is allowed.
        """
        block = self._footprint.block
        return not (_matched(block - face, block - floor) and _matched(floor, face))

    def _moved(self, share: float) -> CrossSection:
        crack, shift_mm, tilting = self._footprint.crack, self._shifts_mm[0], self._shape.tilting
        if tilting.lean:
            x, y = share * shift_mm * self._footprint.lean
            return crack.translate((x, y))
        share = 1 - share if tilting.floor_traced else share
        if share <= 0 or not tilting.away:
            return crack
        if self._stretches:
            # All rings have the same orientation, so overlapping rings are united.
            rings = [np.vstack([ring, (ring + share * (moved - ring))[::-1]]) for ring, moved in self._stretches]
            walls = CrossSection(rings, FillRule.NonZero)
            return crack + walls if tilting.away > 0 else crack - walls
        return crack.offset(share * shift_mm * tilting.away, JoinType.Round, circular_segments=ARC_SEGMENTS)


def _matched(region: CrossSection, within: CrossSection) -> bool:
    """Return True if each piece of a region overlaps exactly one piece of the region ``within``."""
    smaller = pieces(within)
    return all(sum(bool(pieces(piece ^ other)) for other in smaller) == 1 for piece in pieces(region))
