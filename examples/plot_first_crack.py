"""
Your first crack
================

A photo becomes a crack, a solid, a nozzle path, a fluid run and a report that compares it with caliper readings. Photo
and readings are those of ``fixtures/paper-trial``; nothing of them was measured, and the report says so.
"""

# %%
# The photo has a frame of markers, which give it a scale. The two ends of the crack were clicked.
import tempfile
import tomllib
from pathlib import Path

import sealtwin as st

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "paper-trial"
markers = tomllib.loads((FIXTURE / "trial.toml").read_text(encoding="utf-8"))["photo"]["markers"]
photo = st.read_photo(FIXTURE / "photo.jpg", face_mm=(160, 40), markers=markers, data="synthetic")
crack = st.trace_crack(photo, ends_px=[(719.3, 658.4), (1402.7, 258.9)])
print(f"{crack.length_mm:.1f} mm long, {crack.mean_width_mm:.2f} mm wide; scale: {crack.scale_source}")

# %%
# A photo does not show the depth of a crack, nor the tilt of its walls: both are given.
solid = st.build_solid(crack, depth_mm=16, tilt="flare", wall_angle_deg=5.5)
path = st.plan_path(solid, speed_mm_s=10, volume_ml=4.8)
print(f"the cavity holds {solid.cavity_volume_mm3 / 1000:.2f} ml; the nozzle moves for {path.duration_s:.1f} s")

# %%
# Particles of 0.75 mm radius are quick and coarse: two abreast. Leave ``solver`` out for four abreast.
paste = st.Fluid(U=30, D_cm=0.3, freeze_after_s=2.58)
run = st.inject(path, paste, solver=st.Solver(radius_mm=0.75, settle_s=0.5), device="cpu")

# %%
# The readings, and how far the simulated level lies from them.
readings = st.read_readings(FIXTURE / "caliper.csv", solid, data="reconstructed", role="calibrated-on")
result = st.compare(run, readings, gate={"mean_error_mm": 1.6})
low_mm, high_mm = result.interval_95_mm
print(f"mean error {result.mean_error_mm:.2f} mm, 95 % interval {low_mm:.2f} to {high_mm:.2f} mm")
print(result.verdict)
st.plot_levels(result)

# %%
# The report is a page without any other file, and a JSON file for programs; ``pdf=True`` adds a PDF.
with tempfile.TemporaryDirectory() as folder:
    page = st.write_report(folder, result, name="Your first crack")
    print(sorted(file.name for file in page.parent.iterdir()))
