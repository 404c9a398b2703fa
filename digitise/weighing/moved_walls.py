"""Copies of a crack with walls or floor shifted, to fit a weighed fill or by their standard uncertainty."""

from dataclasses import replace

import numpy as np

from digitise.geometry.polyline import uncrossed, without_repeats
from digitise.settings import CrackShape, DepthTable
from sealtwin.core.records import Outline
from sealtwin.core.solid_figures import WeighedCavity

SAME_POINT_MM = 1e-6  # Largest distance between two walls that count as one point, as at a tip


def widened(outline: Outline, by_mm: float) -> Outline:
    """Return the outline, widened by ``by_mm`` on average. All widths change in proportion, so tips and ends stay."""
    if not by_mm:
        return outline
    apart = walls_apart(outline, by_mm / outline.mean_width_mm)
    ring_mm = np.vstack([apart.right_wall_mm, apart.left_wall_mm[::-1]])
    return replace(apart, outline_mm=without_repeats(uncrossed(ring_mm), SAME_POINT_MM))


def walls_apart(outline: Outline, share: float) -> Outline:
    """Return the outline with its walls widened by a share.

    The ring around the crack, which takes longer, is unchanged.
    """
    apart = (outline.left_wall_mm - outline.right_wall_mm) * share / 2
    return replace(outline, left_wall_mm=outline.left_wall_mm + apart, right_wall_mm=outline.right_wall_mm - apart)


def moved_depth(depth_mm: float | DepthTable, by_mm: float) -> float | DepthTable:
    """Return the depth, or each depth of a table, increased by ``by_mm``."""
    if isinstance(depth_mm, tuple):
        return tuple((s_mm, one_mm + by_mm) for s_mm, one_mm in depth_mm)
    return depth_mm + by_mm


def shape_by_weight(shape: CrackShape, weighed: WeighedCavity) -> CrackShape:
    """Return the shape with the depth and the wall angle that follow from the weighed fill. Its ``fill`` is None."""
    depth_mm = moved_depth(shape.depth_mm, weighed.depth_mm - shape.deepest_mm)
    angle = {"wall_angle_deg": weighed.wall_angle_deg} if shape.tilting.opens else {}
    return shape.model_copy(update={"depth_mm": depth_mm, "fill": None, **angle})
