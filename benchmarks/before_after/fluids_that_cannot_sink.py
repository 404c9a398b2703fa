"""Fluids that end in hollows, and water that never rests: Python must warn of each."""

import json
import warnings

import sealtwin as st
from simulate.profile import volume_ratio
from tests.fluids import path, slot

CASES = {
    "K 20, n 0.3 in 3.1 mm": (3.1, st.Fluid(consistency_pa_s_n=20.0, flow_index=0.3)),
    "5 Pa s in 2 mm": (2.0, st.Fluid(viscosity_pa_s=5.0, density_kg_m3=1400.0)),
    "water in 3.7 mm": (3.7, st.Fluid(viscosity_pa_s=0.001, density_kg_m3=1000.0)),
}
lines = []
for name, (width_mm, fluid) in CASES.items():
    solid, crack = slot(16.0, width_mm=width_mm, depth_mm=10.0)
    nozzle, solver = st.Nozzle(diameter_mm=0.7 * width_mm), st.Solver(radius_mm=width_mm / 7, settle_s=2.0)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        trajectory = path(crack, 0.62e-3 * 16.0 * width_mm * 10.0, trim_mm=3.0)
        run = st.inject(crack, solid, trajectory, fluid, solver=solver, nozzle=nozzle)
    told = sum(issubclass(one.category, RuntimeWarning) for one in caught)
    lines.append((f"{name}: volume {volume_ratio(run, solid):.2f}, {told} warnings", told > 0))
print(json.dumps({"line": "; ".join(line for line, _ in lines), "sound": all(sound for _, sound in lines)}))
