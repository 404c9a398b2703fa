"""Readings with a zero among levels of -7 mm, from a file and as an array: both must be in doubt."""

import json
import tempfile
from pathlib import Path

import numpy as np

import sealtwin as st

repeats_mm = np.linspace(-12.0, -4.0, 9)[:, None] + 0.05 * np.random.default_rng(0).standard_normal((9, 3))
repeats_mm[5, 1] = 0.0
table = np.round(np.column_stack([np.arange(0.0, 81.0, 10.0), repeats_mm]), 2)
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder, "caliper.csv")
    np.savetxt(file, table, "%.2f", ",", header="s_mm,level_1_mm,level_2_mm,level_3_mm", comments="")
    of_file, of_array = st.read_readings(file).doubts, st.read_readings(table).doubts
line = f"{len(of_file)} doubt from a file, {len(of_array)} from an array {of_array}"
print(json.dumps({"line": line, "sound": len(of_file) == len(of_array) == 1}))
