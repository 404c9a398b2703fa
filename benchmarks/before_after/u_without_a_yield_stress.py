"""U = 100,000 without a yield stress levels like water: no viscosity may be recorded, and Python must warn.

A sweep must say so of its runs, once, though ``--quiet`` hides the narration.
"""

import json
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import sealtwin as st
from tests.fluids import path, slot
from tests.studies import tiny_lab

solid, crack = slot(12.0)
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    run = st.inject(crack, solid, path(crack, 0.05, speed_mm_s=20.0), st.Fluid(U=1e5), solver=st.Solver(radius_mm=0.6))
recorded = run.health.viscosity_pa_s
line = "no viscosity is recorded" if recorded is None else f"{recorded:.0f} Pa s are recorded"
told = [str(one.message) for one in caught if "without a yield stress" in str(one.message)]
line = f"U = 1e5 without a yield stress: {line}; {told[0] if told else 'no warning'}"
with tempfile.TemporaryDirectory() as place:
    study = tiny_lab(Path(place), '[grid]\n"fluid.U" = [300.0, 3000.0]\n')
    words = ["sweep", str(study), "--out", f"{place}/out", "--jobs", "1", "--device", "cpu", "--quiet"]
    done = subprocess.run([sys.executable, "-m", "sealtwin", *words], capture_output=True, text=True, check=True)
swept = [one for one in done.stdout.splitlines() if "without a yield stress" in one]
line += f"; a sweep: {swept[0] if swept else 'nothing'}"
print(json.dumps({"line": line, "sound": recorded is None and len(told) == len(swept) == 1}))
