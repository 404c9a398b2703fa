"""Compute the sections at the stations of an outline: two straight walls and a floor, less stones."""

import numpy as np
from scipy.spatial import KDTree

from digitise.geometry.polyline import at_arc_length, left_normals
from digitise.settings import AGAINST_EACH_OTHER, CrackShape
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Outline, Sections

SAMPLES = 32  # Samples of the line across a gap between walls: 0.01 % of a cavity among stones. With 8 it is 0.1 %.
UPRIGHT = 1e-9  # Least slope in a division, used for an upright wall
STONE_STEP_MM = 0.05  # Spacing of points on a stone's side, accurate to a thousandth from 1 mm away


def crack_sections(outline: Outline, shape: CrackShape) -> Sections:
    """Return the sections at the outline's stations: two straight walls from the face to the floor, less stones.

    Their sum over the arc is the cavity without side cracks, the part around a tip and the excess of a bend.
    """
    s_mm = outline.s_mm
    depth_mm, width_mm = shape.depth_at_mm(s_mm), outline.width_mm
    area_mm2 = _area_mm2(width_mm, depth_mm, sum(_slopes(shape)), shape)
    stones = _stones(outline)
    for station, edges_mm in stones.items():
        section = width_mm[station], depth_mm[station], area_mm2[station]
        area_mm2[station] = _among_stones_mm2(edges_mm, *section, shape)
    if shape.tilt == "funnel" and outline.islands_mm:
        area_mm2 -= _beyond_stones_mm2(outline, depth_mm, stones, shape)
    return Sections(s_mm, depth_mm, area_mm2)


def _area_mm2(width_mm: Floats, depth_mm: Floats | float, closing: Floats | float, shape: CrackShape) -> Floats:
    """Return the area of sections, (n,); ``closing`` is the width that they lose for each millimetre down."""
    if shape.tilt == "flare":
        # The traced width is that at the deepest level; a shallower floor is wider.
        mouth_mm, open_mm = width_mm + closing * shape.deepest_mm, depth_mm
    else:
        mouth_mm, open_mm = width_mm, np.minimum(depth_mm, width_mm / np.maximum(closing, UPRIGHT))
    return mouth_mm * open_mm - closing * open_mm**2 / 2


def _slopes(shape: CrackShape) -> tuple[float, float]:
    """Return the inward slope of the left wall and of the right one, in mm for each millimetre down."""
    left, right = np.tan(np.radians(shape.wall_angles_deg)) if shape.tilt in AGAINST_EACH_OTHER else (0.0, 0.0)
    inward = -1.0 if shape.tilt == "undercut" else 1.0
    return inward * float(left), inward * float(right)


def _slopes_across(edges_mm: Floats, width_mm: float, shape: CrackShape) -> Floats:
    """Return the slopes of walls at distances ``edges_mm`` from the left wall. The centreline is half way across."""
    left, right = _slopes(shape)
    return np.where(edges_mm < width_mm / 2, left, right)


def _among_stones_mm2(edges_mm: Floats, width_mm: float, depth_mm: float, whole_mm2: float, shape: CrackShape) -> float:
    """Return the area of a section less its stones. ``edges_mm`` are the stones' sides from the left wall, in pairs."""
    if shape.tilt == "funnel":
        edges_mm = np.concatenate([[0.0], edges_mm, [width_mm]])
    closing = _slopes_across(edges_mm, width_mm, shape).reshape(-1, 2).sum(axis=1)
    if shape.tilt == "funnel":
        return float(_area_mm2(np.diff(edges_mm)[::2].clip(min=0.0), depth_mm, closing, shape).sum())
    stone_mm = np.diff(edges_mm)[::2]
    # A stone in a flare narrows upward from the deepest level, and may end below the face; one in an undercut narrows
    # downward and reaches the floor, or the solid is refused.
    closing = np.abs(closing)
    low_mm = shape.deepest_mm - depth_mm if shape.tilt == "flare" else 0.0
    high_mm = np.minimum(low_mm + depth_mm, stone_mm / np.maximum(closing, UPRIGHT))
    height_mm = np.maximum(high_mm - low_mm, 0.0)
    return float(whole_mm2 - (height_mm * (stone_mm - closing * (low_mm + height_mm / 2))).sum())


def _beyond_stones_mm2(outline: Outline, depth_mm: Floats, stones: dict[int, Floats], shape: CrackShape) -> Floats:
    """Return the area of a funnel's sections that stones, which grow downward, fill beyond their own ends, (n,)."""
    width_mm = outline.width_mm
    edges_mm = [np.concatenate([[0.0], stones.get(i, []), [width_mm[i]]]) for i in range(len(width_mm))]
    station = np.repeat(np.arange(len(edges_mm)), [len(edges) // 2 for edges in edges_mm])
    start_mm, end_mm = np.concatenate(edges_mm).reshape(-1, 2).T
    slopes = [_slopes_across(edges, width, shape) for edges, width in zip(edges_mm, width_mm, strict=True)]
    start_slope, end_slope = np.maximum(np.concatenate(slopes).reshape(-1, 2).T, UPRIGHT)[..., None]
    gap_mm = (end_mm - start_mm).clip(min=0.0)
    from_start_mm = gap_mm[:, None] * (np.arange(SAMPLES) + 0.5) / SAMPLES
    own_mm = np.minimum(from_start_mm / start_slope, (gap_mm[:, None] - from_start_mm) / end_slope)
    across = (outline.right_wall_mm - outline.left_wall_mm) / np.maximum(width_mm, 1e-9)[:, None]
    place_mm = (
        outline.left_wall_mm[station, None] + (start_mm[:, None] + from_start_mm)[..., None] * across[station, None]
    )
    stone_mm, stone_slope = _stone_sides(outline, shape)
    away_mm, nearest = KDTree(stone_mm).query(place_mm)
    open_mm = np.minimum(depth_mm[station, None], own_mm)
    closed_mm = np.maximum(open_mm - away_mm / np.maximum(stone_slope[nearest], UPRIGHT), 0.0)
    closed_mm2 = np.bincount(station, gap_mm * closed_mm.mean(axis=1), minlength=len(edges_mm))
    return np.asarray(closed_mm2, dtype=float)


def _stone_sides(outline: Outline, shape: CrackShape) -> tuple[Floats, Floats]:
    """Return points on the sides of all stones, (m, 2), and the outward slope of each, (m,)."""
    rings = [np.vstack([ring, ring[:1]]) for ring in outline.islands_mm]
    points_mm = np.vstack(
        [at_arc_length(ring, (s_mm := arc_length(ring)), np.arange(0.0, s_mm[-1], STONE_STEP_MM)) for ring in rings]
    )
    _, nearest = KDTree(outline.centreline_mm).query(points_mm)
    to_left = ((points_mm - outline.centreline_mm[nearest]) * left_normals(outline.centreline_mm)[nearest]).sum(axis=1)
    left, right = _slopes(shape)
    return points_mm, np.where(to_left > 0, left, right)


def _stones(outline: Outline) -> dict[int, Floats]:
    """Return, by station, the distances from the left wall at which its line enters and leaves stones, (2 k,), mm."""
    edges_mm: dict[int, list[float]] = {}
    across = outline.right_wall_mm - outline.left_wall_mm
    for ring in outline.islands_mm:
        step = np.roll(ring, -1, axis=0) - ring
        # The crossing of a station's line with that of an edge, as shares of both: (stations, edges).
        gap = ring[None] - outline.left_wall_mm[:, None]
        turn = across[:, None, 0] * step[None, :, 1] - across[:, None, 1] * step[None, :, 0]
        turn = np.where(turn == 0, np.nan, turn)
        own = (gap[..., 0] * step[None, :, 1] - gap[..., 1] * step[None, :, 0]) / turn
        other = (gap[..., 0] * across[:, None, 1] - gap[..., 1] * across[:, None, 0]) / turn
        hit = (own >= 0) & (own <= 1) & (other >= 0) & (other < 1)
        for station in np.flatnonzero(hit.sum(axis=1) % 2 == 0):
            length_mm = float(np.linalg.norm(across[station]))
            edges_mm.setdefault(int(station), []).extend((length_mm * own[station, hit[station]]).tolist())
    return {station: np.sort(edges) for station, edges in edges_mm.items() if edges}
