"""What smoothing did to a nozzle's path, and how far the path bends: the figures to state beside its length."""

from typing import Any

import numpy as np

from digitise.settings import NozzlePath
from sealtwin.records import Floats, Outline, Trajectory, arc_length, arc_length_at

SHARP_TURN_DEG = 20.0
"""Between two waypoints. At the default smoothing a wandering crack turns by up to 8; beyond 20 an arm must slow down,
and lays a lump."""
STRAIGHT_MM = 1e5
"""Radii beyond a hundred metres are rounding."""


def path_report(trajectory: Trajectory, outline: Outline, path: NozzlePath) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Figures of a path for solid.json, in mm, degrees and s, and what is odd about it in sentences.

    Leads are left out wherever the crack is meant: they are straight, and no crack lies below them.
    """
    on_crack = _on_crack(trajectory, outline, path)
    s_mm, points_mm = trajectory.s_mm[on_crack], trajectory.position_mm[on_crack, :2]
    off_mm = _off_centreline_mm(points_mm, outline)
    turn_deg = turns_deg(points_mm)
    radius_mm = radii_mm(points_mm)
    moving = trajectory.speed_mm_s[:-1]
    report: dict[str, Any] = {
        "length_mm": float(arc_length(points_mm)[-1]),
        "centreline_mm": float(abs(s_mm[-1] - s_mm[0])),
        "smoothing_mm": path.smoothing_mm,
        "off_centreline_rms_mm": float(np.sqrt(np.mean(off_mm**2))),
        "off_centreline_worst_mm": float(off_mm.max()),
        "largest_turn_deg": float(turn_deg.max(initial=0.0)),
        # A straight path has none.
        "smallest_radius_mm": float(radius_mm.min(initial=np.inf)) if np.isfinite(radius_mm).any() else None,
        "starts_at_s_mm": float(trajectory.s_mm[0]),
        "ends_at_s_mm": float(trajectory.s_mm[-1]),
        "waypoints": len(trajectory.t_s),
        "duration_s": trajectory.duration_s,
        "speed_mm_s": (float(moving.min()), float(moving.max())),
        "sealant_mm3_per_mm": _doses(trajectory, on_crack),
    }
    return report, _warnings(path, outline, s_mm, turn_deg, off_mm)


def turns_deg(points_mm: Floats) -> Floats:
    """Change of direction at each inner waypoint, (n - 2,)."""
    step = np.diff(points_mm[:, :2], axis=0)
    cross = step[:-1, 0] * step[1:, 1] - step[:-1, 1] * step[1:, 0]
    return np.degrees(np.abs(np.arctan2(cross, (step[:-1] * step[1:]).sum(axis=1))))


def radii_mm(points_mm: Floats) -> Floats:
    """Radius of the circle through each inner waypoint and its neighbours, (n - 2,); inf where they are in line."""
    a, b, c = points_mm[:-2, :2], points_mm[1:-1, :2], points_mm[2:, :2]
    sides = [np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))]
    double_area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    with np.errstate(divide="ignore"):
        radius = np.prod(sides, axis=0) / (2 * double_area)
    return np.where(radius > STRAIGHT_MM, np.inf, radius)


def _on_crack(trajectory: Trajectory, outline: Outline, path: NozzlePath) -> slice:
    """Waypoints between the trims."""
    first_mm, last_mm = path.trims_mm[0], outline.length_mm - path.trims_mm[1]
    inside = (trajectory.s_mm > first_mm - 1e-6) & (trajectory.s_mm < last_mm + 1e-6)
    found = np.flatnonzero(inside)
    return slice(int(found[0]), int(found[-1]) + 1)


def _off_centreline_mm(points_mm: Floats, outline: Outline) -> Floats:
    nearest_mm = arc_length_at(points_mm, outline.centreline_mm)
    feet = np.column_stack([np.interp(nearest_mm, outline.s_mm, column) for column in outline.centreline_mm.T])
    return np.linalg.norm(points_mm - feet, axis=1)


def _doses(trajectory: Trajectory, on_crack: slice) -> tuple[float, float]:
    """The least and the most that a millimetre of path gets."""
    way_mm = np.diff(arc_length(trajectory.position_mm))
    given_mm3 = trajectory.flow_mm3_s[:-1] * np.diff(trajectory.t_s)
    per_mm = (given_mm3 / way_mm)[on_crack.start : on_crack.stop - 1]
    return float(per_mm.min()), float(per_mm.max())


def _warnings(path: NozzlePath, outline: Outline, s_mm: Floats, turn_deg: Floats, off_mm: Floats) -> tuple[str, ...]:
    warnings = []
    if turn_deg.max(initial=0.0) > SHARP_TURN_DEG:
        at = int(turn_deg.argmax()) + 1
        warnings.append(
            f"the nozzle's path turns by {turn_deg[at - 1]:.0f} degrees at s = {s_mm[at]:.1f} mm, where an arm slows "
            f"down and lays a lump; a smoothing_mm above {path.smoothing_mm:g} rounds it"
        )
    half_width_mm = outline.mean_width_mm / 2
    if off_mm.max() > half_width_mm:
        at = int(off_mm.argmax())
        warnings.append(
            f"at s = {s_mm[at]:.1f} mm smoothing takes the nozzle {off_mm[at]:.2f} mm off the crack's middle, which is "
            f"{2 * half_width_mm:.2f} mm wide: a smoothing_mm below {path.smoothing_mm:g} keeps it in"
        )
    return tuple(warnings)
