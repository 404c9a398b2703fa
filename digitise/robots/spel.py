"""Write programs in SPEL+ for Epson arms, from a template.

The statements are those of Epson RC+'s Language Reference. ``P1 = XY(x, y, z, u) :ST(s, t) /R`` assigns a point. ``Move
P1 CP`` does not stop at the point. SpeedS is in mm/s. ``Curve "name", O, 0, n, P(first:last)`` is an open spline in n
coordinates, which passes close to evenly spaced points. ``CVMove "name"`` follows the spline at one speed. A point file
(.pts) needs a checksum whose formula is not public, so points are assigned in the program.
"""

from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import Field

from digitise.robots.programs import EVEN_RANGE, Angle, InCell, Language, LanguageSettings, filled
from sealtwin.core.arc_length import step_lengths
from sealtwin.core.records import Floats

if TYPE_CHECKING:
    from digitise.robots.robot_path import Limit, RobotPath

POINTS = 1000  # Number of points of an Epson controller, P0 to P999
FEWEST_IN_CURVE, MAX_IN_CURVE = 3, 200
SLOWEST_MM_S = 0.1  # Smallest allowed value of SpeedS


class Spel(LanguageSettings):
    """Settings of an Epson arm and its SPEL+ program."""

    motion: Literal["curve", "move"] = "curve"
    """Statements that move the arm. curve: Curve and CVMove, with one speed along the whole crack. move: Move ... CP
    from point to point, each with its own speed, for paths whose speed or flow changes."""
    dispenser: Literal["output", "z", "s", "t"]
    """Drive of the dispenser. output: a bit switches a dispenser of constant flow on and off. z, s or t: that axis
    presses the plunger. With z, as in the paper, the arm can no longer lift the nozzle. With s or t, the other one of
    these two added axes moves to 0."""
    output_bit: int | None = Field(default=None, ge=0, le=8191)
    """Number of the output bit, for dispenser = "output"."""
    axis_start_mm: InCell | None = None
    """Coordinate of the axis z, s or t at which the plunger is ready to give sealant."""
    axis_gives: Literal["+", "-"] = "-"
    """Direction of the axis, + or -, that presses the plunger. The paper's z axis presses it downward."""
    hand: Literal["right", "left"] = "right"
    """Posture of the arm. The elbow of a SCARA is on the opposite side."""
    u_deg: Angle = 0.0
    """Angle of the tool about the vertical. It is constant along the path, because a nozzle is round."""
    vw_deg: tuple[Angle, Angle] | None = None
    """Angles V and W of a six-axis arm with the nozzle down. Omit them for a SCARA."""
    tool: int = Field(default=0, ge=0, le=15)
    """Number of the tool whose tip is the nozzle's tip. 0 is the flange without a tool."""
    local: int = Field(default=0, ge=0, le=15)
    """Number of the local frame in which robot_mm was read. 0 is the robot's own frame."""
    first_point: int = Field(default=0, ge=0, lt=POINTS)
    """Number of the first point that the program uses. The robot's points from this number on are overwritten."""

    def _check(self) -> None:
        if len({self.dispenser == "output", self.output_bit is not None, self.axis_start_mm is None}) > 1:
            raise ValueError(
                'dispenser = "output" needs output_bit and no axis_start_mm; z, s or t needs axis_start_mm and no '
                "output_bit"
            )
        if self.motion == "curve" and self.dispenser in ("s", "t"):
            raise ValueError(
                f'dispenser = "{self.dispenser}" cannot be combined with motion = "curve", since a Curve has no '
                'added axis: give motion = "move"'
            )

    @property
    def presses_plunger(self) -> bool:
        return self.dispenser != "output"

    @property
    def waits_for_pump(self) -> bool:
        return not self.presses_plunger

    @property
    def steady(self) -> tuple[str, ...]:
        return ('motion = "curve"',) * (self.motion == "curve") + ('dispenser = "output"',) * (not self.presses_plunger)


# Curve stands before the motions. Between blended motions, the arm would stop until the spline is computed.
TEMPLATE = """\
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


def spel_text(path: "RobotPath") -> str:
    """Return a SPEL+ function. Raises InputError if a limit of the cell, language or controller is exceeded."""
    trajectory, settings = path.trajectory, path.cell.table(Spel)
    lifts, first = settings.dispenser != "z", settings.first_point
    # x, y, z and the added axis.
    places = np.column_stack([trajectory.position_mm, np.zeros(len(trajectory.t_s))])
    if settings.axis_start_mm is not None:
        onward = 1.0 if settings.axis_gives == "+" else -1.0
        places[:, 3 if lifts else 2] = settings.axis_start_mm + onward * path.plunger_mm()
    speed_mm_s = step_lengths(places[:, :3]) / np.diff(trajectory.t_s)
    rows = np.arange(len(places))
    motions = [f"Move P{first + lifts + row}" for row in rows[1:]]
    speeds, begins, curve = [f"{speed:.3f}" for speed in speed_mm_s], trajectory.giving.start, None
    if settings.motion == "curve":
        crack = rows[trajectory.giving]
        speed_mm_s = speed_mm_s[crack[:-1]]
        path.require(*_curve_limits(path, len(crack), speed_mm_s))
        # Only the outer ends of the two leads are needed.
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
    gives = [False, *(trajectory.flow_mm3_s[rows[:-1]] > 0).tolist()]
    values = {
        "motions": list(zip(motions, speeds, ["", *speeds], gives[1:], gives, strict=False)),
        "flow_mm3_s": path.flow_mm3_s.mean(),
        "mean_mm_s": speed_mm_s.mean(),
        "begins": begins,
        "curve": curve,
    }
    return filled(TEMPLATE, "'", path, settings=settings, places=places, first=first, last=last, lifts=lifts, **values)


def _curve_limits(path: "RobotPath", points: int, speed_mm_s: Floats) -> "list[Limit]":
    """Return the limits of a Curve: its speed and flow must be constant, and its number of points is limited."""
    remedy = 'Set spel.motion = "move"'
    return [
        path.even_limit("CVMove keeps one speed", "mm/s", speed_mm_s, remedy),
        path.even_limit("CVMove keeps one flow", "mm³/s", path.flow_mm3_s, remedy),
        (
            not FEWEST_IN_CURVE <= points <= MAX_IN_CURVE,
            f"the path has {points} points over the crack, but a Curve of SPEL+ accepts {FEWEST_IN_CURVE} to "
            f"{MAX_IN_CURVE}. {remedy}, or digitise with another path.spacing_mm.",
        ),
    ]


def _spel_limits(path: "RobotPath", settings: Spel, places: Floats, speed_mm_s: Floats) -> "list[Limit]":
    """Return the limits of all points of a program, (n, 4), and of the arm's speeds along the path."""
    last, fastest_mm_s = settings.first_point + len(places) - 1, speed_mm_s.max()
    reason = "an output that is on or off gives one flow or none"
    return [
        path.tilt_limit,
        path.reach_limit("the SPEL+ program, on its way to the path, along it or from it,", places[:, :3]),
        (
            last >= POINTS,
            f"the SPEL+ program needs {len(places)} points from P{settings.first_point} on, but P{POINTS - 1} is the "
            "last point. Lower spel.first_point, or digitise with a larger path.spacing_mm.",
        ),
        (
            speed_mm_s.min() < SLOWEST_MM_S,
            f"SpeedS must be at least {SLOWEST_MM_S:g} mm/s, but the path has {speed_mm_s.min():.3g} mm/s. Digitise "
            "with a higher path.speed_mm_s, or a coarser path.spacing_mm on a ramp.",
        ),
        path.limit(
            "motion.largest_speed_mm_s",
            fastest_mm_s,
            f"the arm, which also presses the plunger, moves at {fastest_mm_s:.4g} mm/s",
            "Digitise with a lower path.speed_mm_s.",
            EVEN_RANGE,
        ),
        *[path.even_limit(reason, "mm³/s", path.flow_mm3_s, "Let an axis press the plunger")]
        * (settings.dispenser == "output"),
    ]


SPEL = Language("spel", "path.prg", spel_text, Spel, "SPEL+")
