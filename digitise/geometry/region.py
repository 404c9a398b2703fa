"""A crack as one clean region of the plane: no crossing, no noise that booleans would turn into slivers."""

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType

from sealtwin.errors import InputError
from sealtwin.records import Floats

Box = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max."""

TOLERANCE_MM = 0.003
"""The outline is simplified within this: 0.01 mm, still below a pixel, takes 0.14 % of a smooth funnel's volume."""
NECK_MM = 0.005
"""A tooth or neck of up to twice this width is noise of the trace, which booleans turn into slivers. Wider limits would
blunt sharp tips: 0.02 mm takes 0.17 % of a flare's volume there."""
PIECE_MM2 = 0.05
ISLAND_MM2 = 0.1
"""Smaller pieces and islands are noise: a quarter of the particles' section."""


def traced_region(ring_mm: Floats, islands_mm: Sequence[Floats] = ()) -> tuple[CrossSection, list[str]]:
    """What the ring encloses and no island does, whichever way they run, and warnings about what was left out.

    Raises InputError where it encloses nothing or the ring crosses itself by more than noise does.
    """
    traced, warnings = _within_ring(ring_mm)
    islands = [island for island in islands_mm if len(island) >= 3]
    if not all(np.isfinite(island).all() for island in islands):
        raise InputError("An island of the outline has points that are no finite numbers. Trace it again.")
    if islands:
        traced -= CrossSection(islands, FillRule.NonZero)
    if traced.area() < PIECE_MM2:
        raise InputError(f"The outline encloses {traced.area():.3g} mm² beside its islands: no crack. Trace it again.")
    return traced, warnings


def _within_ring(ring_mm: Floats) -> tuple[CrossSection, list[str]]:
    if not np.isfinite(ring_mm).all():
        raise InputError("The outline has points that are no finite numbers. Trace it again.")
    if len(ring_mm) < 3:
        raise InputError(f"The outline has {len(ring_mm)} points; a crack needs at least 3. Trace it again.")
    signed_mm2 = _signed_area_mm2(ring_mm)
    traced = CrossSection([ring_mm if signed_mm2 > 0 else ring_mm[::-1]], FillRule.Positive)
    if traced.area() < PIECE_MM2:
        raise InputError(f"The outline encloses {traced.area():.3g} mm²: no crack. Trace it again.")
    lost_mm2 = abs(traced.area() - abs(signed_mm2))
    if lost_mm2 < 1e-6 * traced.area():
        return traced, []
    at = _first_crossing(ring_mm)
    where = f" near ({at[0]:.1f}, {at[1]:.1f}) mm" if at is not None else ""
    if lost_mm2 > PIECE_MM2:
        raise InputError(f"Outline crosses itself{where}, over {lost_mm2:.2g} mm²; retrace there.")
    return traced, [f"Loops of {lost_mm2:.2g} mm² where the outline crosses itself{where} were left out."]


def cleaned(crack: CrossSection) -> tuple[CrossSection, list[str]]:
    """Without slits, necks, teeth, specks and steps below the tolerances; what goes is named."""
    miter = JoinType.Miter
    closed = crack.offset(NECK_MM / 2, miter).offset(-NECK_MM / 2, miter)
    opened = closed.offset(-NECK_MM, miter).offset(NECK_MM, miter).simplify(TOLERANCE_MM)
    apart = opened.offset(-0.001, miter)
    # Only where parts touch in a point does the gap cost its 0.001 mm.
    if apart.num_contour() != opened.num_contour():
        opened = apart
    warnings, kept = [], []
    for piece in opened.decompose():
        if piece.area() < PIECE_MM2:
            x, y = np.vstack(piece.to_polygons()).mean(axis=0)
            warnings.append(
                f"Outline piece of {piece.area():.3f} mm² near ({x:.1f}, {y:.1f}) mm dropped (smaller than {PIECE_MM2} "
                "mm²)."
            )
            continue
        kept.append(piece)
    rings = []
    for ring in (polygon for piece in kept for polygon in piece.to_polygons()):
        area_mm2 = _signed_area_mm2(ring)
        if -ISLAND_MM2 < area_mm2 < 0:
            x, y = ring.mean(axis=0)
            warnings.append(
                f"Island of {-area_mm2:.3f} mm² near ({x:.1f}, {y:.1f}) mm filled (smaller than {ISLAND_MM2} mm²)."
            )
            continue
        rings.append(ring)
    if len(kept) > 1:
        warnings.append(f"The crack is in {len(kept)} pieces: it is narrower than {2 * NECK_MM} mm between them.")
    return CrossSection(rings, FillRule.Positive), warnings


def rectangle(box_mm: Box) -> CrossSection:
    x_min, y_min, x_max, y_max = box_mm
    return CrossSection.square((x_max - x_min, y_max - y_min)).translate((x_min, y_min))


def nearest_side(point_mm: Floats, box_mm: Box) -> int:
    """Index into the box of the side closest to the point."""
    return int(np.argmin([abs(point_mm[side % 2] - box_mm[side]) for side in range(4)]))


def _signed_area_mm2(ring_mm: Floats) -> float:
    """Positive where the ring runs counter-clockwise."""
    x, y = ring_mm.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def _first_crossing(ring_mm: Floats) -> Floats | None:
    """Where two edges that are no neighbours cross."""
    start, step = ring_mm, np.roll(ring_mm, -1, axis=0) - ring_mm
    n = len(ring_mm)
    for i in range(n - 2):
        others = np.arange(i + 2, n - (i == 0))
        gap = start[others] - start[i]
        denominator = _cross(step[i], step[others])
        with np.errstate(divide="ignore", invalid="ignore"):
            own = _cross(gap, step[others]) / denominator
            other = _cross(gap, step[i]) / denominator
        hit = np.flatnonzero((own >= 0) & (own <= 1) & (other >= 0) & (other <= 1))
        if len(hit):
            return start[i] + own[hit[0]] * step[i]
    return None


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
