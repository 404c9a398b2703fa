"""
Records, lists and axes in a notebook
=====================================

A record shows its main figures in a line, or as a table in a notebook. Readings may be a list of rows, and levels are
drawn on axes of your own.
"""

# %%
# A crack from its middle line, its solid and a path. Printed, each is one line.
import matplotlib.pyplot as plt

import sealtwin as st

crack = st.crack_from_polyline([(0, 20), (30, 22), (60, 18), (80, 20)], width_mm=3, face_mm=(80, 40), data="synthetic")
solid = st.build_solid(crack, depth_mm=16, tilt="vertical", wall_angle_deg=0)
path = st.plan_path(solid, speed_mm_s=4, fill=0.8, trim_mm=10)
for record in (crack, solid, path):
    print(record)

# %%
# Readings as a lab writes them: rows of a list, whose columns are named as in a sheet. Units and the direction are in
# the names; None is a missing reading. A remark that may change readings is asked about: here it says why one is
# missing, and ``as_written`` confirms that.
rows = [
    [1, 9.4, 9.6, ""],
    [2, 6.5, 6.6, ""],
    [4, 2.6, None, "caliper slipped"],
    [6, 0.3, 0.4, ""],
    [7, -1.6, -1.5, ""],
]
columns = ["s [cm]", "depth 1 [mm]", "depth 2 [mm]", "remark"]
readings = st.read_readings(rows, solid, columns=columns, as_written=["D4"], data="synthetic")
print(readings.s_mm, readings.level_mm)

# %%
# A fault is described by the keywords of the function: here no column has a unit.
try:
    st.read_readings([[1, 7.9], [2, 3.5]], columns=["s_mm", "depth"])
except st.InputError as fault:
    print(fault)

# %%
# Levels of two pastes beside each other, on axes that you made. The level has the next colour of the axes, and the
# title stays.
runs = [st.fill_fast(path, st.Fluid(viscosity_pa_s=0.3, yield_stress_pa=each)) for each in (2, 6)]
results = [st.compare(run, readings) for run in runs]
figure, row = plt.subplots(1, 2, figsize=(11, 4), sharey=True, layout="constrained")
for ax, result, title in zip(row, results, ("2 Pa", "6 Pa"), strict=True):
    ax.set_title(title)
    st.plot_levels(result, ax=ax, label="fast model")

# %%
# The comparison of the second one. As the last line of a cell, a record is a table.
results[1]
