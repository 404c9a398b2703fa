"""The paper's claims, measured on a study whose errors are known."""

from dataclasses import replace

import numpy as np
import pytest

from reports.reproduction.claims import findings, reach_of_drag, stages
from reports.reproduction.redrawn import SETS, errors_against, redraw
from reports.reproduction.surface import Along, Surface, surface_of, surfaces_of
from reports.reproduction.unequal import by_sampling, careless_error_mm
from tests.charts import BEST, make_chart
from validate.metrics.curve_distances import Difference

U, D_CM = (np.ravel(each) for each in np.meshgrid([0.01, 0.1, 1.0, 10.0, 100.0, 1000.0], [1e-4, 1e-3, 0.3, 3.0]))


def as_the_paper_has_it() -> Surface:
    """Level to U = 1, 0.5 mm a power of ten down to 100, 0.1 up; D takes 0.4 mm between 1 and 100 alone."""
    of_u = np.interp(np.log10(U), (-2, 0, 2, 3), (2.5, 2.5, 1.5, 1.6))
    of_d = np.where((U > 1) & (U < 100) & (D_CM >= 0.3), -0.4, 0.0)
    return Surface(U, D_CM, of_u + of_d, Along(1.26, 0.75, 0.75, 5.0, 0.0))


def test_stages_and_reach_are_those_that_were_put_in():
    """Means over D take half of what D does: at U = 10 that is 0.2 mm, which tilts no line through 1, 10 and 100."""
    surface = as_the_paper_has_it()
    assert stages(surface) == pytest.approx((0.0, -0.5, 0.1), abs=1e-9)
    assert reach_of_drag(surface) == pytest.approx((0.0, -0.4, 0.0), abs=1e-9)


def judged(surface: Surface, redrawn: list[Surface]) -> dict[str, str]:
    return {found.name.split(",")[0]: found.judgement for found in findings(surface, redrawn)}


def test_a_shape_agrees_where_it_holds_and_disagrees_where_it_is_turned_round():
    surface = as_the_paper_has_it()
    shapes = judged(surface, [surface])
    assert (shapes["three stages of U"], shapes["reach of D"]) == ("agrees", "agrees")
    upside_down = replace(surface, error_mm=4.0 - surface.error_mm)
    turned = judged(upside_down, [upside_down])
    assert (turned["three stages of U"], turned["reach of D"]) == ("disagrees", "disagrees")


def test_a_shape_that_hangs_on_the_readings_is_open():
    """At 94 of 100 sets it does not agree; at 5 of 100, or where the readings as they are differ, it is not wrong."""
    surface = as_the_paper_has_it()
    upside_down = replace(surface, error_mm=4.0 - surface.error_mm)

    def stages_of_u(as_they_are: Surface, holding: int) -> str:
        return judged(as_they_are, [surface] * holding + [upside_down] * (100 - holding))["three stages of U"]

    assert [stages_of_u(surface, holding) for holding in (95, 94, 5, 0)] == ["agrees", "open", "open", "open"]
    found = [stages_of_u(upside_down, holding) for holding in (100, 94, 5, 4)]
    assert found == ["open", "open", "open", "disagrees"]


def test_a_number_is_judged_by_what_the_table_shows():
    """75 % against redrawn shares of 35 to 72 % disagrees: there is no tolerance beside the table.

    5 mm, which the paper gives in whole millimetres, is in 5.1 to 6.1 as it is in 5 to 6.
    """
    surface = as_the_paper_has_it()

    def shown(start: str, low: float, high: float) -> tuple[str, str]:
        key = {"length with": "share_under_1_mm", "largest error along": "worst_mm"}[start]
        values = np.linspace(low, high, 1001)
        redrawn = [replace(surface, chosen=replace(surface.chosen, **{key: float(value)})) for value in values]
        (found,) = [each for each in findings(surface, redrawn) if each.name.startswith(start)]
        return found.redrawn, found.judgement

    # The middle 95 of 100 of an even spread leave out a 40th at each end.
    assert shown("length with", 0.34, 0.73) == ("35 to 72 %", "disagrees")
    assert shown("length with", 0.34, 0.77) == ("35 to 76 %", "open")
    assert shown("largest error along", 5.1, 6.1) == ("5 to 6 mm", "open")
    assert shown("largest error along", 5.6, 6.6) == ("6 to 7 mm", "disagrees")


def test_a_number_is_open_within_what_redrawn_readings_give():
    """The paper's 1.26 mm against redrawn means about 1.3 mm, and about 2."""
    surface = as_the_paper_has_it()

    def chosen(centre_mm):
        values = np.linspace(centre_mm - 0.1, centre_mm + 0.1, 41)
        redrawn = [replace(surface, chosen=replace(surface.chosen, mean_mm=float(value))) for value in values]
        (found,) = [each for each in findings(surface, redrawn) if each.name.startswith("mean error of the chosen")]
        return found

    assert chosen(1.3).judgement == "open"
    assert chosen(2.0).judgement == "disagrees"
    assert chosen(1.3).redrawn == "1.21 to 1.40 mm"  # 2.5 and 97.5 of 100 of an even spread


def test_redrawn_readings_scatter_as_prose_leaves_open():
    """Plateau at 60 mm: 0.5 mm of the corners, each weighing half there, and 0.15 / sqrt(3) of the caliper: 0.36 mm.

    500 draws know a standard deviation to 3 %; three times that are allowed.
    """
    sets = redraw()
    assert len(sets) == SETS
    levels_mm = np.array([readings.level_mm for readings in sets])
    at_60 = int(np.flatnonzero(sets[0].s_mm == 60)[0])
    assert levels_mm[:, at_60].std() == pytest.approx(np.hypot(0.5 / np.sqrt(2), 0.15 / np.sqrt(3)), rel=0.1)
    assert levels_mm[:, at_60].mean() == pytest.approx(1.0, abs=0.06)
    assert levels_mm.min() >= -16.0
    # A second difference knows nothing of the line: what is left is the caliper's, of weights 1, -2, 1.
    around = levels_mm[:, at_60 - 1 : at_60 + 2] @ np.array([1.0, -2.0, 1.0])
    assert around.std() == pytest.approx(np.sqrt(6) * 0.15 / np.sqrt(3), rel=0.1)


def test_errors_against_redrawn_readings_are_exact():
    """As the polylines' own difference has them, one set and one run at a time."""
    chart = make_chart()
    sets = redraw()[:20]
    found_mm = errors_against(chart, sets)
    for readings, row in zip(sets, found_mm, strict=True):
        for run, value_mm in zip(chart.runs[::9], row[::9], strict=True):
            error = Difference(run.profile.s_mm, run.profile.level_mm, readings.s_mm, readings.level_mm)
            assert value_mm == pytest.approx(np.trapezoid(np.abs(error.value), error.x) / error.length_mm, abs=1e-9)


def test_the_chosen_pair_is_measured_against_each_set():
    chart = make_chart()
    assert surface_of(chart).chosen.mean_mm == pytest.approx(0.5, abs=1e-9)
    assert surface_of(chart).pair(surface_of(chart).best) == BEST
    sets = redraw()[:3]
    for surface, row in zip(
        surfaces_of(chart, errors_against(chart, sets), sets), errors_against(chart, sets), strict=True
    ):
        chosen = int(np.flatnonzero((surface.u == BEST[0]) & (surface.d_cm == BEST[1]))[0])
        assert surface.chosen.mean_mm == pytest.approx(row[chosen], abs=1e-9)


def test_the_library_is_right_on_one_grid_and_wrong_on_two():
    """A level that is 0.5 mm too high everywhere: 17 against 17 points say so, more points of the profile do not."""
    chart = make_chart()
    profile, readings = chart.best.profile, chart.readings
    assert careless_error_mm(profile, readings, 17) == pytest.approx(0.5, abs=1e-9)
    assert max(abs(each.error_mm - 0.5) for each in by_sampling(chart.best, readings)[1:3]) > 0.1
