"""The page of runs side by side."""

import csv
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.comparison_sides import compared, side
from validate.figures.compare_page import SAME_MM, compare_page, first_with_readings, held_out_mean_mm, nearest
from validate.figures.page import FigureTable, write_page


def test_runs_go_by_numbers_whose_names_the_first_table_has(tmp_path):
    """28 runs, names of 80 emoji: no table has a name in its head. A collapsed figure warns, and fails."""
    sides = [side("🛣" * 80 + str(number), 0.1, lowered_mm=0.1 * number) for number in range(28)]
    sheet = compare_page(sides)
    first, *others = [item for part in sheet.sections for item in part.items if isinstance(item, FigureTable)]
    assert [row[0] for row in first.rows] == [str(number) for number in range(1, 29)]
    assert [row[-1] for row in first.rows] == [each.name for each in sides]
    assert [list(grid.head[1:3]) for grid in others if len(grid.head) > len(sides)] != []
    assert all(list(grid.head[1:3]) == ["1", "2"] for grid in others if len(grid.head) > len(sides))
    assert not any("🛣" in name for grid in others for name in grid.head)
    write_page(tmp_path / "compare.html", sheet)
    assert (tmp_path / "compare.html").read_text(encoding="utf-8").count("🛣" * 80 + "27") == 1
    assert "🛣" not in (tmp_path / "figures" / "levels.svg").read_text(encoding="utf-8")
    with (tmp_path / "figures" / "figures.csv").open(encoding="utf-8", newline="") as file:
        assert next(csv.reader(file))[28] == "28 " + sides[27].name


def test_what_was_edited_and_never_measured_is_said_first():
    made_up = replace(side("b", 0.5, data="reconstructed"), edited=["profile.csv"])
    kinds, edits = compare_page([side("a", 0.5), made_up]).cautions
    assert "reconstructed" in kinds
    assert "run 2, because files were edited" in edits
    assert "profile.csv" in edits
    assert compare_page([side("a", 0.5), side("b", 0.7)]).cautions == []


def test_what_one_run_was_tuned_on_is_held_out_from_none():
    """Whoever set the role: the same numbers were seen."""
    tuned = replace(side("a", 0.5), comparison=compared(role="calibrated-on"))
    (caution,) = compare_page([tuned, side("b", 0.7), side("c", 0.7, lowered_mm=1.0)]).cautions
    assert "the readings of run 2 were used to calibrate run 1." in caution


@pytest.mark.parametrize("marred", [{"volume_ratio": 1.051}, {"edited": ["profile.csv"]}], ids=["volume", "edited"])
def test_a_run_whose_volume_is_off_or_that_was_edited_is_in_no_ranking(marred):
    """It is the nearer one of the two; it is neither the nearest nor in the mean over held-out trials."""
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


def test_held_out_trials_alone_make_the_mean():
    trials = [("calibrated-on", 0.2), ("held-out", 1.0), ("held-out", 2.0)]
    sides = [replace(side("a", 0.1), comparison=compared(role=role, mean_error_mm=mm)) for role, mm in trials]
    assert held_out_mean_mm(sides) == pytest.approx(1.5)
    assert held_out_mean_mm(sides[:1]) is None


def held_out_words(sheet):
    (part,) = [part for part in sheet.sections if part.title == "Held out"]
    return part.items


def test_runs_that_leaked_or_have_another_volume_are_named():
    """In one sentence. To the digits that are shown: 1.0504 is 1.050, which is sound."""
    ratios = (1.0, 1.48, 1.0504, 1.66, 0.949)
    sheet = compare_page([replace(side(f"{k}", 0.5), volume_ratio=ratio) for k, ratio in enumerate(ratios)])
    (sentence,) = sheet.cautions
    assert [f"run {number}," in sentence for number in range(1, 6)] == [False, True, False, True, True]
    assert "1.660 of the dispensed volume settled (0.95 to 1.05" in sentence
    leaking = [replace(side(name, 0.5), escaped_particles=2) for name in "bc"]
    (sentence,) = compare_page([side("a", 0.5), *leaking]).cautions
    assert "run 2, because particles went through a wall; run 3, because particles" in sentence


NEAR = compared(mean_error_mm=0.2)


def test_the_same_numbers_are_the_same_readings_whatever_sheet_holds_them():
    """Copied in inches and back they move by rounding; taken again, by more than a caliper's last digit."""
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
