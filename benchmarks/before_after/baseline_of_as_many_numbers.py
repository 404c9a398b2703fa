"""Readings that a parabola meets better than a level with three settings fitted: the headline must say so."""

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
fitted = ("fluid.U", "fluid.D_cm", "crack.tilt")
table = np.column_stack([s_mm, repeats_mm])
readings = st.read_readings(table, crack, solid, data="measured", role="calibrated-on", fitted=fitted)
result = st.compare(Profile(s_mm, bed_mm + 0.6 * np.sign(s_mm - 37.0)), readings, crack, solid)
line = result.headline[1]
print(json.dumps({"line": line, "sound": "parabola" in line and "no better" in line}))
