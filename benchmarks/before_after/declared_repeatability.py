"""Repeats that scatter by 0.15 mm beside a declared repeatability of 5 mm, which is not used: a finding must say so.

Of true declarations at most 1 in 100 may be called contradicted. The finding must stand in the answers of ``run`` and
``validate`` too, where the fast model allows no verdict.
"""

import json
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
s_mm = np.linspace(0.0, 79.0, 17)
bed_mm = -6.0 + 2.0 * np.cos(s_mm / 20.0)
random = np.random.default_rng(0)


def told(declared_mm: float, count: int) -> list[str]:
    """Return the findings on a declared repeatability over a number of sheets."""
    sentences = list[str]()
    for _ in range(count):
        repeats_mm = bed_mm[:, None] + 0.15 * random.standard_normal((17, 3))
        readings = st.read_readings(np.column_stack([s_mm, repeats_mm]), data="measured", role="held-out")
        declared = {"repeatability_mm": declared_mm, "pass_mm": 0.0}
        try:
            result = st.compare(Profile(s_mm, bed_mm), readings, crack, solid, uncertainty=declared)
        except st.InputError:
            continue  # A sheet that contradicts the declared passes or a scatter that is too small.
        found = result.uncertainty
        sentences += [one for one in (found.sentences if found else ()) if "repeatability_mm" in one]
    return sentences


def answers() -> dict[str, str]:
    """Return what the commands say of a trial of the fast model that declares 5 mm."""
    fixture, said = Path("fixtures/paper-trial").resolve(), dict[str, str]()
    text = (fixture / "trial.toml").read_text(encoding="utf-8")
    text = text.replace('preset = "accurate"', 'model = "slot"').replace("radius_mm = 0.4\n", "")
    text = text.replace("[uncertainty]", "[uncertainty]\nrepeatability_mm = 5.0\npass_mm = 0.0")
    for name in ("photo.jpg", "caliper.csv"):
        text = text.replace(f'"{name}"', f'"{fixture / name}"')
    with tempfile.TemporaryDirectory() as place:
        trial, run = Path(place, "trial.toml"), Path(place, "run")
        trial.write_text(text, encoding="utf-8")
        for words in (["run", trial, "--out", run], ["validate", run]):
            for more in ([], ["--quiet"], ["--json"], ["--json", "--quiet"]):
                command = [sys.executable, "-m", "sealtwin", *map(str, words), *more]
                done = subprocess.run(command, capture_output=True, text=True, check=True)
                said[" ".join([str(words[0]), *more])] = done.stdout
    return said


true, large = told(0.15, 60), told(5.0, 20)
silent = [name for name, text in answers().items() if text.count("repeatability_mm = 5 is not used") != 1]
line = f"of 60 true declarations {len(true)} are called contradicted, of 20 of 5 mm {len(large)}. {(large or [''])[0]} "
line += f"Not said by: {', '.join(silent)}." if silent else "Said by run and validate, with --quiet and --json too."
print(json.dumps({"line": line, "sound": len(true) <= 3 and len(large) >= 19 and not silent}))
