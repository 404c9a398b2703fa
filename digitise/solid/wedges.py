"""Block minus tilted cavity, as unions of wedges: every wall face has exactly the tilt's angle.

A wedge is the hull of a straight stretch of wall at one level and its moved place at the other. Wedges are united
before they are subtracted, because subtracting one after the other leaves fins.
"""

import numpy as np
from manifold3d import Manifold, OpType

from digitise.geometry.polyline import cross, to_left
from digitise.geometry.region import box_region, prism
from digitise.settings import CrackShape
from digitise.solid.dams import Dam
from digitise.solid.footprint import Footprint
from sealtwin.core.records import Floats

MITRE_DEG = 8.0  # Turn of a fan's facets: tangent to the true cone, they add 0.08 % to a rough cavity; 10° add 0.1 %
BELOW_MM = 1.0  # Overlap of bodies that end at another one: coincident planes would leave slivers
Stretch = tuple[Floats, Floats]  # Ends of a stretch of wall, (2, 2), equal in a fan, and the same ends after the move


def wall_shifts_mm(shape: CrackShape) -> tuple[float, float]:
    """Return the sideways move of the left wall and of the right one between the face and the deepest floor."""
    left, right = shape.deepest_mm * np.tan(np.radians(shape.wall_angles_deg))
    return float(left), float(right)


def tilted_walls(footprint: Footprint, shape: CrackShape) -> list[Stretch]:
    """Return the walls that have an angle. Those of a flare rise from its floor, others go down from the mouth."""
    left_mm, right_mm = wall_shifts_mm(shape)
    outward = -1.0 if shape.tilt == "funnel" else 1.0
    stretches = []
    for ring in footprint.crack.to_polygons():
        onward = np.roll(ring, -1, axis=0)
        step = onward - ring
        # Inward normal of each edge, from its point to the next: the region is on the ring's left.
        normal = to_left(step) / np.linalg.norm(step, axis=1)[:, None]
        shift_mm = np.full(len(ring), left_mm)
        if left_mm != right_mm:
            share = footprint.sides.left_share((ring + onward) / 2, -normal)
            shift_mm = share * left_mm + (1 - share) * right_mm
        stretches += _moved_ring(ring, normal, -outward * shift_mm)
    return stretches


def _moved_ring(ring: Floats, normal: Floats, inward_mm: Floats) -> list[Stretch]:
    before, inward_before_mm = np.roll(normal, 1, axis=0), np.roll(inward_mm, 1)
    turn = np.arctan2(cross(before, normal), (before * normal).sum(axis=1))
    parting = -turn * np.sign(inward_mm + inward_before_mm) > 1e-9
    # Places of each corner, in order, as the end of the wall before it and as the beginning of the wall after it.
    moved = [
        _fan(ring[i], before[i], float(turn[i]), inward_before_mm[i], inward_mm[i])
        if parting[i]
        else ring[i] + np.array([inward_before_mm[i] * before[i], inward_mm[i] * normal[i]])
        for i in range(len(ring))
    ]
    stretches: list[Stretch] = []
    for i, fan in enumerate(moved):
        j = (i + 1) % len(ring)
        if parting[i]:
            stretches += [(ring[[i, i]], fan[[k, k + 1]]) for k in range(len(fan) - 1)]
        if inward_mm[i] != 0:
            stretches.append((ring[[i, j]], np.array([fan[-1], moved[j][0]])))
    return stretches


def _fan(corner: Floats, before: Floats, turn: float, from_mm: float, to_mm: float) -> Floats:
    """Return the moved places of a corner at which two walls diverge, (n, 2)."""
    count = max(1, int(np.ceil(abs(turn) / np.radians(MITRE_DEG))))
    first = np.arctan2(before[1], before[0])
    if from_mm != to_mm:
        # At a tip the shift changes smoothly from that of one wall to that of the other, tangent to both.
        way = np.linspace(0.0, 1.0, count + 1)
        angle, away_mm = first + way * turn, from_mm + (to_mm - from_mm) * (1 - np.cos(np.pi * way)) / 2
        return corner + away_mm[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    # Corners of the tangent polygon of a circle.
    half = turn / count / 2
    middle = first + half * (2 * np.arange(count) + 1)
    return corner + from_mm / np.cos(half) * np.column_stack([np.cos(middle), np.sin(middle)])


def carve(footprint: Footprint, shape: CrackShape, plates: tuple[Dam, ...]) -> Manifold:
    """Return the sample in mm, dams included, before its mesh is tidied."""
    depth_mm = shape.deepest_mm
    bottom_mm = -(depth_mm + shape.floor_thickness_mm)
    # Made first, since Manifold sorts the triangles of a boolean by the age of its bodies.
    ground = footprint.floor.ground if footprint.floor else Manifold()
    block = prism(footprint.block, bottom_mm, 0.0)
    shaft = prism(footprint.crack, -depth_mm - (BELOW_MM if footprint.floor else 0.0), 0.0)
    walls = Manifold()
    if shape.tilt == "lean":
        shear: Floats = np.eye(3, 4)
        shear[:2, 2] = -wall_shifts_mm(shape)[0] / depth_mm * footprint.lean
        shaft = shaft.transform(shear)
    elif shape.tilt == "flare":
        shaft += _wedges(tilted_walls(footprint, shape), -depth_mm, 0.0)
    elif shape.tilt == "undercut":
        shaft += _wedges(tilted_walls(footprint, shape), 0.0, -depth_mm)
    elif shape.tilt == "funnel":
        walls = _wedges(tilted_walls(footprint, shape), 0.0, -depth_mm)
    if not footprint.stoppers.is_empty():
        shaft -= prism(footprint.stoppers, -depth_mm - 2 * BELOW_MM, BELOW_MM)
    sample = block - shaft
    walls += ground
    if not walls.is_empty():
        # Wedges of the run-outs extend beyond the block's sides, where only dams belong.
        sample = (sample + walls) ^ block
    for plate in plates:
        sample += prism(box_region(plate.box_mm), bottom_mm, shape.dam_height_mm)
    return sample


def _wedges(stretches: list[Stretch], edge_z_mm: float, far_z_mm: float) -> Manifold:
    """Return the body between the walls at ``edge_z_mm`` and their moved places at ``far_z_mm``."""
    pieces = []
    for wall_mm, moved_mm in stretches:
        edge, foot, far = (
            np.column_stack([places_mm, (z_mm, z_mm)])
            for places_mm, z_mm in ((wall_mm, edge_z_mm), (wall_mm, far_z_mm), (moved_mm, far_z_mm))
        )
        pieces.append(Manifold.hull_points(np.vstack([edge, foot, far])))
    # Neighbours on the ring are united first, which keeps every boolean small.
    while len(pieces) > 1:
        pieces = [Manifold.batch_boolean(pieces[i : i + 2], OpType.Add) for i in range(0, len(pieces), 2)]
        for piece in pieces:
            # Manifold evaluates lazily, and all at once is three times slower here.
            piece.num_tri()
    return pieces[0] if pieces else Manifold()
