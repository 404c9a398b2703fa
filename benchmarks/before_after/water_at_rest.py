"""Water that a run says to flow as 2.5 mm2/s: its particles stay in motion, and the same sentence must say so."""

import json
import warnings

import sealtwin as st
from tests.fluids import path, slot

solid, crack = slot(16.0, width_mm=3.7, depth_mm=10.0)
nozzle, solver = st.Nozzle(diameter_mm=2.6), st.Solver(radius_mm=3.7 / 7, settle_s=4.0)
fluid = st.Fluid(viscosity_pa_s=0.001, density_kg_m3=1000.0)
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    run = st.inject(crack, solid, path(crack, 0.367, trim_mm=3.0), fluid, solver=solver, nozzle=nozzle)
said = [str(one.message) for one in caught]
first = next((one for one in [*said, *getattr(run, "remarks", ())] if "of their own" in one), "no word")
print(json.dumps({"line": first[max(0, first.find("of their own")) :], "sound": "does not come to rest" in first}))
