"""What a level along the crack holds: sealant, room left, heaps; and which level a volume makes."""

import numpy as np

from sealtwin.records import Floats, Outline, Profile, Solid, Trajectory

BEYOND_MM = 1e-6
"""Where a level begins or ends: a step in a curve that has one value at each s."""


def fill_volumes(profile: Profile, outline: Outline, solid: Solid, from_mm: float, to_mm: float) -> dict[str, float]:
    """Sealant, room left below the face and sealant above the mouth over a stretch of s, mm³; and the share filled.

    The section is as wide as the mouth at the face and narrows by the tangents of the walls' angles where they tilt
    against each other (flare and funnel alike); sealant on the face beside the mouth is not seen by a profile.
    """
    s_mm = np.unique(np.concatenate([profile.s_mm, outline.s_mm, [from_mm, to_mm]]))
    s_mm = s_mm[(s_mm >= from_mm) & (s_mm <= to_mm)]
    level_mm = np.interp(s_mm, profile.s_mm, profile.level_mm)
    mouth_mm = mouth_widths_mm(s_mm, outline, solid)
    left_mm3 = float(np.trapezoid(_room_mm2(level_mm, mouth_mm, solid), s_mm))
    room_mm3 = float(np.trapezoid(_room_mm2(-solid.depth_at_mm(s_mm), mouth_mm, solid), s_mm))
    heap_mm3 = float(np.trapezoid(mouth_mm * np.maximum(level_mm, 0.0), s_mm))
    return {
        "underfill_mm3": left_mm3,
        "overfill_mm3": heap_mm3,
        "sealant_mm3": room_mm3 - left_mm3 + heap_mm3,
        "fill_ratio": 1 - left_mm3 / room_mm3,
    }


def mouth_widths_mm(s_mm: Floats, outline: Outline, solid: Solid) -> Floats:
    """Width of the crack at the face, square to the centreline, at each s, (n,)."""
    traced_mm = np.interp(s_mm, outline.s_mm, outline.width_mm)
    return traced_mm + (_closing(solid) * solid.depth_mm if solid.tilt == "flare" else 0.0)


def balance_profile(volume_mm3: float, trajectory: Trajectory, outline: Outline, solid: Solid) -> Profile:
    """The level that a volume has, spread evenly over the nozzle's reach.

    Flat from where the first sealant leaves to where the last does, as water between two dams would stand, and the
    bare floor beyond. It knows volume, crack and path, and nothing of how sealant flows: a simulation should do better.
    """
    from scipy.optimize import root_scalar

    first_mm, last_mm = np.sort(trajectory.s_mm[trajectory.giving][[0, -1]])

    def held(level_mm: float) -> dict[str, float]:
        floor_mm = -solid.depth_at_mm(outline.s_mm)
        flat = Profile(outline.s_mm, np.maximum(floor_mm, level_mm))
        return fill_volumes(flat, outline, solid, first_mm, last_mm)

    # Above the face each millimetre adds as much as the first: all of it heaped up is surely too high.
    highest_mm = 1.0 + volume_mm3 / held(1.0)["overfill_mm3"]
    level_mm = root_scalar(
        lambda level_mm: held(level_mm)["sealant_mm3"] - volume_mm3, bracket=(-solid.depth_mm, highest_mm)
    ).root
    edges_mm = np.array([first_mm, last_mm])
    s_mm = np.unique(np.concatenate([outline.s_mm, edges_mm, edges_mm + BEYOND_MM * np.array([-1, 1])]))
    s_mm = s_mm[(s_mm >= 0) & (s_mm <= outline.length_mm)]
    floor_mm = -solid.depth_at_mm(s_mm)
    reached = (s_mm >= first_mm) & (s_mm <= last_mm)
    return Profile(s_mm, np.where(reached, np.maximum(floor_mm, level_mm), floor_mm), source="volume balance")


def _room_mm2(level_mm: Floats, mouth_mm: Floats, solid: Solid) -> Floats:
    """Of each section between the level and the face, (n,)."""
    closing = _closing(solid)
    below_mm = np.maximum(-level_mm, 0.0)
    if closing:
        # Walls of a narrow funnel meet above the floor; there is no room below.
        below_mm = np.minimum(below_mm, mouth_mm / closing)
    return mouth_mm * below_mm - closing * below_mm**2 / 2


def _closing(solid: Solid) -> float:
    """Width that a section loses with each millimetre of depth."""
    tilted = solid.tilt in ("flare", "funnel")
    return float(np.tan(np.radians(solid.wall_angles_deg)).sum()) if tilted else 0.0
