"""Where s = 0 lies on both curves is a declared choice; what it costs if one of them is off."""

import numpy as np

from sealtwin.records import Floats, Profile
from validate.comparison.curves import Difference
from validate.comparison.distances import area_between

CHOICE = "s from the first end given, on both curves; neither is shifted to fit the other"
SHIFTS_MM = (-2.0, -1.0, 0.0, 1.0, 2.0)
"""A station is set by hand to a millimetre or two, and the end of a crack is seen no better."""


def shifted_errors_mm(simulated: Profile, measured: Profile) -> list[dict[str, float]]:
    """Mean error and bias with the readings moved along the crack by each of the shifts."""
    rows = []
    for shift_mm in SHIFTS_MM:
        moved_mm = measured.s_mm + shift_mm
        error = Difference(simulated.s_mm, simulated.level_mm, moved_mm, measured.level_mm)
        area_mm2 = area_between(simulated.s_mm, simulated.level_mm, moved_mm, measured.level_mm)
        rows.append({"shift_mm": shift_mm, "mean_error_mm": area_mm2 / error.length_mm, "bias_mm": error.mean()})
    return rows


def station_effect_mm(simulated: Profile, s_mm: Floats, standard_mm: float) -> Floats:
    """What a standard uncertainty of the stations' s does to E at each station, (n,): the slope's share of it."""
    before, after = (np.interp(s_mm + by, simulated.s_mm, simulated.level_mm) for by in (-standard_mm, standard_mm))
    return (after - before) / 2
