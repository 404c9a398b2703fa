"""A plan that one run of particles judged: one run shows no scatter, so its level has no 95 % band."""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

fixture = Path("fixtures/paper-trial").resolve()
trial = f"""name = "short"
photo = {{file = "{fixture / "photo.jpg"}", mm_per_px = 0.1, data = "synthetic", ends_px = [[881, 541], [1093, 413]]}}
crack = {{depth_mm = 16.0, tilt = "vertical"}}
path = {{volume_ml = "cavity", speed_mm_s = 10.0, trim_mm = 2.0}}
fluid = {{viscosity_pa_s = 1.0, yield_stress_pa = 5.0, freeze_after_s = "never"}}
nozzle = {{diameter_mm = 2.4}}
solver = {{radius_mm = 0.7, settle_s = 0.2}}
"""
with tempfile.TemporaryDirectory() as place:
    file, out = Path(place, "trial.toml"), Path(place, "plan")
    file.write_text(trial, encoding="utf-8")
    once = ["--knots", "3", "--verify", "1", "--seeds", "1", "--flow-max-mm3-s", "3000", "--device", "cpu"]
    command = [sys.executable, "-m", "sealtwin", "plan", file, "--out", out, *once, "--json", "--quiet"]
    answer = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
    with (out / "level.csv").open(encoding="utf-8") as table:
        row = next(csv.DictReader(table))
half_mm, ends_mm = answer["band_95_mm"], (row["low_95_mm"], row["high_95_mm"])
line = (
    f"band_95_mm = {half_mm}, in level.csv {row['level_mm']} mm within {ends_mm[0] or 'none'} to {ends_mm[1] or 'none'}"
)
print(json.dumps({"line": line, "sound": half_mm is None and ends_mm == ("", "")}))
