"""Where the walls come to when they tilt: mitred where they part, so that each stands at exactly its angle.

A wall that stands still at one level moves sideways with depth. Where neighbouring pieces part, their ends are mitred,
with pieces of no length fanned between them so that each mitre turns at most ``MITRE_DEG``.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from manifold3d import CrossSection, FillRule

from digitise.footprint import Footprint
from digitise.settings import CrackShape
from sealtwin.records import Floats

MITRE_DEG = 8.0
"""Facets of a fan are tangent to the true cone and stand 0.24 % out at their corners. That makes at most 0.08 % of a
rough cavity's volume; 10° made 0.1 %."""


class WallPiece(NamedTuple):
    """A straight piece of wall, or a corner, which has no length."""

    start: Floats
    end: Floats
    moved: Floats  # (2, 2): where the two have come to at the other level


def wall_shifts_mm(shape: CrackShape) -> tuple[float, float]:
    """How far the left wall and the right one move sideways between the face and the deepest floor."""
    left, right = shape.deepest_mm * np.tan(np.radians(shape.wall_angles_deg))
    return float(left), float(right)


def tilted_walls(footprint: Footprint, shape: CrackShape) -> list[WallPiece]:
    """Of a flare, which opens upward from its floor, or of a funnel, which closes downward from its mouth.

    Walls without an angle do not move and are left out.
    """
    left_mm, right_mm = wall_shifts_mm(shape)
    outward = 1.0 if shape.tilt == "flare" else -1.0
    pieces = []
    for ring in footprint.crack.to_polygons():
        normal = _inward_normals(ring)
        shift_mm = np.full(len(ring), left_mm)
        if left_mm != right_mm:
            share = footprint.sides.left_share((ring + np.roll(ring, -1, axis=0)) / 2, -normal)
            shift_mm = share * left_mm + (1 - share) * right_mm
        pieces += _moved_ring(ring, normal, -outward * shift_mm)
    return pieces


def swept(pieces: list[WallPiece], share: float) -> CrossSection:
    """All that the walls pass over in the first ``share`` of their way."""
    fixed = np.array([(piece.start, piece.end) for piece in pieces])
    moved = fixed + share * (np.array([piece.moved for piece in pieces]) - fixed)
    # All turn alike, so that where two overlap they add up.
    return CrossSection(list(np.concatenate([fixed, moved[:, ::-1]], axis=1)), FillRule.NonZero)


def _inward_normals(ring: Floats) -> Floats:
    """Of the edges, each from its point to the next; the region lies on the ring's left."""
    step = np.roll(ring, -1, axis=0) - ring
    return np.column_stack([-step[:, 1], step[:, 0]]) / np.linalg.norm(step, axis=1)[:, None]


def _moved_ring(ring: Floats, normal: Floats, inward_mm: Floats) -> list[WallPiece]:
    before, inward_before_mm = np.roll(normal, 1, axis=0), np.roll(inward_mm, 1)
    turn = np.arctan2(before[:, 0] * normal[:, 1] - before[:, 1] * normal[:, 0], (before * normal).sum(axis=1))
    parting = -turn * np.sign(inward_mm + inward_before_mm) > 1e-9
    fans = [
        _fan(ring[i], before[i], normal[i], float(turn[i]), inward_before_mm[i], inward_mm[i]) if parting[i] else None
        for i in range(len(ring))
    ]
    pieces = []
    for i in range(len(ring)):
        j = (i + 1) % len(ring)
        here, there = fans[i], fans[j]
        if inward_mm[i] != 0:
            from_point = here[-1] if here is not None else ring[i] + inward_mm[i] * normal[i]
            to_point = there[0] if there is not None else ring[j] + inward_mm[i] * normal[i]
            pieces.append(WallPiece(ring[i], ring[j], np.array([from_point, to_point])))
        if here is not None:
            pieces += [WallPiece(ring[i], ring[i], np.array(pair)) for pair in pairwise(here)]
    return pieces


def _fan(corner: Floats, before: Floats, after: Floats, turn: float, from_mm: float, to_mm: float) -> Floats:
    """Where a corner from which walls part comes to, (n, 2)."""
    count = max(1, int(np.ceil(abs(turn) / np.radians(MITRE_DEG))))
    first = np.arctan2(before[1], before[0])
    if from_mm != to_mm:
        # At a tip the shift goes over from that of one wall to that of the other, and leaves both along them.
        way = np.linspace(0.0, 1.0, count + 1)
        angle, away_mm = first + way * turn, from_mm + (to_mm - from_mm) * (1 - np.cos(np.pi * way)) / 2
        return corner + away_mm[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    if count == 1:
        # Exactly the same point from either side, whichever normal it is computed from.
        return corner + from_mm * ((before + after) / (1 + before @ after))[None]
    # Corners of the tangent polygon of a circle.
    half = turn / count / 2
    middle = first + half * (2 * np.arange(count) + 1)
    return corner + from_mm / np.cos(half) * np.column_stack([np.cos(middle), np.sin(middle)])
