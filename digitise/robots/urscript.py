"""A program for an arm of Universal Robots.

Functions as in The URScript Programming Language, modules motion and interfaces: movej, movel and movep with poses
``p[x, y, z, rx, ry, rz]`` in metres and radians, a in m/s², v in m/s, r the blend radius in m; a move whose blend
overlaps its neighbour's is skipped. set_standard_analog_out takes a level from 0 to 1, set_standard_digital_out a
Boolean. A call after a blended move is made as the blend begins.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from digitise.robots.cell import Urscript
from digitise.robots.frame import Frame
from digitise.robots.placed import RobotPath, level_flow_mm3_s, reach_faults
from digitise.robots.text import comments, decimal
from sealtwin.records import Floats

JOINT_SPEED_RAD_S, JOINT_ACCELERATION_RAD_S2 = 0.5, 0.7
"""Half of URScript's own defaults: the way over the sample is the only one that the arm chooses itself."""


def urscript_text(path: RobotPath) -> str:
    """Over the path, down, along it with movep, up; the dispenser follows the flow.

    Raises InputError where blends would overlap, the dispenser cannot give the flow, the tool is not square to the
    face, or the way to the path leaves the reach box.
    """
    settings = path.cell.urscript
    if settings is None:
        raise ValueError("a cell without [urscript]")
    over_mm = np.array([path.above_start_mm, path.above_end_mm])
    turn = _tool(path.frame, settings)
    path.refuse(
        [
            *_blend_faults(path, settings),
            *_tool_faults(path, turn),
            *reach_faults("the way to the path or from it", over_mm, path.cell),
        ]
    )
    # As taught where it was: the same turn has another vector, which would puzzle whoever reads the pendant.
    rotation = [decimal(angle, 6) for angle in settings.rotation_vector_rad or turn.as_rotvec()]
    trajectory, motion = path.trajectory, path.cell.motion
    accelerate, approach = _metres(motion.acceleration_mm_s2), _metres(motion.approach_speed_mm_s)

    def pose(place_mm: Floats) -> str:
        return f"p[{', '.join([*(_metres(value) for value in place_mm), *rotation])}]"

    levels, off = _levels(path, settings), _level(0.0, settings)
    lines = [
        *comments("#", [*path.head, *_notes(path, settings)]),
        "def sealtwin():",
        f"  {_set(off, settings)}",
        f"  movej({pose(over_mm[0])}, a={JOINT_ACCELERATION_RAD_S2}, v={JOINT_SPEED_RAD_S})",
        f"  movel({pose(trajectory.position_mm[0])}, a={accelerate}, v={approach})",
    ]
    last = len(trajectory.t_s) - 1
    for row in range(last):
        if levels[row] != (levels[row - 1] if row else off):
            lines.append(f"  {_set(levels[row], settings)}")
        radius = 0.0 if row + 1 == last else settings.blend_mm
        speed = _metres(trajectory.speed_mm_s[row])
        lines.append(
            f"  movep({pose(trajectory.position_mm[row + 1])}, a={accelerate}, v={speed}, r={_metres(radius)})"
        )
    lines += [
        f"  {_set(off, settings)}",
        f"  movel({pose(over_mm[1])}, a={accelerate}, v={approach})",
        "end",
        "",
    ]
    return "\n".join(lines)


def _levels(path: RobotPath, settings: Urscript) -> list[str]:
    """Of the dispenser's output between each waypoint and the next."""
    flow_mm3_s = path.trajectory.flow_mm3_s[:-1]
    if settings.full_flow_mm3_s is None:
        level_flow_mm3_s(path, "a digital output", 'set urscript.dispenser = "analog"')
        return [_level(float(flow > 0), settings) for flow in flow_mm3_s]
    share = flow_mm3_s / settings.full_flow_mm3_s
    if share.max() > 1:
        path.refuse(
            [
                f"the path's flow goes up to {flow_mm3_s.max():.4g} mm³/s; at its full level the dispenser gives "
                f"urscript.full_flow_mm3_s = {settings.full_flow_mm3_s:g}. Digitise with a lower path.speed_mm_s."
            ]
        )
    return [_level(float(value), settings) for value in share]


def _level(share: float, settings: Urscript) -> str:
    return decimal(share, 5) if settings.dispenser == "analog" else str(share > 0)


def _set(level: str, settings: Urscript) -> str:
    return f"set_standard_{settings.dispenser}_out({settings.port}, {level})"


def _notes(path: RobotPath, settings: Urscript) -> list[str]:
    dispenser = (
        f"Set the dispenser to {path.trajectory.flow_mm3_s.max():.4f} mm3/s before."
        if settings.full_flow_mm3_s is None
        else f"Analog output {settings.port}: 1.0 is {settings.full_flow_mm3_s:g} mm3/s."
    )
    return [
        "Units: m, rad, m/s. Poses in the base frame, and the active TCP must be the tip of the nozzle.",
        f"To the place above the path by movej at {JOINT_SPEED_RAD_S} rad/s, the way that the arm finds: start near.",
        dispenser,
    ]


def _blend_faults(path: RobotPath, settings: Urscript) -> list[str]:
    step_mm = np.linalg.norm(np.diff(path.trajectory.position_mm, axis=0), axis=1)
    if settings.blend_mm < step_mm.min() / 2:
        return []
    return [
        f"urscript.blend_mm is {settings.blend_mm:g}: it must stay below half the closest waypoints' distance, "
        f"{step_mm.min():.4g} mm, or the arm skips them. Give less than {step_mm.min() / 2:.3g}, or digitise with a "
        "larger path.spacing_mm."
    ]


def _tool(frame: Frame, settings: Urscript) -> Rotation:
    """Of the tool, its z along the nozzle: given, or into the face with its x along the robot's but for the turn."""
    if settings.rotation_vector_rad is not None:
        return Rotation.from_rotvec(settings.rotation_vector_rad)
    down = -frame.normal
    x = np.array([1.0, 0.0, 0.0]) - down[0] * down
    x /= np.linalg.norm(x)
    square = Rotation.from_matrix(np.column_stack([x, np.cross(down, x), down]))
    return square * Rotation.from_euler("z", settings.tool_turn_deg, degrees=True)


def _tool_faults(path: RobotPath, turn: Rotation) -> list[str]:
    along = turn.apply([0.0, 0.0, 1.0])
    off_deg = np.degrees(np.arccos(np.clip(-along @ path.frame.normal, -1, 1)))
    allowed_deg = path.cell.motion.largest_tilt_deg
    if off_deg <= allowed_deg:
        return []
    return [
        f"urscript.rotation_vector_rad holds the nozzle {off_deg:.1f} degrees off the face's normal; "
        f"motion.largest_tilt_deg allows {allowed_deg:g}. Teach it again, or leave it out."
    ]


def _metres(mm: float) -> str:
    return decimal(mm / 1000, 7)
