"""The page that compares several runs."""

from dataclasses import replace
from typing import Any

import numpy as np

from tests.support.comparison_sides import compared, side
from validate.figures.compare_page import SAME_MM, first_with_readings, ranking

NEAR = compared(mean_error_mm=0.2)


def test_equal_numbers_from_another_sheet_count_as_the_same_readings():
    """A copy in inches differs by rounding; repeated readings differ by more than a caliper's last digit."""
    run: Any = side("a", 0.1)
    in_inches_mm = np.round(run.readings.level_mm / 25.4, 4) * 25.4
    copied = replace(run, readings=replace(run.readings, level_mm=in_inches_mm, source="inches.xlsx", repeats_mm=None))
    again = side("b", 0.1, lowered_mm=2 * SAME_MM)
    fewer = replace(
        run,
        readings=replace(run.readings, s_mm=run.readings.s_mm[1:], level_mm=run.readings.level_mm[1:]),
    )
    bare = replace(run, readings=None, comparison=None)
    assert first_with_readings([run, bare, copied, again, fewer, run]) == [0, None, 0, 3, 4, 0]


def test_no_run_is_called_nearest_if_the_readings_or_the_stage_numbers_differ():
    near = replace(side("b", 0.2), comparison=NEAR)
    bare = replace(near, readings=None, comparison=None)
    assert ranking([bare, side("a", 0.5), near]).startswith("Run 3 is nearest")
    assert "different readings" in ranking([side("a", 0.5), side("b", 0.2, lowered_mm=1.0)])
    older = side("b", 0.2, settings={"stage_number.simulate": 1})
    assert "different stage numbers" in ranking([side("a", 0.5, settings={"stage_number.simulate": 2}), older])
