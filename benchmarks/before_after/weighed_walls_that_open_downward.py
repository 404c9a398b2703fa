"""Water weighed into cracks that open downward by 4 and by 25 degrees: the fit must name that tilt, and its angle."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ANGLE_DEG, STEEP_DEG, DEPTH_MM = 4.0, 25.0, 16.0
LENGTH_MM, WIDTH_MM = 79.55, 3.123  # Of the shipped photo's crack, as traced
FIXTURE = Path("fixtures/paper-trial").resolve()


def digitised(tilt: str, place: Path, angle_deg: float = ANGLE_DEG) -> tuple[int, str, dict]:
    """Exit code, last line on stderr and the weighed cavity of solid.json."""
    slope = np.tan(np.radians(angle_deg))
    rows = []
    for level_mm in (-12.0, -9.0, -6.0, -3.0, 0.0):
        area_mm2 = WIDTH_MM * (DEPTH_MM + level_mm) + slope * (DEPTH_MM**2 - level_mm**2)
        rows.append(f"{LENGTH_MM * area_mm2 / 1e3:.3f},{level_mm:g}")
    place.mkdir()
    (place / "fill.csv").write_text("mass_g,level_mm\n" + "\n".join(rows) + "\n", encoding="utf-8")
    text = (FIXTURE / "trial.toml").read_text(encoding="utf-8").split("[crack]")[0]
    crack = f'tilt = "{tilt}"\ndepth_mm = {DEPTH_MM}\n'
    crack += '[crack.fill]\nfile = "fill.csv"\ndensity_kg_m3 = 1000.0\nsurface_tension_n_m = 0.0\n'
    trial = text.replace('"photo.jpg"', f'"{FIXTURE / "photo.jpg"}"') + f"[crack]\n{crack}[path]\nvolume_ml = 4.8\n"
    (place / "trial.toml").write_text(trial, encoding="utf-8")
    command = [sys.executable, "-m", "sealtwin", "digitise", place / "trial.toml", "--out", place / "run", "--quiet"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    solid = place / "run" / "solid.json"
    weighed = json.loads(solid.read_text(encoding="utf-8"))["weighed"] if solid.is_file() else {}
    return ended.returncode, (ended.stderr.strip().splitlines() or [""])[-1], weighed


with tempfile.TemporaryDirectory() as folder:
    _, _, funnel = digitised("funnel", Path(folder, "funnel"))
    code, fault, undercut = digitised("undercut", Path(folder, "undercut"))
    _, _, steep = digitised("lean", Path(folder, "lean"), STEEP_DEG)
named = any('tilt = "undercut"' in finding for finding in funnel["findings"])
angle_deg = undercut.get("wall_angle_deg", float("nan"))
line = f'as a funnel: {"names undercut" if named else "upright, no tilt named"}; as tilt = "undercut": '
line += f"{angle_deg:.1f} degrees of {ANGLE_DEG:g}" if undercut else f"exit code {code}, {fault[:60]}"
steeply = any("undercut" in finding and f"{STEEP_DEG:.0f}." in finding for finding in steep["findings"])
line += f'; {STEEP_DEG:g} degrees as tilt = "lean": {"" if steeply else "not "}named'
print(json.dumps({"line": line, "sound": named and abs(angle_deg - ANGLE_DEG) < 0.5 and steeply}))
