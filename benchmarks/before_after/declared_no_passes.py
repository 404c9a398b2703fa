"""Sheets of which an operator read one column 0.3 mm higher, with ``pass_mm = 0`` declared: intervals or a refusal."""

import json

import numpy as np

import sealtwin as st
from sealtwin.core.errors import SealtwinError
from sealtwin.core.records import Profile

photo = st.read_photo("fixtures/paper-trial/photo.jpg", mm_per_px=0.1)
crack = st.trace_crack(photo, ends_px=[(719, 658), (1403, 259)])
solid = st.build_solid(crack, depth_mm=16)
s_mm = np.linspace(0.0, 79.0, 17)
bed_mm = -6.0 + 2.0 * np.cos(s_mm / 20.0)
random = np.random.default_rng(0)


def sheets(off_mm: float, count: int = 60) -> tuple[int, int, str]:
    """Return how many sheets are refused, how many of the others hold the true bias of 0, and a refusal."""
    refusals, covered = list[str](), 0
    for _ in range(count):
        repeats_mm = bed_mm[:, None] + 0.15 * random.standard_normal((17, 3)) + [0.0, 0.0, off_mm]
        readings = st.read_readings(np.column_stack([s_mm, repeats_mm]), data="measured", role="held-out")
        try:
            result = st.compare(Profile(s_mm, bed_mm), readings, crack, solid, uncertainty={"pass_mm": 0.0})
        except SealtwinError as fault:
            refusals.append(str(fault))
            continue
        low_mm, high_mm = result.uncertainty.bias_interval_mm if result.uncertainty else (0.0, 0.0)
        covered += low_mm <= 0.0 <= high_mm
    return len(refusals), covered, refusals[0] if refusals else "none"


(alike, covered, _), (differ, wrong, words) = sheets(0.0), sheets(0.3)
line = (
    f"of 60 true sheets {alike} refused, {covered} of the others hold the bias; of 60 with a column 0.3 mm off "
    f"{differ} refused, {wrong} of the others hold it. {words[:150]}"
)
print(json.dumps({"line": line, "sound": alike <= 3 and differ >= 57 and "uncertainty.pass_mm" in words}))
