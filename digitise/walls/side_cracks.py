"""Find side cracks in the dark region connected to a crack, measure them, and join them to its ring."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import CrossSection, FillRule
from numpy.typing import NDArray
from scipy.spatial import KDTree

from digitise.crack_path.hints import CrackPath
from digitise.crack_path.medial_axis import LEAST_BRANCH, LEAST_BRANCH_PX, holding, radius, side_lines
from digitise.crack_path.standing_out import unlike_length_px
from digitise.geometry.polyline import resampled, signed_area, smoothed, unit
from digitise.geometry.region import ISLAND_MM2
from digitise.image.raster import shrunk
from digitise.photo import Photo
from digitise.walls.centreline_and_walls import LEAST_WIDTH_PX
from digitise.walls.islands import Contrast, contrast
from digitise.walls.straightened import patch_around
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Integers, Outline

WORK_PX = 30.0  # Width of the crack in the searched copy: a side crack a tenth as wide is three pixels wide
AROUND = 0.5  # Distance from the path within which side cracks are searched for, as a share of its length
AS_DARK = 0.6  # Largest share of ``wall_share`` in a side crack; lighter lines are scratches, stains or shadows
AS_WIDE = 1.5  # Largest width of a side crack in widths of the main crack
SLENDER = 3.0  # Least length of a side crack over its own width: shorter ones are pores, stains and broken edges
EDGE = 0.9  # Share of a line with unlike sides from which the line is an edge, as of a sample of unknown size
STRAIGHT = (1.0, 4.0)  # Half widths from the main wall that give a side crack's direction; nearer it turns square
STEP_PX = 0.5  # Spacing at which a line that goes straight back is compared with the centreline


@dataclass(frozen=True)
class FoundSideCrack:
    """A side crack before it is measured, in pixels of the patch."""

    line_px: Floats  # Along its middle, from the main crack's wall to its tip, or to the wall again: (n, 2), 1 px apart
    half_px: float  # Median half width
    comes_back: bool


@dataclass(frozen=True)
class SideCracks:
    """All side cracks of a path, and the levels and the region in which they were found."""

    lines: tuple[FoundSideCrack, ...]
    levels: Contrast
    crack: NDArray[np.bool_]  # Pixels of the patch in the main crack and all that is connected to it
    way_px: Floats  # The path in the patch
    width_px: float
    wall_share: float

    def opens_beside(self, points_px: Floats) -> NDArray[np.bool_]:
        """Return True for points along the crack, (n,), in the photo, that are within a side crack's mouth."""
        inside = np.zeros(len(points_px), dtype=bool)
        for side in self.lines:
            for end_px in (side.line_px[0], side.line_px[-1])[: 1 + side.comes_back]:
                away_px = np.linalg.norm(points_px - end_px - self.levels.patch.offset_px, axis=1)
                inside |= away_px <= self.width_px + 2 * side.half_px
        return inside


def find_side_cracks(photo: Photo, path: CrackPath, wall_share: float) -> SideCracks:
    """Find the side cracks of a path: side lines darker than ``wall_share`` of the contrast."""
    width_px = max(path.width_px, LEAST_WIDTH_PX)
    patch = patch_around(photo, path.points_px, AROUND * float(arc_length(path.points_px)[-1]))
    levels = contrast(photo, path, patch)
    way_px, (height, width) = path.points_px - patch.offset_px, patch.soft.shape
    scale = min(1.0, WORK_PX / width_px)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    small, shown = levels.share_of(shrunk(patch.soft, size)), shrunk(levels.sample.astype(np.float32), size) > 0.99
    places = (way_px + 0.5) * scale - 0.5
    region = holding((small < wall_share) & shown, places)
    way = np.clip(np.rint(places[:, ::-1]).astype(np.int64), 0, np.array(small.shape) - 1)
    way = way[region[tuple(way.T)]]
    least = max(LEAST_BRANCH * width_px, LEAST_BRANCH_PX) * scale
    lines = side_lines(region, way, least) if len(way) > 1 else []
    to_rim = radius(region)
    side_cracks = []
    for cells, comes_back in lines:
        half = float(np.median(to_rim[tuple(cells.T)]))
        dark = np.median(small[tuple(cells.T)]) < AS_DARK * wall_share
        if dark and 2 * half < AS_WIDE * width_px * scale:
            line_px = (_to_the_tip(cells, to_rim, comes_back) + 0.5) / scale - 0.5
            line_px, half_px = smoothed(resampled(line_px, 1.0), half / scale), half / scale
            if arc_length(line_px)[-1] < SLENDER * 2 * to_rim[tuple(cells.T)].max() / scale:
                continue
            unlike_px = unlike_length_px(photo, line_px + patch.offset_px, 2 * half_px)
            if unlike_px < EDGE * len(line_px):
                side_cracks.append(FoundSideCrack(line_px, half_px, comes_back))
    crack = np.zeros_like(levels.sample)
    if side_cracks:
        crack = holding((levels.share < wall_share) & levels.sample, way_px)
    return SideCracks(tuple(side_cracks), levels, crack, way_px, width_px, wall_share)


def _to_the_tip(cells: Integers, to_rim: Floats, comes_back: bool) -> Floats:
    """Return the places of cells, extended to the tip, because a skeleton ends before a round tip."""
    places = cells[:, ::-1].astype(float)
    rest = float(to_rim[tuple(cells[-1])])
    behind = places[-1] - places[max(0, len(places) - 3 - round(2 * rest))]
    if comes_back or not behind.any():
        return places
    return np.vstack([places, places[-1] + rest * behind / np.linalg.norm(behind)])


def with_branches(
    photo: Photo,
    outline: Outline,
    sides: SideCracks,
    side_rings_px: Sequence[Sequence[Floats]],
    keep: bool,
    least_width_px: float,
) -> Outline:
    """Return the main crack's outline with its side cracks. With ``keep``, wide enough ones are joined to its ring.

    Ground that joined side cracks enclose is an island. ``least_width_px`` is the least width of a side crack that is
    measured.
    """
    main = CrossSection([outline.outline_mm], FillRule.Positive)
    lines_mm, measured, warnings = [], [], []
    for side, rings_px in zip(sides.lines, side_rings_px, strict=True):
        line_mm = _from_centreline(photo, outline.centreline_px, sides, side)
        lines_mm.append(line_mm)
        rings_mm = _turned([photo.to_mm(ring) for ring in rings_px])
        own_mm = photo.to_mm(side.line_px + sides.levels.patch.offset_px)
        area_mm2 = (CrossSection(rings_mm, FillRule.Positive) - main).area() if rings_mm else 0.0
        width_px = area_mm2 / float(arc_length(own_mm)[-1]) / photo.mm_per_px
        if not rings_mm:
            warnings.append(f"{_count([line_mm])} is left out: the photo does not show where it leaves the crack")
        elif width_px < least_width_px:
            warnings.append(
                f"{_count([line_mm])} is left out: it is {width_px:.1f} px wide; {least_width_px:g} px are needed to "
                "measure its width"
            )
        else:
            measured.append((line_mm, rings_mm))
    ring_mm, enclosed_mm = outline.outline_mm, ()
    if measured and keep:
        ring_mm, enclosed_mm = _united([ring_mm, *(ring for _, rings in measured for ring in rings)])
    elif measured:
        are, them = ("is", "it") if len(measured) == 1 else ("are", "them")
        count = _count([line for line, _ in measured])
        warnings.insert(0, f'{count} {are} left out; set branches = "keep" to include {them}')
    return replace(
        outline,
        **photo.in_both_units(outline=ring_mm),
        branches_mm=tuple(lines_mm),
        branches_kept=bool(measured) and keep,
        islands_mm=enclosed_mm,
        warnings=(*outline.warnings, *warnings),
    )


def _from_centreline(photo: Photo, centreline_px: Floats, sides: SideCracks, side: FoundSideCrack) -> Floats:
    """Return a side crack's line from the main centreline, with a straight piece up to its first point."""
    offset_px = sides.levels.patch.offset_px
    centreline = KDTree(resampled(centreline_px - offset_px, STEP_PX))
    line_px = side.line_px
    if side.comes_back:
        line_px = _straight_back(line_px[::-1], side.half_px, centreline, sides.width_px)[::-1]
    return photo.to_mm(_straight_back(line_px, side.half_px, centreline, sides.width_px) + offset_px)


def _straight_back(line_px: Floats, half_px: float, centreline: KDTree, width_px: float) -> Floats:
    s = arc_length(line_px)
    first, last = (int(np.searchsorted(s, min(reach * half_px, s[-1] / 2))) for reach in STRAIGHT)
    first = min(first, last - 1)
    back = unit(line_px[first] - line_px[last])
    reach_px = 2 * float(centreline.query(line_px[first])[0]) + 2 * width_px
    steps_px = np.arange(0, reach_px, STEP_PX)[:, None]
    meets = int(np.argmin(centreline.query(line_px[first] + steps_px * back)[0]))
    return np.concatenate([(line_px[first] + steps_px[1 : meets + 1] * back)[::-1], line_px[first:]])


def _turned(rings: list[Floats]) -> list[Floats]:
    """Turn the rings so that the outer one is counter-clockwise and those in it are clockwise."""
    outer_area = max((signed_area(ring) for ring in rings), key=abs, default=0.0)
    return [ring[::-1] for ring in rings] if outer_area < 0 else rings


def _united(rings_mm: Sequence[Floats]) -> tuple[Floats, tuple[Floats, ...]]:
    """Return one ring around the connected rings, and the rings of ground that they enclose."""
    pieces = CrossSection(rings_mm, FillRule.Positive).decompose()
    main = max(pieces, key=lambda piece: piece.area())
    rings = [np.asarray(ring, dtype=float) for ring in main.to_polygons()]
    return max(rings, key=signed_area), tuple(ring for ring in rings if signed_area(ring) <= -ISLAND_MM2)


def _count(lines_mm: Sequence[Floats]) -> str:
    """Return number and lengths as text: "2 side cracks (12 and 7 mm)"."""
    *others, last = [f"{arc_length(line)[-1]:.0f}" for line in lines_mm]
    lengths = f"{', '.join(others)} and {last}" if others else last
    return f"{len(lines_mm)} side crack{'s' if others else ''} ({lengths} mm)"
