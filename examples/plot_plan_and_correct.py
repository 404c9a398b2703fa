"""
Plan and correct
================

Flow and speed along a crack are planned so that it is full and nothing overspills. Then a pump gives a tenth less than
it is asked for; the pour pauses halfway, and the rest is planned from the levels so far. All of it is EMULATED.
"""

# %%
# A trial with a paste that the fast model knows. Coarse particles and 25 mm of the crack keep this page short.
import tempfile
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import tomlkit

import sealtwin as st

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "paper-trial"
given = tomllib.loads((FIXTURE / "trial.toml").read_text(encoding="utf-8"))
trial = {name: given[name] for name in ("name", "crack", "nozzle")}
trial["photo"] = given["photo"] | {"file": str(FIXTURE / "photo.jpg"), "ends_px": [[881.2, 541.1], [1093.6, 413.4]]}
trial["path"] = {"volume_ml": "cavity", "speed_mm_s": 10.0, "trim_mm": 2.0}
trial["fluid"] = {"viscosity_pa_s": 1.0, "yield_stress_pa": 5.0, "freeze_after_s": "never"}
trial["solver"] = {"radius_mm": 0.7, "settle_s": 0.5}
place = tempfile.TemporaryDirectory()
folder = Path(place.name)
(folder / "trial.toml").write_text(tomlkit.dumps(trial), encoding="utf-8")

# %%
# The plan is searched on the fast model and judged by particles, beside two baselines.
coarse = {"knots": 4, "verify": 1, "seeds": 2, "device": "cpu"}
plan = st.plan_flow(folder / "trial.toml", out=folder / "plan", flow_max_mm3_s=3000, **coarse)
for name, one in {"planned": plan.content, **plan.content["baselines"]}.items():
    print(f"{name}: {one['under_mm3']:.0f} mm³ missing below the face, {one['over_mm3']:.0f} mm³ above it")

# %%
# The level that the plan leads to, with its 95 % band.
figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
axes.errorbar(plan.s_mm, plan.level_mm, plan.half_width_mm, ecolor="lightgrey")
axes.set(xlabel="s (mm)", ylabel="level from the face (mm)")

# %%
# Half of the plan, by a pump that gives a tenth less. The fast model stands for the crack and for the sensor.
rows = len(plan.t_s) // 2
flow_mm3_s = np.append(0.9 * plan.flow_mm3_s[: rows - 1], 0.0)
table = np.column_stack([plan.t_s[:rows], plan.position_mm[:rows], flow_mm3_s])
np.savetxt(folder / "half.csv", table, "%.6f", ",", header="t_s,x_mm,y_mm,z_mm,flow_mm3_s", comments="")
half = trial | {"path": {"plan": "half.csv"}, "solver": trial["solver"] | {"model": "slot"}}
paused = st.run_trial(half, source=folder, out=folder / "half")
levels = np.column_stack([paused.level.s_mm, paused.level.level_mm])[paused.level.s_mm <= paused.path.s_mm.max()]

# %%
# The rest of the pour, and the level to which it leads, beside that of the unchanged plan.
rest = st.plan_rest(plan.folder / "trial.toml", levels, out=folder / "rest", flow_max_mm3_s=3000, knots=4)
for name, one in {"as planned": rest.content["unchanged"], "with the rest": rest.content}.items():
    print(f"{name}: {one['under_mm3']:.0f} mm³ missing, {one['over_mm3']:.0f} mm³ above the face")
place.cleanup()
