"""Robots' cells and placed paths for tests: a face of 160 x 40 mm, turned, shifted and a little tipped."""

from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from digitise.robots.cell import RobotCell
from digitise.robots.robot_path import RobotPath, place_path
from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory
from sealtwin.core.records import Floats, Outline, Sections, Trajectory
from sealtwin.trial.starter_files import CELL
from tests.support.shapes import CUT, random_crack, wandering_crack

TAUGHT = """
[[taught]]
sample_mm = [0.0, 0.0]
robot_mm = [250.0, -80.0, 55.0]

[[taught]]
sample_mm = [160.0, 0.0]
robot_mm = [250.0, 80.0, 55.0]

[[taught]]
sample_mm = [0.0, 40.0]
robot_mm = [210.0, -80.0, 55.0]
"""
TAUGHT_CELL = CELL + TAUGHT
"""The example of a cell file with points that are taught on the sample's face."""
PHOTO_CELL = f'taught_in = "photo"\n{TAUGHT_CELL}'
"""The same cell for a photo whose scale is mm_per_px."""
CORNERS_MM = ((0.0, 0.0), (160.0, 0.0), (0.0, 40.0))
SHIFT_MM = (300.0, -60.0, 80.0)
SECTIONS = Sections(np.array([0.0, 90.0]), np.array([5.0, 15.0]), np.array([15.0, 45.0]))


def in_cell(sample_mm: Floats, turn_deg: float = 25.0, tip_deg: float = 1.0) -> Floats:
    """Points (n, 3) of the sample where the robot of ``cell`` finds them."""
    return Rotation.from_euler("zx", [turn_deg, tip_deg], degrees=True).apply(np.array(sample_mm)) + SHIFT_MM


def cell(turn_deg: float = 25.0, tip_deg: float = 1.0, **changes: Any) -> RobotCell:
    taught = in_cell(np.column_stack([CORNERS_MM, np.zeros(3)]), turn_deg, tip_deg)
    tables: dict[str, Any] = {
        "name": "bench",
        "formats": ("csv",),
        "taught": tuple(
            {"sample_mm": sample, "robot_mm": tuple(robot)}
            for sample, robot in zip(CORNERS_MM, taught.tolist(), strict=True)
        ),
        "reach": {"low_mm": (-800.0, -800.0, -800.0), "high_mm": (800.0, 800.0, 800.0)},
        "motion": {"largest_speed_mm_s": 200.0, "acceleration_mm_s2": 2000.0},
        "plunger": {"diameter_mm": 20.0, "travel_mm": 100.0, "largest_speed_mm_s": 20.0},
        "spel": {"dispenser": "output", "output_bit": 8},
        "gcode": {},
        "urscript": {"dispenser": "analog", "port": 0, "full_flow_mm3_s": 4000.0},
    }
    for name, change in changes.items():
        tables[name] = {**tables[name], **change} if isinstance(change, dict) else change
    return RobotCell.model_validate(tables)


def trajectory(outline: Outline | None = None, **path: Any) -> Trajectory:
    plan = NozzlePath.model_validate({"volume_ml": 4.8, "trim_mm": 10.0} | path)
    return plan_trajectory(wandering_crack(1) if outline is None else outline, plan, 1.0, SECTIONS)


def placed(it: Trajectory | None = None, **changes: Any) -> RobotPath:
    return place_path(trajectory() if it is None else it, cell(**changes), "cell.toml")


def random_paths() -> st.SearchStrategy[Trajectory]:
    """Paths of every kind over random cracks."""
    return st.builds(
        lambda seed, speed, spacing, ramp, leads, reverse, flow: trajectory(
            replace(random_crack("plain", seed, length_mm=40.0, ends=CUT), face_mm=(-60.0, -60.0, 60.0, 60.0)),
            trim_mm=(2.0, 4.0),
            speed_mm_s=speed,
            spacing_mm=spacing,
            ramp_mm=ramp,
            lead_in_mm=leads[0],
            lead_out_mm=leads[1],
            reverse=reverse,
            flow=flow,
            volume_ml=0.6,
        ),
        seed=st.integers(0, 30),
        speed=st.floats(1.0, 40.0),
        spacing=st.floats(0.5, 3.0),
        ramp=st.sampled_from([0.0, 6.0]),
        leads=st.tuples(st.sampled_from([0.0, 8.0]), st.sampled_from([0.0, 6.0])),
        reverse=st.booleans(),
        flow=st.sampled_from(["constant", "cross_section"]),
    )
