"""Dams at open ends, as the tape in the paper, and proof that the cavity leaves the block nowhere else."""

from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection

from digitise.body.footprint import Footprint
from digitise.geometry.region import Box, nearest_side, rectangle
from sealtwin.errors import InputError
from sealtwin.records import Floats

CLEARANCE_MM = 0.5
"""Least thickness of sample between the crack and the block's side."""
DAM_THICKNESS_MM = 4.0
DAM_OVERLAP_MM = 4.0
"""A dam covers this much of the block's side on either hand of the opening, as tape does."""


@dataclass(frozen=True)
class Dam:
    """A plate on the outside of the block's side, over one open end."""

    end: int
    side: int
    """Index in the block's box: 0 x_min, 1 y_min, 2 x_max, 3 y_max."""
    box_mm: Box


def dams(footprint: Footprint, sections: list[CrossSection], spread_mm: float = 0.0) -> tuple[Dam, ...]:
    """One plate for each open end, over all that ``sections`` (the cavity at several depths) leave open at its side.

    ``spread_mm`` is what the tilt moved the walls by, for whoever must be told.

    Raises InputError where the cavity comes out of the block anywhere else.
    """
    opened = [(end, nearest_side(end.centre_mm, footprint.block_mm)) for end in footprint.ends if end.kind == "open"]
    points = np.vstack([polygon for section in sections for polygon in section.to_polygons()])
    plates = []
    for end, side in opened:
        at_side = points[np.abs(points[:, side % 2] - footprint.block_mm[side]) < 1e-6]
        rivals = [other.centre_mm for other, other_side in opened if other_side == side and other is not end]
        for rival in rivals:
            mine = np.linalg.norm(at_side - end.centre_mm, axis=1) <= np.linalg.norm(at_side - rival, axis=1)
            at_side = at_side[mine]
        if not len(at_side):
            raise InputError(
                f"End {end.number + 1} is open, but the crack does not reach the block's side there. "
                "Move the end to the edge of the face, or make it closed or cut."
            )
        plates.append(Dam(end.number, side, plate_over(at_side, side, footprint.block_mm)))
    _require_clearance(footprint, sections, plates, spread_mm)
    return tuple(plates)


def plate_over(at_side: Floats, side: int, block_mm: Box) -> Box:
    """The opening and an overlap, no farther than the block's corners, standing outside the block's side."""
    along = 1 - side % 2
    low = max(float(at_side[:, along].min()) - DAM_OVERLAP_MM, block_mm[along])
    high = min(float(at_side[:, along].max()) + DAM_OVERLAP_MM, block_mm[along + 2])
    face = block_mm[side]
    inner, outer = (face - DAM_THICKNESS_MM, face) if side < 2 else (face, face + DAM_THICKNESS_MM)
    return (inner, low, outer, high) if side % 2 == 0 else (low, inner, high, outer)


def _require_clearance(footprint: Footprint, sections: list[CrossSection], plates: list[Dam], spread_mm: float) -> None:
    block_mm = footprint.block_mm
    x_min, y_min, x_max, y_max = block_mm
    safe = rectangle((x_min + CLEARANCE_MM, y_min + CLEARANCE_MM, x_max - CLEARANCE_MM, y_max - CLEARANCE_MM))
    for plate in plates:
        safe += rectangle(_behind(plate, block_mm))
    for section in sections:
        exposed = _pieces(section - safe)
        if not exposed:
            continue
        if not _pieces(((footprint.crack ^ footprint.block) - footprint.stoppers) - safe):
            raise tilted_out(spread_mm)
        points = np.vstack([polygon for piece in exposed for polygon in piece.to_polygons()])
        away_mm = max(0.0, float(np.min([np.abs(points[:, side % 2] - block_mm[side]).min() for side in range(4)])))
        raise InputError(
            f"Crack mouth or floor comes within {away_mm:.2g} mm of the block side, where no open end is; at least "
            f"{CLEARANCE_MM} mm must stand. Mark an open end there, or give a larger face_mm or margin_mm."
        )


def tilted_out(spread_mm: float) -> InputError:
    """The tilt, not the trace, takes the crack out of the sample."""
    return InputError(
        f"The tilt moves the walls {spread_mm:.1f} mm sideways over the depth, which takes the crack to within "
        f"{CLEARANCE_MM} mm of the block's side or through it, where no open end is. Reduce wall_angle_deg, check "
        'depth_mm, or choose tilt = "vertical".'
    )


def _pieces(region: CrossSection) -> list[CrossSection]:
    return [piece for piece in region.decompose() if piece.area() > 1e-6]


def _behind(plate: Dam, block_mm: Box) -> Box:
    """The strip of block that a dam covers, short of the corners: a dam covers one side only."""
    along, strip = 1 - plate.side % 2, list(plate.box_mm)
    strip[along] = max(strip[along], block_mm[along] + CLEARANCE_MM)
    strip[along + 2] = min(strip[along + 2], block_mm[along + 2] - CLEARANCE_MM)
    strip[plate.side % 2] -= CLEARANCE_MM
    strip[plate.side % 2 + 2] += CLEARANCE_MM
    return strip[0], strip[1], strip[2], strip[3]
