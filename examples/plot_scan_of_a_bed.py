"""
A scan of a bed
===============

A scan of the sealed face gives the level all along the crack. The scan of this example is EMULATED: the program makes
its points from a level that it computes, so the error of the reading is known.
"""

# %%
# The fast model fills a winding crack. Its level is the truth.
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

import sealtwin as st

x_mm = np.linspace(0, 80, 200)
line_mm = np.column_stack([x_mm, 14 + 8 * np.sin(x_mm / 25) + 2 * np.sin(x_mm / 7)])
crack = st.crack_from_polyline(line_mm, width_mm=5, face_mm=(80, 40), data="synthetic")
solid = st.build_solid(crack, depth_mm=16, tilt="vertical", wall_angle_deg=0)
path = st.plan_path(solid, speed_mm_s=4, fill=0.7, trim_mm=10)
truth = st.fill_fast(path, st.Fluid(viscosity_pa_s=2, yield_stress_pa=4)).level

# %%
# The emulated scanner sees a point every 0.3 mm, with a noise of 0.05 mm. One point in 200 is an outlier. The sealant
# is hidden from s = 50 to 56 mm. The scanner's axes are turned by 8 degrees, tilted by 2, and moved.
random = np.random.default_rng(1)
points_mm = np.stack(np.meshgrid(np.arange(0, 80.1, 0.3), np.arange(0, 40.1, 0.3)), axis=-1).reshape(-1, 2)
fine_mm = np.linspace(0, crack.length_mm, 4000)
centre_mm = np.column_stack([np.interp(fine_mm, crack.s_mm, column) for column in crack.centreline_mm.T])
away_mm, nearest = KDTree(centre_mm).query(points_mm)
s_mm, in_mouth = fine_mm[nearest], away_mm < 2.5
height_mm = np.where(in_mouth, np.interp(s_mm, truth.s_mm, truth.level_mm), 0.0)
height_mm += random.normal(0, 0.05, len(height_mm))
height_mm[random.random(len(height_mm)) < 0.005] += 8
seen = ~(in_mouth & (s_mm > 50) & (s_mm < 56))
turn = Rotation.from_euler("zx", [8, 2], degrees=True)
scan_mm = turn.apply(np.column_stack([points_mm, height_mm])[seen]) + np.array([120, -40, 310])

# %%
# No format states a unit or which way heights grow, so ``placement`` must. The position is found by the
# face's plane and the crack's mouth.
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder, "bed.xyz")
    np.savetxt(file, scan_mm, fmt="%.4f")
    readings = st.read_readings(file, solid, placement={"units": "mm", "up": "z"}, data="synthetic")
print(readings.dialect)

# %%
# The level is the mean across the crack, every millimetre. The interval is that of its mean along the crack.
figures = readings.scan.figures
true_mm = np.interp(readings.s_mm, truth.s_mm, truth.level_mm)
true_mean_mm = np.trapezoid(true_mm, readings.s_mm) / np.ptp(readings.s_mm)
rms_mm = np.sqrt(np.mean((readings.level_mm - true_mm) ** 2))
print(f"mean {figures.mean_level_mm:.3f} ± {figures.mean_level_95_mm:.3f} mm (95 %), truth {true_mean_mm:.3f} mm")
print(f"RMS error {rms_mm:.3f} mm at {len(true_mm)} stations")

# %%
# Heights beside the centreline, and the level below them. White was not scanned.
figure, (above, below) = plt.subplots(2, figsize=(9, 5), sharex=True, layout="constrained")
colours = above.pcolormesh(readings.scan.s_mm, readings.scan.across_mm, readings.scan.height_mm, vmin=-8, vmax=1)
figure.colorbar(colours, ax=above, label="height (mm)")
above.set(ylabel="to the left (mm)")
below.plot(truth.s_mm, truth.level_mm, color="grey", label="truth")
below.plot(readings.s_mm, readings.level_mm, ".", label="scan")
below.set(xlabel="s along the crack (mm)", ylabel="level (mm)")
below.legend()
