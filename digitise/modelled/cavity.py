"""The crack in a block: the room below its face that opens upward as one long mouth, and nothing else."""

from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold

from digitise.geometry.region import rectangle
from digitise.modelled.block import Block, parted
from sealtwin.errors import InputError
from sealtwin.records import Floats

RIVAL = 0.5
"""A second opening with more than this share of the first one's area makes the choice the user's."""
WORTH_SAYING_MM2 = 1.0
"""A pit of this size is told; smaller ones are pores."""
SLICE_MM = 1e-3
"""Below the level at which a room is cut off, where it can be sliced."""
UNDER_MM = 1.0
"""How far below the underside is looked for a crack that goes through it."""


@dataclass(frozen=True)
class Cavity:
    """The room that sealant can fill."""

    body: Manifold
    """From the face down, and to the block's sides where the crack is open."""
    mouth: CrossSection
    """Its section ``below_mm`` under the face."""
    below_mm: float
    warnings: tuple[str, ...]

    @property
    def volume_mm3(self) -> float:
        return float(self.body.volume())

    @property
    def depth_mm(self) -> float:
        return -float(self.body.bounding_box()[2])


def find_cavity(block: Block, below_mm: float, on_path_mm: Floats | None) -> Cavity:
    """The opening ``below_mm`` under the face that the points of the path lie in, or the largest, and all below it.

    Raises InputError where nothing opens, two openings compete, or the crack goes through the underside.
    """
    face = rectangle(block.face_mm)
    openings = (face - block.body.slice(-below_mm)).decompose()
    mouth, warnings = _chosen(openings, on_path_mm)
    bottom_mm = block.body.bounding_box()[2]
    shaft = face.extrude(-below_mm - bottom_mm + UNDER_MM).translate((0.0, 0.0, bottom_mm - UNDER_MM))
    _, rooms = parted(shaft, block.body)
    below = _piece_under(rooms, mouth, below_mm)
    if below.bounding_box()[2] < bottom_mm:
        raise InputError(
            "The crack goes through the underside of the mesh, so nothing would stay in it. Close it below, or check "
            "up, the axis that points out of the cracked face."
        )
    # Walls that open upward lie beyond the mouth; at 63 degrees from upright they are a face.
    rim = mouth.offset(2 * below_mm, JoinType.Round) ^ face
    above = rim.extrude(below_mm).translate((0.0, 0.0, -below_mm)) - block.body
    return Cavity(below + above, mouth, below_mm, warnings)


def _chosen(openings: list[CrossSection], on_path_mm: Floats | None) -> tuple[CrossSection, tuple[str, ...]]:
    openings = sorted(openings, key=lambda opening: -opening.area())
    if not openings or openings[0].area() < WORTH_SAYING_MM2:
        raise InputError("No crack opens in the face. Check up, the axis that points out of the cracked face.")
    largest, *others = openings
    if on_path_mm is not None:
        passed = [_points_inside(opening, on_path_mm) for opening in openings]
        if not any(passed):
            raise InputError(
                "The path lies in no opening of the face. It is read as x and y in mm, in the mesh's axes."
            )
        largest = openings.pop(int(np.argmax(passed)))
        others = openings
    elif others and others[0].area() > RIVAL * largest.area():
        one, other = (_place(opening) for opening in openings[:2])
        raise InputError(
            f"Two openings compete, {largest.area():.0f} mm² round {one} and {others[0].area():.0f} mm² round {other} "
            "mm from the face's lower left corner: choose with a path."
        )
    pits = [other.area() for other in others if other.area() >= WORTH_SAYING_MM2]
    if not pits:
        return largest, ()
    return largest, (
        f"{len(pits)} other openings of up to {pits[0]:.1f} mm² in the face are not part of the crack: sealant may run "
        "into them.",
    )


def _piece_under(rooms: Manifold, mouth: CrossSection, below_mm: float) -> Manifold:
    """Of all that is empty below the mouth's level, what hangs together with the mouth."""
    for room in sorted(rooms.decompose(), key=lambda room: -room.volume()):
        if (room.slice(-below_mm - SLICE_MM) ^ mouth).area() > 0:
            return room
    raise InputError("The crack's mouth leads nowhere: check the mesh round it.")


def _points_inside(region: CrossSection, points_mm: Floats) -> int:
    """A point is inside where a ray from it crosses the region's edges an odd number of times."""
    x, y = points_mm.T[:, :, None]
    inside = np.zeros(len(points_mm), dtype=bool)
    for ring in region.to_polygons():
        (x0, y0), (x1, y1) = ring.T, np.roll(ring, -1, axis=0).T
        over = (y0 > y) != (y1 > y)
        at = x0 + (y - y0) * np.divide(x1 - x0, y1 - y0, out=np.zeros(len(ring)), where=y1 != y0)
        inside ^= (over & (x < at)).sum(axis=1) % 2 == 1
    return int(inside.sum())


def _place(region: CrossSection) -> str:
    x_min, y_min, x_max, y_max = region.bounds()
    return f"({(x_min + x_max) / 2:.0f}, {(y_min + y_max) / 2:.0f})"
