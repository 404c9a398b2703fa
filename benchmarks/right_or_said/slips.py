"""Settings in another unit than the one meant: each is named, and none of the usual sealants is."""

import warnings
from typing import Any

import sealtwin as st

warnings.simplefilter("ignore")
crack = st.crack_from_polyline([(0, 0), (60, 0)], 2.9)


def doubts(depth_mm: float = 16.0, speed_mm_s: float = 4.0, nozzle_mm: float = 2.4, **others: Any) -> str:
    """Return what solid, path and a run by the fast model say, without the reasons why that model is unfit."""
    solid = st.build_solid(crack, depth_mm, tilt="vertical")
    path = st.plan_path(crack, solid, fill=0.8, speed_mm_s=speed_mm_s)
    slope = {key: others.pop(key) for key in ("gradient_deg",) if key in others}
    fluid = st.Fluid(**{"viscosity_pa_s": 0.3, "yield_stress_pa": 3.0} | others)
    level = st.fill_fast(crack, solid, path, fluid, nozzle=st.Nozzle(diameter_mm=nozzle_mm), **slope)
    return " ".join(said for record in (solid, path, level) for said in getattr(record, "doubts", ()))


slips = [
    ({"viscosity_pa_s": 300.0}, "in mPa s"),
    ({"density_kg_m3": 1.69}, "g/cm3"),
    ({"nozzle_mm": 6.0}, "diameter_mm is 6"),
    ({"nozzle_mm": 24.0}, "diameter_mm is 24"),
    ({"speed_mm_s": 0.04}, "m/s"),
    ({"gradient_deg": 25.0}, "percent"),
    ({"depth_mm": 1.6}, "cm"),
]
meant = [{}, {"viscosity_pa_s": 0.001, "yield_stress_pa": 0.5}, {"viscosity_pa_s": 20.0, "density_kg_m3": 1400.0}]
silent = [str(slip) for slip, word in slips if word not in doubts(**slip)]
wrong = [said for settings in meant if (said := doubts(**settings))]
if silent or wrong:
    print(f"silent: {', '.join(silent)}; doubted without reason: {wrong}")
else:
    print(f"said: all {len(slips)}, such as: {doubts(viscosity_pa_s=300.0)}")
