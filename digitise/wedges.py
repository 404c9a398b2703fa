"""Block minus tilted cavity, as unions of convex pieces: every wall face stands at exactly the tilt's angle.

A wall that stands still at one level and moves sideways with depth is a wedge for each edge of the outline: a triangle
swept along it. Where neighbouring wedges part, their ends are mitred, with wedges of no length fanned between them so
that each mitre turns at most ``MITRE_DEG``. Wedges are only ever united: their backs lie exactly in the walls, and
taking wedges away one after the other leaves fins.
"""

from itertools import pairwise

import numpy as np
from manifold3d import CrossSection, Manifold, OpType

from digitise.dams import Dam
from digitise.footprint import Footprint
from digitise.region import rectangle
from digitise.settings import CrackShape
from sealtwin.records import Floats

MITRE_DEG = 8.0
"""Facets of a fan are tangent to the true cone and stand 0.24 % out at their corners. That makes at most 0.08 % of a
rough cavity's volume; 10° made 0.1 %."""


def tilted_by_mm(shape: CrackShape) -> float:
    """How far a wall moves sideways between mouth and floor."""
    return shape.deepest_mm * float(np.tan(np.radians(max(shape.wall_angles_deg))))


def carve(footprint: Footprint, shape: CrackShape, plates: tuple[Dam, ...]) -> Manifold:
    """The sample in mm, dams included: as the booleans leave it, before it is tidied."""
    depth_mm, spread_mm = shape.deepest_mm, tilted_by_mm(shape)
    bottom_mm = -(depth_mm + shape.floor_thickness_mm)
    block = _upright(footprint.block, bottom_mm, 0.0)
    shaft = _upright(footprint.crack, -depth_mm, 0.0)
    walls = Manifold()
    if spread_mm > 0 and shape.tilt == "lean":
        shaft = shaft.transform(_shear(footprint.lean, spread_mm / depth_mm))
    elif spread_mm > 0 and shape.tilt == "flare":
        voids = _wedges(footprint.crack, -spread_mm, edge_z_mm=-depth_mm, far_z_mm=0.0)
        shaft += voids
    elif spread_mm > 0 and shape.tilt == "funnel":
        walls = _wedges(footprint.crack, spread_mm, edge_z_mm=0.0, far_z_mm=-depth_mm)
    if not footprint.stoppers.is_empty():
        # Beyond the shaft's own top and bottom: planes that coincide would leave slivers there.
        shaft -= _upright(footprint.stoppers, -depth_mm - 1.0, 1.0)
    sample = block - shaft
    if not walls.is_empty():
        # Wedges of the run-outs stand beyond the block's sides; what is outside belongs to the dams alone.
        sample = (sample + walls) ^ block
    for plate in plates:
        sample += _upright(rectangle(plate.box_mm), bottom_mm, shape.dam_height_mm)
    return sample


def _upright(region: CrossSection, bottom_mm: float, top_mm: float) -> Manifold:
    return region.extrude(top_mm - bottom_mm).translate((0.0, 0.0, bottom_mm))


def _shear(towards: Floats, slope: float) -> Floats:
    """(3, 4): below z = 0 everything moves ``slope`` sideways for each unit down."""
    matrix = np.eye(3, 4)
    matrix[:2, 2] = -slope * towards
    return matrix


def _wedges(region: CrossSection, inward_mm: float, edge_z_mm: float, far_z_mm: float) -> Manifold:
    """All between the walls of ``region`` and where they have moved to.

    The walls stand at ``edge_z_mm`` and have moved ``inward_mm`` (outward if negative) at ``far_z_mm``.
    """
    return _united(
        [
            _hull(start, end, moved, edge_z_mm, far_z_mm)
            for ring in region.to_polygons()
            for start, end, moved in _moved_corners(ring, inward_mm)
        ]
    )


def _united(pieces: list[Manifold]) -> Manifold:
    """Union of pieces in the order of the ring: neighbours first, which keeps every boolean small."""
    while len(pieces) > 1:
        pieces = [Manifold.batch_boolean(pieces[i : i + 2], OpType.Add) for i in range(0, len(pieces), 2)]
        for piece in pieces:
            # Booleans are put off until someone asks, and then done all at once: three times slower here.
            piece.num_tri()
    return pieces[0]


def _moved_corners(ring: Floats, inward_mm: float) -> list[tuple[Floats, Floats, Floats]]:
    """Start and end of each wall piece, and the two points (2, 2) that they move to; region on the ring's left."""
    step = np.roll(ring, -1, axis=0) - ring
    length = np.linalg.norm(step, axis=1)
    normal = np.column_stack([-step[:, 1], step[:, 0]]) / length[:, None]
    before = np.roll(normal, 1, axis=0)
    turn = np.arctan2(before[:, 0] * normal[:, 1] - before[:, 1] * normal[:, 0], (before * normal).sum(axis=1))
    parting = np.where(inward_mm > 0, -turn, turn)
    fans = [
        _fan(ring[i], before[i], normal[i], turn[i], inward_mm) if parting[i] > 1e-9 else None for i in range(len(ring))
    ]
    pieces = []
    for i in range(len(ring)):
        j = (i + 1) % len(ring)
        here, there = fans[i], fans[j]
        from_point = here[-1] if here is not None else ring[i] + inward_mm * normal[i]
        to_point = there[0] if there is not None else ring[j] + inward_mm * normal[i]
        pieces.append((ring[i], ring[j], np.array([from_point, to_point])))
        if here is not None:
            pieces += [(ring[i], ring[i], np.array(pair)) for pair in pairwise(here)]
    return pieces


def _fan(corner: Floats, before: Floats, after: Floats, turn: float, inward_mm: float) -> Floats:
    """Mitre points around a corner where walls part: corners of the tangent polygon of a circle, (n, 2)."""
    count = max(1, int(np.ceil(abs(turn) / np.radians(MITRE_DEG))))
    first, half = np.arctan2(before[1], before[0]), turn / count / 2
    middle = first + half * (2 * np.arange(count) + 1)
    points = corner + inward_mm / np.cos(half) * np.column_stack([np.cos(middle), np.sin(middle)])
    if count == 1:
        # Exactly the same point from either side, whichever normal it is computed from.
        points[0] = corner + inward_mm * (before + after) / (1 + before @ after)
    return points


def _hull(start: Floats, end: Floats, moved: Floats, edge_z_mm: float, far_z_mm: float) -> Manifold:
    at_wall = [(x, y, z) for x, y in (start, end) for z in (edge_z_mm, far_z_mm)]
    return Manifold.hull_points(np.array(at_wall + [(x, y, far_z_mm) for x, y in moved]))
