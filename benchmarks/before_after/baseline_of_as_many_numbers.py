"""Readings that a parabola meets better than a level with three settings fitted: the headline must say so.

With as many settings as stations it must say that they fit anything, and an empty list is a declaration too.
"""

import json

import numpy as np

import sealtwin as st
from sealtwin.core.records import Profile

photo = st.read_photo("fixtures/paper-trial/photo.jpg", mm_per_px=0.1)
crack = st.trace_crack(photo, ends_px=[(719, 658), (1403, 259)])
solid = st.build_solid(crack, depth_mm=16)
s_mm = np.linspace(0.0, 75.0, 16)
bed_mm = -8.0 + 6.0 * (s_mm / 75.0 - 1.0) ** 2
repeats_mm = bed_mm[:, None] + 0.1 * np.random.default_rng(0).standard_normal((16, 3))
table = np.column_stack([s_mm, repeats_mm])
SIXTEEN = """fluid.U fluid.D_cm crack.tilt crack.depth_mm crack.wall_angle_deg fluid.yield_stress_pa fluid.density_kg_m3
fluid.freeze_after_s path.volume_ml path.speed_mm_s path.trim_mm nozzle.diameter_mm solver.radius_mm solver.substeps
solver.settle_s seed"""


def headline(*fitted: str) -> tuple[str, ...]:
    readings = st.read_readings(table, crack, solid, data="measured", role="calibrated-on", fitted=fitted)
    return st.compare(Profile(s_mm, bed_mm + 0.6 * np.sign(s_mm - 37.0)), readings, crack, solid).headline


three = headline("fluid.U", "fluid.D_cm", "crack.tilt")[1]
sixteen, nothing = headline(*SIXTEEN.split())[1], headline()[2]
sound = "parabola" in three and "no better" in three and "fit any readings exactly" in sixteen
line = f"{three} 16 settings: ...{sixteen[-110:]} None: {nothing}"
print(json.dumps({"line": line, "sound": sound and "not declared" not in nothing}))
