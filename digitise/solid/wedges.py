"""Cut the tilted cavity out of the block with unions of wedges. Every wall face has exactly the tilt's angle.

A wedge is a triangle that is swept along a wall. All wedges are united before they are subtracted. Subtracting them one
by one would leave fins.
"""

import numpy as np
from manifold3d import Manifold, Mesh64, OpType

from digitise.geometry.polyline import to_left
from digitise.geometry.region import box_region, prism
from digitise.settings import CrackShape
from digitise.solid.dams import Dam
from digitise.solid.footprint import Footprint
from sealtwin.core.arrays import Floats, cross, lengths

MITRE_DEG = 8.0  # Angle of a facet of a fan at a corner. The facets add 0.08 % to a rough cavity, and with 10°, 0.1 %
BELOW_MM = 1.0  # Overlap of bodies that end at another body. Coincident planes would leave slivers
# Part of a wall: its corners, (n, 2), repeated at a fan, and their positions at the other end of the depth, (n, 2)
Stretch = tuple[Floats, Floats]


def wall_shifts_mm(shape: CrackShape) -> tuple[float, float]:
    """Return the sideways shift of the left and of the right wall between the face and the deepest floor."""
    left_mm, right_mm = (shape.deepest_mm * np.tan(np.radians(shape.wall_angles_deg))).tolist()
    return left_mm, right_mm


def tilted_walls(footprint: Footprint, shape: CrackShape) -> list[Stretch]:
    """Return the tilted walls. The walls of a flare go up from its floor, and other walls go down from the mouth."""
    left_mm, right_mm = wall_shifts_mm(shape)
    stretches = []
    for ring in footprint.crack.to_polygons():
        onward = np.roll(ring, -1, axis=0)
        step = onward - ring
        # Normal of the edge from each point to the next. It points inward, because the region is on the ring's left.
        normal = to_left(step) / lengths(step)[:, None]
        shift_mm = np.full(len(ring), left_mm)
        if left_mm != right_mm:
            share = footprint.sides.left_share((ring + onward) / 2, -normal)
            shift_mm = share * left_mm + (1 - share) * right_mm
        stretches += _moved_ring(ring, normal, -shape.tilting.away * shift_mm)
    return stretches


def _moved_ring(ring: Floats, normal: Floats, inward_mm: Floats) -> list[Stretch]:
    before, inward_before_mm = np.roll(normal, 1, axis=0), np.roll(inward_mm, 1)
    turn = np.arctan2(cross(before, normal), (before * normal).sum(axis=1))
    parting = -turn * np.sign(inward_mm + inward_before_mm) > 1e-9
    fans = [
        _fan(ring[i], before[i], normal[i], float(turn[i]), inward_before_mm[i], inward_mm[i]) if parting[i] else None
        for i in range(len(ring))
    ]
    stretches = list[tuple[list[Floats], list[Floats]]]()
    for i in range(len(ring)):
        j = (i + 1) % len(ring)
        fan, next_fan = fans[i], fans[j]
        shift = inward_mm[i] * normal[i]
        if inward_mm[i] == 0:
            # After a wall that does not move, a fan is a separate stretch.
            stretches.append(([], []))
        elif i == 0 or fan is None or inward_mm[i - 1] == 0:
            stretches.append(([ring[i]], [ring[i] + shift if fan is None else fan[-1]]))
        ends = [*next_fan] if next_fan is not None else [ring[j] + shift] if inward_mm[i] else []
        stretches[-1][0].extend([ring[j]] * len(ends))
        stretches[-1][1].extend(ends)
    return [(np.array(corners), np.array(moved)) for corners, moved in stretches if corners]


def _fan(corner: Floats, before: Floats, after: Floats, turn: float, from_mm: float, to_mm: float) -> Floats:
    """Return the shifted positions of a corner at which two walls diverge, (n, 2)."""
    count = max(1, int(np.ceil(abs(turn) / np.radians(MITRE_DEG))))
    first = np.arctan2(before[1], before[0])
    if from_mm != to_mm:
        # At a tip, the shift changes smoothly from one wall's shift to the other's.
        way = np.linspace(0.0, 1.0, count + 1)
        angle, away_mm = first + way * turn, from_mm + (to_mm - from_mm) * (1 - np.cos(np.pi * way)) / 2
        return corner + away_mm[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    if count == 1:
        # The formula is symmetric in both normals, so that both walls get exactly the same point.
        return corner + from_mm * ((before + after) / (1 + before @ after))[None]
    # The positions are the corners of a polygon around a circle.
    half = turn / count / 2
    middle = first + half * (2 * np.arange(count) + 1)
    return corner + from_mm / np.cos(half) * np.column_stack([np.cos(middle), np.sin(middle)])


def carve(footprint: Footprint, shape: CrackShape, plates: tuple[Dam, ...]) -> Manifold:
    """Return the body of the sample in mm, including dams. Its mesh still has to be cleaned."""
    depth_mm = shape.deepest_mm
    bottom_mm = -(depth_mm + shape.floor_thickness_mm)
    # The order matters: Manifold sorts the triangles of a boolean by the age of its bodies.
    ground = footprint.floor.ground if footprint.floor else Manifold()
    block = prism(footprint.block, bottom_mm, 0.0)
    shaft = prism(footprint.crack, -depth_mm - (BELOW_MM if footprint.floor else 0.0), 0.0)
    walls = Manifold()
    if shape.tilting.lean:
        shear: Floats = np.eye(3, 4)
        shear[:2, 2] = -wall_shifts_mm(shape)[0] / depth_mm * footprint.lean
        shaft = shaft.transform(shear)
    elif shape.tilting.floor_traced:
        shaft += _wedges(footprint, shape, edge_z_mm=-depth_mm, far_z_mm=0.0)
    elif shape.tilting.away > 0:
        # Wedges of walls that move outward have the right orientation if they go up. The body is mirrored afterwards.
        shaft += _wedges(footprint, shape, edge_z_mm=0.0, far_z_mm=depth_mm).mirror((0.0, 0.0, 1.0))
    elif shape.tilting.away < 0:
        walls = _wedges(footprint, shape, edge_z_mm=0.0, far_z_mm=-depth_mm)
    if not footprint.stoppers.is_empty():
        shaft -= prism(footprint.stoppers, -depth_mm - 2 * BELOW_MM, BELOW_MM)
    sample = block - shaft
    walls += ground
    if not walls.is_empty():
        # Wedges of the run-outs extend beyond the block's sides and are cut off there.
        sample = (sample + walls) ^ block
    for plate in plates:
        sample += prism(box_region(plate.box_mm), bottom_mm, shape.dam_height_mm)
    return sample


def _wedges(footprint: Footprint, shape: CrackShape, edge_z_mm: float, far_z_mm: float) -> Manifold:
    """Return the body between the walls at ``edge_z_mm`` and their shifted positions at ``far_z_mm``."""
    pieces = [_wedge(stretch, edge_z_mm, far_z_mm) for stretch in tilted_walls(footprint, shape)]
    # Neighbours on the ring are united first, so that every boolean is small.
    while len(pieces) > 1:
        pieces = [Manifold.batch_boolean(pieces[i : i + 2], OpType.Add) for i in range(0, len(pieces), 2)]
        for piece in pieces:
            # This makes Manifold compute the union now. Computing all at the end is three times slower.
            piece.num_tri()
    return pieces[0] if pieces else Manifold()


def _wedge(stretch: Stretch, edge_z_mm: float, far_z_mm: float) -> Manifold:
    """Return a row of connected wedges: a back, a slope and a base along the wall, and a triangle at each end."""
    corners, moved = stretch
    # A fan has several moved positions for the same corner.
    fresh = np.concatenate([[True], (corners[1:] != corners[:-1]).any(axis=1)])
    count = int(fresh.sum())
    edge = np.cumsum(fresh) - 1
    foot, far = edge + count, np.arange(len(corners)) + 2 * count
    vertices = np.empty((2 * count + len(corners), 3))
    vertices[: 2 * count, :2] = np.concatenate([corners[fresh], corners[fresh]])
    vertices[2 * count :, :2] = moved
    vertices[:, 2] = far_z_mm
    vertices[:count, 2] = edge_z_mm
    quads = [(a[:-1], b[:-1], b[1:], a[1:]) for a, b in ((edge, foot), (foot, far), (far, edge))]
    triangles = [np.stack(quad)[[[0, 1, 2], [0, 2, 3]]] for quad in quads]
    faces = np.concatenate(triangles, axis=2).transpose(0, 2, 1).reshape(-1, 3)
    faces = faces[(faces != faces[:, [1, 2, 0]]).all(axis=1)]
    ends = [(edge[0], far[0], foot[0]), (edge[-1], foot[-1], far[-1])]
    return Manifold(Mesh64(vertices, np.vstack([faces, ends]).astype(np.uint64)))
