"""Side cracks in the outline of a crack: named with their lengths, and joined to it where they are kept."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from manifold3d import CrossSection, FillRule
from scipy.spatial import KDTree

from digitise.geometry.polyline import resampled, signed_area
from digitise.geometry.region import ISLAND_MM2
from digitise.photo import Photo
from digitise.walls.mouths import PastMouths
from digitise.walls.side_cracks import SideCrack, SideCracks
from sealtwin.records import Floats, Outline, arc_length

STRAIGHT = (1.0, 4.0)
"""Half widths from the main crack's wall between which a side crack shows the direction in which it left it: nearer,
its middle line turns square to that wall.
"""
STEP_PX = 0.5
"""Of the line that goes straight back, when its meeting with the centreline is looked for."""


def with_branches(
    photo: Photo, outline: Outline, sides: SideCracks, past: PastMouths, keep: bool, least_width_px: float
) -> Outline:
    """The outline of the main crack with its side cracks named, and joined to it if they are to be kept.

    Walls and centreline stay those of the main crack. What is narrower than ``least_width_px``, or has no clear mouth,
    is left out, and it is said.
    """
    if not sides.found:
        return outline
    main = CrossSection([outline.outline_mm], FillRule.Positive)
    lines_mm, measured, warnings = [], [], []
    for side, rings_px in zip(sides.found, past.side_rings_px, strict=True):
        line_mm = _from_centreline(photo, outline, sides, side)
        lines_mm.append(line_mm)
        rings_mm = _turned([photo.to_mm(ring) for ring in rings_px])
        own_mm = photo.to_mm(side.line_px + sides.levels.patch.offset_px)
        area_mm2 = (CrossSection(rings_mm, FillRule.Positive) - main).area() if rings_mm else 0.0
        width_px = area_mm2 / float(arc_length(own_mm)[-1]) / photo.mm_per_px
        if not rings_mm:
            warnings.append(f"{_count([line_mm])} is left out: where it leaves the crack cannot be told")
        elif width_px < least_width_px:
            warnings.append(
                f"{_count([line_mm])} is left out: it is {width_px:.1f} px wide; need {least_width_px:g} px to measure "
                "its width"
            )
        else:
            measured.append((line_mm, rings_mm))
    if measured and not keep:
        one = len(measured) == 1
        warnings.insert(
            0,
            f"{_count([line for line, _ in measured])} {'is' if one else 'are'} left out; "
            f'branches = "keep" keeps {"it" if one else "them"}',
        )
    outline = replace(outline, branches_mm=tuple(lines_mm), warnings=(*outline.warnings, *warnings))
    return _united(photo, outline, [ring for _, rings in measured for ring in rings]) if measured and keep else outline


def _from_centreline(photo: Photo, outline: Outline, sides: SideCracks, side: SideCrack) -> Floats:
    """A side crack's line from the main centreline, to which it goes straight back."""
    line_px = side.line_px
    if side.comes_back:
        line_px = _straight_back(line_px[::-1], side.half_px, outline, sides)[::-1]
    line_px = _straight_back(line_px, side.half_px, outline, sides)
    return photo.to_mm(line_px + sides.levels.patch.offset_px)


def _straight_back(line_px: Floats, half_px: float, outline: Outline, sides: SideCracks) -> Floats:
    s = arc_length(line_px)
    first, last = (int(np.searchsorted(s, min(reach * half_px, s[-1] / 2))) for reach in STRAIGHT)
    first = min(first, last - 1)
    back = (line_px[first] - line_px[last]) / np.linalg.norm(line_px[first] - line_px[last])
    centreline = KDTree(resampled(outline.centreline_px - sides.levels.patch.offset_px, STEP_PX))
    reach_px = 2 * float(centreline.query(line_px[first])[0]) + 2 * sides.width_px
    steps_px = np.arange(0, reach_px, STEP_PX)[:, None]
    meets = int(np.argmin(centreline.query(line_px[first] + steps_px * back)[0]))
    return np.concatenate([(line_px[first] + steps_px[1 : meets + 1] * back)[::-1], line_px[first:]])


def _turned(rings: list[Floats]) -> list[Floats]:
    """The outer ring counter-clockwise, those in it clockwise."""
    if not rings:
        return rings
    outer = max(rings, key=lambda ring: abs(signed_area(ring)))
    return rings if signed_area(outer) > 0 else [ring[::-1] for ring in rings]


def _united(photo: Photo, outline: Outline, branches_mm: Sequence[Floats]) -> Outline:
    """Main crack and branches in one ring; ground between them that they close in stands as an island."""
    pieces = CrossSection([outline.outline_mm, *branches_mm], FillRule.Positive).decompose()
    main = max(pieces, key=lambda piece: piece.area())
    rings = [np.asarray(ring, dtype=float) for ring in main.to_polygons()]
    outer_mm = max(rings, key=signed_area)
    enclosed = tuple(ring for ring in rings if signed_area(ring) <= -ISLAND_MM2)
    return replace(
        outline,
        outline_mm=outer_mm,
        outline_px=photo.to_px(outer_mm),
        islands_mm=(*outline.islands_mm, *enclosed),
        branches_kept=True,
    )


def _count(lines_mm: Sequence[Floats]) -> str:
    """In words: "2 side cracks (12 and 7 mm)"."""
    *others, last = [f"{arc_length(line)[-1]:.0f}" for line in lines_mm]
    lengths = f"{', '.join(others)} and {last}" if others else last
    return f"{len(lines_mm)} side crack{'s' if others else ''} ({lengths} mm)"
