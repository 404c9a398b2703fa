"""What each reading of the tilt makes of one outline: sections, volumes, widths, and where walls meet.

All of it from the outline alone, by offsets of it at many depths; the solid is checked against these.
"""

from itertools import pairwise
from typing import Any, get_args

import numpy as np
from manifold3d import CrossSection, JoinType

from digitise.body.footprint import Footprint
from digitise.body.tilting import Stretch, swept, tilted_walls, wall_shifts_mm
from digitise.settings import CrackShape, Tilt
from sealtwin.records import Outline

NODES: dict[Tilt, int] = {"vertical": 1, "lean": 8, "flare": 8, "funnel": 24}
"""Of Gauss and Legendre, over the depth: within 15 ppm of the limit; where a funnel's walls meet, within 70."""
FLOOR_NODES = 16
"""Over a floor that rises and falls, whose area bends at every station of its table: within 400 ppm."""
ARC_SEGMENTS = 128
"""A full turn of a rounded offset corner: 0.04 % of the corner's own area."""


class Slicer:
    """The cavity at any depth below the face, inside the block, cut ends closed."""

    def __init__(self, footprint: Footprint, shape: CrackShape) -> None:
        self._footprint = footprint
        self._shape = shape
        self._shifts_mm = wall_shifts_mm(shape)
        self._stretches: list[Stretch] = []
        if shape.tilt in ("flare", "funnel") and self._shifts_mm[0] != self._shifts_mm[1]:
            self._stretches = tilted_walls(footprint, shape)

    def between_walls(self, depth_mm: float) -> CrossSection:
        """What lies between the walls, whether above the floor or below it."""
        crack = self._moved(depth_mm / self._shape.deepest_mm)
        return (crack ^ self._footprint.block) - self._footprint.stoppers

    def cavity(self, depth_mm: float) -> CrossSection:
        section, floor = self.between_walls(depth_mm), self._footprint.floor
        return section if floor is None else section - floor.above(depth_mm)

    def _moved(self, share: float) -> CrossSection:
        crack, shift_mm = self._footprint.crack, self._shifts_mm[0]
        if self._shape.tilt == "vertical":
            return crack
        if self._shape.tilt == "lean":
            x, y = share * shift_mm * self._footprint.lean
            return crack.translate((float(x), float(y)))
        flares = self._shape.tilt == "flare"
        share = 1 - share if flares else share
        if share <= 0:
            return crack
        if self._stretches:
            walls = swept(self._stretches, share)
            return crack + walls if flares else crack - walls
        return crack.offset(share * shift_mm * (1 if flares else -1), JoinType.Round, circular_segments=ARC_SEGMENTS)


def cavity_volume_mm3(footprint: Footprint, shape: CrackShape, finer: int = 1) -> float:
    """Integral of the sections over the depth, with ``finer`` times as many of them as are mostly enough."""
    slicer, reach_mm = Slicer(footprint, shape), shape.deepest_mm
    # A narrow funnel ends far above its floor: the sections belong where it is open.
    while shape.tilt == "funnel" and slicer.between_walls(0.9 * reach_mm).is_empty():
        reach_mm *= 0.9
    stretches_mm, nodes = [(0.0, reach_mm)], NODES[shape.tilt]
    if footprint.floor is not None:
        # Where the floor is level for a while, sections lose all of that in one step.
        steps_mm = shape.level_depths_mm[shape.level_depths_mm < reach_mm]
        stretches_mm, nodes = list(pairwise([0.0, *steps_mm, reach_mm])), FLOOR_NODES
    at, weight = np.polynomial.legendre.leggauss(finer * nodes)
    return sum(
        (below_mm - above_mm) / 2 * w * slicer.cavity(above_mm + (below_mm - above_mm) * (1 + x) / 2).area()
        for above_mm, below_mm in stretches_mm
        for x, w in zip(at, weight, strict=True)
    )


def compare_readings(outline: Outline, footprint: Footprint, shape: CrackShape) -> dict[str, Any]:
    """The part of solid.json that says what the chosen tilt means beside the others at this angle."""
    opening_mm = sum(wall_shifts_mm(shape)) * {"flare": 1.0, "funnel": -1.0}.get(shape.tilt, 0.0)
    other_mm = _mean_width_mm(outline, opening_mm)
    photo_mm = outline.mean_width_mm
    mouth_mm, floor_mm = (other_mm, photo_mm) if shape.tilt == "flare" else (photo_mm, other_mm)
    return {
        "photo_width_mm": photo_mm,
        "mouth_width_mm": mouth_mm,
        "floor_width_mm": floor_mm,
        "volume_mm3": {tilt: cavity_volume_mm3(footprint, with_tilt(shape, tilt)) for tilt in get_args(Tilt)},
        "closing_depth_mm": _closing_depth(outline, shape),
    }


def with_tilt(shape: CrackShape, tilt: Tilt) -> CrackShape:
    return shape.model_copy(update={"tilt": tilt})


def _mean_width_mm(outline: Outline, opening_mm: float) -> float:
    """Mean over the arc of the width changed by ``opening_mm``; closed walls have no width, not a negative one."""
    width_mm = np.maximum(0.0, outline.width_mm + opening_mm)
    return float(np.trapezoid(width_mm, outline.s_mm) / outline.length_mm)


def _closing_depth(outline: Outline, shape: CrackShape) -> dict[str, float]:
    """Where the walls of a funnel at these angles meet: w / (tan left + tan right) below the face."""
    closing = float(np.tan(np.radians(with_tilt(shape, "funnel").wall_angles_deg)).sum())
    if closing == 0:
        return {"min": np.inf, "mean": np.inf, "share_above_floor": 0.0}
    depth_mm = outline.width_mm / closing
    closed = (depth_mm < shape.depth_at_mm(outline.s_mm)).astype(float)
    return {
        "min": float(depth_mm.min()),
        "mean": float(np.trapezoid(depth_mm, outline.s_mm) / outline.length_mm),
        "share_above_floor": float(np.trapezoid(closed, outline.s_mm) / outline.length_mm),
    }
