"""A tip of 3 mm at 9 stations, and 5 stations beside a mound: do the stated intervals contain the truth?"""

from pathlib import Path

import numpy as np

from benchmarks.reading_faults import BED_S_MM, pour
from sealtwin.core.records import Profile
from validate.metrics.verdict import basis_of
from validate.settings import Readings, Uncertainty
from validate.uncertainty.budget import Curve
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.reading_errors import budget_of

MOUND_MM = 3 * np.exp(-(((BED_S_MM - 70) / 5) ** 2) / 2) - 3 * np.exp(-((BED_S_MM / 5) ** 2) / 2)
holds, random = [], np.random.default_rng(68)
judged = basis_of(np.linspace(0, 80, 5), 0.0, 80.0, 80.0).enough_readings
for count, probe in [(9, {"probe_mm": 3.0}), (5, {})] * 60:
    s_mm, bed_mm = np.linspace(0, 80, count), pour(random) if probe else MOUND_MM
    below_mm = np.clip(s_mm[:, None] + np.linspace(-1.5, 1.5, 41) * len(probe), 0, 80)
    read_mm = np.interp(below_mm, BED_S_MM, bed_mm).max(axis=1)[:, None] + random.normal(0, 0.15, (count, 3))
    sheet = Readings.model_validate({"file": Path("sheet.csv"), "data": "synthetic", "role": "held-out", **probe})
    mouth = Mouth(s_mm, 0 * s_mm + 3.1, None)
    budget = budget_of(measured := Profile(s_mm, read_mm.mean(axis=1), read_mm), sheet, Uncertainty(), mouth)
    near = np.abs(measured.level_mm - np.interp(s_mm, BED_S_MM, bed_mm)) <= budget.band_mm
    off_mm = (np.trapezoid(measured.level_mm, s_mm) - np.trapezoid(bed_mm, BED_S_MM)) / 80
    holds.append((near.mean(), abs(off_mm) <= budget.mean_mm(Curve.of(s_mm, np.zeros(count), s_mm).weights())))
tip, few = np.mean(holds[::2], axis=0)[0], np.mean(holds[1::2], axis=0)[1]
word = "right" if 0.92 <= tip <= 0.99 and (few >= 0.9 or not judged) else "silent"
print(f"{word}: 3 mm tip holds {tip:.0%} of stations; 5 at a mound, judged: {judged}, bias {few:.0%}")
