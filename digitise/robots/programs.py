"""Robot files of a path: tables of points, and programs in three languages by one writer.

To add a language: a ``Language``, the function that fills it, and a row of ``PROGRAMS`` here; its name, settings and
checks in ``cell.py``; a table in ``sealtwin/templates/starter_cell.toml``; a row in ``docs/how-to/to-the-robot.md``;
and an independent reader in ``tests/robot_readers.py``.

G-code has the words of NIST RS274/NGC (Kramer, Proctor, Messina 2000) and of Marlin, in mm and mm/min. URScript has the
functions of The URScript Programming Language, in m and rad; a call after a blended move runs when the blend begins.
SPEL+ has the statements of Epson RC+'s Language Reference: ``P1 = XY(x, y, z, u) :ST(s, t) /R`` assigns a point, ``Move
P1 CP`` does not stop there, SpeedS is in mm/s, and ``Curve "name", O, 0, n, P(first:last)`` is an open spline in n
coordinates through close to evenly spaced points, which ``CVMove "name"`` follows at one speed. A point file (.pts)
needs a checksum that is not public, so points are assigned in the program.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from digitise.geometry.polyline import unit
from digitise.robots.cell import SPEL_POINTS, Format, Spel, Urscript
from digitise.robots.robot_path import EVEN, RobotPath, comments
from sealtwin.core.errors import present
from sealtwin.core.record_files import TRAJECTORY_COLUMNS
from sealtwin.core.records import Floats

E_DECIMALS = 5  # Of a plunger's way in mm
FEWEST_IN_CURVE, MOST_IN_CURVE = 3, 200
SLOWEST_MM_S = 0.1  # Least value of SpeedS
JOINT_SPEED_RAD_S = 0.5  # Half of URScript's default, as the acceleration in movej, where the arm chooses its path


@dataclass(frozen=True)
class Language:
    """Statements of a robot language, with braces for ``str.format``. Numbers have z, since controllers may read no -0.

    A statement that sets the dispenser or the speed is written before a motion if it differs from the one before.
    """

    comment: str  # Mark of a comment
    start: str  # Lines until the nozzle is at the first waypoint
    move: str  # Motion to the next waypoint
    end: str
    wait: str  # Waits for the first sealant
    output: str = ""  # Sets the dispenser
    speed: str = ""  # Sets the speed
    blend: str = ""  # Suffix of a motion without a stop
    stop: str = ""  # Suffix of a motion with a stop


GCODE = Language(
    comment=";",
    start=(
        "G21\nG90\nM82\n{cold}\nG92 E0\nG1 Z{above[0][2]:z.4f} F{approach:.3f}\n"
        "G1 X{above[0][0]:z.4f} Y{above[0][1]:z.4f} Z{above[0][2]:z.4f} F{approach:.3f}\n"
        "G1 X{begin[0]:z.4f} Y{begin[1]:z.4f} Z{begin[2]:z.4f} F{approach:.3f}"
    ),
    wait="{plunger_alone}",
    move="G1 X{place[0]:z.4f} Y{place[1]:z.4f} Z{place[2]:z.4f} E{e:z.5f} F{speed:.3f}",
    end="G1 X{above[1][0]:z.4f} Y{above[1][1]:z.4f} Z{above[1][2]:z.4f} F{approach:.3f}",
)
URSCRIPT = Language(
    comment="#",
    start=(
        "def sealtwin():\n  set_standard_{kind}_out({port}, {level})\n"
        "  movej(p[{above[0][0]:z.7f}, {above[0][1]:z.7f}, {above[0][2]:z.7f}, {turn}], a=0.7, v={joint_speed})\n"
        "  movel(p[{begin[0]:z.7f}, {begin[1]:z.7f}, {begin[2]:z.7f}, {turn}], a={acceleration:.7f}, v={approach:.7f})"
    ),
    output="  set_standard_{kind}_out({port}, {level})",
    wait="  sleep({hold_s:.3f})",
    move=(
        "  movep(p[{place[0]:z.7f}, {place[1]:z.7f}, {place[2]:z.7f}, {turn}], a={acceleration:.7f}, v={speed:.7f}, "
        "r={suffix})"
    ),
    blend="{blend_m:.7f}",
    stop="0.0000000",
    end=(
        "  set_standard_{kind}_out({port}, {level})\n"
        "  movel(p[{above[1][0]:z.7f}, {above[1][1]:z.7f}, {above[1][2]:z.7f}, {turn}], a={acceleration:.7f}, "
        "v={approach:.7f})\nend"
    ),
)
SPEL = Language(
    comment="'",
    start=(
        "Function sealtwin\n  Tool {tool}\n{points}\n  AccelS {acceleration:.1f}\n  SpeedS {approach:.3f}\n{lower}\n"
        "{curve}\n  Move P{begin}\n{curve_speed}"
    ),
    output="{level}",
    speed="{speed}",
    wait="{wait}",
    move="  {motion}{suffix}",
    blend=" CP",
    end="{switched_off}\n{lift}\nFend",
)


def written(
    language: Language, path: RobotPath, notes: Sequence[str], begins: int, values: dict[str, Any], **columns: Any
) -> str:
    """Return a program. ``columns`` has the values of each motion; motion ``begins`` is the first with sealant."""
    lines = [*comments(language.comment, [*path.head, *notes]), *language.start.format(**values).split("\n")]
    before = {language.output: language.output.format(**values)}
    motions = [dict(zip(columns, motion, strict=True)) for motion in zip(*columns.values(), strict=True)]
    for row, motion in enumerate(motions):
        stops = row == len(motions) - 1 or (path.hold_s > 0 and row == begins - 1)
        motion["suffix"] = (language.stop if stops else language.blend).format(**values)
        wait = language.wait if path.hold_s > 0 and row == begins else ""
        for template in (language.output, wait, language.speed, language.move):
            statement = template.format(**values | motion)
            if template == language.move or statement != before.get(template):
                lines.append(statement)
            before[template] = statement
    return "\n".join(line for line in [*lines, *language.end.format(**values).split("\n")] if line) + "\n"


def _straight(path: RobotPath, unit_mm: float, unit_mm_s: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the values of a program with straight motions, and those of each motion, in the language's units."""
    it, motion = path.trajectory, path.cell.motion
    values = {
        "acceleration": motion.acceleration_mm_s2 / unit_mm,
        "approach": motion.approach_speed_mm_s / unit_mm_s,
        "above": path.over_mm / unit_mm,
        "begin": it.position_mm[0] / unit_mm,
        "hold_s": path.hold_s,
    }
    return values, {"place": it.position_mm[1:] / unit_mm, "speed": it.speed_mm_s[:-1] / unit_mm_s}


def gcode_text(path: RobotPath) -> str:
    """Return G-code. Raises InputError if the plunger, the tilt of the face or the reach does not allow it."""
    settings, plunger = present(path.cell.gcode, "[gcode]"), present(path.cell.plunger, "[plunger]")
    path.require(path.tilt_limit, path.reach_limit("the way to the path or from it", path.over_mm))
    e_mm, begins = np.round(path.plunger_mm(path.held_mm3), E_DECIMALS), path.trajectory.giving.start
    held_mm = round(path.held_mm3 / plunger.area_mm2, E_DECIMALS)
    alone = f"G1 E{e_mm[begins] + held_mm:z.5f}"
    e_mm[begins + 1 :] += held_mm
    values, columns = _straight(path, 1, 1 / 60)
    values |= {
        "cold": "M302 P1" if settings.cold_extrusion else "",
        "plunger_alone": f"{alone} F{60 * held_mm / path.hold_s:.3f}" if held_mm > 0 else "",
    }
    notes = ["Units: x, y, z of the robot and E of the plunger in mm, F in mm/min. Home the axes first."]
    return written(GCODE, path, notes, begins, values, e=e_mm[1:], **columns)


def urscript_text(path: RobotPath) -> str:
    """Return URScript, with movep. Raises InputError if a limit is exceeded, or if blends would overlap."""
    settings, flow_mm3_s = present(path.cell.urscript, "[urscript]"), path.trajectory.flow_mm3_s[:-1]
    full_mm3_s, largest_mm3_s, giving_mm3_s = settings.full_flow_mm3_s, flow_mm3_s.max(), flow_mm3_s[flow_mm3_s > 0]
    closest_mm = np.linalg.norm(np.diff(path.trajectory.position_mm, axis=0), axis=1).min()
    path.require(
        (
            settings.blend_mm >= closest_mm / 2,
            f"urscript.blend_mm is {settings.blend_mm:g}: it must be below half the smallest distance between "
            f"waypoints ({closest_mm:.4g} mm), or the arm skips waypoints. Give less than {closest_mm / 2:.3g}, or "
            "digitise with a larger path.spacing_mm.",
        ),
        path.reach_limit("the way to the path or from it", path.over_mm),
        path.even_limit(
            "a digital output gives one flow or none", "mm³/s", giving_mm3_s, 'Set urscript.dispenser = "analog"'
        )
        if full_mm3_s is None
        else (
            largest_mm3_s > full_mm3_s,
            f"the path's flow rises to {largest_mm3_s:.4g} mm³/s, but at its full level the dispenser gives only "
            f"urscript.full_flow_mm3_s = {full_mm3_s:g}. Digitise with a lower path.speed_mm_s.",
        ),
    )
    if full_mm3_s is None:
        dispenser, off = f"First set the dispenser to {largest_mm3_s:.4f} mm3/s.", "False"
        levels = (flow_mm3_s > 0).tolist()
    else:
        dispenser, off = f"Analog output {settings.port}: 1.0 is {full_mm3_s:g} mm3/s.", "0.00000"
        levels = [f"{flow / full_mm3_s:.5f}" for flow in flow_mm3_s]
    notes = [
        "Units: m, rad, m/s. Poses in the base frame, and the active TCP must be the tip of the nozzle.",
        f"movej goes to the place above the path at {JOINT_SPEED_RAD_S} rad/s, on a way that the arm chooses: start "
        "near it.",
        dispenser,
    ]
    values, columns = _straight(path, 1000, 1000)
    values |= {
        "kind": settings.dispenser,
        "port": settings.port,
        "level": off,
        "blend_m": settings.blend_mm / 1000,
        "joint_speed": JOINT_SPEED_RAD_S,
        "turn": ", ".join(f"{angle:z.6f}" for angle in _tool(path, settings).as_rotvec()),
    }
    return written(URSCRIPT, path, notes, path.trajectory.giving.start, values, level=levels, **columns)


def _tool(path: RobotPath, settings: Urscript) -> Rotation:
    """Return the tool's orientation: z points into the face, and x is turned from the robot's x axis."""
    down = -path.frame.normal
    x = unit(np.array([1.0, 0.0, 0.0]) - down[0] * down)
    square = Rotation.from_matrix(np.column_stack([x, np.cross(down, x), down]))
    return square * Rotation.from_euler("z", settings.tool_turn_deg, degrees=True)


def spel_text(path: RobotPath) -> str:
    """Return a SPEL+ function. Raises InputError if a limit of the cell, language or controller is exceeded."""
    settings, motion = present(path.cell.spel, "[spel]"), path.cell.motion
    lifts, first = settings.dispenser != "z", settings.first_point
    places, begins, columns, curve = _spel_motions(path, settings, first + lifts)
    if lifts:
        above = np.column_stack([path.over_mm, places[[0, -1], 3]])
        places = np.vstack([above[0], places, above[1]])
    last = first + len(places) - 1
    path.require(
        path.tilt_limit,
        path.reach_limit("the SPEL+ program, on its way to the path, along it or from it,", places[:, :3]),
        (
            last >= SPEL_POINTS,
            f"the SPEL+ program needs {len(places)} points from P{first} on, but P{SPEL_POINTS - 1} is the last one. "
            "Lower spel.first_point, or digitise with a larger path.spacing_mm.",
        ),
    )
    if settings.dispenser == "output":
        flow = path.trajectory.flow_mm3_s[:-1]
        flow = flow[flow > 0]
        one = "an output that is on or off gives one flow or none"
        path.require(path.even_limit(one, "mm³/s", flow, "Let an axis press the plunger"))
        off, wait = f"  Off {settings.output_bit}", f"  Wait {path.hold_s:.3f}"
        notes = [f"First set the dispenser at output {settings.output_bit} to {flow.mean():.4f} mm3/s."]
    else:
        off = wait = ""
        notes = [
            f"Axis {settings.dispenser} presses the plunger and is ready to give sealant at "
            f"{settings.axis_start_mm:g} mm."
        ]
    notes = [
        "Units: mm, degrees, mm/s. First switch the motors on and set the power mode, then call this function.",
        f"Overwrites P{first} to P{last} in memory. Tool {settings.tool}, Local {settings.local}.",
        *notes,
        *([] if lifts else ["The arm cannot lift the nozzle: its way to the first point must be free."]),
    ]
    point = "  P{} = XY({:z.3f}, {:z.3f}, {:z.3f}, {}){} {}"
    angles = ", ".join(f"{angle:z.3f}" for angle in (settings.u_deg, *(settings.vw_deg or ())))
    flags = f"/{settings.hand[0].upper()}" + (f" /{settings.local}" if settings.local else "")
    axis = {"s": " :ST({:z.4f}, 0)", "t": " :ST(0, {:z.4f})"}.get(settings.dispenser, "")
    points = [
        point.format(number, *place[:3], angles, axis.format(place[3]), flags)
        for number, place in enumerate(places, start=first)
    ]
    values = {
        "acceleration": motion.acceleration_mm_s2,
        "approach": motion.approach_speed_mm_s,
        "tool": settings.tool,
        "points": "\n".join(points),
        "lower": f"  Move P{first}" if lifts else "",
        "begin": first + lifts,
        "wait": wait,
        "level": off,
        "switched_off": off if columns["level"][-1] != off else "",
        "lift": f"  SpeedS {motion.approach_speed_mm_s:.3f}\n  Move P{last}" if lifts else "",
        **curve,
    }
    return written(SPEL, path, notes, begins, values, **columns)


def _spel_motions(
    path: RobotPath, settings: Spel, number: int
) -> tuple[Floats, int, dict[str, list[str]], dict[str, str]]:
    """Return the points from P ``number`` on, (n, 4), the first motion with sealant, all motions, and a curve's lines.

    A point is x, y, z and the added axis. motion = "curve" has one motion over the crack, and one on each lead.
    """
    it, giving = path.trajectory, path.trajectory.giving
    places = np.column_stack([it.position_mm, np.zeros(len(it.t_s))])
    if settings.axis_start_mm is not None:
        onward = 1.0 if settings.axis_gives == "+" else -1.0
        places[:, 2 if settings.dispenser == "z" else 3] = settings.axis_start_mm + onward * path.plunger_mm()
    speed_mm_s = np.linalg.norm(np.diff(places[:, :3], axis=0), axis=1) / np.diff(it.t_s)
    rows, begins, curve = np.arange(len(places)), giving.start, {"curve": "", "curve_speed": ""}
    limits = []
    if settings.motion == "curve":
        # Of the leads only their outer ends are needed.
        crack, ends = rows[giving], rows[[0, giving.start, giving.stop - 1, -1]]
        speed_mm_s, flow_mm3_s = speed_mm_s[crack[:-1]], it.flow_mm3_s[crack[:-1]]
        remedy = 'Set spel.motion = "move"'
        limits = [
            path.even_limit("CVMove keeps one speed", "mm/s", speed_mm_s, remedy),
            path.even_limit("CVMove keeps one flow", "mm³/s", flow_mm3_s, remedy),
            (
                not FEWEST_IN_CURVE <= len(crack) <= MOST_IN_CURVE,
                f"the path has {len(crack)} points over the crack, but a Curve of SPEL+ takes {FEWEST_IN_CURVE} to "
                f"{MOST_IN_CURVE}. {remedy}, or digitise with another path.spacing_mm.",
            ),
        ]
        points, rows = np.union1d(crack, ends), np.unique(ends)
        places, begins = places[points], min(begins, 1)
        first = number + begins
        # Before the arm moves: between blended motions it would have to wait for the spline.
        axes = 4 if settings.vw_deg is None else 6
        curve["curve"] = f'  Curve "crack", O, 0, {axes}, P({first}:{first + len(crack) - 1})'
        curve["curve_speed"] = f"  SpeedS {speed_mm_s.mean():.3f}"
        motions = [f"Move P{number + stop}" for stop in np.searchsorted(points, rows)[1:]]
        motions[begins], speeds = 'CVMove "crack"', [""] * len(motions)
    else:
        motions = [f"Move P{number + row}" for row in rows[1:]]
        speeds = [f"  SpeedS {speed:.3f}" for speed in speed_mm_s]
    slowest_mm_s, fastest_mm_s = speed_mm_s.min(), speed_mm_s.max()
    path.require(
        *limits,
        (
            slowest_mm_s < SLOWEST_MM_S,
            f"SpeedS takes {SLOWEST_MM_S:g} mm/s or more, but the path has {slowest_mm_s:.3g}. Digitise with a higher "
            "path.speed_mm_s, or a coarser path.spacing_mm on a ramp.",
        ),
        path.limit(
            "motion.largest_speed_mm_s",
            fastest_mm_s,
            f"the arm, which also presses the plunger, moves at {fastest_mm_s:.4g} mm/s",
            "Digitise with a lower path.speed_mm_s.",
            EVEN,
        ),
    )
    states = ["On" if flows else "Off" for flows in it.flow_mm3_s[rows[:-1]] > 0]
    levels = [f"  {state} {settings.output_bit}" if settings.dispenser == "output" else "" for state in states]
    return places, begins, {"motion": motions, "level": levels, "speed": speeds}, curve


def points_text(path: RobotPath) -> str:
    """Return one line for each waypoint, x y z in mm of the robot, without a header."""
    return "".join("{:z.4f} {:z.4f} {:z.4f}\n".format(*place) for place in path.trajectory.position_mm)


def table_text(path: RobotPath) -> str:
    """Return the columns of trajectory.csv with the robot's x, y and z. A row applies until the next one.

    If a pump was weighed, the last column is the requested flow, ``asked_mm3_s``.
    """
    it = path.trajectory
    columns = (*TRAJECTORY_COLUMNS[:-1], "asked_mm3_s") if path.weighed else TRAJECTORY_COLUMNS
    rows = np.column_stack([it.t_s, it.position_mm, it.s_mm, it.speed_mm_s, it.flow_mm3_s])
    if path.hold_s > 0:
        # The nozzle waits at its first giving waypoint, with the pump already on.
        first = it.giving.start
        rows = np.insert(rows, first, rows[first], axis=0)
        rows[first, list(columns).index("speed_mm_s")] = 0.0
        rows[first + 1 :, 0] += path.hold_s
    return "\n".join([",".join(columns), *(",".join(f"{value:z.6f}" for value in row) for row in rows), ""])


PROGRAMS: dict[Format, tuple[str, Callable[[RobotPath], str]]] = {
    "txt": ("path.txt", points_text),
    "csv": ("path.csv", table_text),
    "spel": ("path.prg", spel_text),
    "gcode": ("path.gcode", gcode_text),
    "urscript": ("path.script", urscript_text),
}
"""Name of the file for each format, and the function that returns the file's text."""
