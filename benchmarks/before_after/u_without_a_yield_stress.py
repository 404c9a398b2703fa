"""U = 100,000 without a yield stress levels like water: its record must not call it a viscosity."""

import json

import sealtwin as st
from tests.fluids import path, slot

solid, crack = slot(12.0)
run = st.inject(crack, solid, path(crack, 0.05, speed_mm_s=20.0), st.Fluid(U=1e5), solver=st.Solver(radius_mm=0.6))
recorded = run.health.viscosity_pa_s
line = "no viscosity is recorded" if recorded is None else f"{recorded:.0f} Pa s are recorded"
print(json.dumps({"line": f"U = 1e5 without a yield stress: {line}", "sound": recorded is None}))
