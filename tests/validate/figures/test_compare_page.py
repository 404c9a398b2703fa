"""The page that compares several runs."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.comparison_sides import compared, side
from validate.figures.compare_page import SAME_MM, compare_page, first_with_readings, nearest


def test_readings_that_were_used_to_calibrate_another_run_give_a_caution():
    """The declared role does not matter, since the numbers are the same."""
    tuned = replace(side("a", 0.5), comparison=compared(role="calibrated-on"))
    (caution,) = compare_page([tuned, side("b", 0.7), side("c", 0.7, lowered_mm=1.0)]).cautions
    assert "the readings of run 2 were used to calibrate run 1." in caution


@pytest.mark.parametrize("marred", [{"volume_ratio": 1.051}, {"edited": ["profile.csv"]}], ids=["volume", "edited"])
def test_a_run_with_a_wrong_volume_or_edited_files_is_not_ranked(marred):
    """It has the smaller error of the two, but is not called nearest and not in the mean over held-out trials."""
    unsound = replace(side("b", 0.2), comparison=compared(mean_error_mm=0.2), **marred)
    sheet = compare_page([side("a", 0.5), unsound])
    assert "Run 1 is nearest" in sheet.finding
    assert ("mean error over held-out trials", "0.50 mm") in sheet.key_figures
    assert "Mean error over the held-out trials: 0.50 mm." in held_out_words(sheet)
    alone = compare_page([unsound])
    assert "nearest to" not in alone.finding
    assert [name for name, _ in alone.key_figures] == ["settings that differ"]
    assert "No held-out run is ranked" in str(held_out_words(alone)[0])
    reason = "1.051 of the dispensed" if "volume_ratio" in marred else "profile.csv"
    assert [part in sheet.cautions[0] for part in ("run 1,", "run 2,", reason)] == [False, True, True]


def held_out_words(sheet):
    (part,) = [part for part in sheet.sections if part.title == "Held out"]
    return part.items


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


def test_no_run_is_called_nearest_if_the_readings_differ():
    near = replace(side("b", 0.2), comparison=NEAR)
    bare = replace(near, readings=None, comparison=None)
    assert nearest([bare, side("a", 0.5), near]) == 2
    assert nearest([side("a", 0.5), side("b", 0.2, lowered_mm=1.0)]) is None
    assert nearest([bare, bare]) is None
