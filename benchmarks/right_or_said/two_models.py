"""A prediction by particles says neither what the fast model has nor what a flat line of its volume has."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

TRIAL = """
name = "two models"
photo = { file = "crack.png", data = "synthetic", mm_per_px = 0.1, ends_px = [[40, 100], [160, 100]] }
crack = { depth_mm = 8, tilt = "vertical" }
path = { volume_ml = 0.12, speed_mm_s = 8, trim_mm = 1 }
fluid = { viscosity_pa_s = 1, yield_stress_pa = 3, freeze_after_s = "never" }
solver = { radius_mm = 0.36, substeps = 2, settle_s = 0.3 }
uncertainty = { volume_ml = 0.01 }
"""
grain = np.random.default_rng(1).normal(170, 6, (200, 200, 1)).clip(0, 255).astype(np.uint8)
photo = Image.fromarray(np.repeat(grain, 3, axis=2))
ImageDraw.Draw(photo).line([(40, 100), (160, 100)], fill=(40, 40, 40), width=20)
photo.save("crack.png")
Path("trial.toml").write_text(TRIAL, encoding="utf-8")
for words in (["run", "trial.toml", "--out", "run"], ["validate", "run", "--uncertainty"]):
    command = [sys.executable, "-m", "sealtwin", *words, "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
prediction = json.loads(Path("run", "prediction.json").read_text(encoding="utf-8"))
part = [one["place_mm"] for one in prediction["parts"] if "fast model" in one["name"] and one["kind"] == "model"]
lines = [line for line in done.stdout.splitlines() if "fast model" in line and "lying flat" in line]
print(f"right: {part[0]:.2f} mm; {lines[0]}" if part and lines else f"silent: {prediction['mean_level_mm']:.2f} mm")
