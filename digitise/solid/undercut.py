"""Walls that open downward: the angle up to which they meet no other part of the crack and stay in the block."""

import numpy as np

from digitise.geometry.region import pieces
from digitise.settings import CrackShape
from digitise.solid.dams import CLEARANCE_MM, plates_over, sheltered
from digitise.solid.footprint import Footprint
from digitise.solid.tilt_variants import Slicer, largest_share, meeting_share
from sealtwin.core.errors import InputError

SMALLEST_DEG = 0.1  # Least angle that a refusal proposes, and the step of what it proposes


def require_room(footprint: Footprint, shape: CrackShape) -> None:
    """Raise InputError with the largest angle that fits, if parts of the crack meet below the face or leave the block.

    A trace that leaves the block at the face already is refused by ``dams``.
    """
    slicer = Slicer(footprint, shape)
    meeting, leaving = meeting_share(slicer, shape), _leaving_share(footprint, slicer, shape)
    if meeting is None and leaving is None:
        return
    if meeting is not None and (leaving is None or meeting <= leaving):
        share, fault = meeting, "parts of the crack meet below the face"
    else:
        share, fault = leaving or 0.0, f"the crack comes within {CLEARANCE_MM} mm of the block's side or leaves it"
    # Largest angles in steps that are rounded down, so that they do fit.
    angles_deg = np.degrees(np.arctan(share * np.tan(np.radians(shape.wall_angles_deg))))
    left_deg, right_deg = np.floor(angles_deg / SMALLEST_DEG) * SMALLEST_DEG
    fits = f"{left_deg:.1f}" if left_deg == right_deg else f"[{left_deg:.1f}, {right_deg:.1f}]"
    remedy = f"the largest wall_angle_deg that fits is {fits}"
    if max(left_deg, right_deg) == 0:
        remedy = f"no wall_angle_deg of {SMALLEST_DEG}° or more fits"
    raise InputError(
        f'With tilt = "undercut", {_angles(shape)} and {shape.deepest_mm:g} mm deep, {fault}; {remedy}, and '
        'tilt = "lean" keeps the width.'
    )


def _leaving_share(footprint: Footprint, slicer: Slicer, shape: CrackShape) -> float | None:
    face, floor = (slicer.between_walls(depth_mm) for depth_mm in (0.0, shape.deepest_mm))
    covered = sheltered(footprint, plates_over(footprint, [face, floor]))
    if pieces(face - covered):
        return None
    return largest_share(lambda share: bool(pieces(slicer.between_walls(share * shape.deepest_mm) - covered)))


def _angles(shape: CrackShape) -> str:
    left_deg, right_deg = shape.wall_angles_deg
    return f"walls at {left_deg:g}°" if left_deg == right_deg else f"walls at {left_deg:g}° and {right_deg:g}°"
