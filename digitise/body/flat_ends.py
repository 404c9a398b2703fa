"""Ends that are no tips: open at the block's side, or cut from a longer crack."""

from dataclasses import dataclass, replace

import numpy as np
from manifold3d import CrossSection, FillRule

from digitise.geometry.region import Box, nearest_side
from sealtwin.errors import InputError
from sealtwin.records import EndKind, Floats, Outline, arc_length

ON_SIDE_MM = 0.01
"""A point this close to the block's side lies on it: the outline's file rounds to a thousandth of this."""
RUN_OUT_MM = 5.0
"""How far the walls run straight beyond an end, more than what the tilt takes: nothing of the true end is disturbed."""
HEADING_MM = 5.0
"""The direction of an end is taken over this much centreline: long against pixels, short against the crack's wander."""


@dataclass(frozen=True)
class FlatEnd:
    """An end that is no tip: open at the block's side, or cut by a wall across."""

    number: int
    """0 at s = 0, 1 at the far end."""
    kind: EndKind
    left_mm: Floats
    right_mm: Floats
    outward: Floats
    """Unit vector along which the crack leaves."""

    @property
    def onward(self) -> Floats:
        """Unit vector of the walk from s = 0 to the far end, here."""
        return self.outward if self.number else -self.outward

    @property
    def centre_mm(self) -> Floats:
        return (self.left_mm + self.right_mm) / 2

    @property
    def across(self) -> Floats:
        """Unit vector from the right wall to the left."""
        chord = self.left_mm - self.right_mm
        return chord / np.linalg.norm(chord)

    @property
    def run_out(self) -> Floats:
        """Outward, stretched so that one unit of it is one unit square to the end."""
        facing = np.array([self.across[1], -self.across[0]])
        square = abs(float(facing @ self.outward))
        # An end oblique by more than 80 degrees is a side of the crack; stretching it further helps nobody.
        return self.outward / max(square, 0.17)


def flat_ends(outline: Outline) -> tuple[FlatEnd, ...]:
    """The outline's open and cut ends, first to last."""
    return tuple(_flat_end(outline, number) for number in (0, 1) if outline.ends[number] != "closed")


def heading(outline: Outline, number: int) -> Floats:
    """Unit vector along which the crack's centreline leaves by an end."""
    centre = outline.centreline_mm if number == 0 else outline.centreline_mm[::-1]
    ahead = min(HEADING_MM, outline.length_mm)
    s_mm = arc_length(centre)
    inside = np.array([np.interp(ahead, s_mm, centre[:, axis]) for axis in (0, 1)])
    outward = centre[0] - inside
    return outward / np.linalg.norm(outward)


def require_open_ends_at_side(ends: tuple[FlatEnd, ...], block_mm: Box, width_mm: float) -> None:
    for end in ends:
        if end.kind != "open":
            continue
        side = nearest_side(end.centre_mm, block_mm)
        away_mm = abs(float(end.centre_mm[side % 2]) - block_mm[side])
        if away_mm > width_mm:
            raise InputError(
                f"End {end.number + 1} is open but lies {away_mm:.1f} mm inside the face. "
                "Move it to the edge of the face, or make it closed or cut."
            )


def on_side(end: FlatEnd, ring_mm: Floats, block_mm: Box, width_mm: float) -> FlatEnd:
    """An open end with its corners where the outline meets the block's side.

    The walls' first stations lie square to the centreline: of an oblique crack one is inside the block, one outside.
    """
    if end.kind != "open":
        return end
    side = nearest_side(end.centre_mm, block_mm)
    at_side = ring_mm[np.abs(ring_mm[:, side % 2] - block_mm[side]) < ON_SIDE_MM]
    # An end as oblique as 10 degrees to the side opens over six widths of it.
    at_side = at_side[np.linalg.norm(at_side - end.centre_mm, axis=1) < 6 * width_mm]
    if len(at_side) < 2:
        return end
    to_left = at_side @ np.array([-end.onward[1], end.onward[0]])
    return replace(end, left_mm=at_side[to_left.argmax()], right_mm=at_side[to_left.argmin()])


def run_out(end: FlatEnd, reach_mm: float) -> CrossSection:
    """The crack's straight continuation beyond an end."""
    step = reach_mm * end.run_out
    corners = np.array([end.right_mm, end.right_mm + step, end.left_mm + step, end.left_mm])
    return _region(corners)


def stopper(end: FlatEnd, reach_mm: float, spread_mm: float) -> CrossSection:
    """Ground beyond a cut end, wide and long enough to hold all of its run-out after that has tilted."""
    away = np.array([end.across[1], -end.across[0]])
    away = away if away @ end.outward > 0 else -away
    # The run-out drifts sideways by as much as the cut is oblique.
    drift_mm = reach_mm * float(np.linalg.norm(end.run_out))
    side = (drift_mm + reach_mm) * end.across
    depth = (reach_mm + spread_mm + RUN_OUT_MM) * away
    return _region(
        np.array([end.right_mm - side, end.right_mm - side + depth, end.left_mm + side + depth, end.left_mm + side])
    )


def _flat_end(outline: Outline, number: int) -> FlatEnd:
    return FlatEnd(
        number=number,
        kind=outline.ends[number],
        left_mm=outline.left_wall_mm[-number],
        right_mm=outline.right_wall_mm[-number],
        outward=heading(outline, number),
    )


def _region(corners: Floats) -> CrossSection:
    return CrossSection([corners], FillRule.NonZero)
