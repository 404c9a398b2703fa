"""
A block of paste that is let go
===============================

A dam break has no crack and no nozzle: a block of fluid stands behind a gate, and the gate is gone.
``st.release_block`` computes the front, so that a measured front can be compared with a rheometer's numbers.
"""

# %%
# A block of 20 x 20 x 20 mm in front of a plate. The paste has Herschel and Bulkley's law.
import matplotlib.pyplot as plt

import sealtwin as st

fluid = st.Fluid(yield_stress_pa=7, consistency_pa_s_n=6.3, flow_index=0.5, density_kg_m3=1175)
solver = st.Solver(radius_mm=1.2)
block = {"length_mm": 20, "width_mm": 20, "height_mm": 20, "duration_s": 0.4, "ahead_mm": 40, "solver": solver}
on_plate = st.release_block(fluid=fluid, every_s=0.02, **block)
print(on_plate)

# %%
# A stiffer paste stops sooner.
stiff = st.Fluid(yield_stress_pa=28, consistency_pa_s_n=6.3, flow_index=0.5, density_kg_m3=1175)
stiffer = st.release_block(fluid=stiff, every_s=0.02, **block)
_, ax = plt.subplots(figsize=(8, 4), layout="constrained")
for name, run in (("7 Pa", on_plate), ("28 Pa", stiffer)):
    ax.plot(run.t_s, run.front_mm, label=name)
ax.set(xlabel="time since the gate is gone (s)", ylabel="front ahead of the gate (mm)")
ax.legend()
