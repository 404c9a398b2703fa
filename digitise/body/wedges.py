"""Block minus tilted cavity, as unions of wedges: every wall face stands at exactly the tilt's angle.

What lies between a stretch of wall and where it has moved to is a wedge: a triangle swept along it. Wedges are only
ever united: their backs lie exactly in the walls, and taking wedges away one after the other leaves fins.
"""

import numpy as np
from manifold3d import CrossSection, Manifold, Mesh64, OpType

from digitise.body.dams import Dam
from digitise.body.footprint import Footprint
from digitise.body.tilting import Stretch, tilted_walls, wall_shifts_mm
from digitise.geometry.region import rectangle
from digitise.settings import CrackShape
from sealtwin.records import Floats

BELOW_MM = 1.0
"""How far bodies overlap that are to end at another one: planes that coincide would leave slivers there."""


def carve(footprint: Footprint, shape: CrackShape, plates: tuple[Dam, ...]) -> Manifold:
    """The sample in mm, dams included: as the booleans leave it, before it is tidied."""
    depth_mm = shape.deepest_mm
    bottom_mm = -(depth_mm + shape.floor_thickness_mm)
    block = _upright(footprint.block, bottom_mm, 0.0)
    shaft = _upright(footprint.crack, -depth_mm - (BELOW_MM if footprint.floor else 0.0), 0.0)
    walls = Manifold()
    if shape.tilt == "lean":
        shaft = shaft.transform(_shear(footprint.lean, wall_shifts_mm(shape)[0] / depth_mm))
    elif shape.tilt == "flare":
        shaft += _wedges(tilted_walls(footprint, shape), edge_z_mm=-depth_mm, far_z_mm=0.0)
    elif shape.tilt == "funnel":
        walls = _wedges(tilted_walls(footprint, shape), edge_z_mm=0.0, far_z_mm=-depth_mm)
    if not footprint.stoppers.is_empty():
        shaft -= _upright(footprint.stoppers, -depth_mm - 2 * BELOW_MM, BELOW_MM)
    sample = block - shaft
    if footprint.floor:
        walls += footprint.floor.ground
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


def _wedges(stretches: list[Stretch], edge_z_mm: float, far_z_mm: float) -> Manifold:
    """All between walls that stand at ``edge_z_mm`` and where they have moved to at ``far_z_mm``."""
    return _united([_wedge(stretch, edge_z_mm, far_z_mm) for stretch in stretches]) if stretches else Manifold()


def _united(pieces: list[Manifold]) -> Manifold:
    """Union of pieces in the order of the ring: neighbours first, which keeps every boolean small."""
    while len(pieces) > 1:
        pieces = [Manifold.batch_boolean(pieces[i : i + 2], OpType.Add) for i in range(0, len(pieces), 2)]
        for piece in pieces:
            # Booleans are put off until someone asks, and then done all at once: three times slower here.
            piece.num_tri()
    return pieces[0]


def _wedge(stretch: Stretch, edge_z_mm: float, far_z_mm: float) -> Manifold:
    """A row of wedges end to end: back, slope and base, and a triangle at either end."""
    corners, moved = stretch
    # A fan is many places that one corner comes to.
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
