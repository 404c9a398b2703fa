"""Plan the nozzle's timed path over a crack, smooth and with straight leads, and the flow along the path."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import splev, splprep

from digitise.planned_path import PathTable
from digitise.settings import LARGEST_VOLUME_ML, NozzlePath
from sealtwin.core.arc_length import arc_length, arc_length_at, at_arc_length
from sealtwin.core.arrays import lengths, midpoints, rms
from sealtwin.core.errors import InputError, present
from sealtwin.core.facts import Facts, doubt
from sealtwin.core.records import Floats, Outline, Sections, Solid, Trajectory
from sealtwin.core.settings import doubts_of
from sealtwin.core.solid_figures import PathFigures

# At a waypoint with a larger turn, an arm slows down and leaves a lump. Winding cracks have turns up to 8 degrees
SHARP_TURN_DEG = 20.0
STRAIGHT_MM = 1e5  # A bend with a larger radius is only rounding error
SAMPLE_MM = 0.25  # Equal spacing of the centreline's points before smoothing, so that every millimetre has equal weight
FINEST_SAMPLES, MAX_SAMPLES = 17, 20_000
MAX_WAYPOINTS = 100_000  # Largest number of waypoints of a path: a metre of crack at a hundredth of a millimetre
# Largest and smallest ratio of sealant to cavity volume without a warning. The paper has 0.8 to 1.2
MUCH_SEALANT, LITTLE_SEALANT = 3.0, 0.1
ROUNDING = 1e-9


def times_along(way_mm: Floats, speed_mm_s: float, ramp_mm: float) -> Floats:
    """Return the time in s at which the nozzle reaches each distance from the path's start, (n,).

    On a ramp of length R, which is at most half of the path, the nozzle accelerates by v² / (2 R) to the full speed v.
    It reaches the distance x at t = 2 sqrt(R x) / v.
    """
    length_mm = way_mm[-1]
    into_mm = np.minimum(way_mm, ramp_mm)
    to_end_mm = np.minimum(length_mm - way_mm, ramp_mm)
    even_mm = np.clip(way_mm - ramp_mm, 0.0, length_mm - 2 * ramp_mm)
    return (2 * np.sqrt(ramp_mm * into_mm) + even_mm + 2 * (ramp_mm - np.sqrt(ramp_mm * to_end_mm))) / speed_mm_s


def with_path(solid: Solid, trajectory: Trajectory, outline: Outline, path: NozzlePath) -> Solid:
    """Return the solid with the figures of a path, and with warnings about the path, added to its figures."""
    of_path, doubts = path_report(trajectory, outline, path)
    sealant_mm3 = trajectory.dispensed_mm3
    figures = replace(
        solid.figures,
        sealant_mm3=sealant_mm3,
        cavity_to_sealant=solid.cavity_volume_mm3 / sealant_mm3,
        path=of_path,
        warnings=(
            *solid.figures.warnings,
            *doubts,
            *doubts_of(path),
            *volume_warnings(sealant_mm3, solid.cavity_volume_mm3),
        ),
    )
    return replace(solid, figures=figures)


def path_report(trajectory: Trajectory, outline: Outline, path: NozzlePath) -> tuple[PathFigures, Facts]:
    """Return the figures of a path, without its leads, and warnings about the path."""
    giving = trajectory.giving
    s_mm, position_mm = trajectory.s_mm[giving], trajectory.position_mm[giving]
    points_mm = position_mm[:, :2]
    dose_mm3_per_mm = trajectory.given_mm3[giving.start : giving.stop - 1] / np.diff(arc_length(position_mm))
    _, off_mm = _beside(outline, points_mm)
    turn_deg = turns_deg(points_mm)
    sines = np.sin(np.radians(turn_deg))
    chords_mm = lengths(points_mm[2:] - points_mm[:-2])
    # Radius of the circle through three consecutive waypoints.
    smallest_mm = float((chords_mm / (2 * np.maximum(sines, ROUNDING))).min(initial=np.inf))
    moving = trajectory.speed_mm_s[:-1]
    figures = PathFigures(
        length_mm=float(arc_length(points_mm)[-1]),
        centreline_mm=float(abs(s_mm[-1] - s_mm[0])),
        smoothing_mm=path.smoothing_mm,
        off_centreline_rms_mm=rms(off_mm),
        off_centreline_worst_mm=float(off_mm.max()),
        largest_turn_deg=float(turn_deg.max(initial=0.0)),
        smallest_radius_mm=smallest_mm if smallest_mm <= STRAIGHT_MM else None,
        starts_at_s_mm=float(trajectory.s_mm[0]),
        ends_at_s_mm=float(trajectory.s_mm[-1]),
        waypoints=len(trajectory.t_s),
        duration_s=trajectory.duration_s,
        speed_mm_s=(float(moving.min()), float(moving.max())),
        sealant_mm3_per_mm=(float(dose_mm3_per_mm.min()), float(dose_mm3_per_mm.max())),
    )
    return figures, _warnings(path, outline, s_mm, turn_deg, off_mm)


def turns_deg(points_mm: Floats) -> Floats:
    """Return the change of direction in degrees at each inner waypoint, (n - 2,)."""
    x_mm, y_mm = np.diff(points_mm[:, :2], axis=0).T
    return np.degrees(np.abs(np.diff(np.unwrap(np.arctan2(y_mm, x_mm)))))


def _warnings(path: NozzlePath, outline: Outline, s_mm: Floats, turn_deg: Floats, off_mm: Floats) -> Facts:
    warnings = []
    if turn_deg.max(initial=0.0) > SHARP_TURN_DEG:
        row = int(turn_deg.argmax()) + 1
        text = (
            f"the nozzle's path turns by {turn_deg[row - 1]:.0f} degrees at s = {s_mm[row]:.1f} mm, where an arm "
            f"slows down and leaves a lump. Set smoothing_mm above {path.smoothing_mm:g} to round the path"
        )
        warnings.append(doubt("nozzle.sharp-turn", text, float(turn_deg[row - 1]), "deg"))
    if off_mm.max() > outline.mean_width_mm / 2:
        row = int(off_mm.argmax())
        text = (
            f"at s = {s_mm[row]:.1f} mm smoothing moves the nozzle {off_mm[row]:.2f} mm off the middle of a crack "
            f"that is {outline.mean_width_mm:.2f} mm wide. Set smoothing_mm below {path.smoothing_mm:g} to keep the "
            "nozzle over the crack"
        )
        warnings.append(doubt("nozzle.off-centre", text, float(off_mm[row]), "mm"))
    return tuple(warnings)


def plan_trajectory(
    outline: Outline, path: NozzlePath, cavity_volume_mm3: float = 0.0, sections: Sections | None = None
) -> Trajectory:
    """Plan evenly spaced waypoints on a smoothed centreline between the trims, with a straight lead at each end.

    Row i applies from ``t_s[i]`` to ``t_s[i + 1]``: the nozzle moves straight to the next waypoint at ``speed_mm_s``
    and gives ``flow_mm3_s``. Both are 0 in the last row. ``s_mm`` is the arc length on the outline's own centreline. It
    decreases along a reversed path, and continues along the leads. The volume per millimetre does not depend on the
    speed. If volume_ml is "cavity" but there is no cavity, the volume is 0. If the settings contain a plan, the plan is
    returned instead.

    Raises InputError if the path is too short for its trims or ramps, has too many waypoints, or gives too much
    sealant, or if a plan gives sealant beside the crack.
    """
    if (planned := path.planned) is not None:
        return _as_planned(outline, planned)
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
    share = np.pad(share, (len(before_mm), len(after_mm)))
    way_mm = arc_length(points_mm)
    if way_mm[-1] < 2 * path.ramp_mm:
        raise InputError(
            f"ramp_mm is {path.ramp_mm:g}, but two ramps do not fit into a path of {way_mm[-1]:.1f} mm, leads "
            f"included. Give at most {np.floor(way_mm[-1] * 5) / 10:g}, or a longer lead_in_mm and lead_out_mm."
        )
    t_s = times_along(way_mm, path.speed_mm_s, path.ramp_mm)
    lasts_s = np.diff(t_s)
    return Trajectory(
        t_s=t_s,
        position_mm=np.column_stack([points_mm, np.full(len(points_mm), path.nozzle_height_mm)]),
        s_mm=s_mm,
        speed_mm_s=np.append(np.diff(way_mm) / lasts_s, 0.0),
        flow_mm3_s=np.append(volume_mm3 * share / lasts_s, 0.0),
        has_origin=outline.has_origin,
    )


def _as_planned(outline: Outline, planned: PathTable) -> Trajectory:
    s_mm, off_mm = _beside(outline, planned.place_mm[:, :2])
    gives = np.flatnonzero(planned.flow > 0)
    if (off_mm := off_mm[gives]).max() > outline.mean_width_mm:
        worst = int(gives[off_mm.argmax()])
        raise InputError(
            f"path.plan, row {worst + 1}: this row gives sealant {off_mm.max():.1f} mm from the middle of the crack, "
            f"which is {outline.mean_width_mm:.1f} mm wide. The plan belongs to another crack or frame. Make a new "
            "plan."
        )
    return Trajectory(
        t_s=np.array(planned.t_s),
        position_mm=planned.place_mm,
        s_mm=s_mm,
        speed_mm_s=planned.speed_mm_s,
        flow_mm3_s=planned.flow,
        has_origin=outline.has_origin,
    )


def _beside(outline: Outline, points_mm: Floats) -> tuple[Floats, Floats]:
    """Return the arc length of the centreline's point nearest to each point, and its distance from it, (n,) each."""
    s_mm = arc_length_at(points_mm, outline.centreline_mm)
    return s_mm, lengths(points_mm - at_arc_length(outline.centreline_mm, outline.s_mm, s_mm))


def begun_late(trajectory: Trajectory, delay_s: float) -> Trajectory:
    """Return the path with all flow delayed by ``delay_s``.

    The nozzle's motion and the end of the flow do not change.
    """
    own_s = trajectory.t_s
    t_s = np.unique(np.concatenate([own_s, own_s[own_s + delay_s < own_s[-1]] + delay_s]))
    moves = np.searchsorted(own_s, t_s, side="right") - 1
    gives = np.searchsorted(own_s + delay_s, t_s, side="right") - 1
    flows = (gives >= 0) & (t_s < own_s[trajectory.giving][-1])
    return Trajectory(
        t_s=t_s,
        position_mm=at_arc_length(trajectory.position_mm, own_s, t_s),
        s_mm=np.interp(t_s, own_s, trajectory.s_mm),
        speed_mm_s=trajectory.speed_mm_s[moves],
        flow_mm3_s=trajectory.flow_mm3_s[gives] * flows,
    )


def volume_warnings(sealant_mm3: float, cavity_mm3: float) -> Facts:
    """Return a warning if the volume of sealant is implausible for the volume of the cavity."""
    times = sealant_mm3 / cavity_mm3
    if LITTLE_SEALANT <= times <= MUCH_SEALANT:
        return ()
    text = (
        f"volume_ml gives {sealant_mm3 / 1000:.4g} ml of sealant to a cavity of {cavity_mm3 / 1000:.4g} ml, "
        f"{times:.3g} times as much: "
        f"{'most of the sealant will spill' if times > 1 else 'the crack will hardly be wetted'}. Check volume_ml and "
        'depth_mm, or set volume_ml = "cavity"'
    )
    return (doubt("nozzle.volume", text, times),)


def smooth_centreline(centreline_mm: Floats, smoothing_mm: float) -> tuple[Floats, Floats]:
    """Return arc lengths, (n,), and points, (n, 2), of a smoothing spline (Dierckx 1982) at every ``SAMPLE_MM``."""
    s_mm = arc_length(centreline_mm)
    count = int(np.clip(np.ceil(s_mm[-1] / SAMPLE_MM) + 1, FINEST_SAMPLES, MAX_SAMPLES))
    at_mm = np.linspace(0.0, s_mm[-1], count)
    samples = at_arc_length(centreline_mm, s_mm, at_mm)
    spline, _ = splprep(samples.T, u=at_mm, k=3, s=count * smoothing_mm**2)
    return at_mm, np.column_stack(splev(at_mm, spline))


def _check_lengths(length_mm: float, path: NozzlePath) -> None:
    first_mm, last_mm = path.trims_mm
    if length_mm < first_mm + last_mm + path.spacing_mm:
        raise InputError(
            f"The centreline is {length_mm:.1f} mm long, which is too short to trim {first_mm:g} and {last_mm:g} mm "
            f"and leave a step of {path.spacing_mm:g} mm. Reduce trim_mm."
        )
    if (length_mm + path.lead_in_mm + path.lead_out_mm) / path.spacing_mm > MAX_WAYPOINTS:
        raise InputError(
            f"spacing_mm is {path.spacing_mm:g}, but a crack of {length_mm:.0f} mm would then need more than "
            f"{MAX_WAYPOINTS} waypoints. Choose a larger spacing_mm."
        )


def _waypoints(centreline_mm: Floats, path: NozzlePath) -> tuple[Floats, Floats, Floats]:
    """Return waypoints evenly spaced along the smoothed path.

    Returns the arc length on the centreline, (n,), the position, (n, 2), and the unit vector along the path, (n, 2).
    """
    at_mm, smooth = smooth_centreline(centreline_mm, path.smoothing_mm)
    flown_mm = arc_length(smooth)
    from_start_mm, from_end_mm = path.trims_mm
    first, last = np.interp([from_start_mm, at_mm[-1] - from_end_mm], at_mm, flown_mm)
    even_mm = np.linspace(first, last, max(1, int(np.ceil((last - first) / path.spacing_mm - ROUNDING))) + 1)
    points_mm, tangents = (
        at_arc_length(points, flown_mm, even_mm) for points in (smooth, np.gradient(smooth, flown_mm, axis=0))
    )
    headings = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
    return np.interp(even_mm, flown_mm, at_mm), points_mm, headings


def _steps(length_mm: float, spacing_mm: float) -> Floats:
    """Return the distances of a lead's waypoints from the end of the path in mm, (n,), nearest first."""
    count = int(np.ceil(length_mm / spacing_mm - ROUNDING))
    return np.linspace(0.0, length_mm, count + 1)[1:]


def _shares(s_mm: Floats, points_mm: Floats, path: NozzlePath, sections: Sections | None) -> Floats:
    """Return the fraction of the volume that is given between each waypoint and the next, (n - 1,). The sum is 1."""
    if path.flow == "constant":
        share = np.diff(arc_length(points_mm))
    else:
        sections = present(sections, "sections")
        # In a tapering crack, sections change between waypoints. They are therefore integrated.
        grid_mm = np.unique(np.concatenate([s_mm, sections.s_mm]))
        area_mm2 = np.interp(grid_mm, sections.s_mm, sections.area_mm2)
        steps_mm3 = np.diff(grid_mm) * midpoints(area_mm2)
        below_mm3 = np.cumsum(np.append(0.0, steps_mm3))
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
    volume_mm3 = path.fill * cavity_volume_mm3
    if volume_mm3 > 1000 * LARGEST_VOLUME_ML:
        raise InputError(
            f'volume_ml is "cavity", but fill = {path.fill:g} of the cavity is {volume_mm3 / 1000:.0f} ml, and one '
            f"path may give at most {LARGEST_VOLUME_ML:g} ml. Check the crack's depth and the scale, or set volume_ml "
            "to a number."
        )
    return volume_mm3
