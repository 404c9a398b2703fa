"""
Calibrate, then hold out
========================

Viscosity and yield stress of a paste are found by the readings of one pour, and predict a second one.
The readings are EMULATED: both pours are runs of a paste that is known here, so that one can look whether it is found.
"""

# %%
# Two pours of one paste, at two speeds. Coarse particles, and a piece of 25 mm of the crack, keep this page short.
import tempfile
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import tomlkit

import sealtwin as st

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "paper-trial"
given = tomllib.loads((FIXTURE / "trial.toml").read_text(encoding="utf-8"))
TRUTH = {"viscosity_pa_s": 1.0, "yield_stress_pa": 8.0}
place = tempfile.TemporaryDirectory()
folder, files = Path(place.name), []
for name, speed_mm_s, role in (("first", 10.0, "calibrated-on"), ("second", 15.0, "held-out")):
    trial = {"name": name, "seed": 7, **{key: given[key] for key in ("crack", "nozzle")}}
    trial["photo"] = given["photo"] | {"file": str(FIXTURE / "photo.jpg"), "ends_px": [[881.2, 541.1], [1093.6, 413.4]]}
    trial["path"] = {"volume_ml": 1.4, "speed_mm_s": speed_mm_s, "trim_mm": 4.0}
    trial["fluid"] = TRUTH | {"freeze_after_s": "never"}
    trial["solver"] = {"radius_mm": 0.7, "settle_s": 0.5}
    poured = st.run_trial(trial, out=folder / f"{name}-truth", source=folder).level
    # A caliper every 2 mm, to 0.1 mm.
    s_mm = np.arange(1.0, poured.s_mm[-1], 2.0)
    read_mm = np.interp(s_mm, poured.s_mm, poured.level_mm) + np.random.default_rng(0).normal(0, 0.1, len(s_mm))
    np.savetxt(folder / f"{name}.csv", np.c_[s_mm, read_mm], "%.2f", ",", header="s_mm,level_mm", comments="")
    trial["readings"] = {"file": f"{name}.csv", "data": "synthetic", "role": role}
    files.append(folder / f"{name}.toml")
    files[-1].write_text(tomlkit.dumps(trial), encoding="utf-8")

# %%
# Forty runs of the first pour, and twelve draws of the posterior in the second.
free = {"fluid.viscosity_pa_s": (0.3, 3.0), "fluid.yield_stress_pa": (2.0, 20.0)}
result = st.calibrate(files[0], free, hold_out=files[1:], out=folder / "calibration")
print(result.content["finding"])
print("identified:", result.identified)

# %%
# The posterior, with the paste that made the readings.
figure, ax = plt.subplots(layout="constrained")
ax.plot(result.posterior["fluid.viscosity_pa_s"], result.posterior["fluid.yield_stress_pa"], "o", alpha=0.3, ms=3)
ax.plot(*TRUTH.values(), "D", label="the paste that was poured")
ax.set(xlabel="viscosity (Pa s)", ylabel="yield stress (Pa)", xlim=(0.3, 3), ylim=(2, 20), xscale="log")
ax.legend()
place.cleanup()
