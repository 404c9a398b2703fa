"""A tip of 2 to 4 mm at 9 and 17 stations, and 5 to 7 stations beside a mound: are the stated intervals held?

Run by itself it prints a line for each case, of 200 draws.
"""

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
random, words = np.random.default_rng(68), []


def held(count: int, tip_mm: float) -> tuple[bool, float]:
    """Return whether the bias is in its interval, and the share of stations whose level is in theirs."""
    s_mm, bed_mm = np.linspace(0, 80, count), pour(random) if tip_mm else MOUND_MM
    below_mm = np.clip(s_mm[:, None] + tip_mm * np.linspace(-0.5, 0.5, 41), 0, 80)
    read_mm = np.interp(below_mm, BED_S_MM, bed_mm).max(axis=1)[:, None] + random.normal(0, 0.15, (count, 3))
    table = {"file": Path("sheet.csv"), "data": "synthetic", "role": "held-out", "probe_mm": tip_mm or None}
    mouth = Mouth(s_mm, 0 * s_mm + 3.1, None)
    measured = Profile(s_mm, read_mm.mean(axis=1), read_mm)
    budget = budget_of(measured, Readings.model_validate(table), Uncertainty(), mouth)
    near = np.abs(measured.level_mm - np.interp(s_mm, BED_S_MM, bed_mm)) <= budget.band_mm
    off_mm = (np.trapezoid(measured.level_mm, s_mm) - np.trapezoid(bed_mm, BED_S_MM)) / 80
    half_mm = budget.mean_mm(Curve.of(s_mm, np.zeros(count), s_mm).weights())
    return bool(abs(off_mm) <= half_mm), float(near.mean())


for count, tip_mm in [(9, 2.0), (9, 3.0), (9, 4.0), (17, 2.0), (17, 3.0), (17, 4.0), (5, 0.0), (6, 0.0), (7, 0.0)]:
    bias, stations = np.mean([held(count, tip_mm) for _ in range(200)], axis=0)
    judged = basis_of(np.linspace(0, 80, count), 0.0, 80.0, 80.0).enough_readings
    right = not judged or (bias >= 0.9 and (0.92 <= stations <= 0.99 or not tip_mm))
    words.append("right" if right else "silent")
    print(f"{tip_mm:g} mm tip, {count} stations: holds {stations:.1%}, bias {bias:.0%}, judged: {judged}")
print(f"{'silent' if 'silent' in words else 'right'}: {words.count('silent')} of 9 cases are not held, and judged")
