"""Names of the code as a reader's words."""

import numpy as np
import pytest

from validate.units import counted, percent, plain, signed, words


@pytest.mark.parametrize(("number", "text"), [(0, "0 stations"), (1, "1 station"), (1200, "1,200 stations")])
def test_nouns_follow_their_number(number, text):
    assert counted(number, "station") == text


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("frame_s", "frame (s)"),
        ("speed_mm_s", "speed (mm/s)"),
        ("viscosity_pa_s", "viscosity (Pa s)"),
        ("yield_stress_pa", "yield stress (Pa)"),
        ("structuration_pa_per_s", "structuration (Pa/s)"),
        ("damping_per_s", "damping (1/s)"),
        ("D_cm", "D (cm)"),
        ("wall", "wall"),
    ],
)
def test_units_follow_from_the_names(key, text):
    assert words(key) == text


@pytest.mark.parametrize(
    ("value", "text"), [(True, "yes"), (np.bool_(False), "no"), (3.24808e-5, "3.248e-05"), (7, "7"), ("lean", "lean")]
)
def test_values_are_short(value, text):
    assert plain(value) == text


@pytest.mark.parametrize(
    ("number", "text"), [(-0.0004, "+0.000"), (0.0, "+0.000"), (-0.0006, "-0.001"), (1.5, "+1.500")]
)
def test_nothing_has_no_minus(number, text):
    assert signed(number, 3) == text


def test_a_share_is_in_percent():
    assert (percent(0.56), percent(0.308, 0)) == ("56.0 %", "31 %")
