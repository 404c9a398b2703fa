"""SPEL+ function for an Epson arm.

Statements are those of Epson RC+'s SPEL+ Language Reference: point assignments ``P1 = XY(x, y, z, u) /R``, with
``:ST(s, t)`` for added axes; Move P1 CP, which does not stop there; SpeedS in mm/s and AccelS in mm/s² of straight and
curved motion; On and Off of an output bit; ``Curve "name", O, 0, n, P(first:last)``, an open spline in n coordinates
through 3 to 200 points that are close to evenly spaced, and ``CVMove "name"``, which follows it at one speed. A point
file (.pts) needs a checksum that is not public, so points are assigned in the program.
"""

import numpy as np

from digitise.geometry.polyline import at_arc_length
from digitise.robots.cell import SPEL_POINTS, Spel
from digitise.robots.robot_path import Limit, RobotPath, comments, decimal
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import present
from sealtwin.core.records import Floats

FEWEST_IN_CURVE, MOST_IN_CURVE = 3, 200
THINNED_MM = 0.05  # Largest distance of the path from lines between a curve's points: half the default smoothing
SLOWEST_MM_S = 0.1  # Least value of SpeedS
EVEN = 1e-4  # Relative range of a constant speed or dose, after the six decimals of a trajectory.csv

Places = Floats  # Coordinates x, y, z, and that of an added axis that presses the plunger, (n, 4)


def spel_text(path: RobotPath) -> str:
    """Return the program. Raises InputError if a limit of the cell, the language or the controller is exceeded."""
    settings = present(path.cell.spel, "[spel]")
    places = _places(path, settings)
    follow = _along_curve if settings.motion == "curve" else _along_moves
    lifts = settings.dispenser != "z"
    named, motion = follow(path, settings, places, settings.first_point + lifts)
    if lifts:
        over = np.column_stack([path.over_mm, places[[0, -1], 3]])
        named = np.vstack([over[0], named, over[1]])
    first, last = settings.first_point, settings.first_point + len(named) - 1
    path.require(
        path.tilt_limit,
        path.reach_limit("the SPEL+ program, on its way to the path, along it or from it,", named[:, :3]),
        (
            last >= SPEL_POINTS,
            f"the SPEL+ program needs {len(named)} points from P{first} on, but P{SPEL_POINTS - 1} is the last one. "
            "Lower spel.first_point, or digitise with a larger path.spacing_mm.",
        ),
    )
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
    """Return the coordinates of the arm and of the added axis at each waypoint."""
    places = np.column_stack([path.trajectory.position_mm, np.zeros(len(path.trajectory.t_s))])
    if settings.axis_start_mm is not None:
        onward = 1.0 if settings.axis_gives == "+" else -1.0
        places[:, 2 if settings.dispenser == "z" else 3] = settings.axis_start_mm + onward * path.plunger_mm()
    return places


def _along_curve(path: RobotPath, settings: Spel, places: Places, number: int) -> tuple[Places, list[str]]:
    """Write leads with Move and the crack with CVMove; return the points from P ``number`` on, and the statements."""
    giving = path.trajectory.giving
    crack = places[giving]
    speed_mm_s = np.linalg.norm(np.diff(crack[:, :3], axis=0), axis=1) / np.diff(path.trajectory.t_s[giving])
    path.require(*_evenness_limits(path, speed_mm_s), *_speed_limits(path, speed_mm_s))
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
        *([f"  Move P{begins}{_blend(path)}"] if len(before) else []),
        *([f"  On {settings.output_bit}", *_wait(path)] if settings.dispenser == "output" else []),
        f'  CVMove "crack"{" CP" if len(after) else ""}',
        *([f"  Off {settings.output_bit}"] if settings.dispenser == "output" else []),
        *([f"  Move P{ends + 1}"] if len(after) else []),
    ]
    return np.vstack([before, crack, after]), lines


def _along_moves(path: RobotPath, settings: Spel, places: Places, number: int) -> tuple[Places, list[str]]:
    """Write a Move with its own speed for each waypoint. Return the points from P ``number`` on, and the statements."""
    trajectory = path.trajectory
    speed_mm_s = np.linalg.norm(np.diff(places[:, :3], axis=0), axis=1) / np.diff(trajectory.t_s)
    path.require(*_speed_limits(path, speed_mm_s))
    flowing = trajectory.flow_mm3_s > 0
    switched = settings.dispenser == "output"
    lines, speed, is_on, last = [f"  Move P{number}"], "", False, len(places) - 1
    for row in range(last):
        if switched and flowing[row] != is_on:
            is_on = not is_on
            lines.append(f"  {'On' if is_on else 'Off'} {settings.output_bit}")
            # Only once: a path gives without a pause.
            lines += _wait(path) if row == trajectory.giving.start else []
        if (wanted := decimal(float(speed_mm_s[row]), 3)) != speed:
            speed = wanted
            lines.append(f"  SpeedS {speed}")
        onward = "" if row + 1 == last else _blend(path) if row + 1 == trajectory.giving.start else " CP"
        lines.append(f"  Move P{number + row + 1}{onward}")
    return places, [*lines, *([f"  Off {settings.output_bit}"] if is_on else [])]


def _blend(path: RobotPath) -> str:
    """Write the suffix that blends a motion into the next one, unless the nozzle waits between them."""
    return "" if path.hold_s > 0 else " CP"


def _wait(path: RobotPath) -> list[str]:
    """Write the statement that waits for the first sealant."""
    return [f"  Wait {decimal(path.hold_s, 3)}"] if path.hold_s > 0 else []


def _for_curve(path: RobotPath, crack: Places) -> Places:
    """Return evenly spaced points, as many as a Curve takes. Raises InputError if these are too few for the path."""
    count = int(np.clip(len(crack), FEWEST_IN_CURVE, MOST_IN_CURVE))
    if count == len(crack):
        return crack
    s_mm = arc_length(crack[:, :3])
    stations = np.linspace(0.0, s_mm[-1], count)
    thinned = at_arc_length(crack, s_mm, stations)
    off_mm = np.linalg.norm(at_arc_length(thinned, stations, s_mm)[:, :3] - crack[:, :3], axis=1).max()
    fault = (
        f"the path has {len(crack)} points over the crack. A Curve of SPEL+ takes at most {MOST_IN_CURVE}, which "
        f'would deviate from the path by {off_mm:.2f} mm; {THINNED_MM:g} are allowed. Set spel.motion = "move".'
    )
    path.require((off_mm > THINNED_MM, fault))
    return thinned


def _evenness_limits(path: RobotPath, speed_mm_s: Floats) -> list[Limit]:
    """Return the limits of speed and dose over the crack. A CVMove has only one speed and one dose."""
    giving = path.trajectory.giving
    flow_mm3_s = path.trajectory.flow_mm3_s[giving.start : giving.stop - 1]
    return [
        (
            values.max() > values.min() * (1 + EVEN),
            f"CVMove keeps one {what}, but that of the path over the crack ranges from {values.min():.4g} to "
            f'{values.max():.4g} {unit}. Set spel.motion = "move"; or digitise with path.flow = "constant" and with '
            "leads as long as path.ramp_mm, or without path.ramp_mm.",
        )
        for what, unit, values in (("speed", "mm/s", speed_mm_s), ("flow", "mm³/s", flow_mm3_s))
    ]


def _speed_limits(path: RobotPath, speed_mm_s: Floats) -> list[Limit]:
    """Return the limits of the arm's speed, which exceeds the nozzle's if its z presses the plunger too."""
    fastest_mm_s = speed_mm_s.max()
    fault = f"the arm, which also presses the plunger, moves at {fastest_mm_s:.4g} mm/s"
    return [
        (
            speed_mm_s.min() < SLOWEST_MM_S,
            f"SpeedS takes {SLOWEST_MM_S:g} mm/s or more, but the path has {speed_mm_s.min():.3g}. Digitise with a "
            "higher path.speed_mm_s, or a coarser path.spacing_mm on a ramp.",
        ),
        path.motion_limit("largest_speed_mm_s", fastest_mm_s, fault, "Digitise with a lower path.speed_mm_s.", EVEN),
    ]


def _pose(place: Floats, settings: Spel) -> str:
    values = (*place[:3].tolist(), settings.u_deg, *(settings.vw_deg or ()))
    coordinates, added = ", ".join(decimal(value, 3) for value in values), decimal(float(place[3]), 4)
    axes = {"s": f" :ST({added}, 0)", "t": f" :ST(0, {added})"}.get(settings.dispenser, "")
    hand = "/R" if settings.hand == "right" else "/L"
    local = f" /{settings.local}" if settings.local else ""
    return f"XY({coordinates}){axes} {hand}{local}"


def _notes(path: RobotPath, settings: Spel, first: int, last: int) -> list[str]:
    notes = [
        "Units: mm, degrees, mm/s. First switch the motors on and set the power mode, then call this function.",
        f"Overwrites P{first} to P{last} in memory. Tool {settings.tool}, Local {settings.local}.",
    ]
    if settings.dispenser == "output":
        flow = path.level_flow_mm3_s("an output that is on or off", "let an axis press the plunger")
        notes.append(f"First set the dispenser at output {settings.output_bit} to {flow:.4f} mm3/s.")
    else:
        notes.append(
            f"Axis {settings.dispenser} presses the plunger and is ready to give sealant at "
            f"{settings.axis_start_mm:g} mm."
        )
    if settings.dispenser == "z":
        notes.append("The arm cannot lift the nozzle: its way to the first point must be free.")
    return notes
