"""Readings that a parabola meets better than a level with three settings fitted: the headline must say so.

With as many settings as stations it must say that they fit anything, a sweep too, and an empty list is a declaration
too. A station beyond the crack is none that is compared, and a setting named twice is one.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import sealtwin as st
from sealtwin.core.records import Profile

photo = st.read_photo("fixtures/paper-trial/photo.jpg", mm_per_px=0.1)
crack = st.trace_crack(photo, ends_px=[(719, 658), (1403, 259)])
solid = st.build_solid(crack, depth_mm=16)
s_mm = np.linspace(0.0, 75.0, 16)
bed_mm = -8.0 + 6.0 * (s_mm / 75.0 - 1.0) ** 2
repeats_mm = bed_mm[:, None] + 0.1 * np.random.default_rng(0).standard_normal((16, 3))
table = np.column_stack([s_mm, repeats_mm])
SIXTEEN = """fluid.U fluid.D_cm crack.tilt crack.depth_mm crack.wall_angle_deg fluid.yield_stress_pa fluid.density_kg_m3
fluid.freeze_after_s path.volume_ml path.speed_mm_s path.trim_mm nozzle.diameter_mm solver.radius_mm solver.substeps
solver.settle_s seed"""


def headline(*fitted: str) -> tuple[str, ...]:
    readings = st.read_readings(table, crack, solid, data="measured", role="calibrated-on", fitted=fitted)
    return st.compare(Profile(s_mm, bed_mm + 0.6 * np.sign(s_mm - 37.0)), readings, crack, solid).headline


def swept() -> str:
    """Return what a sweep of the fast model says of a trial that declares sixteen settings as fitted."""
    fixture, names = Path("fixtures/paper-trial").resolve(), ", ".join(f'"{name}"' for name in SIXTEEN.split())
    text = (fixture / "trial.toml").read_text(encoding="utf-8").replace("radius_mm = 0.4\n", "")
    within = {'preset = "accurate"': 'model = "slot"', "U = 30.0\nD_cm = 0.3": "viscosity_pa_s = 0.05"}
    for old, new in {**within, "volume_ml = 4.8": 'volume_ml = "cavity"\nfill = 0.6'}.items():
        text = text.replace(old, new)
    for name in ("photo.jpg", "caliper.csv"):
        text = text.replace(f'"{name}"', f'"{fixture / name}"')
    with tempfile.TemporaryDirectory() as place:
        study = Path(place, "study.toml")
        declared = re.sub(r"fitted = \[.*?\]", f"fitted = [{names}]", text, flags=re.DOTALL)
        Path(place, "trial.toml").write_text(declared, encoding="utf-8")
        study.write_text(
            'name = "s"\ntrial = "trial.toml"\n[grid]\n"fluid.yield_stress_pa" = [4.0, 6.0]\n', encoding="utf-8"
        )
        command = [
            sys.executable,
            "-m",
            "sealtwin",
            "sweep",
            str(study),
            "--out",
            f"{place}/out",
            "--jobs",
            "1",
            "--quiet",
        ]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def beyond() -> str:
    """Return the headline of a level that ends before the last of seventeen stations, with sixteen settings fitted."""
    s_mm = np.linspace(0.0, 80.0, 17)
    repeats_mm = -4.0 + 0.1 * np.random.default_rng(0).standard_normal((17, 3))
    how = {"data": "measured", "role": "calibrated-on", "fitted": tuple(SIXTEEN.split())}
    readings = st.read_readings(np.column_stack([s_mm, repeats_mm]), **how)
    return " ".join(st.compare(Profile(np.array([0.0, 79.5]), np.full(2, -4.5)), readings, crack, solid).headline)


def twice() -> bool:
    """Return whether a setting that is named twice is refused."""
    try:
        headline("fluid.U", "fluid.U")
    except st.InputError:
        return True
    return False


three = headline("fluid.U", "fluid.D_cm", "crack.tilt")[1]
sixteen, nothing = headline(*SIXTEEN.split())[1], headline()[2]
sound = "parabola" in three and "no better" in three and "fit any readings exactly" in sixteen
line = f"{three} 16 settings: ...{sixteen[-110:]} None: {nothing}"
counts = {
    "a station beyond the crack": "passes through all 16 stations" in beyond() and "at 16 stations" in beyond(),
    "a setting named twice": twice(),
    "a sweep": "passes through all 16 stations" in swept(),
}
if missed := [name for name, counted in counts.items() if not counted]:
    line += f" Not counted so: {', '.join(missed)}."
print(json.dumps({"line": line, "sound": sound and "not declared" not in nothing and not missed}))
