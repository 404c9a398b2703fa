"""The nozzle's timed path over a crack: smooth, straight before and after it, and how much it gives where."""

import numpy as np
from scipy.interpolate import splev, splprep

from digitise.ramps import times_along
from digitise.settings import LARGEST_VOLUME_ML, NozzlePath
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline, Sections, Trajectory, arc_length

SAMPLE_MM = 0.25
"""The centreline is resampled this finely before it is smoothed, so that every millimetre of it weighs the same."""
FINEST_SAMPLES, MOST_SAMPLES = 17, 20_000
MOST_WAYPOINTS = 100_000
"""A metre of crack at a hundredth of a millimetre; more is a slip of the pen."""
MUCH_SEALANT, LITTLE_SEALANT = 3.0, 0.1
"""Cavities' worth beyond which a volume is more likely a slip than a plan: the paper gives 0.8 to 1.2."""
ROUNDING = 1e-9


def plan_trajectory(
    outline: Outline, path: NozzlePath, cavity_volume_mm3: float, sections: Sections | None = None
) -> Trajectory:
    """Evenly spaced waypoints on a smoothed centreline, from one trim to the other, with a straight lead at each end.

    Row i holds from ``t_s[i]`` to ``t_s[i + 1]``: the nozzle goes straight from waypoint to waypoint at ``speed_mm_s``
    and gives ``flow_mm3_s``. In the last row both are 0: a controller that holds it stands still and gives no more, so
    ``sum(flow[:-1] * diff(t))`` is the whole volume. ``s_mm`` is arc length on the outline's own centreline, from its
    first point: it falls along a reversed path, and on a lead it runs on beyond the trim, below 0 if need be.

    Ramps take from the first waypoint and from the last, leads included. What a millimetre of crack gets does not
    depend on how fast it is passed: the same everywhere, or in proportion to the cavity's section there.

    Args:
        outline: The crack.
        path: How to follow it.
        cavity_volume_mm3: What volume_ml = "cavity" is a share of.
        sections: The cavity along the centreline; needed for flow = "cross_section".

    Raises:
        InputError: the path is too short for its trims or ramps, has too many waypoints, or gives no volume that a path
            may give.
    """
    _check_lengths(outline.length_mm, path)
    volume_mm3 = _volume_mm3(path, cavity_volume_mm3)
    s_mm, points_mm, headings = _waypoints(outline.centreline_mm, path)
    if path.reverse:
        s_mm, points_mm, headings = s_mm[::-1], points_mm[::-1], -headings[::-1]
    share = _shares(s_mm, points_mm, path, sections)

    onward = -1.0 if path.reverse else 1.0
    before_mm, after_mm = _steps(path.lead_in_mm, path.spacing_mm)[::-1], _steps(path.lead_out_mm, path.spacing_mm)
    s_mm = np.concatenate([s_mm[0] - onward * before_mm, s_mm, s_mm[-1] + onward * after_mm])
    points_mm = np.concatenate(
        [points_mm[0] - before_mm[:, None] * headings[0], points_mm, points_mm[-1] + after_mm[:, None] * headings[-1]]
    )
    share = np.concatenate([np.zeros(len(before_mm)), share, np.zeros(len(after_mm))])

    way_mm = arc_length(points_mm)
    if way_mm[-1] < 2 * path.ramp_mm:
        raise InputError(
            f"ramp_mm is {path.ramp_mm:g}: two ramps do not fit into a path of {way_mm[-1]:.1f} mm, leads included. "
            f"Allowed is at most {np.floor(way_mm[-1] * 5) / 10:g}; or give a longer lead_in_mm and lead_out_mm."
        )
    t_s = times_along(way_mm, path.speed_mm_s, path.ramp_mm)
    lasts_s = np.diff(t_s)
    return Trajectory(
        t_s=t_s,
        position_mm=np.column_stack([points_mm, np.full(len(points_mm), path.nozzle_height_mm)]),
        s_mm=s_mm,
        speed_mm_s=np.append(np.diff(way_mm) / lasts_s, 0.0),
        flow_mm3_s=np.append(volume_mm3 * share / lasts_s, 0.0),
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


def _check_lengths(length_mm: float, path: NozzlePath) -> None:
    first_mm, last_mm = path.trims_mm
    if length_mm < first_mm + last_mm + path.spacing_mm:
        trims = f"2 x {first_mm:g}" if first_mm == last_mm else f"{first_mm:g} and {last_mm:g}"
        raise InputError(
            f"Centreline {length_mm:.1f} mm: too short to trim {trims} mm and leave a step of "
            f"{path.spacing_mm:g} mm. Reduce trim_mm."
        )
    if (length_mm + path.lead_in_mm + path.lead_out_mm) / path.spacing_mm > MOST_WAYPOINTS:
        raise InputError(
            f"spacing_mm is {path.spacing_mm:g}: more than {MOST_WAYPOINTS} waypoints on {length_mm:.0f} mm of crack. "
            "Choose a larger spacing."
        )


def _waypoints(centreline_mm: Floats, path: NozzlePath) -> tuple[Floats, Floats, Floats]:
    """Arc length on the centreline, place and heading of each waypoint, evenly spaced along the smoothed path."""
    at_mm, smooth = smooth_centreline(centreline_mm, path.smoothing_mm)
    flown_mm = arc_length(smooth)
    from_start_mm, from_end_mm = path.trims_mm
    first, last = np.interp([from_start_mm, at_mm[-1] - from_end_mm], at_mm, flown_mm)
    even_mm = np.linspace(first, last, max(1, int(np.ceil((last - first) / path.spacing_mm - ROUNDING))) + 1)
    tangents = np.gradient(smooth, flown_mm, axis=0)
    points_mm, headings = (
        np.column_stack([np.interp(even_mm, flown_mm, column) for column in values.T]) for values in (smooth, tangents)
    )
    headings /= np.linalg.norm(headings, axis=1, keepdims=True)
    return np.interp(even_mm, flown_mm, at_mm), points_mm, headings


def _steps(length_mm: float, spacing_mm: float) -> Floats:
    """Distances from an end of the path to the waypoints of the lead beyond it, the nearest first."""
    count = int(np.ceil(length_mm / spacing_mm - ROUNDING))
    return length_mm / max(count, 1) * np.arange(1, count + 1, dtype=float)


def _shares(s_mm: Floats, points_mm: Floats, path: NozzlePath, sections: Sections | None) -> Floats:
    """Of the volume, between each waypoint and the next; their sum is 1."""
    if path.flow == "constant":
        share = np.diff(arc_length(points_mm))
    else:
        if sections is None:
            raise ValueError('flow = "cross_section" without sections')
        # Sections change faster than waypoints come where a crack tapers: their integral, so that nothing is skipped.
        grid_mm = np.unique(np.concatenate([s_mm, sections.s_mm]))
        area_mm2 = np.interp(grid_mm, sections.s_mm, sections.area_mm2)
        below_mm3 = np.concatenate([[0.0], np.cumsum((area_mm2[1:] + area_mm2[:-1]) / 2 * np.diff(grid_mm))])
        share = np.abs(np.diff(np.interp(s_mm, grid_mm, below_mm3)))
        if not share.sum() > 0:
            raise InputError(
                f'flow is "cross_section", but the cavity has no section between s = {s_mm.min():g} and '
                f'{s_mm.max():g} mm. Check depth_mm, or set flow = "constant".'
            )
    return share / share.sum()


def _volume_mm3(path: NozzlePath, cavity_volume_mm3: float) -> float:
    if path.volume_ml != "cavity":
        return path.volume_ml * 1000.0
    if not cavity_volume_mm3 > 0:
        raise InputError(
            f'volume_ml is "cavity", but the cavity holds {cavity_volume_mm3:g} mm³. Give volume_ml a number.'
        )
    volume_mm3 = path.fill * cavity_volume_mm3
    if volume_mm3 > 1000 * LARGEST_VOLUME_ML:
        filled = "" if path.fill == 1 else f", which fill = {path.fill:g} makes {volume_mm3 / 1000:.0f} ml"
        raise InputError(
            f'volume_ml is "cavity", but the cavity holds {cavity_volume_mm3 / 1000:.0f} ml{filled}, more than the '
            f"{LARGEST_VOLUME_ML:g} ml that one path may give. Check depth_mm and the scale of the photo, or give "
            "volume_ml a number."
        )
    return volume_mm3
