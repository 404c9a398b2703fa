"""The pair of settings that is nearest to the readings, and the pairs that fit equally well."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sealtwin.core.errors import InputError
from tests.support.mapped_study import BEST, D_CM, U, error_mm, make_budget, make_chart, make_readings, make_runs
from validate.figures.chart import (
    HeldRun,
    as_near_as_the_best,
    axes_of,
    chosen_few,
    first_of_each_pair,
    hold,
)


def compare(runs, readings):
    axes = axes_of([run.settings for run in runs])
    return tuple(hold(run, readings, axes) for run in runs), axes


def test_a_constant_offset_of_the_level_is_the_mean_error_and_the_bias():
    """The tolerance of 1e-9 mm is rounding over 400 pieces."""
    chart = make_chart()
    expected = [error_mm(*run.values) for run in chart.runs]
    assert [run.mean_error_mm for run in chart.runs] == pytest.approx(expected, abs=1e-9)
    assert [run.bias_mm for run in chart.runs] == pytest.approx(expected, abs=1e-9)
    assert (chart.best.values, chart.best.share_under_1_mm) == (BEST, 1)


@pytest.mark.parametrize(
    ("readings_mm", "runs_mm", "near"),
    [
        # The mean level is known to 0.07 mm by repeats that scatter by 0.5, and neighbours are 0.1 mm apart. Broken on
        # purpose with other draws for each run, the pairs nearest in D pass for the best.
        (0.5, 0.0, {BEST}),
        # Two runs of 0.05 mm scatter each differ by 0.07 times 1.96 mm in 95 of 100 cases.
        (0.1, 0.05, {(30.0, d_cm) for d_cm in D_CM if error_mm(30.0, d_cm) - 0.5 < 0.139}),
        # With 5 mm no two pairs differ; the limit is a third more than the nearest's error of 0.5 mm.
        (0.1, 5.0, {(u, d_cm) for u in U for d_cm in D_CM if error_mm(u, d_cm) <= 0.5 * 4 / 3}),
    ],
)
def test_setting_pairs_within_the_uncertainty_of_readings_and_runs_fit_equally_well(readings_mm, runs_mm, near):
    """All runs are too high, so an error of the readings changes all of their errors equally."""
    readings = make_readings(scatter_mm=readings_mm)
    compared, _ = compare(make_runs(), readings)
    alike = as_near_as_the_best(compared, readings, make_budget(readings), runs_mm)
    assert {run.values for run, is_near in zip(compared, alike, strict=True) if is_near} == near
    assert 0 < len(near) < len(compared)


def test_setting_pairs_that_fit_equally_well_are_named_with_the_scatter_of_runs():
    chart = make_chart()
    assert "fit equally well: U = 30 and D from 0.01 to 3 cm" in chart.flatness
    assert "0.10 mm (one standard deviation, 1 pair repeated, 4 degrees of freedom)" in chart.flatness
    assert "No pair was repeated" in make_chart(replicates=None, screening="All are drafts.").flatness
    alone = replace(chart, as_near=tuple(run is chart.best for run in chart.runs))
    assert alone.flatness.endswith("no other pair fits equally well.")
    assert chart.exclusion == "All 39 runs of the study are ranked."


def test_runs_with_equal_settings_and_different_seeds_are_replicates():
    """Errors are 0.5 and 0.7 mm, and 1.0, 1.1 and 1.2 mm: sums of squares of 0.02 each, over 3 degrees of freedom."""
    once, twice, third = make_chart().runs[:3]
    again = [_with_error(run, mm) for run, errors in ((once, (0.5, 0.7)), (twice, (1.0, 1.1, 1.2))) for mm in errors]
    firsts, replicates = first_of_each_pair([*again, third])
    assert [run.mean_error_mm for run in firsts] == [0.5, 1.0, third.mean_error_mm]
    assert vars(replicates) == {"runs": 3, "pairs": 2, "scatter_mm": pytest.approx(np.sqrt(0.04 / 3))}
    assert first_of_each_pair(make_chart().runs)[1] is None


def test_copies_of_a_run_are_refused_as_replicates():
    """Broken on purpose, without the refusal, single runs scatter by 0.00 mm and no other pair is as near.

    The fast model has no scatter, since no seed changes it.
    """
    first, other = make_chart().runs[:2]
    copies = [first, replace(first, number=9, settings={**first.settings, "seed": 1}), other]
    with pytest.raises(InputError, match=r"maps: the runs 1 \(seed 0\) and 9 \(seed 1\) .* solver.radius_mm"):
        first_of_each_pair(copies, "maps")
    assert first_of_each_pair(copies, fast=True) == ((first, other), None)


def _with_error(run: HeldRun, error_mm: float) -> HeldRun:
    level_mm = run.profile.level_mm + error_mm - run.mean_error_mm
    return replace(run, mean_error_mm=error_mm, profile=replace(run.profile, level_mm=level_mm))


def test_the_chosen_runs_include_the_corners_of_the_map_and_the_best_run():
    chart = make_chart()
    places = {run.values for run in chosen_few(chart)}
    assert {(U[0], D_CM[0]), (U[-1], D_CM[0]), (U[0], D_CM[-1]), (U[-1], D_CM[-1]), BEST} <= places
    assert len(places) == 9


def rows(*pairs: Any, names: tuple[str, str] = ("fluid.U", "fluid.D_cm")) -> list[dict[str, Any]]:
    return [dict(zip(names, pair, strict=True)) for pair in pairs]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (rows((1, 1), (1, 1), (1, 1)), "none varies"),
        (rows((1, 1), (2, 1), (3, 1)), "1 vary: fluid.U"),
        (rows((1, True), (2, False), (1, False)), "fluid.D_cm = True"),
        (rows((1, 100), (10, 10), (100, 1), (1000, 0.1)), "fluid.U and fluid.D_cm vary together"),
        ([{"a.x": x, "a.y": y, "a.z": z} for x, y, z in ((1, 1, 1), (2, 2, 2), (1, 2, 3))], "3 vary: a.x, a.y, a.z"),
    ],
)
def test_settings_that_do_not_form_a_map_are_refused_in_one_sentence(settings, words):
    with pytest.raises(InputError, match=rf"^[^\n]*{re.escape(words)}[^\n]*$"):
        axes_of(settings)


def test_random_draws_of_settings_are_not_treated_as_a_grid():
    """A line through values with one run each would show noise as an influence."""
    across, _ = axes_of(rows(*[(value, 7 * value % 12) for value in range(12)]))
    assert not across.is_graded(runs=12)
    assert axes_of(rows(*[(first, other) for first in range(6) for other in range(2)]))[0].is_graded(runs=12)
