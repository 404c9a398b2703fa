"""Runs side by side: what differs, whose readings are the same, and when replicates may be compared."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.sides import compared, side
from validate.figures.compare_page import (
    SAME_MM,
    first_with_readings,
    nearest,
    replicate_words,
)

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


def test_replicates_give_the_distance_of_their_mean_levels_and_copies_are_none():
    """Measured means 0 and -1 mm apart, simulated 0.5 mm above each: the distributions are 0.5 mm apart, exactly.

    Beside a real replicate copies count once. Broken on purpose with every run counted, they weigh twice and the metric
    is 0.333 mm.
    """
    (alone,) = replicate_words([side("a", 0.5), side("b", 0.5, lowered_mm=1.0)])
    assert alone == "Area validation metric of the mean level over 2 replicates (runs 1 and 2): 0.500 mm."
    copies, none = replicate_words([side("a", 0.5), side("b", 0.5)])
    assert copies.startswith("Runs 1 and 2 have the same readings")
    assert none.startswith("No area validation metric")
    copies, metric = replicate_words([side("a", 0.0), side("b", 0.5), side("c", 1.0, lowered_mm=1.0)])
    assert copies.startswith("Runs 1 and 2")
    assert metric.endswith("over 2 replicates (runs 1 and 3): 0.500 mm.")
    for others in ([], [replace(side("b", 0.5, lowered_mm=1.0), replicate_of="two")]):
        (words,) = replicate_words([side("a", 0.5), *others])
        assert words.startswith("No area validation metric"), "one run or other settings are no replicates"


def test_no_run_is_called_nearest_over_different_readings():
    near = replace(side("b", 0.2), comparison=NEAR)
    bare = replace(near, readings=None, comparison=None)
    assert nearest([bare, side("a", 0.5), near]) == 2
    assert nearest([side("a", 0.5), side("b", 0.2, lowered_mm=1.0)]) is None
    assert nearest([bare, bare]) is None


@pytest.mark.parametrize("marred", [{"edited": ["profile.csv"]}, {"escaped_particles": 1}])
def test_a_run_that_is_not_its_own_any_more_is_neither_nearest_nor_a_replicate(marred):
    """Nor do its readings keep the others from being compared."""
    near = replace(side("b", 0.2, lowered_mm=1.0), comparison=NEAR, **marred)
    assert nearest([near, side("a", 0.5), side("c", 0.5)]) == 1
    assert nearest([near]) is None
    (words,) = replicate_words([side("a", 0.5), near])
    assert words.startswith("No area validation metric")
