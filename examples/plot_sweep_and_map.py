"""
A sweep and its map
===================

A trial file is run once for each pair of two settings, and the runs are held against the trial's readings. What is done
is kept: the same call goes on where it was interrupted.
"""

# %%
# Four runs with coarse particles and a quick nozzle; a study has dozens, and finer ones.
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import sealtwin as st

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "paper-trial"
U, D_CM = [3, 300], [0.03, 0.6]
fixed = {"solver.radius_mm": 0.75, "solver.settle_s": 0.0, "path.speed_mm_s": 20.0, "fluid.freeze_after_s": 0.5}

with tempfile.TemporaryDirectory() as folder:
    swept = st.sweep(
        FIXTURE / "trial.toml", {"fluid.U": U, "fluid.D_cm": D_CM}, out=Path(folder, "study"), fixed=fixed, jobs=1
    )
    # The page has levels, a map of the error, influences and cost; its figures lie beside it as SVG and CSV.
    # Particles as coarse as these do not keep the volume, which bars a run from every ranking unless one asks for it.
    page = st.write_map(swept, any_volume=True)
    print(page.name, sorted(file.name for file in page.parent.iterdir()))

# %%
# One row for each run: its settings and its figures, units in the names.
for row in swept.rows:
    print(f"U = {row['fluid.U']:g}, D = {row['fluid.D_cm']:g} cm: mean error {row['mean_error_mm']:.2f} mm")
if swept.best is not None:
    print("nearest to the readings:", swept.best["settings"])

# %%
# The same as a picture. The first setting varies slowest.
error_mm = swept.column("mean_error_mm").reshape(len(U), len(D_CM))
figure, ax = plt.subplots(layout="constrained")
image = ax.imshow(error_mm, origin="lower", cmap="viridis")
ax.set_xticks(range(len(D_CM)), [f"{value:g}" for value in D_CM])
ax.set_yticks(range(len(U)), [f"{value:g}" for value in U])
ax.set(xlabel="D (cm)", ylabel="U")
figure.colorbar(image, label="mean error (mm)")
