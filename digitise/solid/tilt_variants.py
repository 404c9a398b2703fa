"""Compute sections, volumes and widths of one outline under each tilt from its offsets, to check the solid."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import get_args

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType
from scipy.spatial import KDTree

from digitise.geometry.polyline import at_arc_length, left_normals
from digitise.geometry.region import pieces
from digitise.settings import AGAINST_EACH_OTHER, CrackShape, Tilt
from digitise.solid.footprint import Footprint
from digitise.solid.wedges import Stretch, tilted_walls, wall_shifts_mm
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Outline, Sections
from sealtwin.core.solid_figures import ClosingDepth

SAMPLES = 32  # Samples of the line across a gap between walls: 0.01 % of a cavity among stones. With 8 it is 0.1 %.
UPRIGHT = 1e-9  # Least slope in a division, used for an upright wall
STONE_STEP_MM = 0.05  # Spacing of points on a stone's side, accurate to a thousandth from 1 mm away
# Gauss-Legendre, over the depth: 70 ppm
NODES: dict[Tilt, int] = {"vertical": 1, "lean": 8, "flare": 8, "undercut": 8, "funnel": 24}
LEVELS = 8  # Sections of an undercut between floor and face that are tried for one that fits
HALVINGS = 10  # Halvings of the interval between the one that fits and the next
FLOOR_NODES = 16  # Nodes for a floor of changing depth, with a bend of the area at every station: within 400 ppm
ARC_SEGMENTS = 128  # Segments of a full turn of a rounded offset corner: 0.04 % of the corner's own area


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


def cavity_volume_mm3(footprint: Footprint, shape: CrackShape, finer: int = 1) -> float:
    """Integrate the sections over the depth, with ``finer`` times the default number of nodes."""
    slicer, reach_mm = Slicer(footprint, shape), shape.deepest_mm
    # A narrow funnel ends far above its floor; place the nodes where it is open.
    while shape.tilt == "funnel" and slicer.between_walls(0.9 * reach_mm).is_empty():
        reach_mm *= 0.9
    stretches_mm, nodes = [(0.0, reach_mm)], NODES[shape.tilt]
    if footprint.floor is not None:
        # At the depth of a level stretch of floor the area of the sections jumps.
        steps_mm = shape.level_depths_mm[shape.level_depths_mm < reach_mm]
        stretches_mm, nodes = list(pairwise([0.0, *steps_mm, reach_mm])), FLOOR_NODES
    at, weight = np.polynomial.legendre.leggauss(finer * nodes)
    return sum(
        (below_mm - above_mm) / 2 * w * slicer.cavity(above_mm + (below_mm - above_mm) * (1 + x) / 2).area()
        for above_mm, below_mm in stretches_mm
        for x, w in zip(at, weight, strict=True)
    )


@dataclass(frozen=True)
class TiltVariants:
    """Widths for the chosen tilt, and volumes for all tilts at its angle. They are fields of ``SolidFigures``."""

    photo_width_mm: float
    mouth_width_mm: float
    floor_width_mm: float
    volume_mm3: dict[str, float]
    closing_depth_mm: ClosingDepth


def compare_tilts(outline: Outline, footprint: Footprint, shape: CrackShape) -> TiltVariants:
    """Return widths and volumes of the cavity for each possible tilt."""
    opening_mm = sum(wall_shifts_mm(shape)) * {"flare": 1.0, "undercut": 1.0, "funnel": -1.0}.get(shape.tilt, 0.0)
    other_mm = _mean_along(outline, np.maximum(0.0, outline.width_mm + opening_mm))
    photo_mm = outline.mean_width_mm
    mouth_mm, floor_mm = (other_mm, photo_mm) if shape.tilt == "flare" else (photo_mm, other_mm)
    shapes = {tilt: shape.model_copy(update={"tilt": tilt}) for tilt in get_args(Tilt)}
    if meeting_share(Slicer(footprint, shapes["undercut"]), shape) is not None:
        del shapes["undercut"]
    volume_mm3 = {tilt: cavity_volume_mm3(footprint, other) for tilt, other in shapes.items()}
    return TiltVariants(photo_mm, mouth_mm, floor_mm, volume_mm3, _closing_depth(outline, shape))


def _mean_along(outline: Outline, values: Floats) -> float:
    return float(np.trapezoid(values, outline.s_mm) / outline.length_mm)


def _closing_depth(outline: Outline, shape: CrackShape) -> ClosingDepth:
    """Return the depth at which the walls of a funnel at these angles meet: w / (tan left + tan right)."""
    funnel = shape.model_copy(update={"tilt": "funnel"})
    closing = float(np.tan(np.radians(funnel.wall_angles_deg)).sum())
    if closing == 0:
        return ClosingDepth(None, None, 0.0)
    depth_mm = outline.width_mm / closing
    closed = (depth_mm < shape.depth_at_mm(outline.s_mm)).astype(float)
    return ClosingDepth(float(depth_mm.min()), _mean_along(outline, depth_mm), _mean_along(outline, closed))
