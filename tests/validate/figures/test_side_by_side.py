"""Runs side by side: what differs, whose readings are the same, and which is nearest."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.comparison_sides import compared, side
from validate.figures.compare_page import SAME_MM, first_with_readings, nearest

NEAR = compared(mean_error_mm=0.2)


def test_the_same_numbers_are_the_same_readings_whatever_sheet_holds_them():
    """Copied in inches and back they move by rounding; taken again, by more than a caliper's last digit."""
    one: Any = side("a", 0.1)
    in_inches_mm = np.round(one.readings.level_mm / 25.4, 4) * 25.4
    copied = replace(one, readings=replace(one.readings, level_mm=in_inches_mm, source="inches.xlsx", repeats_mm=None))
    again = side("b", 0.1, lowered_mm=2 * SAME_MM)
    fewer = replace(one, readings=replace(one.readings, s_mm=one.readings.s_mm[1:], level_mm=one.readings.level_mm[1:]))
    bare = replace(one, readings=None, comparison=None)
    assert first_with_readings([one, bare, copied, again, fewer, one]) == [0, None, 0, 3, 4, 0]


def test_no_run_is_called_nearest_over_different_readings():
    near = replace(side("b", 0.2), comparison=NEAR)
    bare = replace(near, readings=None, comparison=None)
    assert nearest([bare, side("a", 0.5), near]) == 2
    assert nearest([side("a", 0.5), side("b", 0.2, lowered_mm=1.0)]) is None
    assert nearest([bare, bare]) is None


@pytest.mark.parametrize("marred", [{"edited": ["profile.csv"]}, {"escaped_particles": 1}])
def test_a_run_that_is_not_its_own_any_more_is_not_the_nearest(marred):
    """Nor do its readings keep the others from being compared."""
    near = replace(side("b", 0.2, lowered_mm=1.0), comparison=NEAR, **marred)
    assert nearest([near, side("a", 0.5), side("c", 0.5)]) == 1
    assert nearest([near]) is None
