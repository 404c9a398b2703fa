"""Runs side by side: what differs, and when replicates may be compared as distributions."""

from dataclasses import replace
from typing import Any

import pytest

from sealtwin.records import Profile
from tests.charts import S_MM, line, make_readings
from validate.studies.sheet import write_sheet_of_figures
from validate.studies.side_by_side import Side, differing, replicate_words, side_by_side

METRICS = {
    "mean_error_mm": 0.5,
    "bias_mm": 0.5,
    "rmse_mm": 0.5,
    "worst_error_mm": 0.5,
    "worst_at_mm": 3.0,
    "share_under_1_mm": 1.0,
    "flat_level_error_mm": 4.0,
    "beats_flat_level": True,
    "role": "held-out",
    "readings_data": "measured",
}


def side(name: str, above_mm: float, *, sheet: str = "a", lowered_mm: float = 0.0, settings: Any = ()) -> Side:
    """A run that stands ``above_mm`` too high, its readings ``lowered_mm`` lower than the others'."""
    readings = make_readings()
    readings = replace(readings, level_mm=readings.level_mm - lowered_mm)
    profile = Profile(S_MM, line(S_MM) - lowered_mm + above_mm)
    return Side(name, {"fluid.U": 30.0, **dict(settings)}, profile, readings, sheet, METRICS, {"particles": 100}, "one")


def test_only_settings_that_differ_are_told():
    first, second = side("a", 0.1), side("b", 0.2, settings={"fluid.U": 3.0, "solver.settle_s": 1.0})
    assert differing([first, second]) == {"fluid.U": [30.0, 3.0], "solver.settle_s": [None, 1.0]}
    assert differing([first, first]) == {}


def test_replicates_give_the_distance_of_their_mean_levels():
    """Measured means 0 and -1 mm apart, simulated 0.5 mm above each: the distributions are 0.5 mm apart, exactly."""
    (told,) = replicate_words([side("a", 0.5), side("b", 0.5, sheet="b", lowered_mm=1.0)])
    assert told == "Area validation metric of the mean level over 2 replicates (a, b): 0.500 mm."


@pytest.mark.parametrize("others", [[], [side("b", 0.5)], [replace(side("b", 0.5, sheet="b"), replicate_of="two")]])
def test_one_sheet_or_other_settings_are_no_replicates(others):
    """One alone, the same readings twice, and another trial: each has no distribution."""
    (told,) = replicate_words([side("a", 0.5), *others])
    assert told.startswith("No area validation metric")


def test_no_run_is_called_nearest_over_different_readings(tmp_path):
    same = side_by_side([side("a", 0.5), side("b", 0.2)])
    assert "Nearest is a" in same.finding
    apart = side_by_side([side("a", 0.5), side("b", 0.2, sheet="b")])
    assert "no one of them is the nearest" in apart.finding
    written = write_sheet_of_figures(tmp_path, "compare.html", apart)
    assert {"figures/levels.svg", "figures/errors.svg", "figures/held-out.csv"} <= set(written)
    assert "0.50 mm" in (tmp_path / "compare.html").read_text(encoding="utf-8")


def test_runs_of_any_name_and_number_have_room(tmp_path):
    """28 runs, names of 80 emoji: figures have letters, the page the names. A collapsed figure warns, and fails."""
    sides = [side("🛣" * 80 + str(number), 0.1, sheet=str(number)) for number in range(28)]
    write_sheet_of_figures(tmp_path, "compare.html", side_by_side(sides))
    assert "🛣" * 80 + "27" in (tmp_path / "compare.html").read_text(encoding="utf-8")
    assert "🛣" not in (tmp_path / "figures" / "levels.svg").read_text(encoding="utf-8")
