"""
Your first crack
================

A photo becomes a crack, a solid, a nozzle path, a fluid run and a report. The photo is a detail of the "Concrete Crack
Segmentation Dataset" by Çağlar Fırat Özgenel (2019), https://doi.org/10.17632/jwsn7tfbrp.1, CC BY 4.0
(https://creativecommons.org/licenses/by/4.0/); cropped, and enlarged three times from a reduced preview. Its scale and
the crack's depth are invented, and the report says so.
"""

# %%
# Nobody measured the scale of this photo, so it is declared assumed. The two ends of the crack were clicked.
import tempfile
from pathlib import Path

import sealtwin as st

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "real-crack"
photo = st.read_photo(FIXTURE / "photo.jpg", mm_per_px=0.25, scale_is="assumed", data="measured")
crack = st.trace_crack(photo, ends_px=[(10, 163), (359, 133)])
print(f"{crack.length_mm:.1f} mm long, {crack.mean_width_mm:.2f} mm wide; scale: {crack.scale_source}")

# %%
# A photo does not show the depth of a crack, nor the tilt of its walls. The depth is given. The walls lean by 11
# degrees, 0.6 of the cavity is dispensed, and the nozzle moves at 4 mm/s: these are defaults.
solid = st.build_solid(crack, depth_mm=12)
path = st.plan_path(solid)
print(f"the cavity holds {solid.cavity_volume_mm3 / 1000:.2f} ml; the nozzle moves for {path.duration_s:.1f} s")

# %%
# A draft has coarse particles and is quick. Leave ``solver`` out for a run whose level can be compared with readings.
paste = st.Fluid(viscosity_pa_s=0.3, yield_stress_pa=2, freeze_after_s="never")
run = st.inject(path, paste, solver=st.Solver(preset="draft"), device="cpu")
st.plot_levels(run)

# %%
# The report is a page without any other file, and a JSON file for programs; ``pdf=True`` adds a PDF. With readings,
# ``st.compare`` adds a verdict.
with tempfile.TemporaryDirectory() as folder:
    page = st.write_report(folder, run, name="Your first crack")
    print(sorted(file.name for file in page.parent.iterdir()))
