"""URScript program for an arm of Universal Robots.

Functions are those of The URScript Programming Language, modules motion and interfaces: poses and blend radii in metres
and radians, outputs from 0 to 1 or Boolean. A call after a blended move runs when the blend begins.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from digitise.robots.cell import RobotFrame, Urscript
from digitise.robots.robot_path import Limit, RobotPath, comments, decimal
from sealtwin.core.errors import present
from sealtwin.core.records import Floats

JOINT_SPEED_RAD_S, JOINT_ACCELERATION_RAD_S2 = 0.5, 0.7  # Half of URScript's defaults, where the arm chooses its path


def urscript_text(path: RobotPath) -> str:
    """Return the program, which uses movep. Raises InputError if a limit is exceeded, or if blends would overlap."""
    settings = present(path.cell.urscript, "[urscript]")
    over_mm, turn = path.over_mm, _tool(path.frame, settings)
    path.require(
        _blend_limit(path, settings),
        _tool_limit(path, turn),
        path.reach_limit("the way to the path or from it", over_mm),
    )
    # A given vector is written as the pendant shows it; other vectors mean the same turn.
    rotation = [decimal(angle, 6) for angle in settings.rotation_vector_rad or turn.as_rotvec()]
    trajectory, motion = path.trajectory, path.cell.motion
    accelerate, approach = _metres(motion.acceleration_mm_s2), _metres(motion.approach_speed_mm_s)

    def pose(place_mm: Floats) -> str:
        return f"p[{', '.join([*(_metres(value) for value in place_mm), *rotation])}]"

    off, *outputs = _outputs(path, settings)
    lines = [
        *comments("#", [*path.head, *_notes(path, settings)]),
        "def sealtwin():",
        off,
        f"  movej({pose(over_mm[0])}, a={JOINT_ACCELERATION_RAD_S2}, v={JOINT_SPEED_RAD_S})",
        f"  movel({pose(trajectory.position_mm[0])}, a={accelerate}, v={approach})",
    ]
    radii_mm = [settings.blend_mm] * (len(outputs) - 1) + [0.0]
    begins = trajectory.giving.start
    if path.hold_s > 0 and begins > 0:
        # The arm waits at this waypoint, so it must stop there.
        radii_mm[begins - 1] = 0.0
    rows = zip(outputs, [off, *outputs], trajectory.position_mm[1:], trajectory.speed_mm_s, radii_mm, strict=False)
    for row, (output, before, place_mm, speed_mm_s, radius_mm) in enumerate(rows):
        lines += [output] if output != before else []
        if path.hold_s > 0 and row == begins:
            lines.append(f"  sleep({decimal(path.hold_s, 3)})")
        lines.append(f"  movep({pose(place_mm)}, a={accelerate}, v={_metres(speed_mm_s)}, r={_metres(radius_mm)})")
    return "\n".join([*lines, off, f"  movel({pose(over_mm[1])}, a={accelerate}, v={approach})", "end", ""])


def _outputs(path: RobotPath, settings: Urscript) -> list[str]:
    """Return the statements that set the dispenser's output: first off, then one from each waypoint to the next."""
    call = f"  set_standard_{settings.dispenser}_out({settings.port}, "
    flow_mm3_s = np.append(0.0, path.trajectory.flow_mm3_s[:-1])
    if settings.full_flow_mm3_s is None:
        path.level_flow_mm3_s("a digital output", 'set urscript.dispenser = "analog"')
        return [f"{call}{flow > 0})" for flow in flow_mm3_s]
    share = flow_mm3_s / settings.full_flow_mm3_s
    fault = (
        f"the path's flow rises to {flow_mm3_s.max():.4g} mm³/s, but at its full level the dispenser gives only "
        f"urscript.full_flow_mm3_s = {settings.full_flow_mm3_s:g}. Digitise with a lower path.speed_mm_s."
    )
    path.require((share.max() > 1, fault))
    return [f"{call}{decimal(float(value), 5)})" for value in share]


def _notes(path: RobotPath, settings: Urscript) -> list[str]:
    dispenser = (
        f"First set the dispenser to {path.trajectory.flow_mm3_s.max():.4f} mm3/s."
        if settings.full_flow_mm3_s is None
        else f"Analog output {settings.port}: 1.0 is {settings.full_flow_mm3_s:g} mm3/s."
    )
    return [
        "Units: m, rad, m/s. Poses in the base frame, and the active TCP must be the tip of the nozzle.",
        f"movej goes to the place above the path at {JOINT_SPEED_RAD_S} rad/s, on a way that the arm chooses: start "
        "near it.",
        dispenser,
    ]


def _blend_limit(path: RobotPath, settings: Urscript) -> Limit:
    closest_mm = np.linalg.norm(np.diff(path.trajectory.position_mm, axis=0), axis=1).min()
    return (
        settings.blend_mm >= closest_mm / 2,
        f"urscript.blend_mm is {settings.blend_mm:g}: it must be below half the smallest distance between waypoints "
        f"({closest_mm:.4g} mm), or the arm skips waypoints. Give less than {closest_mm / 2:.3g}, or digitise with a "
        "larger path.spacing_mm.",
    )


def _tool(frame: RobotFrame, settings: Urscript) -> Rotation:
    """Return the tool's orientation, with z along the nozzle.

    By default z points into the face, and the tool is turned from the robot's x axis.
    """
    if settings.rotation_vector_rad is not None:
        return Rotation.from_rotvec(settings.rotation_vector_rad)
    down = -frame.normal
    x = np.array([1.0, 0.0, 0.0]) - down[0] * down
    x /= np.linalg.norm(x)
    square = Rotation.from_matrix(np.column_stack([x, np.cross(down, x), down]))
    return square * Rotation.from_euler("z", settings.tool_turn_deg, degrees=True)


def _tool_limit(path: RobotPath, turn: Rotation) -> Limit:
    along = turn.apply([0.0, 0.0, 1.0])
    off_deg = float(np.degrees(np.arccos(np.clip(-along @ path.frame.normal, -1, 1))))
    fault = f"urscript.rotation_vector_rad puts the nozzle {off_deg:.1f} degrees off the face's normal"
    return path.motion_limit("largest_tilt_deg", off_deg, fault, "Teach it again, or remove it.")


def _metres(mm: float) -> str:
    return decimal(mm / 1000, 7)
