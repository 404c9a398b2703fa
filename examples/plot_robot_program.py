"""
A robot's program
=================

The nozzle's path is turned into the robot's frame by points that were taught on the sample's face, held against the
limits of the cell, and written in the robot's own language.
"""

# %%
# The crack and the path; no fluid is needed for them.
import tempfile
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt

import sealtwin as st

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "paper-trial"
markers = tomllib.loads((FIXTURE / "trial.toml").read_text(encoding="utf-8"))["photo"]["markers"]
photo = st.read_photo(FIXTURE / "photo.jpg", face_mm=(160, 40), markers=markers, data="synthetic")
crack = st.trace_crack(photo, ends_px=[(719.3, 658.4), (1402.7, 258.9)])
solid = st.build_solid(crack, depth_mm=16, tilt="vertical")
path = st.plan_path(solid, speed_mm_s=8, volume_ml=2.5, lead_in_mm=5, lead_out_mm=5, ramp_mm=3)

# %%
# The cell: three points of the face, counted from its lower left corner, as the robot found them; the box that the tip
# must not leave; what the arm may do.
# ``sealtwin robot --example cell.toml`` writes such a cell with a comment on each line.
cell = {
    "name": "bench",
    "formats": ["csv", "urscript"],
    "taught": [
        {"sample_mm": [0.0, 0.0], "robot_mm": [250.0, -80.0, 55.0]},
        {"sample_mm": [160.0, 0.0], "robot_mm": [250.0, 80.0, 55.0]},
        {"sample_mm": [0.0, 40.0], "robot_mm": [210.0, -80.0, 55.0]},
    ],
    "reach": {"low_mm": [100.0, -150.0, 50.0], "high_mm": [350.0, 150.0, 200.0]},
    "motion": {"largest_speed_mm_s": 100.0, "acceleration_mm_s2": 200.0},
    "urscript": {"blend_mm": 0.4, "dispenser": "digital", "port": 0},
}
with tempfile.TemporaryDirectory() as folder:
    written = st.write_robot_program(folder, path, cell, name="My sample")
    print([file.name for file in written])
    print(written[1].read_text(encoding="utf-8")[:900])

# %%
# Speed and flow over time: ramps at both ends, leads without flow.
figure, (above, below) = plt.subplots(2, sharex=True, figsize=(9, 4), layout="constrained")
above.step(path.t_s, path.speed_mm_s, where="post")
above.set_ylabel("speed (mm/s)")
below.step(path.t_s, path.flow_mm3_s, where="post")
below.set(xlabel="time (s)", ylabel="flow (mm³/s)")
