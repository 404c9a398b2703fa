"""Compute the sections at the stations of an outline: two straight walls and a floor, less stones."""

import numpy as np
from scipy.spatial import KDTree
from skimage.measure import points_in_poly

from digitise.geometry.polyline import left_normals, resampled
from digitise.settings import AGAINST_EACH_OTHER, CrackShape
from sealtwin.core.records import Floats, Outline, Sections

SAMPLES = 256  # Samples of the line from wall to wall among stones: a stone's side is placed within 0.2 % of the width
UPRIGHT = 1e-9  # Least slope in a division, used for an upright wall
STONE_STEP_MM = 0.05  # Spacing of points on a stone's side, accurate to a thousandth from 1 mm away


def crack_sections(outline: Outline, shape: CrackShape) -> Sections:
    """Return the sections at the outline's stations: two straight walls from the face to the floor, less stones.

    Their sum over the arc is the cavity without side cracks, the part around a tip and the excess of a bend.
    """
    s_mm, width_mm = outline.s_mm, outline.width_mm
    depth_mm, closing = shape.depth_at_mm(s_mm), float(_slopes(shape).sum())
    if shape.tilt == "undercut":
        closing = -closing
    if shape.tilt == "flare":
        # The traced width is that at the deepest level; a shallower floor is wider.
        mouth_mm, open_mm = width_mm + closing * shape.deepest_mm, depth_mm
    else:
        mouth_mm, open_mm = width_mm, np.minimum(depth_mm, width_mm / max(closing, UPRIGHT))
    area_mm2 = mouth_mm * open_mm - closing * open_mm**2 / 2
    return Sections(
        s_mm, depth_mm, area_mm2 - _stones_mm2(outline, depth_mm, shape) if outline.islands_mm else area_mm2
    )


def _slopes(shape: CrackShape) -> Floats:
    """Return how far the left wall and the right one move sideways for each millimetre of depth."""
    return np.tan(np.radians(shape.wall_angles_deg)) * (shape.tilt in AGAINST_EACH_OTHER)


def _stones_mm2(outline: Outline, depth_mm: Floats, shape: CrackShape) -> Floats:
    """Return the area of each section that stones fill, (n,).

    Stones in a flare narrow upward from the deepest level, those in an undercut downward; those in a funnel grow
    downward, also beyond their own ends.
    """
    rings = [np.vstack([ring, ring[:1]]) for ring in outline.islands_mm]
    side_mm = np.vstack([resampled(ring, STONE_STEP_MM) for ring in rings])
    _, station = KDTree(outline.centreline_mm).query(side_mm)
    to_left = (side_mm - outline.centreline_mm[station]) * left_normals(outline.centreline_mm)[station]
    left, right = np.maximum(_slopes(shape), UPRIGHT)
    width_mm, share = outline.width_mm[:, None], (np.arange(SAMPLES) + 0.5) / SAMPLES
    across_mm = outline.right_wall_mm - outline.left_wall_mm
    place_mm = outline.left_wall_mm[:, None] + share[:, None] * across_mm[:, None]
    away_mm, nearest = KDTree(side_mm).query(place_mm)
    inside = np.any([points_in_poly(place_mm.reshape(-1, 2), ring) for ring in rings], axis=0).reshape(away_mm.shape)
    # Height over which the side of the nearest stone moves by the distance from it.
    height_mm = away_mm / np.where(to_left.sum(axis=1) > 0, left, right)[nearest]
    if shape.tilt == "funnel":
        open_mm = np.minimum(depth_mm[:, None], np.minimum(share * width_mm / left, (1 - share) * width_mm / right))
        filled_mm = np.where(inside, open_mm, np.maximum(open_mm - height_mm, 0.0))
    else:
        below_mm = shape.deepest_mm - depth_mm if shape.tilt == "flare" else np.zeros_like(depth_mm)
        filled_mm = np.where(inside, np.clip(height_mm - below_mm[:, None], 0.0, depth_mm[:, None]), 0.0)
    return outline.width_mm * filled_mm.mean(axis=1)
