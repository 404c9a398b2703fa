"""The nozzle's timed path over a crack: smooth, at constant speed, giving a constant flow."""

import numpy as np
from scipy.interpolate import splev, splprep

from digitise.settings import LARGEST_VOLUME_ML, NozzlePath
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline, Trajectory, arc_length

SAMPLE_MM = 0.25
"""The centreline is resampled this finely before it is smoothed, so that every millimetre of it weighs the same."""
FINEST_SAMPLES, MOST_SAMPLES = 17, 20_000
MOST_WAYPOINTS = 100_000
"""A metre of crack at a hundredth of a millimetre; more is a slip of the pen."""
MUCH_SEALANT, LITTLE_SEALANT = 3.0, 0.1
"""Cavities' worth beyond which a volume is more likely a slip than a plan: the paper gives 0.8 to 1.2."""


def plan_trajectory(outline: Outline, path: NozzlePath, cavity_volume_mm3: float) -> Trajectory:
    """Waypoints from ``trim_mm`` in to as far from the other end, evenly spaced, on a smoothed centreline.

    Row i holds from ``t_s[i]`` to ``t_s[i + 1]``: the nozzle goes straight from waypoint to waypoint at ``speed_mm_s``
    and gives ``flow_mm3_s``. In the last row both are 0: a controller that holds it stands still and gives no more, so
    ``sum(flow[:-1] * diff(t))`` is the whole volume. ``s_mm`` is arc length on the outline's own centreline: the first
    waypoint has s = ``trim_mm``.

    Raises InputError where the crack is too short for its trims, or the cavity's volume is asked for and there is none,
    or more than a path may give.
    """
    length_mm = outline.length_mm
    if length_mm < 2 * path.trim_mm + path.spacing_mm:
        raise InputError(
            f"Centreline {length_mm:.1f} mm: too short to trim 2 x {path.trim_mm:g} mm and leave a step of "
            f"{path.spacing_mm:g} mm. Reduce trim_mm."
        )
    if length_mm / path.spacing_mm > MOST_WAYPOINTS:
        raise InputError(
            f"spacing_mm is {path.spacing_mm:g}: more than {MOST_WAYPOINTS} waypoints on {length_mm:.0f} mm of crack. "
            "Choose a larger spacing."
        )
    volume_mm3 = _volume_mm3(path, cavity_volume_mm3)
    s_mm, points_mm = _waypoints(outline.centreline_mm, path)
    t_s = arc_length(points_mm) / path.speed_mm_s
    moving = np.append(np.ones(len(t_s) - 1), 0.0)
    return Trajectory(
        t_s=t_s,
        position_mm=np.column_stack([points_mm, np.full(len(points_mm), path.nozzle_height_mm)]),
        s_mm=s_mm,
        speed_mm_s=path.speed_mm_s * moving,
        flow_mm3_s=volume_mm3 / t_s[-1] * moving,
    )


def volume_warnings(sealant_mm3: float, cavity_mm3: float) -> tuple[str, ...]:
    """What is odd about giving ``sealant_mm3`` to a cavity of ``cavity_mm3``; empty where nothing is."""
    times = sealant_mm3 / cavity_mm3
    if LITTLE_SEALANT <= times <= MUCH_SEALANT:
        return ()
    return (
        f"volume_ml gives {sealant_mm3 / 1000:.4g} ml of sealant to a cavity of {cavity_mm3 / 1000:.4g} ml, "
        f"{times:.3g} times what it holds: {'most of it will spill' if times > 1 else 'it will hardly be wetted'}; "
        'check volume_ml and depth_mm, or set volume_ml = "cavity"',
    )


def smooth_centreline(centreline_mm: Floats, smoothing_mm: float) -> tuple[Floats, Floats]:
    """Arc length on the centreline (n,) and the smoothed points there (n, 2), every ``SAMPLE_MM``.

    A cubic smoothing spline over arc length, with the fewest knots whose RMS distance from the centreline stays within
    ``smoothing_mm`` (FITPACK's splprep, Dierckx 1982). 0 follows the centreline through every sample.
    """
    s_mm = arc_length(centreline_mm)
    count = int(np.clip(np.ceil(s_mm[-1] / SAMPLE_MM) + 1, FINEST_SAMPLES, MOST_SAMPLES))
    at_mm = np.linspace(0.0, s_mm[-1], count)
    samples = np.column_stack([np.interp(at_mm, s_mm, centreline_mm[:, axis]) for axis in (0, 1)])
    spline, _ = splprep(samples.T, u=at_mm, k=3, s=count * smoothing_mm**2)
    return at_mm, np.column_stack(splev(at_mm, spline))


def _waypoints(centreline_mm: Floats, path: NozzlePath) -> tuple[Floats, Floats]:
    """Arc length on the centreline and position of each waypoint, evenly spaced along the smoothed path."""
    at_mm, smooth = smooth_centreline(centreline_mm, path.smoothing_mm)
    flown_mm = arc_length(smooth)
    first, last = np.interp([path.trim_mm, at_mm[-1] - path.trim_mm], at_mm, flown_mm)
    steps = max(1, int(np.ceil((last - first) / path.spacing_mm - 1e-9)))
    even_mm = np.linspace(first, last, steps + 1)
    points_mm = np.column_stack([np.interp(even_mm, flown_mm, smooth[:, axis]) for axis in (0, 1)])
    return np.interp(even_mm, flown_mm, at_mm), points_mm


def _volume_mm3(path: NozzlePath, cavity_volume_mm3: float) -> float:
    if path.volume_ml != "cavity":
        return path.volume_ml * 1000.0
    if not cavity_volume_mm3 > 0:
        raise InputError(
            f'volume_ml is "cavity", but the cavity holds {cavity_volume_mm3:g} mm³. Give volume_ml a number.'
        )
    if cavity_volume_mm3 > 1000 * LARGEST_VOLUME_ML:
        raise InputError(
            f'volume_ml is "cavity", but the cavity holds {cavity_volume_mm3 / 1000:.0f} ml, more than the '
            f"{LARGEST_VOLUME_ML:g} ml that one path may give. Check depth_mm and the scale of the photo, or give "
            "volume_ml a number."
        )
    return cavity_volume_mm3
