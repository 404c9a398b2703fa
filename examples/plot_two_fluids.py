"""
Two fluids side by side
=======================

The same crack and the same path, once with a fluid that levels out and once with a paste that stands by its yield
stress. The crack is real; its scale and its depth are invented.

Photo: detail of "Concrete Crack Segmentation Dataset" by Çağlar Fırat Özgenel (2019),
https://doi.org/10.17632/jwsn7tfbrp.1, `CC BY 4.0 <https://creativecommons.org/licenses/by/4.0/>`_; cropped, and
enlarged three times from a reduced preview.
"""

# %%
# One crack, shallow and short of time for the example's sake.
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sealtwin as st

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "real-crack"
photo = st.read_photo(FIXTURE / "photo.jpg", mm_per_px=0.25, scale_is="assumed", data="measured")
crack = st.trace_crack(photo, ends_px=[(10, 163), (359, 133)])
solid = st.build_solid(crack, depth_mm=8, tilt="vertical")
path = st.plan_path(solid, speed_mm_s=20, fill=0.7)

# %%
# Viscosities in Pa s, stresses in Pa.
fluids = {
    "grout without a yield stress": st.Fluid(viscosity_pa_s=0.1),
    "paste, yield stress 4 Pa": st.Fluid(viscosity_pa_s=0.5, yield_stress_pa=4),
}
solver = st.Solver(radius_mm=0.5, settle_s=4.0)
levels = {}
for name, fluid in fluids.items():
    levels[name] = st.inject(path, fluid, solver=solver, device="cpu").level

# %%
# Any axes of matplotlib can be drawn on.
figure, axes = plt.subplots(2, sharex=True, figsize=(9, 6), layout="constrained")
for ax, (name, level) in zip(axes, levels.items(), strict=True):
    st.plot_levels(level, ax=ax)
    ax.set_title(name, pad=24)

# %%
# The grout runs to the ends, where the nozzle does not go; the paste stays nearer to where it was laid.
for name, level in levels.items():
    in_middle = (level.s_mm > 15) & (level.s_mm < crack.length_mm - 15)
    print(f"{name}: {np.mean(level.level_mm[in_middle]):.2f} mm in the middle, {level.level_mm[0]:.2f} mm at s = 0")
