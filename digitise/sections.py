"""The cavity's section square to the centreline, station by station, in closed form."""

import numpy as np

from digitise.settings import CrackShape
from sealtwin.records import Floats, Outline, Sections


def crack_sections(outline: Outline, shape: CrackShape) -> Sections:
    """At the outline's stations: between two straight walls, from the face to the floor.

    Summed over the arc they are the cavity, less side cracks, what a flare adds around a tip, and what a bend gives
    its outer wall more than its inner one.
    """
    s_mm = outline.s_mm
    depth_mm = shape.depth_at_mm(s_mm)
    return Sections(s_mm, depth_mm, section_area_mm2(outline.width_mm, depth_mm, shape))


def section_area_mm2(width_mm: Floats, depth_mm: Floats, shape: CrackShape) -> Floats:
    """Of sections as wide as traced ``width_mm`` and as deep as ``depth_mm``, (n,) each."""
    if shape.tilt not in ("flare", "funnel"):
        return width_mm * depth_mm
    closing = float(np.tan(np.radians(shape.wall_angles_deg)).sum())
    if shape.tilt == "flare":
        # The traced width is that at the deepest level; a shallower floor is wider.
        mouth_mm, open_mm = width_mm + closing * shape.deepest_mm, depth_mm
    else:
        mouth_mm = width_mm
        open_mm = np.minimum(depth_mm, width_mm / closing) if closing else depth_mm
    return mouth_mm * open_mm - closing * open_mm**2 / 2
