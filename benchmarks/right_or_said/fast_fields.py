"""The fast model goes on in silence with a sealant that has a setting which it lacks, such as another law of flow."""

from typing import Literal

import numpy as np

import sealtwin as st


class Casson(st.Fluid):
    shear_law: Literal["bingham", "casson"] = "bingham"  # As a maintainer would add it


crack = st.crack_from_polyline([(0.0, 20.0), (60.0, 20.0)], 3.0, face_mm=(80, 40), data="synthetic")
solid = st.build_solid(crack, 16, tilt="vertical", wall_angle_deg=0)
path = st.plan_path(crack, solid, speed_mm_s=4, fill=0.6, trim_mm=10)
bingham = Casson(viscosity_pa_s=2.0, yield_stress_pa=6.0)
casson = Casson(viscosity_pa_s=2.0, yield_stress_pa=6.0, shear_law="casson")
try:
    off_mm = np.ptp([st.fill_fast(crack, solid, path, fluid).level_mm for fluid in (bingham, casson)], axis=0).max()
    print(f"{'right' if off_mm > 0 else 'silent'}: casson differs from bingham by {off_mm:g} mm")
except st.InputError as fault:
    print(f"said: {fault}")
