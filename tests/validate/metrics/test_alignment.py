"""Errors of level by a shift along a slope."""

import numpy as np
import pytest

from sealtwin.core.records import Profile
from validate.metrics.curve_distances import alignment

FINE_MM = np.linspace(0, 80, 401)
SLOPE = 0.25


def test_a_slope_turns_a_shift_into_a_level():
    """Both beds rise by a quarter; readings moved on by 2 mm lie half a millimetre lower at the same place."""
    simulated = Profile(FINE_MM, SLOPE * FINE_MM)
    measured = Profile(np.linspace(0, 80, 17), SLOPE * np.linspace(0, 80, 17))
    rows = {row.shift_mm: row for row in alignment(simulated, measured).shifts}
    assert sorted(rows) == [-2.0, -1.0, 0.0, 1.0, 2.0]
    assert rows[2.0].bias_mm == pytest.approx(0.5)
    assert rows[-2.0].bias_mm == pytest.approx(-0.5)
    assert rows[1.0].mean_error_mm == pytest.approx(0.25)
    assert rows[0.0].mean_error_mm == pytest.approx(0.0, abs=1e-12)
