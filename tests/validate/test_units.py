"""Numbers, units and names of settings in words for readers."""

import numpy as np
import pytest

from validate.units import counted, percent, setting_words, signed, words


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (counted(1, "station"), "1 station"),
        (counted(1200, "station"), "1,200 stations"),
        (words("viscosity_pa_s"), "viscosity (Pa s)"),
        (words("structuration_pa_per_s"), "structuration (Pa/s)"),
        (words("D_cm"), "D (cm)"),
        (setting_words(np.bool_(False)), "no"),
        (setting_words(3.24808e-5), "3.24808e-05"),
        (signed(-0.0004, 3), "+0.000"),
        (signed(-0.0006, 3), "-0.001"),
        (percent(0.56), "56.0 %"),
        (percent(0.308, 0), "31 %"),
    ],
)
def test_numbers_and_names_of_settings_are_formatted_for_readers(value, text):
    assert value == text
