"""The cavity's section square to the centreline, station by station, in closed form."""

import numpy as np

from digitise.settings import CrackShape
from sealtwin.records import Floats, Outline, Sections


def crack_sections(outline: Outline, shape: CrackShape) -> Sections:
    """At the outline's stations: between two straight walls, from the face to the floor, less the stones between them.

    Summed over the arc they are the cavity, less side cracks, what a flare adds around a tip, and what a bend gives
    its outer wall more than its inner one.
    """
    s_mm = outline.s_mm
    depth_mm, width_mm = shape.depth_at_mm(s_mm), outline.width_mm
    area_mm2 = section_area_mm2(width_mm, depth_mm, shape)
    for station, edges_mm in _stones(outline).items():
        area_mm2[station] = _among_stones_mm2(edges_mm, width_mm[station], depth_mm[station], shape)
    return Sections(s_mm, depth_mm, area_mm2)


def section_area_mm2(width_mm: Floats, depth_mm: Floats, shape: CrackShape) -> Floats:
    """Of sections as wide as traced ``width_mm`` and as deep as ``depth_mm``, (n,) each."""
    closing = _closing(shape)
    if shape.tilt == "flare":
        # The traced width is that at the deepest level; a shallower floor is wider.
        mouth_mm, open_mm = width_mm + closing * shape.deepest_mm, depth_mm
    else:
        mouth_mm = width_mm
        open_mm = np.minimum(depth_mm, width_mm / closing) if closing else depth_mm
    return mouth_mm * open_mm - closing * open_mm**2 / 2


def _closing(shape: CrackShape) -> float:
    """By how much the walls come nearer to each other for each millimetre down."""
    return float(np.tan(np.radians(shape.wall_angles_deg)).sum()) if shape.tilt in ("flare", "funnel") else 0.0


def _among_stones_mm2(edges_mm: Floats, width_mm: float, depth_mm: float, shape: CrackShape) -> float:
    """Of one section across stones, whose sides stand as far from the left wall as ``edges_mm``, in pairs."""
    if shape.tilt == "funnel":
        # Each gap closes for itself.
        gap_mm = np.diff(np.concatenate([[0.0], edges_mm, [width_mm]]))[::2].clip(min=0.0)
        return float(section_area_mm2(gap_mm, np.full_like(gap_mm, depth_mm), shape).sum())
    stone_mm, closing = np.diff(edges_mm)[::2], _closing(shape)
    # A stone in a flare narrows upward from the deepest level, and may end below the face.
    low_mm = shape.deepest_mm - depth_mm if closing else 0.0
    high_mm = np.minimum(low_mm + depth_mm, stone_mm / closing) if closing else depth_mm
    height_mm = np.maximum(high_mm - low_mm, 0.0)
    stones_mm2 = (height_mm * (stone_mm - closing * (low_mm + height_mm / 2))).sum()
    return float(section_area_mm2(np.array([width_mm]), np.array([depth_mm]), shape)[0] - stones_mm2)


def _stones(outline: Outline) -> dict[int, Floats]:
    """Where the line across each station, from the left wall on, enters and leaves stones: (2 k,), mm."""
    found: dict[int, list[float]] = {}
    across = outline.right_wall_mm - outline.left_wall_mm
    for ring in outline.islands_mm:
        start, step = ring, np.roll(ring, -1, axis=0) - ring
        # Where the line of a station and that of an edge cross, as shares of both: (stations, edges).
        gap = start[None] - outline.left_wall_mm[:, None]
        turn = across[:, None, 0] * step[None, :, 1] - across[:, None, 1] * step[None, :, 0]
        turn = np.where(turn == 0, np.nan, turn)
        own = (gap[..., 0] * step[None, :, 1] - gap[..., 1] * step[None, :, 0]) / turn
        other = (gap[..., 0] * across[:, None, 1] - gap[..., 1] * across[:, None, 0]) / turn
        hit = (own >= 0) & (own <= 1) & (other >= 0) & (other < 1)
        for station in np.flatnonzero(hit.sum(axis=1) % 2 == 0):
            length_mm = float(np.linalg.norm(across[station]))
            found.setdefault(int(station), []).extend((length_mm * own[station, hit[station]]).tolist())
    return {station: np.sort(edges) for station, edges in found.items() if edges}
