"""G-code program for a gantry with an extruder, in mm and mm/min.

Words are those of NIST RS274/NGC (Kramer, Proctor, Messina 2000) and of Marlin (marlinfw.org/docs/gcode).
"""

import numpy as np

from digitise.robots.robot_path import RobotPath, comments, decimal
from sealtwin.core.errors import present
from sealtwin.core.records import Floats

E_DECIMALS = 5


def gcode_text(path: RobotPath) -> str:
    """Return the program. Raises InputError if the plunger, the tilt of the face or the reach does not allow it."""
    settings = present(path.cell.gcode, "[gcode]")
    over_mm = path.over_mm
    path.require(path.tilt_limit, path.reach_limit("the way to the path or from it", over_mm))
    # Rounded before it is differenced: relative steps then add up to the absolute end.
    e_mm = np.round(path.plunger_mm(path.held_mm3), E_DECIMALS)
    plunger, begins = path.cell.plunger, path.trajectory.giving.start
    held_mm = 0.0 if plunger is None else round(path.held_mm3 / plunger.area_mm2, E_DECIMALS)
    if settings.relative_e:
        e_mm = np.diff(e_mm, prepend=0.0)
    else:
        e_mm[begins + 1 :] += held_mm
    trajectory, approach = path.trajectory, path.cell.motion.approach_speed_mm_s
    lines = [
        *comments(";", path.head),
        *comments(";", ["Units: x, y, z of the robot and E of the plunger in mm, F in mm/min. Home the axes first."]),
        "G21",
        "G90",
        "M83" if settings.relative_e else "M82",
        *(["M302 P1"] if settings.cold_extrusion else []),
        "G92 E0",
        f"G1 Z{decimal(over_mm[0, 2], 4)} {_feed(approach)}",
        f"G1 {_place(over_mm[0])} {_feed(approach)}",
        f"G1 {_place(trajectory.position_mm[0])} {_feed(approach)}",
    ]
    for row, (place, e, speed) in enumerate(
        zip(trajectory.position_mm[1:], e_mm[1:], trajectory.speed_mm_s[:-1], strict=True)
    ):
        if row == begins and held_mm > 0:
            # The plunger alone, until the first sealant comes.
            before_mm = 0.0 if settings.relative_e else float(e_mm[begins])
            lines.append(f"G1 E{decimal(before_mm + held_mm, E_DECIMALS)} {_feed(held_mm / path.hold_s)}")
        lines.append(f"G1 {_place(place)} E{decimal(e, E_DECIMALS)} {_feed(speed)}")
    lines += [f"G1 {_place(over_mm[1])} {_feed(approach)}", ""]
    return "\n".join(lines)


def _place(place_mm: Floats) -> str:
    return " ".join(f"{axis}{decimal(value, 4)}" for axis, value in zip("XYZ", place_mm, strict=True))


def _feed(speed_mm_s: float) -> str:
    return f"F{decimal(60 * speed_mm_s, 3)}"
