"""The solid of the shipped trial must have the mouth that its photo shows, and its readings a declared state."""

import json
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from sealtwin.core.record_files import read_solid

TRIAL = Path("fixtures/paper-trial/trial.toml")
with tempfile.TemporaryDirectory() as place:
    command = [sys.executable, "-m", "sealtwin", "digitise", TRIAL, "--out", place, "--quiet"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    figures = read_solid(Path(place)).figures
mouth_mm, photo_mm = figures.mouth_width_mm or 0.0, figures.photo_width_mm or 0.0
state = tomllib.loads(TRIAL.read_text(encoding="utf-8"))["readings"].get("state", "not declared")
print(
    json.dumps(
        {
            "line": f"mouth {mouth_mm:.2f} mm, in the photo {photo_mm:.2f} mm; state of the readings: {state}",
            "sound": abs(mouth_mm - photo_mm) < 1e-6 and state == "cured",
        }
    )
)
