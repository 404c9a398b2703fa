"""A draft of a trial with the paper's U: the viscosity of an accurate run, in larger particles."""

import json
import subprocess
import sys
from pathlib import Path

TRIAL = Path(__file__).parents[2] / "fixtures/paper-trial/trial.toml"
PASTE = ("path.volume_ml=0.5", "fluid.yield_stress_pa=12.0", "fluid.freeze_after_s=never", "output.snapshots_s=[]")
pairs = []
for radius in ("0.4", "auto"):
    for preset in ("accurate", "draft"):
        changes = [part for setting in (*PASTE, f"solver.radius_mm={radius}") for part in ("--set", setting)]
        command = [sys.executable, "-m", "sealtwin", "run", str(TRIAL), *changes, "--preset", preset, "--device", "cpu"]
        subprocess.run([*command, "--quiet", "--out", radius + preset], check=False, stdout=subprocess.DEVNULL)
        run = json.loads(Path(radius + preset, "simulation.json").read_text())
        pairs.append((run["radius_mm"], run["health"]["viscosity_pa_s"]))
right = all(b[0] > 1.2 * a[0] and abs(b[1] / a[1] - 1) < 0.02 for a, b in (pairs[:2], pairs[2:]))
print(f"{'right' if right else 'silent'}: radius in mm, Pa s; accurate, draft, and both at auto: {pairs}")
