"""Write a path as files for robots: tables of points, and programs in G-code and URScript from templates.

G-code uses the words of NIST RS274/NGC (Kramer, Proctor, Messina 2000) and of Marlin, in mm and mm/min. URScript uses
the functions of The URScript Programming Language, in m and rad. A call after a blended move runs when the blend
begins.
"""

import io
import re
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import jinja2
import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from sealtwin.core.arc_length import step_lengths
from sealtwin.core.errors import present
from sealtwin.core.record_files import TRAJECTORY_COLUMNS, trajectory_rows
from sealtwin.core.settings import Settings

if TYPE_CHECKING:
    from digitise.robots.robot_path import RobotPath

EVEN_RANGE = 1e-4  # A speed or flow with a smaller relative range counts as constant, since trajectory.csv is rounded
# Characters with a meaning to some controller: GRBL executes ?, ! and ~
NOT_PLAIN = re.compile(r"[^A-Za-z0-9 .,:_+=/-]")
LONGEST = 120
E_DECIMALS = 5  # Decimals of the plunger's travel in mm
WAY = "the way to the path or from it"
InCell = Annotated[float, Field(ge=-10_000, le=10_000)]  # Coordinate of a robot in mm: no arm reaches ten metres
Angle = Annotated[float, Field(ge=-360, le=360)]


class LanguageSettings(Settings):
    """Settings of a language in a cell file. Each language overrides properties that differ from these defaults."""

    @property
    def presses_plunger(self) -> bool:
        """True if the program itself moves the plunger."""
        return False

    @property
    def waits_for_pump(self) -> bool:
        """True if the program can wait until a weighed pump delivers its first sealant."""
        return True

    @property
    @abstractmethod
    def steady(self) -> tuple[str, ...]:
        """Settings, as written in the file, with which a program can have only one speed or one flow."""

    @property
    def largest_flow_mm3_s(self) -> float | None:
        return None


class Language(NamedTuple):
    """A robot language, or a format for a table of points."""

    name: str  # Name in the cell's formats, and of the language's table in the cell file
    file: str
    text: Callable[["RobotPath"], str]
    """Function that returns the file's content. It raises InputError if the path exceeds a limit."""
    settings: type[LanguageSettings] | None = None
    title: str = ""
    units: str = ""  # Units of the program. Empty for mm, s and degrees


class Gcode(LanguageSettings):
    """Settings of a gantry with an extruder, programmed in G-code."""

    cold_extrusion: bool = False
    """True to write M302 P1. Without this command, Marlin does not move an extruder below 170 degrees Celsius, and
    gives no error."""

    @property
    def presses_plunger(self) -> bool:
        return True

    @property
    def steady(self) -> tuple[str, ...]:
        return ()


class Urscript(LanguageSettings):
    """Settings of an arm of Universal Robots, programmed in URScript."""

    blend_mm: float = Field(default=0.4, gt=0.01, le=20)
    """Radius of the blend at each waypoint. It must be less than half the spacing of waypoints, which is 1 mm by
    default. Without a blend the arm would stop at each waypoint."""
    dispenser: Literal["analog", "digital"]
    """Kind of output that drives the dispenser. analog: a standard analog output, proportional to the flow. digital: a
    standard output that is on or off."""
    port: int = Field(ge=0, le=7)
    """Number of the output: 0 or 1 for analog, 0 to 7 for digital."""
    full_flow_mm3_s: float | None = Field(default=None, gt=1e-3, le=1e6)
    """Flow at the output's full level, for dispenser = "analog"."""
    tool_turn_deg: Angle = 0.0
    """Angle of the tool about the nozzle, measured from the robot's x axis. Set it so that a camera or a cable at the
    tool's side does not collide."""

    def _check(self) -> None:
        if (self.dispenser == "analog") != (self.full_flow_mm3_s is not None):
            raise ValueError('full_flow_mm3_s and dispenser = "analog" belong together: give both or neither')
        if self.dispenser == "analog" and self.port > 1:
            raise ValueError(f"port is {self.port}, but the standard analog outputs are 0 and 1: give one of these")

    @property
    def steady(self) -> tuple[str, ...]:
        return ('dispenser = "digital"',) * (self.dispenser == "digital")

    @property
    def largest_flow_mm3_s(self) -> float | None:
        return self.full_flow_mm3_s


GCODE_TEMPLATE = """\
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
# movej gets half of URScript's default speed and acceleration of joints, since the arm chooses its own path.
URSCRIPT_TEMPLATE = """\
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
ENVIRONMENT = jinja2.Environment(
    undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
)
ENVIRONMENT.filters["g"] = "{:g}".format
# z, since some controllers do not read -0.
ENVIRONMENT.filters["fixed"] = lambda value, decimals: f"{value:z.{decimals}f}"


def comments(mark: str, lines: Sequence[str]) -> list[str]:
    """Return each line as a comment. Characters that could be a command for a controller are replaced by _."""
    return [f"{mark} {NOT_PLAIN.sub('_', line)[:LONGEST]}".rstrip() for line in lines]


def filled(template: str, mark: str, path: "RobotPath", **values: Any) -> str:
    """Return a program: the lines of ``path.head`` as comments, then the filled template."""
    head = "".join(f"{line}\n" for line in comments(mark, path.head))
    common = {"begins": path.trajectory.giving.start, "motion": path.cell.motion, "it": path.trajectory, "path": path}
    return head + ENVIRONMENT.from_string(template).render(common | values)


def gcode_text(path: "RobotPath") -> str:
    """Return a G-code program. Raises InputError if it exceeds a limit of the plunger, the tilt or the reach."""
    trajectory, plunger = path.trajectory, present(path.cell.plunger, "[plunger]")
    path.require(path.tilt_limit, path.reach_limit(WAY, path.over_mm))
    e_mm = np.round(path.plunger_mm(path.held_mm3), E_DECIMALS)
    held_mm = round(path.held_mm3 / plunger.area_mm2, E_DECIMALS)
    after_mm = e_mm[1:] + held_mm * (np.arange(1, len(e_mm)) > trajectory.giving.start)
    motions = zip(trajectory.position_mm[1:], after_mm, trajectory.speed_mm_s, strict=False)
    return filled(
        GCODE_TEMPLATE, ";", path, settings=path.cell.table(Gcode), e_mm=e_mm, held_mm=held_mm, motions=motions
    )


def urscript_text(path: "RobotPath") -> str:
    """Return a URScript program with movep. Raises InputError if a limit is exceeded, or if blends would overlap."""
    trajectory, settings = path.trajectory, path.cell.table(Urscript)
    flow_mm3_s, full_mm3_s = trajectory.flow_mm3_s[:-1], settings.full_flow_mm3_s
    largest_mm3_s, closest_mm = flow_mm3_s.max(), step_lengths(trajectory.position_mm).min()
    if full_mm3_s is None:
        reason = "a digital output gives one flow or none"
        limit = path.even_limit(reason, "mm³/s", path.flow_mm3_s, 'Set urscript.dispenser = "analog"')
        levels = ["False", *map(str, flow_mm3_s > 0)]
    else:
        limit = (
            largest_mm3_s > full_mm3_s,
            f"the path's flow rises to {largest_mm3_s:.4g} mm³/s, but at its full level the dispenser delivers only "
            f"urscript.full_flow_mm3_s = {full_mm3_s:g}. Digitise with a lower path.speed_mm_s.",
        )
        levels = [f"{flow / full_mm3_s:.5f}" for flow in (0.0, *flow_mm3_s)]
    path.require(
        (
            settings.blend_mm >= closest_mm / 2,
            f"urscript.blend_mm is {settings.blend_mm:g}, but it must be below half the smallest distance between "
            f"waypoints ({closest_mm:.4g} mm), or the arm skips waypoints. Give less than {closest_mm / 2:.3g}, or "
            "digitise with a larger path.spacing_mm.",
        ),
        path.reach_limit(WAY, path.over_mm),
        limit,
    )
    motions = list(zip(trajectory.position_mm[1:], trajectory.speed_mm_s, levels[1:], levels, strict=False))
    # The tool's z axis is square to the face. Before tool_turn_deg, its x axis is as close as possible to the robot's.
    axes, tool_axes = [-path.frame.normal, [1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    tool = Rotation.align_vectors(axes, tool_axes, weights=[np.inf, 1.0])[0]
    tool = tool * Rotation.from_euler("z", settings.tool_turn_deg, degrees=True)
    turn = ", ".join(f"{angle:z.6f}" for angle in tool.as_rotvec())
    return filled(URSCRIPT_TEMPLATE, "#", path, settings=settings, turn=turn, motions=motions)


def table_text(path: "RobotPath") -> str:
    """Return a CSV with the columns of trajectory.csv. x, y and z are in the robot's frame.

    Speed and flow of a row apply until the next row. If the pump was weighed, the last column is the requested flow,
    ``asked_mm3_s``.
    """
    trajectory = path.trajectory
    columns = (*TRAJECTORY_COLUMNS[:-1], "asked_mm3_s") if path.weighed else TRAJECTORY_COLUMNS
    rows = trajectory_rows(trajectory)
    if path.hold_s > 0:
        # The nozzle waits at the first waypoint with sealant, with the pump already on.
        first = trajectory.giving.start
        rows = np.insert(rows, first, rows[first], axis=0)
        rows[first, list(columns).index("speed_mm_s")] = 0.0
        rows[first + 1 :, 0] += path.hold_s
    text = io.StringIO()
    # No -0.
    np.savetxt(text, rows.round(6) + 0.0, "%.6f", ",", header=",".join(columns), comments="")
    return text.getvalue()


CSV = Language("csv", "path.csv", table_text)
GCODE = Language("gcode", "path.gcode", gcode_text, Gcode, "G-code")
URSCRIPT = Language("urscript", "path.script", urscript_text, Urscript, "URScript", "m and rad")
