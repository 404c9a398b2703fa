"""
Readings only
=============

A sheet of caliper readings can be read, checked and drawn without any simulation.
"""

# %%
# The file says what it holds in its header: arc length along the crack, and three readings of the level at each
# station, upward from the face. What a file does not say is asked for, never guessed.
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sealtwin as st

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "paper-trial"
readings = st.read_readings(FIXTURE / "caliper.csv", data="reconstructed")
print(readings.dialect)
st.plot_levels(readings)

# %%
# The scatter of the repeats: one standard deviation at each station, and pooled over all of them.
deviation_mm = np.std(np.asarray(readings.repeats_mm), axis=1, ddof=1)
pooled_mm = np.sqrt(np.mean(deviation_mm**2))
print(f"{len(readings.s_mm)} stations, repeatability {pooled_mm:.3f} mm")
figure, ax = plt.subplots(figsize=(9, 3), layout="constrained")
ax.stem(readings.s_mm, deviation_mm, basefmt=" ")
ax.axhline(pooled_mm, linestyle="--", color="grey", label="pooled")
ax.set(xlabel="s along the crack (mm)", ylabel="standard deviation (mm)")
ax.legend()

# %%
# Readings may also be an array: s in mm, then the readings of each station; NaN where one is missing. A depth counts
# downward.
table = np.array([[0.0, 16.1, 15.9], [10.0, 10.0, np.nan], [20.0, 4.1, 3.9]])
print(st.read_readings(table, quantity="depth").level_mm)

# %%
# What cannot be is refused by its place, so that it can be mended.
try:
    st.read_readings(np.array([[0.0, -1.0], [np.nan, -2.0]]))
except st.InputError as fault:
    print(fault)
