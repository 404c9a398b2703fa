"""Positions at which a crack is narrower, or divided into more gaps, than the sections of the fast model.

A section of that model is a mean over a cell, with one gap. Stones, walls across the crack and roofs reduce the area,
or increase the wall length for the same area. They therefore resist the paste more. To find them, the crack is cut at
shorter distances than the cells.
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from sealtwin.core.records import Floats, Integers, Outline, Solid, unit
from simulate.slot.sections import ROUND_CORNERS, Trapezoids, sections_of

CUTS = 8  # Number of cuts in each cell
LEVELS = 96  # Number of layers of a cut, from the deepest floor to the face
RESISTANCE_TOLERANCE = 0.05  # Fraction by which a cell may resist more, equal to the allowed error of a trapezoid
SLIVER_MM = 0.01  # Width up to which gaps are ignored, because nothing flows through them
SEARCH_DEPTHS, NEAREST_MM, PROBES = 0.5, 0.05, 16
"""Search beyond an end of the crack: its distance divided by the depth (more than walls of 25 degrees open), the
shortest distance in mm, and the number of cuts within the distance. The crack ends if one of the cuts is closed."""
SMALLEST_FLOAT = float(np.finfo(np.float32).tiny)


@dataclass(frozen=True)
class Narrows:
    """Lengths of crack that are equivalent to its narrow positions.

    They are 0 if there are none, infinite if one is closed.
    """

    holds_mm: float
    """Length of crack on which the yield stress resists as much as at the narrow positions."""
    drags_mm: float
    """Length of crack that drags a liquid as much as the narrow positions do."""
    s_mm: float
    """Arc length of the cell that adds most drag."""


@dataclass(frozen=True)
class _Cuts:
    """Areas, wetted lengths and gaps of k cuts of a crack below n levels, (k, n) each."""

    levels_mm: Floats  # (n,): upper ends of the layers
    area_mm2: Floats
    wetted_mm: Floats
    gaps: Floats
    """Mean number of gaps side by side."""


def narrows(outline: Outline, solid: Solid, sections: Trapezoids, fill: float) -> Narrows:
    """Return the length of crack equivalent to the narrow positions of a crack filled to a fraction of its sections."""
    height_mm = sections.height_mm(min(fill, 1.0) * sections.full_mm2)
    own_mm2, own_wetted_mm = sections.area_mm2(height_mm)[0], sections.wetted_mm(height_mm)
    own_mm = sections.holding_mm(own_mm2, own_wetted_mm)
    if outline.islands_mm or solid.tilt == "modelled":
        area_mm2, wetted_mm, gaps = _below(_cuts_of(outline, solid, len(own_mm)), _surface_mm(sections, height_mm))
    else:
        area_mm2, wetted_mm, gaps = _fine(outline, solid, sections, height_mm)
    # Each gap is a section of its own, with an equal share of area and walls.
    half_mm = np.sqrt(np.maximum(wetted_mm**2 - 2 * ROUND_CORNERS * gaps * area_mm2, 0.0))
    holds, drags = np.full((2, *area_mm2.shape), np.inf)
    opens = area_mm2 > 0
    np.divide(own_mm[:, None] * (wetted_mm + half_mm), 2 * area_mm2, out=holds, where=opens)
    np.divide(holds**2 * own_mm2[:, None], area_mm2, out=drags, where=opens)
    # The end cells do not count: at a closed tip the width goes to 0, and nothing flows farther.
    holds_mm, drags_mm = (
        sections.step_mm * np.maximum(more.mean(axis=1) - 1 - RESISTANCE_TOLERANCE, 0.0)[1:-1]
        for more in (holds, drags)
    )
    return Narrows(float(holds_mm.sum()), float(drags_mm.sum()), float(sections.s_mm[1:-1][drags_mm.argmax()]))


def goes_on(outline: Outline, solid: Solid) -> float | None:
    """Return the arc length of a closed end of a mesh's mouth beyond which the cavity continues.

    Returns None if none does.
    """
    if solid.tilt != "modelled":
        return None
    middles_mm = _middles_mm(solid)
    for end, s_mm in ((0, 0.0), (-1, outline.length_mm)):
        if outline.ends[end] == "open":
            continue
        tip_mm, across_mm = outline.centreline_mm[end], outline.left_wall_mm[end] - outline.right_wall_mm[end]
        inner_mm = outline.centreline_mm[1 if end == 0 else -2]
        outward = (tip_mm - inner_mm) / max(float(np.linalg.norm(tip_mm - inner_mm)), SMALLEST_FLOAT)
        left = np.array([-outward[1], outward[0]])
        half_mm = max(float(np.linalg.norm(across_mm)), outline.mean_width_mm) / 2
        reach_mm = SEARCH_DEPTHS * solid.depth_mm
        cuts = np.array(
            [
                _gaps(solid, tip_mm + away_mm * outward, left, middles_mm, (-half_mm, half_mm))[0].sum()
                for away_mm in [-reach_mm, *np.geomspace(NEAREST_MM, reach_mm, PROBES)]
            ]
        )
        if cuts[1:].min() > RESISTANCE_TOLERANCE * cuts[0]:
            return s_mm
    return None


def _surface_mm(sections: Trapezoids, height_mm: Floats) -> Floats:
    """Return the highest level of each cell and its neighbours, (n,).

    A step in the floor is then not taken for a dam.
    """
    level_mm = np.pad(sections.bottom_mm + height_mm, 1, mode="edge")
    return np.max([level_mm[:-2], level_mm[1:-1], level_mm[2:]], axis=0)


def _fine(outline: Outline, solid: Solid, sections: Trapezoids, height_mm: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the area, wetted length and number of gaps of finer sections, (cells, ``CUTS``) each."""
    cells = len(height_mm)
    fine = sections_of(outline, solid, CUTS * cells, reach_per_mm=0.0)
    there_mm = np.maximum(np.repeat(_surface_mm(sections, height_mm), CUTS) - fine.bottom_mm, 0.0)
    area_mm2, wetted_mm = fine.area_mm2(np.minimum(there_mm, fine.depth_mm))[0], fine.wetted_mm(there_mm)
    return area_mm2.reshape(cells, CUTS), wetted_mm.reshape(cells, CUTS), np.ones((cells, CUTS))


def _below(cuts: _Cuts, surface_mm: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the area, wetted length and number of gaps of the cuts below the surface in their cell."""
    layer_mm = cuts.levels_mm[1] - cuts.levels_mm[0]
    level = np.clip((np.repeat(surface_mm, CUTS) - cuts.levels_mm[0]) / layer_mm, 0.0, len(cuts.levels_mm) - 1.0)
    lower = np.minimum(level.astype(int), len(cuts.levels_mm) - 2)
    rows, share = np.arange(len(lower)), level - lower

    def value_at(values: Floats) -> Floats:
        between = values[rows, lower] + share * (values[rows, lower + 1] - values[rows, lower])
        return between.reshape(-1, CUTS)

    return value_at(cuts.area_mm2), value_at(cuts.wetted_mm), value_at(cuts.gaps)


_BY_SOLID: WeakKeyDictionary[Solid, tuple[Outline, _Cuts]] = WeakKeyDictionary()


def _cuts_of(outline: Outline, solid: Solid, cells: int) -> _Cuts:
    """Return the cuts of a solid's mesh. The cuts for its last outline are cached."""
    cached = _BY_SOLID.get(solid)
    if cached is None or cached[0] is not outline:
        cached = outline, _cut(outline, solid, cells)
        _BY_SOLID[solid] = cached
    return cached[1]


def _cut(outline: Outline, solid: Solid, cells: int) -> _Cuts:
    s_mm = (np.arange(CUTS * cells) + 0.5) * outline.length_mm / (CUTS * cells)
    layer_mm, middles_mm = solid.depth_mm / LEVELS, _middles_mm(solid)
    centre_mm, left_mm, right_mm = (
        np.column_stack([np.interp(s_mm, outline.s_mm, line[:, axis]) for axis in (0, 1)])
        for line in (outline.centreline_mm, outline.left_wall_mm, outline.right_wall_mm)
    )
    across = unit(left_mm - right_mm)
    beside_mm = outline.mean_width_mm if solid.tilt == "modelled" else 0.0
    if solid.tilt == "lean":
        beside_mm = solid.depth_mm * np.tan(np.radians(max(solid.wall_angles_deg)))
    widths, gaps = np.zeros((2, len(s_mm), LEVELS))
    for station, (at_mm, left) in enumerate(zip(centre_mm, across, strict=True)):
        ends_mm = (right_mm[station] - at_mm) @ left - beside_mm, (left_mm[station] - at_mm) @ left + beside_mm
        widths[station], gaps[station] = _gaps(solid, at_mm, left, middles_mm, ends_mm)
    # The floor and ledges are wetted too: walls are as long as the way from one layer to the next.
    beside = np.maximum(gaps[:, 1:], gaps[:, :-1])
    slanted_mm = 2 * beside * np.hypot(layer_mm, np.diff(widths, axis=1) / np.maximum(2 * beside, 1))
    first_mm = np.where(gaps[:, :1] > 0, widths[:, :1] + 2 * gaps[:, :1] * layer_mm, 0.0)
    wetted_mm = np.cumsum(np.concatenate([np.zeros((len(s_mm), 1)), first_mm, slanted_mm], axis=1), axis=1)
    area_mm2 = np.cumsum(np.pad(widths, ((0, 0), (1, 0))), axis=1) * layer_mm
    layers = np.maximum(np.cumsum(gaps > 0, axis=1), 1)
    mean_gaps = np.pad(np.cumsum(gaps, axis=1) / layers, ((0, 0), (1, 0)), mode="edge")
    return _Cuts(np.linspace(-solid.depth_mm, 0.0, LEVELS + 1), area_mm2, wetted_mm, np.maximum(mean_gaps, 1.0))


def _middles_mm(solid: Solid) -> Floats:
    """Return the levels of the layers' middles, (``LEVELS``,)."""
    return (np.arange(LEVELS) + 0.5) * solid.depth_mm / LEVELS - solid.depth_mm


def _gaps(
    solid: Solid, at_mm: Floats, left: Floats, levels_mm: Floats, ends_mm: tuple[float, float]
) -> tuple[Floats, Integers]:
    """Return the width and number of gaps of an upright plane at each level, (n,), between the ends of its mouth."""
    ahead = np.array([left[1], -left[0]])
    away_mm = (solid.vertices_mm[:, :2] - at_mm) @ ahead
    beyond = (away_mm >= 0)[solid.faces]
    cut = solid.faces[beyond.any(axis=1) & ~beyond.all(axis=1)]
    ends, others = cut, np.roll(cut, -1, axis=1)
    crosses = (away_mm[ends] >= 0) != (away_mm[others] >= 0)
    # Each cut triangle has two sides that cross the plane. In a fixed order, so that neighbours have the same bits.
    first, second = np.minimum(ends, others)[crosses], np.maximum(ends, others)[crosses]
    share = away_mm[first] / (away_mm[first] - away_mm[second])
    points_mm = solid.vertices_mm[first] + share[:, None] * (solid.vertices_mm[second] - solid.vertices_mm[first])
    place_mm = np.column_stack([(points_mm[:, :2] - at_mm) @ left, points_mm[:, 2]]).reshape(-1, 2, 2)
    (y0, z0), (y1, z1) = place_mm[:, 0].T, place_mm[:, 1].T
    level, side = np.nonzero((z0[None] >= levels_mm[:, None]) != (z1[None] >= levels_mm[:, None]))
    y_mm = y0[side] + (levels_mm[level] - z0[side]) / (z1[side] - z0[side]) * (y1[side] - y0[side])
    order = np.lexsort((y_mm, level))
    level, y_mm = level[order], y_mm[order]
    rank = np.arange(len(level)) - np.searchsorted(level, level)
    # The first crossing is the block's own side, the second opens a gap, the third closes it, and so on.
    opens = np.flatnonzero((rank[:-1] % 2 == 1) & (level[:-1] == level[1:]))
    low_mm, high_mm = y_mm[opens], y_mm[opens + 1]
    counts = (high_mm - low_mm > SLIVER_MM) & (high_mm > ends_mm[0]) & (low_mm < ends_mm[1])
    opens = level[opens[counts]]
    widths_mm = np.asarray(np.bincount(opens, (high_mm - low_mm)[counts], len(levels_mm)), dtype=float)
    return widths_mm, np.bincount(opens, minlength=len(levels_mm))
