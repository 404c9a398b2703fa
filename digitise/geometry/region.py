"""Make one clean plane region of the crack. Crossings and noise would cause slivers in boolean operations."""

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType, Manifold

from digitise.geometry.polyline import Box, crossings, meeting, signed_area
from sealtwin.core.errors import ShapeError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats

# Tolerance of the simplified outline. With 0.01, still below a pixel, a smooth funnel loses 0.14 %
TOLERANCE_MM = 0.003
NECK_MM = 0.005  # A tooth or neck up to twice as wide as this is noise. 0.02 would blunt sharp tips
PIECE_MM2 = 0.05  # A smaller piece of the outline is noise
ISLAND_MM2 = 0.1  # A smaller island is noise: this is a quarter of a particle's section


def traced_region(ring_mm: Floats, islands_mm: Sequence[Floats] = ()) -> tuple[CrossSection, list[Fact]]:
    """Return the region inside a ring and outside its islands, and warnings about loops that were left out.

    The ring may run clockwise or counter-clockwise. Raises ShapeError if the ring encloses no crack or crosses itself
    over a large area.
    """
    if len(ring_mm) < 3 or not all(np.isfinite(ring).all() for ring in (ring_mm, *islands_mm)):
        raise ShapeError(
            f"The outline has {len(ring_mm)} points. Give 3 or more points, and only finite numbers, for the "
            "outline and its islands.",
            "Trace it again.",
        )
    signed_mm2, warnings = signed_area(ring_mm), []
    traced = CrossSection([ring_mm if signed_mm2 > 0 else ring_mm[::-1]], FillRule.Positive)
    lost_mm2 = abs(traced.area() - abs(signed_mm2))
    if lost_mm2 >= 1e-6 * traced.area() > 0:
        where = ""
        for first, second in crossings(ring_mm, closed=True)[:1]:
            step = np.roll(ring_mm, -1, axis=0) - ring_mm
            x, y = meeting((ring_mm[first], step[first]), (ring_mm[second], step[second]))
            where = f" near ({x:.1f}, {y:.1f}) mm"
        if lost_mm2 > PIECE_MM2:
            raise ShapeError(f"Outline crosses itself{where}, over {lost_mm2:.2g} mm².", "Retrace the outline there.")
        text = f"Loops of {lost_mm2:.2g} mm² were left out because the outline crosses itself{where}."
        warnings.append(doubt("solid.loops-left-out", text, lost_mm2, "mm²"))
    if len(islands_mm):
        traced -= CrossSection(list(islands_mm), FillRule.NonZero)
    if traced.area() < PIECE_MM2:
        raise ShapeError(
            f"The outline encloses only {traced.area():.3g} mm² outside its islands, which is too little for a crack.",
            "Trace it again.",
        )
    return traced, warnings


def cleaned(crack: CrossSection) -> tuple[CrossSection, list[Fact]]:
    """Remove slits, necks, teeth, specks and steps that are smaller than the tolerances.

    Returns the region, and warnings: one for each dropped piece or filled island, and one if several pieces are left.
    """
    miter = JoinType.Miter
    closed = crack.offset(NECK_MM / 2, miter).offset(-NECK_MM / 2, miter)
    opened = closed.offset(-NECK_MM, miter).offset(NECK_MM, miter).simplify(TOLERANCE_MM)
    apart = opened.offset(-0.001, miter)
    # The gap of 0.001 mm is needed only if parts touch at a point.
    if apart.num_contour() != opened.num_contour():
        opened = apart
    warnings, rings = [], []
    for ring in map(np.asarray, opened.to_polygons()):
        area_mm2, (x, y) = signed_area(ring), ring.mean(axis=0)
        if 0 <= area_mm2 < PIECE_MM2:
            text = (
                f"A piece of the outline near ({x:.1f}, {y:.1f}) mm was dropped: its area of {area_mm2:.3f} mm² is "
                f"below {PIECE_MM2} mm²."
            )
            warnings.append(doubt("solid.piece-dropped", text, area_mm2, "mm²"))
        elif -ISLAND_MM2 < area_mm2 < 0:
            text = (
                f"An island near ({x:.1f}, {y:.1f}) mm was filled: its area of {-area_mm2:.3f} mm² is below "
                f"{ISLAND_MM2} mm²."
            )
            warnings.append(doubt("solid.island-filled", text, -area_mm2, "mm²"))
        else:
            rings.append(ring)
    if (count := sum(signed_area(ring) > 0 for ring in rings)) > 1:
        text = f"The crack is in {count} pieces: between them it is narrower than {2 * NECK_MM} mm."
        warnings.append(doubt("solid.in-pieces", text, count))
    return CrossSection(rings, FillRule.Positive), warnings


def pieces(region: CrossSection) -> list[CrossSection]:
    """Return the connected pieces of a region, without specks that come from rounding."""
    return [piece for piece in region.decompose() if piece.area() > 1e-6]


def box_region(box_mm: Box) -> CrossSection:
    """Return the region of a box. ``box_mm`` is x_min, y_min, x_max, y_max."""
    x_min, y_min, x_max, y_max = box_mm
    return CrossSection.square((x_max - x_min, y_max - y_min)).translate((x_min, y_min))


def prism(region: CrossSection, bottom_mm: float, top_mm: float) -> Manifold:
    """Return the upright body over a region, between two heights in mm."""
    return region.extrude(top_mm - bottom_mm).translate((0.0, 0.0, bottom_mm))
