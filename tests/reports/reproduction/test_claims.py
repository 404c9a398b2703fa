"""The paper's claims, measured on a study whose errors are known."""

from dataclasses import replace

import numpy as np
import pytest

from reports.reproduction.claims import CLAIMS
from reports.reproduction.judging import Finding, judge
from reports.reproduction.redrawn import (
    FIRST_READINGS_MM,
    SETS,
    beginning_at,
    errors_against,
    first_readings,
    redraw,
)
from reports.reproduction.surface import Along, Surface
from reports.reproduction.unequal import by_sampling, careless_error_mm
from tests.charts import make_chart
from validate.metrics.curve_distances import Difference

U, D_CM = (np.ravel(each) for each in np.meshgrid([0.01, 0.1, 1.0, 10.0, 100.0, 1000.0], [1e-4, 1e-3, 0.3, 3.0]))
CHOSEN = Along(1.26, 0.75, 5.0, 0.0, (3.0, 1.2, 0.9, 0.8, 0.7, 0.1, 0.5, 0.6))


def surface_with(error_mm: np.ndarray, chosen: Along = CHOSEN) -> Surface:
    return Surface(U, D_CM, error_mm, error_mm, chosen, error_mm)


def as_the_paper_has_it() -> Surface:
    """Level to U = 1, 0.5 mm a power of ten down to 100, 0.1 up; D takes 0.4 mm between 1 and 100, and wavers above."""
    of_u = np.interp(np.log10(U), (-2, 0, 2, 3), (2.5, 2.5, 1.5, 1.6))
    of_d = np.where((U > 1) & (U < 100) & (D_CM >= 0.3), -0.4, 0.0)
    return surface_with(of_u + of_d + np.where((U > 100) & (D_CM == 0.3), 0.2, 0.0))


def upside_down(surface: Surface) -> Surface:
    return surface_with(4.0 - surface.error_mm, surface.chosen)


def finding(start: str, surface: Surface, draws: list[Surface]) -> Finding:
    """Of the one claim whose name starts so."""
    (claim,) = [each for each in CLAIMS if each.name.startswith(start)]
    return judge(claim, surface, draws)


NUMBERS = {
    "length with": "share_under_1_mm",
    "largest error along": "worst_mm",
    "mean error of the chosen": "mean_mm",
}
OF_THE_MAP = ("three stages of U", "reach of D", "plateau of D", "fluctuation over D")


@pytest.mark.parametrize("name", OF_THE_MAP)
def test_a_shape_agrees_where_it_holds_and_disagrees_where_it_is_turned_round(name):
    surface = as_the_paper_has_it()
    assert finding(name, surface, [surface]).judgement == "agrees"
    turned = upside_down(surface)
    if name == "fluctuation over D":
        turned = surface_with(np.where(U > 100, 2.0, surface.error_mm))
    assert finding(name, turned, [turned]).judgement == "disagrees"
    assert finding(name, surface, [surface, turned]).judgement == "open"


def test_stages_of_u_are_claimed_at_each_d():
    """At three of four D they hold, and so they do in the mean over D: the claim is of every one."""
    surface = as_the_paper_has_it()
    falls_at_once = np.where((D_CM == 3.0) & (U > 100), 1.3, surface.error_mm)
    without = surface_with(falls_at_once)
    mean_mm = np.mean([without.along_u(d_cm)[1] for d_cm in np.unique(D_CM)], axis=0)
    assert mean_mm[-1] > mean_mm[-2]
    stages = finding("three stages", without, [without])
    assert stages.judgement == "disagrees"
    assert stages.ours == "so at 3 of 4 D; not at 3 cm"
    assert stages.redrawn == "agrees at 3, open at 0, disagrees at 1 of 4 D; as seen it holds at 3"
    # Where a draw in ten has them there too, that D is open, and with it the claim.
    draws = [without] * 9 + [surface]
    assert finding("three stages", without, draws).judgement == "open"


def test_a_shape_that_hangs_on_the_readings_is_open():
    """At 94 of 100 sets it does not agree; at 5 of 100, or where the readings as they are differ, it is not wrong."""
    surface, turned = as_the_paper_has_it(), upside_down(as_the_paper_has_it())

    def reach_of_d(as_they_are: Surface, holding: int) -> str:
        return finding("reach of D", as_they_are, [surface] * holding + [turned] * (100 - holding)).judgement

    assert [reach_of_d(surface, holding) for holding in (95, 94, 5, 0)] == ["agrees", "open", "open", "open"]
    judgements = [reach_of_d(turned, holding) for holding in (100, 94, 5, 4)]
    assert judgements == ["open", "open", "open", "disagrees"]


def test_a_number_is_judged_by_what_the_table_shows():
    """75 % against redrawn shares of 35 to 72 % disagrees: there is no tolerance beside the table.

    5 mm, which the paper gives in whole millimetres, is in 5.1 to 6.1 as it is in 5 to 6.
    """
    surface = as_the_paper_has_it()

    def shown(start: str, low: float, high: float) -> tuple[str, str]:
        key = NUMBERS[start]
        values = np.linspace(low, high, 1001)
        redrawn = [replace(surface, chosen=replace(surface.chosen, **{key: float(value)})) for value in values]
        judged = finding(start, surface, redrawn)
        return judged.redrawn, judged.judgement

    # The middle 95 of 100 of an even spread leave out a 40th at each end. The paper has 1.26 mm for the mean.
    assert shown("mean error of the chosen", 1.2, 1.6) == ("1.21 to 1.59 mm", "open")
    assert shown("mean error of the chosen", 1.9, 2.1)[1] == "disagrees"
    assert shown("length with", 0.34, 0.73) == ("35 to 72 %", "disagrees")
    assert shown("length with", 0.34, 0.77) == ("35 to 76 %", "open")
    assert shown("largest error along", 5.1, 6.1) == ("5 to 6 mm", "open")
    assert shown("largest error along", 5.6, 6.6) == ("6 to 7 mm", "disagrees")


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


def test_each_first_reading_is_held_against_the_chosen_pair():
    """Of the line from -16 to -4 mm over 20 mm a bed that begins at -10 is off by a triangle of 6 by 20 mm: 0.75 mm."""
    chart = make_chart()
    s_mm = chart.best.profile.s_mm
    bed = replace(chart.best.profile, level_mm=np.interp(s_mm, (0, 20, 30, 40, 80), (-10, -4, -4, 1, 1)))
    firsts = first_readings(bed, chart.readings)
    assert tuple(each.level_mm for each in firsts) == FIRST_READINGS_MM == tuple(range(-16, -4))
    off_mm = {each.level_mm: (each.error.mean_mm, each.error.worst_mm, each.error.worst_at_mm) for each in firsts}
    assert off_mm[-16] == pytest.approx((0.75, 6.0, 0.0), abs=1e-6)
    assert off_mm[-10][:2] == pytest.approx((0.0, 0.0), abs=1e-6)
    assert off_mm[-5] == pytest.approx((5 * 20 / 2 / 80, 5.0, 0.0), abs=1e-6)
    assert beginning_at(-16, chart.readings).level_mm == pytest.approx(chart.readings.level_mm)


def test_errors_against_redrawn_readings_are_exact():
    """As the polylines' own difference has them, one set and one run at a time."""
    chart = make_chart()
    sets = redraw()[:20]
    found_mm = errors_against(chart.runs, chart.readings, sets)
    for readings, row in zip(sets, found_mm, strict=True):
        for run, value_mm in zip(chart.runs[::9], row[::9], strict=True):
            error = Difference(run.profile.s_mm, run.profile.level_mm, readings.s_mm, readings.level_mm)
            assert value_mm == pytest.approx(np.trapezoid(np.abs(error.value), error.x) / error.length_mm, abs=1e-9)


def test_the_library_is_right_on_one_grid_and_wrong_on_two():
    """A level that is 0.5 mm too high everywhere: 17 against 17 points say so, more points of the profile do not."""
    chart = make_chart()
    profile, readings = chart.best.profile, chart.readings
    assert careless_error_mm(profile, readings, 17) == pytest.approx(0.5, abs=1e-9)
    assert max(abs(each.error_mm - 0.5) for each in by_sampling(chart.best, readings)[1:3]) > 0.1
