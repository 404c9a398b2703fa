"""Where the walls come to when they tilt: mitred where they part, so that each stands at exactly its angle.

A wall that stands still at one level moves sideways with depth. Where neighbouring pieces part, their ends are mitred,
with pieces of no length fanned between them so that each mitre turns at most ``MITRE_DEG``.
"""

from typing import NamedTuple

import numpy as np
from manifold3d import CrossSection, FillRule

from digitise.body.footprint import Footprint
from digitise.settings import CrackShape
from sealtwin.records import Floats

MITRE_DEG = 8.0
"""Facets of a fan are tangent to the true cone and stand 0.24 % out at their corners. That makes at most 0.08 % of a
rough cavity's volume; 10° made 0.1 %."""


class Stretch(NamedTuple):
    """Wall from corner to corner, all of them parting: a fan repeats its corner for each place that it comes to."""

    corners: Floats  # (n, 2)
    moved: Floats  # (n, 2): where they have come to at the other level


def wall_shifts_mm(shape: CrackShape) -> tuple[float, float]:
    """How far the left wall and the right one move sideways between the face and the deepest floor."""
    left, right = shape.deepest_mm * np.tan(np.radians(shape.wall_angles_deg))
    return float(left), float(right)


def tilted_walls(footprint: Footprint, shape: CrackShape) -> list[Stretch]:
    """Of a flare, which opens upward from its floor, or of a funnel, which closes downward from its mouth.

    Walls without an angle do not move and are left out.
    """
    left_mm, right_mm = wall_shifts_mm(shape)
    outward = 1.0 if shape.tilt == "flare" else -1.0
    stretches = []
    for ring in footprint.crack.to_polygons():
        normal = _inward_normals(ring)
        shift_mm = np.full(len(ring), left_mm)
        if left_mm != right_mm:
            share = footprint.sides.left_share((ring + np.roll(ring, -1, axis=0)) / 2, -normal)
            shift_mm = share * left_mm + (1 - share) * right_mm
        stretches += _moved_ring(ring, normal, -outward * shift_mm)
    return stretches


def swept(stretches: list[Stretch], share: float) -> CrossSection:
    """All that the walls pass over in the first ``share`` of their way."""
    rings = [np.vstack([at, (at + share * (moved - at))[::-1]]) for at, moved in stretches]
    # All turn alike, so that where two overlap they add up.
    return CrossSection(rings, FillRule.NonZero)


def _inward_normals(ring: Floats) -> Floats:
    """Of the edges, each from its point to the next; the region lies on the ring's left."""
    step = np.roll(ring, -1, axis=0) - ring
    return np.column_stack([-step[:, 1], step[:, 0]]) / np.linalg.norm(step, axis=1)[:, None]


def _moved_ring(ring: Floats, normal: Floats, inward_mm: Floats) -> list[Stretch]:
    before, inward_before_mm = np.roll(normal, 1, axis=0), np.roll(inward_mm, 1)
    turn = np.arctan2(before[:, 0] * normal[:, 1] - before[:, 1] * normal[:, 0], (before * normal).sum(axis=1))
    parting = -turn * np.sign(inward_mm + inward_before_mm) > 1e-9
    fans = [
        _fan(ring[i], before[i], normal[i], float(turn[i]), inward_before_mm[i], inward_mm[i]) if parting[i] else None
        for i in range(len(ring))
    ]
    stretches: list[Stretch] = []
    corners: list[Floats] = []
    moved: list[Floats] = []
    for i in range(len(ring)):
        j = (i + 1) % len(ring)
        here, there = fans[i], fans[j]
        if inward_mm[i] != 0:
            if not corners:
                corners, moved = [ring[i]], [ring[i] + inward_mm[i] * normal[i] if here is None else here[-1]]
            ends = [ring[j] + inward_mm[i] * normal[i]] if there is None else list(there)
            corners, moved = corners + [ring[j]] * len(ends), moved + ends
            if there is not None and j > 0 and inward_mm[j] != 0:
                continue
        elif there is not None:
            # From a wall that stands still the fan begins a stretch of its own.
            corners, moved = [ring[j]] * len(there), list(there)
        if len(corners) > 1:
            stretches.append(Stretch(np.array(corners), np.array(moved)))
        corners, moved = [], []
    return stretches


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
