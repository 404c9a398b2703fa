"""
Plan the pour
=============

Flow and speed along a crack are planned so that it is full and nothing overspills. The crack is real; its scale, depth
and sealant are invented.

Photo: detail of "Concrete Crack Segmentation Dataset" by Çağlar Fırat Özgenel (2019),
https://doi.org/10.17632/jwsn7tfbrp.1, `CC BY 4.0 <https://creativecommons.org/licenses/by/4.0/>`_; cropped, and
enlarged three times from a reduced preview.
"""

# %%
# A trial with a paste that the fast model knows. Coarse particles and a third of the crack keep this page short.
import tempfile
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import tomlkit

import sealtwin as st

FIXTURE = Path(__file__).resolve().parents[1] / "fixtures" / "real-crack"
given = tomllib.loads((FIXTURE / "trial.toml").read_text(encoding="utf-8"))
trial = {name: given[name] for name in ("name", "crack", "nozzle")}
trial["photo"] = given["photo"] | {"file": str(FIXTURE / "photo.jpg"), "ends_px": [[150.0, 178.0], [245.0, 156.0]]}
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
place.cleanup()
