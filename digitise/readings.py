"""What each reading of the tilt makes of one outline: sections, volumes, widths, and where walls meet.

All of it from the outline alone, by exact offsets of it at many depths; the solid is checked against these.
"""

from typing import Any, get_args

import numpy as np
from manifold3d import CrossSection, JoinType

from digitise.footprint import Footprint
from digitise.settings import CrackShape, Tilt
from digitise.wedges import tilted_by_mm
from sealtwin.records import Outline

SLICES = 64
"""Midpoints over the depth: within 0.03 % where a funnel's walls meet, far better elsewhere."""
ARC_SEGMENTS = 128
"""A full turn of a rounded offset corner: 0.04 % of the corner's own area."""


def section(footprint: Footprint, shape: CrackShape, depth_mm: float) -> CrossSection:
    """The cavity at one depth below the face, inside the block, cut ends closed."""
    spread_mm = tilted_by_mm(shape)
    share = depth_mm / shape.deepest_mm
    crack = footprint.crack
    if shape.tilt == "funnel" and share > 0:
        crack = crack.offset(-share * spread_mm, JoinType.Round, circular_segments=ARC_SEGMENTS)
    elif shape.tilt == "flare" and share < 1:
        crack = crack.offset((1 - share) * spread_mm, JoinType.Round, circular_segments=ARC_SEGMENTS)
    elif shape.tilt == "lean":
        x, y = share * spread_mm * footprint.lean
        crack = crack.translate((float(x), float(y)))
    return (crack ^ footprint.block) - footprint.stoppers


def cavity_volume_mm3(footprint: Footprint, shape: CrackShape, slices: int = SLICES) -> float:
    """Integral of the sections over the depth."""
    reach_mm = shape.deepest_mm
    # A narrow funnel ends far above its floor: the slices belong where it is open.
    while shape.tilt == "funnel" and section(footprint, shape, reach_mm / 2).is_empty():
        reach_mm /= 2
    step_mm = reach_mm / slices
    return step_mm * sum(section(footprint, shape, (i + 0.5) * step_mm).area() for i in range(slices))


def compare_readings(outline: Outline, footprint: Footprint, shape: CrackShape) -> dict[str, Any]:
    """The part of solid.json that says what the chosen tilt means beside the others at this angle."""
    spread_mm = tilted_by_mm(shape)
    opening_mm = 2 * spread_mm * {"flare": 1.0, "funnel": -1.0}.get(shape.tilt, 0.0)
    other_mm = _mean_width_mm(outline, opening_mm)
    photo_mm = outline.mean_width_mm
    mouth_mm, floor_mm = (other_mm, photo_mm) if shape.tilt == "flare" else (photo_mm, other_mm)
    return {
        "photo_width_mm": photo_mm,
        "mouth_width_mm": mouth_mm,
        "floor_width_mm": floor_mm,
        "volume_mm3": {tilt: cavity_volume_mm3(footprint, replace_tilt(shape, tilt)) for tilt in get_args(Tilt)},
        "closing_depth_mm": _closing_depth(outline, shape),
    }


def replace_tilt(shape: CrackShape, tilt: Tilt) -> CrackShape:
    return shape.model_copy(update={"tilt": tilt})


def _mean_width_mm(outline: Outline, opening_mm: float) -> float:
    """Mean over the arc of the width changed by ``opening_mm``; closed walls have no width, not a negative one."""
    width_mm = np.maximum(0.0, outline.width_mm + opening_mm)
    return float(np.trapezoid(width_mm, outline.s_mm) / outline.length_mm)


def _closing_depth(outline: Outline, shape: CrackShape) -> dict[str, float]:
    """Where the walls of a funnel at this angle meet: w / (2 tan angle) below the face."""
    slope = float(np.tan(np.radians(replace_tilt(shape, "funnel").wall_angles_deg)).mean())
    if slope == 0:
        return {"min": np.inf, "mean": np.inf, "share_above_floor": 0.0}
    depth_mm = outline.width_mm / (2 * slope)
    closed = (depth_mm < shape.deepest_mm).astype(float)
    return {
        "min": float(depth_mm.min()),
        "mean": float(np.trapezoid(depth_mm, outline.s_mm) / outline.length_mm),
        "share_above_floor": float(np.trapezoid(closed, outline.s_mm) / outline.length_mm),
    }
