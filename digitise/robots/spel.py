"""A SPEL+ function for an Epson arm.

Statements as in Epson RC+'s SPEL+ Language Reference: point assignments ``P1 = XY(x, y, z, u) /R``, with ``:ST(s, t)``
for added axes; Move P1 CP, which does not stop there; SpeedS in mm/s and AccelS in mm/s² of straight and curved motion;
On and Off of an output bit; ``Curve "name", O, 0, n, P(first:last)``, an open spline in n coordinates through 3 to 200
points that are close to evenly spaced, and ``CVMove "name"``, which follows it at one speed. A point file (.pts)
carries a checksum that is not public: points are assigned, and none is written.
"""

import numpy as np

from digitise.geometry.polyline import at_arc_length
from digitise.robots.cell import SPEL_POINTS, Spel
from digitise.robots.placed import RobotPath, level_flow_mm3_s, plunger_mm, reach_faults, tilt_faults
from digitise.robots.text import comments, decimal
from sealtwin.records import Floats, arc_length

FEWEST_IN_CURVE, MOST_IN_CURVE = 3, 200
THINNED_MM = 0.05
"""How far the path may lie from the straight lines between the points that a curve keeps: half the default smoothing,
and the controller's spline lies nearer."""
SLOWEST_MM_S = 0.1
"""Of SpeedS."""
EVEN = 1e-4
"""Relative: a constant speed or dose, after the six decimals of a trajectory.csv."""

Places = Floats
"""(n, 4): x, y, z, and the added axis where one presses the plunger."""


def spel_text(path: RobotPath) -> str:
    """Over the path, down, along it with the dispenser on over the crack, and up.

    Where z presses the plunger the arm cannot lift the nozzle: the program then goes straight to the first waypoint.

    Raises InputError where a curve cannot have the path's speeds and doses, the points do not fit into a controller, or
    plunger, tilt or reach do not allow it.
    """
    settings = path.cell.spel
    if settings is None:
        raise ValueError("a cell without [spel]")
    places = _places(path, settings)
    follow = _along_curve if settings.motion == "curve" else _along_moves
    lifts = settings.dispenser != "z"
    named, motion = follow(path, settings, places, settings.first_point + lifts)
    if lifts:
        over = [np.append(path.above_start_mm, places[0, 3]), np.append(path.above_end_mm, places[-1, 3])]
        named = np.vstack([over[0], named, over[1]])
    path.refuse(
        [
            *tilt_faults(path),
            *reach_faults("the SPEL+ program, on its way to the path, along it or from it,", named[:, :3], path.cell),
            *_number_faults(len(named), settings),
        ]
    )
    first, last = settings.first_point, settings.first_point + len(named) - 1
    approach = f"  SpeedS {decimal(path.cell.motion.approach_speed_mm_s, 3)}"
    lines = [
        *comments("'", [*path.head, *_notes(path, settings, first, last)]),
        "Function sealtwin",
        f"  Tool {settings.tool}",
        *(f"  P{first + row} = {_pose(place, settings)}" for row, place in enumerate(named)),
        f"  AccelS {decimal(path.cell.motion.acceleration_mm_s2, 1)}",
        approach,
        *([f"  Move P{first}"] if lifts else []),
        *motion,
        *([approach, f"  Move P{last}"] if lifts else []),
        "Fend",
    ]
    return "\n".join(lines) + "\n"


def _places(path: RobotPath, settings: Spel) -> Places:
    """What each waypoint asks of the arm's own coordinates and of the added axis."""
    places = np.column_stack([path.trajectory.position_mm, np.zeros(len(path.trajectory.t_s))])
    if settings.axis_start_mm is not None:
        onward = 1.0 if settings.axis_gives == "+" else -1.0
        places[:, 2 if settings.dispenser == "z" else 3] = settings.axis_start_mm + onward * plunger_mm(path)
    return places


def _along_curve(path: RobotPath, settings: Spel, places: Places, number: int) -> tuple[Places, list[str]]:
    """Leads by Move, the crack by CVMove. Returns the places to name, from P ``number`` on, and the statements."""
    giving, lasts_s = path.trajectory.giving, np.diff(path.trajectory.t_s)
    crack = places[giving]
    step_mm = np.linalg.norm(np.diff(crack[:, :3], axis=0), axis=1)
    speed_mm_s = step_mm / lasts_s[giving.start : giving.stop - 1]
    path.refuse([*_uneven_faults(path, speed_mm_s), *_speed_faults(path, speed_mm_s)])
    crack = _for_curve(path, crack)
    before, after = places[: min(giving.start, 1)], places[giving.stop :][-1:]
    begins, ends = number + len(before), number + len(before) + len(crack) - 1
    speed = decimal(float(speed_mm_s.mean()), 3)
    axes = 4 if settings.vw_deg is None else 6
    lines = [
        # Before the arm moves: between blended motions it would have to wait for the spline.
        f'  Curve "crack", O, 0, {axes}, P({begins}:{ends})',
        f"  Move P{number}",
        f"  SpeedS {speed}",
        *([f"  Move P{begins} CP"] if len(before) else []),
        *([f"  On {settings.output_bit}"] if settings.dispenser == "output" else []),
        f'  CVMove "crack"{" CP" if len(after) else ""}',
        *([f"  Off {settings.output_bit}"] if settings.dispenser == "output" else []),
        *([f"  Move P{ends + 1}"] if len(after) else []),
    ]
    return np.vstack([before, crack, after]), lines


def _along_moves(path: RobotPath, settings: Spel, places: Places, number: int) -> tuple[Places, list[str]]:
    """A Move for each waypoint, each with its speed, as ``_along_curve``."""
    trajectory = path.trajectory
    speed_mm_s = np.linalg.norm(np.diff(places[:, :3], axis=0), axis=1) / np.diff(trajectory.t_s)
    path.refuse(_speed_faults(path, speed_mm_s))
    flowing = trajectory.flow_mm3_s > 0
    switched = settings.dispenser == "output"
    lines, speed, is_on, last = [f"  Move P{number}"], "", False, len(places) - 1
    for row in range(last):
        if switched and flowing[row] != is_on:
            is_on = not is_on
            lines.append(f"  {'On' if is_on else 'Off'} {settings.output_bit}")
        if (asked := decimal(float(speed_mm_s[row]), 3)) != speed:
            speed = asked
            lines.append(f"  SpeedS {speed}")
        lines.append(f"  Move P{number + row + 1}{' CP' if row + 1 < last else ''}")
    return places, [*lines, *([f"  Off {settings.output_bit}"] if is_on else [])]


def _for_curve(path: RobotPath, crack: Places) -> Places:
    """As many points, evenly spaced, as a Curve takes. Raises InputError where so few would leave the path."""
    count = int(np.clip(len(crack), FEWEST_IN_CURVE, MOST_IN_CURVE))
    if count == len(crack):
        return crack
    s_mm = arc_length(crack[:, :3])
    stations = np.linspace(0.0, s_mm[-1], count)
    kept = at_arc_length(crack, s_mm, stations)
    off_mm = np.linalg.norm(at_arc_length(kept, stations, s_mm)[:, :3] - crack[:, :3], axis=1).max()
    if off_mm > THINNED_MM:
        path.refuse(
            [
                f"a Curve of SPEL+ takes {MOST_IN_CURVE} points, the path has {len(crack)} over the crack, and so few "
                f'leave it by {off_mm:.2f} mm; {THINNED_MM:g} are allowed. Set spel.motion = "move".'
            ]
        )
    return kept


def _uneven_faults(path: RobotPath, speed_mm_s: Floats) -> list[str]:
    """Why CVMove, at one speed and with as much for every millimetre, is not what was planned."""
    giving = path.trajectory.giving
    flow_mm3_s = path.trajectory.flow_mm3_s[giving.start : giving.stop - 1]
    faults = []
    for what, unit, values in (("speed", "mm/s", speed_mm_s), ("flow", "mm³/s", flow_mm3_s)):
        if values.max() > values.min() * (1 + EVEN):
            faults.append(
                f"CVMove keeps one {what}, and the path's over the crack goes from {values.min():.4g} to "
                f'{values.max():.4g} {unit}. Set spel.motion = "move"; or digitise with path.flow = "constant" and '
                "either no path.ramp_mm or leads as long as it."
            )
    return faults


def _speed_faults(path: RobotPath, speed_mm_s: Floats) -> list[str]:
    """Of the arm, which goes faster than the nozzle along the path where its z presses the plunger as well."""
    faults, largest_mm_s = [], path.cell.motion.largest_speed_mm_s
    if speed_mm_s.min() < SLOWEST_MM_S:
        faults.append(
            f"SpeedS takes {SLOWEST_MM_S:g} mm/s or more, and the path has {speed_mm_s.min():.3g}. Digitise with a "
            "higher path.speed_mm_s, or a coarser path.spacing_mm on a ramp."
        )
    if speed_mm_s.max() > largest_mm_s * (1 + EVEN):
        faults.append(
            f"along the path and down with the plunger the arm goes at {speed_mm_s.max():.4g} mm/s; "
            f"motion.largest_speed_mm_s allows {largest_mm_s:g}. Digitise with a lower path.speed_mm_s."
        )
    return faults


def _number_faults(count: int, settings: Spel) -> list[str]:
    if settings.first_point + count <= SPEL_POINTS:
        return []
    return [
        f"the SPEL+ program needs {count} points from P{settings.first_point} on; P{SPEL_POINTS - 1} is the last. "
        "Lower spel.first_point, or digitise with a larger path.spacing_mm."
    ]


def _pose(place: Floats, settings: Spel) -> str:
    angles = [settings.u_deg, *(settings.vw_deg or ())]
    coordinates = ", ".join([*(decimal(float(value), 3) for value in place[:3]), *(decimal(a, 3) for a in angles)])
    added = decimal(float(place[3]), 4)
    axes = {"s": f" :ST({added}, 0)", "t": f" :ST(0, {added})"}.get(settings.dispenser, "")
    hand = "/R" if settings.hand == "right" else "/L"
    local = f" /{settings.local}" if settings.local else ""
    return f"XY({coordinates}){axes} {hand}{local}"


def _notes(path: RobotPath, settings: Spel, first: int, last: int) -> list[str]:
    notes = [
        "Units: mm, degrees, mm/s. Switch motors on and set the power mode before, then call this function.",
        f"Overwrites P{first} to P{last} in memory. Tool {settings.tool}, Local {settings.local}.",
    ]
    if settings.dispenser == "output":
        flow = level_flow_mm3_s(path, "an output that is on or off", "let an axis press the plunger")
        notes.append(f"Set the dispenser at output {settings.output_bit} to {flow:.4f} mm3/s before.")
    else:
        notes.append(f"Axis {settings.dispenser} presses the plunger, ready to give at {settings.axis_start_mm:g} mm.")
    if settings.dispenser == "z":
        notes.append("The arm cannot lift the nozzle: its way to the first point must be free.")
    return notes
