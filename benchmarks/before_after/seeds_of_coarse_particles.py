"""Two seeds at a radius of which a nozzle of 2.4 mm releases one particle at a time: their levels must differ."""

import json

import numpy as np

import sealtwin as st

photo = st.read_photo("fixtures/paper-trial/photo.jpg", mm_per_px=0.1)
crack = st.trace_crack(photo, ends_px=[(719, 658), (1403, 259)])
solid = st.build_solid(crack, depth_mm=16, tilt="flare", wall_angle_deg=5.5)
path = st.plan_path(crack, solid, speed_mm_s=4, volume_ml=4.8)
paste = st.Fluid(U=30, D_cm=0.3, yield_stress_pa=12)


def scatter_mm(radius_mm: float) -> float:
    """RMS over the levels of a pair of seeds, the mean over three pairs."""
    levels = []
    for seed in range(3):
        run = st.inject(crack, solid, path, paste, solver=st.Solver(radius_mm=radius_mm), seed=seed)
        levels.append(st.measure_level(run, crack, solid).level_mm)
    pairs = [levels[a] - levels[b] for a, b in ((0, 1), (0, 2), (1, 2))]
    return float(np.sqrt(np.mean(np.square(pairs))))


coarse_mm, fine_mm = scatter_mm(0.7), scatter_mm(0.6)
print(
    json.dumps(
        {
            "line": f"seeds differ by {coarse_mm:.3f} mm RMS at R = 0.7 mm, by {fine_mm:.3f} mm at R = 0.6",
            "sound": fine_mm / 1.5 <= coarse_mm <= 1.5 * fine_mm,
        }
    )
)
