"""
A crack from lines, and the fast model in a loop
================================================

A crack that you know by its lines needs no photo. The fast model fills it in a tenth of a second, so that a parameter
can be varied in a loop.
"""

# %%
# The centreline in millimetres, and its width. The line ends at the edge of the face, so the crack is open there.
import warnings

import matplotlib.pyplot as plt
import numpy as np

import sealtwin as st

x_mm = np.linspace(0, 80, 60)
line_mm = np.column_stack([x_mm, 20 + 3 * np.sin(x_mm / 12)])
crack = st.crack_from_polyline(line_mm, width_mm=3, face_mm=(80, 40), data="synthetic")
solid = st.build_solid(crack, depth_mm=16, tilt="vertical", wall_angle_deg=0)
path = st.plan_path(solid, speed_mm_s=4, fill=0.8, trim_mm=10)
print(crack, solid, path, sep="\n")

# %%
# Two walls are a crack as well, here with a width that grows. ``st.import_dxf`` reads either from a drawing.
left_mm, right_mm = (np.column_stack([x_mm, line_mm[:, 1] + y_mm]) for y_mm in (1.5, -1 - x_mm / 40))
wider = st.crack_from_walls(left_mm, right_mm, face_mm=(80, 40), data="synthetic")
print(wider)

# %%
# Paste of three yield stresses. The model warns if it is unfit for a case.
_, ax = plt.subplots(figsize=(9, 4), layout="constrained")
for yield_stress_pa in (2, 6, 18):
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        level = st.fill_fast(path, st.Fluid(viscosity_pa_s=2, yield_stress_pa=yield_stress_pa)).level
    st.plot_levels(level, ax=ax, label=f"{yield_stress_pa} Pa{', unfit' if doubts else ''}")
    print(f"{yield_stress_pa} Pa: highest {level.level_mm.max():.2f} mm, {len(doubts)} reasons against the fast model")
