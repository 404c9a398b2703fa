"""A paste that stiffens below 1/s: does `sealtwin material rheometer` name the rows that it leaves out?"""

import subprocess
import sys
from pathlib import Path

import numpy as np

rate = np.geomspace(80, 0.02, 19)
stress = 15.5 + 0.382 * rate**1.35 + np.where(rate < 1, 23.2 * np.log(rate) / np.log(0.02), 0.0)
np.savetxt("curve.csv", np.column_stack([rate, stress]), "%.4g", ",", header="shear_rate_per_s,stress_pa", comments="")
command = [sys.executable, "-m", "sealtwin", "material", "rheometer", "curve.csv", "--density-kg-m3", "1690"]
answer = subprocess.run([*command, "--data", "synthetic"], capture_output=True, text=True, check=True).stdout
lines = [line for line in answer.splitlines() if "2.5 times" in line and line in Path("material.toml").read_text()]
print(f"said: {lines[0]}" if lines else "silent: a stress 2.5 times the law's at 0.02 /s is left out, and not named")
