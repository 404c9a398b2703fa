"""Settings in another unit than the one meant: each is asked about, and none of the usual sealants is."""

import warnings

import sealtwin as st

warnings.simplefilter("ignore")
slips = [("viscosity_pa_s", 300.0), ("density_kg_m3", 1.69), ("diameter_mm", 6.0), ("speed_mm_s", 0.04)]
slips += [("diameter_mm", 24.0), ("gradient_deg", 25.0), ("depth_mm", 1.6)]
crack, silent, texts = st.crack_from_polyline([(0, 0), (60, 0)], 2.9), [], []
for name, value in [*slips, ("viscosity_pa_s", 0.001), ("viscosity_pa_s", 20.0), ("density_kg_m3", 1025.0)]:
    default = {"depth_mm": 16.0, "speed_mm_s": 4.0, "diameter_mm": 2.4, "gradient_deg": 0.0}
    at = default | {"viscosity_pa_s": 0.3, "density_kg_m3": 1690.0} | {name: value}
    solid = st.build_solid(crack, at["depth_mm"], tilt="vertical")
    path = st.plan_path(crack, solid, fill=0.8, speed_mm_s=at["speed_mm_s"])
    fluid = st.Fluid(yield_stress_pa=3.0, viscosity_pa_s=at["viscosity_pa_s"], density_kg_m3=at["density_kg_m3"])
    nozzle = st.Nozzle(diameter_mm=at["diameter_mm"])
    level = st.fill_fast(crack, solid, path, fluid, nozzle=nozzle, gradient_deg=at["gradient_deg"])
    texts += [" ".join(text for record in (solid, path, level) for text in getattr(record, "doubts", ()))]
    silent += [(name, value)] if (name in texts[-1]) != ((name, value) in slips) else []
print(f"silent, or doubted without reason: {silent}" if silent else f"said: {texts[0]}")
