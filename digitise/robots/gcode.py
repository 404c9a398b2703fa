"""G-code for a gantry with an extruder.

Words as in the NIST RS274/NGC interpreter (Kramer, Proctor, Messina 2000: G0, G1, G21, G90, G92, F) and in Marlin's
reference (marlinfw.org/docs/gcode: E, M82, M83, M302): millimetres, F in mm/min along x, y and z, ``;`` to the line's
end a comment.
"""

import numpy as np

from digitise.robots.placed import RobotPath, plunger_mm, reach_faults, tilt_faults
from digitise.robots.text import comments, decimal
from sealtwin.records import Floats

E_DECIMALS = 5


def gcode_text(path: RobotPath) -> str:
    """Up to the safe height, over the path, down, along it with E as far as the plunger is to go, and up.

    Raises InputError where the plunger, the tilt of the face or the reach does not allow it.
    """
    settings = path.cell.gcode
    if settings is None:
        raise ValueError("a cell without [gcode]")
    over_mm = np.array([path.above_start_mm, path.above_end_mm])
    path.refuse([*tilt_faults(path), *reach_faults("the way to the path or from it", over_mm, path.cell)])
    # Rounded before it is differenced: relative steps then add up to the absolute end.
    e_mm = np.round(plunger_mm(path), E_DECIMALS)
    if settings.relative_e:
        e_mm = np.diff(e_mm, prepend=0.0)
    trajectory, approach = path.trajectory, path.cell.motion.approach_speed_mm_s
    lines = [
        *comments(";", path.head),
        *comments(";", ["Units: x, y, z of the robot and E of the plunger in mm, F in mm/min. Home the axes before."]),
        "G21",
        "G90",
        "M83" if settings.relative_e else "M82",
        *(["M302 P1"] if settings.cold_extrusion else []),
        "G92 E0",
        f"G1 Z{decimal(over_mm[0, 2], 4)} {_feed(approach)}",
        f"G1 {_place(over_mm[0])} {_feed(approach)}",
        f"G1 {_place(trajectory.position_mm[0])} {_feed(approach)}",
    ]
    for place, e, speed in zip(trajectory.position_mm[1:], e_mm[1:], trajectory.speed_mm_s[:-1], strict=True):
        lines.append(f"G1 {_place(place)} E{decimal(e, E_DECIMALS)} {_feed(speed)}")
    lines += [f"G1 {_place(over_mm[1])} {_feed(approach)}", ""]
    return "\n".join(lines)


def _place(place_mm: Floats) -> str:
    return " ".join(f"{axis}{decimal(value, 4)}" for axis, value in zip("XYZ", place_mm, strict=True))


def _feed(speed_mm_s: float) -> str:
    return f"F{decimal(60 * speed_mm_s, 3)}"
