"""Robot files of a path: tables of points, and programs in three languages from templates.

G-code has the words of NIST RS274/NGC (Kramer, Proctor, Messina 2000) and of Marlin, in mm and mm/min. URScript has the
functions of The URScript Programming Language, in m and rad; a call after a blended move runs when the blend begins.
SPEL+ has the statements of Epson RC+'s Language Reference: ``P1 = XY(x, y, z, u) :ST(s, t) /R`` assigns a point, ``Move
P1 CP`` does not stop there, SpeedS is in mm/s, and ``Curve "name", O, 0, n, P(first:last)`` is an open spline in n
coordinates through close to evenly spaced points, which ``CVMove "name"`` follows at one speed. A point file (.pts)
needs a checksum that is not public, so points are assigned in the program.
"""

import io
from collections.abc import Callable
from typing import Any

import jinja2
import numpy as np
from scipy.spatial.transform import Rotation

from digitise.robots.cell import SPEL_POINTS, Format, Spel
from digitise.robots.robot_path import EVEN, Limit, RobotPath, comments
from sealtwin.core.errors import present
from sealtwin.core.record_files import TRAJECTORY_COLUMNS
from sealtwin.core.records import Floats

E_DECIMALS = 5  # Of a plunger's way in mm
FEWEST_IN_CURVE, MOST_IN_CURVE = 3, 200
SLOWEST_MM_S = 0.1  # Least value of SpeedS
WAY = "the way to the path or from it"

GCODE = """\
{% macro xyz(place) %}X{{ place[0]|fixed(4) }} Y{{ place[1]|fixed(4) }} Z{{ place[2]|fixed(4) }}{% endmacro %}
; Units: x, y, z of the robot and E of the plunger in mm, F in mm/min. Home the axes first.
G21
G90
M82
{% if settings.cold_extrusion %}
M302 P1
{% endif %}
G92 E0
G1 Z{{ path.over_mm[0][2]|fixed(4) }} F{{ (60 * motion.approach_speed_mm_s)|fixed(3) }}
G1 {{ xyz(path.over_mm[0]) }} F{{ (60 * motion.approach_speed_mm_s)|fixed(3) }}
G1 {{ xyz(it.position_mm[0]) }} F{{ (60 * motion.approach_speed_mm_s)|fixed(3) }}
{% for place, e, speed in motions %}
{% if held_mm and loop.index0 == begins %}
G1 E{{ (e_mm[begins] + held_mm)|fixed(5) }} F{{ (60 * held_mm / path.hold_s)|fixed(3) }}
{% endif %}
G1 {{ xyz(place) }} E{{ e|fixed(5) }} F{{ (60 * speed)|fixed(3) }}
{% endfor %}
G1 {{ xyz(path.over_mm[1]) }} F{{ (60 * motion.approach_speed_mm_s)|fixed(3) }}
"""
# movej has half of URScript's default speed and acceleration of joints, since the arm chooses its way.
URSCRIPT = """\
{% macro m(mm) %}{{ (mm / 1000)|fixed(7) }}{% endmacro %}
{% macro pose(place) %}p[{{ m(place[0]) }}, {{ m(place[1]) }}, {{ m(place[2]) }}, {{ turn }}]{% endmacro %}
{% macro out(level) %}set_standard_{{ settings.dispenser }}_out({{ settings.port }}, {{ level }}){% endmacro %}
# Units: m, rad, m/s. Poses in the base frame, and the active TCP must be the tip of the nozzle.
# movej goes to the place above the path at 0.5 rad/s, on a way that the arm chooses: start near it.
{% if settings.full_flow_mm3_s %}
# Analog output {{ settings.port }}: 1.0 is {{ settings.full_flow_mm3_s|g }} mm3/s.
{% else %}
# First set the dispenser to {{ it.flow_mm3_s.max()|fixed(4) }} mm3/s.
{% endif %}
def sealtwin():
  {{ out(motions[0][3]) }}
  movej({{ pose(path.over_mm[0]) }}, a=0.7, v=0.5)
  movel({{ pose(it.position_mm[0]) }}, a={{ m(motion.acceleration_mm_s2) }}, v={{ m(motion.approach_speed_mm_s) }})
{% for place, speed, level, before in motions %}
{% if level != before %}
  {{ out(level) }}
{% endif %}
{% if path.hold_s and loop.index0 == begins %}
  sleep({{ path.hold_s|fixed(3) }})
{% endif %}
{% set blend_mm = 0 if loop.last or (path.hold_s and loop.index == begins) else settings.blend_mm %}
  movep({{ pose(place) }}, a={{ m(motion.acceleration_mm_s2) }}, v={{ m(speed) }}, r={{ m(blend_mm) }})
{% endfor %}
  {{ out(motions[0][3]) }}
  movel({{ pose(path.over_mm[1]) }}, a={{ m(motion.acceleration_mm_s2) }}, v={{ m(motion.approach_speed_mm_s) }})
end
"""
# A Curve is named before the arm moves: between blended motions it would have to wait for the spline.
SPEL = """\
' Units: mm, degrees, mm/s. First switch the motors on and set the power mode, then call this function.
' Overwrites P{{ first }} to P{{ last }} in memory. Tool {{ settings.tool }}, Local {{ settings.local }}.
{% if settings.dispenser == "output" %}
' First set the dispenser at output {{ settings.output_bit }} to {{ flow_mm3_s|fixed(4) }} mm3/s.
{% else %}
' Axis {{ settings.dispenser }} presses the plunger and is ready to give sealant at {{ settings.axis_start_mm|g }} mm.
{% endif %}
{% if not lifts %}
' The arm cannot lift the nozzle: its way to the first point must be free.
{% endif %}
Function sealtwin
  Tool {{ settings.tool }}
{% for x, y, z, added in places %}
  P{{ first + loop.index0 }} = XY({{ x|fixed(3) }}, {{ y|fixed(3) }}, {{ z|fixed(3) }}, {{ settings.u_deg|fixed(3) }}
{%- for angle in settings.vw_deg or () %}, {{ angle|fixed(3) }}{% endfor %})
{%- if settings.dispenser == "s" %} :ST({{ added|fixed(4) }}, 0)
{%- elif settings.dispenser == "t" %} :ST(0, {{ added|fixed(4) }})
{%- endif %} /{{ settings.hand[0]|upper }}{% if settings.local %} /{{ settings.local }}{% endif %}

{% endfor %}
  AccelS {{ motion.acceleration_mm_s2|fixed(1) }}
  SpeedS {{ motion.approach_speed_mm_s|fixed(3) }}
{% if lifts %}
  Move P{{ first }}
{% endif %}
{% if settings.motion == "curve" %}
  Curve "crack", O, 0, {{ 6 if settings.vw_deg else 4 }}, P({{ first + curve[0] }}:{{ first + curve[1] }})
{% endif %}
  Move P{{ first + lifts }}
{% if settings.motion == "curve" %}
  SpeedS {{ mean_mm_s|fixed(3) }}
{% endif %}
{% for statement, speed, speed_before, gives, gave in motions %}
{% if settings.dispenser == "output" and gives != gave %}
  {{ "On" if gives else "Off" }} {{ settings.output_bit }}
{% endif %}
{% if settings.dispenser == "output" and path.hold_s and loop.index0 == begins %}
  Wait {{ path.hold_s|fixed(3) }}
{% endif %}
{% if speed != speed_before %}
  SpeedS {{ speed }}
{% endif %}
  {{ statement }}{{ "" if loop.last or (path.hold_s and loop.index == begins) else " CP" }}
{% endfor %}
{% if settings.dispenser == "output" and motions[-1][3] %}
  Off {{ settings.output_bit }}
{% endif %}
{% if lifts %}
  SpeedS {{ motion.approach_speed_mm_s|fixed(3) }}
  Move P{{ last }}
{% endif %}
Fend
"""
ENVIRONMENT = jinja2.Environment(
    undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
)
ENVIRONMENT.filters["g"] = "{:g}".format
# z, since some controllers do not read -0.
ENVIRONMENT.filters["fixed"] = lambda value, decimals: f"{value:z.{decimals}f}"


def _filled(template: str, mark: str, path: RobotPath, **values: Any) -> str:
    """Return a program below the comments of its head."""
    head = "".join(f"{line}\n" for line in comments(mark, path.head))
    common = {"begins": path.trajectory.giving.start, "motion": path.cell.motion, "it": path.trajectory, "path": path}
    return head + ENVIRONMENT.from_string(template).render(common | values)


def gcode_text(path: RobotPath) -> str:
    """Return G-code. Raises InputError if the plunger, the tilt of the face or the reach does not allow it."""
    it, plunger = path.trajectory, present(path.cell.plunger, "[plunger]")
    path.require(path.tilt_limit, path.reach_limit(WAY, path.over_mm))
    e_mm = np.round(path.plunger_mm(path.held_mm3), E_DECIMALS)
    held_mm = round(path.held_mm3 / plunger.area_mm2, E_DECIMALS)
    after_mm = e_mm[1:] + held_mm * (np.arange(1, len(e_mm)) > it.giving.start)
    motions = zip(it.position_mm[1:], after_mm, it.speed_mm_s, strict=False)
    return _filled(GCODE, ";", path, settings=path.cell.gcode, e_mm=e_mm, held_mm=held_mm, motions=motions)


def urscript_text(path: RobotPath) -> str:
    """Return URScript, with movep. Raises InputError if a limit is exceeded, or if blends would overlap."""
    it, settings = path.trajectory, present(path.cell.urscript, "[urscript]")
    flow_mm3_s, full_mm3_s = it.flow_mm3_s[:-1], settings.full_flow_mm3_s
    largest_mm3_s, closest_mm = flow_mm3_s.max(), np.linalg.norm(np.diff(it.position_mm, axis=0), axis=1).min()
    if full_mm3_s is None:
        one = "a digital output gives one flow or none"
        limit = path.even_limit(one, "mm³/s", path.flow_mm3_s, 'Set urscript.dispenser = "analog"')
        levels = ["False", *map(str, flow_mm3_s > 0)]
    else:
        limit = (
            largest_mm3_s > full_mm3_s,
            f"the path's flow rises to {largest_mm3_s:.4g} mm³/s, but at its full level the dispenser gives only "
            f"urscript.full_flow_mm3_s = {full_mm3_s:g}. Digitise with a lower path.speed_mm_s.",
        )
        levels = [f"{flow / full_mm3_s:.5f}" for flow in (0.0, *flow_mm3_s)]
    path.require(
        (
            settings.blend_mm >= closest_mm / 2,
            f"urscript.blend_mm is {settings.blend_mm:g}: it must be below half the smallest distance between "
            f"waypoints ({closest_mm:.4g} mm), or the arm skips waypoints. Give less than {closest_mm / 2:.3g}, or "
            "digitise with a larger path.spacing_mm.",
        ),
        path.reach_limit(WAY, path.over_mm),
        limit,
    )
    motions = list(zip(it.position_mm[1:], it.speed_mm_s, levels[1:], levels, strict=False))
    # z of the tool points into the face exactly, and x is as near to the robot's as it can be, before the tool's turn.
    axes, own = [-path.frame.normal, [1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    tool = Rotation.align_vectors(axes, own, weights=[np.inf, 1.0])[0]
    tool = tool * Rotation.from_euler("z", settings.tool_turn_deg, degrees=True)
    turn = ", ".join(f"{angle:z.6f}" for angle in tool.as_rotvec())
    return _filled(URSCRIPT, "#", path, settings=settings, turn=turn, motions=motions)


def spel_text(path: RobotPath) -> str:
    """Return a SPEL+ function. Raises InputError if a limit of the cell, language or controller is exceeded."""
    it, settings = path.trajectory, present(path.cell.spel, "[spel]")
    lifts, first = settings.dispenser != "z", settings.first_point
    # x, y, z and the added axis.
    places = np.column_stack([it.position_mm, np.zeros(len(it.t_s))])
    if settings.axis_start_mm is not None:
        onward = 1.0 if settings.axis_gives == "+" else -1.0
        places[:, 3 if lifts else 2] = settings.axis_start_mm + onward * path.plunger_mm()
    speed_mm_s = np.linalg.norm(np.diff(places[:, :3], axis=0), axis=1) / np.diff(it.t_s)
    rows = np.arange(len(places))
    motions = [f"Move P{first + lifts + row}" for row in rows[1:]]
    speeds, begins, curve = [f"{speed:.3f}" for speed in speed_mm_s], it.giving.start, None
    if settings.motion == "curve":
        crack = rows[it.giving]
        speed_mm_s = speed_mm_s[crack[:-1]]
        path.require(*_curve_limits(path, len(crack), speed_mm_s))
        # Of the leads only their outer ends are needed.
        rows = np.unique([0, crack[0], crack[-1], rows[-1]])
        kept = np.union1d(rows, crack)
        places, begins = places[kept], min(begins, 1)
        motions = [f"Move P{first + lifts + row}" for row in np.searchsorted(kept, rows)[1:]]
        motions[begins], speeds = 'CVMove "crack"', [""] * len(motions)
        curve = np.searchsorted(kept, crack)[[0, -1]] + lifts
    if lifts:
        above = np.column_stack([path.over_mm, places[[0, -1], 3]])
        places = np.vstack([above[0], places, above[1]])
    last = first + len(places) - 1
    path.require(*_spel_limits(path, settings, places, speed_mm_s))
    gives = [False, *(it.flow_mm3_s[rows[:-1]] > 0).tolist()]
    values = {
        "motions": list(zip(motions, speeds, ["", *speeds], gives[1:], gives, strict=False)),
        "flow_mm3_s": path.flow_mm3_s.mean(),
        "mean_mm_s": speed_mm_s.mean(),
        "begins": begins,
        "curve": curve,
    }
    return _filled(SPEL, "'", path, settings=settings, places=places, first=first, last=last, lifts=lifts, **values)


def _curve_limits(path: RobotPath, points: int, speed_mm_s: Floats) -> list[Limit]:
    """Return the limits of a Curve: the number of its points, and one speed and dose all along."""
    remedy = 'Set spel.motion = "move"'
    return [
        path.even_limit("CVMove keeps one speed", "mm/s", speed_mm_s, remedy),
        path.even_limit("CVMove keeps one flow", "mm³/s", path.flow_mm3_s, remedy),
        (
            not FEWEST_IN_CURVE <= points <= MOST_IN_CURVE,
            f"the path has {points} points over the crack, but a Curve of SPEL+ takes {FEWEST_IN_CURVE} to "
            f"{MOST_IN_CURVE}. {remedy}, or digitise with another path.spacing_mm.",
        ),
    ]


def _spel_limits(path: RobotPath, settings: Spel, places: Floats, speed_mm_s: Floats) -> list[Limit]:
    """Return the limits of all points of a program, (n, 4), and of the arm's speeds between those of the path."""
    last, fastest_mm_s = settings.first_point + len(places) - 1, speed_mm_s.max()
    one = "an output that is on or off gives one flow or none"
    return [
        path.tilt_limit,
        path.reach_limit("the SPEL+ program, on its way to the path, along it or from it,", places[:, :3]),
        (
            last >= SPEL_POINTS,
            f"the SPEL+ program needs {len(places)} points from P{settings.first_point} on, but P{SPEL_POINTS - 1} is "
            "the last one. Lower spel.first_point, or digitise with a larger path.spacing_mm.",
        ),
        (
            speed_mm_s.min() < SLOWEST_MM_S,
            f"SpeedS takes {SLOWEST_MM_S:g} mm/s or more, but the path has {speed_mm_s.min():.3g}. Digitise with a "
            "higher path.speed_mm_s, or a coarser path.spacing_mm on a ramp.",
        ),
        path.limit(
            "motion.largest_speed_mm_s",
            fastest_mm_s,
            f"the arm, which also presses the plunger, moves at {fastest_mm_s:.4g} mm/s",
            "Digitise with a lower path.speed_mm_s.",
            EVEN,
        ),
        *[path.even_limit(one, "mm³/s", path.flow_mm3_s, "Let an axis press the plunger")]
        * (settings.dispenser == "output"),
    ]


def points_text(path: RobotPath) -> str:
    """Return one line for each waypoint, x y z in mm of the robot, without a header."""
    return _rows(path.trajectory.position_mm, 4, " ")


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
    return f"{','.join(columns)}\n{_rows(rows, 6, ',')}"


def _rows(rows: Floats, decimals: int, between: str) -> str:
    text = io.StringIO()
    # No -0.
    np.savetxt(text, rows.round(decimals) + 0.0, f"%.{decimals}f", between)
    return text.getvalue()


PROGRAMS: dict[Format, tuple[str, Callable[[RobotPath], str]]] = {
    "txt": ("path.txt", points_text),
    "csv": ("path.csv", table_text),
    "spel": ("path.prg", spel_text),
    "gcode": ("path.gcode", gcode_text),
    "urscript": ("path.script", urscript_text),
}
"""Name of the file for each format, and the function that returns the file's text."""
