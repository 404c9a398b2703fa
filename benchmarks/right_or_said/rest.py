"""A shear-thinning bed without yield stress that still flattens, and one of Bingham paste that has come to rest."""

import warnings

import sealtwin as st

crack = st.crack_from_polyline([[0.0, 0.0], [18.0, 0.0]], 2.6, data="synthetic")
solid = st.build_solid(crack, 9.0, tilt="vertical")
path = st.plan_path(crack, solid, volume_ml=0.7 * 0.018 * 2.6 * 9.0, speed_mm_s=4.0, trim_mm=2.0)
thin = st.Fluid(consistency_pa_s_n=4.0, flow_index=0.4, density_kg_m3=1600.0)
paste = st.Fluid(viscosity_pa_s=0.3, yield_stress_pa=12.0)
texts, ranges = [], []
for settle_s, fluid in ((0.0, thin), (2.0, thin), (15.0, thin), (2.0, paste)):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = st.inject(crack, solid, path, fluid, solver=st.Solver(radius_mm=0.371, settle_s=settle_s))
    texts.append(" ".join(str(each.message) for each in caught if "at rest" in str(each.message)))
    level_mm = st.measure_level(run, crack, solid).level_mm
    ranges.append(f"{level_mm.max() - level_mm.min():.1f}")
verdict = "said" if all("flat" in text for text in texts[:3]) and not texts[3] else "silent"
print(f"{verdict}: level uneven by {', '.join(ranges[:3])} mm after 0, 2, 15 s: {texts[1] or 'no word'}")
