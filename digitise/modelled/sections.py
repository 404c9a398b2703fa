"""Sections of a modelled cavity square to its centreline."""

import numpy as np
from manifold3d import Manifold

from digitise.geometry.polyline import at_arc_length, left_normals
from sealtwin.records import Floats, Outline, Sections

STATION_MM = 1.0
"""Between sections: as far apart as the nozzle's waypoints."""
MOST_STATIONS = 400
"""A finer look at a long crack would cost minutes and tell nothing."""
FROM_END_MM = 1e-3
"""At an end's own plane there is nothing to cut."""


def cavity_sections(cavity: Manifold, outline: Outline) -> Sections:
    """Depth and area of what each upright plane across the crack cuts from its cavity."""
    length_mm = outline.length_mm
    s_mm = np.linspace(0.0, length_mm, int(np.clip(np.ceil(length_mm / STATION_MM), 8, MOST_STATIONS)) + 1)
    at_mm = np.clip(s_mm, FROM_END_MM, length_mm - FROM_END_MM)
    centre, normal, left, right = (
        at_arc_length(values, outline.s_mm, at_mm)
        for values in (
            outline.centreline_mm,
            left_normals(outline.centreline_mm),
            outline.left_wall_mm,
            outline.right_wall_mm,
        )
    )
    half_mm = np.maximum(np.linalg.norm(left - right, axis=1) / 2, FROM_END_MM)
    cuts = [_cut(cavity, *station) for station in zip(centre, normal, half_mm, strict=True)]
    return Sections(s_mm, *np.array(cuts).T)


def _cut(cavity: Manifold, centre_mm: Floats, left: Floats, half_mm: float) -> tuple[float, float]:
    """Depth and area of the section at one station: of the crack here, and of none of its other parts beside it."""
    left = left / np.linalg.norm(left)
    # The plane's own axes: to the left, up, and along the crack.
    turn = np.array([[left[0], left[1], 0.0], [0.0, 0.0, 1.0], [left[1], -left[0], 0.0]])
    moved = cavity.transform(np.column_stack([turn, -turn @ np.append(centre_mm, 0.0)]))
    depth_mm, area_mm2 = 0.0, 0.0
    for piece in moved.slice(0.0).decompose():
        # What is left of a tip that the plane only grazes has no bounds.
        if piece.is_empty():
            continue
        low, bottom, high, _ = piece.bounds()
        if low <= half_mm and high >= -half_mm:
            depth_mm = max(depth_mm, -bottom)
            area_mm2 += piece.area()
    return depth_mm, area_mm2
