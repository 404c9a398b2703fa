"""Validation of the tables [readings], [gate] and [uncertainty]."""

from contextlib import nullcontext
from pathlib import Path

import pytest
from pydantic import ValidationError

from sealtwin.core.errors import InputError
from validate.settings import Gate, Readings, Uncertainty


@pytest.mark.parametrize(("limit", "reason"), [(0, ""), (float("nan"), ""), (float("inf"), ""), (1.6, "two\nlines")])
def test_a_gate_with_an_invalid_limit_or_a_multiline_reason_is_refused(limit, reason):
    with pytest.raises(InputError):
        Gate(mean_error_mm=limit, reason=reason)


@pytest.mark.parametrize(
    ("role", "fitted", "fault"),
    [
        ("calibrated-on", ("fluid.U",), None),
        ("held-out", ("fluid.U",), "calibrated-on"),
        # An empty list declares that nothing was fitted, which needs a declared role.
        ("held-out", (), None),
        ("undeclared", (), 'fitted is empty, but role is "undeclared"'),
        ("calibrated-on", ("fluid.U", "seed", "fluid.U"), r"fluid\.U is listed twice"),
    ],
)
def test_fitted_settings_are_allowed_only_for_readings_of_a_calibration(role, fitted, fault):
    table = {"file": Path("caliper.csv"), "data": "measured", "role": role, "fitted": fitted}
    with nullcontext() if fault is None else pytest.raises(ValidationError, match=fault):
        assert Readings.model_validate(table).fitted == fitted


def test_the_uncertainty_of_a_fitted_width_is_the_default_of_width_mm():
    assert Uncertainty(speed_mm_s=0.1).with_sample(0.02, None).moved == {"speed_mm_s": 0.1, "width_mm": 0.02}
    assert Uncertainty(width_mm=0.5).with_sample(0.02, None).moved == {"width_mm": 0.5}
    assert Uncertainty().with_sample(None, None).moved == {}
